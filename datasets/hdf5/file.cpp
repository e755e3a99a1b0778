#include "datasets/hdf5/file.h"

#include <hdf5.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <limits>
#include <type_traits>

#include "autograd/base/words.h"
#include "datasets/hdf5/detail.h"
#include "datasets/hdf5/probe.h"
#include "datasets/readers/byte_stream.h"
#include "datasets/readers/errors.h"

namespace restage::h5 {
namespace {

constexpr uint64_t kAlwaysAllowed = uint64_t{64} << 20;  // bytes that any data set may claim
constexpr uint64_t kMostCompression = 2000;  // gzip reaches 1032; beyond this, a claim is a lie
constexpr uint64_t kLargestChunk = uint64_t{256} << 20;
std::atomic<uint64_t> max_memory = uint64_t{16} << 30;

template <class T>
hid_t memory_type() {
  if constexpr (std::is_same_v<T, double>) return H5T_NATIVE_DOUBLE;
  if constexpr (std::is_same_v<T, float>) return H5T_NATIVE_FLOAT;
  if constexpr (std::is_same_v<T, int64_t>) return H5T_NATIVE_INT64;
  if constexpr (std::is_same_v<T, int32_t>) return H5T_NATIVE_INT32;
  if constexpr (std::is_same_v<T, int16_t>) return H5T_NATIVE_INT16;
  if constexpr (std::is_same_v<T, uint8_t>) return H5T_NATIVE_UINT8;
}

/// Only filters of our own files: others are rare, or plug-ins, or known to trip on damaged data.
void check_filters(hid_t properties, const std::string& where) {
  const int n = H5Pget_nfilters(properties);
  for (int i = 0; i < n; ++i) {
    unsigned flags = 0;
    size_t values = 0;
    const H5Z_filter_t filter = H5Pget_filter2(properties, static_cast<unsigned>(i), &flags,
                                               &values, nullptr, 0, nullptr, nullptr);
    if (filter != H5Z_FILTER_DEFLATE && filter != H5Z_FILTER_SHUFFLE &&
        filter != H5Z_FILTER_FLETCHER32)
      throw InputError(where, cat("is compressed by filter ", filter, ", which is not read here"),
                       "repack it with: h5repack -f GZIP=4 OLD NEW");
  }
}

void require_memory(uint64_t values, uint64_t value_size, const std::string& where,
                    const char* what) {
  const uint64_t most = max_memory;
  if (values <= most / value_size) return;
  throw InputError(where,
                   cat(what, " ", values, " values of ", value_size, " bytes, more than the ", most,
                       " bytes allowed"),
                   "allow more with {max-memory}");
}

/// `width`: bytes of a stored value.
void check_layout(hid_t properties, uint64_t width, const std::string& where) {
  const H5D_layout_t layout = H5Pget_layout(properties);
  if (H5Pget_external_count(properties) > 0 || layout == H5D_VIRTUAL || layout < 0)
    throw InputError(where, "keeps its values in another file",
                     "copy it into one file with h5repack");
  if (layout != H5D_CHUNKED) return;
  check_filters(properties, where);
  hsize_t chunk[H5S_MAX_RANK];
  const int rank = H5Pget_chunk(properties, H5S_MAX_RANK, chunk);
  double values = 1;
  for (int i = 0; i < rank; ++i) values *= static_cast<double>(chunk[i]);
  if (rank <= 0 || values <= 0 || 8 * values > static_cast<double>(kLargestChunk))
    throw InputError(where, "has chunks of impossible size",
                     "make the file again with smaller chunks");
  require_memory(static_cast<uint64_t>(values), width, where, "is stored in chunks of");
}

Shape extent_of(hid_t space, const std::string& where) {
  hsize_t dims[H5S_MAX_RANK];
  const int rank = H5Sget_simple_extent_type(space) == H5S_NULL
                       ? -1
                       : H5Sget_simple_extent_dims(space, dims, nullptr);
  if (rank < 0) throw InputError(where, "holds nothing", "store an array");
  Shape shape;
  double total = 8;
  for (int i = 0; i < rank; ++i) {
    // An axis of length 0 must not hide the others: products of any of them have to fit too.
    total *= static_cast<double>(std::max<hsize_t>(dims[i], 1));
    if (total > 4e18 || dims[i] > (hsize_t{1} << 60))
      throw InputError(where, "claims an impossible size", "make the file again");
    shape.push_back(static_cast<int64_t>(dims[i]));
  }
  return shape;
}

void check_probe(Probe probed, const std::string& path) {
  if (probed == Probe::damaged)
    throw InputError(path, "is an HDF5 file, but damaged, cut short or still being written",
                     "copy or make the file again");
  if (probed == Probe::memory)
    throw InputError(path,
                     cat("takes more than ", kProbeMemory >> 20,
                         " MiB to read, which no file of this kind needs"),
                     "make it again with smaller chunks (h5repack)");
  if (probed == Probe::time)
    throw InputError(path, "is an HDF5 file whose reading finds no end",
                     "copy or make the file again");
}

uint64_t file_size(const std::string& path) {
  struct stat info {};
  return ::stat(path.c_str(), &info) == 0 ? static_cast<uint64_t>(info.st_size) : 0;
}

int64_t product(const Shape& shape, size_t from = 0) {
  int64_t n = 1;
  for (size_t i = from; i < shape.size(); ++i) n *= shape[i];
  return n;
}

/// Selects rows [first, first + count) of a data set's space; the space of their values, which is
/// none (< 0) if that fails.
Handle select_rows(hid_t space, const Shape& shape, int64_t first, int64_t count) {
  std::vector<hsize_t> start(shape.size(), 0), size(shape.begin(), shape.end());
  start[0] = static_cast<hsize_t>(first);
  size[0] = static_cast<hsize_t>(count);
  const herr_t done =
      H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, size.data(), nullptr);
  const int axes = static_cast<int>(size.size());
  return {done < 0 ? -1 : H5Screate_simple(axes, size.data(), nullptr), H5Sclose};
}

}  // namespace

