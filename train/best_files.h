// The weights of a stage's best validations, in RUN/best. A file is named by its step and its
// figure, so the folder says by itself which files stay, also after a stop:
// skeleton-000004000-joint_error_mm-17.9.safetensors
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace restage {

class BestFiles {
 public:
  /// Keeps the `most` best of `stage` in `run`/best; 0: none, and nothing is written.
  BestFiles(const std::string& run, std::string stage, int64_t most);
  /// Notes a validation; `bytes` makes the file, and is called only if the validation is one of the
  /// best. Lower is better; of equal ones (to six digits) the earlier is. What is not finite is
  /// never kept. WorkError: the folder cannot be written.
  void add(int64_t step, const std::string& figure, double value,
           const std::function<std::string()>& bytes) const;
  /// Removes the files of steps after `step`: a resumed training makes them again.
  void forget_after(int64_t step) const;

 private:
  std::string folder_, stage_;
  int64_t most_;
};

}  // namespace restage
