// restage view: any file as a picture, a sheet of moments, an animated picture or a page that plays
// it; and beside it what it was made from, and the truth.

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "datasets/readers/frames/hdf5_frames.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/cli/perform/source_options.h"
#include "experiments/cli/pictures/browser.h"
#include "experiments/cli/pictures/view_options.h"
#include "experiments/pictures/rows.h"
#include "experiments/pictures/two_takes.h"
#include "experiments/pictures/view.h"
#include "experiments/slow_work.h"
#include "infer/render/animation.h"
#include "infer/render/film.h"
#include "infer/render/page.h"
#include "infer/render/sheet.h"
#include "infer/render/side_by_side.h"

namespace restage::cli {
namespace {

constexpr int kPictureHeight = 720, kAnimationHeight = 480;
constexpr double kUsualGifFps = 15;

FilmOptions film_options(const ViewOptions& o, double facing, double close_up, ViewKind kind) {
  FilmOptions out;
  out.height = kind == ViewKind::picture ? kPictureHeight : kAnimationHeight;
  if (!o.size.empty()) std::tie(out.width, out.height) = parse_size(o.size);
  if (!o.background.empty()) out.background = parse_colour(o.background);
  out.azimuth = facing + azimuth_of(o);
  out.zoom = o.zoom.value_or(1);
  out.close_up = close_up;
  return out;
}

std::vector<size_t> all_frames(size_t frames, size_t every = 1) {
  std::vector<size_t> out;
  for (size_t f = 0; f < frames; f += every) out.push_back(f);
  return out;
}

/// The file's bytes. Drawn: a Film or SideBySide of so many frames.
template <class Drawn>
std::string animation(const Drawn& film, size_t frames, double fps, ViewKind kind) {
  std::unique_ptr<AnimationWriter> writer;
  if (kind == ViewKind::webp) {
    writer = webp_writer(fps);
  } else {
    constexpr size_t kSamples = 6;
    std::vector<Image> samples;
    film.draw(all_frames(frames, (frames + kSamples - 1) / kSamples),
              [&](const Image& image) { samples.push_back(image); });
    writer = gif_writer(fps, samples);
  }
  SlowWork slow;
  size_t done = 0;
  film.draw(all_frames(frames), [&](const Image& image) {
    writer->push(image);
    slow.on(format("drawing frame %zu of %zu", ++done, frames));
  });
  return writer->finish();
}

ShowRequest request_of(const ViewOptions& o, ViewKind kind, uint64_t max_memory) {
  ShowRequest request = o.request;
  request.single = kind == ViewKind::picture;
  request.every = o.every.value_or(1);
  request.max_memory = max_memory;
  request.fps = o.fps;
  if (!o.fps && kind == ViewKind::gif && !o.every) request.fps = kUsualGifFps;
  return request;
}

/// InputError for a rate that the file cannot have.
void check_rate(const std::string& path, double fps, ViewKind kind) {
  if (kind == ViewKind::gif && fps > kGifFps)
    throw InputError(path, format("has %g frames per second, more than GIF can show", fps),
                     format("give --fps up to %g, or write .webp", kGifFps));
  const double longest = kind == ViewKind::gif ? 600 : 16000;  // seconds that files can state
  if (is_animation(kind) && fps * longest < 1)
    throw InputError(path, format("would show each frame for %.0f s", 1 / fps),
                     "give a smaller --every, or a larger --fps");
}

/// The file at the rate of the picture.
Showing read_one(const ViewOptions& o, ViewKind kind, uint64_t max_memory) {
  Showing view = read_showing(request_of(o, kind, max_memory));
  check_rate(o.request.path, view.clip.fps, kind);
  const std::string name = std::filesystem::path(o.request.path).filename().string();
  view.clip.label = view.animation.empty() ? name : name + ": " + view.animation;
  return view;
}

/// One moment, or an animation. Drawn: a Film or SideBySide of so many frames.
template <class Drawn>
void write_drawn(const ViewOptions& o, ViewKind kind, const Drawn& film, const Clip& clip,
                 Json& document) {
  document["width"] = film.width();
  document["height"] = film.height();
  if (kind == ViewKind::picture)
    film.draw({0}, [&](const Image& image) { write_png(o.out, image); });
  else
    write_file_atomically(o.out, animation(film, clip.frames.size(), clip.fps, kind));
}

/// Several moments side by side, or a page; a row or a view for each clip.
void write_rows(const ViewOptions& o, ViewKind kind, const std::string& out,
                const std::vector<Clip>& clips, size_t result, double close_up) {
  if (kind == ViewKind::page) {
    PageOptions page;
    page.fps = clips[result].fps;
    page.labels_below = o.two_takes();
    if (!o.title.empty())
      page.title = o.title;
    else if (o.two_takes())
      page.title = clips[0].label + ", " + clips[1].label;
    else if (!o.compares())
      page.title = std::filesystem::path(o.request.path).filename().string();
    write_page(out, clips, page);
    return;
  }
  SheetOptions sheet;
  sheet.columns = static_cast<int>(o.columns.value_or(sheet.columns));
  sheet.fps = clips[result].fps;
  sheet.title = o.title;
  sheet.azimuth = azimuth_of(o);
  sheet.close_up = close_up;
  write_contact_sheet(out, clips, sheet);
}

/// The file, its source and the truth.
Rows read_beside(const ViewOptions& o, uint64_t max_memory) {
  const ShowRequest& r = o.request;
  SourceRecord file{.path = r.path, .clip = r.clip, .sequence = r.sequence};
  if (r.scale) file.scale = *r.scale;
  if (!r.up.empty()) file.up = r.up;
  Comparison how = o.beside;
  if (o.compare == kRemembered)
    how.remembered = how.needed = true;
  else
    how.source = o.compare;
  return read_rows(file, how, r.look, max_memory);
}

/// Two characters or recordings, or any two files in an animation: --compare's, then the file's.
Rows write_two_takes(const ViewOptions& o, ViewKind kind, const std::string& out,
                     uint64_t max_memory, Json& document) {
  ShowRequest second = request_of(o, kind, max_memory), first = second;
  first.path = o.compare;
  first.clip = o.beside.clip.value_or("");
  first.up = o.beside.up.value_or("");
  first.scale = o.beside.scale;
  first.file_fps = o.beside.fps;
  if (o.beside.sequence || !is_hdf5(o.compare)) first.sequence = o.beside.sequence;
  TwoTakes takes = read_two_takes(first, second);
  Rows rows;
  for (Showing& shown : takes.shown) rows.clips.push_back(std::move(shown.clip));
  rows.result = 1;
  check_rate(o.request.path, rows.clips[1].fps, kind);
  if (kind == ViewKind::page || kind == ViewKind::sheet)
    write_rows(o, kind, out, rows.clips, rows.result, takes.close_up);
  else
    write_drawn(
        o, kind,
        SideBySide(rows.clips[0], rows.clips[1],
                   film_options(o, takes.shown[0].facing, takes.close_up, kind), takes.remarks),
        rows.clips[1], document);
  document["source"] = o.compare;
  rows.remarks = std::move(takes.remarks);
  return rows;
}

int run_view(const ViewOptions& o, const Common& common) {
  const ViewKind kind = kind_of(o);
  check_view(o, kind);
  const bool opens = o.out.empty();
  if (opens)
    check_display();
  else
    check_output(o.out, {o.request.path, o.compare, o.beside.truth});
  const std::string out = opens ? page_for(o.request.path) : o.out;
  Json document = {{"out", out}, {"source", Json()}};
  Rows rows;
  if (o.two_takes()) {
    rows = write_two_takes(o, kind, out, common.max_memory, document);
  } else if (o.compares()) {
    rows = read_beside(o, common.max_memory);
    if (!rows.source.empty()) document["source"] = rows.source;
    write_rows(o, kind, out, rows.clips, rows.result, rows.close_up);
  } else {
    Showing view = read_one(o, kind, common.max_memory);
    if (kind == ViewKind::page || kind == ViewKind::sheet)
      write_rows(o, kind, out, {view.clip}, 0, view.close_up);
    else
      write_drawn(o, kind,
                  Film(view.clip, film_options(o, view.facing, view.close_up, kind), view.remarks),
                  view.clip, document);
    document["clip"] = view.animation.empty() ? Json() : Json(view.animation);
    rows.remarks = std::move(view.remarks);
    rows.clips.push_back(std::move(view.clip));
  }
  // Bad input is answered with one line: remarks come when all is done.
  for (const std::string& remark : rows.remarks) log_warning(remark);
  std::error_code error;
  document["bytes"] = std::filesystem::file_size(out, error);
  document["frames"] = rows.clips[rows.result].frames.size();
  document["fps"] = rows.clips[rows.result].fps;
  print(common.json, document, "wrote " + out + "\n");
  if (opens) open_page(out);
  return 0;
}

// ---- options

void add_camera(CommandOptions app, ViewOptions& o) {
  app.add_option("--columns", o.columns, "moments on a sheet (default: 8)");
  app.add_option("--side", o.side,
                 "where the camera stands, seen from the character (default: three-quarter)")
      .one_of({"front", "left", "right", "back", "three-quarter"})
      .formerly("--from");
  app.add_option("--azimuth", o.azimuth,
                 "the same in degrees from the front towards the body's left (default: 32)");
  app.add_option("--look", o.request.look.part,
                 "a close-up: head, hands, left-hand, right-hand, feet, or a joint such as "
                 "left_wrist; not for pages")
      .formerly("--focus");
  app.add_option("--within", o.request.look.within,
                 "metres to either side of --look (default: as the part needs; 0.25 of a joint)");
  app.add_option("--title", o.title, "a line at the top of a sheet or a page");
}

/// `older`: the names that these options had in the command render.
void add_comparison(CommandOptions app, ViewOptions& o, bool older) {
  const auto formerly = [&](Option option, const char* name) {
    if (older) option.formerly(name);
  };
  Comparison& c = o.beside;
  app.add_option("--truth", c.truth,
                 "the true motion, if it is known; a page shows how far each vertex is off");
  formerly(app.add_option("--source-fps", c.fps,
                          "frames per second of the source; without one, of the file (default: "
                          "the source's, else 30)"),
           "--fps");
  app.add_option("--source-up", c.up,
                 "the source's axis that points up: x, -x, y, -y, z or -z (default: as the file "
                 "remembers, else y)");
  formerly(add_scale(app, c.scale, "the source's units in metres", "as the file remembers, else 1",
                     "--source-scale"),
           "--scale");
  formerly(app.add_option("--source-clip", c.clip,
                          "animation of a glTF source (default: as the file remembers, else the "
                          "first)"),
           "--clip");
  app.add_option("--source-sequence", c.sequence,
                 "which sequence of an HDF5 source, from 0 (default: as --sequence)");
  app.add_option("--sequence", o.request.sequence,
                 "which sequence of an HDF5 file, from 0 (default: the only one)");
}

struct RenderOptions : ViewOptions {
  bool no_source = false;
};

int run_render(const RenderOptions& given, const Common& common) {
  ViewOptions o = given;
  if (!o.out.ends_with(".png") && !o.out.ends_with(".html"))
    throw InputError(o.out, "names neither a picture nor a page", "end --out in .png or .html");
  if (given.no_source && !o.compare.empty())
    throw InputError("", "--no-source contradicts --source", "leave one of them out");
  o.rows = true;
  o.beside.remembered = !given.no_source;
  if (!o.columns && o.out.ends_with(".png")) o.columns = SheetOptions{}.columns;
  const int code = run_view(o, common);
  log_warning(
      "'restage render' is called 'restage view' now: '--compare source' draws what a result "
      "remembers");
  return code;
}

void add_render(Program& program) {
  auto [app, options] = program.add(
      "render", "the older name of 'view --compare source'",
      "restage render result.h5 --out sheet.png        # view result.h5 --compare source --out "
      "sheet.png\n"
      "restage render result.h5 --no-source --out sheet.png\n"
      "restage render result.h5 --source scans.h5 --truth truth.h5 --title Walk --out page.html\n"
      "restage render result.h5 --source mm/ --source-fps 60 --source-up z --source-scale mm --out "
      "page.html\n"
      "restage render result.h5 --source hero.glb --source-clip Walk --side left --out sheet.png\n"
      "restage render result.h5 --source takes.h5 --source-sequence 3 --sequence 1 --out "
      "sheet.png\n"
      "restage render result.h5 --look left_foot --within 0.1 --azimuth 60 --columns 4 --out "
      "foot.png",
      run_render);
  app.add_option("RESULT", options.request.path,
                 "prediction or scans (HDF5), or a folder of PLY or OBJ")
      .required();
  app.add_option("--source", options.compare,
                 "what the motion was taken from (default: what RESULT.h5 remembers, and how it is "
                 "read)");
  app.add_flag("--no-source", options.no_source, "the result alone");
  app.add_option("--out", options.out, "sheet.png or page.html").required();
  add_comparison(app, options, true);
  add_camera(app, options);
}

}  // namespace

void add_view(Program& program) {
  auto [app, options] = program.add(
      "view", "show any character, motion or scan: a picture, an animation or a page",
      "restage view hero_dancing.vrm                          # in the browser\n"
      "restage view hero_dancing.vrm --out dance.webp         # for a README or a chat\n"
      "restage view hero.glb --clip Walk --fps 12 --size 320x320 --out walk.gif\n"
      "restage view hero.glb --look hands --side front --out hands.png\n"
      "restage view hero.glb --look left_foot --within 0.1 --columns 4 --out foot.png\n"
      "restage view hero.glb --frame 40 --background black --out still.png\n"
      "restage view hero.glb --time 1.5 --zoom 1.2 --bones names.yaml --out still.png\n"
      "restage view --source walk.bvh --every 2 --out walk.webp\n"
      "restage view scans/ --up z --scale mm --out scans.webp\n"
      "restage view motions.h5 --sequence 3 --out motion.gif\n"
      "restage view --compare before.glb after.glb --out both.webp\n"
      "restage view hero_moving.glb --compare scans/ --source-fps 60 --out both.webp\n"
      "restage view result.h5 --compare source --out sheet.png\n"
      "restage view result.h5 --compare mm/ --source-fps 60 --source-up z --source-scale mm --out "
      "page.html\n"
      "restage view result.h5 --compare hero.glb --source-clip Walk --azimuth 60 --out sheet.png\n"
      "restage view result.h5 --compare takes.h5 --source-sequence 3 --out sheet.png\n"
      "restage view result.h5 --compare scans.h5 --truth truth.h5 --title Walk --out page.html",
      run_view);
  ShowRequest& r = options.request;
  app.add_option(
         "--source,SOURCE", r.path,
         "glTF (.glb, .gltf, .vrm, .vrma), FBX, BVH, AMC, AMASS (.npz), a result, scans or motions "
         "(HDF5), PLY, OBJ, or a folder of frames")
      .required();
  app.add_option("--out", options.out,
                 "picture.png, animation.webp, animation.gif or page.html (default: a page in the "
                 "browser)");
  app.add_option(
      "--compare", options.compare,
      "another character or recording, shown in step on the left: same clock, scale and "
      "camera; of a result what the motion was taken from, such as scans: a file, or, on a sheet "
      "(.png) or a page (.html), the word source for what the result remembers");
  add_comparison(app, options, false);
  add_camera(app, options);
  app.add_option("--clip", r.clip,
                 "animation of a glTF file (default: the last that restage wrote, else the first)");
  app.add_option("--frame", r.frame, "frame of a picture, from 0 (default: the middle one)");
  app.add_option("--time", r.seconds, "the same in seconds (default: the middle)");
  app.add_option("--fps", options.fps,
                 "frames per second of the animation (default: the file's or 30; GIF: 15)");
  app.add_option("--every", options.every, "one frame in so many (default: 1)");
  app.add_option("--size", options.size,
                 "WIDTHxHEIGHT in pixels (default: 720 high, animations 480, as wide as needed)");
  app.add_option("--zoom", options.zoom, "everything so many times as large (default: 1)");
  app.add_option("--background", options.background,
                 "white, black, grey or '#rrggbb' (default: as paper)");
  app.add_option(
      "--bones", r.bones,
      "which bone of a rig is which joint, a .yaml file (docs/formats.md) (default: found)");
  app.add_option(
      "--up", r.up,
      "axis of scans and recordings that points up: x, -x, y, -y, z or -z (default: y; of "
      "recordings found)");
  add_scale(app, r.scale, "units of scans and recordings in metres", "metres, of recordings found");
  add_render(program);
}

}  // namespace restage::cli
