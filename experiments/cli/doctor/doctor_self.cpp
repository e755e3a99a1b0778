// restage doctor --self: what works on this machine.
#include <chrono>

#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/base/parallel.h"
#include "autograd/base/shipped.h"
#include "autograd/base/words.h"
#include "autograd/kernels/instruction_sets.h"
#include "autograd/kernels/kernel.h"
#include "datasets/builtin/bodies.h"
#include "datasets/readers/sha256.h"
#include "datasets/sampling/surface.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "infer/retargeter.h"

namespace restage::cli {
namespace {

/// Milliseconds that a frame of 1,000 points takes with these weights, by a body made from a seed.
double frame_time(const Bundle& weights, const std::string& name) {
  constexpr int kWarm = 5, kFrames = 30;
  const Body body = builtin_body(1, "test", 0);
  RetargetOptions options;
  options.force = true;
  Retargeter system(weights, name, body.rest, body.joints, options);
  const Points cloud = SurfaceSampler(body).draw(RngKey{1, 0}, 1000).on_rest(body);
  std::chrono::steady_clock::time_point begun;
  for (int i = 0; i < kWarm + kFrames; ++i) {
    if (i == kWarm) begun = std::chrono::steady_clock::now();
    system.push(cloud, "frame " + std::to_string(i), [](const RetargetedFrame&) {});
  }
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begun)
             .count() /
         kFrames;
}

std::string gpu() {
  try {
    device_of("cuda");
    return "found: device=cuda trains on it";
  } catch (const InputError& error) {
    return error.what();
  }
}

void add_weights(Json& out) {
  try {
    const std::string path = shipped("experiments/weights/standard.safetensors");
    out["weights"] = path;
    if (path.empty()) {
      out["problem"] = "the standard weights are not beside the program; install it again";
      return;
    }
    const std::string sum = sha256_of_file(path);
    out["weights_sha256"] = sum;
    if (sum != RESTAGE_STANDARD_SHA256) {
      out["problem"] =
          path + ": is not the file that this program was built with; install it again";
      return;
    }
    out["frame_ms"] = frame_time(load_bundle(path), path);
  } catch (const Error& error) {
    out["problem"] = error.what();
  }
}

}  // namespace

int run_doctor_self(const Common& common) {
  Json out = {{"version", RESTAGE_VERSION},
              {"program", own_program()},
              {"instructions", instruction_set()},
              {"instructions_here", joined(instruction_sets())},
              {"threads", threads()},
              {"built_with", RESTAGE_BUILT_WITH},
              {"gpu", gpu()}};
  for (const char* name : {"configs", "experiments"}) out[name] = shipped(name);
  add_weights(out);
  std::string text;
  for (const auto& [name, value] : out.items())
    text += name + ": " + (value.is_string() ? value.get<std::string>() : value.dump()) + "\n";
  print(common.json, out, text);
  return out.contains("problem") ? 1 : 0;
}

}  // namespace restage::cli
