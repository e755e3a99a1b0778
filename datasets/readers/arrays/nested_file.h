// Files of nested values, whoever writes them: pickles, joblib's dumps (also packed with zlib or
// gzip), files of torch.save (zip and older), NPY and NPZ, whose objects are pickles. Nothing in
// them is run (pickle.h).
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "datasets/readers/arrays/npz.h"
#include "datasets/readers/arrays/value_tree.h"
#include "datasets/readers/errors.h"

namespace restage {

/// By its name, a file that holds a pickle: .pkl, .pickle, .pt, .pth, .joblib.
bool is_pickle_name(const std::string& path);

/// Whether an NPY file holds objects.
bool holds_objects(const std::string& path);

/// What a file holds: a pickle in whatever wrapping, by its content; an NPY file of objects.
/// InputError: damaged, too large, neither of these, a name or an operation that is not known.
ValueTree read_nested_file(const std::string& path, uint64_t max_memory = kMaxMemory);

/// A map of the archive's arrays, which are read when they are asked for; of objects, what they
/// hold. Objects that cannot be read are left out, `fault` is why.
ValueTree read_nested_arrays(const std::shared_ptr<const Npz>& file, uint64_t max_memory,
                             std::optional<InputError>& fault);

/// How what matters can be saved as plain arrays: the words that end a refusal.
std::string save_as_arrays(const std::string& path);

}  // namespace restage
