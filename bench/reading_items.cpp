// The loader of every stage beside the training that it feeds, both as the trainer runs them.
#include "autograd/base/error.h"
#include "bench/items.h"
#include "train/stages/deformation_stage.h"
#include "train/stages/skeleton_stage.h"
#include "train/training/training.h"

namespace restage::bench {
namespace {

struct Subject {
  const char *size, *stage;
  int batch;  ///< of the configuration
};
constexpr Subject kSubjects[] = {{"lite", "skeleton", 12},    {"lite", "motion", 16},
                                 {"lite", "deformation", 16}, {"paper", "skeleton", 16},
                                 {"paper", "motion", 16},     {"paper", "deformation", 16}};

/// Step after step, each on the examples of its own: "training" is all of it, "loader" draws the
/// same examples and does no more, "loader_1fps" from one frame a second of motion.
class Reading : public Item {
 public:
  Reading(const Inputs& inputs, const Subject& subject, const std::string& variant)
      : config_(config(inputs, subject, variant)),
        data_(config_.data),
        stage_(make_stage(config_, subject.stage, data_, &nothing_)),
        trains_(variant == "training"),
        // From there on offsets are trained as well.
        step_(stage_->name() == "deformation" ? deformation(config_).skinning_steps : 0) {
    if (stage_->examples_per_step() != subject.batch)
      throw InputError(std::string(subject.size) + "/all.yaml",
                       "its batch of stage '" + stage_->name() + "' is not what is timed",
                       "change bench/reading_items.cpp with it");
  }
  void run() override {
    if (trains_)
      stage_->step(step_++);
    else
      stage_->examples(step_++);
  }
  /// LibTorch has no part in this.
  std::vector<double> check() override { return {}; }

  template <size_t which>
  static std::unique_ptr<Item> make(const Inputs& inputs, const std::string& variant, bool) {
    return std::make_unique<Reading>(inputs, kSubjects[which], variant);
  }

 private:
  static DeformationStageConfig& deformation(TrainConfig& c) {
    return c.section("deformation").config.as<DeformationStageConfig>();
  }
  static TrainConfig config(const Inputs& inputs, const Subject& subject,
                            const std::string& variant) {
    TrainConfig c = inputs.training(subject.size);
    if (variant == "loader_1fps")
      c.section("skeleton").config.as<SkeletonStageConfig>().clouds.frame_step =
          deformation(c).pairs.frame_step = 30;
    return c;
  }

  TrainConfig config_;
  TrainingData data_;
  Bundle nothing_;
  std::unique_ptr<Stage> stage_;
  bool trains_;
  int64_t step_;
};

template <size_t which>
ItemInfo info() {
  const Subject& s = kSubjects[which];
  const std::string stage = s.stage;
  const std::string per = stage == "skeleton" ? "cloud" : stage == "motion" ? "window" : "pair";
  std::vector<std::string> also = {"loader"};
  if (stage != "motion") also.push_back("loader_1fps");  // windows are of every frame
  return {"reading_" + stage + "_" + s.size,
          stage + ", " + s.size,
          per,
          s.batch,
          0,
          Reading::make<which>,
          {},
          also,
          "training"};
}

}  // namespace

std::vector<ItemInfo> reading_items() {
  return {info<0>(), info<1>(), info<2>(), info<3>(), info<4>(), info<5>()};
}

}  // namespace restage::bench
