// restage.Adam.
#include "python/model.h"
#include "train/optim/adam.h"

namespace restage::python {
namespace {

void in_range(const char* name, double value, bool ok) {
  if (!ok)
    throw InputError("", std::string(name) + " is out of range: " + std::to_string(value),
                     "see restage.Adam");
}

/// A model, a dict or a list of parameters.
std::vector<std::pair<std::string, PyParameter>> named(const py::object& parameters) {
  std::vector<std::pair<std::string, PyParameter>> out;
  if (py::isinstance<PyModel>(parameters)) return parameters.cast<const PyModel&>().parameters();
  const auto add = [&out](const std::string& name, const py::handle& p) {
    if (!py::isinstance<Parameter>(p)) throw ShapeError("Adam: '" + name + "' is no Parameter");
    out.emplace_back(name, p.cast<PyParameter>());
  };
  if (py::isinstance<py::dict>(parameters)) {
    for (const auto& [key, value] : parameters.cast<py::dict>()) add(py::str(key), value);
  } else if (py::isinstance<py::iterable>(parameters)) {
    for (const py::handle p : parameters) add(std::to_string(out.size()), p);
  } else {
    throw ShapeError("Adam: give a Model, a dict or a list of parameters");
  }
  return out;
}

class PyAdam {
 public:
  PyAdam(const py::object& parameters, double rate, double beta1, double beta2, double eps,
         double weight_decay)
      : kept_(named(parameters)), rate_(rate) {
    in_range("rate", rate, rate >= 0);
    in_range("beta1", beta1, beta1 >= 0 && beta1 < 1);
    in_range("beta2", beta2, beta2 >= 0 && beta2 < 1);
    in_range("eps", eps, eps > 0);
    in_range("weight_decay", weight_decay, weight_decay >= 0);
    std::vector<NamedParameter> list;
    for (const auto& [name, p] : kept_) list.push_back({name, p.get()});
    adam_.emplace(list, AdamConfig{beta1, beta2, eps, weight_decay});
  }

  void step(const Gradients& gradients, const std::optional<double>& rate, double scale) {
    const py::gil_scoped_release released;
    const std::lock_guard<std::recursive_mutex> lock(recording());
    adam_->step(gradients, rate.value_or(rate_), scale);
  }
  py::dict state() const {
    TensorFile file;
    adam_->save("", file);
    py::dict out;
    for (const auto& [name, tensor] : file.tensors) out[py::str(name)] = py::cast(tensor.clone());
    return out;
  }
  void load(const py::dict& state) {
    TensorFile file;
    file.tensors = tensors_of(state);
    adam_->load("", file, "state");
  }

  double rate() const { return rate_; }
  void set_rate(double rate) {
    in_range("rate", rate, rate >= 0);
    rate_ = rate;
  }

 private:
  std::vector<std::pair<std::string, PyParameter>> kept_;
  double rate_;
  std::optional<Adam> adam_;
};

}  // namespace

void add_optim(py::module_& m) {
  py::class_<PyAdam>(
      m, "Adam",
      R"(Adam, exactly as PyTorch's. parameters: a Model, a dict or a list of Parameters.)")
      .def(py::init<const py::object&, double, double, double, double, double>(),
           py::arg("parameters"), py::arg("rate") = 1e-3, py::arg("beta1") = 0.9,
           py::arg("beta2") = 0.999, py::arg("eps") = 1e-8, py::arg("weight_decay") = 0.0)
      .def(
          "step",
          [](PyAdam& self, const PyGradients& g, const std::optional<double>& rate, double scale) {
            self.step(g.gradients, rate, scale);
          },
          py::arg("gradients"), py::arg("rate") = py::none(), py::arg("scale") = 1.0,
          "One update by the gradients times scale; a parameter without one stays.")
      .def_property("rate", &PyAdam::rate, &PyAdam::set_rate)
      .def("state_dict", &PyAdam::state)
      .def("load_state_dict", &PyAdam::load, py::arg("state"));
}

}  // namespace restage::python
