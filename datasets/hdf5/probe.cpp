#include "datasets/hdf5/probe.h"

#include <hdf5.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <ctime>
#include <set>

#include "autograd/base/child_process.h"
#include "datasets/hdf5/detail.h"

namespace restage::h5 {
namespace {

// A damaged file can also make the library loop for ever. Of processor time, with as much again for
// every 100 MB of the file.
constexpr unsigned kCpuSeconds = 10;
constexpr const char *kShortOfMemory = "short of memory", *kDamaged = "damaged";  // answers
constexpr hsize_t kReadWhole = hsize_t{64} << 20;  // bytes; larger data sets: first and last row
constexpr hsize_t kReadInAll = hsize_t{256}
                               << 20;  // of values unpacked; after that, structure only

hsize_t bytes_read = 0;  // by this child

bool short_of_memory = false, damaged = false;

herr_t find_shortage(unsigned, const H5E_error2_t* entry, void*) {
  short_of_memory =
      short_of_memory || (entry->maj_num == H5E_RESOURCE &&
                          (entry->min_num == H5E_NOSPACE || entry->min_num == H5E_CANTALLOC));
  return 0;
}

/// Notes whether a call failed for want of memory; the next call forgets why this one failed.
template <class Result>
Result tried(Result result) {
  if (result < 0) H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, find_shortage, nullptr);
  return result;
}

/// For what must not fail in any sound file, whatever is in it.
template <class Result>
Result needed(Result result) {
  damaged = damaged || result < 0;
  return tried(result);
}

/// Memory for values that nobody looks at.
void* take(hsize_t bytes) {
  void* out = std::malloc(static_cast<size_t>(bytes));
  short_of_memory = short_of_memory || out == nullptr;
  return out;
}

/// Reads the selection of `count` rows from `first` into memory that is thrown away. At least a
/// whole `chunk` (bytes) is unpacked for it.
void read_rows(hid_t set, hid_t type, int rank, const hsize_t* dims, hsize_t chunk, hsize_t first,
               hsize_t count) {
  hsize_t start[H5S_MAX_RANK] = {}, size[H5S_MAX_RANK];
  hsize_t bytes = H5Tget_size(type);
  for (int i = 0; i < rank; ++i) {
    size[i] = i == 0 ? count : dims[i];
    if (size[i] == 0 || bytes > kReadWhole / size[i]) return;
    bytes *= size[i];
  }
  if (rank > 0) start[0] = first;
  bytes_read += std::max(bytes, chunk);
  void* out = take(bytes);
  const Handle space(H5Dget_space(set), H5Sclose);
  const Handle memory(rank > 0 ? H5Screate_simple(rank, size, nullptr) : H5Screate(H5S_SCALAR),
                      H5Sclose);
  if (rank > 0) H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, size, nullptr);
  if (out != nullptr) tried(H5Dread(set, type, memory, space, H5P_DEFAULT, out));
  std::free(out);
}

/// Bytes of a chunk, unpacked; 0: not stored in chunks.
hsize_t chunk_bytes(hid_t creation, size_t width) {
  hsize_t chunk[H5S_MAX_RANK];
  const int rank =
      H5Pget_layout(creation) == H5D_CHUNKED ? H5Pget_chunk(creation, H5S_MAX_RANK, chunk) : 0;
  if (rank <= 0) return 0;
  double bytes = static_cast<double>(width);
  for (int i = 0; i < rank; ++i) bytes *= static_cast<double>(chunk[i]);
  return static_cast<hsize_t>(std::min(bytes, 1e15));
}

