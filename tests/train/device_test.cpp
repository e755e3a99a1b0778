// Every stage on a device whose memory the host cannot read: five steps give the bits of the CPU's,
// so nothing between the examples and the checkpoint touches the numbers in passing.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/emulated_gpu.h"
#include "tests/support/errors.h"
#include "tests/support/fake_device.h"
#include "tests/support/files.h"
#include "tests/support/gpu.h"
#include "tests/train/tiny_training.h"
#include "train/forecast.h"

namespace restage {
namespace {

using testing::choose;
using testing::deformation;
using testing::motion;
using testing::result_bytes;
using testing::skeleton;
using testing::tiny_stage;
using testing::tiny_training;

std::unique_ptr<Stage> stage_on(Device device, const std::string& name, TrainConfig config,
                                const Bundle& given = {}) {
  config.device = name_of(device);
  return tiny_stage(name, config, given);
}

struct Outcome {
  std::string bytes, handed_on;
  NamedValues logged, judged;
};

Outcome trained(Device device, const std::string& name, const TrainConfig& config,
                const Bundle& given = {}) {
  const auto stage = stage_on(device, name, config, given);
  Outcome out;
  for (int64_t i = 0; i < 5; ++i)
    for (const auto& value : stage->step(i)) out.logged.push_back(value);
  out.bytes = result_bytes(*stage);
  out.judged = stage->validate();
  for (const Shown& row : stage->show()) EXPECT_FALSE(row.label.empty());
  TensorFile weights;
  const Bundle result = stage->result();
  for (const auto& [role, model] : result) append(&weights, *model.net, prefix_of(role));
  out.handed_on = safetensors_bytes(weights);
  return out;
}

void expect_same(const std::string& name, const TrainConfig& config, const Bundle& given = {}) {
  const Outcome here = trained(Device{}, name, config, given);
  const int64_t before = fake_counts().kernels;
  const Outcome there = trained(fake_device(), name, config, given);
  EXPECT_GT(fake_counts().kernels, before + 100) << name;
  EXPECT_TRUE(here.bytes == there.bytes) << name;
  EXPECT_TRUE(here.handed_on == there.handed_on) << name;
  EXPECT_EQ(here.logged, there.logged) << name;
  EXPECT_EQ(here.judged, there.judged) << name;
}

TEST(DeviceStages, ThoseOfTheTinyTraining) {
  for (const std::string name : {"skeleton", "motion", "deformation"})
    expect_same(name, tiny_training(6));
}

TEST(DeviceStages, ThePapersExtractors) {
  TrainConfig c = tiny_training(6);
  skeleton(c).clouds.remembered = 0;
  choose(skeleton(c).model, "skeleton/point_transformer",
         {"points=64", "neighbours=4", "width=32", "layers=2"});
  expect_same("skeleton", c);
  choose(skeleton(c).model, "skeleton/pointnet", {"points=64", "dropout=0.3"});
  expect_same("skeleton", c);
}

TEST(DeviceStages, ALookAgainWithRotations) {
  TrainConfig c = tiny_training(6);
  choose(skeleton(c).model, "skeleton/patch_transformer",
         {"points=96", "width=32", "layers=1", "centres=24", "neighbours=8", "uncertainty=true",
          "memory=true", "orientation=true", "looks=2"});
  expect_same("skeleton", c);
}

TEST(DeviceStages, TheHybridOnWhatAnExtractorAnswers) {
  TrainConfig c = tiny_training(6);
  choose(skeleton(c).model, "skeleton/patch_transformer",
         {"points=96", "width=32", "layers=1", "centres=24", "neighbours=8", "uncertainty=true",
          "orientation=true"});
  skeleton(c).clouds.remembered = 0;
  const Bundle given = stage_on(Device{}, "skeleton", c)->result();
  MotionStageConfig& m = motion(c);
  choose(m.model, "smrm/hybrid", {"hidden=16", "contact=true", "latency=1"});
  m.windows.self_share = 1;
  m.windows.remove_heading = true;
  m.self_first_pass = true;
  m.paired_share = 0.5;
  m.weights.adversarial = 0;
  m.weights.contact = 0.1;
  m.answers.tracks.sequences = 4;
  m.answers.tracks.frames = 14;
  expect_same("motion", c, given);
}

/// What two devices that round in other ways come to: the same step, and from there not quite the
/// same training, since Adam's first steps go by the sign of gradients that may be next to nothing.
void expect_alike(const std::string& name, const TrainConfig& config, Device device) {
  const Outcome here = trained(Device{}, name, config), there = trained(device, name, config);
  ASSERT_EQ(here.logged.size(), there.logged.size());
  for (size_t i = 0; i < here.logged.size(); ++i) {
    const double value = here.logged[i].second, share = i < here.logged.size() / 5 ? 1e-3 : 0.1;
    EXPECT_NEAR(value, there.logged[i].second, share * (1e-3 + std::abs(value)))
        << name << " " << here.logged[i].first;
  }
  ASSERT_EQ(here.judged.size(), there.judged.size());
  for (size_t i = 0; i < here.judged.size(); ++i)
    EXPECT_NEAR(here.judged[i].second, there.judged[i].second,
                0.1 * (1e-3 + std::abs(here.judged[i].second)))
        << name << " " << here.judged[i].first;
}

TrainConfig papers_networks() {
  TrainConfig c = tiny_training(6);
  skeleton(c).clouds.remembered = 0;
  choose(skeleton(c).model, "skeleton/point_transformer",
         {"points=64", "neighbours=4", "width=32", "layers=2"});
  return c;
}

TEST(DeviceStages, TheKernelsOfTheGpuTrainAlike) {
  const int64_t before = emulated_counts().kernels;
  for (const std::string name : {"skeleton", "motion", "deformation"})
    expect_alike(name, papers_networks(), emulated_gpu());
  EXPECT_GT(emulated_counts().kernels, before + 1000);
}

TEST(DeviceGpu, StagesTrainAlikeAndRepeatTheirBits) {
  RESTAGE_GPU_OR_SKIP(gpu);
  for (const std::string name : {"skeleton", "motion", "deformation"}) {
    expect_alike(name, papers_networks(), gpu);
    const Outcome once = trained(gpu, name, papers_networks());
    EXPECT_TRUE(once.bytes == trained(gpu, name, papers_networks()).bytes) << name;
  }
}

TEST(DeviceStages, SayWhatTheirTensorsTakeOnTheDevice) {
  const Device gpu = emulated_gpu();
  const auto stage = stage_on(gpu, "skeleton", tiny_training(40));
  const StageForecast f = forecast(*stage, MatmulPrecision::float32, false);
  EXPECT_EQ(f.memory, memory_stats(gpu).peak);
  EXPECT_GT(f.memory, memory_stats(gpu).in_use);

  const test::TempDir dir;
  RunDir run = RunDir::create_at(dir / "run", "x: 1\n", "{}\n", {"skeleton"});
  ::testing::internal::CaptureStderr();
  train(run, {"skeleton"}, {},
        [&](const std::string& name, Bundle*) { return stage_on(gpu, name, tiny_training(3)); },
        {.quiet = true, .observers = {}});
  const std::string said = ::testing::internal::GetCapturedStderr();
  const std::string peak =
      std::to_string(std::llround(static_cast<double>(memory_stats(gpu).peak) / 1048576.0));
  EXPECT_HAS(said, "peak of tensors " + peak + " MiB on emulated gpu and ");
  EXPECT_HAS(said, " MiB on the host, ");
}

TEST(DeviceStages, BonesAndMicroBatches) {
  TrainConfig c = tiny_training(6);
  choose(deformation(c).model, "deformation/bones", {"width=16"});
  deformation(c).supervision = 0.1;
  c.loop.micro_batches = 2;
  expect_same("deformation", c);
  expect_same("motion", c);
}

TEST(DeviceStages, ACheckpointMovesBetweenDevices) {
  const TrainConfig c = tiny_training(6);
  for (const std::string name : {"skeleton", "motion", "deformation"}) {
    const auto whole = stage_on(Device{}, name, c), begun = stage_on(Device{}, name, c),
               gone_on = stage_on(fake_device(), name, c);
    for (int64_t i = 0; i < 4; ++i) whole->step(i);
    for (int64_t i = 0; i < 2; ++i) begun->step(i);
    TensorFile checkpoint;
    begun->save(checkpoint);
    gone_on->load(checkpoint, "checkpoint");
    for (int64_t i = 2; i < 4; ++i) gone_on->step(i);
    EXPECT_TRUE(result_bytes(*gone_on) == result_bytes(*whole)) << name;
  }
}

}  // namespace
}  // namespace restage
