// restage.retarget: the command, with arrays in and out where there are no files.
#include "experiments/cli/perform/retarget.h"

#include "datasets/readers/frames/memory_frames.h"
#include "experiments/cli/output.h"
#include "python/arrays.h"

namespace restage::python {
namespace {

/// Clouds that were given as arrays, without points where there was none.
std::unique_ptr<FrameSource> frames_of(std::vector<Cloud> clouds) {
  const size_t count = clouds.size();
  return std::make_unique<MemoryFrames>(count, [clouds = std::move(clouds)](size_t i) {
    Frame out;
    out.source = "clouds:" + std::to_string(i);
    out.points = clouds[i].points;
    out.left_out = clouds[i].left_out;
    return out;
  });
}

/// Frames as they come, one after the other.
struct Arrays {
  std::vector<float> vertices, joints, rotations, confidence;
  std::vector<Triangle> faces;
  std::vector<int64_t> filled;
  py::ssize_t frames = 0, vertex_count = 0;
  bool with_joints = true;

  void push(const RetargetedFrame& f) {
    ++frames;
    const float* v = f.vertices.empty() ? nullptr : f.vertices[0].data();
    vertices.insert(vertices.end(), v, v + 3 * f.vertices.size());
    if (f.confidence) confidence.push_back(static_cast<float>(*f.confidence));
    with_joints = with_joints && f.joints.has_value();
    if (!with_joints) return;
    append_joints(*f.joints, joints);
    append_rotations(to_global(f.pose.local), rotations);
  }
};

cli::Sink sink_into(Arrays& out, const cli::Shown& shown) {
  out.faces = shown.target.faces;
  out.vertex_count = std::ssize(shown.target.vertices);
  return {[&out](const RetargetedFrame& f) { out.push(f); },
          [&out](const std::vector<int64_t>& filled) { out.filled = filled; }};
}

py::dict dict_of(Arrays arrays, const std::string& document) {
  py::dict out;
  const py::ssize_t f = arrays.frames;
  const auto or_none = [](bool there, auto make) -> py::object {
    return there ? py::object(make()) : py::none();
  };
  out["vertices"] = or_none(!arrays.vertices.empty(), [&] {
    return array_of<float>(std::move(arrays.vertices), {f, arrays.vertex_count, 3});
  });
  const bool joints = arrays.with_joints;
  out["joints"] = or_none(joints, [&] {
    return array_of<float>(std::move(arrays.joints), {f, kJoints, 3});
  });
  out["rotations"] = or_none(joints, [&] {
    return array_of<float>(std::move(arrays.rotations), {f, kJoints, 4});
  });
  out["confidence"] = or_none(std::ssize(arrays.confidence) == f,
                              [&] { return array_of<float>(std::move(arrays.confidence), {f}); });
  out["faces"] = array_of(std::move(arrays.faces));
  out["filled"] = py::cast(arrays.filled);
  out["document"] = document;
  return out;
}

std::vector<Cloud> clouds_of(const py::object& given) {
  const py::object source = array_or_same(given, "source");
  if (!py::isinstance<py::iterable>(source))
    throw InputError("source", "is neither a file's name nor a sequence of clouds",
                     "give a path, or arrays of [n, 3]");
  std::vector<Cloud> out;
  for (const py::handle cloud : source) {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    const std::string name = "clouds:" + std::to_string(out.size());
    out.push_back(cloud.is_none() ? Cloud() : cloud_of(cloud, name));
  }
  return out;
}

bool names_a_file(const py::handle& source) {
  return py::isinstance<py::str>(source) || PyBytes_Check(source.ptr()) ||
         PyObject_HasAttrString(source.ptr(), "__fspath__");
}

std::string text_of(const cli::Json& document) {
  return document.dump(-1, ' ', false, cli::Json::error_handler_t::replace);
}

py::object run(const py::object& source, const py::object& target, const py::object& weights,
               const py::object& out, const py::dict& options) {
  Words given = words_of(options);
  given.words.push_back("--target=" + path_of(target));
  if (!weights.is_none()) given.words.push_back("--weights=" + path_of(weights));
  if (!out.is_none()) given.words.push_back("--out=" + path_of(out));
  Watch watch;
  Arrays arrays;
  cli::RetargetCaller caller;
  caller.every_frame = [&watch] { watch(); };
  if (out.is_none())
    caller.sink = [&arrays](const cli::Shown& shown) { return sink_into(arrays, shown); };
  cli::RetargetCommand c;
  if (names_a_file(source))
    given.words.push_back("--source=" + path_of(source));
  else
    caller.clouds = frames_of(clouds_of(source));
  if (caller.clouds) c.source.path = "clouds";
  std::string document;
  watch.run([&] {
    run_command("retarget", given, [&](cli::Program& program) {
      const auto action = [&] {
        document = text_of(cli::retarget(c, program.common(), std::move(caller)).document);
        return 0;
      };
      cli::add_retarget_options(program.add("retarget", "", "", action), c, false);
    });
  });
  if (!out.is_none()) return py::str(document);
  return dict_of(std::move(arrays), document);
}

}  // namespace

void add_retarget(py::module_& m) { m.def("retarget", &run); }

}  // namespace restage::python
