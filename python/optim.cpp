// restage.Adam and its like, restage.Schedule and restage.Average.
#include <algorithm>
#include <cmath>
#include <memory>

#include "autograd/base/words.h"
#include "python/copies.h"
#include "python/model.h"
#include "train/optim/adam.h"
#include "train/optim/lion.h"
#include "train/optim/muon.h"
#include "train/optim/sgd.h"
#include "train/schedule.h"
#include "train/selection.h"

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

void is_decay(const char* name, double value) { in_range(name, value, value >= 0 && value < 1); }
void is_size(const char* name, double value) {
  in_range(name, value, value >= 0 && std::isfinite(value));
}
void is_above_zero(const char* name, double value) {
  in_range(name, value, value > 0 && std::isfinite(value));
}

AdamConfig checked(const AdamConfig& c) {
  is_decay("beta1", c.beta1);
  is_decay("beta2", c.beta2);
  is_above_zero("eps", c.eps);
  is_size("weight_decay", c.weight_decay);
  return c;
}

/// One rule for all parameters, or two that share them.
class PyOptimiser {
 public:
  PyOptimiser(const py::object& parameters, double rate) : kept_(named(parameters)), rate_(rate) {
    check_rate(rate);
    for (const auto& [name, p] : kept_) ids_.push_back(p->id);
    std::sort(ids_.begin(), ids_.end());
  }

  void step(const Gradients& gradients, const std::optional<double>& rate, double scale,
            const std::optional<double>& clip, const std::optional<double>& clip_value) {
    if (rate) check_rate(*rate);
    in_range("scale", scale, std::isfinite(scale));
    if (clip) is_above_zero("clip", *clip);
    if (clip_value) is_above_zero("clip_value", *clip_value);
    const py::gil_scoped_release released;
    const std::lock_guard<std::recursive_mutex> lock(recording());
    std::optional<Gradients> small;
    if (clip_value)
      small = clipped(gradients, ids_, *clip_value / std::max(1e-300, std::abs(scale)));
    const Gradients& g = small ? *small : gradients;
    if (clip) scale *= std::min(1.0, *clip / (std::abs(scale) * g.norm(ids_) + 1e-6));
    for (const auto& [prefix, rule] : rules_) rule->step(g, rate.value_or(rate_), scale);
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
    for (const auto& [prefix, rule] : rules_) rule->load(prefix, file, "state");
  }

  double rate() const { return rate_; }
  void set_rate(double rate) {
    check_rate(rate);
    rate_ = rate;
  }

 protected:
  /// The parameters for which `takes` is true.
  template <class Takes>
  std::vector<NamedParameter> those(Takes&& takes) const {
    std::vector<NamedParameter> out;
    for (const auto& [name, p] : kept_)
      if (takes(*p)) out.push_back({name, p.get()});
    return out;
  }
  std::vector<NamedParameter> all() const {
    return those([](const Parameter&) { return true; });
  }
  template <class Rule, class... Settings>
  void add(const std::string& prefix, const std::vector<NamedParameter>& parameters,
           const Settings&... settings) {
    rules_.emplace_back(prefix, std::make_unique<Rule>(parameters, settings...));
  }

