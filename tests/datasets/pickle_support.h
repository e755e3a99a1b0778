// Pickles written by hand: each function gives the operations that put one value on the stack.
#pragma once

#include <string>
#include <vector>

#include "tests/datasets/npz_support.h"

namespace restage::test::pickle {

inline std::string text(const std::string& words) {
  return "X" + raw(static_cast<uint32_t>(words.size())) + words;
}
inline std::string bytes(const std::string& content) {
  return "B" + raw(static_cast<uint32_t>(content.size())) + content;
}
inline std::string number(int32_t value) { return "J" + raw(value); }
inline std::string name(const std::string& module, const std::string& word) {
  return "c" + module + "\n" + word + "\n";
}
inline std::string tuple(const std::vector<std::string>& items) {
  std::string out = "(";
  for (const std::string& item : items) out += item;
  return out + "t";
}
inline std::string list(const std::vector<std::string>& items) {
  std::string out = "](";
  for (const std::string& item : items) out += item;
  return out + "e";
}
/// Keys are whole operations, too.
inline std::string map(const std::vector<std::pair<std::string, std::string>>& items) {
  std::string out = "}(";
  for (const auto& [key, value] : items) out += key + value;
  return out + "u";
}
inline std::string call(const std::string& function, const std::vector<std::string>& arguments) {
  return function + tuple(arguments) + "R";
}
inline std::string shape(const std::vector<int64_t>& lengths) {
  std::vector<std::string> out;
  for (const int64_t n : lengths) out.push_back(number(static_cast<int32_t>(n)));
  return tuple(out);
}
/// numpy.dtype, as "f8".
inline std::string type(const std::string& kind) {
  return call(name("numpy", "dtype"), {text(kind), "\x89", "\x88"}) +
         tuple({number(3), text("<"), "N", "N", "N", number(-1), number(-1), number(0)}) + "b";
}
inline std::string state(const std::vector<int64_t>& lengths, const std::string& kind, bool fortran,
                         const std::string& content) {
  return call(name("numpy.core.multiarray", "_reconstruct"),
              {name("numpy", "ndarray"), tuple({number(0)}), bytes("b")}) +
         tuple({number(1), shape(lengths), type(kind), fortran ? "\x88" : "\x89", content}) + "b";
}
inline std::string raw_of(const std::vector<double>& values) {
  std::string out;
  for (const double value : values) out += raw(value);
  return out;
}
/// A numpy array of float64.
inline std::string array(const std::vector<int64_t>& lengths, const std::vector<double>& values,
                         bool fortran = false) {
  return state(lengths, "f8", fortran, bytes(raw_of(values)));
}
/// A numpy array of objects.
inline std::string objects(const std::vector<int64_t>& lengths,
                           const std::vector<std::string>& items) {
  return state(lengths, "O", false, list(items));
}
inline std::string file(const std::string& value) { return "\x80\x02" + value + "."; }
/// The NPY file of an array of objects.
inline std::string npy_objects(const std::vector<int64_t>& lengths,
                               const std::vector<std::string>& items) {
  return npy_of(npy_header("|O", lengths), file(objects(lengths, items)));
}

/// An array as joblib writes it: its description, and behind it its bytes, aligned.
inline std::string joblib_array(const std::vector<int64_t>& lengths,
                                const std::vector<double>& values) {
  const std::string pad = "\x03???";
  return name("joblib.numpy_pickle", "NumpyArrayWrapper") + ")\x81" +
         map({{text("shape"), shape(lengths)},
              {text("order"), text("C")},
              {text("dtype"), type("f8")},
              {text("numpy_array_alignment_bytes"), number(16)}}) +
         "b" + pad + raw_of(values);
}

/// torch: part of a storage of float64.
inline std::string tensor(const std::string& key, int64_t elements, int64_t offset,
                          const std::vector<int64_t>& size, const std::vector<int64_t>& stride) {
  const std::string storage = tuple({text("storage"), name("torch", "DoubleStorage"), text(key),
                                     text("cpu"), number(static_cast<int32_t>(elements))}) +
                              "Q";
  return call(name("torch._utils", "_rebuild_tensor_v2"),
              {storage, number(static_cast<int32_t>(offset)), shape(size), shape(stride), "\x89",
               call(name("collections", "OrderedDict"), {})});
}
/// The zip of torch.save.
inline std::string torch_file(const std::string& value,
                              const std::vector<std::vector<double>>& storages) {
  std::vector<ZipEntry> entries = {{"archive/data.pkl", file(value)}};
  for (size_t i = 0; i < storages.size(); ++i) {
    entries.push_back({"archive/data/" + std::to_string(i), raw_of(storages[i])});
    entries.back().descriptor = true;
  }
  entries.push_back({"archive/version", "3\n"});
  return zip_of(entries);
}

}  // namespace restage::test::pickle
