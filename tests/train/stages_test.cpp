// The three stages: deterministic, learning, frugal, and plain about what goes wrong.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "autograd/base/atomic_file.h"
#include "autograd/kernels/matmul_precision.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/reduce.h"
#include "nn/layers/linear.h"
#include "tests/support/errors.h"
#include "tests/support/files.h"
#include "tests/support/unreadable.h"
#include "tests/support/use_set.h"
#include "tests/train/tiny_training.h"

namespace restage {
namespace {

using testing::choose;
using testing::deformation;
using testing::expect_the_same_bits;
using testing::expect_to_resume;
using testing::expect_validation_to_stop;
using testing::motion;
using testing::optimisers;
using testing::resize;
using testing::result_bytes;
using testing::skeleton;
using testing::tiny_stage;
using testing::tiny_training;

const char* const kStageNames[] = {"skeleton", "motion", "deformation"};

double value_of(const NamedValues& values, const std::string& name) {
  for (const auto& [key, value] : values)
    if (key == name) return value;
  ADD_FAILURE() << "no value '" << name << "'";
  return 0;
}

/// Sizes at which ops are cut into several pieces.
TrainConfig wide(int64_t steps) {
  TrainConfig c = tiny_training(steps);
  resize(skeleton(c).model, {"points=256", "centres=64", "width=64"});
  skeleton(c).optimiser.batch = motion(c).optimiser.batch = 8;
  resize(motion(c).model, {"hidden=48"});
  motion(c).windows.frames = 20;
  deformation(c).pairs.points = 128;
  deformation(c).optimiser.batch = 2;
  return c;
}

TEST(TrainStages, FiveStepsGiveTheSameBitsOnAllVectorSets) {
  const auto sets = testing::vector_sets();
  if (sets.size() < 2) GTEST_SKIP() << "this processor has fewer than two vector sets";
  for (const std::string name : kStageNames) {
    std::string first;
    for (const std::string& set : sets) {
      const testing::UseSet use(set);
      const auto stage = tiny_stage(name, wide(5));
      for (int64_t i = 0; i < 5; ++i) stage->step(i);
      if (first.empty()) first = result_bytes(*stage);
      EXPECT_TRUE(result_bytes(*stage) == first) << name << ": " << sets[0] << " and " << set;
    }
  }
}

TEST(TrainStages, TwentyStepsWithOneTwoAndThreeThreadsGiveTheSameBits) {
  for (const std::string name : kStageNames) expect_the_same_bits(name, wide(20));
}

TEST(TrainStages, AnotherSeedGivesOtherBits) {
  TrainConfig a = tiny_training(2), b = a;
  b.seed = 8;
  for (const std::string name : kStageNames) {
    const auto x = tiny_stage(name, a), y = tiny_stage(name, a), z = tiny_stage(name, b);
    for (int64_t i = 0; i < 2; ++i) x->step(i), y->step(i), z->step(i);
    EXPECT_TRUE(result_bytes(*x) == result_bytes(*y)) << name;
    EXPECT_FALSE(result_bytes(*x) == result_bytes(*z)) << name;
    // Not only where it begins: a training that starts from given weights would not vary else.
    const auto examples = [](const Stage& stage) {
      TensorFile file;
      for (const auto& [what, tensor] : stage.examples(1)) file.tensors[what] = tensor;
      return safetensors_bytes(file);
    };
    EXPECT_TRUE(examples(*x) == examples(*y)) << name;
    EXPECT_FALSE(examples(*x) == examples(*z)) << name;
  }
}

TEST(TrainStages, ValidationsLookAtSignals) {
  for (const std::string name : kStageNames) expect_validation_to_stop(name, tiny_training(2));
}

TEST(TrainStages, StateGoesThroughAFile) {
  for (const std::string name : kStageNames) expect_to_resume(name, tiny_training(8));
}

TEST(TrainStages, ReadingHasNoState) {
  const std::vector<std::string> known = {"skeleton.",    "smrm.",      "discriminator.",
                                          "deformation.", "optimiser.", "discriminator_optimiser.",
                                          "balance"};
  for (const std::string name : kStageNames) {
    const auto one = tiny_stage(name, tiny_training(8)), other = tiny_stage(name, tiny_training(8));
    one->examples(5);  // as if it had been ahead
    one->step(0);
    one->examples(0);
    one->step(1);
    other->step(0);
    other->step(1);
    EXPECT_TRUE(result_bytes(*one) == result_bytes(*other)) << name;
    // A checkpoint holds models, optimisers and the discriminator's balance, and nothing of where
    // the loader is: that is a function of the number of the step.
    TensorFile file;
    one->save(file);
    for (const auto& entry : file.tensors) {
      const std::string& tensor = entry.first;
      EXPECT_TRUE(std::any_of(known.begin(), known.end(),
                              [&](const std::string& k) { return tensor.starts_with(k); }))
          << name << " keeps " << tensor;
    }
  }
}

/// A motion stage that asks an extractor, as steps and validation leave it. `answers`: where they
/// are kept.
std::string asked(const TrainConfig& config, const std::optional<AnswerFolder>& answers = {}) {
  Bundle so_far;
  so_far.add(tiny_stage("skeleton", config)->result());
  TrainingData data = testing::tiny_data();
  data.answers = answers;
  const auto stage = make_stage(config, "motion", data, &so_far);
  for (int64_t i = 0; i < 3; ++i) stage->step(i);
  return result_bytes(*stage) + std::to_string(value_of(stage->validate(), "pa_mpjpe"));
}

TrainConfig asking() {
  TrainConfig c = tiny_training(6);
  motion(c).answers.tracks.sequences = 4;
  motion(c).answers.tracks.frames = 16;
  motion(c).answers.tracks.clouds.one_camera = 0.5;
  motion(c).answers.views = 2;
  motion(c).paired_share = 0.5;
  motion(c).self_first_pass = true;
  testing::choose(motion(c).model, "smrm/hybrid", {"hidden=16", "contact=true"});
  motion(c).weights.contact = 0.1;
  motion(c).weights.measure = Measure::distance;
  return c;
}

TEST(TrainStages, MotionLearnsFromWhatTheExtractorAnswers) {
  TrainConfig c = asking();
  std::string first;
  for (const int n : {1, 2, 3}) {
    const testing::UseThreads use(n);
    if (n == 1) first = asked(c);
    EXPECT_TRUE(asked(c) == first) << n << " threads";
  }
  motion(c).answers.views = 1;
  EXPECT_FALSE(asked(c) == first);
  EXPECT_EQ(stage_type("motion").reads(c.section("motion").config),
            std::vector<std::string>{"skeleton"});
  c.stages = {"motion"};
  EXPECT_HAS(test::refusal_of([&] { tiny_stage("motion", c); }), "needs what 'skeleton' leaves");
}

TEST(TrainStages, AnswersAreAskedForOnceAndKept) {
  const test::TempDir dir;
  const AnswerFolder folder{dir / "answers", "tiny"};
  const auto files = [&] {
    std::vector<std::string> out;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path))
      out.push_back(entry.path().string());
    std::sort(out.begin(), out.end());
    return out;
  };
  TrainConfig c = asking();
  for (const bool rotations : {false, true}) {  // what a model does not give is not kept as given
    if (rotations) resize(skeleton(c).model, {"orientation=true", "uncertainty=true"});
    const std::string first = asked(c);
    EXPECT_TRUE(asked(c, folder) == first);
    const auto kept = files();
    ASSERT_EQ(kept.size(), rotations ? 4u : 2u);  // of training people, of validation people
    // Bytes that do not fit their sum are asked for again.
    std::vector<std::string> whole;
    for (const std::string& path : kept) {
      whole.push_back(test::bytes_of(path));
      std::string cut = whole.back();
      cut[cut.size() / 2] ^= 1;
      test::write_bytes(path, cut);
    }
    EXPECT_TRUE(asked(c, folder) == first);
    int mended = 0;
    for (size_t i = 0; i < kept.size(); ++i) mended += test::bytes_of(kept[i]) == whole[i];
    EXPECT_EQ(mended, 2);  // those of the other network are not looked at
  }
  TrainConfig other = c;  // the same question by another network
  motion(other).optimiser.schedule.rate = 1e-3;
  asked(other, folder);
  EXPECT_EQ(files().size(), 4u);
  asked(other, AnswerFolder{folder.path, "another data set"});
  EXPECT_EQ(files().size(), 6u);
  motion(other).answers.views = 3;
  asked(other, folder);
  EXPECT_EQ(files().size(), 8u);
}

