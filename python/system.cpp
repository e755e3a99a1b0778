// restage.System: clouds in, frames out, one at a time.
#include "infer/system.h"

#include <chrono>
#include <cstring>
#include <mutex>

#include "datasets/doctor/examine.h"
#include "experiments/cli/perform/retarget.h"
#include "experiments/cli/perform/source_options.h"
#include "experiments/source.h"
#include "python/arrays.h"
#include "python/copies.h"

namespace restage::python {
namespace {

/// A frame of the result, for itself: nothing of the system is needed any more.
struct Frame {
  using Bound = void;
  Points vertices;
  std::vector<float> joints, rotations;
  std::optional<double> confidence;
  bool filled = false;

  Frame() = default;
  explicit Frame(const RetargetedFrame& f)
      : vertices(f.vertices), confidence(f.confidence), filled(f.filled) {
    if (!f.joints) return;
    append_joints(*f.joints, joints);
    append_rotations(to_global(f.pose.local), rotations);
  }
};
using Frames = std::vector<std::shared_ptr<Frame>>;

/// An array over numbers of a frame, which it keeps alive.
py::object view(const py::object& frame, const float* data, std::vector<py::ssize_t> shape) {
  return py::array_t<float>(std::move(shape), data, frame);
}

class PySystem {
 public:
  using Bound = void;
  PySystem(const py::object& target, const py::object& weights, const py::dict& options) {
    Words given = words_of(options);
    given.words.push_back("--target=" + path_of(target));
    if (!weights.is_none()) given.words.push_back("--weights=" + path_of(weights));
    Watch watch;
    watch.run([&] {
      run_command("retarget", given, [&](cli::Program& program) {
        const auto make_it = [&] { return make(program.common()), 0; };
        cli::add_live_options(program.add("retarget", "", "", make_it), c_);
      });
    });
  }

  Frames push_all(const py::object& points, const std::string& name) {
    Frames out;
    push(points, name, into(out));
    return out;
  }
  /// The newest frame; null: none is finished.
  std::shared_ptr<Frame> push_newest(const py::object& points, const std::string& name) {
    std::shared_ptr<Frame> out;
    push(points, name, [&](const RetargetedFrame& f) { out = std::make_shared<Frame>(f); });
    return out;
  }
  Frames finish() {
    Frames out;
    locked([&] { system_->finish(into(out)); });
    return out;
  }
  void miss() {
    locked([&] { system_->miss(); });
  }
  void restart() {
    locked([&] { system_->restart(); });
  }

  py::object target_vertices() const { return array_of(Points(system_->target().vertices)); }
  py::object faces() const { return array_of(std::vector<Triangle>(system_->target().faces)); }
  py::object rest_joints() const {
    const Joints* joints = system_->target_joints();
    return joints == nullptr ? py::none() : py::object(array_of(*joints));
  }
  py::object source_joints() {
    std::optional<Joints> seen;
    locked([&] {
      if (const Joints* joints = system_->source_joints()) seen = *joints;
    });
    return seen ? py::object(array_of(*seen)) : py::none();
  }

  size_t points_left_out() {
    return locked([&] { return left_out_; });
  }

  py::dict times() {
    FrameTimes t;
    double frame = 0;
    locked([&] { t = system_->times(), frame = frame_seconds_; });
    py::dict out;
    out["extract"] = t.extract, out["motion"] = t.motion, out["deformation"] = t.deformation;
    out["frame"] = frame;
    return out;
  }

 private:
  static System::Show into(Frames& out) {
    return [&out](const RetargetedFrame& f) { out.push_back(std::make_shared<Frame>(f)); };
  }

  void push(const py::object& points, const std::string& name, const System::Show& show) {
    Cloud given = some_cloud_of(points, name);
    locked([&] {
      const auto start = std::chrono::steady_clock::now();
      Points& cloud = given.points;
      left_out_ += given.left_out;
      to_ours_->clean(cloud);
      door_->pass(cloud, name, [&] { system_->push(cloud, name, show); });
      frame_seconds_ =
          std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    });
  }

  void make(const cli::Common& common) {
    cli::check_options(c_.options, system_type(c_.system));
    to_ours_.emplace(c_.source.scale, c_.source.up);
    door_.emplace(frame_of(c_.source), c_.options.force);
    if (c_.source.fps && !(*c_.source.fps >= 1 && *c_.source.fps <= 1000))
      throw InputError("", "fps is out of range", "give the clouds' frames per second, 1 to 1000");
    SystemInput input = cli::load_input(c_, common);
    if (c_.source.fps) input.options.fps = *c_.source.fps;
    TargetMesh target = read_target(c_.target, c_.bones);
    cli::check_mesh(c_, target);
    system_ = cli::system_for(c_, std::move(input), target);
  }

  /// One caller at a time; Python's other threads go on.
  template <class Work>
  auto locked(const Work& work) -> decltype(work()) {
    const py::gil_scoped_release released;
    const std::lock_guard<std::mutex> lock(mutex_);
    return work();
  }