void set_max_memory(uint64_t bytes) { max_memory = bytes; }

std::string to_string(const Shape& shape) {
  return cat("[", joined(shape, [](int64_t n) { return n < 0 ? "*" : std::to_string(n); }), "]");
}

// ---- Dataset -----------------------------------------------------------------------------------

int64_t Dataset::row_size() const { return product(shape_, 1); }

size_t Dataset::value_size() const {
  const Lock lock;
  const Handle type(H5Dget_type(id_), H5Tclose);
  if (type < 0) throw_damaged(where_);
  return H5Tget_size(type);
}

void Dataset::check_memory(int64_t values, size_t value_size) const {
  require_memory(static_cast<uint64_t>(values), value_size, where_, "has to be read at once,");
}

void Dataset::read_raw(int64_t first, int64_t count, int64_t type, void* out) const {
  herr_t done = -1;
  if (shape_.empty()) {
    done = H5Dread(id_, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, out);
  } else {
    const Handle space(H5Dget_space(id_), H5Sclose),
        memory = select_rows(space, shape_, first, count);
    if (memory >= 0) done = H5Dread(id_, type, memory, space, H5P_DEFAULT, out);
  }
  if (done < 0) throw InputError(where_, "is damaged or cut short", "copy or make the file again");
}

template <class T>
void Dataset::read_rows(int64_t first, int64_t count, std::vector<T>& out) const {
  if (type_ == Type::text) throw InputError(where_, "holds text", "store numbers");
  if (std::is_integral_v<T> && type_ != Type::integer)
    throw InputError(where_, "holds fractions where integers are expected", "store integers");
  if (first < 0 || count < 0 || first > rows() || count > rows() - first)
    throw InputError(where_, cat("has ", rows(), " rows, row ", first + count, " was asked for"),
                     "make the file again");
  const int64_t values = count * row_size();
  const bool narrow = std::is_integral_v<T> && !std::is_same_v<T, int64_t> &&
                      (wide_ || !std::is_same_v<T, int32_t>);
  check_memory(values, narrow ? sizeof(int64_t) : sizeof(T));
  out.resize(values);
  if (values == 0) return;
  const Lock lock;
  if (!narrow) return read_raw(first, count, memory_type<T>(), out.data());
  if constexpr (std::is_integral_v<T>) {
    std::vector<int64_t> wide(out.size());
    read_raw(first, count, H5T_NATIVE_INT64, wide.data());
    for (size_t i = 0; i < wide.size(); ++i) {
      if (wide[i] < std::numeric_limits<T>::min() || wide[i] > std::numeric_limits<T>::max())
        throw InputError(where_, cat("holds ", wide[i], ", which is out of range"),
                         "correct the value");
      out[i] = static_cast<T>(wide[i]);
    }
  }
}

