// Which weights a stage hands on: the best validation's, averages, an early end; and that a
// training which was stopped anywhere decides as an undisturbed one.
#include "train/selection.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "autograd/base/atomic_file.h"
#include "autograd/base/interrupt.h"
#include "autograd/base/log.h"
#include "nn/config/config.h"
#include "tests/support/errors.h"
#include "tests/support/files.h"
#include "tests/support/handled_signals.h"
#include "tests/train/tiny_training.h"
#include "train/trainer.h"

namespace restage {
namespace {

using testing::Forwarding;
using testing::tiny_stage;
using testing::tiny_training;

constexpr int64_t kSelectionSteps = 12;
const double kNaN = std::numeric_limits<double>::quiet_NaN();
const TrainOptions kQuietOptions{
    .precision = MatmulPrecision::float32, .quiet = true, .observers = {}};

/// When a signal comes: before a step, or in the validation after so many steps; -1: never.
struct Stop {
  int64_t step = -1, validation = -1;
};

/// A stage whose validations, one every two steps, say what the test wants; a signal may come.
class Scripted final : public Forwarding {
 public:
  Scripted(std::vector<double> scores, Stop stop)
      : Forwarding(tiny_stage("deformation", tiny_training(kSelectionSteps))),
        scores_(std::move(scores)),
        stop_(stop) {}
  NamedValues step(int64_t step) override {
    if (step == stop_.step) ::raise(SIGTERM);
    done_ = step + 1;
    return Forwarding::step(step);
  }
  void save(TensorFile& file) const override {
    Forwarding::save(file);
    file.tensors["scripted.done"] = Tensor::from<int64_t>({1}, {done_});
  }
  void load(const TensorFile& file, const std::string& where) override {
    Forwarding::load(file, where);
    done_ = file.at("scripted.done", where).data<int64_t>()[0];
  }
  NamedValues validate() override {
    if (done_ == stop_.validation) ::raise(SIGTERM);
    throw_if_stopped();
    const int64_t at = done_ / 2 - (started_from_weights() ? 0 : 1);
    return {{"other", 1}, {"figure", scores_[static_cast<size_t>(at)]}};
  }

 private:
  std::vector<double> scores_;
  Stop stop_;
  int64_t done_ = 0;
};

class TrainSelection : public test::FileTest {
 protected:
  void SetUp() override {
    set_log_level(LogLevel::quiet);
    loop_.log_every = 100;
    loop_.validate_every = 2;
    loop_.checkpoint_every = 5;
    loop_.selection.monitor = {"deformation.figure"};
  }
  void TearDown() override { set_log_level(LogLevel::info); }

  /// Weights after a training in a new folder, or in one that is there.
  std::string trained(RunDir&& run, const std::vector<double>& scores, Stop stop = {}) {
    const MakeStage make = [&](const std::string&, Bundle*) {
      auto stage = std::make_unique<Scripted>(scores, stop);
      if (fine_tuning_) stage->start_from({}, {}, "given weights");
      return stage;
    };
    return safetensors_bytes(to_file(train(run, {"deformation"}, loop_, make, kQuietOptions)));
  }
  RunDir create(const std::string& name) {
    return RunDir::create_at(dir / name, "x: 1\n", "{}\n", {"deformation"});
  }
  std::string trained(const std::string& name, const std::vector<double>& scores) {
    return trained(create(name), scores);
  }
  /// Stopped by a signal and resumed by a new process, it ends as the undisturbed training `whole`,
  /// whose weights are `weights`.
  void expect_completes(const std::string& whole, const std::string& weights,
                        const std::vector<double>& scores, Stop stop) {
    const int64_t when = std::max(stop.step, stop.validation);
    const std::string name = (stop.step < 0 ? "validation" : "step") + std::to_string(when);
    EXPECT_THROW(trained(create(name), scores, stop), Interrupted) << name;
    handle_signals();
    EXPECT_TRUE(trained(RunDir::resume(dir / name, {"deformation"}), scores) == weights) << name;
    EXPECT_EQ(metrics(name), metrics(whole)) << name;
  }
  std::string metrics(const std::string& name) { return read_file(dir / name + "/metrics.jsonl"); }

  /// The networks in the checkpoint of a step.
  std::string weights_at(const std::string& name, int64_t step, const std::string& prefix = "") {
    const Checkpoint c = checkpoint_of(dir / name, "deformation", step);
    const TensorFile file = parse_safetensors(c.bytes, c.path);
    TensorFile out;
    for (const auto& [key, value] : file.tensors)
      if (key.starts_with(prefix + "deformation.")) out.tensors[key.substr(prefix.size())] = value;
    return safetensors_bytes(out);
  }
  static std::string tensors_of(const std::string& bytes) {
    TensorFile file = parse_safetensors(bytes, "weights");
    file.metadata.clear();
    return safetensors_bytes(file);
  }

