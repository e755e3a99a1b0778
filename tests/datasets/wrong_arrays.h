// What tests of body models and of their motions share: arrays of a file, changed or wrong.
#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "tests/datasets/npz_support.h"

namespace restage::test {

using Arrays = std::vector<std::pair<std::string, std::string>>;

/// The arrays with another one of this name, or without it where `bytes` are empty.
inline Arrays with(Arrays arrays, const std::string& name, const std::string& bytes) {
  const auto at = std::find_if(arrays.begin(), arrays.end(),
                               [&](const auto& array) { return array.first == name; });
  if (at == arrays.end())
    arrays.emplace_back(name, bytes);
  else
    at->second = bytes;
  if (bytes.empty()) std::erase_if(arrays, [&](const auto& array) { return array.first == name; });
  return arrays;
}

inline std::string doubles(const std::vector<int64_t>& shape, double value) {
  int64_t size = 1;
  for (const int64_t n : shape) size *= n;
  return npy<double>(shape, std::vector<double>(static_cast<size_t>(size), value));
}

/// An array, what stands in its place (nothing: it is missing), and what is said of it.
struct WrongArray {
  const char* name;
  std::string bytes;
  const char* says;
};

}  // namespace restage::test