void read_dataset(hid_t set) {
  const Handle type(H5Dget_type(set), H5Tclose), space(H5Dget_space(set), H5Sclose),
      creation(H5Dget_create_plist(set), H5Pclose);
  hsize_t dims[H5S_MAX_RANK] = {};
  const int rank = H5Sget_simple_extent_dims(space, dims, nullptr);
  if (type < 0 || rank < 0 || H5Pget_external_count(creation) > 0 ||
      H5Pget_layout(creation) == H5D_VIRTUAL)
    return;                  // values of other files are never read
  H5Dget_storage_size(set);  // walks the whole index of chunks
  if (bytes_read > kReadInAll) return;
  hsize_t bytes = H5Tget_size(type);
  const hsize_t chunk = chunk_bytes(creation, bytes);
  bool whole = bytes > 0;
  for (int i = 0; i < rank; ++i) {
    whole = whole && (dims[i] == 0 || bytes <= kReadWhole / dims[i]);
    bytes *= dims[i];
  }
  if (whole) return read_rows(set, type, rank, dims, chunk, 0, rank > 0 ? dims[0] : 1);
  if (rank == 0 || dims[0] == 0) return;
  read_rows(set, type, rank, dims, chunk, 0, 1);
  read_rows(set, type, rank, dims, chunk, dims[0] - 1, 1);
}

herr_t read_attribute(hid_t object, const char* name, const H5A_info_t*, void*) {
  const Handle id(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  const Handle type(H5Aget_type(id), H5Tclose), space(H5Aget_space(id), H5Sclose);
  const hssize_t values = H5Sget_simple_extent_npoints(space);
  const size_t width = type < 0 ? 0 : H5Tget_size(type);
  if (values <= 0 || width == 0 || static_cast<hsize_t>(values) > kReadWhole / width) return 0;
  void* out = take(static_cast<hsize_t>(values) * width);
  if (out != nullptr) tried(H5Aread(id, type, out));
  std::free(out);
  return 0;
}

herr_t pass_by(hid_t, const char*, const H5L_info_t*, void*) { return 0; }

herr_t read_object(hid_t root, const char* name, const H5O_info_t*, void*) {
  const Handle object(needed(H5Oopen(root, name, H5P_DEFAULT)), H5Oclose);
  if (object < 0) return 0;
  needed(H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_NATIVE, nullptr, read_attribute, nullptr));
  if (H5Iget_type(object) == H5I_DATASET) read_dataset(object);
  if (H5Iget_type(object) == H5I_GROUP)
    needed(H5Literate(object, order_of(object), H5_ITER_INC, nullptr, pass_by, nullptr));
  return 0;
}

/// The work of the child.
std::string walk(const std::string& path) {
  const hid_t file = needed(H5Fopen(path.c_str(), H5F_ACC_RDONLY, file_access()));
  if (file >= 0) needed(H5Ovisit(file, H5_INDEX_NAME, H5_ITER_NATIVE, read_object, nullptr));
  // Values that could not be read stop nothing: the parent gets the same answer, if it asks.
  return short_of_memory ? kShortOfMemory : damaged ? kDamaged : "";
}

Probe outcome(const ChildResult& child) {
  using enum ChildResult::End;
  if (child.end == no_end) return Probe::time;
  if (child.end == no_memory || child.answer == kShortOfMemory) return Probe::memory;
  return child.end == answered && child.answer.empty() ? Probe::good : Probe::damaged;
}

/// What tells one state of a file from another.
using Identity = std::array<int64_t, 7>;

Identity identity_of(const std::string& path) {
  struct stat s {};
  if (::stat(path.c_str(), &s) != 0) return {};
  return {static_cast<int64_t>(s.st_dev),
          static_cast<int64_t>(s.st_ino),
          s.st_size,
          s.st_mtim.tv_sec,
          s.st_mtim.tv_nsec,
          s.st_ctim.tv_sec,
          s.st_ctim.tv_nsec};
}

}  // namespace

Probe probe(const std::string& path) {
  static std::set<Identity> passed;  // guarded by the Lock
  const Identity identity = identity_of(path);
  if (passed.count(identity) != 0) return Probe::good;
  const unsigned seconds = kCpuSeconds * static_cast<unsigned>(1 + identity[2] / 100'000'000);
  const Probe out = outcome(in_a_child({kProbeMemory, seconds}, path, [&] { return walk(path); }));
  // Of a file that changed just now, a further change may not show in its times.
  constexpr int64_t kSettled = 5;  // seconds
  if (out == Probe::good && std::time(nullptr) - identity[5] > kSettled) passed.insert(identity);
  return out;
}

}  // namespace restage::h5