template <class T>
std::vector<T> Dataset::read() const {
  std::vector<T> out;
  read_rows(0, rows(), out);
  return out;
}

std::vector<std::string> Dataset::read_text() const {
  if (type_ != Type::text) throw InputError(where_, "holds no text", "store strings");
  const Lock lock;
  const Handle type(H5Dget_type(id_), H5Tclose);
  const size_t n = static_cast<size_t>(rows() * row_size());
  std::vector<std::string> out;
  if (H5Tis_variable_str(type) > 0) {
    check_memory(static_cast<int64_t>(n), sizeof(char*));
    std::vector<char*> raw(n, nullptr);
    const Handle memory = text_type(H5T_VARIABLE, H5Tget_cset(type));
    read_raw(0, rows(), memory, raw.data());
    for (char* item : raw) {
      out.emplace_back(item == nullptr ? "" : item);
      H5free_memory(item);
    }
    return out;
  }
  const size_t width = H5Tget_size(type);
  if (width == 0 || width > (size_t{1} << 20))
    throw InputError(where_, "holds strings of impossible length", "make the file again");
  check_memory(static_cast<int64_t>(n), width);
  std::vector<char> raw(n * width);
  read_raw(0, rows(), type, raw.data());
  for (size_t i = 0; i < n; ++i)
    out.emplace_back(raw.data() + i * width, ::strnlen(raw.data() + i * width, width));
  return out;
}

template <class T>
void Dataset::append(std::span<const T> values) {
  const Lock lock;
  const int64_t row = row_size(), count = row == 0 ? 0 : static_cast<int64_t>(values.size()) / row;
  if (count * row != static_cast<int64_t>(values.size()))
    throw ShapeError(cat(where_, ": ", values.size(), " values are no whole rows of ", row));
  const int64_t first = rows();
  truncate(first + count);
  if (values.empty()) return;
  const Handle space(H5Dget_space(id_), H5Sclose),
      memory = select_rows(space, shape_, first, count);
  if (memory < 0 || H5Dwrite(id_, memory_type<T>(), memory, space, H5P_DEFAULT, values.data()) < 0)
    throw_write_error(path_);
}

void Dataset::truncate(int64_t rows) {
  const Lock lock;
  std::vector<hsize_t> size(shape_.begin(), shape_.end());
  size[0] = static_cast<hsize_t>(rows);
  if (H5Dset_extent(id_, size.data()) < 0) throw_write_error(path_);
  shape_[0] = rows;
}

// ---- File --------------------------------------------------------------------------------------

File::File(std::unique_ptr<State> state) : state_(std::move(state)) {}
File::File(File&&) noexcept = default;
File& File::operator=(File&&) noexcept = default;
File::~File() = default;
const std::string& File::path() const { return state_->path; }

File File::open(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0)
    throw InputError(path, cat("cannot be read (", std::strerror(errno), ")"), "check the path");
  if (!S_ISREG(info.st_mode)) throw InputError(path, "is not a file", "give an HDF5 file");
  const Lock lock;
  auto state = std::make_unique<State>();
  state->path = path;
  const Handle access = file_access();
  if (H5Fis_hdf5(path.c_str()) <= 0)
    throw InputError(path, "is not an HDF5 file", "give an HDF5 file (.h5)");
  check_probe(probe(path), path);
  state->id = Handle(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access), locked<H5Fclose>);
  if (state->id < 0) check_probe(Probe::damaged, path);
  return File(std::move(state));
}

