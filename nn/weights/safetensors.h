// safetensors files: an 8-byte little-endian header length, a JSON header, raw little-endian data.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "autograd/tensor/tensor.h"

namespace restage {

/// Named tensors and text metadata, in the order of their names.
struct TensorFile {
  std::map<std::string, Tensor> tensors;
  std::map<std::string, std::string> metadata;

  /// Null if there is no such tensor.
  const Tensor* find(const std::string& name) const;
  /// InputError naming `where` if there is no such tensor.
  const Tensor& at(const std::string& name, const std::string& where) const;
};

/// F32, F64, I32 and I64 are kept, F16 and BF16 become f32. InputError (one line, naming `where`)
/// for whatever is damaged: lengths that the bytes state are checked before they are used.
TensorFile parse_safetensors(std::string_view bytes, const std::string& where);
TensorFile read_safetensors(const std::string& path);

/// The same bytes for the same content; data begins at a multiple of 8.
std::string safetensors_bytes(const TensorFile& file);
/// Writes a file that appears whole or not at all.
void write_safetensors(const std::string& path, const TensorFile& file);

/// A name from a file in a form fit for a message: in quotes, short, printable.
std::string name_in_quotes(std::string_view name);

}  // namespace restage
