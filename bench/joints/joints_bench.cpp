// The network that finds turns of bones from positions of joints.
//   joints_bench fit OUT.safetensors FILE...   from the training splits of data files; steps=N
//   joints_bench measure FILE WEIGHTS.safetensors [SPLIT]
//                                              errors by joint on FILE's test split, as Markdown:
//                                              of the whole way from positions to a motion with the
//                                              network that is part of the program, of copying (no
//                                              bone turns about itself), and of the motion network
//                                              of WEIGHTS
//   joints_bench online FILE [SPLIT]           the same errors of a recording that is solved all at
//                                              once, and frame by frame as it comes
#include <cstdio>
#include <iostream>
#include <string>
#include <vector>

#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/rotation.h"
#include "bench/joints/fit.h"
#include "datasets/importers/joints/follow.h"
#include "datasets/importers/joints/solve.h"
#include "datasets/sampling/windows.h"
#include "nn/models/closed_form_motion.h"
#include "nn/models/motion.h"
#include "nn/weights/bundle.h"
#include "nn/weights/state.h"

namespace restage::bench {
namespace {

using namespace joints_detail;

void say(const std::string& line) { std::cerr << line << std::endl; }

Corpus together(const std::vector<std::string>& files, const std::string& split) {
  Corpus out;
  for (const std::string& file : files) {
    CorpusSource source;
    source.source = file;
    Corpus part = load_corpus(source, split);
    for (Body& body : part.bodies) out.bodies.push_back(std::move(body));
    for (Motion& motion : part.motions) out.motions.push_back(std::move(motion));
  }
  return out;
}

int fit(const std::string& out, const std::vector<std::string>& files, int64_t steps) {
  TurnFitOptions options;
  options.steps = steps;
  const Corpus corpus = together(files, "train");
  const TurnExamples examples(corpus, {}, options.seed);
  TurnNet net{Init{RngKey{options.seed, 0}}};
  fit_turn_net(examples, options, say, net);
  TensorFile weights = to_file(net);
  weights.metadata["made by"] = "joints_bench fit";
  weights.metadata["license"] =
      "From MakeHuman bodies (CC0) and CMU motions: the data used in this project was obtained "
      "from "
      "mocap.cs.cmu.edu. The database was created with funding from NSF EIA-0196217.";
  write_safetensors(out, weights);
  return 0;
}

// ---- measure -----------------------------------------------------------------------------------

/// Angles between turns, degrees: sums by joint, and how many there are.
struct Angles {
  std::array<double, kJoints> sum{};
  double count = 0, millimetres = 0;
  void add(const Rotations& found, const Rotations& truth) {
    for (size_t j = 0; j < kJoints; ++j)
      sum[j] += Quat(found[j]).angularDistance(Quat(truth[j])) * (180 / M_PI);
    count += 1;
  }
  double of(size_t joint) const { return sum[joint] / count; }
  double mean() const {
    double out = 0;
    for (size_t j = 0; j < kJoints; ++j) out += of(j) / kJoints;
    return out;
  }
};

/// What is given of somebody's joints.
struct Given {
  const char* title;
  const char* layout;
  double noise;  ///< metres, standard deviation per coordinate
};

constexpr Given kGiven[] = {{"22 joints", "smpl22", 0},
                            {"and 15 mm of noise", "smpl22", 0.015},
                            {"Human3.6M's 17", "h36m17", 0},
                            {"COCO's 17", "coco17", 0}};

/// Our joints in the order of a layout; what we do not have is not known.
FileFrame in_layout(const Joints& joints, const JointLayout& layout) {
  FileFrame out(layout.count);
  for (size_t i = 0; i < layout.joints.size(); ++i)
    for (size_t j = 0; j < kJoints; ++j)
      if (layout.joints[i] == kJointNames[j]) out[i] = joints[j];
  return out;
}

/// Test people who perform test motions, `frames` frames of each.
void each_performance(const Corpus& corpus,
                      const std::function<void(const std::vector<PosedSkeleton>&)>& f) {
  constexpr size_t kFrames = 120;
  for (size_t m = 0; m < corpus.motions.size(); ++m) {
    const Motion& motion = corpus.motions[m];
    const Body& body = corpus.bodies[m % corpus.bodies.size()];
    std::vector<PosedSkeleton> out;
    for (size_t k = 0; k < std::min(kFrames, motion.frames()); ++k)
      out.push_back(forward_kinematics(body.joints, pose_on(motion, body, k)));
    f(out);
  }
}

/// What a tracker would write of somebody.
JointRecording recorded(const std::vector<PosedSkeleton>& truth, const Given& given, Rng& rng) {
  JointRecording out;
  out.layout = joint_layout(given.layout);
  out.fps = kFps;
  for (const PosedSkeleton& pose : truth) {
    Joints seen = pose.joints;
    for (Vec3& x : seen) x += given.noise * Vec3(rng.normal(), rng.normal(), rng.normal());
    out.frames.push_back(in_layout(seen, out.layout));
  }
  return out;
}

MotionOptions as_it_is() {
  MotionOptions out;
  out.rest.up = Axis::y;
  out.scale = 1;
  out.force = true;
  return out;
}

Angles solved(const Corpus& corpus, const Given& given) {
  Angles out;
  Rng rng(RngKey{7, 0}.fold("noise"));
  double off = 0, places = 0;
  each_performance(corpus, [&](const std::vector<PosedSkeleton>& truth) {
    const JointRecording recording = recorded(truth, given, rng);
    ImportReport report;
    const Motion motion = solve_joints(recording, as_it_is(), report).motion;
    std::vector<Joints> apart;  // the motion stands on a floor of its own
    for (size_t f = 0; f < truth.size(); ++f) {
      Rotations found;
      for (size_t j = 0; j < kJoints; ++j)
        found[j] = motion.global[f][j].cast<double>().toRotationMatrix();
      out.add(found, truth[f].global);
      const Vec3 middle = 0.5 * (motion.rest[kLeftHip] + motion.rest[kRightHip]);
      const Vec3 root = motion.hips[f].cast<double>() + found[0] * (motion.rest[0] - middle);
      const PosedSkeleton posed = forward_kinematics(motion.rest, {to_local(found), root});
      apart.emplace_back();
      for (size_t j = 0; j < kJoints; ++j) apart.back()[j] = posed.joints[j] - truth[f].joints[j];
    }
    double lift = 0;
    for (const Joints& x : apart) lift += x[kPelvis].y() / static_cast<double>(apart.size());
    for (const Joints& frame : apart)
      for (const Vec3& x : frame) off += (x - Vec3(0, lift, 0)).norm(), places += 1;
  });
  out.millimetres = 1e3 * off / places;
  return out;
}

Angles asked(const Corpus& corpus, MotionModel& net, bool steady) {
  constexpr int64_t kWindows = 64;
  WindowConfig config;
  config.frames = 60;
  config.self_share = 1;
  config.mirror = false;
  config.remove_heading = true;
  config.steady_heading = steady;
  const WindowSampler sampler(corpus, config, 1);
  const WindowBatch b = sampler.batch(0, kWindows);
  Context ctx;
  MotionState state;
  const MotionOutput answer = net.forward(
      ctx, {b.input_a, b.input_trans_a, b.rest_b, b.turns, b.uncertainty, b.reframed}, &state);
  const Tensor truth = sixd_to_matrix(reshape(Var(b.sixd_a), {kWindows, 60, kJoints, 6})).value;
  Angles out;
  for (int64_t i = 0; i < kWindows * 60; ++i) {
    Rotations found, right;
    for (size_t j = 0; j < kJoints; ++j) {
      const int64_t at = 9 * (i * kJoints + static_cast<int64_t>(j));
      found[j] = matrix_at(answer.rotations.value.data<float>() + at).cast<double>();
      right[j] = matrix_at(truth.data<float>() + at).cast<double>();
    }
    out.add(to_global(found), to_global(right));
  }
  return out;
}

// ---- online ------------------------------------------------------------------------------------

/// The frames behind the first second: all at once, and one by one.
std::pair<Angles, Angles> late_and_online(const Corpus& corpus, const Given& given) {
  constexpr size_t kLearn = 30;
  std::pair<Angles, Angles> out;
  Rng rng(RngKey{7, 0}.fold("noise"));
  each_performance(corpus, [&](const std::vector<PosedSkeleton>& truth) {
    if (truth.size() <= kLearn) return;
    const JointRecording all = recorded(truth, given, rng);
    ImportReport report;
    const Motion motion = solve_joints(all, as_it_is(), report).motion;
    JointRecording first = all;
    first.frames.resize(kLearn);
    JointFollower follower(first, as_it_is(), report);
    for (size_t f = kLearn; f < truth.size(); ++f) {
      Rotations found;
      for (size_t j = 0; j < kJoints; ++j)
        found[j] = motion.global[f][j].cast<double>().toRotationMatrix();
      out.first.add(found, truth[f].global);
      const std::optional<PosedSkeleton> now = follower.next(all.frames[f]);
      if (now) out.second.add(now->global, truth[f].global);
    }
  });
  return out;
}

int measure_online(const std::string& file, const std::string& split) {
  const Corpus corpus = together({file}, split);
  std::printf(
      "| degrees, mean of 22 joints (forearms) | all at once | one by one |\n|---|---:|---:|\n");
  for (const Given& given : kGiven) {
    const auto [late, now] = late_and_online(corpus, given);
    const auto arms = [](const Angles& a) { return 0.5 * (a.of(kLeftElbow) + a.of(kRightElbow)); };
    std::printf("| %s | %.1f (%.1f) | %.1f (%.1f) |\n", given.title, late.mean(), arms(late),
                now.mean(), arms(now));
  }
  return 0;
}

int measure(const std::string& file, const std::string& weights, const std::string& split) {
  const Corpus corpus = together({file}, split);
  std::vector<std::pair<std::string, Angles>> columns;
  for (const Given& given : kGiven) columns.emplace_back(given.title, solved(corpus, given));
  ClosedFormMotion closed({}, {});
  columns.emplace_back("copying", asked(corpus, closed, false));
  const Bundle bundle = load_bundle(weights);
  columns.emplace_back("the paper's network",
                       asked(corpus, bundle.need_as<MotionModel>("motion", weights), false));
  std::string head = "| joint |", line = "|---|";
  for (const auto& [title, angles] : columns) head += " " + title + " |", line += "---:|";
  std::printf("%s\n%s\n", head.c_str(), line.c_str());
  const auto row = [&](const std::string& title, const std::function<double(const Angles&)>& f) {
    std::printf("| %s |", title.c_str());
    for (const auto& [name, angles] : columns) std::printf(" %.1f |", f(angles));
    std::printf("\n");
  };
  for (size_t j = 0; j < kJoints; ++j)
    row(std::string(kJointNames[j]), [j](const Angles& a) { return a.of(j); });
  row("mean", [](const Angles& a) { return a.mean(); });
  row("joints, mm", [](const Angles& a) { return a.millimetres; });
  return 0;
}

}  // namespace
}  // namespace restage::bench

int main(int argc, char** argv) {
  using namespace restage::bench;
  const std::vector<std::string> words(argv + 1, argv + argc);
  try {
    if (words.size() >= 3 && words[0] == "fit") {
      std::vector<std::string> files(words.begin() + 2, words.end());
      int64_t steps = TurnFitOptions{}.steps;
      if (files.back().starts_with("steps=")) {
        steps = std::stoll(files.back().substr(6));
        files.pop_back();
      }
      return fit(words[1], files, steps);
    }
    if (words.size() >= 2 && words[0] == "online")
      return measure_online(words[1], words.size() > 2 ? words[2] : "test");
    if (words.size() >= 3 && words[0] == "measure")
      return measure(words[1], words[2], words.size() > 3 ? words[3] : "test");
  } catch (const restage::InputError& error) {
    std::cerr << error.what() << "\n";
    return 2;
  }
  std::cerr << "joints_bench fit OUT.safetensors FILE... [steps=N] | measure FILE WEIGHTS | online "
               "FILE\n";
  return 2;
}
