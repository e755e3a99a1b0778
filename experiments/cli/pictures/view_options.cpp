#include "experiments/cli/pictures/view_options.h"

#include <algorithm>
#include <cstdio>

#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "datasets/readers/gltf/gltf.h"
#include "datasets/readers/text/text.h"
#include "infer/render/animation.h"

namespace restage::cli {
namespace {

constexpr int kLeastSide = 16, kMostSide = 4096;

bool is_take(const std::string& path) {
  return is_gltf_name(path) || text::ends_in(path, {".bvh", ".amc"});
}

using Given = std::initializer_list<std::pair<bool, const char*>>;

/// The options of `list` that are given, and why they are refused.
void refuse(const Given& list, const char* why) {
  for (const auto& [given, name] : list)
    if (given) throw InputError("", std::string(name) + " " + why, "leave it out");
}

/// Options that the kind of picture has no use for.
void check_kind(const ViewOptions& o, ViewKind kind) {
  const ShowRequest& r = o.request;
  if (kind == ViewKind::page)
    refuse({{!o.size.empty(), "--size"},
            {!o.side.empty(), "--side"},
            {o.azimuth.has_value(), "--azimuth"},
            {!r.look.part.empty(), "--look"},
            {o.zoom.has_value(), "--zoom"},
            {!o.background.empty(), "--background"},
            {o.columns.has_value(), "--columns"}},
           "is for pictures, such as a sheet: a page is turned and zoomed by hand");
  if (kind == ViewKind::sheet)
    refuse({{!o.size.empty(), "--size"},
            {o.zoom.has_value(), "--zoom"},
            {!o.background.empty(), "--background"}},
           "is for a picture of one moment, not for a sheet of several");
  if (kind != ViewKind::picture)
    refuse({{r.frame.has_value(), "--frame"}, {r.seconds.has_value(), "--time"}},
           "is for one picture (.png), not for an animation or a sheet");
  else
    refuse({{o.every.has_value(), "--every"}, {!o.title.empty(), "--title"}},
           "is not for a picture of one moment");
  if (is_animation(kind))
    refuse({{o.compare == kRemembered, "--compare source"},
            {!o.beside.truth.empty(), "--truth"},
            {o.columns.has_value(), "--columns"},
            {!o.title.empty(), "--title"}},
           "is not for an animation: end --out in .png");
}

/// Options that belong to others which are not there.
void check_together(const ViewOptions& o) {
  const ShowRequest& r = o.request;
  const Comparison& c = o.beside;
  refuse({{r.frame && r.seconds, "--frame"}}, "contradicts --time");
  refuse({{!o.side.empty() && o.azimuth, "--side"}}, "contradicts --azimuth");
  refuse({{r.look.within && r.look.part.empty(), "--within"}}, "belongs to --look");
  if (o.two_takes() && is_take(o.compare))
    refuse({{c.fps.has_value(), "--source-fps"}, {c.sequence.has_value(), "--source-sequence"}},
           "does not go with two characters or recordings");
  else if (o.two_takes())
    return;
  else if (o.compares())
    refuse({{o.fps.has_value(), "--fps"},
            {o.every.has_value(), "--every"},
            {!r.bones.empty(), "--bones"}},
           "does not go with --compare and --truth");
  else
    refuse({{c.fps.has_value(), "--source-fps"},
            {c.scale.has_value(), "--source-scale"},
            {c.up.has_value(), "--source-up"},
            {c.clip.has_value(), "--source-clip"},
            {c.sequence.has_value(), "--source-sequence"}},
           "says how the file of --compare is read, and there is none");
}

void check_ranges(const ViewOptions& o, ViewKind kind) {
  const ShowRequest& r = o.request;
  const auto within = [](const char* name, const std::optional<double>& value, double least,
                         double most, const char* what) {
    if (value && !(*value >= least && *value <= most))
      throw InputError("", std::string(name) + " is out of range",
                       format("give %s, %g to %g", what, least, most));
  };
  const char* rate = "frames per second";
  within("--fps", o.fps, 1, kind == ViewKind::gif ? kGifFps : 240, rate);
  within("--source-fps", o.beside.fps, 1, 1000, rate);
  within("--zoom", o.zoom, 0.1, 50, "a factor");
  within("--scale", r.scale, 1e-9, 1e6, "metres per unit");
  within("--source-scale", o.beside.scale, 1e-9, 1e6, "metres per unit");
  within("--within", r.look.within, 1e-3, 10, "metres");
  within("--azimuth", o.azimuth, -360, 360, "degrees");
  if (o.every && !(*o.every >= 1 && *o.every <= 100'000))
    throw InputError("", "--every is out of range", "give a whole number, 1 to 100000");
  if (o.columns && !(*o.columns >= 1 && *o.columns <= 64))
    throw InputError("", "--columns " + std::to_string(*o.columns) + " is out of range",
                     "give a number from 1 to 64");
  if (!o.size.empty()) parse_size(o.size);
  if (!o.background.empty()) parse_colour(o.background);
  check_look(r.look);
}

}  // namespace

bool ViewOptions::two_takes() const {
  if (rows || !beside.truth.empty() || compare.empty() || compare == kRemembered) return false;
  const bool animation = text::ends_in(out, {".webp", ".gif"});
  return animation || (is_take(compare) && is_take(request.path));
}

ViewKind kind_of(const ViewOptions& o) {
  const auto ends = [&](const char* ending) { return o.out.ends_with(ending); };
  if (o.out.empty() || ends(".html")) return ViewKind::page;
  if (ends(".png"))
    return (o.compares() && !o.two_takes()) || o.columns ? ViewKind::sheet : ViewKind::picture;
  if (ends(".webp")) return ViewKind::webp;
  if (ends(".gif")) return ViewKind::gif;
  throw InputError(o.out, "names no picture, animation or page",
                   "end --out in .png, .webp, .gif or .html");
}

double azimuth_of(const ViewOptions& o) {
  if (o.azimuth) return *o.azimuth;
  if (o.side == "front") return 0;
  if (o.side == "left") return 90;
  if (o.side == "right") return -90;
  return o.side == "back" ? 180 : 32;
}

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

void check_view(const ViewOptions& o, ViewKind kind) {
  check_kind(o, kind);
  check_together(o);
  check_ranges(o, kind);
}

}  // namespace restage::cli