  const test::HandledSignals handled_;
  LoopConfig loop_;
  bool fine_tuning_ = false;
};

TEST_F(TrainSelection, TheBestValidationIsHandedOn) {
  const std::vector<double> scores = {5, 3, kNaN, 3, 4, 6};  // at steps 2, 4 ... 12
  loop_.keep = 100;
  const std::string last = trained("last", scores);
  EXPECT_TRUE(tensors_of(last) == weights_at("last", 12));
  loop_.selection.choice = SelectionConfig::Export::best;
  loop_.keep = 2;
  const std::string best = trained("best", scores);
  EXPECT_TRUE(tensors_of(best) == weights_at("best", 4));
  EXPECT_FALSE(tensors_of(last) == weights_at("best", 4));
  const std::string lines = metrics("best");
  const auto end = nlohmann::json::parse(lines.substr(lines.rfind('\n', lines.size() - 2) + 1));
  EXPECT_EQ(end["step"], 12);
  EXPECT_EQ(end["best_step"], 4);
  // min_delta is for patience: the lowest is handed on
  loop_.selection.min_delta = 2.5;
  const std::string delta = trained("delta", scores);
  EXPECT_TRUE(tensors_of(delta) == weights_at("delta", 4));
}

TEST_F(TrainSelection, PatienceAsksForMoreThanMinDeltaAndTheLowestIsHandedOn) {
  loop_.selection.choice = SelectionConfig::Export::best;
  loop_.selection.patience = 2;
  loop_.selection.min_delta = 0.5;
  const std::vector<double> scores = {5, 4.8, 4.7, 1, 1, 1};  // at steps 2, 4, 6 ...
  const std::string got = trained("small", scores);
  EXPECT_EQ(latest_checkpoint(dir / "small", {"deformation"})->step, 6) << "ended early";
  EXPECT_TRUE(tensors_of(got) == weights_at("small", 6));
  // small steps add up to one that is large enough
  const std::vector<double> slow = {5, 4.7, 4.4, 4.2, 4.3, 4.4};
  const std::string steady = trained("slow", slow);
  EXPECT_EQ(latest_checkpoint(dir / "slow", {"deformation"})->step, 10);
  EXPECT_TRUE(tensors_of(steady) == weights_at("slow", 8));
  for (const int64_t when : {3, 5, 7, 8}) expect_completes("slow", steady, slow, {.step = when});
}

TEST_F(TrainSelection, TheBestValidationsStayAsFilesWithStepAndFigure) {
  const std::vector<double> scores = {5, 3, kNaN, 3, 4.25, 0.125};
  loop_.selection.keep_best = 3;
  const auto files = [&](const std::string& name) {
    std::vector<std::string> out;
    for (const auto& item : std::filesystem::directory_iterator(dir / name + "/best"))
      out.push_back(item.path().filename().string());
    std::sort(out.begin(), out.end());
    return out;
  };
  const std::vector<std::string> wanted = {"deformation-000000004-figure-3.safetensors",
                                           "deformation-000000008-figure-3.safetensors",
                                           "deformation-000000012-figure-0.125.safetensors"};
  const std::string last = trained("whole", scores);
  EXPECT_EQ(files("whole"), wanted);
  EXPECT_TRUE(tensors_of(read_file(dir / "whole/best/" + wanted[2])) == tensors_of(last));
  // They open as weights, and are those of the checkpoint of that step.
  loop_.keep_every = 4;
  loop_.checkpoint_every = 4;
  trained("marked", scores);
  EXPECT_TRUE(tensors_of(read_file(dir / "marked/best/" + wanted[0])) == weights_at("marked", 4));
  EXPECT_NE(load_bundle(dir / "marked/best/" + wanted[0]).find("deformation.weights"), nullptr);
  // A stop changes nothing; files of steps that are taken back go.
  for (const int64_t when : {3, 6, 9}) {
    const std::string name = "step" + std::to_string(when);
    expect_completes("marked", last, scores, {.step = when});
    EXPECT_EQ(files(name), wanted) << name;
  }
  std::filesystem::remove(checkpoint_of(dir / "marked", "deformation", 12).path);
  const std::string others = "marked/best/deformation-000000011-figure-0.1.safetensors";
  write_file_atomically(dir / others, "x");
  EXPECT_TRUE(trained(RunDir::resume(dir / "marked", {"deformation"}), scores) == last);
  EXPECT_EQ(files("marked"), wanted);
  loop_.selection.keep_best = 0;
  trained("none", scores);
  EXPECT_FALSE(std::filesystem::exists(dir / "none/best"));
}

TEST_F(TrainSelection, StochasticWeightAveragingIsTheMeanOfTheLastSteps) {
  loop_.keep_every = 1;
  loop_.checkpoint_every = 1;
  trained("plain", std::vector<double>(6, 1));
  loop_.selection.swa_from = 0.75;  // of 12 steps: the weights after 10, 11 and 12
  const std::string got = trained("averaged", std::vector<double>(6, 1));
  const std::string key = "deformation.weights.fc2.weight";
  const auto numbers = [&](const TensorFile& file) {
    return file.tensors.at(key).to_vector<float>();
  };
  std::vector<double> mean;
  for (const int64_t step : {10, 11, 12}) {
    EXPECT_TRUE(weights_at("plain", step) == weights_at("averaged", step)) << step;
    const auto w = numbers(parse_safetensors(weights_at("plain", step), "w"));
    mean.resize(w.size());
    for (size_t i = 0; i < w.size(); ++i) mean[i] += static_cast<double>(w[i]) / 3;
  }
  const auto average = numbers(parse_safetensors(got, "weights"));
  for (size_t i = 0; i < mean.size(); ++i) EXPECT_NEAR(average[i], mean[i], 1e-6);
  EXPECT_TRUE(weights_at("averaged", 9) == weights_at("averaged", 9, "loop.ema."))
      << "before, the weights themselves are validated";
  loop_.keep_every = 0;
  for (const int64_t when : {2, 9, 10, 11})
    expect_completes("averaged", got, std::vector<double>(6, 1), {.step = when});
}

TEST(SelectionKeys, OneAverageOnly) {
  SelectionConfig config;
  const auto read = [&](const std::string& yaml) {
    return test::refusal_of([&] { read_config(parse_yaml(yaml, "x.yaml"), config); });
  };
  EXPECT_HAS(read("swa_from: 0.5\nema: 0.9\n"), "x.yaml:1: 'swa_from' makes no sense with 'ema'");
  config = {};
  EXPECT_HAS(read("swa_from: 1\n"), "swa_from");
}

TEST_F(TrainSelection, FineTuningThatMakesWorseHandsOnWhatItBeganWith) {
  fine_tuning_ = true;
  loop_.selection.choice = SelectionConfig::Export::best;
  const std::vector<double> worse = {2, 5, 3, 4, 3, 4, 6}, better = {2, 5, 1, 4, 3, 4, 6};
  const std::string got = trained("worse", worse);
  EXPECT_TRUE(tensors_of(got) == weights_at("worse", 0));
  EXPECT_EQ(metrics("worse").find("\"step\":0,"), 1u) << metrics("worse").substr(0, 60);
  const std::string other = trained("better", better);
  EXPECT_TRUE(tensors_of(other) == weights_at("better", 4));
  for (const int64_t when : {0, 1, 5, 9}) expect_completes("worse", got, worse, {.step = when});
  for (const int64_t when : {0, 2, 12}) expect_completes("worse", got, worse, {.validation = when});
}

TEST_F(TrainSelection, PatienceEndsAStage) {
  loop_.selection.patience = 2;
  const std::string got = trained("patient", {5, 3, 4, kNaN, 1, 1});
  EXPECT_TRUE(tensors_of(got) == weights_at("patient", 8)) << "without export: best, the last";
  EXPECT_EQ(latest_checkpoint(dir / "patient", {"deformation"})->step, 8);
  loop_.selection.choice = SelectionConfig::Export::best;
  const std::string both = trained("both", {5, 3, 4, kNaN, 1, 1});
  EXPECT_TRUE(tensors_of(both) == weights_at("both", 4));
}

TEST_F(TrainSelection, AnAverageIsHandedOnAndTheWeightsGoOn) {
  loop_.keep_every = 1;
  loop_.checkpoint_every = 1;
  trained("plain", std::vector<double>(6, 1));
  loop_.selection.ema = 0.5;
  const std::string got = trained("averaged", std::vector<double>(6, 1));
  const auto tensor = [&](const std::string& name, int64_t step, const std::string& key) {
    const Checkpoint c = checkpoint_of(dir / name, "deformation", step);
    return parse_safetensors(c.bytes, c.path).tensors.at(key);
  };
  const std::string key = "deformation.weights.fc2.weight";
  for (const int64_t step : {1, 7, 12})
    EXPECT_TRUE(weights_at("plain", step) == weights_at("averaged", step)) << step;
  std::vector<double> expected;
  for (int64_t t = 1; t <= kSelectionSteps; ++t) {
    const Tensor w = tensor("plain", t, key);
    if (expected.empty()) {  // as it was before the first step
      const Scripted untrained({}, Stop{});
      for (const StateEntry& entry : untrained.weights())
        if (entry.name == key)
          expected.assign(entry.value->data<float>(), entry.value->data<float>() + w.numel());
    }
    const double keep =
        std::min(0.5, (1.0 + static_cast<double>(t)) / (10.0 + static_cast<double>(t)));
    for (int64_t i = 0; i < w.numel(); ++i)
      expected[static_cast<size_t>(i)] = keep * expected[static_cast<size_t>(i)] +
                                         (1 - keep) * static_cast<double>(w.data<float>()[i]);
  }
  const TensorFile handed_on = parse_safetensors(got, "weights");
  const Tensor& average = handed_on.tensors.at(key);
  for (int64_t i = 0; i < average.numel(); ++i)
    EXPECT_NEAR(static_cast<double>(average.data<float>()[i]), expected[static_cast<size_t>(i)],
                1e-6);
  EXPECT_TRUE(tensors_of(got) == weights_at("averaged", 12, "loop.ema."));
}

TEST_F(TrainSelection, StoppedAnywhereItEndsAsUndisturbed) {
  loop_.selection.choice = SelectionConfig::Export::best;
  loop_.selection.patience = 3;
  loop_.selection.ema = 0.9;
  const std::vector<double> scores = {5, 3, 4, 3.5, 3.2, 6};
  const std::string whole = trained("whole", scores);
  for (int64_t when = 0; when < 10; ++when)
    expect_completes("whole", whole, scores, {.step = when});
  for (int64_t when = 2; when <= 10; when += 2)
    expect_completes("whole", whole, scores, {.validation = when});
  // and one that had ended already
  EXPECT_TRUE(trained(RunDir::resume(dir / "whole", {"deformation"}), scores) == whole);
}

/// The figures that a stage says it measures are those of its validation, and no others can be
/// monitored.
TEST(TrainConfigLoop, MonitorsWhatTheConfigurationMeasures) {
  const auto monitoring = [](TrainConfig config, const std::string& figure) {
    config.loop.selection.monitor = {figure};
    return config;
  };
  TrainConfig plain = tiny_training(4), all = plain;
  testing::deformation(plain).offsets = false;
  testing::resize(testing::skeleton(plain).model, {"uncertainty=false"});
  CloudConfig& clouds = testing::skeleton(all).clouds;
  clouds.one_camera = clouds.camera_ring = clouds.intruder = 0.1;
  testing::resize(testing::skeleton(all).model, {"orientation=true"});
  for (const TrainConfig& config : {plain, all})
    for (const std::string name : {"skeleton", "motion", "deformation"}) {
      const auto stage = tiny_stage(name, config);
      std::vector<std::string> measured;
      for (const auto& figure : stage->validate()) measured.push_back(figure.first);
      EXPECT_EQ(stage->figures(), measured) << name;
      for (const std::string& figure : stage_type(name).figures) {
        const bool there = std::find(measured.begin(), measured.end(), figure) != measured.end();
        const std::string refused =
            test::refusal_of([&] { tiny_stage(name, monitoring(config, name + "." + figure)); });
        EXPECT_EQ(refused.empty(), there) << name << "." << figure << ": " << refused;
        if (there) continue;
        EXPECT_HAS(refused, "loop.monitor");
        EXPECT_HAS(refused, "'" + name + "." + figure + "'");
        EXPECT_HAS(refused, name + "." + measured[0]);
      }
    }
}

TEST(TrainConfigLoop, MonitorsNamedFiguresOnly) {
  TrainConfig config;
  const auto read = [&](const std::string& figures) {
    ConfigNode tree = write_config(config);
    apply_override(tree, "loop.monitor=[" + figures + "]");
    read_config(tree, config);
  };
  read("motion.pa_mpjpe, skeleton.one_camera_joint_error_mm");
  EXPECT_EQ(monitored(config.loop.selection, "skeleton"), "one_camera_joint_error_mm");
  EXPECT_EQ(monitored(config.loop.selection, "deformation"), "");
  EXPECT_THROW(read("motion.pa_mpjep"), InputError);
}

}  // namespace
}  // namespace restage