TEST(TrainStages, KeptAnswersAreReadAndNotAskedForAgain) {
  const test::TempDir dir;
  TrainConfig c = asking();
  const AnswerFolder folder{dir / "answers", "tiny"};
  Bundle network;
  network.add(tiny_stage("skeleton", c)->result());
  const Corpus& corpus = testing::tiny_data().train;
  const auto first = ask(corpus, "train", motion(c).answers, network, 3, folder);
  // Other people under the same name would get other answers if they were asked.
  Corpus others = corpus;
  std::reverse(others.bodies.begin(), others.bodies.end());
  const auto again = ask(others, "train", motion(c).answers, network, 3, folder);
  ASSERT_EQ(first.size(), again.size());
  for (size_t i = 0; i < first.size(); ++i)
    for (size_t f = 0; f < first[i].frames.size(); ++f)
      EXPECT_EQ(first[i].frames[f].joints, again[i].frames[f].joints);
  const auto other = ask(others, "validation", motion(c).answers, network, 3, folder);
  EXPECT_NE(first[0].frames[0].joints, other[0].frames[0].joints);
  // What cannot be read is not damaged.
  const std::string kept = folder.path + "/" + test::names_in(folder.path).at(0);
  {
    const test::Unreadable loop(kept);
    EXPECT_THROW(ask(others, "train", motion(c).answers, network, 3, folder), ReadError);
  }
  EXPECT_TRUE(std::filesystem::exists(kept));
  // Who is not there is not looked up: they are asked for again.
  others.bodies.resize(1);
  for (const JointTrack& track : ask(others, "train", motion(c).answers, network, 3, folder))
    EXPECT_EQ(track.body, 0u);
}

