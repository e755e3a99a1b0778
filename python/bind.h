// The module `restage` of Python, in parts: each file adds its functions and classes. What they
// share is here. The package around it, which users see, is in restage/.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <chrono>
#include <exception>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "autograd/base/interrupt.h"
#include "experiments/cli/program.h"

namespace restage {
class Tensor;
struct Parameter;
}  // namespace restage

namespace restage::python {

namespace py = pybind11;

/// A class that Python knows: ours say so with `using Bound = void;`, those of the engine stand
/// here.
template <class T>
concept BoundToPython = requires {
  typename T::Bound;
}
|| std::is_same_v<T, Tensor> || std::is_same_v<T, Parameter>;

void add_errors(py::module_& m);
void add_command(py::module_& m);
void add_retarget(py::module_& m);
void add_system(py::module_& m);
void add_skeleton(py::module_& m);
void add_readers(py::module_& m);
void add_metrics(py::module_& m);
void add_tensor(py::module_& m);
void add_tape(py::module_& m);
void add_ops(py::module_& m);
void add_own_op(py::module_& m);
void add_gradcheck(py::module_& m);
void add_context(py::module_& m);
void add_model(py::module_& m);
void add_own_network(py::module_& m);
void add_data(py::module_& m);
void add_optim(py::module_& m);
void add_train(py::module_& m);
void add_main(py::module_& m);

// ---- calls into the program (command.cpp) -------------------------------------------------------

/// A command line of Python. What True and False mean for an option, only its command can tell.
struct Words {
  std::vector<std::string> words;
  std::vector<std::pair<std::string, bool>> switches;  ///< "foot-lock", without dashes
};
/// `--name=value` of every keyword of Python; None says nothing. InputError for what no command
/// line could say.
Words words_of(const py::dict& options);
/// A file's name, as bytes; InputError if it cannot be one.
std::string path_of(const py::handle& path);

/// A command as a caller of its own: `add` adds it to a Program and says what it does; `given` is
/// read by it. Returns what it prints. Is called without the GIL. InputError for True and False
/// where an option needs a value.
std::string run_command(const std::string& name, Words given,
                        const std::function<void(cli::Program&)>& add);

/// Looks whether Python wants something (Ctrl-C) while C++ works without the GIL, and carries an
/// exception of Python through C++ code that knows nothing of it.
class Watch {
 public:
  /// Runs `look` with the GIL, if it is given, and lets Python's signals be handled. An exception
  /// of Python is kept, and Interrupted goes up instead.
  void operator()(const std::function<void()>& look = nullptr);
  /// Whether there was one.
  bool caught() const { return caught_ != nullptr; }
  /// Runs work without the GIL; throws the exception that was kept, if there is one.
  template <class Work>
  auto run(const Work& work) -> decltype(work()) {
    const py::gil_scoped_release released;
    const HostSignals asked([this] { return wanted(); });
    try {
      if constexpr (std::is_void_v<decltype(work())>) {
        work();
        rethrow();
      } else {
        auto out = work();
        rethrow();  // the work may have ended before it looked
        return out;
      }
    } catch (...) {
      rethrow();
      throw;
    }
  }

 private:
  void rethrow() const {
    if (caught_) std::rethrow_exception(caught_);
  }
  /// Whether to stop. Asks Python some times a second, not more.
  bool wanted();
  std::chrono::steady_clock::time_point looked_{};
  std::exception_ptr caught_;
};

}  // namespace restage::python

namespace pybind11::detail {

/// pybind11 gives memory that holds nothing for an object whose __init__ was not called, as where a
/// subclass uses itself before super().__init__(). Here that is a TypeError.
template <class T>
class type_caster<T, std::enable_if_t<restage::python::BoundToPython<T>>>
    : public type_caster_base<T> {
 public:
  bool load(handle from, bool convert) {
    const type_info* type = get_type_info(typeid(T), true);
    if (from && PyObject_TypeCheck(from.ptr(), type->type) &&
        !reinterpret_cast<instance*>(from.ptr())->get_value_and_holder(type).holder_constructed())
      throw type_error(std::string(type->type->tp_name) + ": __init__ was not called yet");
    return type_caster_base<T>::load(from, convert);
  }
};

}  // namespace pybind11::detail
