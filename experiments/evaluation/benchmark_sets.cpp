#include "experiments/evaluation/benchmark_sets.h"

#include <algorithm>
#include <filesystem>
#include <memory>

#include "autograd/base/atomic_file.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "datasets/benchmark/recipe.h"
#include "datasets/benchmark/sequence.h"
#include "datasets/doctor/mended_file.h"
#include "datasets/importers/rigs/gltf_character.h"
#include "datasets/schema.h"
#include "experiments/evaluation/world_map.h"
#include "experiments/scratch.h"
#include "infer/transfer.h"
#include "nn/geometry/closed_form.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

std::string in(const std::string& folder, const char* file) {
  return (fs::path(folder) / file).string();
}

bool same(const Joints& a, const Joints& b) {
  for (size_t j = 0; j < kJoints; ++j)
    if ((a[j] - b[j]).norm() > 1e-4) return false;
  return true;
}

/// The file with the source's own vertices, frame by frame. A benchmark stores clouds of the
/// sources only; but in its set `naked` everybody who is the source of a motion is the target of
/// the same motion in another sequence, and the truth of that sequence is what the source did.
std::string source_mesh(const std::string& folder) {
  const std::string own = in(folder, "source_mesh.h5");
  if (fs::exists(own)) return own;
  const PredictionFile source(in(folder, "source.h5"));
  const std::vector<Joints> did = joints_of(source.joints());
  std::error_code none;
  for (const auto& entry :
       fs::directory_iterator(fs::path(folder).parent_path().parent_path() / "naked", none)) {
    const std::string path = in(entry.path().string(), "truth.h5");
    if (!fs::exists(path)) continue;
    const PredictionFile truth(path);
    if (truth.data.frames != source.data.frames) continue;
    const std::vector<Joints> there = joints_of(truth.joints());
    if (std::equal(did.begin(), did.end(), there.begin(), there.end(), same)) return path;
  }
  throw InputError(in(folder, "source.h5"),
                   "has clouds, and these weights need the source's vertices, which no sequence of "
                   "the set naked has",
                   "evaluate these weights on the sets test and naked");
}

/// What the target did, as a file of predictions would hold it.
Prediction retargeted(const Bundle& weights, const std::string& folder, const std::string& clouds,
                      const BenchmarkOptions& how) {
  const auto frames = open_frames(needs_correspondence(weights) ? source_mesh(folder) : clouds);
  const SystemType& type = system_type(how.system);
  SystemInput input;
  input.weights = weights;
  input.weights_name = "the trial's weights";
  input.target_name = in(folder, "target.ply");
  input.target = read_target(input.target_name).mesh;
  input.options.fps = frames->fps();
  input.options.seed = how.seed;
  input.options.anchor = how.anchor;
  input.options.steady_bones = how.steady_bones;
  input.options.keep_limbs = how.keep_limbs;
  input.options.any_size = how.any_size;
  input.options.any_way_up = how.any_way_up;
  input.options.force = how.force;
  input.options.lost_seconds = 0;  // every frame of a table counts
  if (type.needs_rest)
    input.rest = joints_of(PredictionFile(in(folder, "rest.h5")).joints().slice(0, 1))[0];
  const auto system = type.make(std::move(input));
  Prediction out;
  const auto keep = [&](const auto& points, std::vector<double>* to) {
    for (const auto& p : points)
      for (int c = 0; c < 3; ++c) to->push_back(static_cast<float>(p[c]));  // as in a file
  };
  const System::Show keep_all = [&](const RetargetedFrame& f) {
    if (f.joints) keep(*f.joints, &out.joints);
    keep(f.vertices, &out.vertices);
    for (const auto& q : quaternions(to_global(f.pose.local)))
      if (f.joints) out.rotations.insert(out.rotations.end(), q.begin(), q.end());
    if (f.confidence) out.confidence.push_back(*f.confidence);
    ++out.frames;
  };
  for (int64_t i = 0; const auto frame = frames->next(); ++i) {
    throw_if_stopped();
    if (i % how.every == 0) system->push(frame->points, frame->source, keep_all);
  }
  system->finish(keep_all);
  out.vertex_count = static_cast<int64_t>(system->target().vertices.size());
  return out;
}

