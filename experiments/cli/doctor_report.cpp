#include "experiments/cli/doctor_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "datasets/readers/mesh_io.h"
#include "datasets/schema.h"
#include "infer/render/figures.h"
#include "infer/writers/frames.h"

namespace restage::cli {
namespace {

constexpr uint32_t kPerson = 0x4a8bc9, kStray = 0xd23c3c, kOther = 0xe8892a, kMark = 0x3a9d5d;

std::string digits(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", x == 0 ? 0.0 : x);  // no minus zero
  return text;
}

std::string name_of(const std::string& path) {
  const auto slash = path.find_last_of('/', path.find_last_not_of('/'));
  return slash == std::string::npos ? path : path.substr(slash + 1);
}

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

/// The person's surface or points, and what else there is, moved by `move`.
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
  std::vector<FigureLayer> out = {person};
  for (const FigureLayer& layer : {stray, other})
    if (!layer.points.empty()) out.push_back(layer);
  return out;
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

}  // namespace

Json to_json(const Finding& f) {
  return {{"topic", f.topic}, {"weight", name(f.weight)}, {"what", f.what},
          {"sure", f.sure},   {"evidence", f.evidence},   {"fix", f.fix}};
}

Json frame_json(const Diagnosis& d) {
  const auto told = [](bool sure, Json value) { return sure ? value : Json(nullptr); };
  const bool unit = d.unit.sure >= 0.5, up = d.orientation.up_sure >= 0.5;
  const auto axis = [](int index) { return Json(kDirections[static_cast<size_t>(index)]); };
  return {{"unit", told(unit && *d.unit.unit.name != 0, d.unit.unit.name)},
          {"metres_per_unit", told(unit, d.unit.unit.metres)},
          {"up", told(up, axis(d.orientation.up))},
          {"facing", told(up && d.orientation.facing_sure >= 0.5, axis(d.orientation.facing))},
          {"height", told(d.transform.has_value(), d.height)}};
}

Json to_json(const Similarity& t) {
  Json rotation = Json::array();
  for (int i = 0; i < 3; ++i)
    rotation.push_back({t.rotation(i, 0), t.rotation(i, 1), t.rotation(i, 2)});
  return {{"formula", "p' = scale * rotation * (p - offset)"},
          {"scale", t.scale},
          {"rotation", rotation},
          {"offset", {t.offset.x(), t.offset.y(), t.offset.z()}}};
}

std::string to_text(const Finding& f) {
  char head[64];
  std::snprintf(head, sizeof head, "  %-6s%-16s", name(f.weight), f.topic.c_str());
  std::string text = head + f.what;
  if (f.sure < 1) text += " (sure " + digits(std::floor(100 * f.sure)) + " %)";
  text += "\n";
  const std::string margin(24, ' ');
  if (!f.evidence.empty() && f.weight != Weight::fact) text += margin + "why: " + f.evidence + "\n";
  if (!f.fix.empty()) text += margin + "fix: " + f.fix + "\n";
  return text;
}

std::string to_text(const Similarity& t) {
  if (t.is_identity()) return "  in our frame already\n";
  std::string text = "  into our frame: p' = " + digits(t.scale) + " R (p - t), R = [";
  for (int i = 0; i < 3; ++i) {
    if (i > 0) text += "; ";
    for (int j = 0; j < 3; ++j) text += (j > 0 ? " " : "") + digits(t.rotation(i, j));
  }
  return text + "], t = [" + digits(t.offset.x()) + " " + digits(t.offset.y()) + " " +
         digits(t.offset.z()) + "]\n";
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
      "as it is, y upwards", 32, 9, 0};
  raw.floor = static_cast<float>(quantile(raw.layers[0].points, Vec3::UnitY(), 0.003));
  std::vector<Figure> figures = {raw};
  if (d.transform) {
    std::vector<FigureLayer> layers = layers_of(mesh, *d.transform);
    layers.push_back(marks(layers[0], d));
    figures.push_back({layers, "front", 0, 4, 0});
    figures.push_back({layers, "left side", 90, 4, 0});
    figures.push_back({layers, "top", 0, 89, 0});
  }
  for (const Finding& f : d.findings)
    options.lines.push_back(std::string(name(f.weight)) + ": " + f.topic + ": " + f.what +
                            (f.weight != Weight::fact && !f.fix.empty() ? " -> " + f.fix : ""));
  return png_bytes(figure_sheet(figures, options));
}