TEST(TrainStages, LatencyNeedsPassesWhoseAnswerIsKnown) {
  TrainConfig c = tiny_training(6);
  testing::choose(motion(c).model, "smrm/hybrid", {"hidden=16", "latency=3"});
  EXPECT_HAS(test::refusal_of([&] { tiny_stage("motion", c); }), "self_share");
  motion(c).windows.self_share = 1;
  motion(c).self_first_pass = true;
  motion(c).weights.adversarial = 0;
  const auto stage = tiny_stage("motion", c);
  for (int64_t i = 0; i < 3; ++i) EXPECT_TRUE(std::isfinite(value_of(stage->step(i), "loss")));
  for (const auto& [name, value] : stage->validate()) EXPECT_TRUE(std::isfinite(value)) << name;
  motion(c).windows.frames = 5;
  EXPECT_HAS(test::refusal_of([&] { tiny_stage("motion", c); }), "longer windows.frames");
}

/// Answers what it remembers; where it remembers nothing, zeros.
struct Echo final : SkeletonModel {
  SkeletonOutput forward(Context&, const SkeletonInput& in) override {
    Tensor joints = Tensor::zeros({in.cloud.size(0), kJoints, 3});
    for (int64_t k = 0; in.past.defined() && k < joints.numel() / 3; ++k)
      std::copy_n(in.past.data<float>() + 4 * k, 3, joints.data<float>() + 3 * k);
    SkeletonOutput out;
    out.joints = Var(joints);
    return out;
  }
  int64_t points() const override { return 64; }
  void visit(Fields&) override {}
  const char* kind() const override { return "Echo"; }
};

