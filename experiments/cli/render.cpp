// restage render: a contact sheet or a page that plays source, result and truth.

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "autograd/base/error.h"
#include "autograd/base/nearest.h"
#include "autograd/base/output_check.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/clips.h"
#include "infer/render/page.h"
#include "infer/render/sheet.h"
#include "nn/geometry/skeleton.h"

namespace restage::cli {
namespace {

constexpr double kCloseUp = 0.25;  // metres to either side

struct RenderOptions {
  std::string result, source, truth, out, title, focus;
  int columns = 8;
  double fps = kFps;
  std::optional<double> within, azimuth;
  int64_t sequence = 0;
};

void check(const RenderOptions& options) {
  if (!options.out.ends_with(".png") && !options.out.ends_with(".html"))
    throw InputError(options.out, "names neither a picture nor a page",
                     "end --out in .png or .html");
  if (options.columns < 1 || options.columns > 64)
    throw InputError("", "--columns " + std::to_string(options.columns) + " is out of range",
                     "give a number from 1 to 64");
  if (!(options.fps > 0) || options.fps > 1000)
    throw InputError("", "--fps is out of range", "give frames per second above 0");
  if (options.within && (!(*options.within > 0) || *options.within > 10))
    throw InputError("", "--within is out of range", "give metres above 0, at most 10");
  if (options.within && options.focus.empty())
    throw InputError("", "--within belongs to --focus", "give both, or leave it out");
  if (options.azimuth && !(std::abs(*options.azimuth) <= 360))
    throw InputError("", "--azimuth is out of range", "give degrees from -360 to 360");
  for (const auto& [given, name] : {std::pair(!options.focus.empty(), "--focus"),
                                    std::pair(options.azimuth.has_value(), "--azimuth")})
    if (given && options.out.ends_with(".html"))
      throw InputError("", std::string(name) + " goes with a sheet only",
                       "end --out in .png, or leave it out");
  check_output(options.out, {options.result, options.source, options.truth});
}

size_t joint_of(const std::string& name) {
  const std::vector<std::string> names(kJointNames.begin(), kJointNames.end());
  const auto at = std::find(names.begin(), names.end(), name);
  if (at != names.end()) return static_cast<size_t>(at - names.begin());
  const std::string near = nearest(name, names);
  throw InputError(
      "", "there is no joint '" + name + "'",
      near.empty() ? "use a name as restage skeleton prints them" : "did you mean '" + near + "'?");
}

int run_render(const RenderOptions& options, const Common& common) {
  check(options);
  std::vector<Clip> clips;
  const auto add = [&](const std::string& path, const std::string& label) {
    if (path.empty()) return;
    clips.push_back(read_clip(path, label, options.sequence));
    if (!options.focus.empty())
      clips.back().focus = read_focus(path, joint_of(options.focus), options.sequence);
  };
  add(options.source, "source");
  add(options.result, "result");
  add(options.truth, "truth");
  if (!options.truth.empty()) {
    const size_t result = options.source.empty() ? 0 : 1;
    add_errors(clips[result + 1], &clips[result]);
  }
  if (options.out.ends_with(".png")) {
    SheetOptions sheet;
    sheet.columns = options.columns;
    sheet.fps = options.fps;
    sheet.title = options.title;
    sheet.azimuth = options.azimuth.value_or(sheet.azimuth);
    if (!options.focus.empty()) sheet.close_up = options.within.value_or(kCloseUp);
    write_contact_sheet(options.out, clips, sheet);
  } else {
    PageOptions page;
    page.fps = options.fps;
    if (!options.title.empty()) page.title = options.title;
    write_page(options.out, clips, page);
  }
  print(common.json, {{"out", options.out}}, "wrote " + options.out + "\n");
  return 0;
}

}  // namespace

void add_render(Program& program) {
  auto [app, options] = program.add(
      "render", "draw a result as a contact sheet or a page that plays it",
      "restage render result.h5 --source scans/ --out sheet.png\n"
      "restage render result.h5 --source scans.h5 --truth truth.h5 --out page.html\n"
      "restage render result.h5 --focus left_wrist --azimuth 60 --out hand.png\n"
      "restage render result.h5 --focus left_foot --within 0.1 --columns 4 --out foot.png\n"
      "restage render scans.h5 --sequence 2 --fps 60 --title 'take 2' --out page.html",
      run_render);
  app.add_option("RESULT", options.result, "prediction or scans (HDF5), or a folder of PLY or OBJ")
      .required();
  app.add_option("--source", options.source, "what the motion was taken from");
  app.add_option("--truth", options.truth,
                 "the true motion, if it is known; a page shows how far each vertex is off");
  app.add_option("--out", options.out, "sheet.png or page.html").required();
  app.add_option("--columns", options.columns, "moments on a sheet");
  app.add_option("--fps", options.fps, "frames per second of the input");
  app.add_option("--sequence", options.sequence, "which sequence of an HDF5 file, from 0");
  app.add_option("--focus", options.focus,
                 "joint of a close-up, such as left_wrist; of files with /joints, on a sheet");
  app.add_option("--within", options.within, "metres to either side of --focus (0.25)");
  app.add_option("--azimuth", options.azimuth,
                 "where a sheet is seen from, degrees from the front towards the body's left (32)");
  app.add_option("--title", options.title, "a line at the top");
}

}  // namespace restage::cli
