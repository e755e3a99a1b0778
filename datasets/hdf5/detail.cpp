#include "datasets/hdf5/detail.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <initializer_list>

#include "autograd/base/error.h"

namespace restage::h5 {
namespace {

/// Never destroyed: files may be closed while the program ends.
std::recursive_mutex& library_mutex() {
  static auto* mutex = [] {
    // All handles close by themselves. The library's own tidying at exit would try again to write
    // what a full disk refused, and complain on standard error.
    H5dont_atexit();
    return new std::recursive_mutex;
  }();
  return *mutex;
}

/// Finds "errno = N" in the texts of the error stack.
herr_t find_errno(unsigned, const H5E_error2_t* entry, void* out) {
  const char* found = entry->desc == nullptr ? nullptr : std::strstr(entry->desc, "errno = ");
  if (found != nullptr) *static_cast<int*>(out) = std::atoi(found + std::strlen("errno = "));
  return 0;
}

/// numpy's float16, which the library has no name for.
Handle half_type() {
  Handle half(H5Tcopy(H5T_IEEE_F32LE), H5Tclose);
  H5Tset_fields(half, 15, 10, 5, 0, 10);
  H5Tset_size(half, 2);
  H5Tset_ebias(half, 15);
  return half;
}

bool is_one_of(hid_t type, std::initializer_list<hid_t> known) {
  return std::any_of(known.begin(), known.end(), [&](hid_t k) { return H5Tequal(type, k) > 0; });
}

}  // namespace

Lock::Lock() : lock_(library_mutex()) { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

std::string File::State::where(const std::string& name) const {
  return path + ":" + (name.empty() || name[0] != '/' ? "/" : "") + printable(name);
}

Handle file_access() {
  Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);
  return access;
}

Handle text_type(size_t width, H5T_cset_t letters) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type, width);
  if (width != H5T_VARIABLE) H5Tset_strpad(type, H5T_STR_NULLPAD);
  H5Tset_cset(type, letters);
  return type;
}

std::string printable(const std::string& name) {
  std::string text = name.substr(0, 80);
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 32 || c == 127) c = '?';
  return text;
}

void throw_damaged(const std::string& where) {
  throw InputError(where, "is damaged", "copy or make the file again");
}

void throw_write_error(const std::string& path) {
  int code = 0;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, find_errno, &code);
  throw WorkError(path + ": could not be written (" +
                  (code == 0 ? "HDF5 failed" : std::strerror(code)) +
                  "); free some space and run it again");
}

bool is_wide_integer(hid_t type) {
  return is_one_of(type, {H5T_STD_I64LE, H5T_STD_I64BE, H5T_STD_U64LE, H5T_STD_U64BE, H5T_STD_U32LE,
                          H5T_STD_U32BE});
}

/// What h5py makes of truth values: an enumeration of 0 and 1 in one byte.
bool is_truth(hid_t type) {
  if (H5Tget_class(type) != H5T_ENUM || H5Tget_size(type) != 1 || H5Tget_nmembers(type) != 2)
    return false;
  const Handle base(H5Tget_super(type), H5Tclose);
  if (!is_one_of(base, {H5T_STD_I8LE, H5T_STD_U8LE})) return false;
  std::array<uint8_t, 2> values{};
  for (unsigned i = 0; i < 2; ++i)
    if (H5Tget_member_value(type, i, &values[i]) < 0) return false;
  return values == std::array<uint8_t, 2>{0, 1} || values == std::array<uint8_t, 2>{1, 0};
}

Type classify(hid_t type, const std::string& where) {
  const H5T_class_t kind = H5Tget_class(type);
  if (is_truth(type)) return Type::integer;
  if (kind == H5T_STRING) return Type::text;
  if (kind == H5T_FLOAT &&
      (is_one_of(type, {H5T_IEEE_F32LE, H5T_IEEE_F32BE, H5T_IEEE_F64LE, H5T_IEEE_F64BE}) ||
       H5Tequal(type, half_type()) > 0))
    return Type::floating;
  if (kind == H5T_INTEGER &&
      (is_wide_integer(type) ||
       is_one_of(type,
                 {H5T_STD_I8LE, H5T_STD_I8BE, H5T_STD_U8LE, H5T_STD_U8BE, H5T_STD_I16LE,
                  H5T_STD_I16BE, H5T_STD_U16LE, H5T_STD_U16BE, H5T_STD_I32LE, H5T_STD_I32BE})))
    return Type::integer;
  throw InputError(where, "holds neither plain numbers nor text",
                   "store float32, float64 or integers of 8 to 64 bits");
}

H5_index_t order_of(hid_t group) {
  const Handle creation(H5Gget_create_plist(group), H5Pclose);
  unsigned order = 0;
  H5Pget_link_creation_order(creation, &order);
  return (order & H5P_CRT_ORDER_INDEXED) ? H5_INDEX_CRT_ORDER : H5_INDEX_NAME;
}

bool link_exists(const File::State& state, const std::string& name) {
  if (name.empty() || name == "/") return true;
  for (size_t end = name.find('/', 1);; end = name.find('/', end + 1)) {
    const std::string part = name.substr(0, end);
    if (H5Lexists(state.id, part.c_str(), H5P_DEFAULT) <= 0) return false;
    H5L_info_t info;
    if (H5Lget_info(state.id, part.c_str(), &info, H5P_DEFAULT) < 0) return false;
    if (info.type == H5L_TYPE_EXTERNAL)
      throw InputError(state.where(part), "is a link into another file",
                       "copy it into one file with h5repack");
    if (end == std::string::npos) return H5Oexists_by_name(state.id, name.c_str(), H5P_DEFAULT) > 0;
  }
}

}  // namespace restage::h5