  std::mutex mutex_;
  double frame_seconds_ = 0;  // of C++ in the last push
  size_t left_out_ = 0;
  cli::RetargetCommand c_;
  std::optional<ToOurs> to_ours_;
  std::optional<CloudDoor> door_;
  std::unique_ptr<System> system_;
};

/// What pickle and copy carry: bytes of the arrays, confidence, filled.
py::tuple state_of(const Frame& f) {
  const auto bytes = [](const auto& values) {
    return py::bytes(reinterpret_cast<const char*>(values.data()),
                     values.size() * sizeof(values[0]));
  };
  return py::make_tuple(bytes(f.vertices), bytes(f.joints), bytes(f.rotations), f.confidence,
                        f.filled);
}

std::shared_ptr<Frame> frame_of(const py::tuple& state) {
  constexpr size_t kParts = 5;
  if (state.size() != kParts) throw py::value_error("this is no frame of restage");
  const auto fill = [&](size_t part, auto& values) {
    const auto bytes = state[part].cast<std::string_view>();
    values.resize(bytes.size() / sizeof(values[0]));
    if (!values.empty())
      std::memcpy(static_cast<void*>(values.data()), bytes.data(),
                  values.size() * sizeof(values[0]));
  };
  auto out = std::make_shared<Frame>();
  fill(0, out->vertices), fill(1, out->joints), fill(2, out->rotations);
  const auto whole = [](const auto& v, size_t n) { return v.empty() || v.size() == n; };
  if (!whole(out->joints, 3 * kJoints) || !whole(out->rotations, 4 * kJoints))
    throw py::value_error("this is no frame of restage");
  out->confidence = state[3].cast<std::optional<double>>();
  out->filled = state[4].cast<bool>();
  return out;
}

void add_frame(py::module_& m) {
  const auto joints = [](const py::object& self, std::vector<float> Frame::*of, int width) {
    const auto& values = self.cast<Frame&>().*of;
    return values.empty() ? py::none() : view(self, values.data(), {kJoints, width});
  };
  py::class_<Frame, std::shared_ptr<Frame>>(m, "Frame",
                                            "The target in one frame, 30 of them a second.")
      .def_property_readonly(
          "vertices",
          [](const py::object& self) -> py::object {
            const Points& v = self.cast<Frame&>().vertices;
            if (v.empty()) return py::none();
            return view(self, v[0].data(), {std::ssize(v), 3});
          },
          "float32 [V, 3], world metres, in the target's order; None: the system gives none")
      .def_property_readonly(
          "joints", [joints](const py::object& s) { return joints(s, &Frame::joints, 3); },
          "float32 [22, 3], world metres; None: the system has no skeleton")
      .def_property_readonly(
          "rotations", [joints](const py::object& s) { return joints(s, &Frame::rotations, 4); },
          "float32 [22, 4], unit quaternions w x y z: world turns from the T-pose")
      .def_readonly("confidence", &Frame::confidence,
                    "how sure the extractor is of the source's joints, 0 to 1, or None")
      .def_readonly("filled", &Frame::filled, "whether no cloud is behind this frame")
      .def(py::pickle(&state_of, &frame_of));
}

}  // namespace

void add_system(py::module_& m) {
  add_frame(m);
  py::class_<PySystem> system(m, "System");
  refuse_copies(system,
                "a System cannot be copied or pickled, as it is in the middle of a motion: make "
                "one where it is needed, restage.System(target, weights)");
  system.def(py::init<const py::object&, const py::object&, const py::dict&>())
      .def("push_all", &PySystem::push_all, py::arg("points"), py::arg("name") = "cloud",
           "Takes the next cloud, [n, 3] in metres, y up (or as scale and source_up say), and "
           "returns the frames that it finishes, as a list. InputError leaves the system as it "
           "was: call miss() for that cloud.")
      .def("push", &PySystem::push_newest, py::arg("points"), py::arg("name") = "cloud",
           "As push_all(), but returns the newest frame, or None where none is finished.")
      .def("finish", &PySystem::finish,
           "Says that the source has ended; returns the frames that are left, as a list.")
      .def("miss", &PySystem::miss, "Says that a frame of the source is missing.")
      .def("restart", &PySystem::restart, "Forgets the motion so far.")
      .def_property_readonly("target_vertices", &PySystem::target_vertices,
                             "float32 [V, 3], the target in T-pose, metres")
      .def_property_readonly("faces", &PySystem::faces, "int32 [T, 3], the target's triangles")
      .def_property_readonly("rest_joints", &PySystem::rest_joints,
                             "float64 [22, 3], the target's joints in T-pose, metres, or None")
      .def_property_readonly(
          "times", &PySystem::times,
          "how long the parts of the last push() took, seconds; frame: all that C++ did")
      .def_property_readonly("points_left_out", &PySystem::points_left_out,
                             "points of all clouds so far that were NaN or infinite")
      .def_property_readonly("source_joints", &PySystem::source_joints,
                             "float64 [22, 3], the source's joints in the last cloud, or None");
}

}  // namespace restage::python
