// Protobuf messages written field by field, and the checksums of files that hold them. The few
// messages of TensorBoard's and of Weights & Biases' files need no library.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace restage {

/// One protobuf message, field by field.
class Message {
 public:
  Message& number(int field, uint64_t value) {
    varint(static_cast<uint64_t>(field) << 3);
    varint(value);
    return *this;
  }
  Message& real(int field, double value) {
    varint((static_cast<uint64_t>(field) << 3) | 1);
    return raw(value);
  }
  Message& single(int field, float value) {
    varint((static_cast<uint64_t>(field) << 3) | 5);
    return raw(value);
  }
  Message& bytes(int field, std::string_view value) {
    varint((static_cast<uint64_t>(field) << 3) | 2);
    varint(value.size());
    out_ += value;
    return *this;
  }
  Message& message(int field, const Message& inner) { return bytes(field, inner.text()); }
  Message& reals(int field, const std::vector<double>& values) {  // packed
    return bytes(field,
                 {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double)});
  }
  const std::string& text() const { return out_; }

 private:
  void varint(uint64_t value) {
    for (; value >= 0x80; value >>= 7) out_ += static_cast<char>((value & 0x7f) | 0x80);
    out_ += static_cast<char>(value);
  }
  template <class T>
  Message& raw(T value) {
    static_assert(std::endian::native == std::endian::little);
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    out_.append(bytes, sizeof value);
    return *this;
  }
  std::string out_;
};

/// The bytes of a number as they lie in a file, the least first.
template <class T>
std::string as_bytes(T value) {
  static_assert(std::endian::native == std::endian::little);
  std::string out(sizeof value, '\0');
  std::memcpy(out.data(), &value, sizeof value);
  return out;
}

/// A CRC of 32 bits by its reversed polynomial.
class CheckSum {
 public:
  explicit CheckSum(uint32_t polynomial) {
    for (uint32_t i = 0; i < 256; ++i) {
      uint32_t x = i;
      for (int bit = 0; bit < 8; ++bit) x = (x >> 1) ^ (x & 1 ? polynomial : 0);
      table_[i] = x;
    }
  }
  uint32_t of(std::string_view bytes) const {
    uint32_t crc = ~0u;
    for (const char c : bytes) crc = (crc >> 8) ^ table_[(crc ^ static_cast<uint8_t>(c)) & 0xff];
    return ~crc;
  }

 private:
  std::array<uint32_t, 256> table_{};
};

}  // namespace restage