 private:
  static void check_rate(double rate) { is_size("rate", rate); }
  TensorFile own() const {
    TensorFile file;
    for (const auto& [prefix, rule] : rules_) rule->save(prefix, file);
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

  std::vector<std::pair<std::string, PyParameter>> kept_;
  std::vector<uint64_t> ids_;  // ascending
  double rate_;
  std::vector<std::pair<std::string, std::unique_ptr<UpdateRule>>> rules_;
};

struct PyAdam : PyOptimiser {
  using Bound = void;
  PyAdam(const py::object& parameters, double rate, double beta1, double beta2, double eps,
         double weight_decay)
      : PyOptimiser(parameters, rate) {
    add<Adam>("", all(), checked({beta1, beta2, eps, weight_decay}));
  }
};

struct PyAdamW : PyOptimiser {
  using Bound = void;
  PyAdamW(const py::object& parameters, double rate, double beta1, double beta2, double eps,
          double weight_decay)
      : PyOptimiser(parameters, rate) {
    add<Adam>("", all(), checked({beta1, beta2, eps, weight_decay}), Adam::Decay::of_weights);
  }
};

struct PySgd : PyOptimiser {
  using Bound = void;
  PySgd(const py::object& parameters, double rate, double momentum, bool nesterov,
        double weight_decay)
      : PyOptimiser(parameters, rate) {
    is_decay("momentum", momentum);
    is_size("weight_decay", weight_decay);
    if (nesterov && momentum == 0)
      throw InputError("", "nesterov needs a momentum above 0",
                       "give momentum=0.9, or leave it out");
    SgdConfig config;
    config.momentum = momentum;
    config.nesterov = nesterov;
    config.weight_decay = weight_decay;
    add<Sgd>("", all(), config);
  }
};

struct PyLion : PyOptimiser {
  using Bound = void;
  PyLion(const py::object& parameters, double rate, double beta1, double beta2, double weight_decay)
      : PyOptimiser(parameters, rate) {
    is_decay("beta1", beta1);
    is_decay("beta2", beta2);
    is_size("weight_decay", weight_decay);
    add<Lion>("", all(), LionConfig{beta1, beta2, weight_decay});
  }
};

struct PyMuon : PyOptimiser {
  using Bound = void;
  PyMuon(const py::object& parameters, double rate, double momentum, double step, double beta1,
         double beta2, double eps, double weight_decay)
      : PyOptimiser(parameters, rate) {
    is_decay("momentum", momentum);
    is_above_zero("step", step);
    const AdamConfig rest = checked({beta1, beta2, eps, weight_decay});
    add<Muon>("muon.", those([](const Parameter& p) { return Muon::takes(p); }),
              MuonConfig{momentum, step});
    add<Adam>("adam.", those([](const Parameter& p) { return !Muon::takes(p); }), rest);
  }
};

/// The rate of a step by its number.
struct PySchedule {
  using Bound = void;
  ScheduleConfig config;
  int64_t steps = 0;
  double at(int64_t step) const {
    if (step < 0) throw InputError("", cat("there is no step ", step), "count the steps from 0");
    return learning_rate(config, step, steps);
  }
};

PySchedule schedule_of(int64_t steps, const std::string& kind, double rate,
                       const py::kwargs& more) {
  if (steps < 1) throw InputError("", "a schedule needs 1 step or more", "give steps");
  ConfigNode tree;
  tree.kind = ConfigNode::Kind::map;
  const auto set = [&](const std::string& key, const std::string& value) {
    apply_override(tree, key + "=" + value);
  };
  set("kind", kind);
  set("rate", py::repr(py::float_(rate)));
  for (const auto& [key, value] : more) set(py::str(key), py::str(value));
  PySchedule out;
  read_config(tree, out.config);
  out.steps = steps;
  return out;
}

/// An average of parameters: exponential with a decay, or alike over all updates.
class PyAverage {
 public:
  using Bound = void;
  PyAverage(const py::object& parameters, const std::optional<double>& decay)
      : kept_(named(parameters)) {
    if (decay) in_range("decay", *decay, *decay > 0 && *decay < 1);
    std::vector<StateEntry> entries;
    for (const auto& [name, p] : kept_)
      entries.push_back({name, &p->value, p.get(), "", "", false});
    average_.emplace(std::move(entries), decay.value_or(0));
  }
  void update() {
    if (inside_) throw Error("the averages are in the parameters; swap() them back first");
    const std::lock_guard<std::recursive_mutex> lock(recording());
    average_->add(++updates_);
  }
  void swap() {
    const std::lock_guard<std::recursive_mutex> lock(recording());
    average_->exchange();
    inside_ = !inside_;
  }
  int64_t updates() const { return updates_; }

