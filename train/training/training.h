// The stages of a configuration, trained: in a run directory (`restage train`), or each as an
// artifact of a store that other trials share (sweeps).
#pragma once

#include "train/artifacts/store.h"
#include "train/forecast.h"
#include "train/rate_sweep.h"
#include "train/training/identity.h"
#include "train/training/train_config.h"

namespace restage {

/// What a configuration trains and validates on.
struct TrainingData {
  TrainingData() = default;
  explicit TrainingData(const CorpusSource& source)
      : train(load_corpus(source, "train")), validation(load_corpus(source, "validation")) {}
  Corpus train, validation;
  Team* team = nullptr;  ///< the processes that train together; null: this process alone
  /// Where the answers of extractors about these data are kept.
  std::optional<AnswerFolder> answers;
};

/// A stage, with the weights that it starts from. Null if the stage is taken as it is; then its
/// networks are put into `so_far`. InputError: the weights do not fit or hold nothing for the
/// stage, the stage reads another one that does not come before it, or loop.monitor names a figure
/// that the stage does not measure.
std::unique_ptr<Stage> make_stage(const TrainConfig& config, const std::string& name,
                                  const TrainingData& data, Bundle* so_far);

/// Finds everything that can be wrong with a configuration before any work: models of unknown
/// names, sizes that do not fit together, windows longer than every motion, weights that are not
/// there.
void check_stages(const TrainConfig& config, const TrainingData& data);

/// Trains all stages one after the other in a run directory, in the precision of the configuration.
Bundle train_run(RunDir& run, const TrainConfig& config, const TrainingData& data,
                 TrainOptions options);

/// What each stage that is trained would cost, measured on some of its steps. A stage that reads
/// the networks of another gets them untrained, which changes no time. `validate`: one validation
/// of each is measured, too.
std::vector<StageForecast> forecast(TrainConfig config, const TrainingData& data,
                                    bool validate = true);

/// Where a sweep of the rate begins and ends, and its steps.
struct RateRange {
  double from = 1e-6, to = 10;
  int64_t steps = 100;
};
/// What the loss of each stage that is trained does while its rate grows exponentially, from
/// untrained networks (or those of `init`). A stage that reads the networks of another gets them
/// untrained: give them with STAGE.from. Nothing is written.
std::vector<RateSweep> find_rates(TrainConfig config, const TrainingData& data,
                                  const RateRange& range = {});

struct StoreTraining {
  Bundle bundle;
  std::vector<StageId> artifacts;  ///< in the order of training
};
/// Trains through a store: artifacts that are there are taken; the others are made, or waited for
/// while another process makes them. `last_stage`: the last stage to make ("": all). Data are read
/// only if something is trained.
StoreTraining train_in_store(const Store& store, const TrainConfig& config, Identities* identities,
                             const TrainOptions& options, const std::string& last_stage = "");

}  // namespace restage
