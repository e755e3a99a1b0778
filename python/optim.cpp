// restage.Adam and restage.Muon.
#include <cmath>

#include "python/model.h"
#include "train/optim/adam.h"
#include "train/optim/muon.h"

namespace restage::python {
namespace {

void in_range(const char* name, double value, bool ok) {
  if (!ok)
    throw InputError("", std::string(name) + " is out of range: " + std::to_string(value),
                     "see the help of the optimiser");
}

/// A model, a dict or a list of parameters.
std::vector<std::pair<std::string, PyParameter>> named(const py::object& parameters) {
  std::vector<std::pair<std::string, PyParameter>> out;
  if (py::isinstance<PyModel>(parameters)) return parameters.cast<const PyModel&>().parameters();
  const auto add = [&out](const std::string& name, const py::handle& p) {
    if (!py::isinstance<Parameter>(p))
      throw ShapeError("optimiser: '" + name + "' is no Parameter");
    for (const auto& [other, known] : out)
      if (known == p.cast<PyParameter>())
        throw ShapeError("optimiser: '" + name + "' is the same Parameter as '" + other + "'");
    out.emplace_back(name, p.cast<PyParameter>());
  };
  if (py::isinstance<py::dict>(parameters)) {
    for (const auto& [key, value] : parameters.cast<py::dict>()) add(py::str(key), value);
  } else if (py::isinstance<py::iterable>(parameters)) {
    for (const py::handle p : parameters) add(std::to_string(out.size()), p);
  } else {
    throw ShapeError("optimiser: give a Model, a dict or a list of parameters");
  }
  return out;
}

/// Adam for all parameters, or Muon for matrices and Adam for the rest.
class PyOptimiser {
 public:
  PyOptimiser(const py::object& parameters, double rate, const AdamConfig& adam,
              const std::optional<MuonConfig>& muon)
      : kept_(named(parameters)), rate_(rate) {
    check_rate(rate);
    in_range("beta1", adam.beta1, adam.beta1 >= 0 && adam.beta1 < 1);
    in_range("beta2", adam.beta2, adam.beta2 >= 0 && adam.beta2 < 1);
    in_range("eps", adam.eps, adam.eps > 0 && std::isfinite(adam.eps));
    in_range("weight_decay", adam.weight_decay,
             adam.weight_decay >= 0 && std::isfinite(adam.weight_decay));
    if (muon) in_range("momentum", muon->momentum, muon->momentum >= 0 && muon->momentum < 1);
    if (muon) in_range("step", muon->step, muon->step > 0 && std::isfinite(muon->step));
    std::vector<NamedParameter> matrices, rest;
    for (const auto& [name, p] : kept_)
      (muon && Muon::takes(*p) ? matrices : rest).push_back({name, p.get()});
    if (muon) muon_.emplace(matrices, *muon);
    adam_.emplace(rest, adam);
  }

  void step(const Gradients& gradients, const std::optional<double>& rate, double scale) {
    if (rate) check_rate(*rate);
    in_range("scale", scale, std::isfinite(scale));
    const py::gil_scoped_release released;
    const std::lock_guard<std::recursive_mutex> lock(recording());
    if (muon_) muon_->step(gradients, rate.value_or(rate_), scale);
    adam_->step(gradients, rate.value_or(rate_), scale);
  }
  py::dict state() const {
    py::dict out;
    for (const auto& [name, tensor] : own().tensors) out[py::str(name)] = py::cast(tensor.clone());
    return out;
  }
  void load(const py::dict& state) {
    TensorFile file;
    file.tensors = tensors_of(state);
    check(file);  // all of it first: nothing is half loaded
    if (muon_) muon_->load("muon.", file, "state");
    adam_->load(prefix(), file, "state");
  }

  double rate() const { return rate_; }
  void set_rate(double rate) {
    check_rate(rate);
    rate_ = rate;
  }

