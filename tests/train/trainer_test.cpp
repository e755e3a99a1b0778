// The loop around the stages: files of a run, resume after a stop and after a kill, metrics. And
// clipping by the norm of what is optimised.
#include "train/trainer.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "autograd/base/atomic_file.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "autograd/gradcheck/evaluate.h"
#include "nn/layers/linear.h"
#include "tests/support/files.h"
#include "tests/support/handled_signals.h"
#include "tests/train/tiny_training.h"
#include "train/optim/optimiser.h"

namespace restage {
namespace {

namespace fs = std::filesystem;
using testing::Forwarding;
using testing::tiny_stage;
using testing::tiny_training;

constexpr int64_t kSteps = 9;
const TrainOptions kQuiet{.precision = MatmulPrecision::float32, .quiet = true, .observers = {}};
const std::vector<std::string> kAll = {"skeleton", "motion", "deformation"};

/// Does something of the test's own before one of its steps.
class Disturbed final : public Forwarding {
 public:
  Disturbed(std::unique_ptr<Stage> stage, int64_t when, std::function<void()> what)
      : Forwarding(std::move(stage)), when_(when), what_(std::move(what)) {}
  NamedValues step(int64_t step) override {
    if (step == when_) what_();
    return Forwarding::step(step);
  }

 private:
  int64_t when_;
  std::function<void()> what_;
};

/// A signal comes at the beginning of one of its validations.
class SignalledValidation final : public Forwarding {
 public:
  SignalledValidation(std::unique_ptr<Stage> stage, int number)
      : Forwarding(std::move(stage)), number_(number) {}
  NamedValues validate() override {
    if (number_-- == 0) ::raise(SIGTERM);
    return Forwarding::validate();
  }

 private:
  int number_;
};

struct Killed : std::runtime_error {
  Killed() : std::runtime_error("killed") {}
};

class TrainTrainer : public test::FileTest {
 protected:
  const test::HandledSignals handled_;
  void SetUp() override { set_log_level(LogLevel::quiet); }
  void TearDown() override { set_log_level(LogLevel::info); }
  RunDir create(const std::string& name) const {
    return RunDir::create_at(dir / name, "x: 1\n", "{}\n", kAll);
  }

  static MakeStage plain() {
    return [](const std::string& name, Bundle*) { return tiny_stage(name, tiny_training(kSteps)); };
  }
  /// `what` happens before step `when` of stage `which`.
  static MakeStage disturbed(const std::string& which, int64_t when,
                             const std::function<void()>& what) {
    return [=](const std::string& name, Bundle*) -> std::unique_ptr<Stage> {
      auto stage = tiny_stage(name, tiny_training(kSteps));
      if (name != which) return stage;
      return std::make_unique<Disturbed>(std::move(stage), when, what);
    };
  }
  static LoopConfig loop() { return {.log_every = 2, .validate_every = 5, .checkpoint_every = 4}; }
  static std::string weights(const Bundle& set) { return safetensors_bytes(to_file(set)); }
  std::string metrics(const std::string& name) const {
    return read_file(dir / name + "/metrics.jsonl");
  }