// ---- repair ------------------------------------------------------------------------------------

namespace {

/// Where frames go: an HDF5 file or a folder.
class FrameSink {
 public:
  FrameSink(const std::string& out, const FileInfo& info, double fps) {
    if (out.ends_with(".h5"))
      scans_.emplace(out, info, fps);
    else
      folder_.emplace(out, std::vector<Triangle>{});
    out_ = out;
  }
  void push(const Mesh& mesh) {
    if (mesh.vertices.empty())
      throw InputError(out_, "a frame would be empty", "leave it out of the input");
    if (folder_) return folder_->push(mesh.vertices, mesh.faces);
    if (!mesh.faces.empty())
      throw InputError(out_, "cannot hold surfaces", "give a folder to --fix");
    scans_->append(mesh.vertices);
  }
  void end_sequence() {
    if (scans_) scans_->end_sequence();
  }
  void commit() {
    if (scans_) scans_->commit();
    if (folder_) folder_->commit();
  }

 private:
  std::string out_;
  std::optional<ScanWriter> scans_;
  std::optional<FrameFolderWriter> folder_;
};

void write_frames(FrameSource& source, FrameSink& sink, const Diagnosis& d) {
  std::optional<Mesh> previous;
  int64_t sequence = 0;
  for (int64_t i = 0; const auto frame = source.next(); ++i) {
    if (frame->sequence != sequence) {
      if (i > 0) sink.end_sequence();
      sequence = frame->sequence;
      previous.reset();
    }
    if (i % d.keep_every != 0) continue;
    Mesh mesh = mended({frame->points, frame->faces}, d);
    // A gap of up to a second: the nearest frame in time stands in.
    const auto gap = d.gap.find(i);
    if (gap != d.gap.end() && previous && static_cast<double>(gap->second) <= d.fps)
      for (int64_t k = 0; k < gap->second; ++k) sink.push(2 * k < gap->second ? *previous : mesh);
    sink.push(mesh);
    previous = std::move(mesh);
  }
  sink.commit();
}

bool is_hdf5(const std::string& path) { return path.ends_with(".h5") || path.ends_with(".hdf5"); }

}  // namespace

std::string write_repaired(const std::string& path, const std::string& out, const Diagnosis& d,
                           uint64_t max_memory) {
  if (!d.transform)
    throw InputError(path, "cannot be repaired: its up axis or its units cannot be told",
                     "say them with --up and --scale");
  Json note = to_json(*d.transform);
  note["from"] = name_of(path);
  FileInfo info;
  if (is_hdf5(path)) info.license = inspect(path).license;
  info.provenance = "repaired by restage doctor from " + name_of(path);
  info.transform = note.dump();
  const double fps = d.fps > 0 ? d.fps / d.keep_every : kFps;
  // Both files or none: the transform's is opened first and takes its place last.
  std::optional<AtomicFile> sidecar;
  const std::string sidecar_name =
      out.ends_with(".h5") ? "" : out.substr(0, out.find_last_not_of('/') + 1) + ".transform.json";
  if (!sidecar_name.empty()) {
    note["fps"] = fps;
    sidecar.emplace(sidecar_name);
    sidecar->write(note.dump(2) + "\n");
  }
  if (is_mesh_name(out)) {
    if (d.kind == "frames")
      throw InputError(out, "is one frame only", "give a folder or an .h5 file to --fix");
    const Mesh mesh = mended(read_mesh(path), d);
    out.ends_with("obj") || out.ends_with("OBJ") ? write_obj(out, mesh) : write_ply(out, mesh);
  } else {
    FrameSink sink(out, info, fps);
    write_frames(*open_frames(path, {"", max_memory}), sink, d);
  }
  if (sidecar) sidecar->commit();
  return sidecar_name;
}

}  // namespace restage::cli
