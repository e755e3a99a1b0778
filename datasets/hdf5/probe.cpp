#include "datasets/hdf5/probe.h"

#include <fcntl.h>
#include <hdf5.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include "datasets/hdf5/detail.h"

// The child is a copy of a process that may have threads: only plain library calls here, no
// exceptions, no output.

namespace restage::h5 {
namespace {

constexpr rlim_t kCpuSeconds = 10;  // a damaged file can also make the library loop for ever
constexpr unsigned kWallSeconds = 120;
constexpr hsize_t kReadWhole = hsize_t{64} << 20;   // bytes; larger data sets: first and last row
constexpr hsize_t kReadInAll = hsize_t{256} << 20;  // after that, the ends only

hsize_t bytes_read = 0;  // by this child

/// Version of the superblock, which may stand at 0, 512, 1024, ...; -1 if there is none.
int superblock_version(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return -1;
  int version = -1;
  for (off_t at = 0; version < 0 && at < (off_t{1} << 40); at = at == 0 ? 512 : at * 2) {
    unsigned char head[9];
    if (::pread(fd, head, sizeof head, at) != static_cast<ssize_t>(sizeof head)) break;
    if (std::memcmp(head, "\x89HDF\r\n\x1a\n", 8) == 0) version = head[8];
  }
  ::close(fd);
  return version;
}

/// Reads the selection of `count` rows from `first` into memory that is thrown away.
void read_rows(hid_t set, hid_t type, int rank, const hsize_t* dims, hsize_t first, hsize_t count) {
  hsize_t start[H5S_MAX_RANK] = {}, size[H5S_MAX_RANK];
  hsize_t bytes = H5Tget_size(type);
  for (int i = 0; i < rank; ++i) {
    size[i] = i == 0 ? count : dims[i];
    if (size[i] == 0 || bytes > kReadWhole / size[i]) return;
    bytes *= size[i];
  }
  if (rank > 0) start[0] = first;
  bytes_read += bytes;
  void* out = std::malloc(static_cast<size_t>(bytes));
  const hid_t space = H5Dget_space(set);
  const hid_t memory = rank > 0 ? H5Screate_simple(rank, size, nullptr) : H5Screate(H5S_SCALAR);
  if (rank > 0) H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, size, nullptr);
  if (out != nullptr) H5Dread(set, type, memory, space, H5P_DEFAULT, out);
  std::free(out);
}

void read_dataset(hid_t set) {
  const hid_t type = H5Dget_type(set), space = H5Dget_space(set),
              creation = H5Dget_create_plist(set);
  hsize_t dims[H5S_MAX_RANK] = {};
  const int rank = H5Sget_simple_extent_dims(space, dims, nullptr);
  if (type < 0 || rank < 0 || H5Pget_external_count(creation) > 0) return;
  H5Dget_storage_size(set);  // walks the whole index of chunks
  hsize_t bytes = H5Tget_size(type);
  bool whole = bytes > 0;
  for (int i = 0; i < rank; ++i) {
    whole = whole && (dims[i] == 0 || bytes <= kReadWhole / dims[i]);
    bytes *= dims[i];
  }
  if (whole && bytes_read < kReadInAll)
    return read_rows(set, type, rank, dims, 0, rank > 0 ? dims[0] : 1);
  if (rank == 0 || dims[0] == 0) return;
  read_rows(set, type, rank, dims, 0, 1);
  read_rows(set, type, rank, dims, dims[0] - 1, 1);
}

herr_t read_attribute(hid_t object, const char* name, const H5A_info_t*, void*) {
  const hid_t id = H5Aopen(object, name, H5P_DEFAULT), type = H5Aget_type(id),
              space = H5Aget_space(id);
  const hssize_t values = H5Sget_simple_extent_npoints(space);
  const size_t width = type < 0 ? 0 : H5Tget_size(type);
  if (values <= 0 || width == 0 || static_cast<hsize_t>(values) > kReadWhole / width) return 0;
  void* out = std::malloc(static_cast<size_t>(values) * width);
  if (out != nullptr) H5Aread(id, type, out);
  std::free(out);
  return 0;
}

herr_t read_object(hid_t root, const char* name, const H5O_info_t*, void*) {
  const hid_t object = H5Oopen(root, name, H5P_DEFAULT);
  if (object < 0) return 0;
  H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_NATIVE, nullptr, read_attribute, nullptr);
  if (H5Iget_type(object) == H5I_DATASET) read_dataset(object);
  H5Oclose(object);
  return 0;
}

[[noreturn]] void child(const char* path) {
  const int nowhere = ::open("/dev/null", O_WRONLY);
  if (nowhere >= 0) ::dup2(nowhere, STDERR_FILENO);
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGABRT, SIGALRM, SIGILL})
    std::signal(signal, SIG_DFL);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  const rlimit cpu{kCpuSeconds, kCpuSeconds};
  ::setrlimit(RLIMIT_CPU, &cpu);
  ::alarm(kWallSeconds);
  const hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
  if (file >= 0) H5Ovisit(file, H5_INDEX_NAME, H5_ITER_NATIVE, read_object, nullptr);
  ::_exit(0);  // an error that the library reports is no crash: the parent will see it too
}

}  // namespace

bool survives_reading(const std::string& path) {
  const int version = superblock_version(path);
  if (version < 0 || version >= 3) return true;
  const pid_t pid = ::fork();
  if (pid < 0) return true;  // no process to spare: read it unprobed
  if (pid == 0) child(path.c_str());
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0)
    if (errno != EINTR) return true;
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace restage::h5
