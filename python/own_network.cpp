// A class of C++ for the interface of each role, with an object of Python inside; and how the
// registry gets them.
#include "python/own_network.h"

#include "autograd/base/module_path.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/rotation.h"
#include "nn/models/deformation.h"
#include "nn/models/motion.h"
#include "nn/models/registry.h"
#include "nn/models/skeleton.h"
#include "nn/models/transfer.h"

namespace restage::python {
namespace {

/// What all roles share.
template <class Role>
class OfRole : public Role, public OwnObject {
 public:
  OfRole(const std::string& name, const std::string& kind, const py::tuple& made)
      : OwnObject(name, kind, made) {}
  void visit(Fields& fields) override { visit_members(fields); }
  const char* kind() const override { return kind_name(); }
  bool changes_buffers() const override { return has_changing_buffers(); }
};

class OwnSkeleton final : public OfRole<SkeletonModel> {
 public:
  OwnSkeleton(const std::string& name, const std::string& kind, const py::tuple& made)
      : OfRole(name, kind, made), points_(attribute<int64_t>("points", 1024)) {
    if (points_ < 1 || points_ > kMostPoints)
      throw InputError("", name + ": points is " + std::to_string(points_), "give 1 to 65536");
  }
  int64_t points() const override { return points_; }
  SkeletonOutput forward(Context& ctx, const SkeletonInput& in) override {
    const py::gil_scoped_acquire acquired;
    const py::object y = answer(ctx, {{"cloud", in.cloud}, {"past", in.past}}, nullptr);
    const int64_t n = in.cloud.size(0);
    SkeletonOutput out;
    out.joints = part(y, "joints", {n, kJoints, 3}, true, true);
    out.turns = part(y, "turns", {n, kJoints, 6}, false);
    out.uncertainty = part(y, "uncertainty", {n, kJoints}, false);
    require_learning(ctx, {&out.joints, &out.turns, &out.uncertainty});
    return out;
  }

 private:
  int64_t points_;
};

class OwnMotion final : public OfRole<MotionModel> {
 public:
  OwnMotion(const std::string& name, const std::string& kind, const py::tuple& made)
      : OfRole(name, kind, made), latency_(attribute<int64_t>("latency", 0)) {
    if (latency_ < 0 || latency_ > 1000)
      throw InputError("", name + ": latency is " + std::to_string(latency_), "give 0 to 1000");
  }
  int64_t latency() const override { return latency_; }
  MotionOutput forward(Context& ctx, const MotionInput& in, MotionState* state) const override {
    const py::gil_scoped_acquire acquired;
    const int64_t n = in.joints.size(0), t = in.joints.size(1);
    const py::object y = answer(ctx,
                                {{"joints", in.joints},
                                 {"trans", in.trans},
                                 {"rest", in.rest},
                                 {"turns", in.turns},
                                 {"uncertainty", in.uncertainty},
                                 {"reframed", in.reframed}},
                                state);
    MotionOutput out;
    out.trans = part(y, "trans", {n, t, 3});
    out.standing = part(y, "standing", {n, t, 2}, false);
    out.raw = part(y, "sixd", {n, t, kJoints, 6}, false);
    const bool sixd = out.raw.value.defined();
    out.rotations = part(y, "rotations", {n, t, kJoints, 3, 3}, !sixd);
    out.joints = part(y, "joints", {n, t, kJoints, 3}, false);
    require_learning(ctx, {&out.trans, &out.standing, &out.raw, &out.rotations, &out.joints});
    take_state(y, state);
    const py::gil_scoped_release released;
    complete(in, n, t, &out);
    return out;
  }
  void standardise(const MotionStatistics& s) override {
    const py::gil_scoped_acquire acquired;
    if (!py::hasattr(instance(), "standardise")) return;
    in_python("standardise", [&] {
      const auto pair = [](const MotionStatistics::Columns& c) {
        return py::make_tuple(c.mean.clone(), c.deviation.clone());
      };
      py::dict given;
      given["joints"] = pair(s.joints), given["rest"] = pair(s.rest);
      given["trans"] = pair(s.trans), given["sixd"] = pair(s.sixd);
      instance().attr("standardise")(given);
      return 0;
    });
    require_same_members();
  }

 private:
  /// Rotations from six numbers each, and joints from rotations, where Python gave none.
  static void complete(const MotionInput& in, int64_t n, int64_t t, MotionOutput* out) {
    if (out->raw.value.defined() && !out->rotations.value.defined())
      out->rotations = sixd_to_matrix(out->raw);
    if (!out->raw.value.defined())
      out->raw = reshape(matrix_to_sixd(out->rotations.detach()), {n, t, 6 * kJoints});
    else
      out->raw = reshape(out->raw, {n, t, 6 * kJoints});
    if (out->joints.value.defined()) return;
    put_pose(reshape(out->rotations, {n * t, kJoints, 3, 3}), rest_of_each_frame(in.rest, t), n,
             out);
  }
  void take_state(const py::object& y, MotionState* state) const {
    const auto dict = py::reinterpret_borrow<py::dict>(y);
    state->clear();
    if (!dict.contains("state")) return;
    const py::object given = dict["state"];
    if (!py::isinstance<py::list>(given) && !py::isinstance<py::tuple>(given))
      refuse("forward() gave a 'state' that is no list of values");
    const DType type = DType::f32;
    for (const py::handle one : given) state->push_back(var_of(one, &type).var);
  }