TEST(TrainStages, FollowedPeopleAreRememberedInTheWorld) {
  // Two sequences of three frames: centroids move, joints are where the first centroid was.
  CloudBatch clouds;
  clouds.points = Tensor::zeros({6, 64, 3});
  clouds.centres = Tensor::empty({6, 3});
  clouds.joints = Tensor::empty({6, kJoints, 3});
  for (int64_t i = 0; i < 6; ++i)
    for (int64_t c = 0; c < 3; ++c) {
      const auto moved = static_cast<float>((i % 3) * (c + 1));
      clouds.centres.data<float>()[3 * i + c] = static_cast<float>(10 * (i / 3)) + moved;
      for (int64_t j = 0; j < kJoints; ++j)
        clouds.joints.data<float>()[3 * (i * kJoints + j) + c] = -moved;
    }
  Echo model;
  EXPECT_LT(followed_error(model, clouds, 3), 1e-6);
  EXPECT_GT(followed_error(model, clouds, 1), 1);  // every frame the first of a sequence
}

TEST(TrainStages, SupervisedSkinningKeepsEveryJointsSkin) {
  double lost[2];
  for (const bool supervised : {false, true}) {
    TrainConfig c = tiny_training(60);
    testing::choose(deformation(c).model, "deformation/bones",
                    {"width=64", "dropout=0", "small_start=true"});
    deformation(c).supervision = supervised ? 0.05 : 0;
    deformation(c).pairs.joint_noise = 0.005;
    deformation(c).pairs.dressed = 0.5;
    const auto stage = tiny_stage("deformation", c);
    for (int64_t i = 0; i < 60; ++i) stage->step(i);
    lost[supervised] = value_of(stage->validate(), "skin_lost");
  }
  EXPECT_LT(lost[true], 0.8 * lost[false]);
}

TEST(TrainStages, TheFirstVersionsLossesAreDistancesAndBoneLengths) {
  TrainConfig c = tiny_training(2);
  deformation(c).loss = Measure::distance;
  deformation(c).skinning_steps = 2;
  const NamedValues first = tiny_stage("deformation", c)->step(0);
  EXPECT_NEAR(
      value_of(first, "loss"),
      static_cast<double>(deformation(c).pairs.points) * 1e-3 * value_of(first, "distance_mm"),
      1e-3 * value_of(first, "loss"));
  double loss[3];
  for (int w = 0; w < 3; ++w) {
    skeleton(c).bone_weight = w;
    loss[w] = value_of(tiny_stage("skeleton", c)->step(0), "loss");
  }
  EXPECT_GT(loss[1], loss[0]);
  EXPECT_NEAR(loss[2] - loss[1], loss[1] - loss[0], 1e-4 * loss[1]);
}

TEST(TrainStages, StateOfAnotherStageIsRefused) {
  for (const std::string name : kStageNames) {
    const auto stage = tiny_stage(name, tiny_training(2));
    const std::string before = result_bytes(*stage);
    for (const std::string other : kStageNames) {
      if (other == name) continue;
      const std::string bytes = result_bytes(*tiny_stage(other, tiny_training(2)));
      EXPECT_THROW(stage->load(parse_safetensors(bytes, "c"), "c"), InputError) << name;
    }
    EXPECT_TRUE(result_bytes(*stage) == before) << name;
  }
  EXPECT_THROW(tiny_stage("motions", tiny_training(2)), InputError);
}

TEST(TrainStages, SteadyStepsTakeNoLargeBlocks) {
  TrainConfig c = wide(20);
  // Every stage needs blocks of more than 1 MiB.
  resize(skeleton(c).model, {"points=512", "neighbours=16"});
  motion(c).optimiser.batch = 64;
  motion(c).windows.frames = 40;
  deformation(c).pairs.points = 1024;
  for (const std::string name : kStageNames) {
    const auto stage = tiny_stage(name, c);
    reset_peak_memory();
    const int64_t before = memory_stats().in_use;
    int64_t step = 0;
    // As many of a batch's clouds have a frame before as chance has it: 4 of 4 at some time.
    for (; step < (name == "skeleton" ? 12 : 3); ++step) stage->step(step);
    EXPECT_GT(memory_stats().peak - before, int64_t{4} << 20) << name << " is too small to tell";
    // All of deformation's kinds of step: the offsets begin later.
    if (name == "deformation") stage->step(step = deformation(c).skinning_steps);
    const int64_t blocks = memory_stats().large_allocations;
    for (const int64_t end = step + 6; ++step < end;) stage->step(step);
    EXPECT_EQ(memory_stats().large_allocations, blocks) << name;
  }
}

