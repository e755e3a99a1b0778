#include "infer/render/page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>

#include "autograd/base/atomic_file.h"
#include "autograd/base/base64.h"
#include "autograd/base/format.h"
#include "infer/render/html.h"
#include "infer/render/sheet.h"
#include "nn/geometry/box.h"

namespace restage {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kPage =
#include "infer/render/viewer/page.html.inc"
    ;
constexpr const char* kStyle =
#include "infer/render/viewer/style.css.inc"
    ;
constexpr const char* kScript =
#include "infer/render/viewer/viewer.js.inc"
    ;
/// Of the page of a stream only: other pages ask for nothing.
constexpr const char* kLiveScript =
#include "infer/render/viewer/live.js.inc"
    ;
constexpr const char* kErrorsBox =
    "<label><input id=\"errors\" type=\"checkbox\" checked> errors</label>\n";
constexpr size_t kMostStride = 4;         // every so many frames, before surfaces are thinned
constexpr size_t kFewestVertices = 1200;  // enough to recognise a person
constexpr float kReach = 4.0f;  // metres; points farther from a cloud's middle are left out
// Ends of the scale of errors, metres. A clip gets the first scale that holds 98 % of its errors.
constexpr double kErrorScales[] = {0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1};

std::string hex(uint32_t colour) { return format("#%06x", colour & 0xffffffu); }

// ---- thinning -----------------------------------------------------------------------------------

/// A thinned surface: the vertices that stay (empty: all of them) and the faces between them.
struct PageSurface {
  std::vector<int32_t> kept;
  std::vector<Triangle> faces;
};

/// Thins a surface: in the clip's first frame, one vertex stays of all vertices in a cell of a
/// grid.
PageSurface cluster(const Clip& clip, float cell) {
  PageSurface surface;
  std::map<std::array<int64_t, 3>, int32_t> cells;
  const Points& first = clip.frames[0];
  std::vector<int32_t> place(first.size());
  for (size_t v = 0; v < place.size(); ++v) {
    std::array<int64_t, 3> key;
    for (size_t k = 0; k < 3; ++k) key[k] = static_cast<int64_t>(std::floor(first[v][k] / cell));
    const auto [found, added] = cells.emplace(key, static_cast<int32_t>(surface.kept.size()));
    if (added) surface.kept.push_back(static_cast<int32_t>(v));
    place[v] = found->second;
  }
  std::set<Triangle> seen;
  for (const Triangle& f : clip.faces) {
    const Triangle moved = {place[f[0]], place[f[1]], place[f[2]]};
    if (moved[0] == moved[1] || moved[1] == moved[2] || moved[0] == moved[2]) continue;
    Triangle sorted = moved;
    std::sort(sorted.begin(), sorted.end());
    if (seen.insert(sorted).second) surface.faces.push_back(moved);
  }
  return surface;
}

/// Faces in the order in which they are drawn: those of one material together.
std::vector<Triangle> drawn_faces(const Clip& clip) {
  if (!clip.look) return clip.faces;
  std::vector<size_t> order(clip.faces.size());
  std::iota(order.begin(), order.end(), size_t{0});
  const std::vector<int32_t>& material = clip.look->material;
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return material[a] < material[b]; });
  std::vector<Triangle> out;
  out.reserve(order.size());
  for (const size_t f : order) out.push_back(clip.faces[f]);
  return out;
}

PageSurface thin(const Clip& clip, size_t vertices) {
  // A picture lies on all the vertices of its surface.
  if (clip.faces.empty() || clip.look || clip.frames[0].size() <= vertices)
    return {{}, drawn_faces(clip)};
  const float size = box_of(clip.frames[0]).sizes().norm();
  float cell = std::max(1e-6f, size / 400);
  PageSurface surface = cluster(clip, cell);
  while (surface.kept.size() > vertices && cell < size) {
    cell *= 1.2f;
    surface = cluster(clip, cell);
  }
  return surface;
}

struct Plan {
  size_t stride = 1, frames = 0;
  std::vector<PageSurface> surfaces;
  bool thinned = false;
};

size_t look_bytes(const Clip& clip) {
  if (!clip.look) return 0;
  size_t bytes = 30 * clip.look->uv.size();
  for (const PictureFile& picture : clip.look->pictures) bytes += picture.bytes.size() * 4 / 3;
  return bytes;
}