/// Scans have a frame of their own: mended by the doctor, and the result put back into the world.
Prediction retargeted_scans(const Bundle& weights, const std::string& folder,
                            const WorldMap& to_world, const BenchmarkOptions& how) {
  const std::string source = in(folder, "source.h5");
  PredictionFile source_joints(source);
  source_joints.carry(to_world, false);
  const PredictionFile rest(in(folder, "rest.h5"));
  const Scratch scratch;
  const std::string mended = scratch.file("mended.h5");
  Subject subject;
  subject.path = source;
  subject.frames = open_frames(source);
  subject.stored = inspect(source);
  const Diagnosis diagnosis = examine_frames(*subject.frames);
  subject.frames->rewind();
  write_repaired(subject, mended, diagnosis);
  Prediction out = retargeted(weights, folder, mended, how);
  const double stretched = trajectory_scale(joints_of(source_joints.joints().slice(0, 1))[0],
                                            joints_of(rest.joints().slice(0, 1))[0]);
  const WorldMap map = mended_to_world(mended, to_world);
  map.carry(out.joints, true, stretched);
  map.carry(out.vertices, true, stretched);
  map.turn(out.rotations);
  return out;
}

metrics::Values score(const PredictionFile& pred, const PredictionFile& truth,
                      const BenchmarkOptions& how) {
  if (pred.data.frames != truth.data.frames)
    throw InputError(pred.path,
                     "gives " + std::to_string(pred.data.frames) + " frames instead of " +
                         std::to_string(truth.data.frames),
                     "build the benchmark again");
  const auto metrics = metrics_of_every(how.every, how.metrics);
  const auto views =
      cut(truth.data.sequence_offset, pred.joints(), pred.vertices(), pred.data.rotations, truth);
  return metrics::evaluate(views, metrics).sequences[0];
}

/// Frames without joints, or whose joints coincide, say nothing.
void add_frames(const PredictionFile& pred, const PredictionFile& truth, SystemScores* scores) {
  for (int64_t f = 0; f < std::ssize(pred.data.confidence); ++f) {
    const auto error =
        metrics::mean_distance(pred.joints().slice(f, f + 1), truth.joints().slice(f, f + 1),
                               {metrics::Alignment::Mode::frame, true});
    if (!error) continue;
    scores->confidence.push_back(pred.data.confidence[static_cast<size_t>(f)]);
    scores->frame_errors.push_back(*error);
  }
}

void add(References made, References* all) {
  if (all->empty()) {
    *all = std::move(made);
    return;
  }
  for (size_t r = 0; r < all->size(); ++r)
    (*all)[r].second.sequences.push_back(std::move(made[r].second.sequences[0]));
}

/// Who answers, and what is asked for.
struct Judged {
  BenchmarkAnswer answer;
  const BenchmarkOptions& how;
  const Bundle* weights = nullptr;  ///< null: the answers are there already, and must fit
};

void check_definition(const Judged& judged, const PredictionFile& truth) {
  if (judged.weights == nullptr) return;
  const auto roles = system_type(judged.how.system).roles;
  common_definition({{truth.data.definition, truth.path},
                     {joint_definition(judged.weights->only(roles), "weights"), "the system"}},
                    "judge the weights on data with the joints that they were trained on");
}

void no_values(const Judged& judged, SystemScores* scores) {
  scores->model.sequences.emplace_back(judged.how.metrics.size(), std::nullopt);
}

