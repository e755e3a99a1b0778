// State dicts: between modules and files.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "autograd/base/error.h"
#include "nn/module.h"
#include "nn/weights/safetensors.h"

namespace restage {

/// Copies of all parameters and buffers of a module, under `prefix` + their state-dict names, in
/// the host's memory.
TensorFile to_file(Module& module, const std::string& prefix = "");
void append(TensorFile* file, Module& module, const std::string& prefix);

/// A file does not fit a module: the message shows some of the names, the lists hold all names.
class StateError : public InputError {
 public:
  StateError(const std::string& where, const std::string& wrong, const std::string& fix)
      : InputError(where, wrong, fix) {}
  /// `unfit`: the name and what is wrong with it (shape, dtype, not finite).
  std::vector<std::string> missing, unexpected, unfit;
  /// All names, each in a line.
  std::string details() const;
};

/// Copies the tensors of `file` whose names begin with `prefix` into the module, cast to its dtype,
/// on its device. Strict: if a name is missing, unexpected, of another shape or holds NaN,
/// StateError tells all such names and nothing is loaded. Names ending in num_batches_tracked are
/// ignored.
void load_state(Module& module, const TensorFile& file, const std::string& prefix,
                const std::string& where);

/// Names of another code base turned into ours: lines "foreign: ours" of a YAML file, tried in
/// order, the first match wins. A `*` stands for any text, and for the same text on the right; the
/// right side `~` leaves a tensor out; names without a match stay.
class NameMap {
 public:
  static NameMap read(const std::string& path);
  static NameMap parse(const std::string& yaml, const std::string& where);
  /// InputError if two tensors get the same name.
  TensorFile apply(const TensorFile& file, const std::string& where) const;
  /// Writes the new name; false if the tensor is to be left out.
  bool rename(const std::string& name, std::string* ours) const;

 private:
  struct Rule {
    std::string from, to;
    bool drop;
  };
  std::vector<Rule> rules_;
};

}  // namespace restage
