// What a network of a user's own is given beside its input: restage.Context and restage.Init.
#pragma once

#include <memory>
#include <unordered_set>

#include "python/engine.h"

namespace restage::python {

/// A Context as Python sees it: one of C++ for the time of a call, or one that Python made.
class PyContext {
 public:
  using Bound = void;
  /// One of a call of a network that has these parameters, by identity; until end().
  PyContext(Context* of, const std::unordered_set<uint64_t>* members)
      : of_(of), members_(members) {}
  PyContext(std::shared_ptr<PyTape> tape, bool training, uint64_t seed, uint64_t step);
  void end() { of_ = nullptr; }
  /// ShapeError where the call is over.
  Context& live() const;
  PyVar leaf(const PyParameter& p) const;
  const std::shared_ptr<PyTape>& tape() const { return tape_; }

 private:
  Context own_;
  Context* of_;
  const std::unordered_set<uint64_t>* members_ = nullptr;  ///< null: any parameter may be used
  std::shared_ptr<PyTape> tape_;                           ///< null: a tape of C++, or none
};

/// How many calls of networks in Python this thread is in.
int& networks_running();

/// Where the numbers of a new network come from, as Python sees it.
struct PyInit {
  using Bound = void;
  Init init;
};

}  // namespace restage::python
