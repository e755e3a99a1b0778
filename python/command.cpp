// The program's commands, called from Python: the same options, checks and errors.
#include <atomic>

#include "autograd/base/error.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "autograd/base/parallel.h"
#include "experiments/cli/commands.h"
#include "experiments/cli/output.h"
#include "python/bind.h"

namespace restage::python {
namespace {

std::atomic<int> chosen_threads{0};

std::string bytes_of(const py::handle& text, const std::string& what) {
  const auto bytes = py::reinterpret_steal<py::bytes>(PyUnicode_EncodeFSDefault(text.ptr()));
  if (!bytes) PyErr_Clear();
  std::string out = bytes ? std::string(bytes) : std::string(1, '\0');
  if (out.find('\0') != std::string::npos)
    throw InputError("", what + " holds what no name can hold", "give a plain text");
  return out;
}

/// Options of a program that prints, which would say nothing here.
bool of_the_shell(const std::string& name) {
  for (const char* other : {"json", "quiet", "help", "version", "threads"})
    if (name == other) return true;
  return false;
}

std::string value_of(const std::string& name, const py::handle& value) {
  if (PyObject_HasAttrString(value.ptr(), "__fspath__") || PyBytes_Check(value.ptr()))
    return path_of(value);
  std::string out = bytes_of(py::str(value), "'" + name + "'");
  if (out.empty()) throw InputError("", "'" + name + "' is an empty text", "leave it out, or None");
  return out;
}

/// Whether the name of a value's type begins so ("numpy.bool_", and "numpy.bool" from NumPy 2 on).
bool of_numpy(const py::handle& value, const char* type) {
  return std::string_view(Py_TYPE(value.ptr())->tp_name).starts_with(type);
}

void append_words(const std::string& name, const py::handle& value,
                  std::vector<std::string>& words) {
  const bool on_without = name == "foot-lock" || name == "steady-bones" || name == "keep-limbs";
  if (value.is_none()) return;
  if (PyBool_Check(value.ptr()) || of_numpy(value, "numpy.bool")) {
    const bool yes = PyObject_IsTrue(value.ptr()) == 1;
    if (on_without && !yes) words.push_back("--no-" + name);
    if (!on_without && yes) words.push_back("--" + name);
  } else if (PyList_Check(value.ptr()) || PyTuple_Check(value.ptr())) {
    for (const py::handle item : value) words.push_back("--" + name + "=" + value_of(name, item));
  } else {
    words.push_back("--" + name + "=" + value_of(name, value));
  }
}

/// Whether exit code 1 is an answer, which the document explains, and not a failure.
bool gives_verdicts(const std::vector<std::string>& words) {
  return words[1] == "doctor" || (words[1] == "data" && words.size() > 2 && words[2] == "verify");
}

/// Doing nothing and printing nothing, a command was not run.
void read_options(cli::Program& program, std::vector<std::string>& words) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  const int code = program.run(static_cast<int>(argv.size()), argv.data());
  if (code != 0 && !(code == 1 && gives_verdicts(words)))
    throw Error("the command ended with exit code " + std::to_string(code), code);
}

void use_threads(int n) {
  if (n < 0 || n > 1024)
    throw InputError("", "set_threads(" + std::to_string(n) + ") is out of range",
                     "give a number from 0 (all cores) to 1024");
  chosen_threads = n;
  set_threads(n);
}

std::string run_words(const py::args& arguments) {
  std::vector<std::string> words;
  for (const py::handle word : arguments) words.push_back(value_of("argument", word));
  if (words.empty()) throw InputError("", "no command was given", "see 'restage --help'");
  const std::string name = words.front();
  words.erase(words.begin());
  Watch watch;
  return watch.run([&] { return run_command(name, words, cli::add_commands); });
}

}  // namespace

std::string path_of(const py::handle& path) {
  const auto bytes = py::reinterpret_steal<py::object>(PyOS_FSPath(path.ptr()));
  if (!bytes) {
    PyErr_Clear();
    throw InputError(
        "",
        "'" + std::string(py::str(py::type::of(path).attr("__name__"))) + "' is no name of a file",
        "give a str or a path");
  }
  const bool plain = PyBytes_Check(bytes.ptr());
  std::string out = plain ? std::string(py::reinterpret_borrow<py::bytes>(bytes))
                          : bytes_of(bytes, "a file's name");
  if (out.empty()) throw InputError("", "a file's name is an empty text", "leave it out, or None");
  if (out.find('\0') != std::string::npos)
    throw InputError("", "a file's name holds what no name can hold", "give a plain name");
  return out;
}

std::vector<std::string> words_of(const py::dict& options) {
  std::vector<std::string> words;
  bool verbose = false;
  for (const auto& [key, value] : options) {
    std::string name = bytes_of(key, "an option");
    for (char& c : name)
      if (c == '_') c = '-';
    if (of_the_shell(name) || name.find('=') != std::string::npos)
      throw InputError("", "unknown option '--" + name + "' of Python's restage",
                       name == "threads" ? "call restage.set_threads()" : "leave it out");
    verbose = verbose || (name == "verbose" && PyObject_IsTrue(value.ptr()) == 1);
    append_words(name, value, words);
  }
  if (!verbose) words.emplace_back("--quiet");
  return words;
}

std::string run_command(const std::string& name, std::vector<std::string> words,
                        const std::function<void(cli::Program&)>& add) {
  words.insert(words.begin(), {"restage", name});
  // Program::run() sets them.
  if (name != "--help" && name != "--version")
    words.push_back("--threads=" + std::to_string(chosen_threads));
  const StopScope stop;  // forgets what stopped an earlier command
  cli::Captured captured;
  cli::Program program;
  add(program);
  read_options(program, words);
  return captured.text;
}

void Watch::operator()(const std::function<void()>& look) {
  const py::gil_scoped_acquire acquired;
  try {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (look) look();
  } catch (const py::error_already_set&) {
    caught_ = std::current_exception();
    throw Interrupted(2);
  }
}

bool Watch::wanted() {
  const auto now = std::chrono::steady_clock::now();
  if (caught_ || now - looked_ < std::chrono::milliseconds(50)) return caught();
  looked_ = now;
  try {
    (*this)();
  } catch (const Interrupted&) {
  }
  return caught();
}

void add_command(py::module_& m) {
  set_log_level(LogLevel::quiet);
  m.def("run", &run_words, "Runs `restage WORDS` in this process and returns what it would print.");
  m.def("words_of", &words_of);
  m.def("set_threads", &use_threads, py::arg("n"),
        "How many threads compute from now on; 0: as many as there are cores. Results have the "
        "same bits for any number.");
  m.def("threads", &threads, "How many threads compute.");
}

}  // namespace restage::python