 private:
  std::vector<std::pair<std::string, PyParameter>> kept_;
  std::optional<WeightAverage> average_;
  int64_t updates_ = 0;
  bool inside_ = false;  // the parameters hold the averages
};

template <class Class>
void add_steps(Class& c) {
  c.def(
       "step",
       [](typename Class::type& self, const PyGradients& g, const std::optional<double>& rate,
          double scale, const std::optional<double>& clip,
          const std::optional<double>& clip_value) {
         self.step(g.gradients, rate, scale, clip, clip_value);
       },
       py::arg("gradients"), py::arg("rate") = py::none(), py::arg("scale") = 1.0,
       py::arg("clip") = py::none(), py::arg("clip_value") = py::none(),
       "One update by the gradients times scale; a parameter without one stays. Numbers beyond "
       "clip_value are cut to it, then the norm of all to clip, as torch's clip_grad_value_ and "
       "clip_grad_norm_ do.")
      .def_property("rate", &PyOptimiser::rate, &PyOptimiser::set_rate)
      .def("state_dict", &PyOptimiser::state)
      .def("load_state_dict", &PyOptimiser::load, py::arg("state"));
  refuse_copies(c,
                "an optimiser cannot be copied or pickled, as it writes to parameters of its own: "
                "take its state_dict(), and give it to load_state_dict() of a new one");
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
  py::class_<PyAdamW> adamw(m, "AdamW",
                            "Adam whose weights shrink by rate times weight_decay in a step, apart "
                            "from the gradient, as torch.optim.AdamW's.");
  adamw.def(py::init<const py::object&, double, double, double, double, double>(),
            py::arg("parameters"), py::arg("rate") = 1e-3, py::arg("beta1") = 0.9,
            py::arg("beta2") = 0.999, py::arg("eps") = 1e-8, py::arg("weight_decay") = 0.01);
  add_steps(adamw);
  py::class_<PySgd> sgd(m, "SGD",
                        "Plain steps along the gradient, or along its running sum, as "
                        "torch.optim.SGD's without dampening.");
  sgd.def(py::init<const py::object&, double, double, bool, double>(), py::arg("parameters"),
          py::arg("rate") = 1e-3, py::arg("momentum") = 0.0, py::arg("nesterov") = false,
          py::arg("weight_decay") = 0.0);
  add_steps(sgd);
  py::class_<PyLion> lion(m, "Lion",
                          "Lion (Chen et al. 2023): every number moves by the rate, in the "
                          "direction of the sign of an average of gradients.");
  lion.def(py::init<const py::object&, double, double, double, double>(), py::arg("parameters"),
           py::arg("rate") = 1e-4, py::arg("beta1") = 0.9, py::arg("beta2") = 0.99,
           py::arg("weight_decay") = 0.0);
  add_steps(lion);
  py::class_<PyMuon> muon(
      m, "Muon",
      "Muon (Jordan 2024) for matrices of 32 rows and columns or more, Adam for the rest. One rate "
      "serves both.");
  muon.def(py::init<const py::object&, double, double, double, double, double, double, double>(),
           py::arg("parameters"), py::arg("rate") = 1e-3, py::arg("momentum") = 0.95,
           py::arg("step") = 0.2, py::arg("beta1") = 0.9, py::arg("beta2") = 0.999,
           py::arg("eps") = 1e-8, py::arg("weight_decay") = 0.0);
  add_steps(muon);
  py::class_<PySchedule>(m, "Schedule",
                         "The learning rate of each step of a training of `steps` steps. Further "
                         "keys are those of a configuration's optimiser.schedule: warmup, "
                         "final_fraction, milestones, factor, power, period, period_factor, rise, "
                         "initial_fraction.")
      .def(py::init(&schedule_of), py::arg("steps"), py::arg("kind") = "constant",
           py::arg("rate") = 1e-3)
      .def("__call__", &PySchedule::at, py::arg("step"), "The rate of a step; the first is 0.");
  py::class_<PyAverage> average(m, "Average",
                                "An average of parameters: exponential with decay (EMA; the first "
                                "updates count more), else the mean of all updates (SWA).");
  average
      .def(py::init<const py::object&, const std::optional<double>&>(), py::arg("parameters"),
           py::arg("decay") = py::none())
      .def("update", &PyAverage::update, "Adds what the parameters are now.")
      .def("swap", &PyAverage::swap,
           "The averages into the parameters, and the other way round when called again.")
      .def_property_readonly("updates", &PyAverage::updates)
      .def(
          "__enter__",
          [](PyAverage& self) -> PyAverage& {
            self.swap();
            return self;
          },
          py::return_value_policy::reference_internal)
      .def("__exit__", [](PyAverage& self, const py::args&) { self.swap(); });
  refuse_copies(average,
                "an Average cannot be copied or pickled, as it is of parameters of its own");
}

}  // namespace restage::python
