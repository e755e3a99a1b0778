// The program's commands, called from Python: the same options, checks and errors.
#include <algorithm>
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

void append_option(const std::string& name, const py::handle& value, Words& out) {
  if (value.is_none()) return;
  if (PyBool_Check(value.ptr()) || of_numpy(value, "numpy.bool")) {
    out.switches.emplace_back(name, PyObject_IsTrue(value.ptr()) == 1);
  } else if (PyList_Check(value.ptr()) || PyTuple_Check(value.ptr())) {
    for (const py::handle item : value)
      out.words.push_back("--" + name + "=" + value_of(name, item));
  } else {
    out.words.push_back("--" + name + "=" + value_of(name, value));
  }
}

/// The options of the command that the words begin with: "restage data build ...".
std::vector<cli::CommandTree::Option> options_of(const cli::Program& program,
                                                 const std::vector<std::string>& words) {
  cli::CommandTree at = program.tree();
  for (size_t k = 1; k < words.size() && !at.commands.empty(); ++k) {
    const auto named = [&](const cli::CommandTree& c) { return c.name == words[k]; };
    const auto found = std::find_if(at.commands.begin(), at.commands.end(), named);
    if (found == at.commands.end()) break;
    const cli::CommandTree below = *found;
    at = below;
  }
  return at.options;
}

/// True and False as the command's flags say them. Unknown names go on, so that the program says
/// which one was meant.
std::vector<std::string> flags_of(const Words& given,
                                  const std::vector<cli::CommandTree::Option>& known) {
  const auto& [words, switches] = given;
  const auto named = [&](const std::string& name) {
    return std::find_if(known.begin(), known.end(), [&](const auto& o) { return o.name == name; });
  };
  for (const std::string& word : words) {
    const std::string name = word.substr(0, word.find('='));
    if (name.size() < 3 || name.size() == word.size()) continue;
    if (named(name) == known.end() && named("--no-" + name.substr(2)) != known.end())
      throw InputError("", "'" + name.substr(2) + "' is " + word.substr(name.size() + 1),
                       "give True or False");
  }
  std::vector<std::string> out;
  for (const auto& [name, on] : switches) {
    const std::string yes = "--" + name, no = "--no-" + name;
    const auto flag = named(yes);
    if (flag != known.end() && flag->value)
      throw InputError("", "'" + name + "' is " + (on ? "True" : "False") + ", and needs a value",
                       "give the value" + std::string(on ? "" : ", or None"));
    const bool negative = named(no) != known.end();
    const bool older = std::any_of(known.begin(), known.end(), [&](const auto& o) {
      return std::find(o.formerly.begin(), o.formerly.end(), yes) != o.formerly.end();
    });
    if (!on && negative) out.push_back(no);
    if (flag == known.end() && !older ? !negative : on) out.push_back(yes);
  }
  return out;
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

void refuse(const std::string& option, const std::string& mend) {
  throw InputError("", "unknown option '" + option + "' of Python's restage", mend);
}

std::string run_words(const py::args& arguments, const py::kwargs& options) {
  Words given = words_of(options);
  std::vector<std::string> words;
  for (const py::handle word : arguments) words.push_back(value_of("argument", word));
  if (words.empty()) throw InputError("", "no command was given", "see 'restage --help'");
  for (const std::string& word : words)
    if (word == "-h" || word == "--help") refuse(word, "call it in a shell");
  const std::string name = words.front();
  words.erase(words.begin());
  words.emplace_back("--json");
  given.words.insert(given.words.begin(), words.begin(), words.end());
  Watch watch;
  return watch.run([&] { return run_command(name, given, cli::add_commands); });
}

/// As Python writes it; None where nothing is the default.
py::object default_of(const cli::CommandTree::Option& option, bool negative) {
  if (option.kind == cli::ValueKind::flag) return py::bool_(negative);
  if (option.default_value.empty() || option.several) return py::none();
  if (option.kind == cli::ValueKind::whole) return py::int_(std::stoll(option.default_value));
  if (option.kind == cli::ValueKind::number) return py::float_(std::stod(option.default_value));
  return py::str(option.default_value);
}

/// {keyword: default} of a command, or of "System".
py::dict option_defaults(const std::string& name) {
  cli::CommandTree tree;
  if (name == "System") {
    tree = cli::system_options();
  } else {
    cli::Program program;
    cli::add_commands(program);
    for (const cli::CommandTree& command : program.tree().commands)
      if (command.name == name) tree = command;
  }
  py::dict out;
  for (const cli::CommandTree::Option& option : tree.options) {
    std::string key = option.name.substr(2);
    if (cli::is_for_shells(key)) continue;
    const bool negative = option.kind == cli::ValueKind::flag && key.starts_with("no-");
    if (negative) key = key.substr(3);
    std::replace(key.begin(), key.end(), '-', '_');
    out[py::str(key)] = default_of(option, negative);
  }
  return out;
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

Words words_of(const py::dict& options) {
  Words out;
  bool verbose = false;
  for (const auto& [key, value] : options) {
    std::string name = bytes_of(key, "an option");
    for (char& c : name)
      if (c == '_') c = '-';
    if (cli::is_for_shells(name) || name.find('=') != std::string::npos)
      refuse("--" + name, name == "threads" ? "call restage.set_threads()" : "leave it out");
    verbose = verbose || (name == "verbose" && PyObject_IsTrue(value.ptr()) == 1);
    append_option(name, value, out);
  }
  if (!verbose) out.words.emplace_back("--quiet");
  return out;
}

std::string run_command(const std::string& name, Words given,
                        const std::function<void(cli::Program&)>& add) {
  std::vector<std::string>& words = given.words;
  words.insert(words.begin(), {"restage", name});
  // Program::run() sets them.
  if (name != "--version") words.push_back("--threads=" + std::to_string(chosen_threads));
  const StopScope stop;  // forgets what stopped an earlier command
  cli::Captured captured;
  cli::Program program;
  add(program);
  for (std::string& flag : flags_of(given, options_of(program, words)))
    words.push_back(std::move(flag));
  read_options(program, words);
  if (!program.renamed().empty()) {
    const py::gil_scoped_acquire acquired;
    for (const std::string& remark : program.renamed())
      if (PyErr_WarnEx(PyExc_DeprecationWarning, remark.c_str(), 1) != 0)
        throw py::error_already_set();
  }
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
  m.def("run", &run_words,
        "Runs `restage WORDS --options --json` in this process and returns what it would print.");
  m.def("option_defaults", &option_defaults,
        "The keywords of a command, or of System, with their defaults; None: none.");
  m.def("set_threads", &use_threads, py::arg("n"),
        "How many threads compute from now on; 0: as many as there are cores. Results have the "
        "same bits for any number.");
  m.def("threads", &threads, "How many threads compute.");
}

}  // namespace restage::python
