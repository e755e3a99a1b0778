// NPZ: a zip archive of NPY arrays. Only what is asked for is read and unpacked, so that pickled
// objects beside it do no harm.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "datasets/readers/arrays/array_source.h"
#include "datasets/readers/arrays/npy.h"
#include "datasets/readers/arrays/zip.h"

namespace restage {

class Npz : public ArraySource {
 public:
  /// InputError: see ZipFile. `max_memory` holds for each array.
  explicit Npz(const std::string& path, uint64_t max_memory = kMaxMemory)
      : zip_(path), max_memory_(max_memory) {}

  const std::string& path() const override { return zip_.path(); }
  std::vector<std::string> names() const override;  ///< of the arrays, without ".npy"
  bool has(const std::string& name) const override;
  /// InputError if there is none (it names those there are), or as NpyArray.
  NpyArray array(const std::string& name) const override;
  NpyHeader header(const std::string& name) const override;
  std::unique_ptr<ByteStream> open(const std::string& name) const;

 private:
  ZipFile zip_;
  uint64_t max_memory_;
};

}  // namespace restage
