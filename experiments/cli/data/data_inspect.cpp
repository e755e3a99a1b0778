// restage data inspect: what a file holds, in a screenful, and drawn. Files of others are looked at
// as `restage data import` reads them.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/base/output_check.h"
#include "autograd/base/words.h"
#include "datasets/builtin/bodies.h"
#include "datasets/doctor/shape.h"
#include "datasets/importers/import.h"
#include "datasets/readers/frames/hdf5_frames.h"
#include "datasets/schema.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/data/import_text.h"
#include "experiments/cli/output.h"
#include "experiments/pictures/clips.h"
#include "experiments/scratch.h"
#include "infer/render/figures.h"

namespace restage::cli {
namespace {

constexpr size_t kBodiesDrawn = 8, kMotionsDrawn = 16, kFramesDrawn = 24;
constexpr size_t kListed = 14;  // subjects or actions that are named

struct InspectOptions {
  std::string file, plot, body_model;
};

std::string rounded(double x, int decimals) { return format("%.*f", decimals, x); }

std::string row(std::string name, const std::string& value) {
  name.resize(std::max<size_t>(name.size() + 1, 12), ' ');
  return name + value + "\n";
}

/// "walk 12, jog 3 and 4 more", the most frequent first.
std::string most_frequent(const std::map<std::string, int64_t>& counts) {
  std::vector<std::pair<std::string, int64_t>> order(counts.begin(), counts.end());
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  return cat(order.size(), ": ", listed(order, kListed, [](const auto& one) {
               return cat(one.first, " ", one.second);
             }));
}

std::string inspection_text(const Inspection& found) {
  std::string text = row("kind", found.kind);
  for (const auto& [name, count] : found.counts) text += row(name, std::to_string(count));
  if (found.seconds > 0)
    text += row("seconds", rounded(found.seconds, 1) + " at " +
                               rounded(found.fps, found.fps == std::floor(found.fps) ? 0 : 2) +
                               " frames a second");
  for (const auto& [split, counts] : found.splits) {
    text +=
        row(split, joined(counts, [](const auto& one) { return cat(one.second, " ", one.first); }));
  }
  if (!found.heights.empty())
    text += row("heights", rounded(found.heights.front(), 2) + " to " +
                               rounded(found.heights.back(), 2) + " m, median " +
                               rounded(found.heights[found.heights.size() / 2], 2) + " m");
  for (const auto& [name, bodies] : found.definitions)
    text += row("joints of", name + (bodies > 1 ? ", " + std::to_string(bodies) + " bodies" : ""));
  if (!found.subjects.empty()) text += row("subjects", most_frequent(found.subjects));
  if (!found.actions.empty()) text += row("actions", most_frequent(found.actions));
  text += row("units", found.units) + row("license", found.license) +
          row("provenance", found.provenance);
  if (!found.transform.empty()) text += row("transform", found.transform);
  return text;
}

Json inspection_json(const Inspection& found) {
  Json out = {{"kind", found.kind},       {"counts", found.counts},         {"units", found.units},
              {"license", found.license}, {"provenance", found.provenance}, {"fps", found.fps},
              {"seconds", found.seconds}};
  if (!found.definitions.empty()) out["joint_definition"] = found.definitions;
  if (found.kind == "scans" || found.kind == "prediction") {
    if (Json transform = Json::parse(found.transform, nullptr, false); transform.is_object())
      out["transform"] = std::move(transform);
    return out;
  }
  out["splits"] = found.splits;
  out["subjects"] = found.subjects;
  out["actions"] = found.actions;
  if (!found.heights.empty())
    out["heights"] = {{"least", found.heights.front()},
                      {"median", found.heights[found.heights.size() / 2]},
                      {"most", found.heights.back()}};
  return out;
}

// ---- plot --------------------------------------------------------------------------------------

/// Number k of `n` drawn out of `all`, spread evenly.
size_t spread(size_t k, size_t n, size_t all) { return n < 2 ? 0 : k * (all - 1) / (n - 1); }

void remark(std::vector<std::string>& remarks, size_t drawn, size_t all, const std::string& what) {
  if (drawn < all)
    remarks.push_back("drawn: " + std::to_string(drawn) + " of " + std::to_string(all) + " " +
                      what);
}

void add_bodies(std::vector<Figure>& figures, const std::vector<Body>& bodies) {
  const size_t n = std::min(bodies.size(), kBodiesDrawn);
  for (size_t k = 0; k < n; ++k) {
    const Body& body = bodies[spread(k, n, bodies.size())];
    figures.push_back({{{body.rest.vertices, body.rest.faces}}, body.id + " (" + body.split + ")"});
  }
}

/// Moments of each motion, fewer the more motions there are, performed by the file's bodies in turn
/// or by a built-in one.
void add_motions(std::vector<Figure>& figures, const std::vector<Motion>& motions,
                 const std::vector<Body>& bodies) {
  const std::vector<Body> performers =
      bodies.empty() ? std::vector{builtin_body(0, "test", 0)} : bodies;
  const size_t n = std::min(motions.size(), kMotionsDrawn),
               moments = kMotionsDrawn / std::max<size_t>(n, 1);
  for (size_t k = 0; k < n; ++k) {
    const Motion& motion = motions[spread(k, n, motions.size())];
    const Body& body = performers[k % performers.size()];
    for (size_t m = 0; m < moments && motion.frames() > 0; ++m) {
      const size_t frame = (2 * m + 1) * motion.frames() / (2 * moments);
      std::string label = motion.id + (motion.action.empty() ? "" : ": " + motion.action);
      if (moments > 1) label += " " + rounded(static_cast<double>(frame) / kFps, 1) + " s";
      figures.push_back(
          {{{pose_surface(body, pose_on(motion, body, frame)), body.rest.faces}}, label});
    }
  }
}

/// Brings frames to about a person's size, that a view of metres shows them: 1 if they are of some.
float drawing_scale(const Clip& clip) {
  const double size = shape_of({clip.frames[0], clip.faces}).size;
  return size > 0 && (size < 0.1 || size > 1.5) ? static_cast<float>(0.39 / size) : 1;
}

void add_frames(std::vector<Figure>& figures, const std::string& file, double fps,
                std::vector<std::string>& remarks) {
  Clip clip = read_clip(file, "", 0);
  if (const float scale = drawing_scale(clip); scale != 1) {
    for (Points& frame : clip.frames)
      for (Point& p : frame) p *= scale;
    remarks.push_back("drawn " + format("%.2g", double{scale}) +
                      " times as large as it is; restage doctor says in what units it may be");
  }
  const float floor = clip_floor(clip);
  const size_t n = std::min(clip.frames.size(), kFramesDrawn);
  remark(remarks, n, clip.frames.size(), "frames");
  for (size_t k = 0; k < n; ++k) {
    const size_t f = spread(k, n, clip.frames.size());
    Figure figure{{{clip.frames[f], clip.faces}}, rounded(static_cast<double>(f) / fps, 2) + " s"};
    figure.floor = floor;
    figures.push_back(std::move(figure));
  }
}

/// Draws; gives what was left out.
std::vector<std::string> plot(const InspectOptions& options, const std::string& data,
                              const Inspection& found) {
  std::vector<Figure> figures;
  std::vector<std::string> remarks;
  if (found.kind == "scans" || found.kind == "prediction") {
    if (const int64_t n = found.counts.at("sequences"); n > 1)
      remarks.push_back("drawn: the first of " + std::to_string(n) + " sequences");
    add_frames(figures, data, found.fps, remarks);
  } else {
    std::vector<Body> bodies;
    if (found.counts.contains("bodies")) bodies = read_bodies(data);
    add_bodies(figures, bodies);
    remark(remarks, figures.size(), bodies.size(), "bodies");
    if (found.counts.contains("motions")) {
      const std::vector<Motion> motions = read_motions(data);
      remark(remarks, std::min(motions.size(), kMotionsDrawn), motions.size(), "motions");
      add_motions(figures, motions, bodies);
    }
  }
  FigureSheetOptions sheet;
  sheet.lines = remarks;
  sheet.title = options.file + ": " + found.kind;
  write_png(options.plot, figure_sheet(figures, sheet));
  return remarks;
}

/// A data file that goes away with the object.
class Imported {
 public:
  Imported(const InspectOptions& options, const Common& common) {
    ImportOptions how;
    how.body_model = options.body_model;
    how.motion.force = true;
    how.max_memory = common.max_memory;
    reports_ = import_data(options.file, path_, how).reports;
  }
  const std::string& path() const { return path_; }
  const std::vector<ImportReport>& reports() const { return reports_; }

