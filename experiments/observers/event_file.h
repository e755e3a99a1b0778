// TensorBoard's event files: records of protobuf messages, each with the checksums of its length
// and its bytes. Three messages are all that scalars, histograms and pictures take, so they are
// written by hand; the libraries that write them bring TensorFlow along.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string>

namespace restage {

class EventFile {
 public:
  /// Makes `folder`/events.out.tfevents.SECONDS.HOST.PROCESS. Later steps of older files in the
  /// folder are void from `first_step` on (a run that was resumed). WorkError: cannot be made.
  EventFile(const std::string& folder, int64_t first_step);

  void scalar(int64_t step, const std::string& tag, double value);
  /// Buckets between the least and the largest value; values that are not finite are left out.
  void histogram(int64_t step, const std::string& tag, std::span<const float> values);
  void picture(int64_t step, const std::string& tag, int width, int height, const std::string& png);
  /// WorkError: the disk is full.
  void flush();

  const std::string& path() const { return path_; }

 private:
  void add(const std::string& event);

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
};

/// CRC-32C (Castagnoli) of some bytes, masked as in records.
uint32_t masked_crc32c(std::string_view bytes);

}  // namespace restage
