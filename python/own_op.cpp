// Ops written in Python: a forward and a backward function of NumPy arrays.
#include "autograd/base/module_path.h"
#include "python/engine.h"

namespace restage::python {
namespace {

/// What Python gave; is let go under the GIL, wherever a tape forgets it.
struct Functions {
  py::object forward, backward;
  std::string name, letters;
};
using Shared = std::shared_ptr<const Functions>;

Shared shared(Functions f) {
  return {new Functions(std::move(f)), [](const Functions* p) {
            if (!Py_IsInitialized()) return;
            const py::gil_scoped_acquire acquired;
            delete p;
          }};
}

/// The gradients that the backward function gives, one for each input.
Grads grads_of(const py::object& answer, const Saved& saved, Needs needs, const Functions& f) {
  std::vector<py::object> list;
  if (py::isinstance<py::tuple>(answer) || py::isinstance<py::list>(answer))
    for (const py::handle g : answer) list.push_back(py::reinterpret_borrow<py::object>(g));
  else
    list.push_back(answer);
  if (list.size() != needs.size())
    throw ShapeError(f.name + ": backward gave " + std::to_string(list.size()) + " gradients for " +
                     std::to_string(needs.size()) + " inputs");
  Grads out(needs.size());
  for (size_t i = 0; i < list.size(); ++i) {
    if (!needs[i]) continue;
    if (list[i].is_none())
      out[i] = Tensor::zeros(saved.shape(i), saved.dtype(i));
    else
      out[i] = tensor_of(list[i]).clone().cast(saved.dtype(i));
  }
  return out;
}

struct OwnFunction final : Tape::Function {
  OwnFunction(Shared f, Saved s) : functions(std::move(f)), kept(std::move(s)) {}
  Grads backward(std::span<const Tensor> gy, Needs needs) const override {
    const py::gil_scoped_acquire acquired;
    // inputs and result, as forward() kept them
    py::list arguments;
    arguments.append(array_of(gy[0]));
    arguments.append(array_of(kept.tensors().back()));
    for (size_t i = 0; i + 1 < kept.tensors().size(); ++i) arguments.append(array_of(kept[i]));
    const py::object answer = functions->backward(*py::tuple(arguments));
    return grads_of(answer, kept, needs, *functions);
  }
  const char* name() const override { return functions->name.c_str(); }
  const Saved& saved() const override { return kept; }
  Shared functions;
  Saved kept;
};

Tensor forward_of(const Functions& f, Inputs inputs) {
  const py::gil_scoped_acquire acquired;
  py::list arguments;
  for (const Tensor& t : inputs) arguments.append(array_of(t));
  // A copy: the function may keep its array.
  Tensor y = tensor_of(f.forward(*py::tuple(arguments))).clone();
  if (y.dtype() != DType::f32 && y.dtype() != DType::f64)
    throw ShapeError(f.name + ": forward gave " + name_of(y.dtype()) + ", no float32 or float64");
  return inputs.empty() ? y : y.cast(inputs[0].dtype());
}

/// As call() of tape.h, for an op whose name is known at run time only. Is called without the GIL.
Var call_own(const Shared& f, std::span<const Var> inputs) {
  const OpScope running(f->name.c_str());
  std::vector<Tensor> values;
  std::array<bool, kMaxInputs> needs{};
  Tape* tape = nullptr;
  for (const Var& v : inputs) {
    needs[values.size()] = v.on_tape();
    values.push_back(v.value);
    if (v.on_tape()) tape = v.tape();
  }
  require_one_device(values);
  require_floats(f->name.c_str(), f->letters.c_str(), values);
  Tensor y = forward_of(*f, values);
  if (FiniteCheck::active()) require_finite(y, f->name.c_str(), module_path(), "forward");
  if (tape == nullptr) return Var(std::move(y));
  Saved saved(values, Needs(needs.data(), values.size()));
  std::vector<Tensor> kept = values;
  kept.push_back(y);
  saved.keep_all(kept);
  return tape->record(std::make_unique<OwnFunction>(f, std::move(saved)), inputs, std::move(y));
}

class OwnOp {
 public:
  using Bound = void;
  OwnOp(const std::string& name, const py::object& forward, const py::object& backward,
        const std::string& letters)
      : functions_(shared({forward, backward, name, letters})) {
    for (const py::object& f : {forward, backward})
      if (!PyCallable_Check(f.ptr()))
        throw ShapeError(name + ": forward and backward are functions");
  }
  PyVar operator()(const py::args& inputs) const {
    if (inputs.empty() || inputs.size() >= kMaxInputs)
      throw ShapeError(functions_->name + ": takes 1 to 15 inputs");
    std::vector<PyVar> vars;
    std::vector<Var> values;
    std::vector<const PyVar*> pointers;
    std::optional<DType> like;
    for (const py::handle one : inputs)
      if (!like && py::isinstance<PyVar>(one)) like = one.cast<const PyVar&>().var.dtype();
    for (const py::handle one : inputs) vars.push_back(var_of(one, like ? &*like : nullptr));
    for (const PyVar& v : vars) values.push_back(v.var), pointers.push_back(&v);
    return run_op(pointers, [&] { return call_own(functions_, values); });
  }
  std::string name() const { return functions_->name; }
  std::string letters() const { return functions_->letters; }

 private:
  Shared functions_;
};

}  // namespace

void add_own_op(py::module_& m) {
  py::class_<OwnOp>(m, "Op", R"(An op of your own, with its own gradient.

forward(*inputs) -> y and backward(gy, y, *inputs) -> one gradient for each input (a tuple if there are several;
None: zeros), pure functions of read-only NumPy arrays. Call it with Vars, Tensors or arrays, as ops are called;
restage.gradcheck() checks it. letters: its axes for messages, such as "x[n, c], w[c]".)")
      .def(py::init<const std::string&, const py::object&, const py::object&, const std::string&>(),
           py::arg("name"), py::arg("forward"), py::arg("backward"), py::arg("letters") = "x[...]")
      .def("__call__", &OwnOp::operator())
      .def_property_readonly("name", &OwnOp::name)
      .def_property_readonly("letters", &OwnOp::letters);
}

}  // namespace restage::python