size_t text_bytes(const std::vector<Clip>& clips, const std::vector<PageSurface>& surfaces,
                  size_t frames, size_t max_points) {
  double bytes = 40000;
  for (size_t c = 0; c < clips.size(); ++c) {
    const size_t all = clips[c].frames[0].size();
    const size_t count = clips[c].faces.empty()     ? max_points
                         : surfaces[c].kept.empty() ? all
                                                    : surfaces[c].kept.size();
    bytes += 8.0 * static_cast<double>(count) * static_cast<double>(frames) +
             16.0 * static_cast<double>(surfaces[c].faces.size()) +
             (clips[c].errors.empty() ? 0 : 1.4 * static_cast<double>(count * frames)) +
             30.0 * static_cast<double>(frames) + static_cast<double>(look_bytes(clips[c]));
  }
  return static_cast<size_t>(bytes);
}

Plan make_plan(const std::vector<Clip>& clips, const PageOptions& options) {
  size_t length = clips[0].frames.size();
  for (const Clip& clip : clips) length = std::min(length, clip.frames.size());
  Plan plan;
  for (const Clip& clip : clips) plan.surfaces.push_back({{}, drawn_faces(clip)});
  const auto fits = [&] {
    plan.frames = (length + plan.stride - 1) / plan.stride;
    return text_bytes(clips, plan.surfaces, plan.frames, options.max_points) <= options.max_bytes;
  };
  while (!fits() && plan.stride < kMostStride) ++plan.stride;
  for (size_t vertices = 16384; !fits() && vertices >= kFewestVertices;
       vertices = vertices * 3 / 4) {
    plan.thinned = std::any_of(clips.begin(), clips.end(),
                               [](const Clip& c) { return !c.faces.empty() && !c.look; });
    for (size_t c = 0; c < clips.size(); ++c) plan.surfaces[c] = thin(clips[c], vertices);
  }
  while (!fits() && plan.frames > 2) plan.stride += (plan.stride + 3) / 4;
  return plan;
}

// ---- data ---------------------------------------------------------------------------------------

Points picked(const Clip& clip, const PageSurface& surface, size_t frame, size_t max_points) {
  const Points& all = clip.frames[frame];
  Points out;
  if (!clip.faces.empty()) {
    if (surface.kept.empty()) return all;
    for (const int32_t v : surface.kept) out.push_back(all[v]);
    return out;
  }
  const Point centre = clip_centre(all);
  for (const Point& p : all)
    if (p.allFinite() && (p - centre).cwiseAbs().maxCoeff() < kReach) out.push_back(p);
  if (out.empty()) out.push_back(centre);
  if (out.size() <= max_points) return out;
  for (size_t k = 0; k < max_points; ++k) out[k] = out[k * out.size() / max_points];
  out.resize(max_points);
  return out;
}

Json numbers(const Point& p) {
  Json list = Json::array();
  for (int k = 0; k < 3; ++k) list.push_back(std::round(double{p[k]} * 1e4) / 1e4);
  return list;
}

double error_scale(const FrameStore<float>& errors) {
  std::array<size_t, std::size(kErrorScales)> within{};
  size_t all = 0;
  for (const auto& frame : errors) {
    all += frame.size();
    for (size_t s = 0; s < within.size(); ++s)
      within[s] += std::count_if(frame.begin(), frame.end(),
                                 [&](double error) { return error <= kErrorScales[s]; });
  }
  for (size_t s = 0; s < within.size(); ++s)
    if (within[s] > all * 98 / 100) return kErrorScales[s];
  return kErrorScales[std::size(kErrorScales) - 1];
}

/// Errors as bytes, 255 being `scale`: of each frame that stays, and in a frame of each vertex that
/// stays.
std::vector<uint8_t> packed_errors(const Clip& clip, const PageSurface& surface, const Plan& plan,
                                   double scale) {
  std::vector<uint8_t> out;
  for (size_t f = 0; f < plan.frames; ++f) {
    const std::vector<float>& errors = clip.errors[f * plan.stride];
    const size_t count = surface.kept.empty() ? errors.size() : surface.kept.size();
    for (size_t v = 0; v < count; ++v) {
      const double e = errors[surface.kept.empty() ? v : static_cast<size_t>(surface.kept[v])];
      out.push_back(static_cast<uint8_t>(std::lround(255 * std::clamp(e / scale, 0.0, 1.0))));
    }
  }
  return out;
}

Json texture_meta(const Texture& texture) {
  static constexpr const char* kWrap[] = {"REPEAT", "MIRRORED_REPEAT", "CLAMP_TO_EDGE"};
  const auto& t = texture.transform;
  return {{"picture", texture.picture},
          {"across", kWrap[static_cast<size_t>(texture.across)]},
          {"down", kWrap[static_cast<size_t>(texture.down)]},
          {"nearest", texture.nearest},
          {"transform", {t(0, 0), t(1, 0), 0, t(0, 1), t(1, 1), 0, t(0, 2), t(1, 2), 1}}};
}

