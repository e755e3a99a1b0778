#include "datasets/hdf5/detail.h"

#include <cstdlib>
#include <cstring>

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

}  // namespace

Lock::Lock() : lock_(library_mutex()) { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

File::State::~State() {
  if (id < 0) return;
  const Lock lock;
  H5Fclose(id);
}

std::string File::State::where(const std::string& name) const {
  return path + ":" + (name.empty() || name[0] != '/' ? "/" : "") + printable(name);
}

std::string printable(const std::string& name) {
  std::string text = name.substr(0, 80);
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 32 || c == 127) c = '?';
  return text;
}

void throw_write_error(const std::string& path) {
  int code = 0;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, find_errno, &code);
  throw WorkError(path + ": could not be written (" +
                  (code == 0 ? "HDF5 failed" : std::strerror(code)) +
                  "); free some space and run it again");
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
