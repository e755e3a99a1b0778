// python3 -m restage: the program in a process of Python, which can import networks.
#include <cstdio>

#include "autograd/base/shipped.h"
#include "python/own_network.h"

namespace restage::python {
namespace {

int run_program(const std::vector<std::string>& words) {
  be_the_program();
  std::vector<std::string> all = {"restage"};
  all.insert(all.end(), words.begin(), words.end());
  std::vector<char*> argv;
  for (std::string& word : all) argv.push_back(word.data());
  const py::gil_scoped_release released;
  const int code = cli::run(static_cast<int>(argv.size()), argv.data());
  std::fflush(stdout);  // Python has a buffer of its own
  return code;
}

}  // namespace

void add_main(py::module_& m) {
  m.def("main", &run_program, py::arg("words"),
        "Runs the program as a shell does, and returns its exit code.");
  m.def("be_the_program", &be_the_program);
  m.def("set_program_to_start",
        [](const std::vector<std::string>& words) { set_program_to_start(words); });
}

}  // namespace restage::python
