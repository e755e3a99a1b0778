// Which weights a stage hands on: the weights of its last step or of its best validation, as they
// are or averaged over the steps; and whether the stage ends before its last step. What decides is
// part of a checkpoint, so a resumed training decides as an undisturbed one does.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nn/config/config_reader.h"
#include "nn/weights/safetensors.h"
#include "train/stage.h"

namespace restage {

struct SelectionConfig {
  enum class Export { last, best };
  double ema = 0, swa_from = 0;
  Export choice = Export::last;
  int64_t patience = 0;
  double min_delta = 0;
  int64_t keep_best = 0;
  std::vector<std::string> monitor;

  bool judges() const { return choice == Export::best || patience > 0; }
};

inline EnumNames<SelectionConfig::Export> config_names(SelectionConfig::Export) {
  return {{"last", SelectionConfig::Export::last}, {"best", SelectionConfig::Export::best}};
}

/// The keys stand in the section `loop`.
template <class V>
void visit(V& v, SelectionConfig& c) {
  v("ema", c.ema,
    "decay of a moving average of the weights, which is validated and handed on; 0: none",
    below(0, 1));
  v("swa_from", c.swa_from,
    "share of the steps from which weights are averaged, all alike, instead; 0: none", below(0, 1));
  v.check("swa_from", c.swa_from == 0 || c.ema == 0, "makes no sense with 'ema'",
          "give one of the two averages");
  v("export", c.choice, "what a stage hands on: the weights of its last step or best validation");
  v("patience", c.patience, "validations without a better one that end a stage; 0: never",
    at_least(0));
  v("min_delta", c.min_delta,
    "patience counts a validation as better if it is so by more than this", at_least(0));
  v("keep_best", c.keep_best, "weights of so many best validations stay in RUN/best; 0: of none",
    between(0, 1000));
  v("monitor", c.monitor,
    "STAGE.FIGURE by which a validation is better, instead of the stage's first");
}

/// An average of a stage's networks: parameters are averaged, buffers and frozen parameters follow.
/// `ema`: an exponential moving average; the first steps count more: the decay after t steps is at
/// most (1 + t) / (10 + t). `swa_from`: the mean of the weights after each step from that share of
/// the steps on (Izmailov et al. 2018); before, it is the weights themselves.
class WeightAverage {
 public:
  WeightAverage(Stage& stage, const SelectionConfig& config);
  /// Of these parameters: exponential with this decay, or from the first step on if it is 0.
  WeightAverage(std::vector<StateEntry> parameters, double decay);
  static bool wanted(const SelectionConfig& config) {
    return config.ema > 0 || config.swa_from > 0;
  }
  /// After step number `done`.
  void add(int64_t done);
  /// Exchanges the average and the weights: the average becomes what the stage holds, and back.
  void exchange();
  void save(TensorFile* file) const;
  void load(const TensorFile& file, const std::string& where);

 private:
  std::vector<StateEntry> weights_;
  /// Keeps so much of the average, and adds the rest from the weights.
  void mix(double keep);

  std::vector<Tensor> average_;
  std::vector<bool> averaged_;  ///< whether it is more than a copy
  double decay_;
  int64_t first_ = -1;  ///< the steps that no mean counts; -1: it is an exponential average
};

/// The figure of a validation that is called `monitor`; its first if `monitor` is empty.
/// InputError: there is none.
const std::pair<std::string, double>& figure_monitored(const NamedValues& figures,
                                                       const std::string& monitor);

/// The best validation so far. Lower is better; a figure that is not a number is worse than any
/// number. The best is the lowest; only patience asks by how much one must be lower.
class BestSoFar {
 public:
  /// `monitor`: as of figure_monitored().
  BestSoFar(std::string monitor, double min_delta)
      : monitor_(std::move(monitor)), min_delta_(min_delta) {}
  /// Notes a validation; true if it is better than all before it.
  bool add(int64_t done, const NamedValues& figures);
  int64_t step() const { return step_; }  ///< of the best validation; -1: there is none yet
  /// Validations since the last that was lower by more than min_delta.
  int64_t worse() const { return worse_; }
  std::string text() const;  ///< "best 17.9 at 52000"
  void save(TensorFile* file) const;
  void load(const TensorFile& file, const std::string& where);

 private:
  std::string monitor_;
  double min_delta_, value_ = 0;
  double mark_ = 0;  ///< the last figure that was lower by more than min_delta
  int64_t step_ = -1, worse_ = 0;
};

/// The figure of a stage that `config` monitors (it is named STAGE.FIGURE there); "" if it names
/// none.
std::string monitored(const SelectionConfig& config, const std::string& stage);

}  // namespace restage