  int64_t latency_;
};

class OwnWeights final : public OfRole<DeformationModel> {
 public:
  using OfRole::OfRole;
  Var weights(Context& ctx, const Var& rest, const Var& points) const override {
    const py::gil_scoped_acquire acquired;
    const py::object y = answer(ctx, {{"rest", rest}, {"points", points}}, nullptr);
    const Var out = part(y, "weights", {points.size(0), points.size(1), kJoints}, true, true);
    require_learning(ctx, {&out});
    return out;
  }
};

class OwnTransfer final : public OfRole<TransferModel> {
 public:
  OwnTransfer(const std::string& name, const std::string& kind, const py::tuple& made)
      : OfRole(name, kind, made),
        frames_(attribute<int64_t>("frames", 1)),
        corresponding_(attribute("corresponding", false)),
        equal_(attribute("equal_counts", corresponding_)) {
    if (frames_ < 1 || frames_ > 1024)
      throw InputError("", name + ": frames is " + std::to_string(frames_), "give 1 to 1024");
  }
  int64_t frames() const override { return frames_; }
  bool corresponding() const override { return corresponding_; }
  bool equal_counts() const override { return equal_; }
  Var forward(Context& ctx, const TransferInput& in) override {
    const py::gil_scoped_acquire acquired;
    const int64_t t = in.pose.size(1);
    if (t != frames_)
      refuse("the window is of " + std::to_string(t) + " frames, and the network takes " +
             std::to_string(frames_));
    const py::object y = answer(ctx, {{"pose", in.pose}, {"identity", in.identity}}, nullptr);
    const Var all = part(y, "vertices", {in.pose.size(0), t, in.identity.size(1), 3}, true, true);
    require_learning(ctx, {&all});
    const py::gil_scoped_release released;
    return in.last ? slice(all, 1, t - 1, t) : all;
  }

 private:
  int64_t frames_;
  bool corresponding_, equal_;
};

OwnSizes sizes_of(const py::list& given) {
  OwnSizes out;
  for (const py::handle entry : given) {
    const auto [name, help, value] = entry.cast<std::tuple<std::string, std::string, py::object>>();
    OwnSizes::Size size{name, help, {}};
    if (py::isinstance<py::bool_>(value))
      size.value = value.cast<bool>();
    else if (py::isinstance<py::int_>(value))
      size.value = value.cast<int64_t>();
    else if (py::isinstance<py::float_>(value))
      size.value = value.cast<double>();
    else
      size.value = value.cast<std::string>();
    out.sizes.push_back(std::move(size));
  }
  return out;
}

py::dict dict_of(const OwnSizes& sizes) {
  py::dict out;
  for (const OwnSizes::Size& size : sizes.sizes)
    std::visit([&](const auto& value) { out[py::str(size.name)] = value; }, size.value);
  return out;
}

/// A class of Python: build(sizes, init) makes an object and finds its members.
struct OwnClass {
  std::string name, role, kind;
  Held build;

  std::unique_ptr<Module> operator()(const AnyConfig& config, const Init& init) const {
    const py::gil_scoped_acquire acquired;
    try {
      const py::tuple made = (*build)(dict_of(config.as<OwnSizes>()), PyInit{init});
      auto out = own_network(role, name, kind, made);
      if (init.budget != nullptr) *init.budget -= count_parameters(*out);
      if (init.budget != nullptr && *init.budget < 0)
        throw InputError("", "is too small for the network", "give the sizes it was trained with");
      return out;
    } catch (const py::error_already_set& error) {
      fail(error, name + ": __init__()");
    }
  }
};

void register_network(const std::string& name, const std::string& role, const std::string& help,
                      const std::string& kind, const py::list& sizes, const std::string& module,
                      const std::string& code, const std::vector<std::string>& figures,
                      const py::object& build) {
  const AnyConfig config(sizes_of(sizes));
  register_own_model({name, help, role, config, config, OwnClass{name, role, kind, held(build)},
                      module, code, figures});
}

}  // namespace

std::unique_ptr<Module> own_network(const std::string& role, const std::string& name,
                                    const std::string& kind, const py::tuple& made) {
  if (role == "skeleton") return std::make_unique<OwnSkeleton>(name, kind, made);
  if (role == "motion") return std::make_unique<OwnMotion>(name, kind, made);
  if (role == "deformation.weights") return std::make_unique<OwnWeights>(name, kind, made);
  if (role == "transfer") return std::make_unique<OwnTransfer>(name, kind, made);
  throw InputError("", "no network of the role '" + role + "' can be written in Python",
                   "give skeleton, motion, deformation.weights or transfer");
}

void add_own_network(py::module_& m) {
  m.def("register_network", &register_network);
  m.def("set_network_importer", [](const py::object& f) {
    set_network_importer([f = held(f)](const std::string& file) {
      const py::gil_scoped_acquire acquired;
      try {
        (*f)(file);
      } catch (const py::error_already_set& error) {
        fail(error, file);
      }
    });
  });
}

}  // namespace restage::python
