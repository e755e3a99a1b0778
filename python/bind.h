// The module `restage` of Python, in parts: each file adds its functions and classes. What they
// share is here. The package around it, which users see, is in restage/.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <functional>
#include <string>
#include <vector>

#include "experiments/cli/program.h"

namespace restage::python {

namespace py = pybind11;

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
void add_model(py::module_& m);
void add_optim(py::module_& m);
void add_train(py::module_& m);

// ---- calls into the program (command.cpp) -------------------------------------------------------

/// `--name=value` of every keyword of Python: True is a flag, None and False say nothing.
/// InputError for what no command line could say.
std::vector<std::string> words_of(const py::dict& options);
/// A file's name, as bytes; InputError if it cannot be one.
std::string path_of(const py::handle& path);

/// A command as a caller of its own: `add` adds it to a Program and says what it does; `words` are
/// read by it. Returns what it prints. Is called without the GIL.
std::string run_command(const std::string& name, std::vector<std::string> words,
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
    try {
      return work();
    } catch (...) {
      if (caught_) std::rethrow_exception(caught_);
      throw;
    }
  }

 private:
  std::exception_ptr caught_;
};

}  // namespace restage::python