/// Materials that have faces, in the order of drawn_faces().
Json materials_meta(const Appearance& look) {
  std::vector<size_t> faces(look.materials.size());
  for (const int32_t m : look.material) ++faces[static_cast<size_t>(m)];
  Json list = Json::array();
  for (size_t m = 0; m < faces.size(); ++m) {
    const Material& material = look.materials[m];
    const Rgba& c = material.colour;
    const auto& glow = material.glow;
    static constexpr const char* kAlpha[] = {"opaque", "mask", "blend"};
    if (faces[m] > 0)
      list.push_back({{"faces", faces[m]},
                      {"colour", {c[0], c[1], c[2], c[3]}},
                      {"texture", texture_meta(material.texture)},
                      {"glow", {glow[0], glow[1], glow[2]}},
                      {"glow_texture", texture_meta(material.glow_texture)},
                      {"alpha", kAlpha[static_cast<size_t>(material.alpha)]},
                      {"cutoff", material.cutoff},
                      {"two_sided", material.two_sided},
                      {"unlit", material.unlit}});
  }
  return list;
}

std::string data_uri(const std::string& bytes) {
  const char* kind = bytes.starts_with("RIFF")   ? "image/webp"
                     : bytes.starts_with("\xff") ? "image/jpeg"
                                                 : "image/png";
  return std::string("data:") + kind + ";base64," + base64(bytes.data(), bytes.size());
}

/// An element of the page that holds bytes.
std::string script_data(const std::string& name, const void* bytes, size_t size) {
  return "<script id=\"" + name + "\" type=\"text/plain\">" + base64(bytes, size) + "</script>\n";
}

struct Packed {
  Json meta;
  std::string elements;               ///< script elements that hold the data
  float width = 0.5f, height = 0.5f;  ///< of the figure, metres
};

Packed pack(const Clip& clip, const PageSurface& surface, const Plan& plan, size_t number,
            const PageOptions& options) {
  std::vector<Points> frames;
  for (size_t f = 0; f < plan.frames; ++f)
    frames.push_back(picked(clip, surface, f * plan.stride, options.max_points));
  Box box;
  for (const Points& points : frames) box.extend(box_of(points));
  const Point low = box.min(), high = box.max();
  const Eigen::Vector3d step = ((high - low).cast<double>() / 65535.0).cwiseMax(1e-9);
  Packed packed;
  const float floor = clip_floor(clip);
  std::vector<Point> centres;
  centres.reserve(frames.size());
  for (const Points& points : frames) centres.push_back(clip_centre(points));
  centres = calm_centres(centres, options.fps / static_cast<double>(plan.stride));
  std::vector<uint16_t> data;
  Json counts = Json::array(), middles = Json::array();
  size_t most = 1;
  for (size_t f = 0; f < frames.size(); ++f) {
    counts.push_back(frames[f].size());
    middles.push_back(numbers(centres[f]));
    most = std::max(most, frames[f].size());
    const ClipReach reach = clip_reach(frames[f], floor);
    for (const Point& p : frames[f]) {
      for (int k = 0; k < 3; ++k)
        data.push_back(static_cast<uint16_t>(
            std::lround(std::clamp((double{p[k]} - double{low[k]}) / step[k], 0.0, 65535.0))));
      packed.height = std::max(packed.height, std::min(p.y() - floor, reach.high));
      const Point aside = p - centres[f];
      packed.width =
          std::max(packed.width, std::min(2 * std::hypot(aside.x(), aside.z()), 2 * reach.aside));
    }
  }
  const double radius = std::clamp(0.42 * std::sqrt(1.8 / static_cast<double>(most)), 0.004, 0.016);
  packed.meta = {{"label", clip.label},
                 {"colour", hex(kClipColours[number])},
                 {"floor", floor},
                 {"radius", radius},
                 {"low", {low.x(), low.y(), low.z()}},
                 {"step", {step.x(), step.y(), step.z()}},
                 {"faces", surface.faces.size()},
                 {"counts", counts},
                 {"centres", middles}};
  if (!clip.confidence.empty()) {
    Json& list = packed.meta["confidence"] = Json::array();
    for (size_t f = 0; f < plan.frames; ++f)
      list.push_back(std::round(clip.confidence[f * plan.stride] * 1e3) / 1e3);
  }
  const auto element = [&](const char* name, const void* bytes, size_t size) {
    packed.elements += script_data(name + std::to_string(number), bytes, size);
  };
  element("frames", data.data(), data.size() * 2);
  if (!surface.faces.empty()) element("faces", surface.faces.data(), surface.faces.size() * 12);
  if (clip.look) {
    const Appearance& look = *clip.look;
    packed.meta["materials"] = materials_meta(look);
    packed.meta["pictures"] = look.pictures.size();
    for (size_t k = 0; k < look.pictures.size(); ++k)
      packed.elements += "<script id=\"picture" + std::to_string(number) + "_" + std::to_string(k) +
                         "\" type=\"text/plain\">" + data_uri(look.pictures[k].bytes) +
                         "</script>\n";
    if (!look.uv.empty()) element("uv", look.uv.data(), look.uv.size() * sizeof(Uv));
    if (!look.smooth.empty()) element("smooth", look.smooth.data(), look.smooth.size() * 4);
    std::vector<uint8_t> colours;
    for (const Rgba& c : look.colours)
      for (int k = 0; k < 4; ++k)
        colours.push_back(static_cast<uint8_t>(std::lround(255 * std::clamp(c[k], 0.0f, 1.0f))));
    if (!colours.empty()) element("colours", colours.data(), colours.size());
  }
  if (!clip.errors.empty()) {
    const double scale = error_scale(clip.errors);
    packed.meta["error_scale"] = scale;
    const std::vector<uint8_t> errors = packed_errors(clip, surface, plan, scale);
    element("errors", errors.data(), errors.size());
  }
  return packed;
}

