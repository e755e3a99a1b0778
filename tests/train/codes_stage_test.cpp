// The stage of H4D: it learns, its bits depend on nothing but data and seed, what it refuses.
#include "train/stages/codes_stage.h"

#include <gtest/gtest.h>

#include "tests/support/errors.h"
#include "tests/train/tiny_codes.h"

namespace restage {
namespace {

using namespace testing;

TEST(CodesStage, LearnsTheBodiesAndTheirPoses) {
  const auto stage = tiny_stage("codes", tiny_codes(120));
  const NamedValues before = stage->validate();
  double first = 0, last = 0;
  for (int64_t i = 0; i < 120; ++i) {
    const double loss = figure_of(stage->step(i), "loss");
    if (i < 10) first += loss;
    if (i >= 110) last += loss;
  }
  const NamedValues after = stage->validate();
  EXPECT_LT(last, 0.7 * first);
  EXPECT_LT(figure_of(after, "distance_mm"), 0.9 * figure_of(before, "distance_mm"));
  EXPECT_EQ(stage->show().size(), 3u);
}

TEST(CodesStage, GivesTheSameBitsWithAnyNumberOfThreads) {
  expect_the_same_bits("codes", tiny_codes(6));
}

TEST(CodesStage, ValidationsLookAtSignals) { expect_validation_to_stop("codes", tiny_codes(1)); }

TEST(CodesStage, StateGoesThroughAFile) { expect_to_resume("codes", tiny_codes(6)); }

TEST(CodesStage, IsAsLargeAsTheDataAskFor) {
  const auto stage = tiny_stage("codes", tiny_codes(1));
  const Bundle result = stage->result();
  const TrainedModel& model = result.need("codes", "");
  const auto& sizes = model.config.as<H4dConfig>();
  EXPECT_EQ(sizes.shape, 2);  // of ten that were asked for; three bodies have no more
  EXPECT_EQ(sizes.pose, 66);
  EXPECT_EQ(sizes.root, 2);  // the boxes' pelvis swings about one axis
  EXPECT_EQ(sizes.motion, 2 + 6);
  EXPECT_EQ(sizes.vertices, std::ssize(tiny_data().train.bodies[0].rest.vertices));
  EXPECT_EQ(model.settings.at("points"), "48");
}

TEST(CodesStage, StepsMayShareExamples) {
  TrainConfig c = tiny_codes(4);
  codes(c).steps_per_batch = 2;
  const auto stage = tiny_stage("codes", c);
  const auto cloud = [&](int64_t step) {
    for (const auto& [name, x] : stage->examples(step))
      if (name == "clouds") return x.to_vector<float>();
    return std::vector<float>();
  };
  EXPECT_EQ(cloud(0), cloud(1));
  EXPECT_NE(cloud(1), cloud(2));
}

TEST(CodesStage, TheSecondStageBeginsLater) {
  TrainConfig c = tiny_codes(4);
  codes(c).model.sizes.as<H4dConfig>().aux = 4;
  codes(c).aux_from = 2;
  const auto stage = tiny_stage("codes", c);
  const auto correction = [&] {
    const Tensor& w = stage->result().need_as<H4d>("codes", "").aux_decoder->linear.weight.value;
    double sum = 0;
    for (int64_t i = 0; i < w.numel(); ++i) sum += std::abs(w.item(i));
    return sum;
  };
  for (int64_t i = 0; i < 2; ++i) stage->step(i);
  EXPECT_EQ(correction(), 0);
  for (int64_t i = 2; i < 4; ++i) stage->step(i);
  EXPECT_GT(correction(), 0);
}

TEST(CodesStage, RefusesWhatItCannotTrainOn) {
  TrainConfig c = tiny_codes(1);
  const auto refused = [&](const TrainingData& data) {
    Bundle none;
    return test::refusal_of([&] { make_stage(c, "codes", data, &none); });
  };
  TrainingData other = tiny_data();
  other.validation.bodies[0].rest.faces.pop_back();
  EXPECT_HAS(refused(other), "data.source to data of one topology");
  codes(c).model.sizes.as<H4dConfig>().pose = 72;
  EXPECT_HAS(refused(tiny_data()), "leave sizes.pose out");
  codes(c).model.sizes.as<H4dConfig>().pose = 66;
  codes(c).model.sizes.as<H4dConfig>().root = 10;
  EXPECT_HAS(refused(tiny_data()), "smaller root");
}

}  // namespace
}  // namespace restage
