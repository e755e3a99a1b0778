#include "train/training/training.h"

#include <algorithm>
#include <memory>

#include "autograd/kernels/kernel.h"
#include "nn/config/config.h"

namespace restage {
namespace {

void check_order(const TrainConfig& config, const StageType& type, const AnyConfig& own) {
  const auto& stages = config.stages;
  const auto self = std::find(stages.begin(), stages.end(), type.name);
  for (const std::string& read : type.reads(own))
    if (std::find(stages.begin(), self, read) == self)
      throw InputError(
          "", "stage '" + type.name + "' needs what '" + read + "' leaves",
          "name " + read + " before it in stages (" + read + ".from takes it from elsewhere)");
}

/// Error if the loop monitors a figure that the stage does not measure with this configuration.
void check_monitored(const SelectionConfig& selection, Stage& stage) {
  const std::string monitor = monitored(selection, stage.name());
  if (monitor.empty()) return;
  std::vector<std::string> figures = stage.figures();
  if (figures.empty()) return;  // not known before the first validation
  for (const auto& more : {stage.own_figures(), more_figures_of(stage.name())})
    figures.insert(figures.end(), more.begin(), more.end());
  std::string known;
  for (const std::string& figure : figures) {
    if (figure == monitor) return;
    known += (known.empty() ? "" : ", ") + stage.name() + "." + figure;
  }
  throw InputError(
      "loop.monitor",
      "names '" + stage.name() + "." + monitor + "', which this configuration does not measure",
      "name one of " + known);
}

/// Error if a network's own figure has the name of one of its stage: curves and choices would take
/// one for the other.
void check_own_figures(const StageType& type, Stage& stage) {
  std::vector<std::string> known = stage.figures();
  known.insert(known.end(), type.figures.begin(), type.figures.end());
  for (const std::string& figure : stage.own_figures()) {
    if (std::find(known.begin(), known.end(), figure) != known.end())
      throw InputError("",
                       "the network of stage '" + type.name + "' gives the figure '" + figure +
                           "', which is measured already",
                       "give it another name in 'figures'");
    known.push_back(figure);
  }
}

}  // namespace

std::unique_ptr<Stage> make_stage(const TrainConfig& config, const std::string& name,
                                  const TrainingData& data, Bundle* so_far) {
  const StageType& type = stage_type(name);
  const StageSection& section = config.section(name);
  if (section.from) {
    so_far->add(networks_of(type, *section.from));
    common_definition({{data.train.joints, "the data"},
                       {joint_definition(*so_far, *section.from), *section.from}});
    return nullptr;
  }
  check_order(config, type, section.config);
  auto stage = type.make(section.config, {data.train, data.validation, config.seed, *so_far,
                                          data.answers, device_of(config.device)});
  stage->repeat_batches(config.loop.overfit_batches);
  stage->cut_steps(config.loop.micro_batches, data.team != nullptr ? *data.team : alone());
  if (config.loop.gradient_noise) stage->measure_noise();
  check_own_figures(type, *stage);
  check_monitored(config.loop.selection, *stage);
  if (section.init && section.init_names.empty())
    throw InputError(*section.init, "would give nothing: " + name + ".init_names is empty",
                     "name tensors, or * for all, or leave init out");
  if (section.init)
    stage->start_from(load_bundle(*section.init), section.init_names, *section.init);
  return stage;
}

void check_stages(const TrainConfig& config, const TrainingData& data) {
  Bundle so_far;
  for (const std::string& name : config.stages)
    if (const auto stage = make_stage(config, name, data, &so_far)) so_far.add(stage->result());
}

Bundle train_run(RunDir& run, const TrainConfig& config, const TrainingData& data,
                 TrainOptions options) {
  options.precision = config.precision;
  return train(
      run, config.stages, config.loop,
      [&](const std::string& name, Bundle* so_far) {
        return make_stage(config, name, data, so_far);
      },
      options);
}

std::vector<StageForecast> forecast(TrainConfig config, const TrainingData& data, bool validate) {
  std::vector<StageForecast> out;
  Bundle so_far;
  for (const std::string& name : config.stages) {
    const StageType& type = stage_type(name);
    const double left_out = type.shorten ? type.shorten(config.section(name).config) : 1;
    const auto stage = make_stage(config, name, data, &so_far);
    if (stage == nullptr) continue;
    so_far.add(stage->result());
    out.push_back(forecast(*stage, config.precision, validate));
    out.back().before *= left_out;
  }
  return out;
}

std::vector<RateSweep> find_rates(TrainConfig config, const TrainingData& data,
                                  const RateRange& range) {
  std::vector<RateSweep> out;
  Bundle so_far;
  for (const std::string& name : config.stages) {
    const StageType& type = stage_type(name);
    AnyConfig& section = config.section(name).config;
    const bool trains = type.optimiser != nullptr && type.optimiser(section).steps > 0;
    if (trains) {
      OptimiserConfig& optimiser = type.optimiser(section);
      optimiser.steps = range.steps;
      optimiser.schedule = {};
      optimiser.schedule.rate = range.from;
      optimiser.schedule.kind = ScheduleConfig::Kind::exponential;
      optimiser.schedule.final_fraction = range.to / range.from;
      if (type.shorten) type.shorten(section);
    }
    const auto stage = make_stage(config, name, data, &so_far);
    if (stage == nullptr) continue;
    so_far.add(stage->result());
    if (trains) out.push_back(sweep_rate(*stage, config.precision));
  }
  return out;
}

StoreTraining train_in_store(const Store& store, const TrainConfig& config, Identities* identities,
                             const TrainOptions& options, const std::string& last_stage) {
  StoreTraining out;
  out.artifacts = identities->stages(config);
  std::unique_ptr<TrainingData> data;
  TrainOptions own = options;
  own.precision = config.precision;
  for (const std::string& name : config.stages) {
    const StageSection& section = config.section(name);
    if (section.from) {
      out.bundle.add(networks_of(stage_type(name), *section.from));
    } else {
      const auto id = std::find_if(out.artifacts.begin(), out.artifacts.end(),
                                   [&](const StageId& s) { return s.stage == name; });
      out.bundle.add(store.get(*id, resolved_yaml(section.config), [&](RunDir& run) {
        if (data == nullptr) {
          data = std::make_unique<TrainingData>(config.data);
          data->answers = {store.answers(), identities->data(config.data)};
        }
        own.given = out.bundle;
        return train(
            run, {name}, config.loop,
            [&](const std::string&, Bundle*) {
              return make_stage(config, name, *data, &out.bundle);
            },
            own);
      }));
    }
    if (name == last_stage) break;
  }
  return out;
}

}  // namespace restage
