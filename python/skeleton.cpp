// restage.Extractor: the 22 joints of clouds, as the command `skeleton` finds them.
#include <filesystem>
#include <mutex>

#include "autograd/kernels/kernel.h"
#include "datasets/doctor/examine.h"
#include "datasets/readers/sha256.h"
#include "experiments/cli/perform/standard_weights.h"
#include "nn/models/extraction.h"
#include "nn/weights/bundle.h"
#include "python/arrays.h"

namespace restage::python {
namespace {

class PyExtractor {
 public:
  using Bound = void;
  PyExtractor(const py::object& weights, int samples, uint64_t seed, const std::string& device)
      : samples_(samples), seed_(seed), device_(device), key_(RngKey{seed, 0}.fold("skeleton")) {
    if (samples < 1 || samples > 256)
      throw InputError("", "samples is out of range", "give a number from 1 to 256");
    const std::string path = weights.is_none() ? "" : path_of(weights);
    const py::gil_scoped_release released;
    const std::string file = path.empty() ? cli::standard_weights() : path;
    if (!path.empty()) path_ = std::filesystem::absolute(path).string();
    models_ = load_bundle(file);
    auto& model = models_.need_as<SkeletonModel>("skeleton", weights_path(file));
    move_module(model, device_of(device));
    definition_ = joint_definition(models_.only({"skeleton"}), file);
    extract_.emplace(model, LookOptions{.samples = samples, .any_size = true, .any_way_up = true});
  }

  py::tuple operator()(const py::object& points, const std::string& name) {
    const Points cloud = some_cloud_of(points, name).points;
    check_frame(cloud, name, FrameMends::none);
    SeenJoints seen;
    {
      const py::gil_scoped_release released;
      const std::lock_guard<std::mutex> lock(mutex_);
      seen = (*extract_)(cloud, name, key_);
    }
    if (!seen.uncertainty) return py::make_tuple(array_of(seen.joints), py::none());
    const auto radius = radius_of_90(*seen.uncertainty);
    std::vector<double> flat(radius.begin(), radius.end());
    return py::make_tuple(array_of(seen.joints), array_of<double>(std::move(flat), {kJoints}));
  }

  const JointDefinition& definition() const { return definition_; }

  /// What pickle and copy carry: where the weights are, and what must be there.
  py::tuple state() const {
    const py::object path =
        path_.empty() ? py::none()
                      : py::reinterpret_steal<py::object>(PyUnicode_DecodeFSDefault(path_.c_str()));
    return py::make_tuple(path, samples_, seed_, device_, sum());
  }
  static std::unique_ptr<PyExtractor> of_state(const py::tuple& state) {
    if (state.size() != 5) throw py::value_error("this is no state of an Extractor");
    auto out = std::make_unique<PyExtractor>(
        state[0], state[1].cast<int>(), state[2].cast<uint64_t>(), state[3].cast<std::string>());
    if (out->sum() != state[4].cast<std::string>())
      throw InputError(out->path_.empty() ? "the standard weights" : out->path_,
                       "are other weights than those of the Extractor that was pickled",
                       "give the old file back, or make a new Extractor");
    return out;
  }

 private:
  std::string sum() const {
    const py::gil_scoped_release released;
    return sha256(identity_bytes(models_.only({"skeleton"})));
  }

  std::string path_;  // empty: the standard weights
  int samples_;
  uint64_t seed_;
  std::string device_;
  std::mutex mutex_;
  Bundle models_;
  JointDefinition definition_;
  const RngKey key_;
  std::optional<JointExtractor> extract_;
};

/// Frames of joints [.., 22, 3].
py::array convert_joints(const py::object& given, const std::string& from, const std::string& to) {
  const auto in = numbers<double>(given, "joints");
  const py::ssize_t n = in.ndim();
  if (n < 2 || in.shape(n - 2) != kJoints || in.shape(n - 1) != 3)
    throw InputError("joints", "are not skeletons", "give an array [..., 22, 3], metres");
  std::vector<double> values(in.data(), in.data() + in.size());
  JointConversion(from, to, "joints").convert(values);
  return array_of<double>(std::move(values), {in.shape(), in.shape() + n});
}

}  // namespace

void add_skeleton(py::module_& m) {
  py::class_<PyExtractor>(m, "Extractor", R"(The 22 joints of clouds, each by itself.

weights: a file or a run, None: the standard weights; samples: views of a cloud that are averaged;
device: "cpu", or "cuda" where it is built in. pickle and copy carry the name of the weights' file, which is read again.)")
      .def(py::init<const py::object&, int, uint64_t, const std::string&>(),
           py::arg("weights") = py::none(), py::arg("samples") = 1, py::arg("seed") = 0,
           py::arg("device") = "cpu")
      .def_property_readonly(
          "joint_definition", &PyExtractor::definition,
          "Which joints they are: \"makehuman\", \"smpl\" ...; \"\": the weights do not say.")
      .def("__call__", &PyExtractor::operator(), py::arg("points"), py::arg("name") = "cloud",
           "points [n, 3], metres, y up -> joints float64 [22, 3], in the cloud's own frame, and "
           "the radius about each that should hold the true one nine times in ten, float64 [22] "
           "in metres, or None.")
      .def(py::pickle([](const PyExtractor& e) { return e.state(); }, &PyExtractor::of_state));
  m.def("array_or_same", &array_or_same);
  m.def("convert_joints", &convert_joints, py::arg("joints"), py::arg("source"), py::arg("target"),
        "Joints [..., 22, 3] of one definition as those of another, float64. Of \"makehuman\" (the "
        "shipped weights) and \"smpl\" (docs/joints.md).");
}

}  // namespace restage::python
