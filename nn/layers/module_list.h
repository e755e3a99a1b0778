// A list of modules named 0, 1, 2 ... (PyTorch's ModuleList and Sequential).
#pragma once

#include <memory>

#include "nn/module.h"

namespace restage {

template <class M>
struct ModuleList : Module {
  template <class... Args>
  M& emplace(Args&&... args) {
    items_.push_back(std::make_unique<M>(std::forward<Args>(args)...));
    return *items_.back();
  }
  M& operator[](size_t i) { return *items_[i]; }
  const M& operator[](size_t i) const { return *items_[i]; }
  size_t size() const { return items_.size(); }
  /// The step from one name to the next: 2 where every second item of PyTorch's Sequential is an
  /// activation.
  int step = 1;
  void visit(Fields& f) override {
    for (size_t i = 0; i < items_.size(); ++i)
      f(std::to_string(static_cast<int>(i) * step), *items_[i]);
  }
  const char* kind() const override { return "ModuleList"; }

 private:
  std::vector<std::unique_ptr<M>> items_;
};

}  // namespace restage
