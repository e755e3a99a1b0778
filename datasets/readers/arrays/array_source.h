// Arrays by name, wherever they are kept: in an archive, or in memory.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "datasets/readers/arrays/npy.h"

namespace restage {

class ArraySource {
 public:
  virtual ~ArraySource() = default;
  virtual const std::string& path() const = 0;  ///< the file, for messages
  virtual std::vector<std::string> names() const = 0;
  virtual bool has(const std::string& name) const = 0;
  /// InputError if there is none of this name.
  virtual NpyArray array(const std::string& name) const = 0;
  virtual NpyHeader header(const std::string& name) const = 0;
};

/// Up to eight names, for messages: "a, b, c".
std::string list_of(const std::vector<std::string>& names);

/// An array that is read when it is asked for, and is shared.
class LazyArray {
 public:
  virtual ~LazyArray() = default;
  virtual NpyHeader header() const = 0;
  virtual NpyArray read() const = 0;
};
using SharedArray = std::shared_ptr<const LazyArray>;

/// An array in memory.
SharedArray shared_array(NpyArray array);
/// Of numbers, in this shape.
SharedArray shared_numbers(const std::vector<int64_t>& shape, const std::vector<double>& values,
                           const std::string& where);
/// Arrays of one type and shape as one with an axis more; null for others.
SharedArray stacked(const std::vector<SharedArray>& parts);
/// Part `i` of the first axis.
SharedArray part_of(const SharedArray& whole, int64_t i);
/// Parts of the first axis in this order; the same one may come several times.
SharedArray rows_of(const SharedArray& whole, std::vector<int64_t> rows);

/// Arrays that were gathered from somewhere in a file.
class GatheredArrays : public ArraySource {
 public:
  explicit GatheredArrays(std::string path) : path_(std::move(path)) {}
  /// Takes the place of an array of the same name.
  void put(const std::string& name, SharedArray array) { arrays_[name] = std::move(array); }
  void remove(const std::string& name) { arrays_.erase(name); }
  const SharedArray& shared(const std::string& name) const { return arrays_.at(name); }

  const std::string& path() const override { return path_; }
  std::vector<std::string> names() const override;
  bool has(const std::string& name) const override { return arrays_.count(name) > 0; }
  NpyArray array(const std::string& name) const override;
  NpyHeader header(const std::string& name) const override;

 private:
  const LazyArray& at(const std::string& name) const;
  std::string path_;
  std::map<std::string, SharedArray> arrays_;
};

}  // namespace restage
