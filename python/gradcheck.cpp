// restage.gradcheck: the engine's own checks, of a function of Python.
#include "autograd/gradcheck/gradcheck.h"

#include <mutex>

#include "autograd/base/parallel.h"
#include "python/engine.h"

namespace restage::python {
namespace {

std::string first_line(const py::error_already_set& error) {
  const std::string text = error.what();
  return text.substr(0, text.find('\n'));
}

/// A function of Python as the harness calls it. The harness takes an exception for a finding;
/// `raised` keeps one of Python's own.
gradcheck::Build build_of(const py::object& f, std::exception_ptr& raised) {
  // It is let go where the harness's copies are, which may be without the GIL.
  const std::shared_ptr<py::object> held(new py::object(f), [](py::object* p) {
    const py::gil_scoped_acquire acquired;
    delete p;
  });
  return [held, &raised](gradcheck::Args x) {
    const py::gil_scoped_acquire acquired;
    py::list arguments;
    for (const Var& v : x) arguments.append(py::cast(PyVar{v, nullptr, 0}));
    py::object y;
    try {
      y = (*held)(*py::tuple(arguments));
    } catch (const py::error_already_set& error) {
      if (!error.matches(PyExc_ValueError) && !error.matches(PyExc_RuntimeError))
        raised = std::current_exception();
      throw Error(first_line(error));
    }
    if (!py::isinstance<PyVar>(y)) throw ShapeError("gradcheck: the function gave no Var");
    return y.cast<PyVar>().var;
  };
}

struct PyReport {
  using Bound = void;
  gradcheck::Report report;
};

PyReport check(const py::object& f, const py::args& inputs, const std::string& name,
               bool zero_gradient, double f32_tolerance) {
  if (!PyCallable_Check(f.ptr())) throw ShapeError("gradcheck: the first argument is a function");
  if (inputs.empty()) throw ShapeError("gradcheck: give inputs");
  gradcheck::OpSamples op{name, ""};
  gradcheck::Sample sample;
  sample.title = "[inputs]";
  for (const py::handle one : inputs) {
    const Tensor t = tensor_of(one);
    sample.inputs.push_back(t.cast(DType::f64).clone());
  }
  std::exception_ptr raised;
  sample.build = build_of(f, raised);
  sample.zero_gradient = zero_gradient;
  sample.f32_tolerance = f32_tolerance;
  static std::mutex one_at_a_time;  // it sets how many threads compute
  thread_local bool checking = false;
  if (checking) throw ShapeError("gradcheck: the function that is checked calls gradcheck");
  const py::gil_scoped_release released;
  const std::lock_guard lock(one_at_a_time);
  checking = true;
  const int before = threads();
  PyReport out;
  try {
    out.report = gradcheck::check_sample(op, sample);
  } catch (...) {
    set_threads(before);
    checking = false;
    throw;
  }
  set_threads(before);
  checking = false;
  if (raised) std::rethrow_exception(raised);
  return out;
}

}  // namespace

void add_gradcheck(py::module_& m) {
  py::class_<PyReport>(m, "Report", "What gradcheck() found; true if all is well.")
      .def_property_readonly("ok", [](const PyReport& r) { return r.report.ok(); })
      .def_property_readonly("failures", [](const PyReport& r) { return r.report.failures; })
      .def_property_readonly(
          "compared", [](const PyReport& r) { return r.report.compared; },
          "derivatives compared with finite differences")
      .def("__bool__", [](const PyReport& r) { return r.report.ok(); })
      .def("__repr__", [](const PyReport& r) {
        return r.report.ok()
                   ? "Report(ok, " + std::to_string(r.report.compared) + " derivatives compared)"
                   : "Report(" + r.report.text() + ")";
      });
  m.def("gradcheck", &check,
        R"(Checks the gradient of f(*inputs), a function of Vars that returns a Var.

As every op of the engine is checked, in float64 (autograd/gradcheck/gradcheck.h): backward against central
differences, each input alone, a value used twice, the same bits again and for 1, 2 and 3 threads, float32 beside
float64. inputs: arrays at which f is smooth. The Report is true if all is well and says what is not.)",
        py::arg("f"), py::kw_only(), py::arg("name") = "f", py::arg("zero_gradient") = false,
        py::arg("f32_tolerance") = 1e-4);
}

}  // namespace restage::python