File File::create(const std::string& path) {
  const Lock lock;
  auto state = std::make_unique<State>();
  state->path = path;
  state->target = std::make_unique<AtomicFile>(path);
  const Handle access = file_access();
  // The newest layout has checksums over its structure too; no times, so equal content is equal
  // bytes.
  H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110);
  const Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
  H5Pset_link_creation_order(creation, H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED);
  H5Pset_obj_track_times(creation, false);
  state->id = Handle(H5Fcreate(state->target->path().c_str(), H5F_ACC_TRUNC, creation, access),
                     locked<H5Fclose>);
  if (state->id < 0) throw_write_error(path);
  return File(std::move(state));
}

void File::commit() {
  const Lock lock;
  if (H5Fflush(state_->id, H5F_SCOPE_GLOBAL) < 0) throw_write_error(state_->path);
  if (H5Fclose(state_->id.release()) < 0) throw_write_error(state_->path);
  state_->target->commit();
}

bool File::has(const std::string& name) const {
  const Lock lock;
  return link_exists(*state_, name);
}

bool File::is_group(const std::string& name) const {
  const Lock lock;
  H5O_info_t info;
  return link_exists(*state_, name) &&
         H5Oget_info_by_name(state_->id, name.c_str(), &info, H5P_DEFAULT) >= 0 &&
         info.type == H5O_TYPE_GROUP;
}

Dataset File::dataset(const std::string& name) const {
  const Lock lock;
  Dataset set;
  set.where_ = state_->where(name);
  set.path_ = state_->path;
  if (!link_exists(*state_, name))
    throw InputError(set.where_, "is missing", "give a file that has it");
  const Handle access(H5Pcreate(H5P_DATASET_ACCESS), H5Pclose);
  H5Pset_chunk_cache(access, 521, size_t{32} << 20,
                     1.0);  // streaming must not unpack a chunk twice
  set.id_ = Handle(H5Dopen2(state_->id, name.c_str(), access), locked<H5Dclose>);
  if (set.id_ < 0)
    throw InputError(set.where_, "is no data set or damaged",
                     "give a file of the documented schema");
  const Handle type(H5Dget_type(set.id_), H5Tclose), space(H5Dget_space(set.id_), H5Sclose),
      creation(H5Dget_create_plist(set.id_), H5Pclose);
  if (type < 0 || space < 0 || creation < 0) throw_damaged(set.where_);
  set.type_ = classify(type, set.where_);
  set.wide_ = set.type_ == Type::integer && is_wide_integer(type);
  set.shape_ = extent_of(space, set.where_);
  check_layout(creation, std::max<uint64_t>(H5Tget_size(type), 1), set.where_);
  const auto stored = std::min<uint64_t>(H5Dget_storage_size(set.id_), file_size(state_->path));
  const uint64_t claimed = static_cast<uint64_t>(product(set.shape_)) * H5Tget_size(type);
  if (claimed > kAlwaysAllowed && claimed / kMostCompression > stored)
    throw InputError(set.where_, cat("claims ", claimed, " bytes, far more than the file stores"),
                     "make the file again");
  return set;
}

Dataset File::dataset(const std::string& name, const Shape& wanted) const {
  Dataset set = dataset(name);
  bool fits = set.shape().size() == wanted.size();
  for (size_t i = 0; fits && i < wanted.size(); ++i)
    fits = wanted[i] < 0 || wanted[i] == set.shape()[i];
  if (!fits)
    throw InputError(set.where(),
                     "is shaped " + to_string(set.shape()) + " instead of " + to_string(wanted),
                     "store it as documented (datasets/README.md)");
  return set;
}

void File::create_group(const std::string& name) {
  const Lock lock;
  const Handle creation(H5Pcreate(H5P_GROUP_CREATE), H5Pclose);
  H5Pset_link_creation_order(creation, H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED);
  H5Pset_obj_track_times(creation, false);
  for (size_t end = name.find('/', 1);; end = name.find('/', end + 1)) {
    const std::string part = name.substr(0, end);
    if (!part.empty() && !link_exists(*state_, part)) {
      const Handle group(H5Gcreate2(state_->id, part.c_str(), H5P_DEFAULT, creation, H5P_DEFAULT),
                         H5Gclose);
      if (group < 0) throw_write_error(state_->path);
    }
    if (end == std::string::npos) return;
  }
}

