// restage.train: the command, with a function that is called after every step.
#include "experiments/cli/training/train.h"

#include <atomic>

#include "python/bind.h"
#include "train/stages/registry.h"

namespace restage::python {
namespace {

/// Calls a function of Python. The training stops (and writes a checkpoint first) on Ctrl-C or
/// where the function raises.
class StepWatch final : public TrainObserver {
 public:
  StepWatch(Watch& watch, py::object on_step, py::object on_validation)
      : watch_(watch), on_step_(std::move(on_step)), on_validation_(std::move(on_validation)) {}

  void on_step(const Stage& stage, int64_t done, const NamedValues& values) override {
    if (watch_.caught()) return;
    try {
      watch_([&] {
        if (on_step_.is_none()) return;
        on_step_(stage.name(), done, dict_of(values));
      });
    } catch (const Interrupted&) {  // kept; the trainer asks the watch whether to stop
    }
  }

  /// A dict that comes back is added to the figures; False ends the stage.
  bool measure(Stage& stage, int64_t done, NamedValues* figures) override {
    bool goes_on = true;
    if (watch_.caught()) return goes_on;
    watch_([&] {
      if (on_validation_.is_none()) return;
      const py::object said = on_validation_(stage.name(), done, dict_of(*figures));
      if (said.is(py::bool_(false))) goes_on = false;
      if (!py::isinstance<py::dict>(said)) return;
      for (const auto& [name, value] : py::reinterpret_borrow<py::dict>(said))
        figures->emplace_back(py::str(name), py::float_(py::reinterpret_borrow<py::object>(value)));
    });
    return goes_on;
  }

 private:
  static py::dict dict_of(const NamedValues& values) {
    py::dict out;
    for (const auto& [name, value] : values) out[py::str(name)] = value;
    return out;
  }

  Watch& watch_;
  py::object on_step_, on_validation_;
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

/// Figures of on_validation that a configuration may name, as long as a training goes on.
class MoreFigures {
 public:
  explicit MoreFigures(std::vector<std::string> figures) { set_more_figures(std::move(figures)); }
  ~MoreFigures() { set_more_figures({}); }
  MoreFigures(const MoreFigures&) = delete;
  MoreFigures& operator=(const MoreFigures&) = delete;
};

std::string run(const py::args& arguments, const py::dict& options, const py::object& on_step,
                const py::object& on_validation, const std::vector<std::string>& figures) {
  const OneAtATime alone;
  const MoreFigures more(figures);
  Words given = words_of(options);
  for (const py::handle word : arguments) {
    const bool path = PyObject_HasAttrString(word.ptr(), "__fspath__");
    given.words.push_back(path ? path_of(word) : std::string(py::str(word)));
  }
  given.words.emplace_back("--json");
  Watch watch;
  StepWatch steps(watch, on_step, on_validation);
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
  m.def("train",
        [](const py::object& on_step, const py::object& on_validation,
           const std::vector<std::string>& figures, const py::dict& options,
           const py::args& words) { return run(words, options, on_step, on_validation, figures); });
}

}  // namespace restage::python
