// NPY and NPZ files made by hand, right and wrong ones, and texts packed by xz.
#pragma once

#include <lzma.h>
#include <zlib.h>

#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace restage::test {

template <class T>
std::string raw(T value) {
  return std::string(reinterpret_cast<const char*>(&value), sizeof value);
}

inline std::string python_shape(const std::vector<int64_t>& shape) {
  std::string out = "(";
  for (const int64_t n : shape) out += std::to_string(n) + ", ";
  return out + ")";
}

/// An array file of any header and any bytes.
inline std::string npy_of(const std::string& header, const std::string& bytes, int version = 1) {
  const std::string text = header + "\n";
  std::string out = "\x93NUMPY";
  out += static_cast<char>(version);
  out += '\0';
  out += version == 1 ? raw(static_cast<uint16_t>(text.size()))
                      : raw(static_cast<uint32_t>(text.size()));
  return out + text + bytes;
}

inline std::string npy_header(const std::string& type, const std::vector<int64_t>& shape,
                              bool fortran = false) {
  return "{'descr': '" + type + "', 'fortran_order': " + (fortran ? "True" : "False") +
         ", 'shape': " + python_shape(shape) + ", }";
}

/// The same with numpy's name of the type, as "<f8".
inline std::string npy_as(const std::string& type, const std::vector<int64_t>& shape,
                          const std::string& bytes, int version = 1) {
  return npy_of(npy_header(type, shape), bytes, version);
}

inline const char* numpy_type(double) { return "<f8"; }
inline const char* numpy_type(float) { return "<f4"; }
inline const char* numpy_type(int64_t) { return "<i8"; }
inline const char* numpy_type(uint32_t) { return "<u4"; }

/// A little-endian array in C order.
template <class T>
std::string npy(const std::vector<int64_t>& shape, const std::vector<T>& values) {
  std::string bytes;
  for (const T value : values) bytes += raw(value);
  return npy_as(numpy_type(T{}), shape, bytes);
}

/// A text scalar, as numpy stores 'female'.
inline std::string npy_text(const std::string& text) {
  std::string bytes;
  for (const char c : text) bytes += raw(static_cast<uint32_t>(c));
  return npy_as("<U" + std::to_string(text.size()), {}, bytes);
}

struct ZipEntry {
  std::string name = "a.npy", bytes = "";
  bool deflate = false, zip64 = false, descriptor = false;
  std::optional<uint64_t> claimed_size = {};    ///< a lie, in both headers
  std::optional<uint64_t> directory_size = {};  ///< a lie, in the directory only
  std::optional<uint16_t> method = {};
  uint32_t wrong_crc = 0;  ///< flips bits of the checksum
  uint16_t flags = 0;
  bool same_place = false;  ///< its directory entry points at the member before
};

inline std::string deflated(const std::string& bytes) {
  z_stream state{};
  deflateInit2(&state, 9, Z_DEFLATED, -MAX_WBITS, 9, Z_DEFAULT_STRATEGY);
  std::string out(deflateBound(&state, bytes.size()), '\0');
  std::string in = bytes;
  state.next_in = reinterpret_cast<unsigned char*>(in.data());
  state.avail_in = static_cast<unsigned>(in.size());
  state.next_out = reinterpret_cast<unsigned char*>(out.data());
  state.avail_out = static_cast<unsigned>(out.size());
  deflate(&state, Z_FINISH);
  out.resize(state.total_out);
  deflateEnd(&state);
  return out;
}

/// xz's packing of a text, whose unpacking takes so many MiB.
inline std::string xz_of(const std::string& text, uint32_t mebibytes) {
  lzma_options_lzma options;
  lzma_lzma_preset(&options, 0);
  options.dict_size = mebibytes << 20;
  const lzma_filter filters[] = {{LZMA_FILTER_LZMA2, &options}, {LZMA_VLI_UNKNOWN, nullptr}};
  std::string out(lzma_stream_buffer_bound(text.size()), '\0');
  size_t size = 0;
  if (lzma_stream_buffer_encode(const_cast<lzma_filter*>(filters), LZMA_CHECK_CRC64, nullptr,
                                reinterpret_cast<const uint8_t*>(text.data()), text.size(),
                                reinterpret_cast<uint8_t*>(out.data()), &size,
                                out.size()) != LZMA_OK)
    throw std::runtime_error("xz packs nothing");
  return out.substr(0, size);
}

