#include "experiments/cli/doctor/doctor_report.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "datasets/readers/clouds/precision.h"
#include "infer/render/figures.h"

namespace restage::cli {
namespace {

constexpr uint32_t kPerson = 0x4a8bc9, kStray = 0xd23c3c, kOther = 0xe8892a, kMark = 0x3a9d5d;

std::string digits(double x) { return format("%.6g", x == 0 ? 0.0 : x); }  // no minus zero

// ---- picture -----------------------------------------------------------------------------------

/// Points along a line, as a mark.
Points dotted(const Point& from, const Point& to) {
  Points out;
  const int n = std::max(2, static_cast<int>((to - from).norm() / 0.012f));
  for (int i = 0; i <= n && n < 2000; ++i)
    out.push_back(from + (to - from) * (static_cast<float>(i) / static_cast<float>(n)));
  return out;
}

void append(Points& to, const Points& from) { to.insert(to.end(), from.begin(), from.end()); }

/// The person's surface or points, what else there is, and stray points, moved by `move`.
template <class Move>
std::vector<FigureLayer> layers_of(const Mesh& mesh, Move&& move) {
  FigureLayer person{{}, mesh.faces, kPerson}, stray{{}, {}, kStray}, other{{}, {}, kOther};
  const Points points = shape_points(mesh);
  const Parts parts = find_parts(points);
  for (size_t i = 0; i < points.size(); ++i) {
    FigureLayer& to = parts.part[i] == Part::stray   ? stray
                      : parts.part[i] == Part::other ? other
                                                     : person;
    if (mesh.faces.empty() || &to != &person) to.points.push_back(move(points[i]));
  }
  if (!mesh.faces.empty())
    for (const Point& p : mesh.vertices) person.points.push_back(move(p));
  return {person, other, stray};
}

/// Height beside the person and an arrow on the floor where they face.
FigureLayer marks(const FigureLayer& person, const Diagnosis& d) {
  const Vec3 x = Vec3::UnitX(), z = Vec3::UnitZ();
  const auto middle = static_cast<float>(quantile(person.points, x, 0.5)),
             side = std::min(static_cast<float>(quantile(person.points, x, 0.995)) + 0.1f,
                             middle + 0.5f),  // within arms stretched out
      depth = static_cast<float>(quantile(person.points, z, 0.5)),
             front = static_cast<float>(quantile(person.points, z, 0.99) + 0.4),
             top = static_cast<float>(d.height);
  FigureLayer out{{}, {}, kMark};
  append(out.points, dotted({side, 0, depth}, {side, top, depth}));
  append(out.points, dotted({side - 0.06f, top, depth}, {side + 0.06f, top, depth}));
  if (d.orientation.facing_sure >= 0.5) {
    append(out.points, dotted({middle, 0.01f, depth}, {middle, 0.01f, front}));
    for (const float aside : {-0.07f, 0.07f})
      append(out.points, dotted({middle, 0.01f, front}, {middle + aside, 0.01f, front - 0.12f}));
  }
  return out;
}

/// Points that were single precision far from the origin lie on a grid, where they are farthest.
bool on_grid(const Points& points, const Vec3& origin) {
  Eigen::Index axis = 0;
  origin.cwiseAbs().maxCoeff(&axis);
  const double step = rounding_step({Point::Constant(static_cast<float>(origin[axis]))});
  return std::all_of(points.begin(), points.end(), [&](const Point& p) {
    return std::remainder(static_cast<double>(p[axis]), step) == 0;
  });
}

}  // namespace

Json to_json(const Finding& f) {
  return {{"topic", f.topic}, {"weight", name(f.weight)}, {"what", f.what},
          {"sure", f.sure},   {"evidence", f.evidence},   {"fix", f.fix}};
}

Json frame_json(const Diagnosis& d) {
  const auto told = [](bool sure, Json value) { return sure ? value : Json(nullptr); };
  const bool unit = d.unit.sure >= 0.5, up = d.orientation.up_sure >= 0.5;
  const auto axis = [](int index) { return Json(kDirections[index]); };
  return {{"unit", told(unit && *d.unit.unit.name != 0, d.unit.unit.name)},
          {"metres_per_unit", told(unit, d.unit.unit.metres)},
          {"up", told(up, axis(d.orientation.up))},
          {"facing", told(up && d.orientation.facing_sure >= 0.5, axis(d.orientation.facing))},
          {"turned", told(up && d.orientation.facing_sure >= 0.5, d.orientation.turned)},
          {"height", told(d.transform.has_value(), d.height)}};
}

std::string to_text(const Finding& f) {
  std::string text = format("  %-6s%-16s", name(f.weight), f.topic.c_str()) + f.what;
  if (f.sure < 1) text += " (sure " + digits(std::floor(100 * f.sure)) + " %)";
  text += "\n";
  const std::string margin(24, ' ');
  if (!f.evidence.empty() && f.weight != Weight::fact) text += margin + "why: " + f.evidence + "\n";
  if (!f.fix.empty()) text += margin + "fix: " + f.fix + "\n";
  return text;
}

std::string to_text(const Similarity& t, const std::string& of) {
  const std::string what = of.empty() ? "  " : "  " + of + ": ";
  if (t.is_identity()) return what + "in our frame already\n";
  std::string text = what + "into our frame: p' = " + digits(t.scale) + " R (p - t), R = [";
  for (int i = 0; i < 3; ++i) {
    if (i > 0) text += "; ";
    for (int j = 0; j < 3; ++j) text += (j > 0 ? " " : "") + digits(t.rotation(i, j));
  }
  return text + "], t = [" + digits(t.offset.x()) + " " + digits(t.offset.y()) + " " +
         digits(t.offset.z()) + "]\n";
}

Json to_json(const Repaired& repaired) {
  Json out = {{"file", repaired.file},
              {"transform_file", nullptr},
              {"usable", repaired.still_wrong.empty()},
              {"still_wrong", Json::array()},
              {"remarks", repaired.remarks}};
  if (!repaired.transform_file.empty()) out["transform_file"] = repaired.transform_file;
  for (const Finding& f : repaired.still_wrong) out["still_wrong"].push_back(to_json(f));
  return out;
}

std::string to_text(const Repaired& repaired) {
  std::string text =
      "wrote " + repaired.file + (repaired.still_wrong.empty() ? "\n" : ", still not usable:\n");
  for (const Finding& f : repaired.still_wrong) text += to_text(f);
  for (const std::string& remark : repaired.remarks) text += "  " + remark + "\n";
  if (!repaired.transform_file.empty()) text += "wrote " + repaired.transform_file + "\n";
  return text;
}

std::string picture_of(const std::string& out, const std::string& title, const Mesh& mesh,
                       const Diagnosis& d) {
  if (!out.ends_with(".png")) throw InputError(out, "names no picture", "end --picture in .png");
  FigureSheetOptions options;
  options.cell_height = 360;
  options.title = title;
  // As it is: of a person's size and y upwards, whatever its unit and axes.
  const double size = d.size > 0 ? 0.39 / d.size : 1;
  Point middle;
  const Points points = shape_points(mesh);
  for (int axis = 0; axis < 3; ++axis)
    middle[axis] = static_cast<float>(quantile(points, direction(2 * axis), 0.5));
  Figure raw{
      layers_of(mesh,
                [&](const Point& p) { return Point((p - middle) * static_cast<float>(size)); }),
      "all of it as it is, y upwards", 32, 9, 0};
  raw.whole = true;
  raw.floor = static_cast<float>(quantile(raw.layers[0].points, Vec3::UnitY(), 0.003));
  std::vector<Figure> figures = {raw};
  if (d.transform) {
    std::vector<FigureLayer> layers = layers_of(mesh, *d.transform);
    layers.insert(layers.begin() + 1, marks(layers[0], d));
    const size_t framed = 3;  // person, marks, others; stray points may lie anywhere
    figures.push_back({layers, "front", 0, 4, 0, framed});
    figures.push_back({layers, "left side", 90, 4, 0, framed});
    figures.push_back({layers, "top", 0, 89, 0, framed});
  }
  for (const Finding& f : d.findings)
    options.lines.push_back(std::string(name(f.weight)) + ": " + f.topic + ": " + f.what +
                            (f.weight != Weight::fact && !f.fix.empty() ? " -> " + f.fix : ""));
  return png_bytes(figure_sheet(figures, options));
}

std::optional<Finding> far_from_origin(const Vec3& origin, const Points& points) {
  if (origin.isZero(0)) return std::nullopt;
  Finding f{"origin", Weight::wrong, "", 1, "", "--fix moves it to the origin"};
  f.what = format("lies around (%.7g %.7g %.7g), far from the origin", origin.x(), origin.y(),
                  origin.z());
  f.evidence = "retargeting works in single precision, which is too coarse there";
  if (on_grid(points, origin)) {
    f.what += ", and was rounded to the coarse steps of single precision there";
    f.fix = "export it again in double precision, or with an offset subtracted";
  }
  return f;
}

}  // namespace restage::cli
