#include "experiments/reproduce/pictures.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "experiments/evaluation/world_map.h"
#include "experiments/pictures/clips.h"
#include "experiments/sweep/sweep_dir.h"
#include "infer/render/figures.h"
#include "infer/render/sheet.h"

namespace restage::reproduce {
namespace {

namespace fs = std::filesystem;

constexpr int kMoments = 6;  // where the file names none

bool is_there(const std::string& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

/// The trial of a row with the lowest seed.
const tables::TrialResult* trial_of(const tables::Results& results, const std::string& row) {
  const tables::TrialResult* out = nullptr;
  for (const tables::TrialResult& trial : results.trials)
    if (trial.case_name == row && trial.state == tables::TrialState::done &&
        (out == nullptr || trial.seed < out->seed))
      out = &trial;
  return out;
}

/// The sequences of a set on which a trial is farthest off, worst first.
std::vector<std::string> worst_of(const tables::TrialResult& trial, const std::string& set,
                                  size_t count) {
  std::vector<std::pair<double, std::string>> found;
  for (const auto& [name, scores] : trial.sets)
    for (const auto& [sequence, values] : scores.sequences)
      if (const auto value = values.find("pa_mpjpe"); name == set && value != values.end())
        found.emplace_back(-value->second, sequence);
  std::sort(found.begin(), found.end());
  std::vector<std::string> out;
  for (size_t i = 0; i < std::min(count, found.size()); ++i) out.push_back(found[i].second);
  return out;
}

/// Clouds as they were seen, put into the world.
Clip source_of(const std::string& folder) {
  Clip out = read_clip(folder + "/source.h5", "source");
  const auto to_world = source_to_world(folder + "/truth.h5");
  if (!to_world) return out;
  for (Points& frame : out.frames)
    for (Point& p : frame) {
      std::vector<double> place{p.x(), p.y(), p.z()};
      to_world->carry(place, false);
      p = Eigen::Map<const Vec3>(place.data()).cast<float>();
    }
  return out;
}

Clip clip_of(const Prediction& made, const std::vector<Triangle>& faces, const std::string& label) {
  Clip out{label, {}, faces};
  const auto vertices = static_cast<size_t>(made.vertex_count);
  for (size_t f = 0; f < static_cast<size_t>(made.frames); ++f) {
    Points& frame = out.frames.emplace_back(vertices);
    for (size_t v = 0; v < vertices; ++v)
      frame[v] = Eigen::Map<const Vec3>(&made.vertices[3 * (f * vertices + v)]).cast<float>();
  }
  return out;
}

std::vector<size_t> frames_of(const Picture& picture, size_t count) {
  std::vector<size_t> out;
  for (const double seconds : picture.moments)
    out.push_back(std::min(count - 1, static_cast<size_t>(std::lround(seconds * kFps))));
  for (int k = 0; picture.moments.empty() && k < kMoments; ++k)
    out.push_back(static_cast<size_t>(k) * (count - 1) / (kMoments - 1));
  return out;
}

Image sheet(const std::vector<Clip>& clips, const Picture& picture) {
  const size_t last = clips.size() - 1;
  std::vector<Figure> figures;
  for (size_t c = 0; c < clips.size(); ++c)
    for (const size_t frame : frames_of(picture, clips[last].frames.size())) {
      Figure figure;
      const uint32_t colour = kClipColours[c == 0 ? 0 : c == last ? 2 : 1];
      figure.layers = {{clips[c].frames.at(frame), clips[c].faces, colour}};
      figure.caption = clips[c].label + format(", %.2f s", static_cast<double>(frame) / kFps);
      figure.azimuth = picture.azimuth;
      figure.floor = clip_floor(clips[c]);
      figures.push_back(std::move(figure));
    }
  return figure_sheet(figures, {static_cast<int>(figures.size() / clips.size()), 260, "", {}});
}

/// Nothing if a row's weights are not here. InputError if one of the systems cannot do it.
std::optional<Image> drawn(const sweep::SweepDir& dir, const tables::Results& results,
                           const Picture& picture, const std::string& sequence) {
  const std::string folder = dir.evaluate.benchmark + "/" + picture.set + "/" + sequence;
  std::vector<Clip> clips{source_of(folder)};
  const Clip truth = read_clip(folder + "/truth.h5", "truth");
  for (const std::string& row : picture.rows) {
    const tables::TrialResult* trial = trial_of(results, row);
    if (trial == nullptr) return std::nullopt;
    const auto made = sweep::perform(dir.folder(trial->id) + "/config.yaml", dir.store, folder);
    if (!made) return std::nullopt;
    clips.push_back(clip_of(*made, truth.faces, row));
  }
  clips.push_back(truth);
  return sheet(clips, picture);
}

/// Relative paths of a sweep begin where it was planned.
bool planned_here(const sweep::SweepDir& dir) {
  std::error_code code;
  return fs::equivalent(fs::path(dir.path) / dir.directory, fs::current_path(), code);
}

/// Draws what can be drawn, and says of the others why not.
void draw(const std::optional<sweep::SweepDir>& dir, const tables::Results& results,
          const Picture& picture, const std::string& sequence, const std::string& path) {
  const auto left = [&](const std::string& why) { log_info(path + " is not drawn: " + why); };
  if (!dir || dir->evaluate.benchmark.empty()) return left("there is no benchmark");
  if (sequence.empty()) return left("there are no results of its row");
  if (!planned_here(*dir)) return left("its sweep was planned in another folder");
  try {
    const auto image = drawn(*dir, results, picture, sequence);
    if (!image) return left("weights of its rows are not here");
    write_jpeg(path, *image);
  } catch (const InputError& error) {
    left(error.what());
  }
}

}  // namespace

std::vector<Drawn> draw_pictures(const Evidence& evidence, const tables::Results& results,
                                 const std::string& folder) {
  std::vector<Drawn> out;
  if (evidence.asked.pictures.empty()) return out;
  std::optional<sweep::SweepDir> dir;
  if (is_there(evidence.dir + "/plan.json")) dir = sweep::read_sweep_dir(evidence.dir);
  int number = 0;
  for (const Picture& picture : evidence.asked.pictures) {
    std::vector<std::string> sequences{picture.sequence};
    if (picture.worst > 0) {
      const tables::TrialResult* trial = trial_of(results, picture.rows[0]);
      sequences.assign(static_cast<size_t>(picture.worst), "");
      if (trial != nullptr)
        sequences = worst_of(*trial, picture.set, static_cast<size_t>(picture.worst));
    }
    for (const std::string& sequence : sequences) {
      const std::string file = evidence.name + "-" + std::to_string(++number) + ".jpg";
      const std::string path = folder + "/" + file;
      draw(dir, results, picture, sequence, path);
      if (is_there(path))
        out.push_back({file, picture.says + (picture.worst > 0 ? ": " + sequence : "")});
    }
  }
  return out;
}

}  // namespace restage::reproduce
