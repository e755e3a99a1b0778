// The stages of a configuration, trained: in a run directory (`restage train`), or each as an
// artifact of a store that other trials share (sweeps).
#pragma once

#include "train/artifacts/store.h"
#include "train/forecast.h"
#include "train/training/identity.h"
#include "train/training/train_config.h"

namespace restage {

/// What a configuration trains and validates on.
struct TrainingData {
  TrainingData() = default;
  explicit TrainingData(const CorpusSource& source)
      : train(load_corpus(source, "train")), validation(load_corpus(source, "validation")) {}
  Corpus train, validation;
  Team* team = nullptr;  ///< processes that train on them together; null: this one alone
  std::optional<AnswerFolder> answers;  ///< where an extractor's answers to them are kept
};

/// A stage with its weights to start from; null if it is taken as it is, and then its networks are
/// put into `so_far`. InputError: weights that do not fit or hold nothing for the stage, a stage
/// that it reads and that does not come before.
std::unique_ptr<Stage> make_stage(const TrainConfig& config, const std::string& name,
                                  const TrainingData& data, Bundle* so_far);

/// Finds everything that can be wrong with a configuration before any work: models of unknown
/// names, sizes that do not fit together, windows longer than every motion, weights that are not
/// there.
void check_stages(const TrainConfig& config, const TrainingData& data);

/// All stages one after the other in a run directory, in the precision of the configuration.
Bundle train_run(RunDir& run, const TrainConfig& config, const TrainingData& data,
                 TrainOptions options);

/// What each stage that is trained would cost, by some of its steps. A stage that reads another's
/// networks gets them untrained: that changes no time.
std::vector<StageForecast> forecast(TrainConfig config, const TrainingData& data);

struct StoreTraining {
  Bundle bundle;
  std::vector<StageId> artifacts;  ///< in the order of training
};
/// The same through a store: what is there is taken, what is not is made, or waited for if another
/// process makes it. `last_stage`: no further than that. Data are read only if something is
/// trained.
StoreTraining train_in_store(const Store& store, const TrainConfig& config, Identities* identities,
                             const TrainOptions& options, const std::string& last_stage = "");

}  // namespace restage