 private:
  static void check_rate(double rate) { in_range("rate", rate, rate >= 0 && std::isfinite(rate)); }
  TensorFile own() const {
    TensorFile file;
    if (muon_) muon_->save("muon.", file);
    adam_->save(prefix(), file);
    return file;
  }
  /// InputError unless the state has the names, shapes and dtypes of this optimiser's, and numbers.
  void check(const TensorFile& state) const {
    const TensorFile mine = own();
    const auto refuse = [](const std::string& what) {
      throw InputError("state", what, "give what state_dict() of such an optimiser gave");
    };
    for (const auto& [name, tensor] : state.tensors)
      if (mine.find(name) == nullptr) refuse("'" + name + "' belongs to no parameter");
    for (const auto& [name, tensor] : mine.tensors) {
      const Tensor* given = state.find(name);
      if (given == nullptr) refuse("'" + name + "' is missing");
      if (!(given->shape() == tensor.shape()) || given->dtype() != tensor.dtype())
        refuse("'" + name + "' is of another size or dtype");
      for (int64_t i = 0; i < given->numel(); ++i)
        if (!std::isfinite(given->item(i)) || (name.ends_with(".steps") && given->item(i) < 0))
          refuse("'" + name + "' holds no number that it can hold");
    }
  }
  const char* prefix() const { return muon_ ? "adam." : ""; }

  std::vector<std::pair<std::string, PyParameter>> kept_;
  double rate_;
  std::optional<Muon> muon_;
  std::optional<Adam> adam_;
};

struct PyAdam : PyOptimiser {
  using Bound = void;
  PyAdam(const py::object& parameters, double rate, double beta1, double beta2, double eps,
         double weight_decay)
      : PyOptimiser(parameters, rate, {beta1, beta2, eps, weight_decay}, {}) {}
};

struct PyMuon : PyOptimiser {
  using Bound = void;
  PyMuon(const py::object& parameters, double rate, double momentum, double step, double beta1,
         double beta2, double eps, double weight_decay)
      : PyOptimiser(parameters, rate, {beta1, beta2, eps, weight_decay},
                    MuonConfig{momentum, step}) {}
};

template <class Class>
void add_steps(Class& c) {
  c.def(
       "step",
       [](typename Class::type& self, const PyGradients& g, const std::optional<double>& rate,
          double scale) { self.step(g.gradients, rate, scale); },
       py::arg("gradients"), py::arg("rate") = py::none(), py::arg("scale") = 1.0,
       "One update by the gradients times scale; a parameter without one stays.")
      .def_property("rate", &PyOptimiser::rate, &PyOptimiser::set_rate)
      .def("state_dict", &PyOptimiser::state)
      .def("load_state_dict", &PyOptimiser::load, py::arg("state"));
}

}  // namespace

void add_optim(py::module_& m) {
  py::class_<PyAdam> adam(m, "Adam",
                          "Adam as PyTorch's: in float64 to rounding, in float32 to 1e-5 of a "
                          "step. parameters: a Model, "
                          "a dict or a list of Parameters.");
  adam.def(py::init<const py::object&, double, double, double, double, double>(),
           py::arg("parameters"), py::arg("rate") = 1e-3, py::arg("beta1") = 0.9,
           py::arg("beta2") = 0.999, py::arg("eps") = 1e-8, py::arg("weight_decay") = 0.0);
  add_steps(adam);
  py::class_<PyMuon> muon(
      m, "Muon",
      "Muon (Jordan 2024) for matrices of 32 rows and columns or more, Adam for the rest. One rate "
      "serves both.");
  muon.def(py::init<const py::object&, double, double, double, double, double, double, double>(),
           py::arg("parameters"), py::arg("rate") = 1e-3, py::arg("momentum") = 0.95,
           py::arg("step") = 0.2, py::arg("beta1") = 0.9, py::arg("beta2") = 0.999,
           py::arg("eps") = 1e-8, py::arg("weight_decay") = 0.0);
  add_steps(muon);
}

}  // namespace restage::python
