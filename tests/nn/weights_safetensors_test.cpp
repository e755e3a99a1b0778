// The safetensors reader and writer: round trips, foreign dtypes, and damage of every kind.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "autograd/base/atomic_file.h"
#include "nn/weights/safetensors.h"
#include "tests/support/files.h"

namespace restage {
namespace {

std::string with_header(const std::string& head, const std::string& data) {
  const uint64_t n = head.size();
  return std::string(reinterpret_cast<const char*>(&n), 8) + head + data;
}

TensorFile sample() {
  TensorFile f;
  f.tensors["b"] = Tensor::from<double>({2, 2}, {1, 2, 3, 4e300});
  f.tensors["a.weight"] = Tensor::from<float>({3}, {1.5F, -2, 0});
  f.tensors["empty"] = Tensor::zeros({0, 4});
  f.tensors["index"] = Tensor::from<int64_t>({1}, {int64_t{1} << 40});
  f.tensors["small"] = Tensor::from<int32_t>({1, 1}, {-7});
  f.metadata["note"] = "line\n\"quoted\"";
  return f;
}

void expect_bad(const std::string& bytes, const std::string& part) {
  test::expect_refused([&] { parse_safetensors(bytes, "w.safetensors"); }, "w.safetensors: ", part);
}

TEST(WeightsSafetensors, RoundTripKeepsEverything) {
  const TensorFile f = sample();
  const std::string bytes = safetensors_bytes(f);
  const TensorFile g = parse_safetensors(bytes, "x");
  ASSERT_EQ(g.tensors.size(), f.tensors.size());
  for (const auto& [name, t] : f.tensors) {
    const Tensor& u = g.at(name, "x");
    EXPECT_EQ(u.dtype(), t.dtype()) << name;
    EXPECT_TRUE(u.shape() == t.shape()) << name;
    for (int64_t i = 0; i < t.numel(); ++i) EXPECT_EQ(u.item(i), t.item(i)) << name;
  }
  EXPECT_EQ(g.metadata, f.metadata);
  EXPECT_EQ(safetensors_bytes(g), bytes);
  uint64_t header = 0;
  std::memcpy(&header, bytes.data(), 8);
  EXPECT_EQ(header % 8, 0u);
}

TEST(WeightsSafetensors, FilesAreReadAndWritten) {
  const test::TempDir dir;
  const std::string path = dir / "w.safetensors";
  write_safetensors(path, sample());
  EXPECT_EQ(read_file(path), safetensors_bytes(sample()));
  EXPECT_EQ(read_safetensors(path).tensors.size(), 5u);
  std::filesystem::remove(path);
  EXPECT_THROW(read_safetensors(path), InputError);
}

TEST(WeightsSafetensors, HalfPrecisionsBecomeFloat32) {
  const uint16_t half[] = {0x3c00, 0xc000, 0x7bff, 0x0001, 0x8000, 0x7c00, 0x3555};
  const uint16_t brain[] = {0x3f80, 0xc000};
  std::string data(reinterpret_cast<const char*>(half), sizeof half);
  data.append(reinterpret_cast<const char*>(brain), sizeof brain);
  const TensorFile f =
      parse_safetensors(with_header(R"({"h":{"dtype":"F16","shape":[7],"data_offsets":[0,14]},)"
                                    R"("b":{"dtype":"BF16","shape":[2],"data_offsets":[14,18]}})",
                                    data),
                        "x");
  const double want[] = {1, -2, 65504, std::ldexp(1.0, -24), 0, INFINITY, 0.333251953125};
  for (int64_t i = 0; i < 7; ++i) EXPECT_EQ(f.at("h", "x").item(i), want[i]) << i;
  EXPECT_EQ(f.at("b", "x").dtype(), DType::f32);
  EXPECT_EQ(f.at("b", "x").item(0), 1);
  EXPECT_EQ(f.at("b", "x").item(1), -2);
}

TEST(WeightsSafetensors, ScalarsHaveNoAxes) {
  const TensorFile f =
      parse_safetensors(with_header(R"({"s":{"dtype":"F32","shape":[],"data_offsets":[0,4]}})",
                                    std::string("\0\0\x80\x3f", 4)),
                        "x");
  EXPECT_EQ(f.at("s", "x").rank(), 0);
  EXPECT_EQ(f.at("s", "x").item(), 1);
}

TEST(WeightsSafetensors, DamagedHeadersAreNamed) {
  const std::string four(4, '\0');
  const auto tensor = [](const std::string& body) {
    return with_header("{\"t\":{" + body + "}}", std::string(8, '\0'));
  };
  expect_bad("", "too short");
  expect_bad("1234567", "too short");
  expect_bad(std::string(8, '\xff') + "{}", "cut off");
  expect_bad(with_header("[]", ""), "no JSON object");
  expect_bad(with_header("{\"t\":", ""), "not JSON");
  expect_bad(with_header("{\"t\":\"\xff\"}", ""), "not JSON");
  expect_bad(with_header(R"({"__metadata__":3})", ""), "no JSON object");
  expect_bad(with_header(R"({"__metadata__":{"a":3}})", ""), "no text");
  expect_bad(with_header(R"({"t":3})", ""), "lacks dtype");
  expect_bad(tensor(R"("dtype":"F8","shape":[2],"data_offsets":[0,8])"), "unknown dtype");
  expect_bad(tensor(R"("dtype":7,"shape":[2],"data_offsets":[0,8])"), "unknown dtype");
  expect_bad(tensor(R"("dtype":"F32","shape":[-2],"data_offsets":[0,8])"), "whole number");
  expect_bad(tensor(R"("dtype":"F32","shape":[2.5],"data_offsets":[0,8])"), "whole number");
  expect_bad(tensor(R"("dtype":"F32","shape":[1,1,1,1,1,1,2],"data_offsets":[0,8])"), "axes");
  expect_bad(tensor(R"("dtype":"F32","shape":2,"data_offsets":[0,8])"), "axes");
  expect_bad(tensor(R"("dtype":"F32","shape":[2],"data_offsets":[0])"), "pair");
  expect_bad(tensor(R"("dtype":"F32","shape":[2],"data_offsets":[0,16])"), "beyond the end");
  expect_bad(tensor(R"("dtype":"F32","shape":[2],"data_offsets":[8,0])"), "beyond the end");
  expect_bad(tensor(R"("dtype":"F32","shape":[3],"data_offsets":[0,8])"), "do not fit");
  expect_bad(tensor(R"("dtype":"F32","shape":[4611686018427387904,4],"data_offsets":[0,0])"),
             "impossible shape");
  expect_bad(tensor(R"("dtype":"F32","shape":[4294967296,4294967296],"data_offsets":[0,0])"),
             "impossible shape");
  expect_bad(tensor(R"("dtype":"F32","shape":[0,4294967296,4294967296],"data_offsets":[0,0])"),
             "impossible shape");
  expect_bad(tensor(R"("dtype":"F32","shape":[18446744073709551615],"data_offsets":[0,0])"),
             "whole number");
  expect_bad(tensor(R"("dtype":"F32","shape":[1],"data_offsets":[4,8])"), "gap");
  expect_bad(tensor(R"("dtype":"F32","shape":[1],"data_offsets":[0,4])"), "4 bytes more");
}

TEST(WeightsSafetensors, OverlapsDoublesAndDepthAreRefused) {
  const std::string one = R"({"dtype":"F32","shape":[1],"data_offsets":[0,4]})";
  expect_bad(with_header("{\"a\":" + one + ",\"b\":" + one + "}", std::string(4, '\0')),
             "overlaps");
  expect_bad(with_header("{\"a\":" + one + ",\"a\":" + one + "}", std::string(4, '\0')), "twice");
  std::string deep = "{\"a\":";
  for (int i = 0; i < 100000; ++i) deep += "[";
  expect_bad(with_header(deep, ""), "deeply");
}

/// What the format's audits and fuzzers found in other readers.
TEST(WeightsSafetensors, KnownAttacksAreRefused) {
  const std::string one = R"({"dtype":"F32","shape":[1],"data_offsets":[0,4]})", data(4, '\0');
  const auto range = [](int begin, int end) {
    return R"({"dtype":"F32","shape":[)" + std::to_string((end - begin) / 4) +
           R"(],"data_offsets":[)" + std::to_string(begin) + "," + std::to_string(end) + "]}";
  };
  // A length of the header beyond the file, beyond the limit, and nothing of it allocated.
  for (const uint64_t length : {uint64_t{3}, uint64_t{1} << 40, ~uint64_t{0}, ~uint64_t{0} - 7}) {
    std::string bytes(10, '{');
    std::memcpy(bytes.data(), &length, 8);
    expect_bad(bytes, "cut off");
  }
  std::string long_header = "{\"a\":" + one + "}";
  long_header.resize(100'000'001, ' ');
  expect_bad(with_header(long_header, data), "cut off");
  // Keys once, of the header and within a tensor or the metadata.
  expect_bad(with_header(R"({"__metadata__":{},"__metadata__":{}})", ""), "twice");
  expect_bad(with_header(R"({"__metadata__":{"a":"b","a":"c"}})", ""), "twice");
  expect_bad(
      with_header(R"({"t":{"dtype":"F32","dtype":"I32","shape":[1],"data_offsets":[0,4]}})", data),
      "names 'dtype' twice");
  // Overlaps: whole, in part, an empty tensor inside of another; holes before, between, behind.
  const auto two = [&](const std::string& a, const std::string& b, size_t bytes) {
    return with_header("{\"a\":" + a + ",\"b\":" + b + "}", std::string(bytes, '\0'));
  };
  expect_bad(two(range(0, 8), range(4, 12), 12), "overlaps");
  expect_bad(two(range(0, 12), range(4, 8), 12), "overlaps");
  expect_bad(two(range(0, 8), range(4, 4), 8), "overlaps");
  expect_bad(two(range(4, 8), range(8, 12), 12), "gap");
  expect_bad(two(range(0, 4), range(8, 12), 12), "gap");
  expect_bad(two(range(0, 4), range(4, 8), 12), "4 bytes more");
  // Two files in one: something before, behind or after the end of the header's text.
  expect_bad(with_header(" {\"a\":" + one + "}", data), "no JSON object");
  expect_bad(with_header("\xef\xbb\xbf{\"a\":" + one + "}", data), "no JSON object");
  expect_bad(with_header("{\"a\":" + one + "}{}", data), "not JSON");
  expect_bad(with_header("{\"a\":" + one + "}" + std::string("\0PK", 3), data), "no JSON object");
  expect_bad(with_header("{\"a\":" + one + "}", data + "PK"), "2 bytes more");
  // Numbers that are none: negative, fractions, beyond 64 bits, texts.
  for (const char* bad : {"-1", "1.0", "1e0", "18446744073709551616", "\"1\"", "null", "[1]"}) {
    const std::string shape = std::string("{\"t\":{\"dtype\":\"F32\",\"shape\":[") + bad;
    EXPECT_THROW(
        parse_safetensors(with_header(shape + "],\"data_offsets\":[0,4]}}", data), "w.safetensors"),
        InputError)
        << bad;
  }
  // Types of numbers that are not read, also the newest.
  for (const char* type : {"F8_E4M3", "F8_E5M2", "F8_E8M0", "F6_E2M3", "F4", "BOOL", "U8", "I8",
                           "U16", "I16", "U32", "U64", "C64", "f32", ""})
    expect_bad(with_header(std::string("{\"t\":{\"dtype\":\"") + type +
                               R"(","shape":[1],"data_offsets":[0,4]}})",
                           data),
               "unknown dtype");
}

