#include "datasets/readers/arrays/pickle_objects.h"

#include <cmath>
#include <cstring>

#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"

namespace restage::pickle_detail {
namespace {

/// bfloat16 is the upper half of a float.
std::vector<char> widened(const std::vector<char>& halves) {
  std::vector<char> out(2 * halves.size(), '\0');
  for (size_t i = 0; 2 * i + 1 < halves.size(); ++i)
    std::memcpy(out.data() + 4 * i + 2, halves.data() + 2 * i, 2);
  return out;
}

}  // namespace

void Objects::charge(uint64_t bytes) {
  if (bytes > limits_.max_memory || used_ > limits_.max_memory - bytes)
    throw InputError(tree_.path(),
                     cat("takes more memory than the ", limits_.max_memory, " bytes allowed"),
                     "allow more with {max-memory}");
  used_ += bytes;
}

void Objects::damaged(const std::string& what) const {
  throw InputError(tree_.path(), "is a damaged pickle: " + what, "copy or save it again");
}

void Objects::refuse(const std::string& name) const {
  throw InputError(tree_.path(), "asks to run " + text::quote(name),
                   "a pickle may do anything, so only arrays are read: save the arrays alone with "
                   "numpy.savez");
}

// ---- names and their values --------------------------------------------------------------------

Objects::Id Objects::special(Special what) {
  charge(sizeof(Special) + what.name.size());
  const Id out = tree_.add_other(what.name);
  special_.emplace(out, std::move(what));
  return out;
}

const Objects::Special* Objects::find(Id id, Special::Of of) const {
  const auto at = special_.find(id);
  return at == special_.end() || at->second.of != of ? nullptr : &at->second;
}

const Objects::Special& Objects::need(Id id, Special::Of of, const char* what) const {
  const Special* out = find(id, of);
  if (out == nullptr) damaged(cat(what, " is missing"));
  return *out;
}

Objects::Id Objects::global(const std::string& name) {
  const Call call = call_of(name);
  if (call == Call::none) refuse(name);
  return special({.of = Special::Of::name, .call = call, .name = name});
}

Objects::Id Objects::argument(Id arguments, size_t i) const {
  if (!tree_.is(arguments, Kind::list) || i >= tree_.items(arguments).size())
    damaged("an argument is missing");
  return tree_.items(arguments)[i];
}

int64_t Objects::whole(Id id) const {
  if (!tree_.is(id, Kind::number) && !tree_.is(id, Kind::truth)) damaged("a number is missing");
  const double value = tree_.number(id);
  if (!(std::abs(value) < 9e15) || value != std::floor(value)) damaged("a number is no whole one");
  return static_cast<int64_t>(value);
}

std::vector<int64_t> Objects::shape(Id id) const {
  if (!tree_.is(id, Kind::list)) damaged("a shape is missing");
  std::vector<int64_t> out;
  for (const Id length : tree_.items(id)) {
    out.push_back(whole(length));
    if (out.back() < 0 || out.size() > 32) damaged("a shape is impossible");
  }
  return out;
}

const std::string& Objects::text(Id id) const {
  if (!tree_.is(id, Kind::text)) damaged("text is missing");
  return tree_.text(id);
}

/// The bytes that stand in UTF-8, each as a character of its own.
std::string Objects::encoded(Id id) const {
  const std::string& from = text(id);
  std::string out;
  for (size_t i = 0; i < from.size(); ++i) {
    const auto c = static_cast<unsigned char>(from[i]);
    if (c < 0x80) {
      out += from[i];
    } else if ((c == 0xc2 || c == 0xc3) && i + 1 < from.size()) {
      out += static_cast<char>((c & 3) << 6 | (from[++i] & 0x3f));
    } else {
      damaged("its bytes are no characters of Latin-1");
    }
  }
  return out;
}

// ---- calls -------------------------------------------------------------------------------------

Objects::Id Objects::list_of(Id arguments) {
  if (tree_.items(arguments).empty()) return tree_.add_list({});
  const Id from = argument(arguments, 0);
  if (!tree_.is(from, Kind::list)) damaged("a list is missing");
  charge(sizeof(Id) * tree_.items(from).size());
  return tree_.add_list(std::vector<Id>(tree_.items(from)));
}

Objects::Id Objects::path_text(Id arguments) {
  std::string out;
  for (const Id part : tree_.items(arguments))
    if (tree_.is(part, Kind::text))
      out += (out.empty() || out.ends_with('/') ? "" : "/") + tree_.text(part);
  charge(out.size());
  return tree_.add_text(out);
}

Objects::Id Objects::make(Id type, Id arguments) {
  const Special& name = need(type, Special::Of::name, "a class");
  if (!tree_.is(arguments, Kind::list)) damaged("arguments are missing");
  switch (name.call) {
    case Call::wrapper:
      return special({.of = Special::Of::wrapper, .name = "an array"});
    case Call::object:
      return tree_.add_map();
    case Call::map:
    case Call::list:
    case Call::text:
    case Call::bytes:
    case Call::dtype:
      return call(type, arguments);
    default:
      refuse(name.name);
  }
}

Objects::Id Objects::call(Id function, Id arguments) {
  const Special name = need(function, Special::Of::name, "what it calls");  // a copy: it may move
  if (!tree_.is(arguments, Kind::list)) damaged("arguments are missing");
  switch (name.call) {
    case Call::reconstruct:
      return special({.of = Special::Of::array, .name = "an array"});
    case Call::scalar: {
      const std::string type = need(argument(arguments, 0), Special::Of::type, "a type").name;
      return array(type, {}, false, text(argument(arguments, 1)));
    }
    case Call::frombuffer: {
      const std::string type = need(argument(arguments, 1), Special::Of::type, "a type").name;
      const bool fortran = text(argument(arguments, 3)) == "F";
      return array(type, shape(argument(arguments, 2)), fortran, text(argument(arguments, 0)));
    }
    case Call::dtype:
      return special({.of = Special::Of::type, .name = text(argument(arguments, 0))});
    case Call::encode:
      charge(text(argument(arguments, 0)).size());
      return tree_.add_text(encoded(argument(arguments, 0)));
    case Call::bytes: {
      if (tree_.items(arguments).empty()) return tree_.add_text("");
      const Id from = argument(arguments, 0);
      if (tree_.items(arguments).size() == 1) return text(from), from;
      charge(text(from).size());
      return tree_.add_text(encoded(from));  // bytearray(text, 'latin-1')
    }
    case Call::list:
      return list_of(arguments);
    case Call::map:
    case Call::object:
      return tree_.add_map();
    case Call::reconstructor:
      return make(argument(arguments, 0), tree_.add_list({}));
    case Call::tensor:
      return tensor(arguments);
    case Call::first:
      return argument(arguments, 0);
    case Call::apply:
      if (find(argument(arguments, 0), Special::Of::name) == nullptr ||
          find(argument(arguments, 0), Special::Of::name)->call != Call::tensor)
        damaged("it makes a tensor in a way that is not known");
      return tensor(argument(arguments, 2));
    case Call::text:
      return path_text(arguments);
    default:
      refuse(name.name);
  }
}

// ---- arrays ------------------------------------------------------------------------------------

/// Of a type that is not read, what it is.
Objects::Id Objects::array(const std::string& type, const std::vector<int64_t>& shape, bool fortran,
                           std::string_view bytes) {
  NpyHeader header;
  try {
    header = npy_header_of(type, shape, tree_.path());
  } catch (const InputError& error) {
    return tree_.add_other(error.cause());
  }
  if (header.is_object) damaged("an array of objects has no objects");
  header.fortran = fortran && shape.size() > 1;
  if (header.bytes() != bytes.size())
    damaged(cat("an array ", shape_text(shape), " has ", bytes.size(), " bytes"));
  charge(bytes.size() + sizeof(NpyArray));
  return tree_.add_array(
      shared_array(NpyArray(header, std::vector<char>(bytes.begin(), bytes.end()), tree_.path())));
}

/// (version, shape, type, is_fortran, bytes or objects)
void Objects::build_array(Id object, Id state) {
  const std::vector<int64_t> lengths = shape(argument(state, 1));
  const std::string type = need(argument(state, 2), Special::Of::type, "a type").name;
  const Id content = argument(state, 4);
  Id out = content;
  if (tree_.is(content, Kind::list)) {
    const bool one = lengths.empty() && tree_.items(content).size() == 1;
    if (one) out = tree_.items(content)[0];
    if (out == object) damaged("an array holds itself");
  } else {
    out = array(type, lengths, whole(argument(state, 3)) != 0, text(content));
  }
  special_.erase(object);
  if (const auto at = special_.find(out); at != special_.end())
    special_.emplace(object, at->second);
  tree_.alias(object, out);
}

/// (3, '<', None, names, fields, ...)
void Objects::build_type(Id object, Id state) {
  Special& type = special_.at(object);
  const std::string order = text(argument(state, 1));
  const auto is_none = [&](size_t i) { return tree_.is(argument(state, i), Kind::none); };
  if (!is_none(2) || !is_none(3))
    type.name = "V";  // records
  else if (order == "<" || order == ">")
    type.name = order + type.name;
}

bool Objects::build(Id object, Id state) {
  if (find(object, Special::Of::array) != nullptr) {
    build_array(object, state);
    return false;
  }
  if (find(object, Special::Of::type) != nullptr) {
    build_type(object, state);
    return false;
  }
  if (find(object, Special::Of::wrapper) != nullptr) {
    build_wrapper(object, state);
    return true;
  }
  if (!tree_.is(object, Kind::map)) return false;  // attributes of a list, a tensor: none of ours
  Id attributes = state;
  if (tree_.is(state, Kind::list) && tree_.items(state).size() == 2)
    attributes = argument(state, 0);
  if (!tree_.is(attributes, Kind::map) || !tree_.items(object).empty()) return false;
  charge(sizeof(Id) * tree_.items(attributes).size());
  const std::vector<Id> copied = tree_.items(attributes);
  tree_.grow(object) = copied;
  return false;
}

// ---- joblib ------------------------------------------------------------------------------------

void Objects::build_wrapper(Id object, Id state) {
  if (!tree_.is(state, Kind::map)) damaged("an array has no description");
  const auto attribute = [&](const char* name) { return tree_.find(state, name); };
  const Id lengths = attribute("shape"), type = attribute("dtype"), order = attribute("order");
  if (lengths == tree_.none() || type == tree_.none() || order == tree_.none())
    damaged("an array has no description");
  Special& out = special_.at(object);
  out.shape = shape(lengths);
  out.name = need(type, Special::Of::type, "a type").name;
  out.fortran = text(order) == "F";
  const Id aligned = attribute("numpy_array_alignment_bytes");
  out.padding = aligned != tree_.none() && !tree_.is(aligned, Kind::none) ? 1 : 0;
}

size_t Objects::take_array(Id object, std::string_view rest,
                           const std::function<size_t(std::string_view, Id&)>& nested) {
  const Special wrapper = need(object, Special::Of::wrapper, "an array");
  special_.erase(object);
  if (wrapper.name.ends_with('O')) {
    Id value = 0;
    const size_t taken = nested(rest, value);
    tree_.alias(object, value);
    return taken;
  }
  size_t at = 0;
  if (wrapper.padding > 0) {
    if (rest.empty()) damaged("it ends in an array");
    at = 1 + static_cast<unsigned char>(rest[0]);
  }
  const NpyHeader header = npy_header_of(wrapper.name, wrapper.shape, tree_.path());
  if (at > rest.size() || header.bytes() > rest.size() - at) damaged("it ends in an array");
  const std::string_view bytes = rest.substr(at, header.bytes());
  tree_.alias(object, array(wrapper.name, wrapper.shape, wrapper.fortran, bytes));
  return at + bytes.size();
}

// ---- torch -------------------------------------------------------------------------------------

/// ('storage', class, key, place, number of elements)
Objects::Id Objects::storage(Id persistent) {
  if (!limits_.storage) refuse("a persistent id");
  if (text(argument(persistent, 0)) != "storage") damaged("a persistent id is no storage");
  const Special& type = need(argument(persistent, 1), Special::Of::name, "a storage's class");
  const std::string name = type_of_torch(type.name);
  if (name.empty()) damaged("a storage's class is not known");
  const int64_t elements = whole(argument(persistent, 4));
  if (elements < 0) damaged("a storage has no length");
  const uint64_t bytes = static_cast<uint64_t>(elements) * static_cast<uint64_t>(name[2] - '0');
  const std::string_view content = limits_.storage(text(argument(persistent, 2)), bytes);
  return special({.of = Special::Of::storage, .name = name, .bytes = content});
}

/// (storage, offset, size, stride, ...); with a type of its own where the storage has none.
Objects::Id Objects::tensor(Id arguments) {
  const Special from = need(argument(arguments, 0), Special::Of::storage, "a storage");
  std::string type = from.name;
  if (tree_.items(arguments).size() > 6)
    if (const Special* own = find(argument(arguments, 6), Special::Of::name)) {
      type = type_of_torch(own->name);
      if (type.empty()) damaged("a tensor's type is not known");
    }
  const int64_t offset = whole(argument(arguments, 1));
  const std::vector<int64_t> size = shape(argument(arguments, 2)),
                             stride = shape(argument(arguments, 3));
  const bool half = type == "bf2";
  const NpyHeader header = npy_header_of(half ? "<u2" : type, size, tree_.path());
  if (stride.size() != size.size() || offset < 0) damaged("a tensor's strides are wrong");
  const auto width = static_cast<int64_t>(header.width);
  const auto available = static_cast<int64_t>(from.bytes.size()) / width;
  int64_t last = offset;
  for (size_t axis = 0; axis < size.size(); ++axis) {
    const int64_t steps = size[axis] - 1;
    if (steps > 0 && stride[axis] > available / steps)
      last = available;
    else if (steps > 0)
      last += steps * stride[axis];
  }
  if (header.count > 0 && last >= available) damaged("a tensor is larger than its storage");
  charge((half ? 2 : 1) * header.bytes() + sizeof(NpyArray));
  std::vector<char> bytes(header.bytes());
  std::vector<int64_t> at(size.size(), 0);
  for (int64_t i = 0, from_element = offset; i < header.count; ++i) {
    std::memcpy(bytes.data() + i * width, from.bytes.data() + from_element * width, header.width);
    for (size_t axis = size.size(); axis-- > 0;) {
      from_element += stride[axis];
      if (++at[axis] < size[axis]) break;
      from_element -= stride[axis] * size[axis];
      at[axis] = 0;
    }
  }
  if (half) bytes = widened(bytes);
  return tree_.add_array(shared_array(NpyArray(
      npy_header_of(half ? "<f4" : type, size, tree_.path()), std::move(bytes), tree_.path())));
}

}  // namespace restage::pickle_detail
