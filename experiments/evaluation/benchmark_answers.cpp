#include "experiments/evaluation/benchmark_answers.h"

#include <algorithm>
#include <filesystem>

#include "autograd/base/error.h"
#include "autograd/base/words.h"
#include "datasets/benchmark/manifest.h"
#include "experiments/evaluation/world_map.h"
#include "experiments/text.h"
#include "nn/geometry/closed_form.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

constexpr size_t kNamedAnswers = 3;  // of those that are missing

bool refused(const AnswersAsked& asked, const std::string& set, const std::string& name) {
  return std::find(asked.refused.begin(), asked.refused.end(), set + "/" + name) !=
         asked.refused.end();
}

/// The file or folder of an answer; empty: there is none.
std::string place_of_answer(const std::string& answers, const std::string& set,
                            const std::string& name) {
  const std::string folder = (fs::path(answers) / set / name).string();
  std::error_code ignored;
  if (fs::is_regular_file(folder + ".h5", ignored)) return folder + ".h5";
  return fs::is_directory(folder, ignored) ? folder : "";
}

/// "a, b, c and 13 more"
std::string first_names(const std::vector<std::string>& names) {
  const size_t shown = std::min(names.size(), kNamedAnswers);
  std::string out = joined(std::span(names).first(shown));
  if (names.size() > shown) out += " and " + std::to_string(names.size() - shown) + " more";
  return out;
}

void check_file(const Manifest& manifest, const std::string& folder, const std::string& name) {
  const std::string path = (fs::path(folder) / name).string();
  const auto known = manifest.files.find(name);
  const ManifestFile found = describe_file(path);
  if (known == manifest.files.end() || known->second.sha256 != found.sha256)
    throw InputError(path, "is not what manifest.json says",
                     "build the benchmark again ('restage data verify " + folder + "' lists all)");
}

void check_shape(const PredictionFile& answer, const BenchmarkSequence& wanted) {
  if (answer.data.frames != wanted.frames)
    throw InputError(answer.path,
                     "has " + counted(answer.data.frames, "frame") + ", and the sequence has " +
                         std::to_string(wanted.frames) +
                         (answer.remarks.empty() ? "" : " (" + answer.remarks.front() + ")"),
                     "give one frame of the answer for each of the source");
  if (answer.vertices().present() && answer.data.vertex_count != wanted.vertices)
    throw InputError(answer.path,
                     "has " + counted(answer.data.vertex_count, "vertex", "vertices") +
                         ", and target.ply has " + std::to_string(wanted.vertices),
                     "give the vertices of target.ply, in its order");
}

/// The joints become those that the truth has.
void convert_answer(PredictionFile* answer, const JointDefinition& wanted) {
  JointDefinition& has = answer->data.definition;
  if (answer->data.joints.empty() || has.empty() || has == wanted || wanted.empty()) return;
  JointConversion(has, wanted, answer->path).convert(answer->data.joints);
  has = wanted;
}

/// What was made from mended scans goes to where the truth is, as `restage eval --mended` does it.
void carry_mended(PredictionFile* answer, const std::string& folder, const std::string& mended) {
  const auto in = [&](const char* file) { return (fs::path(folder) / file).string(); };
  const std::optional<WorldMap> to_world = source_to_world(in("truth.h5"));
  if (!to_world)
    throw InputError(mended, "belongs to a sequence whose clouds are in the world already",
                     "remove it, and answer from source.h5");
  PredictionFile source(in("source.h5"));
  source.carry(*to_world, false);
  const PredictionFile rest(in("rest.h5"));
  const double stretched = trajectory_scale(joints_of(source.joints().slice(0, 1))[0],
                                            joints_of(rest.joints().slice(0, 1))[0]);
  answer->carry(mended_to_world(mended, *to_world), true, stretched);
}

}  // namespace

void check_asked(const AnswersAsked& asked) {
  const Manifest manifest = read_manifest(asked.benchmark);
  std::vector<std::string> known;
  for (const std::string& set : asked.sets) {
    for (const BenchmarkSequence& sequence : benchmark_sequences(asked.benchmark, set)) {
      known.push_back(set + "/" + sequence.name);
      if (set == "test" || set == "seen") continue;
      for (const char* file : {"source.h5", "target.ply", "rest.h5", "truth.h5"})
        check_file(manifest, asked.benchmark, known.back() + "/" + file);
    }
    if (set == "test" || set == "seen") check_file(manifest, asked.benchmark, "test.h5");
    if (set == "seen") check_file(manifest, asked.benchmark, "train.h5");
  }
  for (const std::string& name : asked.refused)
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw InputError("", "--refused names '" + name + "', which is no sequence of these sets",
                       "give SET/NAME, such as " + known.front());
}

void check_answers(const std::string& answers, const AnswersAsked& asked) {
  std::vector<std::string> missing;
  size_t all = 0;
  for (const std::string& set : asked.sets)
    for (const BenchmarkSequence& sequence : benchmark_sequences(asked.benchmark, set)) {
      const std::string place = place_of_answer(answers, set, sequence.name);
      const std::string name = set + "/" + sequence.name;
      const bool no_answer = refused(asked, set, sequence.name);
      ++all;
      if (no_answer && !place.empty())
        throw InputError(place, "is an answer to a sequence that --refused names",
                         "remove one of them");
      if (place.empty() && !no_answer) missing.push_back(name + ".h5");
      if (!place.empty()) check_shape(PredictionFile(place), sequence);
    }
  if (!missing.empty())
    throw InputError(answers,
                     "lacks " + std::to_string(missing.size()) + " of " +
                         counted(static_cast<int64_t>(all), "answer") + ": " + first_names(missing),
                     "write them, name them in --refused, or leave sets out with --sets");
}

SystemScores score_answers(const std::string& answers, const AnswersAsked& asked,
                           const std::string& set, std::span<const metrics::Metric> metrics,
                           std::vector<std::string>* names) {
  const auto answer = [&](const std::string& folder, const std::string& name) {
    std::optional<PredictionFile> out;
    if (refused(asked, set, name)) return out;
    out.emplace(place_of_answer(answers, set, name));
    const PredictionFile truth((fs::path(folder) / "truth.h5").string());
    convert_answer(&*out, truth.data.definition);
    const std::string mended = (fs::path(answers) / set / (name + ".mended.h5")).string();
    std::error_code ignored;
    if (fs::exists(mended, ignored)) carry_mended(&*out, folder, mended);
    return out;
  };
  return evaluate_benchmark_answers(answer, asked.benchmark, set, metrics, names);
}

}  // namespace restage
