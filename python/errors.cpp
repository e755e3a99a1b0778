// Our errors as exceptions of Python, with the line that the program would print.
#include <filesystem>

#include "autograd/base/atomic_file.h"
#include "autograd/base/error.h"
#include "autograd/base/interrupt.h"
#include "experiments/text.h"
#include "python/own_network.h"

namespace restage::python {
namespace {

// They live as long as the interpreter.
PyObject *input_error, *work_error, *shape_error_type, *non_finite_error;

PyObject* new_type(py::module_& m, const char* name, const char* help, const py::tuple& bases) {
  const std::string full = std::string("restage.") + name;
  PyObject* type = PyErr_NewExceptionWithDoc(full.c_str(), help, bases.ptr(), nullptr);
  if (type == nullptr) throw py::error_already_set();
  m.add_object(name, type);
  return type;
}

void set(PyObject* type, const Error& error) {
  const std::string line = error_line(error.what());
  // Names of files may hold any bytes.
  PyObject* text = PyUnicode_DecodeUTF8(line.data(), std::ssize(line), "replace");
  PyErr_SetObject(type, text);
  Py_XDECREF(text);
}

void translate_ours(const std::exception_ptr& thrown) {
  try {
    std::rethrow_exception(thrown);
  } catch (const Interrupted&) {
    PyErr_SetNone(PyExc_KeyboardInterrupt);
  } catch (const ShapeError& error) {
    set(shape_error_type, error);
  } catch (const NonFiniteError& error) {
    set(non_finite_error, error);
  } catch (const Error& error) {
    set(error.exit_code == 2 ? input_error : work_error, error);
  }
}

/// What the system would not do with a place that the user named, as the program tells it.
void translate(std::exception_ptr thrown) {
  if (!thrown) return;
  try {
    std::rethrow_exception(thrown);
  } catch (const std::filesystem::filesystem_error& error) {
    try {
      throw_refused(error.path1().string(), "used", error.code().value());
    } catch (...) {
      translate_ours(std::current_exception());
    }
  } catch (const Error&) {
    translate_ours(thrown);
  } catch (const py::cast_error&) {
    set(shape_error_type, ShapeError("a number is too large, or is no number"));
  }
}

/// " (mine.py, line 12)": the innermost place that is no file of ours. "" where there is none: a
/// call with other arguments than the function takes has no traceback.
std::string place_of(const py::error_already_set& error) {
  if (!error.trace()) return "";
  const py::list folders = py::module_::import("restage").attr("__path__");
  const std::string ours = std::string(py::str(folders[0])) + "/";
  const auto frames = py::module_::import("traceback").attr("extract_tb")(error.trace());
  std::string place;
  for (const py::handle frame : frames) {
    const std::string file = py::str(frame.attr("filename"));
    if (!file.starts_with(ours) && !file.starts_with("<"))
      place = file + ", line " + std::string(py::str(frame.attr("lineno")));
  }
  return place.empty() ? "" : " (" + place + ")";
}

/// "ValueError: no such thing (mine.py, line 12)"
std::string line_of(const py::error_already_set& error) {
  return std::string(py::str(error.type().attr("__name__"))) + ": " +
         std::string(py::str(error.value())) + place_of(error);
}

bool is_the_program = false;

py::object of(PyObject* type) { return py::reinterpret_borrow<py::object>(type); }

}  // namespace

void be_the_program() { is_the_program = true; }

void fail(const py::error_already_set& error, const std::string& where) {
  const std::string said = std::string(py::str(error.value()));
  const std::string mark = "restage: ";
  const std::string ours = said.starts_with(mark) ? said.substr(mark.size()) : said;
  if (error.matches(of(non_finite_error))) throw NonFiniteError(ours);
  if (!is_the_program) throw;  // NOLINT: called where it was caught
  const bool shape = error.matches(of(shape_error_type));
  if (!shape && error.matches(of(input_error))) throw InputError::of_line(ours);
  const std::string line = where + " failed: " + (shape ? ours + place_of(error) : line_of(error));
  if (error.trace())
    py::module_::import("traceback")
        .attr("print_exception")(error.type(), error.value(), error.trace());
  throw Error(line, 1);
}

void add_errors(py::module_& m) {
  input_error = new_type(m, "InputError",
                         "What was given is at fault: a file, an option, an array (the program's "
                         "exit code 2).",
                         py::make_tuple(of(PyExc_ValueError)));
  work_error = new_type(m, "WorkError",
                        "The work itself failed: a full disk, a training that diverged (the "
                        "program's exit code 1).",
                        py::make_tuple(of(PyExc_RuntimeError)));
  shape_error_type = new_type(m, "ShapeError", "Shapes or types that do not fit an op.",
                              py::make_tuple(of(input_error)));
  non_finite_error = new_type(m, "NonFiniteError", "A value became infinite or NaN.",
                              py::make_tuple(of(work_error)));
  py::register_exception_translator(&translate);
}

}  // namespace restage::python