void judge(const Judged& judged, const std::string& folder, const std::string& name, bool scans,
           SystemScores* scores) {
  const BenchmarkOptions& how = judged.how;
  PredictionFile truth(in(folder, "truth.h5")), source(in(folder, "source.h5")),
      rest(in(folder, "rest.h5"));
  check_definition(judged, truth);
  const std::optional<WorldMap> to_world = source_to_world(truth.path);
  if (scans && !to_world)
    throw InputError(truth.path, "does not say where its scans are", "build the benchmark again");
  if (to_world) source.carry(*to_world, false);
  // Frames that a system leaves out are left out of the comparison, so references would be of
  // other frames than those of systems that do not.
  if (how.every == 1)
    add(references(source, rest, truth, truth.data.sequence_offset, how.metrics),
        &scores->references);
  truth.thin(how.every);
  scores->frames.push_back(truth.data.frames);
  try {
    const std::optional<PredictionFile> pred = judged.answer(folder, name);
    if (!pred) return no_values(judged, scores);
    scores->model.sequences.push_back(score(*pred, truth, how));
    scores->joint_errors.push_back(joint_errors(pred->joints(), truth.joints()));
    add_frames(*pred, truth, scores);
  } catch (const InputError& error) {
    if (judged.weights == nullptr) throw;
    log_warning(folder + " is without a result: " + error.what());
    no_values(judged, scores);
  }
}

/// Sequences that are made when they are asked for.
struct MadeSequences {
  Corpus corpus;
  std::vector<EvalSequence> sequences;
};

/// The AMASS-style set, by rule: clip i from body i, to the next body of the circle, then the one
/// after, ... so that all bodies are sources and targets about equally often.
MadeSequences test_clips(const std::string& folder) {
  MadeSequences out{load_corpus({.source = folder}, "test"), {}};
  const size_t n = out.corpus.bodies.size();
  if (n < 2)
    throw InputError(folder, "has one body in its test split, and 'test' retargets to another",
                     "leave the set 'test' out");
  for (size_t i = 0; i < out.corpus.motions.size(); ++i)
    out.sequences.push_back(
        {i % n, (i + 1 + i / n % (n - 1)) % n, i, 0, out.corpus.motions[i].frames()});
  return out;
}

/// Motions that trainings see, on bodies that they see, to bodies that they do not see: up to 16
/// clips, evenly chosen, three seconds from the middle of each (chen2023, Table 1, "seen motions").
MadeSequences seen_motions(const std::string& folder) {
  constexpr size_t kClips = 16, kFrames = 90;
  MadeSequences out{load_corpus({.source = folder}, "train"), {}};
  Corpus& all = out.corpus;
  const size_t trained = all.bodies.size();
  for (Body& body : load_corpus({.source = folder}, "test").bodies)
    all.bodies.push_back(std::move(body));
  const size_t targets = all.bodies.size() - trained, clips = std::min(kClips, all.motions.size());
  for (size_t i = 0; i < clips; ++i) {
    const size_t motion = i * all.motions.size() / clips, length = all.motions[motion].frames();
    const size_t frames = std::min(kFrames, length);
    out.sequences.push_back(
        {i * trained / clips, trained + i % targets, motion, (length - frames) / 2, frames});
  }
  return out;
}

std::string name_of(const Corpus& corpus, const EvalSequence& s) {
  return corpus.motions[s.motion].id + "-" + corpus.bodies[s.body_a].id + "-" +
         corpus.bodies[s.body_b].id;
}

void judge_made(const Judged& judged, const MadeSequences& made, SystemScores* scores,
                std::vector<std::string>* names) {
  const Corpus& corpus = made.corpus;
  for (const EvalSequence& s : made.sequences) {
    const Scratch scratch;
    const Performance performance(corpus, s, ScanConfig{}, 0);
    const FileInfo info{corpus.license, corpus.description};
    write_sequence(performance, info, scratch.folder());
    if (judged.weights != nullptr && needs_correspondence(*judged.weights))
      write_source_mesh(performance, info, scratch.folder());
    names->push_back(name_of(corpus, s));
    judge(judged, scratch.folder(), names->back(), false, scores);
  }
}

/// The folders of a set that lies in files, in order.
std::vector<fs::path> places_of(const std::string& folder, const std::string& set) {
  std::vector<fs::path> places;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(fs::path(folder) / set, error))
    places.push_back(entry.path());
  if (error || places.empty())
    throw InputError(folder, "has no set '" + set + "'", "build the benchmark again");
  std::sort(places.begin(), places.end());
  return places;
}

