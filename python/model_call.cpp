// Calling a network: what each role takes and gives.
#include "autograd/base/words.h"
#include "nn/models/deformation.h"
#include "nn/models/motion.h"
#include "nn/models/skeleton.h"
#include "nn/models/transfer.h"
#include "python/model.h"

namespace restage::python {
namespace {

/// Checks an input before the network looks at its sizes. Sizes: -1 is any number above 0.
void check(const PyVar& v, const char* what, std::initializer_list<int64_t> sizes) {
  bool ok = v.var.rank() == static_cast<int>(sizes.size()) && v.var.dtype() == DType::f32;
  int axis = 0;
  for (const int64_t size : sizes) {
    ok = ok && (size < 0 ? v.var.size(axis) > 0 : v.var.size(axis) == size);
    ++axis;
  }
  if (!ok)
    throw ShapeError(std::string(what) + " is " + v.var.shape().str() + " " +
                     name_of(v.var.dtype()) + "; the network takes [" +
                     joined(sizes, [](int64_t n) { return n < 0 ? "any" : std::to_string(n); }) +
                     "] float32");
}

struct Call {
  std::vector<PyVar> in;
  std::shared_ptr<PyTape> tape;
  Context own;
  Context* at = &own;
  Context& ctx() { return *at; }

  void count(size_t n, const char* takes) const {
    if (in.size() != n)
      throw ShapeError(std::string("the network takes ") + takes + "; " +
                       std::to_string(in.size()) + " inputs were given");
  }
  /// Runs work() without the GIL while nobody else records.
  template <class Work>
  auto run(const Work& work) {
    const py::gil_scoped_release released;
    const std::lock_guard<std::recursive_mutex> lock(recording());
    return work();
  }
  py::object out(const Var& v) const {
    if (!v.value.defined()) return py::none();
    return py::cast(PyVar{v, v.on_tape() ? tape : nullptr, 0});
  }
};

py::object skeleton(SkeletonModel& net, Call& call) {
  call.count(1, "a cloud");
  check(call.in[0], "cloud", {-1, net.points(), 3});
  const SkeletonOutput y =
      call.run([&] { return net.forward(call.ctx(), SkeletonInput(call.in[0].var)); });
  py::dict out;
  out["joints"] = call.out(y.joints);
  out["turns"] = call.out(y.turns);
  out["uncertainty"] = call.out(y.uncertainty);
  return out;
}

py::object motion(const MotionModel& net, Call& call) {
  call.count(3, "joints, trans and rest");
  check(call.in[0], "joints", {-1, -1, kJoints, 3});
  const int64_t n = call.in[0].var.size(0), t = call.in[0].var.size(1);
  check(call.in[1], "trans", {n, t, 3});
  check(call.in[2], "rest", {n, kJoints, 3});
  const MotionOutput y = call.run([&] {
    MotionInput in;
    in.joints = call.in[0].var;
    in.trans = call.in[1].var;
    in.rest = call.in[2].var;
    MotionState state;
    return net.forward(call.ctx(), in, &state);
  });
  py::dict out;
  out["rotations"] = call.out(y.rotations);
  out["joints"] = call.out(y.joints);
  out["trans"] = call.out(y.trans);
  return out;
}

py::object transfer(TransferModel& net, Call& call) {
  call.count(2, "pose and identity");
  check(call.in[0], "pose", {-1, net.frames(), -1, 3});
  const int64_t n = call.in[0].var.size(0);
  const int64_t v = net.equal_counts() ? call.in[0].var.size(2) : -1;
  check(call.in[1], "identity", {n, v, 3});
  return call.out(call.run([&] {
    return net.forward(call.ctx(), TransferInput{call.in[0].var, call.in[1].var});
  }));
}

py::object deformation(const DeformationModel& net, Call& call) {
  call.count(2, "rest joints and points");
  check(call.in[0], "rest joints", {-1, kJoints, 3});
  check(call.in[1], "points", {call.in[0].var.size(0), -1, 3});
  return call.out(
      call.run([&] { return net.weights(call.ctx(), call.in[0].var, call.in[1].var); }));
}

py::object perceptron(const Mlp3& net, Call& call) {
  call.count(1, "x");
  if (call.in[0].var.rank() < 1) throw ShapeError("x has no axis");
  return call.out(call.run([&] { return net(call.ctx(), call.in[0].var); }));
}

}  // namespace

py::object call_model(const PyModel& model, const py::args& inputs,
                      const std::shared_ptr<PyTape>& tape, const std::shared_ptr<PyContext>& ctx,
                      bool training, uint64_t seed, uint64_t step) {
  Call call;
  if (ctx && (tape || training || seed != 0 || step != 0))
    throw ShapeError("a ctx says where to record and whether to train; leave the others out");
  const DType type = DType::f32;
  for (const py::handle one : inputs) call.in.push_back(var_of(one, &type));
  const std::shared_ptr<PyTape>& given = ctx ? ctx->tape() : tape;
  call.tape = unrecorded() ? nullptr : given;
  for (const PyVar& v : call.in) {
    if (!v.tape) continue;
    if (call.tape && call.tape != v.tape)
      throw ShapeError("the network was given values of two tapes");
    call.tape = v.tape;
  }
  if (given && !unrecorded()) {
    call.own.tape = &given->tape;
    const auto parameters = model.parameters();
    call.run([&] {
      for (const auto& [name, p] : parameters) given->leaves.emplace(p->id, p);
    });
  }
  if (ctx && !unrecorded()) call.at = &ctx->live();
  call.own.training = training;
  call.own.rng = RngKey{seed, 0}.fold("python").fold(step);
  Module* net = model.net.get();
  if (auto* skeletons = dynamic_cast<SkeletonModel*>(net)) return skeleton(*skeletons, call);
  if (auto* motions = dynamic_cast<MotionModel*>(net)) return motion(*motions, call);
  if (auto* transfers = dynamic_cast<TransferModel*>(net)) return transfer(*transfers, call);
  if (auto* surfaces = dynamic_cast<DeformationModel*>(net)) return deformation(*surfaces, call);
  if (auto* mlp = dynamic_cast<Mlp3*>(net)) return perceptron(*mlp, call);
  throw ShapeError("'" + model.name + "' cannot be called from Python");
}

}  // namespace restage::python
