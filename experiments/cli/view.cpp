// restage view: any file as a picture, an animated picture or a page that plays it.

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/base/log.h"
#include "autograd/base/output_check.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "experiments/cli/source_options.h"
#include "experiments/slow_work.h"
#include "experiments/view.h"
#include "infer/render/animation.h"
#include "infer/render/film.h"
#include "infer/render/page.h"

namespace restage::cli {
namespace {

constexpr int kPictureHeight = 720, kAnimationHeight = 480, kLeastSide = 16, kMostSide = 4096;
constexpr double kUsualGifFps = 15;

struct ViewOptions {
  ShowRequest request;
  std::string out, size, from = "three-quarter", background;
  std::optional<double> fps, zoom;
  std::optional<int64_t> every;
};

enum class ViewKind { picture, webp, gif, page };

ViewKind kind_of(const std::string& out) {
  const auto ends = [&](const char* ending) { return out.ends_with(ending); };
  if (ends(".png")) return ViewKind::picture;
  if (ends(".webp")) return ViewKind::webp;
  if (ends(".gif")) return ViewKind::gif;
  if (ends(".html")) return ViewKind::page;
  throw InputError(out, "names no picture, animation or page",
                   "end --out in .png, .webp, .gif or .html");
}

double azimuth_of(const std::string& from) {
  if (from == "front") return 0;
  if (from == "left") return 90;
  if (from == "right") return -90;
  return from == "back" ? 180 : 32;
}

/// "640x480" as width and height.
std::pair<int, int> parse_size(const std::string& text) {
  int width = 0, height = 0, end = 0;
  const int read = std::sscanf(text.c_str(), "%5dx%5d%n", &width, &height, &end);
  if (read == 2 && static_cast<size_t>(end) == text.size() &&
      std::min(width, height) >= kLeastSide && std::max(width, height) <= kMostSide)
    return {width, height};
  throw InputError("", "--size '" + text.substr(0, 40) + "' is no size",
                   format("give WIDTHxHEIGHT in pixels, each %d to %d", kLeastSide, kMostSide));
}

Rgb parse_colour(const std::string& text) {
  if (text == "white") return {255, 255, 255};
  if (text == "black") return {0, 0, 0};
  if (text == "grey" || text == "gray") return {128, 128, 128};
  const std::string digits = text.starts_with('#') ? text.substr(1) : text;
  if (digits.size() == 6 &&
      digits.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos) {
    const auto number = static_cast<uint32_t>(std::strtoul(digits.c_str(), nullptr, 16));
    return {static_cast<uint8_t>(number >> 16), static_cast<uint8_t>(number >> 8 & 255),
            static_cast<uint8_t>(number & 255)};
  }
  throw InputError("", "--background '" + text.substr(0, 40) + "' is no colour",
                   "give white, black, grey or six digits such as '#e8f0ff'");
}

void check(const ViewOptions& o, ViewKind kind) {
  const auto refuse_if = [](bool given, const char* name, const char* where) {
    if (given) throw InputError("", std::string(name) + " " + where, "leave it out");
  };
  const ShowRequest& r = o.request;
  const char* page = "is for pictures: a page is turned and zoomed by hand";
  if (kind == ViewKind::page) {
    refuse_if(!o.size.empty(), "--size", page);
    refuse_if(o.from != "three-quarter", "--from", page);
    refuse_if(!r.look.empty(), "--look", page);
    refuse_if(o.zoom.has_value(), "--zoom", page);
    refuse_if(!o.background.empty(), "--background", page);
  }
  if (kind != ViewKind::picture) {
    refuse_if(r.frame.has_value(), "--frame", "is for one picture (.png), not for an animation");
    refuse_if(r.seconds.has_value(), "--time", "is for one picture (.png), not for an animation");
  } else {
    refuse_if(o.every.has_value(), "--every", "is for animations, not for one picture");
  }
  refuse_if(r.frame && r.seconds, "--frame", "contradicts --time");
  const double most = kind == ViewKind::gif ? kGifFps : 240;
  if (o.fps && !(*o.fps >= 1 && *o.fps <= most))
    throw InputError("", "--fps is out of range", format("give 1 to %g frames per second", most));
  if (o.every && !(*o.every >= 1 && *o.every <= 100'000))
    throw InputError("", "--every is out of range", "give a whole number, 1 to 100000");
  if (o.zoom && !(*o.zoom >= 0.1 && *o.zoom <= 50))
    throw InputError("", "--zoom is out of range", "give 0.1 to 50");
  if (r.scale && !(*r.scale >= 1e-9 && *r.scale <= 1e6))
    throw InputError("", "--scale is out of range", "give metres per unit, 1e-9 to 1e6");
}

FilmOptions film_options(const ViewOptions& o, const Showing& view, ViewKind kind) {
  FilmOptions out;
  out.height = kind == ViewKind::picture ? kPictureHeight : kAnimationHeight;
  if (!o.size.empty()) std::tie(out.width, out.height) = parse_size(o.size);
  if (!o.background.empty()) out.background = parse_colour(o.background);
  out.azimuth = view.facing + azimuth_of(o.from);
  out.zoom = o.zoom.value_or(1);
  out.close_up = view.close_up;
  return out;
}

std::vector<size_t> all_frames(const Clip& clip, size_t every) {
  std::vector<size_t> out;
  for (size_t f = 0; f < clip.frames.size(); f += every) out.push_back(f);
  return out;
}

/// The file's bytes, and the size of its pictures.
std::string animation(const Film& film, const Clip& clip, ViewKind kind) {
  std::unique_ptr<AnimationWriter> writer;
  if (kind == ViewKind::webp) {
    writer = webp_writer(clip.fps);
  } else {
    constexpr size_t kSamples = 6;
    std::vector<Image> samples;
    film.draw(all_frames(clip, (clip.frames.size() + kSamples - 1) / kSamples),
              [&](const Image& image) { samples.push_back(image); });
    writer = gif_writer(clip.fps, samples);
  }
  SlowWork slow;
  size_t done = 0;
  film.draw(all_frames(clip, 1), [&](const Image& image) {
    writer->push(image);
    slow.on(format("drawing frame %zu of %zu", ++done, clip.frames.size()));
  });
  return writer->finish();
}

/// Opens the page by the desktop's own program.
void open_page(const std::string& page) {
  std::string program = "xdg-open", place = page;
  char* words[] = {program.data(), place.data(), nullptr};
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&files, stream, "/dev/null", 1, 0);
  pid_t pid = 0;
  int status = 0;
  const int code = posix_spawnp(&pid, "xdg-open", &files, nullptr, words, environ);
  posix_spawn_file_actions_destroy(&files);
  while (code == 0 && ::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  if (code != 0 || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw WorkError(page + ": no program opened the page; open it in a browser");
}

void check_display() {
  const auto is_set = [](const char* name) {
    const char* value = std::getenv(name);
    return value != nullptr && *value != '\0';
  };
  if (!is_set("DISPLAY") && !is_set("WAYLAND_DISPLAY"))
    throw InputError("", "there is no display to show the page on",
                     "write a file: --out picture.png, animation.webp or page.html");
}

/// A new folder for the page of this file, which a browser may look at when we are gone.
std::string page_for(const std::string& file) {
  std::error_code error;
  std::string folder =
      (std::filesystem::temp_directory_path(error) / "restage-view-XXXXXX").string();
  if (error || ::mkdtemp(folder.data()) == nullptr)
    throw WorkError("no folder for the page can be made; give --out page.html");
  const std::string stem = std::filesystem::path(file).filename().stem().string();
  return folder + "/" + (stem.empty() ? "view" : stem) + ".html";
}

int run_view(const ViewOptions& given, const Common& common) {
  ViewOptions o = given;
  const ViewKind kind = o.out.empty() ? ViewKind::page : kind_of(o.out);
  check(o, kind);
  if (!o.size.empty()) parse_size(o.size);
  if (!o.background.empty()) parse_colour(o.background);
  const bool opens = o.out.empty();
  if (opens)
    check_display();
  else
    check_output(o.out, {o.request.path});
  o.request.single = kind == ViewKind::picture;
  o.request.every = o.every.value_or(1);
  o.request.max_memory = common.max_memory;
  o.request.fps = o.fps;
  if (!o.fps && kind == ViewKind::gif && !o.every) o.request.fps = kUsualGifFps;
  Showing view = read_showing(o.request);
  if (kind == ViewKind::gif && view.clip.fps > kGifFps)
    throw InputError(o.request.path,
                     format("has %g frames per second, more than GIF can show", view.clip.fps),
                     format("give --fps up to %g, or write .webp", kGifFps));
  const double longest = kind == ViewKind::gif ? 600 : 16000;  // seconds that files can state
  if ((kind == ViewKind::gif || kind == ViewKind::webp) && view.clip.fps * longest < 1)
    throw InputError(o.request.path, format("would show each frame for %.0f s", 1 / view.clip.fps),
                     "give a smaller --every, or a larger --fps");
  const std::string name = std::filesystem::path(o.request.path).filename().string();
  view.clip.label = view.animation.empty() ? name : name + ": " + view.animation;
  Json document = {{"out", o.out}};
  if (kind == ViewKind::page) {
    if (opens) o.out = page_for(o.request.path);
    PageOptions page;
    page.fps = view.clip.fps;
    page.title = name;
    write_page(o.out, {view.clip}, page);
  } else {
    const Film film(view.clip, film_options(o, view, kind), view.remarks);
    document["width"] = film.width();
    document["height"] = film.height();
    if (kind == ViewKind::picture)
      film.draw({0}, [&](const Image& image) { write_png(o.out, image); });
    else
      write_file_atomically(o.out, animation(film, view.clip, kind));
  }
  for (const std::string& remark : view.remarks) log_warning(remark);
  std::error_code error;
  document["out"] = o.out;
  document["bytes"] = std::filesystem::file_size(o.out, error);
  document["frames"] = view.clip.frames.size();
  document["fps"] = view.clip.fps;
  document["clip"] = view.animation.empty() ? Json() : Json(view.animation);
  print(common.json, document, "wrote " + o.out + "\n");
  if (opens) open_page(o.out);
  return 0;
}

}  // namespace

void add_view(Program& program) {
  auto [app, options] = program.add(
      "view", "show any character, motion or scan: a picture, an animation or a page",
      "restage view hero_dancing.vrm                          # in the browser\n"
      "restage view hero_dancing.vrm --out dance.webp         # for a README or a chat\n"
      "restage view hero.glb --clip Walk --fps 12 --size 320x320 --out walk.gif\n"
      "restage view hero.glb --look hands --from front --out hands.png\n"
      "restage view hero.glb --frame 40 --background black --out still.png\n"
      "restage view hero.glb --time 1.5 --zoom 1.2 --bones names.yaml --out still.png\n"
      "restage view walk.bvh --every 2 --out walk.webp\n"
      "restage view scans/ --up z --scale mm --out scans.webp\n"
      "restage view motions.h5 --sequence 3 --out motion.gif\n"
      "restage view result.h5 --out page.html",
      run_view);
  ShowRequest& r = options.request;
  app.add_option(
         "FILE", r.path,
         "glTF (.glb, .gltf, .vrm, .vrma), FBX, BVH, AMC, AMASS (.npz), a result, scans or motions "
         "(HDF5), PLY, OBJ, or a folder of frames")
      .required();
  app.add_option("--out", options.out,
                 "picture.png, animation.webp, animation.gif or page.html (default: a page in the "
                 "browser)");
  app.add_option("--clip", r.clip,
                 "animation of a glTF file (default: the last that restage wrote, else the first)");
  app.add_option("--frame", r.frame, "frame of a picture, from 0 (default: the middle one)");
  app.add_option("--time", r.seconds, "the same in seconds");
  app.add_option("--fps", options.fps,
                 "frames per second of the animation (default: the file's or 30; GIF: 15)");
  app.add_option("--every", options.every, "one frame in so many");
  app.add_option("--size", options.size,
                 "WIDTHxHEIGHT in pixels (default: 720 high, animations 480, as wide as needed)");
  app.add_option("--from", options.from, "where the camera stands, seen from the character")
      .one_of({"front", "left", "right", "back", "three-quarter"})
      .show_default();
  app.add_option("--look", r.look, "a close up")
      .one_of({"head", "hands", "left-hand", "right-hand", "feet"});
  app.add_option("--zoom", options.zoom, "everything so many times as large (1)");
  app.add_option("--background", options.background, "white, black, grey or '#rrggbb'");
  app.add_option("--bones", r.bones, "names of a rig that is not recognised (docs/formats.md)");
  app.add_option("--sequence", r.sequence, "which sequence of an HDF5 file, from 0");
  app.add_option("--up", r.up,
                 "axis of scans and recordings that points up: x, -x, y, -y, z or -z");
  add_scale(app, r.scale, "units of scans and recordings in metres");
}

}  // namespace restage::cli