Handle File::make_dataset(const std::string& name, const Shape& shape, int64_t type, bool grows) {
  const size_t slash = name.rfind('/');
  if (slash != std::string::npos && slash > 0) create_group(name.substr(0, slash));
  std::vector<hsize_t> dims(shape.begin(), shape.end()), most = dims, chunk = dims;
  const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_obj_track_times(creation, false);
  if (!dims.empty()) {
    if (grows) most[0] = H5S_UNLIMITED;
    // About half a megabyte: small enough to stream, large enough to compress well.
    const uint64_t row =
        static_cast<uint64_t>(std::max<int64_t>(product(shape, 1), 1)) * H5Tget_size(type);
    const uint64_t rows = std::max<uint64_t>(1, (uint64_t{512} << 10) / row);
    chunk[0] = grows ? rows : std::min<uint64_t>(rows, std::max<hsize_t>(dims[0], 1));
    for (hsize_t& n : chunk) n = std::max<hsize_t>(n, 1);
    H5Pset_chunk(creation, static_cast<int>(chunk.size()), chunk.data());
    H5Pset_shuffle(creation);
    H5Pset_deflate(creation, 3);
    H5Pset_fletcher32(creation);
  }
  const Handle space(
      dims.empty() ? H5Screate(H5S_SCALAR)
                   : H5Screate_simple(static_cast<int>(dims.size()), dims.data(), most.data()),
      H5Sclose);
  Handle id(H5Dcreate2(state_->id, name.c_str(), type, space, H5P_DEFAULT, creation, H5P_DEFAULT),
            locked<H5Dclose>);
  if (id < 0) throw_write_error(state_->path);
  return id;
}

template <class T>
void File::write(const std::string& name, const Shape& shape, std::span<const T> values) {
  if (product(shape) != static_cast<int64_t>(values.size()))
    throw ShapeError(
        cat(state_->where(name), ": ", values.size(), " values for shape ", to_string(shape)));
  const Lock lock;
  const Handle id = make_dataset(name, shape, memory_type<T>(), false);
  if (values.empty()) return;
  if (H5Dwrite(id, memory_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
    throw_write_error(state_->path);
}

void File::write_text(const std::string& name, const std::vector<std::string>& values) {
  size_t width = 1;
  for (const std::string& value : values) width = std::max(width, value.size());
  std::string rows;
  for (const std::string& value : values)
    rows += cat(value, std::string(width - value.size(), '\0'));
  const Lock lock;
  const Handle type = text_type(width, H5T_CSET_UTF8);
  const Handle id = make_dataset(name, {static_cast<int64_t>(values.size())}, type, false);
  if (!values.empty() && H5Dwrite(id, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, rows.data()) < 0)
    throw_write_error(state_->path);
}

template <class T>
Dataset File::create_appendable(const std::string& name, const Shape& row) {
  const Lock lock;
  Dataset set;
  set.shape_ = row;
  set.shape_.insert(set.shape_.begin(), 0);
  set.where_ = state_->where(name);
  set.path_ = state_->path;
  set.type_ = std::is_integral_v<T> ? Type::integer : Type::floating;
  set.id_ = make_dataset(name, set.shape_, memory_type<T>(), true);
  return set;
}

#define RESTAGE_H5_TYPE(T)                                                            \
  template std::vector<T> Dataset::read<T>() const;                                   \
  template void Dataset::read_rows<T>(int64_t, int64_t, std::vector<T>&) const;       \
  template void Dataset::append<T>(std::span<const T>);                               \
  template void File::write<T>(const std::string&, const Shape&, std::span<const T>); \
  template Dataset File::create_appendable<T>(const std::string&, const Shape&);
RESTAGE_H5_TYPE(double)
RESTAGE_H5_TYPE(float)
RESTAGE_H5_TYPE(int64_t)
RESTAGE_H5_TYPE(int32_t)
RESTAGE_H5_TYPE(int16_t)
RESTAGE_H5_TYPE(uint8_t)
#undef RESTAGE_H5_TYPE

}  // namespace restage::h5
