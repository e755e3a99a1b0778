// Attributes and group members of a File.
#include <hdf5.h>

#include <algorithm>
#include <cstring>

#include "autograd/base/error.h"
#include "datasets/hdf5/detail.h"

namespace restage::h5 {
namespace {

constexpr size_t kLongestText = size_t{1} << 20;
constexpr size_t kMostMembers = size_t{1} << 22;

herr_t collect_name(hid_t, const char* name, const H5L_info_t*, void* out) {
  auto* names = static_cast<std::vector<std::string>*>(out);
  if (names->size() >= kMostMembers) return -1;
  names->emplace_back(name);
  return 0;
}

herr_t collect_attribute(hid_t, const char* name, const H5A_info_t*, void* out) {
  auto* names = static_cast<std::vector<std::string>*>(out);
  if (names->size() >= kMostMembers) return -1;
  names->emplace_back(name);
  return 0;
}

/// An open attribute with its type; `id` < 0 if there is none.
struct Attribute {
  Handle id, type;
  std::string where;
};

Attribute open_attribute(const File::State& state, const std::string& object,
                         const std::string& name) {
  const std::string where = state.where(object) + " attribute " + name;
  if (!link_exists(state, object) ||
      H5Aexists_by_name(state.id, object.c_str(), name.c_str(), H5P_DEFAULT) <= 0)
    return {Handle(-1, H5Aclose), Handle(-1, H5Tclose), where};
  Handle id(H5Aopen_by_name(state.id, object.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT),
            H5Aclose);
  Handle type(id < 0 ? -1 : H5Aget_type(id), H5Tclose);
  const Handle space(id < 0 ? -1 : H5Aget_space(id), H5Sclose);
  if (id < 0 || type < 0 || space < 0 || H5Sget_simple_extent_npoints(space) != 1)
    throw InputError(where, "is damaged or not a single value", "store one value");
  return {std::move(id), std::move(type), where};
}

std::string read_text_attribute(const Attribute& attribute) {
  if (H5Tget_class(attribute.type) != H5T_STRING)
    throw InputError(attribute.where, "is not text", "store a string");
  if (H5Tis_variable_str(attribute.type) > 0) {
    const Handle memory = text_type(H5T_VARIABLE, H5Tget_cset(attribute.type));
    char* raw = nullptr;
    if (H5Aread(attribute.id, memory, &raw) < 0) throw_damaged(attribute.where);
    const std::string value = raw == nullptr ? "" : raw;
    H5free_memory(raw);
    return value;
  }
  const size_t width = H5Tget_size(attribute.type);
  if (width == 0 || width > kLongestText) throw_damaged(attribute.where);
  std::string value(width, '\0');
  if (H5Aread(attribute.id, attribute.type, value.data()) < 0) throw_damaged(attribute.where);
  value.resize(::strnlen(value.data(), width));
  return value;
}

void write_attribute(const File::State& state, const std::string& object, const std::string& name,
                     hid_t type, const void* value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  if (H5Aexists_by_name(state.id, object.c_str(), name.c_str(), H5P_DEFAULT) > 0)
    H5Adelete_by_name(state.id, object.c_str(), name.c_str(), H5P_DEFAULT);
  const Handle id(H5Acreate_by_name(state.id, object.c_str(), name.c_str(), type, space,
                                    H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                  H5Aclose);
  if (id < 0 || H5Awrite(id, type, value) < 0) throw_write_error(state.path);
}

}  // namespace

std::vector<std::string> File::children(const std::string& group) const {
  const Lock lock;
  const std::string where = state_->where(group);
  if (!link_exists(*state_, group))
    throw InputError(where, "is missing", "give a file that has it");
  const Handle id(H5Gopen2(state_->id, group.c_str(), H5P_DEFAULT), H5Gclose);
  if (id < 0) throw InputError(where, "is not a group", "give a file of the documented schema");
  std::vector<std::string> names;
  if (H5Literate(id, order_of(id), H5_ITER_INC, nullptr, collect_name, &names) < 0)
    throw_damaged(where);
  return names;
}

void File::set_text(const std::string& object, const std::string& name, const std::string& value) {
  const Lock lock;
  const Handle type = text_type(std::max<size_t>(value.size(), 1), H5T_CSET_UTF8);
  write_attribute(*state_, object, name, type, value.c_str());
}

void File::set_number(const std::string& object, const std::string& name, double value) {
  const Lock lock;
  write_attribute(*state_, object, name, H5T_NATIVE_DOUBLE, &value);
}

void File::set_integer(const std::string& object, const std::string& name, int64_t value) {
  const Lock lock;
  write_attribute(*state_, object, name, H5T_NATIVE_INT64, &value);
}

std::optional<std::string> File::text(const std::string& object, const std::string& name) const {
  const Lock lock;
  const Attribute attribute = open_attribute(*state_, object, name);
  if (attribute.id < 0) return std::nullopt;
  return read_text_attribute(attribute);
}

std::optional<double> File::number(const std::string& object, const std::string& name) const {
  const Lock lock;
  const Attribute attribute = open_attribute(*state_, object, name);
  if (attribute.id < 0) return std::nullopt;
  if (classify(attribute.type, attribute.where) == Type::text)
    throw InputError(attribute.where, "is not a number", "store a number");
  double value = 0;
  if (H5Aread(attribute.id, H5T_NATIVE_DOUBLE, &value) < 0) throw_damaged(attribute.where);
  return value;
}

std::optional<int64_t> File::integer(const std::string& object, const std::string& name) const {
  const Lock lock;
  const Attribute attribute = open_attribute(*state_, object, name);
  if (attribute.id < 0) return std::nullopt;
  if (classify(attribute.type, attribute.where) != Type::integer)
    throw InputError(attribute.where, "is not an integer", "store an integer");
  int64_t value = 0;
  if (H5Aread(attribute.id, H5T_NATIVE_INT64, &value) < 0) throw_damaged(attribute.where);
  return value;
}

std::vector<std::string> File::copy_attributes(const File& from, const std::string& object) {
  const Lock lock;
  std::vector<std::string> names, lost;
  if (H5Aiterate_by_name(from.state_->id, object.c_str(), H5_INDEX_NAME, H5_ITER_INC, nullptr,
                         collect_attribute, &names, H5P_DEFAULT) < 0)
    throw_damaged(from.state_->where(object));
  for (const std::string& name : names) {
    if (H5Aexists_by_name(state_->id, object.c_str(), name.c_str(), H5P_DEFAULT) > 0) continue;
    try {
      const Attribute attribute = open_attribute(*from.state_, object, name);
      const Type type = classify(attribute.type, attribute.where);
      if (type == Type::text)
        set_text(object, name, read_text_attribute(attribute));
      else if (type == Type::integer)
        set_integer(object, name, *from.integer(object, name));
      else
        set_number(object, name, *from.number(object, name));
    } catch (const InputError&) {
      lost.push_back(name);
    }
  }
  return lost;
}

}  // namespace restage::h5