  /// What an undisturbed training gives, made once.
  struct Whole {
    std::string weights, metrics;
  };
  const Whole& whole() {
    static Whole result;
    if (result.weights.empty()) {
      RunDir run = create("whole");
      result.weights = weights(train(run, kAll, loop(), plain(), kQuiet));
      result.metrics = metrics("whole");
    }
    return result;
  }
  /// Trains until it is stopped by a signal; then it is as in a new process.
  void expect_stopped(RunDir&& run, const MakeStage& make, const TrainOptions& options = kQuiet) {
    try {
      train(run, kAll, loop(), make, options);
      ADD_FAILURE() << run.dir() << " is not stopped";
    } catch (const Interrupted& stopped) {
      EXPECT_EQ(stopped.exit_code, 143) << run.dir();
    }
    handle_signals();
  }
  /// Resumes `name`, which must then be the same as the undisturbed training.
  void expect_completes(const std::string& name) {
    RunDir run = RunDir::resume(dir / name, kAll);
    EXPECT_TRUE(weights(train(run, kAll, loop(), plain(), kQuiet)) == whole().weights) << name;
    EXPECT_EQ(metrics(name), whole().metrics) << name;
  }
};

TEST_F(TrainTrainer, MetricsSayWhatHappened) {
  std::istringstream lines(whole().metrics);
  std::map<std::string, std::vector<int64_t>> losses, scores;
  for (std::string line; std::getline(lines, line);) {
    const auto json = nlohmann::json::parse(line);
    (json.contains("loss") ? losses : scores)[json["stage"]].push_back(json["step"]);
  }
  for (const std::string& stage : kAll) {
    EXPECT_EQ(losses[stage], (std::vector<int64_t>{2, 4, 6, 8, 9})) << stage;
    EXPECT_EQ(scores[stage], (std::vector<int64_t>{5, 9})) << stage;
  }
}

TEST_F(TrainTrainer, CheckpointsAreLeftAtTheEndsOfStages) {
  whole();
  RunDir run = create("a");
  train(run, kAll, loop(), plain(), kQuiet);
  for (const std::string& stage : kAll) {
    const auto last = latest_checkpoint(run.dir(), {stage});
    ASSERT_TRUE(last) << stage;
    EXPECT_EQ(last->step, kSteps);
  }
  const Bundle models = bundle_of(parse_safetensors(whole().weights, "w"), "w");
  for (const char* role : {"skeleton", "motion", "deformation.weights", "deformation.offsets"})
    EXPECT_NE(models.find(role), nullptr) << role;
}

TEST_F(TrainTrainer, StopByASignalWritesACheckpointAndResumesToTheSameBits) {
  for (const std::string& stage : kAll) {
    expect_stopped(create(stage), disturbed(stage, 5, [] { ::raise(SIGTERM); }));
    const auto last = latest_checkpoint(dir / stage, kAll);
    ASSERT_TRUE(last) << stage;
    EXPECT_EQ(last->stage, stage);
    EXPECT_EQ(last->step, 6);  // the step in which the signal came is finished
    expect_completes(stage);
  }
}

/// Slurm's warning may come at any moment, also when a stage has done its last step.
TEST_F(TrainTrainer, AStopInTheLastCheckpointOfAStageEndsTheTraining) {
  struct Signal final : TrainObserver {
    void on_checkpoint(const Stage& stage, int64_t done, const std::string&) override {
      if (stage.name() == which && done == kSteps) ::raise(SIGTERM);
    }
    std::string which;
  } signal;
  TrainOptions options = kQuiet;
  options.observers = {&signal};
  for (const std::string& stage : kAll) {
    signal.which = stage;
    expect_stopped(create(stage), plain(), options);
    const auto last = latest_checkpoint(dir / stage, kAll);
    ASSERT_TRUE(last) << stage;
    EXPECT_EQ(last->stage, stage);
    EXPECT_EQ(last->step, kSteps);
    expect_completes(stage);
  }
}

TEST_F(TrainTrainer, AStopLeavesAValidationUnfinishedAndItIsMadeUpLater) {
  for (const std::string& which : kAll)
    for (const int number : {0, 1}) {
      const std::string name = which + std::to_string(number);
      expect_stopped(create(name),
                     [&](const std::string& stage, Bundle*) -> std::unique_ptr<Stage> {
                       auto out = tiny_stage(stage, tiny_training(kSteps));
                       if (stage != which) return out;
                       return std::make_unique<SignalledValidation>(std::move(out), number);
                     });
      const auto last = latest_checkpoint(dir / name, kAll);
      ASSERT_TRUE(last) << name;
      EXPECT_EQ(last->stage, which);
      EXPECT_EQ(last->step, number == 0 ? 5 : kSteps);
      // All lines up to the one of that validation.
      ASSERT_TRUE(whole().metrics.starts_with(metrics(name))) << metrics(name);
      const std::string missing = whole().metrics.substr(metrics(name).size());
      EXPECT_EQ(missing.substr(0, missing.find('\n')).find("\"loss\""), std::string::npos)
          << missing;
      expect_completes(name);
    }
}

TEST_F(TrainTrainer, AStageOfNoStepsMayBeStoppedInItsValidation) {
  const auto make = [](int number) -> MakeStage {
    return [number](const std::string& stage, Bundle*) -> std::unique_ptr<Stage> {
      auto out = tiny_stage(stage, tiny_training(stage == "skeleton" ? 0 : kSteps));
      if (stage != "skeleton") return out;
      return std::make_unique<SignalledValidation>(std::move(out), number);
    };
  };
  RunDir undisturbed = create("undisturbed");
  const std::string got = weights(train(undisturbed, kAll, loop(), make(-1), kQuiet));
  expect_stopped(create("stopped"), make(0));
  EXPECT_EQ(metrics("stopped"), "");
  RunDir again = RunDir::resume(dir / "stopped", kAll);
  EXPECT_TRUE(weights(train(again, kAll, loop(), make(-1), kQuiet)) == got);
  EXPECT_EQ(metrics("stopped"), metrics("undisturbed"));
}

/// Notes the precision of products in steps and validations.
class Watched final : public Forwarding {
 public:
  Watched(std::unique_ptr<Stage> stage, std::vector<MatmulPrecision>& steps,
          std::vector<MatmulPrecision>& validations)
      : Forwarding(std::move(stage)), steps_(steps), validations_(validations) {}
  NamedValues step(int64_t step) override {
    steps_.push_back(matmul_precision());
    return Forwarding::step(step);
  }
  NamedValues validate() override {
    validations_.push_back(matmul_precision());
    return Forwarding::validate();
  }

