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

/// `dropout` false: none, for check().
using MakeItem = std::unique_ptr<Item> (*)(const Inputs& inputs, const std::string& variant,
                                           bool dropout);

template <class T>
std::unique_ptr<Item> make_item(const Inputs& inputs, const std::string& variant, bool dropout) {
  return std::make_unique<T>(inputs, variant, dropout);
}

struct ItemInfo {
  ItemInfo(std::string n, std::string w, std::string p, int count, double flop, MakeItem maker,
           std::vector<std::string> changing = {}, std::vector<std::string> further = {},
           std::string starts = "initial")
      : name(std::move(n)),
        what(std::move(w)),
        per(std::move(p)),
        examples(count),
        gflop(flop),
        make(maker),
        models(std::move(changing)),
        also(std::move(further)),
        variant(std::move(starts)) {}

  std::string name;
  std::string what;  ///< for tables
  std::string per;   ///< what one of `examples` is
  int examples;      ///< per repetition
  double gflop;      ///< of one example by the plain algorithm (work.h); 0: not counted
  MakeItem make;
  /// Models whose weights may change its speed: the item also exists with trained weights if there
  /// are any of one of them.
  std::vector<std::string> models;
  /// Further variants, with initial weights: "dense" leaves nothing out. No ratio counts them.
  std::vector<std::string> also;
  std::string variant;  ///< what it is called with the weights it starts with
};

/// All items, in the order of the tables.
std::vector<ItemInfo> items();
/// One table each; items() joins them.
std::vector<ItemInfo> training_items();
std::vector<ItemInfo> transfer_items();
std::vector<ItemInfo> reading_items();
std::vector<ItemInfo> online_items();
std::vector<ItemInfo> kernel_items();

}  // namespace restage::bench