/// A header may make no more of itself than it is, and be read in good time.
TEST(WeightsSafetensors, LargeHeadersStaySmall) {
  std::string zeros = "0";
  for (int i = 0; i < 100; ++i) zeros += ",0";
  expect_bad(with_header("{\"t\":{\"dtype\":\"F32\",\"shape\":[" + zeros + "]}}", ""),
             "more than 64 numbers");
  expect_bad(with_header("{\"t\":[" + zeros + "]}", ""), "deeply");
  expect_bad(with_header("{\"t\":{\"shape\":[[" + zeros + "]]}}", ""), "deeply");
  expect_bad(with_header("{\"t\":{\"shape\":{\"a\":0}}}", ""), "deeply");
  std::string many = "{";
  for (int i = 0; i < 200'000; ++i)
    many += (i > 0 ? ",\"" : "\"") + std::to_string(i) +
            R"(":{"dtype":"F32","shape":[0],"data_offsets":[0,0]})";
  EXPECT_EQ(parse_safetensors(with_header(many + "}", ""), "x").tensors.size(), 200'000u);
}

TEST(WeightsSafetensors, NamesInMessagesAreShortAndPrintable) {
  EXPECT_EQ(name_in_quotes("a.b"), "'a.b'");
  EXPECT_EQ(name_in_quotes("a\nb"), "'a?b'");
  EXPECT_EQ(name_in_quotes(std::string(500, 'x')).size(), 65u);
}

}  // namespace
}  // namespace restage