 private:
  Scratch folder_;
  std::string path_ = folder_.file("data.h5");
  std::vector<ImportReport> reports_;
};

/// Clouds of others in HDF5, of which our own reader knows nothing.
bool is_foreign_file(const std::string& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored) || !is_hdf5(path)) return false;
  if (!is_foreign_hdf5(path)) return false;
  try {
    inspect(path);
    return false;
  } catch (const InputError&) {
    return holds_clouds(path);
  }
}

int run_inspect(const InspectOptions& options, const Common& common) {
  if (!options.plot.empty() && !options.plot.ends_with(".png"))
    throw InputError(options.plot, "names no picture", "end --plot in .png");
  check_output(options.plot, {options.file, options.body_model});
  if (std::filesystem::exists(options.file + "/manifest.json"))
    throw InputError(options.file, "is a folder that 'restage data build' made",
                     "inspect a file in it, or 'restage data verify' it");
  std::optional<Imported> imported;
  if (is_importable(options.file) || is_foreign_file(options.file))
    imported.emplace(options, common);
  const std::string& data = imported ? imported->path() : options.file;
  const Inspection found = inspect(data);
  std::vector<std::string> remarks;
  if (!options.plot.empty()) remarks = plot(options, data, found);
  if (common.json) {
    Json out = inspection_json(found);
    if (imported) out["reports"] = reports_json(imported->reports());
    if (!options.plot.empty()) out["plot"] = {{"file", options.plot}, {"remarks", remarks}};
    print_json(out);
    return 0;
  }
  if (imported) print(reports_text(imported->reports(), common.verbose));
  std::string text = inspection_text(found);
  if (!options.plot.empty()) text += "wrote " + options.plot + "\n";
  for (const std::string& line : remarks) text += "  " + line + "\n";
  print(text);
  return 0;
}

}  // namespace

void add_data_inspect(Program& program, CommandOptions group) {
  auto [app, options] =
      program.add(group, "inspect", "say what a file holds, and draw it",
                  "restage data inspect data.h5\nrestage data inspect data.h5 --plot sheet.png\n"
                  "restage data inspect walk.bvh\nrestage data inspect hero.glb --plot hero.png\n"
                  "restage data inspect data.h5 --json\n"
                  "restage data inspect walk_poses.npz --body-model SMPLH_MALE.npz",
                  run_inspect);
  app.add_option(
         "FILE", options.file,
         "bodies, motions, scans or a prediction (HDF5), or what 'restage data import' takes")
      .required();
  app.add_option("--body-model", options.body_model, "for an AMASS motion: its SMPL model (.npz)");
  app.add_option("--plot", options.plot, "draw bodies, poses or frames on a contact sheet (PNG)");
}

}  // namespace restage::cli