/// Mean loss of the first and of the last steps.
std::pair<double, double> learn(Stage& stage, int64_t steps) {
  const int64_t some = steps / 6;
  double first = 0, last = 0;
  for (int64_t i = 0; i < steps; ++i) {
    const double loss = value_of(stage.step(i), "loss") / static_cast<double>(some);
    EXPECT_TRUE(std::isfinite(loss));
    if (i < some) first += loss;
    if (i >= steps - some) last += loss;
  }
  return {first, last};
}

/// Sixty steps in which every stage learns something.
TrainConfig sixty_steps() {
  TrainConfig c = tiny_training(60);
  for (OptimiserConfig* o : optimisers(c)) o->schedule.rate = 5e-3;
  resize(motion(c).model, {"hidden=64", "dropout=0"});
  motion(c).self_first_pass = true;
  motion(c).windows.self_share = 0.7;
  return c;
}

TEST(TrainStages, LossFallsInSixtySteps) {
  for (const std::string name : kStageNames) {
    const TrainConfig c = sixty_steps();
    const auto stage = tiny_stage(name, c);
    const std::string figure = name == "skeleton" ? "joint_error_mm"
                               : name == "motion" ? "local_mpjpe"
                                                  : "with_offsets_mm";
    const NamedValues found = stage->validate();
    const double before = value_of(found, figure);
    const auto& known = stage_type(name).figures;  // that sweeps may stop early by
    for (const auto& [one, value] : found)
      EXPECT_NE(std::find(known.begin(), known.end(), one), known.end()) << name << ": " << one;
    const auto [first, last] = learn(*stage, 60);
    EXPECT_LT(last, 0.7 * first) << name;
    EXPECT_LT(value_of(stage->validate(), figure), 0.8 * before) << name;
  }
}

TEST(TrainStages, ExtractorsWithBatchNormLearn) {
  TrainConfig c = tiny_training(24);
  choose(skeleton(c).model, "skeleton/point_transformer",
         {"points=64", "width=16", "layers=2", "neighbours=6"});
  const auto transformer = tiny_stage("skeleton", c);
  const auto [first, last] = learn(*transformer, 24);
  EXPECT_LT(last, 0.9 * first);

  choose(skeleton(c).model, "skeleton/pointnet", {"points=64", "dropout=0"});
  const auto pointnet = tiny_stage("skeleton", c);
  const std::string start = result_bytes(*pointnet);
  const auto [one, twelve] = learn(*pointnet, 12);
  EXPECT_LT(twelve, 0.9 * one);
  // The running statistics are part of the state, and move.
  const TensorFile before = parse_safetensors(start, "b"),
                   after = parse_safetensors(result_bytes(*pointnet), "a");
  int moved = 0;
  for (const auto& [name, tensor] : before.tensors)
    if (name.ends_with("running_mean"))
      moved += tensor.to_vector<float>() != after.at(name, "a").to_vector<float>();
  EXPECT_GT(moved, 3);
}

TEST(TrainStages, EveryWayToTrainTheMotionNetwork) {
  for (const bool self_first : {false, true})
    for (const double adversarial : {0.0, 0.05}) {
      TrainConfig c = tiny_training(4);
      const bool quaternions = adversarial > 0;
      choose(motion(c).model, quaternions ? "smrm/quaternion" : "smrm/rot6d",
             {"hidden=16", quaternions ? "standardise=false" : "standardise=true"});
      motion(c).self_first_pass = self_first;
      motion(c).windows.self_share = 0.5;
      motion(c).weights.adversarial = adversarial;
      motion(c).windows.remove_heading = self_first;
      motion(c).windows.translation = self_first ? Translation::relative : Translation::absolute;
      const auto stage = tiny_stage("motion", c);
      for (int64_t i = 0; i < 4; ++i)
        for (const auto& [name, value] : stage->step(i)) EXPECT_TRUE(std::isfinite(value)) << name;
      const Settings settings = stage->result().need("motion", "test").settings;
      EXPECT_EQ(settings.at("translation"), self_first ? "relative" : "absolute");
      EXPECT_EQ(settings.at("remove_heading"), self_first ? "true" : "false");
    }
}

