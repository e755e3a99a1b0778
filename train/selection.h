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
  double ema = 0;
  Export choice = Export::last;
  int64_t patience = 0;
  double min_delta = 0;
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
  v("export", c.choice, "what a stage hands on: the weights of its last step or best validation");
  v("patience", c.patience, "validations without a better one that end a stage; 0: never",
    at_least(0));
  v("min_delta", c.min_delta, "a validation is better if it is so by more than this", at_least(0));
  v("monitor", c.monitor,
    "STAGE.FIGURE by which a validation is better, instead of the stage's first");
}

/// Exponential moving average of a stage's networks: parameters are averaged, buffers follow.
/// The first steps count more: the decay after t steps is at most (1 + t) / (10 + t).
class WeightAverage {
 public:
  WeightAverage(Stage& stage, double decay);
  /// After step number `done`.
  void add(int64_t done);
  /// Exchanges the average and the weights: the average becomes what the stage holds, and back.
  void exchange();
  void save(TensorFile* file) const;
  void load(const TensorFile& file, const std::string& where);

 private:
  std::vector<StateEntry> weights_;
  std::vector<Tensor> average_;
  double decay_;
};

/// The best validation so far. Lower is better; a figure that is not a number is worse than any
/// number.
class BestSoFar {
 public:
  /// Judges by the figure called `monitor`; by the first figure of a validation if `monitor` is
  /// empty.
  BestSoFar(std::string monitor, double min_delta)
      : monitor_(std::move(monitor)), min_delta_(min_delta) {}
  /// Notes a validation; true if it is better than all before it.
  bool add(int64_t done, const NamedValues& figures);
  int64_t step() const { return step_; }    ///< of the best validation; -1: there is none yet
  int64_t worse() const { return worse_; }  ///< validations since the best one
  std::string text() const;                 ///< "best 17.9 at 52000"
  void save(TensorFile* file) const;
  void load(const TensorFile& file, const std::string& where);

 private:
  std::string monitor_;
  double min_delta_, value_ = 0;
  int64_t step_ = -1, worse_ = 0;
};

/// The figure of a stage that `config` monitors (it is named STAGE.FIGURE there); "" if it names
/// none.
std::string monitored(const SelectionConfig& config, const std::string& stage);

}  // namespace restage
