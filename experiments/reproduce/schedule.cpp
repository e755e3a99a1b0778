#include "experiments/reproduce/schedule.h"

#include <filesystem>
#include <map>

#include "autograd/base/words.h"
#include "experiments/sweep/plan.h"
#include "nn/config/config.h"
#include "nn/models/registry.h"
#include "train/training/training.h"

namespace restage::reproduce {
namespace {

/// Counts the parameters of each model once.
class Counts {
 public:
  int64_t of(const std::string& model, const ConfigNode* sizes) {
    std::vector<std::string> words;
    if (sizes != nullptr)
      for (const ConfigNode& size : sizes->children)
        words.push_back(size.key + "=" + sweep::value_text(size));
    const auto [known, fresh] = counts_.try_emplace(model + " " + joined(words));
    if (fresh)
      known->second =
          count_parameters(*make_model(model, model_config(model, words), {RngKey{0, 0}}));
    return known->second;
  }

 private:
  std::map<std::string, int64_t> counts_;
};

std::string text_at(const ConfigNode& tree, const std::string& key) {
  const ConfigNode* at = &tree;
  for (size_t from = 0; at != nullptr && from <= key.size();) {
    const size_t dot = std::min(key.find('.', from), key.size());
    at = at->find(key.substr(from, dot - from));
    from = dot + 1;
  }
  return at == nullptr ? "" : at->text;
}

/// A stage of a configuration, without the hours.
Scheduled scheduled(const TrainConfig& config, const std::string& stage, Counts* counts) {
  const ConfigNode tree = write_config(config.section(stage).config);
  Scheduled out;
  out.stage = stage;
  out.model = text_at(tree, "model");
  const ConfigNode* sizes = tree.find("sizes");
  out.parameters = counts->of(out.model, sizes);
  if (stage == "deformation" && text_at(tree, "offsets") == "true")
    out.parameters += counts->of("deformation/offsets", sizes);
  out.steps = std::stoll(text_at(tree, "optimiser.steps"));
  out.batch = std::stoll(text_at(tree, "optimiser.batch"));
  out.rate = std::stod(text_at(tree, "optimiser.schedule.rate"));
  return out;
}

constexpr int kExamples = 2;  // of a measured step: batch norm needs two

/// Measures each configuration once; of data it keeps those that were asked for last.
class Stopwatches {
 public:
  /// By stage: of one example.
  const std::map<std::string, double>& seconds(ConfigNode tree, const TrainConfig& whole) {
    const auto [known, fresh] = measured_.try_emplace(resolved_yaml(whole));
    if (!fresh) return known->second;
    for (const std::string& stage : whole.trained())
      apply_override(tree, stage + ".optimiser.batch=" + std::to_string(kExamples));
    // What an extractor answers changes the data of a step, and not its time.
    if (const ConfigNode* motion = tree.find("motion"); motion && motion->find("answers"))
      apply_override(tree, "motion.answers.sequences=0");
    TrainConfig config;
    read_config(tree, config);
    const std::string wanted = resolved_yaml(config.data);
    if (wanted != loaded_) data_ = TrainingData(config.data);
    loaded_ = wanted;
    for (const StageForecast& one : forecast(config, data_, false))
      known->second[one.stage] = one.per_step / kExamples;
    return known->second;
  }

 private:
  std::map<std::string, std::map<std::string, double>> measured_;
  std::string loaded_;
  TrainingData data_;
};

/// Whether what a configuration trains on is there to be measured with.
bool has_data(const TrainConfig& config) {
  std::error_code ignored;
  return config.data.source == "builtin" || std::filesystem::exists(config.data.source, ignored);
}

}  // namespace

std::vector<Scheduled> schedule_of(const Evidence& evidence, const std::string& budget,
                                   const std::vector<std::string>& words) {
  const std::string file = evidence.sweep_file(evidence.asked.budget(budget));
  Stopwatches watches;
  Counts counts;
  std::vector<Scheduled> out;
  for (const auto& [row, tree] : sweep::configurations(sweep::read_sweep_file(file, words))) {
    TrainConfig config;
    read_config(tree, config);
    std::map<std::string, double> seconds;
    if (has_data(config)) seconds = watches.seconds(tree, config);
    for (const std::string& stage : config.trained()) {
      Scheduled one = scheduled(config, stage, &counts);
      one.table = evidence.asked.table;
      one.row = row;
      if (const auto found = seconds.find(stage); found != seconds.end())
        one.hours = found->second * static_cast<double>(one.steps * one.batch) / 3600;
      out.push_back(std::move(one));
    }
  }
  return out;
}

}  // namespace restage::reproduce
