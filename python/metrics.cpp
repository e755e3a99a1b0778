// restage.metrics and restage.closed_form: measures and references that need no network.
#include "nn/metrics/metrics.h"

#include "autograd/base/error.h"
#include "nn/geometry/closed_form.h"
#include "python/arrays.h"

namespace restage::python {
namespace {

using metrics::Metric;
using metrics::Track;
using Numbers = py::array_t<double, py::array::c_style>;

const Metric& metric_of(const std::string& name) {
  for (const auto& table : {metrics::table(), metrics::variants()})
    for (const Metric& metric : table)
      if (name == metric.name) return metric;
  throw InputError("", "there is no metric '" + name + "'", "see restage.metrics.names");
}

/// Of points; of quaternions only the numbers of frames and joints mean something.
Track track_of(const Numbers& a, const std::string& what, bool rotations = false) {
  const bool one = a.ndim() == 2;
  if ((!one && a.ndim() != 3) || a.shape(a.ndim() - 1) != (rotations ? 4 : 3))
    throw InputError(what, "has the shape " + shape_text(a),
                     rotations ? "give quaternions w x y z, [frames, 22, 4]"
                               : "give [frames, points, 3], metres");
  return {a.data(), one ? 1 : a.shape(0), one ? a.shape(0) : a.shape(1)};
}

py::object measure(const std::string& name, const py::object& pred, const py::object& truth,
                   const py::object& joints) {
  const Metric& metric = metric_of(name);
  const Numbers p = numbers<double>(pred, "pred"), t = numbers<double>(truth, "truth");
  const bool rotations = metric.of_rotations != nullptr;
  const Track tp = track_of(p, "pred", rotations), tt = track_of(t, "truth", rotations);
  if (tp.frames != tt.frames || tp.points != tt.points)
    throw InputError("pred", "has the shape " + shape_text(p) + ", and truth " + shape_text(t),
                     "give as many frames and points of both");
  metrics::SequenceView view;
  view.frames = tp.frames;
  if (metric.of_joints != nullptr)
    view.pred_joints = tp, view.true_joints = tt;
  else if (rotations)
    view.pred_rotations = {p.data(), static_cast<size_t>(p.size())},
    view.true_rotations = {t.data(), static_cast<size_t>(t.size())};
  else
    view.pred_vertices = tp, view.true_vertices = tt;
  Numbers j;
  if (!joints.is_none()) {
    if (metric.of_joints != nullptr || rotations)
      throw InputError("joints", "say nothing to " + name, "leave joints out");
    j = numbers<double>(joints, "joints");
    view.true_joints = track_of(j, "joints");
    if (view.true_joints.frames != tp.frames)
      throw InputError("joints", "has the shape " + shape_text(j), "give as many frames as truth");
  }
  metrics::Value value;
  {
    const py::gil_scoped_release released;
    if (tp.frames > 0 && tp.points > 0) value = metric.compute(view);
  }
  return value ? py::object(py::float_(*value)) : py::none();
}

py::list all_metrics() {
  py::list out;
  for (const auto& table : {metrics::table(), metrics::variants()})
    for (const Metric& m : table)
      out.append(py::make_tuple(m.name, m.title, m.unit, m.help,
                                m.of_joints      ? "joints"
                                : m.of_rotations ? "rotations"
                                                 : "vertices"));
  return out;
}

py::tuple closed(const py::object& source, const py::object& rest, const py::object& source_rest) {
  const std::vector<Joints> frames = joint_frames_of(source, "source");
  const Joints target = joints_of(rest, "target_rest");
  std::optional<Joints> from;
  if (!source_rest.is_none()) from = joints_of(source_rest, "source_rest");
  std::vector<double> joints;
  std::vector<float> rotations;
  {
    const py::gil_scoped_release released;
    if (!frames.empty())
      for (const Pose& pose : closed_form(frames, target, from)) {
        const PosedSkeleton posed = forward_kinematics(target, pose);
        for (const Vec3& p : posed.joints) joints.insert(joints.end(), p.data(), p.data() + 3);
        append_rotations(posed.global, rotations);
      }
  }
  const auto f = std::ssize(frames);
  return py::make_tuple(array_of<double>(std::move(joints), {f, kJoints, 3}),
                        array_of<float>(std::move(rotations), {f, kJoints, 4}));
}

}  // namespace

void add_metrics(py::module_& m) {
  m.def("measure", &measure, py::arg("name"), py::arg("pred"), py::arg("truth"),
        py::arg("joints") = py::none());
  m.def("all_metrics", &all_metrics);
  m.def("closed_form", &closed, py::arg("source"), py::arg("target_rest"),
        py::arg("source_rest") = py::none());
}

}  // namespace restage::python
