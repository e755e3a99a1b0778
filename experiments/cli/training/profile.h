// How long the parts of repeated work take.
#pragma once

#include <initializer_list>
#include <string>
#include <vector>

#include "experiments/cli/output.h"

namespace restage::cli {

class Profile {
 public:
  explicit Profile(std::vector<std::string> parts)
      : parts_(std::move(parts)), seconds_(parts_.size()) {}
  /// Seconds of every part, in the order of the parts.
  void add(std::initializer_list<double> seconds) {
    size_t part = 0;
    for (const double s : seconds) seconds_[part++].push_back(s);
  }

  /// Milliseconds: {part: {"p50", "p95", "p99", "max"}} in the order of the parts.
  Json json() const;
  /// The same as lines of text, a heading first.
  std::vector<std::string> lines() const;

 private:
  std::vector<std::string> parts_;
  std::vector<std::vector<double>> seconds_;  // 8 bytes a part and frame
};

}  // namespace restage::cli
