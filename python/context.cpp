#include "python/context.h"

#include "nn/layers/linear.h"

namespace restage::python {
namespace {

void check_dropout(double p) {
  if (!(p >= 0 && p < 1)) throw ShapeError("dropout: p must be in [0, 1)");
}

/// An op that draws a mask of its own (Context::next_mask).
template <class Work>
PyVar dropped(const PyContext& c, const py::object& x, double p, const Work& work) {
  check_dropout(p);
  const PyVar v = var_of(x);
  Context& ctx = c.live();
  return run_op(std::array{&v}, [&] { return work(ctx, v.var, p); });
}

/// A generator of NumPy from the same key.
py::object generator_of(const PyInit& init) {
  const auto words = philox(init.init.key.fold("numpy"), 0);
  const uint64_t seed = (uint64_t{words[0]} << 32) | words[1];
  return py::module_::import("numpy").attr("random").attr("default_rng")(seed);
}

}  // namespace

PyContext::PyContext(std::shared_ptr<PyTape> tape, bool training, uint64_t seed, uint64_t step)
    : of_(&own_), tape_(std::move(tape)) {
  own_.tape = tape_ ? &tape_->tape : nullptr;
  own_.training = training;
  own_.rng = RngKey{seed, 0}.fold("python").fold(step);
}

Context& PyContext::live() const {
  if (of_ == nullptr)
    throw ShapeError("this ctx was of a call that is over; use the one that the call was given");
  return *of_;
}

PyVar PyContext::leaf(const PyParameter& p) const {
  Context& ctx = live();
  if (unrecorded() || ctx.tape == nullptr || ctx.frozen) return {Var(p->value), nullptr, 0};
  if (members_ != nullptr && ctx.training && !members_->contains(p->id))
    throw ShapeError("ctx.leaf: a parameter " + p->value.shape().str() +
                     " belongs to no attribute of the network, so it would never be trained; make "
                     "layers and parameters in __init__");
  if (!tape_) return {ctx.bind(*p), nullptr, 0};
  const py::gil_scoped_release released;
  const std::lock_guard<std::recursive_mutex> lock(recording());
  tape_->leaves.emplace(p->id, p);
  return {ctx.bind(*p), tape_, p->id};
}

int& networks_running() {
  thread_local int count = 0;
  return count;
}

void add_context(py::module_& m) {
  py::class_<PyContext, std::shared_ptr<PyContext>>(
      m, "Context",
      "What a network is given beside its input: where its ops are recorded, and whether it is in "
      "training. A training makes it for each call; Context(tape, training=True) is one for a "
      "loop of your own.")
      .def(py::init<std::shared_ptr<PyTape>, bool, uint64_t, uint64_t>(), py::arg("tape") = nullptr,
           py::arg("training") = false, py::arg("seed") = 0, py::arg("step") = 0)
      .def("leaf", &PyContext::leaf, py::arg("parameter"),
           "The parameter as a value that ops take, with a gradient where there is a tape.")
      .def_property_readonly(
          "training", [](const PyContext& c) { return c.live().training; }, "whether dropout is on")
      .def(
          "dropout",
          [](const PyContext& c, const py::object& x, double p) {
            return dropped(c, x, p,
                           [](Context& ctx, const Var& v, double q) { return dropout(ctx, v, q); });
          },
          py::arg("x"), py::arg("p"),
          "In training each number stays with probability 1 - p, divided by it; else x. Every call "
          "of a step has a mask of its own, by the seed and the step.")
      .def(
          "relu_dropout",
          [](const PyContext& c, const py::object& x, double p) {
            return dropped(c, x, p, [](Context& ctx, const Var& v, double q) {
              return relu_dropout(ctx, v, q);
            });
          },
          py::arg("x"), py::arg("p"), "dropout(relu(x)) in one pass.");
  py::class_<PyInit>(m, "Init",
                     "Where the numbers of a new network come from: a key, and a name for each of "
                     "its parts. Numbers are float32.")
      .def(py::init([](uint64_t seed) {
             return PyInit{Init{RngKey{seed, 0}, DType::f32}};
           }),
           py::arg("seed") = 0)
      .def(
          "sub", [](const PyInit& i, const std::string& name) { return PyInit{i.init.sub(name)}; },
          py::arg("name"), "That of a part.")
      .def(
          "weight",
          [](const PyInit& i, const py::object& shape, int64_t in, int64_t out) {
            return i.init.weight(shape_of(shape), std::max<int64_t>(1, in), out);
          },
          py::arg("shape"), py::arg("inputs"), py::arg("outputs"),
          "Weights of a linear map: uniform in +-1/sqrt(inputs).")
      .def(
          "bias",
          [](const PyInit& i, int64_t in, int64_t out) {
            return i.init.bias(std::max<int64_t>(1, in), out);
          },
          py::arg("inputs"), py::arg("outputs"), "Its biases, from the same range.")
      .def(
          "uniform",
          [](const PyInit& i, const py::object& shape, double bound, const std::string& name) {
            return i.init.uniform(shape_of(shape), bound, name);
          },
          py::arg("shape"), py::arg("bound"), py::arg("name"), "Uniform in +-bound.")
      .def("rng", &generator_of, "A numpy.random.Generator of this key.");
}

}  // namespace restage::python
