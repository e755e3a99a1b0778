#include "experiments/cli/perform/stream_take.h"

#include <filesystem>

#include "autograd/base/output_check.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"
#include "experiments/text.h"

namespace restage::cli {

void check_take(const RetargetCommand& c, const std::string& folder) {
  const std::string& out = c.to.out;
  for (const auto& [given, option] : {std::pair(!c.to.clip_name.empty(), "--clip-name"),
                                      {!c.to.skeleton.empty(), "--skeleton"},
                                      {c.to.animation_only, "--animation-only"}})
    if (given && out.empty())
      throw InputError("", cat(option, " is for the file of --out, and there is none"),
                       "name a file with --out, or leave it out");
  if (out.empty()) return;
  check_sink(c.to);
  if (!text::ends_in(out, {".glb", ".gltf", ".vrm", ".vrma", ".bvh"}))
    throw InputError(out, "is no animation, and a stream is kept as one",
                     "end --out in .glb, .gltf, .vrm, .vrma or .bvh");
  std::vector<std::string> inputs = {c.target};
  if (!c.weights.empty()) inputs.push_back(weights_path(c.weights));
  for (const std::string& more : {c.rest, c.bones})
    if (!more.empty()) inputs.push_back(more);
  check_output(out, inputs);
  std::filesystem::path lies_in = std::filesystem::path(out).parent_path();
  if (lies_in.empty()) lies_in = ".";
  std::error_code error;
  if (!folder.empty() && std::filesystem::equivalent(lies_in, folder, error))
    throw InputError(out, "would lie in the folder from which clouds are read",
                     "write it into another folder");
}

StreamTake::StreamTake(const SinkOptions& options, const Shown& shown, const std::string& clip,
                       const std::string& target, const std::shared_ptr<const GltfOwnRig>& own)
    : out_(options.out), sink_(make_sink(options, shown, std::nullopt, clip, target, own)) {}

void StreamTake::push(const RetargetedFrame& frame) {
  if (fault_) return;
  try {
    sink_.push(frame);
  } catch (...) {
    fault_ = std::current_exception();
    return;
  }
  if (frame.filled) filled_.push_back(frames_);
  ++frames_;
}

void StreamTake::show(const RetargetedFrame& frame, int64_t after) {
  if (frames_ > 0) hold(after - 1);
  push(frame);
  held_.pose = frame.pose;
  held_.filled = true;
  if (frame.confidence) held_.confidence = 0;
  holds_ = 0;
}

void StreamTake::hold(int64_t moments) {
  for (; holds_ < moments && !fault_; ++holds_) push(held_);
}

void StreamTake::finish() {
  if (fault_) std::rethrow_exception(fault_);
  if (frames_ > 0) sink_.commit(filled_);
}

}  // namespace restage::cli