std::string error_legend(const Clip& clip) {
  return format("<small class=\"scale\" hidden>off by 0 <i></i> %g cm</small>",
                100 * error_scale(clip.errors));
}

std::string note_of(const Plan& plan, bool errors) {
  std::string note;
  if (plan.stride > 1) note += " Holds one frame in " + std::to_string(plan.stride) + ".";
  if (plan.thinned) note += " Surfaces are thinned to keep the page small.";
  if (errors) note += " Colours: how far each vertex is off once the frame is aligned (PA-MPVD).";
  return note;
}

std::string script(bool live) {
  std::string out = kScript;
  const std::string_view mark = "// @LIVE@\n";
  return out.replace(out.find(mark), mark.size(), live ? kLiveScript : "");
}

}  // namespace

std::string page_html(const std::vector<Clip>& clips, const PageOptions& options) {
  check_clips("", clips);
  const Plan plan = make_plan(clips, options);
  Json meta = {{"fps", options.fps}, {"stride", plan.stride}};
  std::string data, panels, description = "Views side by side: ";
  float width = 0, height = 0;
  Json list = Json::array();
  for (size_t c = 0; c < clips.size(); ++c) {
    Packed packed = pack(clips[c], plan.surfaces[c], plan, c, options);
    list.push_back(std::move(packed.meta));
    data += packed.elements;
    width = std::max(width, packed.width);
    height = std::max(height, packed.height);
    const std::string label = escape_html(clips[c].label);
    panels += std::string("<div class=\"panel") + (options.labels_below ? " below" : "") +
              "\" id=\"panel" + std::to_string(c) +
              "\"><span><i style=\"background:" + hex(kClipColours[c]) + "\"></i>" + label +
              "<b></b></span>" + (clips[c].errors.empty() ? "" : error_legend(clips[c])) +
              "</div>\n";
    description += (c > 0 ? "; " : "") + label;
  }
  const bool any_errors = std::any_of(clips.begin(), clips.end(),
                                      [](const Clip& clip) { return !clip.errors.empty(); });
  std::string notes;
  for (const std::string& note : options.notes) notes += "<p>" + escape_html(note) + "</p>\n";
  if (options.live) meta["live"] = true;
  if (options.live && !options.live_vertex.empty()) {
    meta["sent"] = options.sent;
    data += script_data("taken0", options.live_vertex.data(), options.live_vertex.size() * 4);
  }
  meta["width"] = width;
  meta["height"] = height;
  meta["clips"] = std::move(list);
  return fill_page(kPage,
                   {{"TITLE", escape_html(options.title)},
                    {"STYLE", kStyle},
                    {"DESCRIPTION", description},
                    {"PANELS", panels},
                    {"NOTE", note_of(plan, any_errors)},
                    {"NOTES", notes},
                    {"ERRORS", any_errors ? kErrorsBox : ""},
                    {"META", script_json(meta.dump(-1, ' ', true, Json::error_handler_t::replace))},
                    {"DATA", data},
                    {"SCRIPT", script(options.live)}});
}

void write_page(const std::string& path, const std::vector<Clip>& clips,
                const PageOptions& options) {
  write_file_atomically(path, page_html(clips, options));
}

}  // namespace restage
