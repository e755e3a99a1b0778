// restage.Adam and restage.Muon.
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
    in_range("rate", rate, rate >= 0);
    in_range("beta1", adam.beta1, adam.beta1 >= 0 && adam.beta1 < 1);
    in_range("beta2", adam.beta2, adam.beta2 >= 0 && adam.beta2 < 1);
    in_range("eps", adam.eps, adam.eps > 0);
    in_range("weight_decay", adam.weight_decay, adam.weight_decay >= 0);
    if (muon) in_range("momentum", muon->momentum, muon->momentum >= 0 && muon->momentum < 1);
    if (muon) in_range("step", muon->step, muon->step > 0);
    std::vector<NamedParameter> matrices, rest;
    for (const auto& [name, p] : kept_)
      (muon && Muon::takes(*p) ? matrices : rest).push_back({name, p.get()});
    if (muon) muon_.emplace(matrices, *muon);
    adam_.emplace(rest, adam);
  }

  void step(const Gradients& gradients, const std::optional<double>& rate, double scale) {
    const py::gil_scoped_release released;
    const std::lock_guard<std::recursive_mutex> lock(recording());
    if (muon_) muon_->step(gradients, rate.value_or(rate_), scale);
    adam_->step(gradients, rate.value_or(rate_), scale);
  }
  py::dict state() const {
    TensorFile file;
    if (muon_) muon_->save("muon.", file);
    adam_->save(prefix(), file);
    py::dict out;
    for (const auto& [name, tensor] : file.tensors) out[py::str(name)] = py::cast(tensor.clone());
    return out;
  }
  void load(const py::dict& state) {
    TensorFile file;
    file.tensors = tensors_of(state);
    if (muon_) muon_->load("muon.", file, "state");
    adam_->load(prefix(), file, "state");
  }

  double rate() const { return rate_; }
  void set_rate(double rate) {
    in_range("rate", rate, rate >= 0);
    rate_ = rate;
  }

 private:
  const char* prefix() const { return muon_ ? "adam." : ""; }

  std::vector<std::pair<std::string, PyParameter>> kept_;
  double rate_;
  std::optional<Muon> muon_;
  std::optional<Adam> adam_;
};

struct PyAdam : PyOptimiser {
  PyAdam(const py::object& parameters, double rate, double beta1, double beta2, double eps,
         double weight_decay)
      : PyOptimiser(parameters, rate, {beta1, beta2, eps, weight_decay}, {}) {}
};

struct PyMuon : PyOptimiser {
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
  py::class_<PyAdam> adam(
      m, "Adam",
      "Adam, exactly as PyTorch's. parameters: a Model, a dict or a list of Parameters.");
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
