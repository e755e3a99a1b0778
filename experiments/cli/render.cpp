// restage render: a contact sheet or a page that plays source, result and truth.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "autograd/base/nearest.h"
#include "autograd/base/output_check.h"
#include "datasets/readers/hdf5_frames.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/cli/source_options.h"
#include "experiments/clips.h"
#include "experiments/text.h"
#include "infer/render/page.h"
#include "infer/render/sheet.h"
#include "nn/geometry/skeleton.h"

namespace restage::cli {
namespace {

constexpr double kCloseUp = 0.25;  // metres to either side

struct RenderOptions {
  std::string result, source, truth, out, title, focus;
  int columns = 8;
  std::optional<double> fps, within, azimuth;
  int64_t sequence = 0;
  // What is said of the source here; else it is read as the result remembers.
  std::optional<std::string> clip, up;
  std::optional<double> scale;
  std::optional<int64_t> source_sequence;
  bool no_source = false;
};

void check(const RenderOptions& options) {
  if (!options.out.ends_with(".png") && !options.out.ends_with(".html"))
    throw InputError(options.out, "names neither a picture nor a page",
                     "end --out in .png or .html");
  if (options.columns < 1 || options.columns > 64)
    throw InputError("", "--columns " + std::to_string(options.columns) + " is out of range",
                     "give a number from 1 to 64");
  if (options.fps && !(*options.fps > 0 && *options.fps <= 1000))
    throw InputError("", "--fps is out of range", "give frames per second above 0, at most 1000");
  if (options.no_source && !options.source.empty())
    throw InputError("", "--no-source contradicts --source", "leave one of them out");
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

bool is_same_file(const std::string& a, const std::string& b) {
  std::error_code error;
  return std::filesystem::equivalent(a, b, error) && !error;
}

/// What the result says of its source, if that is still there.
std::optional<SourceRecord> remembered_source(const std::string& result, Remarks& remarks) {
  std::optional<SourceRecord> out;
  if (is_hdf5(result)) out = read_source_record(result);
  std::error_code error;
  if (!out || std::filesystem::exists(out->path, error)) return out;
  remarks.push_back("the source of " + result + ", " + out->path +
                    ", is not there any more: it is left out (--source says where it is)");
  return std::nullopt;
}

/// Which source is drawn, and how it is read; nothing if none is.
std::optional<SourceRecord> source_of(const RenderOptions& options, Remarks& remarks) {
  if (options.no_source) return std::nullopt;
  std::optional<SourceRecord> out = remembered_source(options.result, remarks);
  if (!options.source.empty()) {
    // Of another source than its own a result knows nothing.
    if (!out || !is_same_file(out->path, options.source))
      out = SourceRecord{.sequence = options.sequence};
    out->path = options.source;
  }
  if (!out) return out;
  if (options.clip) out->clip = *options.clip;
  if (options.up) out->up = *options.up;
  if (options.fps) out->fps = options.fps;
  if (options.scale) out->scale = *options.scale;
  if (options.source_sequence) out->sequence = options.source_sequence;
  return out;
}

/// Options about a source are of no use without one.
void check_needs_source(const RenderOptions& options) {
  for (const auto& [given, name] :
       {std::pair(options.clip.has_value(), "--clip"),
        std::pair(options.up.has_value(), "--source-up"),
        std::pair(options.scale.has_value(), "--scale"),
        std::pair(options.source_sequence.has_value(), "--source-sequence")})
    if (given)
      throw InputError("", std::string(name) + " belongs to a source, and there is none",
                       "give --source too, or leave it out");
}

/// Median distance of the first frame's points from its middle, metres.
double size_of(const Clip& clip) {
  const Point centre = clip_centre(clip.frames[0]);
  std::vector<float> away;
  for (const Point& p : clip.frames[0])
    if (p.allFinite()) away.push_back((p - centre).norm());
  if (away.empty()) return 0;
  const auto half = away.begin() + std::ssize(away) / 2;
  std::nth_element(away.begin(), half, away.end());
  return static_cast<double>(*half);
}

/// Somebody a thousand times as large as the result is an empty row.
void compare_sizes(const Clip& source, const Clip& result, const std::string& path,
                   Remarks& remarks) {
  constexpr double kMostTimes = 4;
  const double times = size_of(source) / std::max(size_of(result), 1e-9);
  if (times > kMostTimes || times < 1 / kMostTimes)
    remarks.push_back(path + ": somebody " + format("%.3g", times) +
                      " times the size of the result; --scale says how many metres a unit has");
}

/// The rows of the picture: the source, the result, the truth, at the result's moments.
class Rows {
 public:
  Rows(const RenderOptions& options, const Common& common) : options_(options), common_(common) {}

  std::vector<Clip> read() {
    const auto source = source_of(options_, remarks_);
    if (!source) check_needs_source(options_);
    Clip result = read({.path = options_.result, .sequence = options_.sequence}, "result");
    if (!source && options_.fps) result.fps = *options_.fps;
    const auto timed = [&](Clip clip) {
      return at_rate(std::move(clip), result.fps, result.frames.size());
    };
    std::vector<Clip> out;
    if (source && can_be_drawn(*source)) {
      out.push_back(timed(read(*source, "source")));
      compare_sizes(out[0], result, source->path, remarks_);
      source_ = source->path;
    }
    std::optional<Clip> truth;
    if (!options_.truth.empty()) {
      Clip whole = read({.path = options_.truth, .sequence = options_.sequence}, "truth");
      if (!source && options_.fps) whole.fps = *options_.fps;
      check_same_motion(whole, result);
      truth = timed(std::move(whole));
      add_errors(*truth, &result);
    }
    out.push_back(std::move(result));
    if (truth) out.push_back(std::move(*truth));
    return out;
  }
  const std::string& source() const { return source_; }  ///< the one that is drawn; empty: none
  const Remarks& remarks() const { return remarks_; }

 private:
  /// Another rate may cut off or add a frame.
  void check_same_motion(const Clip& truth, const Clip& result) const {
    const double seconds = static_cast<double>(truth.frames.size()) / truth.fps;
    const double other = static_cast<double>(result.frames.size()) / result.fps;
    if (std::abs(seconds - other) > 1.5 / std::min(truth.fps, result.fps))
      throw InputError(options_.truth,
                       "has " + counted(std::ssize(truth.frames), "frame") +
                           format(" (%.3g s), and ", seconds) + options_.result + " has " +
                           counted(std::ssize(result.frames), "frame") + format(" (%.3g s)", other),
                       "give the truth of the same motion");
  }

  Clip read(const SourceRecord& how, const std::string& label) {
    Clip out = read_clip(how, label, common_.max_memory, remarks_);
    if (!options_.focus.empty())
      out.focus = read_focus(how.path, joint_of(options_.focus), how.sequence.value_or(0));
    return out;
  }

  /// A close-up needs joints. A source that nobody asked for is then left out.
  bool can_be_drawn(const SourceRecord& source) {
    if (options_.focus.empty() || !options_.source.empty() || has_joints(source.path)) return true;
    remarks_.push_back(source.path + " does not say where its joints are: it is left out");
    return false;
  }

  const RenderOptions& options_;
  const Common& common_;
  std::string source_;
  Remarks remarks_;
};

int run_render(const RenderOptions& options, const Common& common) {
  check(options);
  Rows rows(options, common);
  const std::vector<Clip> clips = rows.read();
  const Clip& result = clips[rows.source().empty() ? 0 : 1];
  if (options.out.ends_with(".png")) {
    SheetOptions sheet;
    sheet.columns = options.columns;
    sheet.fps = result.fps;
    sheet.title = options.title;
    sheet.azimuth = options.azimuth.value_or(sheet.azimuth);
    if (!options.focus.empty()) sheet.close_up = options.within.value_or(kCloseUp);
    write_contact_sheet(options.out, clips, sheet);
  } else {
    PageOptions page;
    page.fps = result.fps;
    if (!options.title.empty()) page.title = options.title;
    write_page(options.out, clips, page);
  }
  // Bad input is answered with one line: remarks come when all is done.
  for (const std::string& remark : rows.remarks()) log_warning(remark);
  Json document = {{"out", options.out}, {"frames", result.frames.size()}, {"fps", result.fps}};
  document["source"] = rows.source().empty() ? Json() : Json(rows.source());
  print(common.json, document, "wrote " + options.out + "\n");
  return 0;
}

}  // namespace

void add_render(Program& program) {
  auto [app, options] = program.add(
      "render", "draw a result as a contact sheet or a page that plays it",
      "restage render result.h5 --out sheet.png\n"
      "restage render result.h5 --source mm/ --fps 60 --source-up z --scale 0.001 --out page.html\n"
      "restage render result.h5 --no-source --out sheet.png\n"
      "restage render result.h5 --source hero.glb --clip Walk --out sheet.png\n"
      "restage render result.h5 --source takes.h5 --source-sequence 3 --out sheet.png\n"
      "restage render result.h5 --source scans.h5 --truth truth.h5 --out page.html\n"
      "restage render result.h5 --focus left_wrist --azimuth 60 --out hand.png\n"
      "restage render result.h5 --focus left_foot --within 0.1 --columns 4 --out foot.png\n"
      "restage render scans.h5 --sequence 2 --fps 60 --title 'take 2' --out page.html",
      run_render);
  app.add_option("RESULT", options.result, "prediction or scans (HDF5), or a folder of PLY or OBJ")
      .required();
  app.add_option("--source", options.source,
                 "what the motion was taken from (default: what RESULT.h5 remembers, and how it is "
                 "read)");
  app.add_flag("--no-source", options.no_source, "the result alone");
  app.add_option("--truth", options.truth,
                 "the true motion, if it is known; a page shows how far each vertex is off");
  app.add_option("--out", options.out, "sheet.png or page.html").required();
  app.add_option("--columns", options.columns, "moments on a sheet");
  app.add_option(
      "--fps", options.fps,
      "frames per second of the source; without one, of RESULT (default: the file's, else "
      "30)");
  app.add_option("--source-up", options.up,
                 "the source's axis that points up: x, -x, y, -y, z or -z");
  add_scale(app, options.scale, "the source's units in metres");
  app.add_option("--clip", options.clip, "animation of a glTF source");
  app.add_option("--source-sequence", options.source_sequence,
                 "which sequence of an HDF5 source, from 0 (default: as --sequence)");
  app.add_option("--sequence", options.sequence,
                 "which sequence of RESULT and truth, from 0, if they are HDF5");
  app.add_option("--focus", options.focus,
                 "joint of a close-up, such as left_wrist; of files with /joints, on a sheet");
  app.add_option("--within", options.within, "metres to either side of --focus (0.25)");
  app.add_option("--azimuth", options.azimuth,
                 "where a sheet is seen from, degrees from the front towards the body's left (32)");
  app.add_option("--title", options.title, "a line at the top");
}

}  // namespace restage::cli
