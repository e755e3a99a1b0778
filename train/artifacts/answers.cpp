#include "train/artifacts/answers.h"

#include <cmath>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "autograd/base/atomic_file.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "autograd/kernels/matmul_precision.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/sha256.h"
#include "nn/weights/safetensors.h"
#include "train/artifacts/artifact_id.h"
#include "train/artifacts/made_once.h"

namespace restage {
namespace {

namespace fs = std::filesystem;

constexpr const char* kWhere = "the skeleton stage";

// Answers as numbers, all in double precision, so that what is read equals what was answered. Each
// frame has 22 rows (joint, rotation, uncertainty), then a row for the sides that are remembered.

constexpr int64_t kJointNumbers = 3 + 9 + 1, kFrame = kJoints * kJointNumbers + 4;

void put(const SeenJoints& seen, double* out) {
  for (size_t j = 0; j < kJoints; ++j, out += kJointNumbers) {
    Eigen::Map<Vec3>(out, 3) = seen.joints[j];
    if (seen.turns) Eigen::Map<Mat3>(out + 3) = (*seen.turns)[j];
    if (seen.uncertainty) out[12] = (*seen.uncertainty)[j];
  }
  Eigen::Map<Vec3>(out, 3) = seen.left.value_or(Vec3::Constant(std::nan("")));
  out[3] = seen.since;
}

SeenJoints get(const double* in, bool turns, bool uncertainty) {
  SeenJoints out;
  if (turns) out.turns.emplace();
  if (uncertainty) out.uncertainty.emplace();
  for (size_t j = 0; j < kJoints; ++j, in += kJointNumbers) {
    out.joints[j] = Eigen::Map<const Vec3>(in, 3);
    if (turns) (*out.turns)[j] = Eigen::Map<const Mat3>(in + 3);
    if (uncertainty) (*out.uncertainty)[j] = in[12];
  }
  if (!std::isnan(in[0])) out.left = Eigen::Map<const Vec3>(in, 3);
  out.since = static_cast<int>(in[3]);
  return out;
}

void put(const std::vector<SeenJoints>& frames, double* out) {
  for (size_t f = 0; f < frames.size(); ++f) put(frames[f], out + f * kFrame);
}

std::vector<SeenJoints> get(const double* in, size_t frames, bool turns, bool uncertainty) {
  std::vector<SeenJoints> out;
  for (size_t f = 0; f < frames; ++f) out.push_back(get(in + f * kFrame, turns, uncertainty));
  return out;
}

// ---- asking ------------------------------------------------------------------------------------

/// Fills the tracks that other processes have asked for. A message holds one track of each process:
/// first whether it has rotations and uncertainties, then its numbers.
void exchange(std::vector<JointTrack>* tracks, size_t frames, Team& team) {
  const auto rank = static_cast<size_t>(team.rank()), size = static_cast<size_t>(team.size());
  for (size_t from = 0; from < tracks->size(); from += size) {
    std::vector<double> mine(2 + frames * kFrame);
    if (from + rank < tracks->size()) {
      const std::vector<SeenJoints>& own = (*tracks)[from + rank].frames;
      mine[0] = own.at(0).turns ? 1 : 0;
      mine[1] = own[0].uncertainty ? 1 : 0;
      put(own, mine.data() + 2);
    }
    const auto all = team.all({mine});
    for (size_t r = 0; r < size && from + r < tracks->size(); ++r)
      (*tracks)[from + r].frames = get(all[r].data() + 2, frames, all[r][0] != 0, all[r][1] != 0);
  }
}

std::vector<JointTrack> asked(const Corpus& corpus, const AnswersConfig& config,
                              const Bundle& given, uint64_t seed, Team& team) {
  JointExtractor extractor(given.need_as<SkeletonModel>("skeleton", kWhere),
                           {.samples = config.views, .any_way_up = config.any_way_up});
  log_info("motion: the extractor is asked about " + std::to_string(config.tracks.sequences) +
           " sequences");
  const auto extract = [&](const Points& cloud, const RngKey& key, const SeenJoints* before) {
    return extractor(cloud, kWhere, key, before);
  };
  std::vector<JointTrack> out;
  try {
    out = make_tracks(corpus, config.tracks, seed, extract, {team.rank(), team.size()});
  } catch (const Interrupted&) {
    team.any(true);
    throw;
  }
  if (team.size() == 1) return out;
  // The signal came to another process of the team.
  if (team.any(false)) throw Interrupted(SIGTERM);
  exchange(&out, static_cast<size_t>(config.tracks.frames), team);
  return out;
}

// ---- a file ------------------------------------------------------------------------------------

std::string sum_of(const TensorFile& file) {
  Sha256 sum;
  for (const auto& [name, t] : file.tensors)
    sum.add(
        {static_cast<const char*>(t.bytes()), static_cast<size_t>(t.numel()) * size_of(t.dtype())});
  return sum.hex();
}

TensorFile to_file(const std::vector<JointTrack>& tracks, const std::string& facts) {
  const auto n = std::ssize(tracks), frames = std::ssize(tracks.at(0).frames);
  Tensor places = Tensor::empty({n, 3}, DType::i64),
         seen = Tensor::zeros({n, frames, kFrame}, DType::f64);
  for (int64_t i = 0; i < n; ++i) {
    const JointTrack& track = tracks[static_cast<size_t>(i)];
    const size_t place[] = {track.body, track.motion, track.first};
    for (int64_t k = 0; k < 3; ++k)
      places.data<int64_t>()[3 * i + k] = static_cast<int64_t>(place[k]);
    put(track.frames, seen.data<double>() + i * frames * kFrame);
  }
  const SeenJoints& first = tracks[0].frames.at(0);
  TensorFile out;
  out.tensors = {{"places", places}, {"seen", seen}};
  out.metadata = {{"turns", first.turns ? "true" : "false"},
                  {"uncertainty", first.uncertainty ? "true" : "false"},
                  {"facts", facts},
                  {"sha256", sum_of(out)}};
  return out;
}

std::vector<JointTrack> from_file(const std::string& path, const std::string& facts,
                                  const Corpus& corpus, const TrackConfig& config) {
  TensorFile file = read_safetensors(path);
  const auto says = [&](const char* name) { return file.metadata[name]; };
  const Tensor &places = file.at("places", path), &seen = file.at("seen", path);
  const Shape wanted{config.sequences, config.frames, kFrame};
  if (says("sha256") != sum_of(file) || says("facts") != facts ||
      places.shape() != Shape{config.sequences, 3} || places.dtype() != DType::i64 ||
      seen.shape() != wanted || seen.dtype() != DType::f64)
    throw InputError(path, "does not fit its checksum", "nothing needs to be done");
  std::vector<JointTrack> out(static_cast<size_t>(config.sequences));
  for (size_t i = 0; i < out.size(); ++i) {
    const int64_t* place = places.data<int64_t>() + 3 * i;
    const auto in = [](int64_t x, int64_t end) { return x >= 0 && x < end; };
    if (!in(place[0], std::ssize(corpus.bodies)) || !in(place[1], std::ssize(corpus.motions)) ||
        !in(place[2], static_cast<int64_t>(corpus.motions[static_cast<size_t>(place[1])].frames()) -
                          config.frames + 1))
      throw InputError(path, "is about somebody who is not in the data",
                       "nothing needs to be done");
    const auto frames = static_cast<size_t>(config.frames);
    out[i] = {static_cast<size_t>(place[0]), static_cast<size_t>(place[1]),
              static_cast<size_t>(place[2]),
              get(seen.data<double>() + i * frames * kFrame, frames, says("turns") == "true",
                  says("uncertainty") == "true")};
  }
  return out;
}

std::optional<std::vector<JointTrack>> find(const std::string& path, const std::string& facts,
                                            const Corpus& corpus, const TrackConfig& config) {
  if (!is_there(path)) return std::nullopt;
  try {
    return from_file(path, facts, corpus, config);
  } catch (const ReadError&) {
    throw;
  } catch (const InputError& error) {
    log_warning("damaged answers are asked for again: " + std::string(error.what()));
    std::error_code ignored;
    fs::remove(path, ignored);
    return std::nullopt;
  }
}

/// Everything that answers depend on, as JSON text.
std::string facts_of(const std::string& data, const std::string& split, const AnswersConfig& config,
                     const Bundle& given, uint64_t seed) {
  const std::string extractor = identity_bytes(given.only({"skeleton"}));
  return nlohmann::json{{"behaviour", kBehaviour},
                        {"data", data},
                        {"split", split},
                        {"answers", keys_text(write_identity(config))},
                        {"extractor", sha256(extractor)},
                        {"precision", static_cast<int>(matmul_precision())},
                        {"seed", seed}}
      .dump();
}

}  // namespace

std::vector<JointTrack> ask(const Corpus& corpus, const std::string& split,
                            const AnswersConfig& config, const Bundle& given, uint64_t seed,
                            const std::optional<AnswerFolder>& folder, Team& team) {
  if (config.tracks.sequences == 0) return {};
  if (!folder) return asked(corpus, config, given, seed, team);
  const std::string facts = facts_of(folder->data, split, config, given, seed);
  const std::string name = "answers-" + short_id(facts),
                    path = (fs::path(folder->path) / (name + ".safetensors")).string();
  return made_once<std::vector<JointTrack>>(
      folder->path, name, [&] { return find(path, facts, corpus, config.tracks); },
      [&](const Lease&) {  // two who make it make the same bytes
        write_safetensors(path, to_file(asked(corpus, config, given, seed, alone()), facts));
      });
}

}  // namespace restage
