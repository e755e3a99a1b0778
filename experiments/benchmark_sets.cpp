#include "experiments/benchmark_sets.h"

#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "autograd/base/log.h"
#include "datasets/benchmark/recipe.h"
#include "datasets/benchmark/sequence.h"
#include "datasets/importers/gltf_character.h"
#include "datasets/schema.h"
#include "experiments/cli/doctor_repair.h"
#include "experiments/cli/eval_world.h"
#include "nn/geometry/closed_form.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using metrics::Track;

/// A folder that goes with its content.
class Scratch {
 public:
  Scratch() {
    std::string name = (fs::temp_directory_path() / "restage-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr)
      throw WorkError(name + ": could not be made; give TMPDIR a folder that you can write to");
    path_ = name;
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  std::string file(const char* name) const { return (path_ / name).string(); }
  std::string folder() const { return path_.string(); }

 private:
  fs::path path_;
};

Track track(const std::vector<double>& values, int64_t frames, int64_t points) {
  return values.empty() ? Track{} : Track{values.data(), frames, points};
}

Joints first_joints(const Prediction& p) {
  Joints out;
  for (size_t j = 0; j < out.size(); ++j) out[j] = Eigen::Map<const Vec3>(&p.joints[3 * j]);
  return out;
}

/// What the target did, as a file of predictions would hold it.
Prediction retargeted(const Bundle& weights, const std::string& folder, const std::string& clouds,
                      uint64_t seed) {
  const auto frames = open_frames(clouds);
  RetargetOptions options;
  options.fps = frames->fps();
  options.seed = seed;
  options.samples = 4;
  const std::string target = (fs::path(folder) / "target.ply").string();
  Retargeter system(weights, "the trial's weights", read_target(target).mesh, target, options);
  Prediction out;
  const auto keep = [&](const auto& points, std::vector<double>* to) {
    for (const auto& p : points)
      for (int c = 0; c < 3; ++c) to->push_back(static_cast<float>(p[c]));  // as in a file
  };
  while (const auto frame = frames->next())
    for (const RetargetedFrame& f : system.push(frame->points, frame->source)) {
      keep(f.joints, &out.joints);
      keep(f.vertices, &out.vertices);
      ++out.frames;
    }
  out.vertex_count = static_cast<int64_t>(system.target().vertices.size());
  return out;
}

/// Scans have a frame of their own: mended by the doctor, and the result put back into the world.
Prediction retargeted_scans(const Bundle& weights, const std::string& folder, uint64_t seed) {
  const std::string source = (fs::path(folder) / "source.h5").string();
  const std::string truth = (fs::path(folder) / "truth.h5").string();
  const Scratch scratch;
  const std::string mended = scratch.file("mended.h5");
  cli::Subject subject;
  subject.path = source;
  subject.frames = open_frames(source);
  subject.stored = inspect(source);
  const Diagnosis diagnosis = examine_frames(*subject.frames);
  subject.frames->rewind();
  cli::write_repaired(subject, mended, diagnosis);
  Prediction out = retargeted(weights, folder, mended, seed);
  const auto to_world = cli::source_to_world(truth);
  if (!to_world)
    throw InputError(truth, "does not say where its scans are", "build the benchmark again");
  Prediction joints = read_prediction(source);
  to_world->carry(joints.joints, false);
  const double stretched = trajectory_scale(
      first_joints(joints), first_joints(read_prediction((fs::path(folder) / "rest.h5").string())));
  const cli::WorldMap map = cli::mended_to_world(mended, *to_world);
  map.carry(out.joints, true, stretched);
  map.carry(out.vertices, true, stretched);
  return out;
}

void judge(const Bundle& weights, const std::string& folder, bool scans, uint64_t seed,
           SystemScores* scores) {
  const Prediction truth = read_prediction((fs::path(folder) / "truth.h5").string());
  scores->frames.push_back(truth.frames);
  try {
    const Prediction pred =
        scans ? retargeted_scans(weights, folder, seed)
              : retargeted(weights, folder, (fs::path(folder) / "source.h5").string(), seed);
    if (pred.frames != truth.frames)
      throw InputError(folder,
                       "gives " + std::to_string(pred.frames) + " frames instead of " +
                           std::to_string(truth.frames),
                       "build the benchmark again");
    const int64_t n = truth.frames;
    const metrics::SequenceView view{track(pred.joints, n, kJoints),
                                     track(truth.joints, n, kJoints),
                                     track(pred.vertices, n, pred.vertex_count),
                                     track(truth.vertices, n, truth.vertex_count), n};
    scores->model.sequences.push_back(metrics::evaluate({&view, 1}).sequences[0]);
  } catch (const InputError& error) {
    log_warning(folder + " is without a result: " + error.what());
    scores->model.sequences.emplace_back(metrics::table().size(), std::nullopt);
  }
}

/// The AMASS-style set, by rule: clip i from body i, to the next body of the circle, then the one
/// after, ... so that all bodies are sources and targets about equally often.
void judge_test_clips(const Bundle& weights, const std::string& folder, uint64_t seed,
                      SystemScores* scores, std::vector<std::string>* names) {
  const Corpus test = load_corpus({.source = folder}, "test");
  const size_t n = test.bodies.size();
  if (n < 2)
    throw InputError(folder, "has one body in its test split, and 'test' retargets to another",
                     "leave the set 'test' out");
  for (size_t i = 0; i < test.motions.size(); ++i) {
    EvalSequence s;
    s.body_a = i % n;
    s.body_b = (i + 1 + i / n % (n - 1)) % n;
    s.motion = i;
    s.frames = test.motions[i].frames();
    const Scratch scratch;
    write_sequence(Performance(test, s, ScanConfig{}, 0), {test.license, test.description},
                   scratch.folder());
    names->push_back(test.motions[i].id + "-" + test.bodies[s.body_a].id + "-" +
                     test.bodies[s.body_b].id);
    judge(weights, scratch.folder(), false, seed, scores);
  }
}

}  // namespace

void check_benchmark_set(const std::string& set) {
  if (set != "test" && set != "naked" && set != "clothed" && set != "scans")
    throw InputError("", "there is no set '" + set + "' in the open benchmark",
                     "use test, naked, clothed or scans");
}

SystemScores evaluate_benchmark_set(const Bundle& weights, const std::string& folder,
                                    const std::string& set, uint64_t seed,
                                    std::vector<std::string>* names) {
  check_benchmark_set(set);
  for (const char* role : {"skeleton", "motion"}) weights.need(role, "the trial");
  SystemScores out;
  if (set == "test") {
    judge_test_clips(weights, folder, seed, &out, names);
  } else {
    std::vector<fs::path> places;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(fs::path(folder) / set, error))
      places.push_back(entry.path());
    if (error || places.empty())
      throw InputError(folder, "has no set '" + set + "'", "build the benchmark again");
    std::sort(places.begin(), places.end());
    for (const fs::path& place : places) {
      names->push_back(place.filename().string());
      judge(weights, place.string(), set == "scans", seed, &out);
    }
  }
  metrics::average(&out.model);
  return out;
}

}  // namespace restage