 private:
  std::vector<MatmulPrecision>&steps_, &validations_;
};

TEST_F(TrainTrainer, PrecisionIsForStepsOnly) {
  std::vector<MatmulPrecision> steps, validations;
  const MakeStage watched = [&](const std::string& name, Bundle*) -> std::unique_ptr<Stage> {
    return std::make_unique<Watched>(tiny_stage(name, tiny_training(kSteps)), steps, validations);
  };
  RunDir run = create("tf32");
  const auto tf32 = MatmulPrecision::tf32;
  const std::string got = weights(
      train(run, kAll, loop(), watched, {.precision = tf32, .quiet = true, .observers = {}}));
  EXPECT_EQ(steps, std::vector<MatmulPrecision>(3 * kSteps, tf32));
  EXPECT_EQ(validations, std::vector<MatmulPrecision>(6, MatmulPrecision::float32));
  EXPECT_EQ(matmul_precision(), MatmulPrecision::float32);
  EXPECT_THROW(
      {
        RunDir other = create("stopped");
        train(other, kAll, loop(), disturbed("motion", 3, [] { throw Killed(); }),
              {.precision = tf32, .quiet = true, .observers = {}});
      },
      Killed);
  EXPECT_EQ(matmul_precision(), MatmulPrecision::float32) << "after an error";
  RunDir again = RunDir::resume(dir / "stopped", kAll);
  EXPECT_TRUE(weights(train(again, kAll, loop(), plain(),
                            {.precision = tf32, .quiet = true, .observers = {}})) == got);
}

/// Counts what it is told.
struct Counting final : TrainObserver {
  int steps = 0, validations = 0, checkpoints = 0;
  void on_step(const Stage&, int64_t, const NamedValues&) override { ++steps; }
  void on_validation(Stage&, int64_t, const NamedValues&) override { ++validations; }
  void on_checkpoint(const Stage&, int64_t, const std::string& path) override {
    checkpoints += fs::exists(path) ? 1 : 0;
  }
};

TEST_F(TrainTrainer, ObserversSeeEverything) {
  Counting seen;
  RunDir run = create("observed");
  TrainOptions options = kQuiet;
  options.observers = {&seen};
  train(run, {"skeleton"}, loop(), plain(), options);
  EXPECT_EQ(seen.steps, kSteps);
  EXPECT_EQ(seen.validations, 2);
  EXPECT_EQ(seen.checkpoints, 3);
}

/// Adds a figure, and ends the first stage at its first validation.
struct Judging final : TrainObserver {
  bool measure(Stage& stage, int64_t, NamedValues* figures) override {
    figures->emplace_back("mine", 1.5);
    return stage.name() != "skeleton";
  }
};

TEST_F(TrainTrainer, AnObserverAddsAFigureAndEndsAStage) {
  Judging judging;
  Counting seen;
  TrainOptions options = kQuiet;
  options.observers = {&judging, &seen};
  const std::vector<std::string> stages = {"skeleton", "deformation"};
  const auto stopping = disturbed("deformation", 3, [] { throw Killed(); });
  {
    RunDir run = create("judged");
    EXPECT_THROW(train(run, stages, loop(), stopping, options), Killed);
  }
  EXPECT_HAS(metrics("judged"), "\"mine\":1.5");
  EXPECT_LT(seen.steps, kSteps + 3);
  // What was told is in the checkpoint: the resumed training does not go on with the first stage.
  Counting later;
  options.observers = {&later};
  RunDir again = RunDir::resume(dir / "judged", stages);
  train(again, stages, loop(), plain(), options);
  EXPECT_LE(later.steps, kSteps);
}

TEST_F(TrainTrainer, AStageOfNoStepsLeavesItsNetworksAndACheckpoint) {
  struct Stopping final : TrainObserver {
    void on_step(const Stage& stage, int64_t done, const NamedValues&) override {
      if (stage.name() == "motion" && done == 4) throw Killed();
    }
  } stopping;
  const MakeStage make = [](const std::string& name, Bundle*) {
    return tiny_stage(name, tiny_training(name == "skeleton" ? 0 : kSteps));
  };
  RunDir run = create("none");
  const std::string got = weights(train(run, kAll, loop(), make, kQuiet));
  TrainOptions options = kQuiet;
  options.observers = {&stopping};
  EXPECT_THROW(
      {
        RunDir other = create("none-stopped");
        train(other, kAll, loop(), make, options);
      },
      Killed);
  {
    RunDir again = RunDir::resume(dir / "none-stopped", kAll);
    EXPECT_TRUE(weights(train(again, kAll, loop(), make, kQuiet)) == got);
  }
  EXPECT_EQ(metrics("none-stopped"), metrics("none")) << "a stage of no steps is judged once";
  Counting seen;
  options.observers = {&seen};
  RunDir complete = RunDir::resume(dir / "none-stopped", kAll);
  EXPECT_TRUE(weights(train(complete, kAll, loop(), make, options)) == got);
  EXPECT_EQ(seen.validations, 0);
  EXPECT_EQ(seen.checkpoints, 0);
}

TEST_F(TrainTrainer, TwoStopsInARow) {
  for (const int64_t when : {1, 3}) {
    RunDir run = when == 1 ? create("twice") : RunDir::resume(dir / "twice", kAll);
    EXPECT_THROW(
        train(run, kAll, loop(), disturbed("motion", when, [] { ::raise(SIGINT); }), kQuiet),
        Interrupted);
    handle_signals();  // a new process
  }
  expect_completes("twice");
}

TEST_F(TrainTrainer, FailureGoesBackToTheCheckpointBefore) {
  const std::pair<const char*, int64_t> moments[] = {
      {"skeleton", 0}, {"skeleton", 7}, {"motion", 4}, {"deformation", 0}, {"deformation", 8}};
  for (const auto& [stage, when] : moments) {
    const std::string name = stage + std::to_string(when);
    {
      RunDir run = create(name);
      EXPECT_THROW(train(run, kAll, loop(), disturbed(stage, when, [] { throw Killed(); }), kQuiet),
                   Killed);
    }
    expect_completes(name);
  }
}

TEST_F(TrainTrainer, ResumedCompleteRunGivesItsModelsAgain) {
  {
    RunDir run = create("done");
    train(run, kAll, loop(), plain(), kQuiet);
  }
  expect_completes("done");
}

TEST_F(TrainTrainer, MissingCheckpointOfAnEarlierStageIsSaid) {
  {
    RunDir run = create("gap");
    EXPECT_THROW(train(run, kAll, loop(), disturbed("motion", 6, [] { throw Killed(); }), kQuiet),
                 Killed);
  }
  fs::remove(latest_checkpoint(dir / "gap", {"skeleton"})->path);
  test::expect_error<InputError>([&] { RunDir::resume(dir / "gap", kAll); }, {"'skeleton'"});
}

TEST_F(TrainTrainer, DivergenceIsAFailureThatNamesThePlace) {
  RunDir run = create("diverged");
  const MakeStage make = [](const std::string& name, Bundle*) {
    TrainConfig c = tiny_training(kSteps);
    testing::skeleton(c).optimiser.schedule = {};
    testing::skeleton(c).optimiser.schedule.rate = 1e25;
    return tiny_stage(name, c);
  };
  test::expect_error<NonFiniteError>([&] { train(run, kAll, loop(), make, kQuiet); },
                                     {"skeleton/patch_transformer"});
}

/// The weights after one step on gradients of `own` each; `foreign`: of a parameter of somebody
/// else that took part.
Tensor after_step(double own, double foreign, double clip) {
  Linear layer(2, 2, Init{RngKey{1, 0}, DType::f64}, false);
  const Parameter other(Tensor::zeros({2}, DType::f64));
  Gradients g;
  g.set(layer.weight.id, Tensor::full({2, 2}, own, DType::f64));
  if (foreign > 0) g.set(other.id, Tensor::full({2}, foreign, DType::f64));
  OptimiserConfig config;
  config.clip = clip;
  config.adam.eps = 1e3;  // so that the size of a step follows that of the gradient
  Optimiser({{"", &layer}}, config).step(g, 1);
  return layer.weight.value;
}

TEST(Clipping, IsByTheNormOfWhatIsOptimisedAndNothingElse) {
  using gradcheck::same_bits;
  const Tensor alone = after_step(3, 0, 1);
  EXPECT_TRUE(same_bits(alone, after_step(3, 1e6, 1)));
  EXPECT_FALSE(same_bits(alone, after_step(3, 0, 0))) << "a norm of 6 is clipped to 1";
  EXPECT_TRUE(same_bits(after_step(0.1, 1e6, 1), after_step(0.1, 0, 0))) << "one of 0.2 is not";
}

TEST(GradientNorms, AreOfTheLeavesThatAreNamed) {
  Gradients g;
  g.set(1, Tensor::full({2}, 3, DType::f64));
  g.set(7, Tensor::full({1}, 4, DType::f64));
  const std::vector<uint64_t> first{1}, both{1, 7}, with_absent{1, 5};
  EXPECT_DOUBLE_EQ(g.norm(first), std::sqrt(18.0));
  EXPECT_DOUBLE_EQ(g.norm(with_absent), std::sqrt(18.0));
  EXPECT_DOUBLE_EQ(g.norm(both), g.norm());
  EXPECT_DOUBLE_EQ(g.norm(), std::sqrt(34.0));
  g.set(7, Tensor::full({1}, 0, DType::f64));  // no stale part remains
  EXPECT_DOUBLE_EQ(g.norm(), std::sqrt(18.0));
}

}  // namespace
}  // namespace restage
