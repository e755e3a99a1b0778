// Files that the program reads, as arrays: meshes, clouds, motions.
#include <variant>

#include "datasets/importers/motions/skeleton_take.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/frames/frame_folder.h"
#include "experiments/cli/perform/source_options.h"
#include "experiments/source.h"
#include "python/arrays.h"

namespace restage::python {
namespace {

py::tuple mesh(const py::object& path) {
  const std::string file = path_of(path);
  Mesh out;
  {
    const py::gil_scoped_release released;
    out = read_mesh(file);
  }
  return py::make_tuple(array_of(std::move(out.vertices)), array_of(std::move(out.faces)));
}

/// Of a file or a folder of clouds, all that can be read; None where a frame cannot.
py::list clouds(const py::object& path, const std::optional<int64_t>& sequence,
                const std::variant<double, std::string>& scale, const std::string& up) {
  SourceRecord how;
  how.path = path_of(path);
  how.sequence = sequence;
  const auto* unit = std::get_if<std::string>(&scale);
  how.scale = unit != nullptr ? cli::metres_per_unit(*unit) : std::get<double>(scale);
  how.up = up;
  std::vector<std::optional<Points>> read;
  Watch watch;
  watch.run([&] {
    Source source(how);
    while (auto cloud = source.next()) {
      watch();
      read.emplace_back();
      if (!cloud->fault) read.back() = std::move(cloud->frame.points);
    }
  });
  py::list out;
  for (auto& points : read)
    out.append(points ? py::object(array_of(std::move(*points))) : py::none());
  return out;
}

py::dict motion(const py::object& path, const std::string& clip, const std::string& bones,
                const std::string& person) {
  const std::string file = path_of(path);
  SkeletonTake take;
  {
    const py::gil_scoped_release released;
    std::string why;
    if (!holds_take(file, bones, &why))
      throw InputError(
          file, "holds no motion of a skeleton" + (why.empty() ? "" : ": " + why),
          "give BVH, AMC, glTF, VRM, AMASS, a pose estimator's file or our motions (.h5)");
    TakeOptions options;
    options.clip = clip;
    options.motion.profile = bones;
    options.person = person;
    take = read_take(file, options);
  }
  std::vector<double> joints;
  std::vector<float> rotations;
  for (const PosedSkeleton& f : take.frames) {
    for (const Vec3& p : f.joints) joints.insert(joints.end(), p.data(), p.data() + 3);
    append_rotations(f.global, rotations);
  }
  const auto f = std::ssize(take.frames);
  py::dict out;
  out["name"] = py::bytes(take.name).attr("decode")("utf-8", "replace");
  out["rest"] = array_of(take.rest);
  out["joints"] = array_of<double>(std::move(joints), {f, kJoints, 3});
  out["rotations"] = array_of<float>(std::move(rotations), {f, kJoints, 4});
  return out;
}

}  // namespace

void add_readers(py::module_& m) {
  m.def("load_mesh", &mesh);
  m.def("load_clouds", &clouds);
  m.def("load_motion", &motion);
}

}  // namespace restage::python