TEST(TrainStages, DiscriminatorRestsWhileItWins) {
  TrainConfig c = tiny_training(3);
  motion(c).balance_limit = 0;
  EXPECT_NO_THROW(value_of(tiny_stage("motion", c)->step(0), "discriminator"));
  motion(c).balance_limit = 1;  // a mean score is below 1
  for (const auto& [name, value] : tiny_stage("motion", c)->step(0))
    EXPECT_NE(name, "discriminator") << value;
}

/// A checkpoint of the stage in which `name` holds the largest numbers.
TensorFile poisoned(const Stage& stage, const std::string& name) {
  TensorFile file = parse_safetensors(result_bytes(stage), "c");
  Tensor t = file.at(name, "c").clone();
  std::fill_n(t.data<float>(), t.numel(), 3e38f);
  file.tensors[name] = t;
  return file;
}

TEST(TrainStages, NonFiniteValuesAreNamedWithOpAndModule) {
  const struct {
    const char *stage, *parameter, *op, *path;
  } cases[] = {
      {"skeleton", "skeleton.vote.weight", "linear", "skeleton/patch_transformer.vote"},
      {"motion", "smrm.fc_rot.weight", "", "smrm/rot6d"},
      {"deformation", "deformation.weights.fc2.weight", "linear", "deformation/weights.fc2"},
  };
  for (const auto& c : cases) {
    const auto stage = tiny_stage(c.stage, tiny_training(4));
    stage->load(poisoned(*stage, c.parameter), "c");
    const std::string before = result_bytes(*stage);
    const std::string what = test::message_of<NonFiniteError>([&] { stage->step(0); });
    EXPECT_HAS(what, c.op);
    EXPECT_HAS(what, c.path);
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
    EXPECT_FALSE(FiniteCheck::active());
    // The parameters stand as they were before the step.
    const TensorFile then = parse_safetensors(before, "b"),
                     now = parse_safetensors(result_bytes(*stage), "a");
    for (const auto& [name, tensor] : then.tensors) {
      if (name.starts_with("optimiser.") || name.starts_with("discriminator")) continue;
      EXPECT_TRUE(tensor.to_vector<float>() == now.at(name, "a").to_vector<float>()) << name;
    }
  }
}

TEST(TrainStages, HugeRateIsCaughtInTheStepWhereItShows) {
  for (const std::string name : kStageNames) {
    TrainConfig c = tiny_training(6);
    for (OptimiserConfig* o : optimisers(c)) {
      o->schedule = {};
      o->schedule.rate = 1e25;
      o->clip = 0;
    }
    const auto stage = tiny_stage(name, c);
    const auto steps = [&] {
      for (int64_t i = 0; i < 6; ++i) stage->step(i);
    };
    EXPECT_HAS(test::message_of<NonFiniteError>(steps), " in ") << name;
  }
}

TEST(TrainStages, FiniteValuesWhoseSumIsNotAreCaughtToo) {
  Linear layer(2, 1, Init{RngKey{1, 0}, DType::f32});
  name_scopes(layer, "probe");
  const auto loss = [&](double factor) {
    return [&layer, factor](Context& ctx) {
      return mean_all(scale(layer(ctx, Var(Tensor::from<float>({1, 2}, {1.0f, 2.0f}))), factor));
    };
  };
  const Differentiated good = differentiate(RngKey{1, 0}, loss(2.0));
  EXPECT_TRUE(std::isfinite(good.loss));
  EXPECT_GT(good.norm, 0);
  EXPECT_THROW(differentiate(RngKey{1, 0}, loss(std::numeric_limits<double>::quiet_NaN())),
               NonFiniteError);
}

}  // namespace
}  // namespace restage
