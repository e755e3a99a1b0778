// The same work as ../items.h, on LibTorch.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "inputs.h"

namespace bench {

class Item {
 public:
  virtual ~Item() = default;
  virtual void prepare() {}
  virtual void run() = 0;
  virtual std::vector<double> check() = 0;
};

/// By the names of ../items.h; null if there is no such item here.
std::unique_ptr<Item> make_item(const std::string& name, const Inputs& inputs, bool dropout);
/// One of them, of the systems without a skeleton.
std::unique_ptr<Item> make_transfer_item(const std::string& name, const Inputs& inputs);

}  // namespace bench