/// The archive; `comment` at its end.
inline std::string zip_of(const std::vector<ZipEntry>& entries, const std::string& comment = "") {
  std::string out, directory;
  bool zip64 = false;
  size_t before = 0;
  const auto u16 = [](uint64_t v) { return raw(static_cast<uint16_t>(v)); };
  const auto u32 = [](uint64_t v) { return raw(static_cast<uint32_t>(v)); };
  for (const ZipEntry& e : entries) {
    const std::string packed = e.deflate ? deflated(e.bytes) : e.bytes;
    const uint64_t size = e.claimed_size.value_or(e.bytes.size());
    const uint16_t method = e.method.value_or(e.deflate ? 8 : 0);
    const auto flags = static_cast<uint16_t>(e.flags | (e.descriptor ? 8 : 0));
    const uint32_t crc =
        static_cast<uint32_t>(crc32(0, reinterpret_cast<const unsigned char*>(e.bytes.data()),
                                    static_cast<unsigned>(e.bytes.size()))) ^
        e.wrong_crc;
    const size_t at = e.same_place ? before : out.size();
    before = at;
    if (!e.same_place) {
      const std::string extra =
          e.zip64 ? u16(1) + u16(16) + raw(size) + raw(uint64_t{packed.size()}) : "";
      const auto field = [&](uint64_t v) { return u32(e.zip64 ? 0xffffffff : v); };
      out += "PK\3\4" + u16(e.zip64 ? 45 : 20) + u16(flags) + u16(method) + u32(0) +
             u32(e.descriptor ? 0 : crc) +
             (e.descriptor ? u32(0) + u32(0) : field(packed.size()) + field(size)) +
             u16(e.name.size()) + u16(e.descriptor ? 0 : extra.size()) + e.name +
             (e.descriptor ? "" : extra) + packed;
      if (e.descriptor) out += "PK\7\10" + u32(crc) + u32(packed.size()) + u32(size);
    }
    const uint64_t told = e.directory_size.value_or(size);
    const std::string extra =
        e.zip64 ? u16(1) + u16(24) + raw(told) + raw(uint64_t{packed.size()}) + raw(uint64_t{at})
                : "";
    const auto field = [&](uint64_t v) { return u32(e.zip64 ? 0xffffffff : v); };
    directory += "PK\1\2" + u16(45) + u16(e.zip64 ? 45 : 20) + u16(flags) + u16(method) + u32(0) +
                 u32(crc) + field(packed.size()) + field(told) + u16(e.name.size()) +
                 u16(extra.size()) + u16(0) + u16(0) + u16(0) + u32(0) + field(at) + e.name + extra;
    zip64 = zip64 || e.zip64;
  }
  const uint64_t begin = out.size(), count = entries.size();
  out += directory;
  if (zip64) {
    const uint64_t record = out.size();
    out += "PK\6\6" + raw(uint64_t{44}) + u16(45) + u16(45) + u32(0) + u32(0) + raw(count) +
           raw(count) + raw(uint64_t{directory.size()}) + raw(begin);
    out += "PK\6\7" + u32(0) + raw(record) + u32(1);
  }
  const auto field = [&](uint64_t v) { return u32(zip64 ? 0xffffffff : v); };
  return out + "PK\5\6" + u16(0) + u16(0) + u16(zip64 ? 0xffff : count) +
         u16(zip64 ? 0xffff : count) + field(directory.size()) + field(begin) +
         u16(comment.size()) + comment;
}

/// An archive of arrays: names without ".npy".
inline std::string npz(const std::vector<std::pair<std::string, std::string>>& arrays,
                       bool deflate = true) {
  std::vector<ZipEntry> entries;
  for (const auto& [name, bytes] : arrays) entries.push_back({name + ".npy", bytes, deflate});
  return zip_of(entries);
}

}  // namespace restage::test