bool is_made(const std::string& set) { return set == "test" || set == "seen"; }

MadeSequences made_sequences(const std::string& folder, const std::string& set) {
  return set == "test" ? test_clips(folder) : seen_motions(folder);
}

SystemScores judge_set(const Judged& judged, const std::string& folder, const std::string& set,
                       std::vector<std::string>* names) {
  SystemScores out;
  if (is_made(set)) {
    judge_made(judged, made_sequences(folder, set), &out, names);
  } else {
    for (const fs::path& place : places_of(folder, set)) {
      names->push_back(place.filename().string());
      judge(judged, place.string(), names->back(), set == "scans", &out);
    }
  }
  metrics::average(&out.model);
  for (auto& [name, reference] : out.references) metrics::average(&reference);
  return out;
}

}  // namespace

void check_benchmark_set(const std::string& set) {
  if (set != "test" && set != "seen" && set != "naked" && set != "clothed" && set != "scans")
    throw InputError("", "there is no set '" + set + "' in the open benchmark",
                     "use test, seen, naked, clothed or scans");
}

Prediction retarget_sequence(const Bundle& weights, const std::string& folder,
                             const BenchmarkOptions& how) {
  const std::optional<WorldMap> to_world = source_to_world(in(folder, "truth.h5"));
  return to_world ? retargeted_scans(weights, folder, *to_world, how)
                  : retargeted(weights, folder, in(folder, "source.h5"), how);
}

SystemScores evaluate_benchmark_set(const Bundle& weights, const std::string& folder,
                                    const std::string& set, const BenchmarkOptions& how,
                                    std::vector<std::string>* names) {
  check_benchmark_set(set);
  for (const std::string& role : system_type(how.system).roles) weights.need(role, "the trial");
  const BenchmarkAnswer answer = [&](const std::string& sequence, const std::string&) {
    return std::optional(PredictionFile(sequence, retarget_sequence(weights, sequence, how)));
  };
  return judge_set({answer, how, &weights}, folder, set, names);
}

std::vector<BenchmarkSequence> benchmark_sequences(const std::string& folder,
                                                   const std::string& set) {
  check_benchmark_set(set);
  std::vector<BenchmarkSequence> out;
  if (is_made(set)) {
    const MadeSequences made = made_sequences(folder, set);
    for (const EvalSequence& s : made.sequences)
      out.push_back({name_of(made.corpus, s), static_cast<int64_t>(s.frames),
                     std::ssize(made.corpus.bodies[s.body_b].rest.vertices)});
  } else {
    for (const fs::path& place : places_of(folder, set)) {
      const PredictionFile truth(in(place.string(), "truth.h5"));
      out.push_back({place.filename().string(), truth.data.frames, truth.data.vertex_count});
    }
  }
  return out;
}

std::vector<std::string> write_benchmark_sequences(const std::string& folder,
                                                   const std::string& set, const std::string& out,
                                                   bool truth) {
  check_benchmark_set(set);
  if (!is_made(set))
    throw InputError(folder, "has the set '" + set + "' in files already",
                     "take " + (fs::path(folder) / set).string());
  const MadeSequences made = made_sequences(folder, set);
  std::vector<std::string> names;
  for (const EvalSequence& s : made.sequences) {
    throw_if_stopped();
    names.push_back(name_of(made.corpus, s));
    const std::string place = (fs::path(out) / set / names.back()).string();
    make_folder(place);
    write_sequence(Performance(made.corpus, s, ScanConfig{}, 0),
                   {made.corpus.license, made.corpus.description}, place);
    if (!truth) fs::remove(in(place, "truth.h5"));
  }
  return names;
}

SystemScores evaluate_benchmark_answers(const BenchmarkAnswer& answer, const std::string& folder,
                                        const std::string& set,
                                        std::span<const metrics::Metric> metrics,
                                        std::vector<std::string>* names) {
  check_benchmark_set(set);
  BenchmarkOptions how;
  how.metrics = metrics;
  return judge_set({answer, how}, folder, set, names);
}

}  // namespace restage
