// restage.train: the command, with a function that is called after every step.
#include "experiments/cli/training/train.h"

#include <atomic>

#include "python/bind.h"

namespace restage::python {
namespace {

/// Calls a function of Python. The training stops (and writes a checkpoint first) on Ctrl-C or
/// where the function raises.
class StepWatch final : public TrainObserver {
 public:
  StepWatch(Watch& watch, py::object on_step) : watch_(watch), on_step_(std::move(on_step)) {}

  void on_step(const Stage& stage, int64_t done, const NamedValues& values) override {
    if (watch_.caught()) return;
    try {
      watch_([&] {
        if (on_step_.is_none()) return;
        py::dict figures;
        for (const auto& [name, value] : values) figures[py::str(name)] = value;
        on_step_(stage.name(), done, figures);
      });
    } catch (const Interrupted&) {  // kept; the trainer asks the watch whether to stop
    }
  }

 private:
  Watch& watch_;
  py::object on_step_;
};

/// Trainings of one process would write into one another's logs.
class OneAtATime {
 public:
  OneAtATime() {
    if (busy_.exchange(true))
      throw InputError("", "another training is going on in this process",
                       "wait for it, or train in processes of their own");
  }
  ~OneAtATime() { busy_ = false; }
  OneAtATime(const OneAtATime&) = delete;
  OneAtATime& operator=(const OneAtATime&) = delete;

 private:
  static inline std::atomic<bool> busy_{false};
};

std::string run(const py::args& arguments, const py::dict& options, const py::object& on_step) {
  const OneAtATime alone;
  Words given = words_of(options);
  for (const py::handle word : arguments) {
    const bool path = PyObject_HasAttrString(word.ptr(), "__fspath__");
    given.words.push_back(path ? path_of(word) : std::string(py::str(word)));
  }
  given.words.emplace_back("--json");
  Watch watch;
  StepWatch steps(watch, on_step);
  cli::TrainArguments a;
  a.observers.push_back(&steps);
  return watch.run([&] {
    return run_command("train", given, [&](cli::Program& program) {
      const auto action = [&] { return cli::run_train(a, program.common()); };
      cli::add_train_options(program.add("train", "", "", action), a);
    });
  });
}

}  // namespace

void add_train(py::module_& m) {
  m.def("train", [](const py::object& on_step, const py::dict& options, const py::args& words) {
    return run(words, options, on_step);
  });
}

}  // namespace restage::python
