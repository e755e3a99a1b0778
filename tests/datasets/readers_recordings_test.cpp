// BVH files that are cut, flipped, deep or announce what they do not hold: refused with a line,
// never a crash, never much memory.
#include <gtest/gtest.h>
#include <lzma.h>

#include "autograd/base/error.h"
#include "autograd/base/rng.h"
#include "datasets/importers/bvh.h"
#include "datasets/readers/bvh.h"
#include "tests/datasets/importers_bvh_text.h"
#include "tests/datasets/schema_support.h"

namespace restage {
namespace {

std::string complaint(const std::string& text) {
  try {
    convert_bvh(text, "x.bvh");
  } catch (const InputError& error) {
    EXPECT_LT(std::string(error.what()).size(), 390u) << error.what();
    return error.what();
  }
  return "";
}

std::string small_file() {
  bvh_test::Style style;
  style.frames = 12;
  return bvh_test::text(style);
}

TEST(ReadersRecordings, CutAtEveryPercentIsRefused) {
  const std::string good = small_file();
  EXPECT_EQ(complaint(good), "");
  for (size_t percent = 0; percent < 100; ++percent)
    EXPECT_EQ(complaint(good.substr(0, good.size() * percent / 100)).find("x.bvh:"), 0u) << percent;
}

TEST(ReadersRecordings, FlippedBytesNeverCrash) {
  const std::string good = small_file();
  for (uint64_t i = 0; i < 500; ++i) {
    Rng rng(RngKey{5, i});
    std::string text = good;
    for (uint64_t n = 1 + rng.below(4); n > 0; --n)
      text[rng.below(text.size())] = static_cast<char>(rng.below(256));
    complaint(text);
  }
}

/// A chain of `depth` joints, one in the other.
std::string deep(size_t depth) {
  std::string text =
      "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Xrotation Yrotation Zrotation\n";
  for (size_t i = 1; i < depth; ++i) text += "JOINT b" + std::to_string(i) + "\n{\nOFFSET 0 1 0\n";
  for (size_t i = 0; i < depth; ++i) text += "}\n";
  return text + "MOTION\nFrames: 1\nFrame Time: 0.1\n0 0 0\n";
}

TEST(ReadersRecordings, DepthIsNoMatterButCountsAreLimited) {
  EXPECT_EQ(parse_bvh(deep(4096), "x.bvh").skeleton.size(), 4096u);
  EXPECT_NE(complaint(deep(4097)).find("more than 4096 joints"), std::string::npos);
  EXPECT_NE(complaint(std::string(1 << 20, '{')).find("x.bvh:1"), std::string::npos);
}

TEST(ReadersRecordings, AnnouncedCountsAreNotBelieved) {
  const std::string good = small_file();
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    return text.replace(text.find(from), from.size(), to);
  };
  EXPECT_NE(complaint(with("Frames: 12", "Frames: 999999999")).find("ends after 12 of"),
            std::string::npos);
  // Vendors miscount: what is announced is read, what follows is left out, whatever it is.
  const MotionClip eleven = convert_bvh(with("Frames: 12", "Frames: 11") + "and notes\n", "x.bvh");
  EXPECT_EQ(eleven.report.remarks.size(), 1u);
  EXPECT_NE(eleven.report.remarks.back().find("announces 11; left out"), std::string::npos);
  EXPECT_NE(complaint(with("Frames: 12", "Frames: 13")).find("ends after 12 of"),
            std::string::npos);
  std::string wide = good.substr(0, good.find("Frame Time")) + "Frame Time: 0.01\n";
  for (int i = 0; i < 200000; ++i) wide += "0 ";
  EXPECT_NE(complaint(wide).find("65537 values"), std::string::npos) << complaint(wide);
}

/// The unpacker would take the memory that the file asks for.
TEST(ReadersRecordings, PackedTextsThatAskForMuchMemoryAreRefused) {
  const test::TempDir dir;
  const std::string text = small_file();
  const auto refusal = [&](uint32_t mebibytes) -> std::string {
    lzma_options_lzma options;
    lzma_lzma_preset(&options, 0);
    options.dict_size = mebibytes << 20;
    const lzma_filter filters[] = {{LZMA_FILTER_LZMA2, &options}, {LZMA_VLI_UNKNOWN, nullptr}};
    std::string packed(lzma_stream_buffer_bound(text.size()), '\0');
    size_t size = 0;
    EXPECT_EQ(
        lzma_stream_buffer_encode(const_cast<lzma_filter*>(filters), LZMA_CHECK_CRC32, nullptr,
                                  reinterpret_cast<const uint8_t*>(text.data()), text.size(),
                                  reinterpret_cast<uint8_t*>(packed.data()), &size, packed.size()),
        LZMA_OK);
    test::write_bytes(dir / "x.bvh.xz", packed.substr(0, size));
    try {
      read_bvh(dir / "x.bvh.xz");
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal(64), "");  // xz -9
  EXPECT_NE(refusal(128).find("takes more than 80 MiB to unpack"), std::string::npos);
}

/// A few bytes a frame at one frame per second, or thousands of joints that never move, would be
/// gigabytes in memory.
TEST(ReadersRecordings, SmallFilesThatMakeLongMotionsAreRefused) {
  const std::string good = small_file();
  const std::string head = good.substr(0, good.find("MOTION"));
  const auto recording = [](const std::string& hierarchy, size_t channels, int frames) {
    std::string line,
        text = hierarchy + "MOTION\nFrames: " + std::to_string(frames) + "\nFrame Time: 1\n";
    for (size_t c = 0; c < channels; ++c) line += "0 ";
    for (int f = 0; f < frames; ++f) text += line + "\n";
    return text;
  };
  const size_t channels = parse_bvh(good, "x.bvh").channel_count;
  EXPECT_EQ(complaint(recording(head, channels, 100)), "");
  EXPECT_NE(complaint(recording(head, channels, 5000)).find("far more than is in the file"),
            std::string::npos);
  std::string still;
  for (int i = 0; i < 3000; ++i) still += "JOINT x" + std::to_string(i) + "\n{\nOFFSET 0 1 0\n}\n";
  const size_t at = head.rfind('}');
  const std::string crowd = head.substr(0, at) + still + head.substr(at);
  EXPECT_EQ(complaint(recording(crowd, channels, 10)), "");
  EXPECT_NE(complaint(recording(crowd, channels, 500)).find("of 3022 joints, far more"),
            std::string::npos);
}

}  // namespace
}  // namespace restage
