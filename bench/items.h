// What restage_bench can time: training steps, reading, online frames and the kernels that
// dominate, all on inputs and weights that LibTorch's program (libtorch/) reads from the same
// folder (inputs.h).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bench/inputs.h"
#include "nn/models/skeleton.h"

namespace restage::bench {

/// One thing that is done again and again.
class Item {
 public:
  virtual ~Item() = default;
  /// Before every repetition, not timed.
  virtual void prepare() {}
  /// One repetition.
  virtual void run() = 0;
  /// Numbers that another implementation with the same weights must give as well, from a fresh item
  /// without dropout.
  virtual std::vector<double> check() = 0;
};

/// Every attention of a point transformer does all products, if the variant is "dense".
void make_dense(SkeletonModel& net, const std::string& variant);
/// What an item's check() may say of a result: the sum of its absolute values and three of them.
std::vector<double> summary(const Tensor& x);

struct ItemInfo {
  std::string name;
  std::string what;  ///< for tables
  std::string per;   ///< what one of `examples` is
  int examples = 1;  ///< per repetition
  double gflop =
      0;  ///< of one example by the plain algorithm (docs/performance.md); 0: not counted
  /// Models whose weights may change its speed: the item also exists with trained weights if there
  /// are any of one of them.
  std::vector<std::string> models;
  /// `dropout` false: none, for check().
  std::unique_ptr<Item> (*make)(const Inputs& inputs, const std::string& variant, bool dropout);
  /// Further variants, with initial weights: "dense" leaves nothing out, "bfloat16" multiplies in
  /// it (only where the processor has a unit for that). No ratio counts them.
  std::vector<std::string> also = {};
  /// What it is called with the weights it starts with.
  std::string variant = "initial";
};

/// All items, in the order of the tables.
std::vector<ItemInfo> items();
/// One table each; items() joins them.
std::vector<ItemInfo> training_items();
std::vector<ItemInfo> reading_items();
std::vector<ItemInfo> online_items();
std::vector<ItemInfo> kernel_items();

}  // namespace restage::bench
