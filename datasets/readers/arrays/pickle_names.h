// The names that a pickle may ask for, and what stands for them.
#pragma once

#include <optional>
#include <string>

namespace restage::pickle_detail {

enum class Call {
  none,
  reconstruct,    ///< numpy: an array whose state follows
  scalar,         ///< numpy: (type, bytes)
  frombuffer,     ///< numpy: (bytes, type, shape, order)
  dtype,          ///< numpy: a type of elements
  encode,         ///< _codecs.encode: text whose characters are bytes
  bytes,          ///< bytes, bytearray of nothing or of bytes
  list,           ///< list, tuple, set, frozenset of nothing or of a list
  map,            ///< dict, OrderedDict, defaultdict ...
  object,         ///< a plain object, of which its attributes are kept as a map
  reconstructor,  ///< copyreg: makes an object of its class
  wrapper,        ///< joblib: an array that follows
  tensor,         ///< torch: (storage, offset, size, stride, ...)
  first,          ///< torch: a parameter, which is its first argument
  apply,          ///< torch: (function, type, arguments, state)
  text,           ///< a path, a device: its parts as text
  storage,        ///< a class of torch's storages
  type,           ///< a class or a constant that says nothing by itself
};

/// What a global name ("numpy.core.multiarray._reconstruct") stands for; Call::none for a name that
/// is not known, which is refused.
Call call_of(const std::string& name);

/// numpy's name of a storage's elements ("<f4" of torch.FloatStorage; "bf2" of bfloat16, "<u1" of
/// untyped ones) or of a type of torch's (torch.float32); empty for others.
std::string type_of_torch(const std::string& name);

}  // namespace restage::pickle_detail
