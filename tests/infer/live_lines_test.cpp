// Lines of JSON in a stream of bytes.
#include <gtest/gtest.h>

#include "tests/infer/live_support.h"

namespace restage::live {
namespace {

TEST(LiveLines, LinesTellThemselves) {
  const std::string bytes = "{\"a\": 1}\n\n  \r\n[2]\r\n{3}";
  Parsed got;
  for (const size_t piece : {1, 3, 4, 5, 1000}) {
    got = parsed(bytes, piece);
    ASSERT_EQ(got.clouds.size(), 2u) << piece;
    EXPECT_EQ(got.clouds[0].line, "{\"a\": 1}");
    EXPECT_EQ(got.clouds[0].number, 1);
    EXPECT_EQ(got.clouds[1].line, "[2]\r");
    EXPECT_EQ(got.clouds[1].number, 4);
    EXPECT_TRUE(got.in_frame);  // until the input ends
    EXPECT_EQ(got.garbage, "");
  }
  // As many points as {, and no lines: the number's last byte is 0.
  const std::string cloud = std::string("{\0\0\0", 4) + std::string(8 + 12 * '{', '\0');
  got = parsed(cloud, 3);
  ASSERT_EQ(got.clouds.size(), 1u);
  EXPECT_EQ(got.clouds[0].points.size(), size_t{'{'});
  EXPECT_TRUE(got.clouds[0].line.empty());
}

TEST(LiveLines, ALineThatIsTooLongIsPassedOver) {
  for (const size_t piece : {1000, 5000, 1 << 22}) {
    const Parsed got = parsed("[1]\n[" + std::string(kLongestLine + 9, ' ') + "]\n[3]\n", piece);
    ASSERT_EQ(got.clouds.size(), 2u) << piece;
    EXPECT_EQ(got.clouds[1].line, "[3]");
    EXPECT_EQ(got.clouds[1].number, 3);
    EXPECT_EQ(got.refused, (std::vector<std::string>{"line 2 is longer than 1 MB"}));
    EXPECT_EQ(got.garbage, "");
  }
}

TEST(LiveLines, WhatIsPrintedIsALine) {
  for (const std::string first : {"INFO tracker started", "# tracker", "null"})
    for (const size_t piece : {1, 3, 100}) {
      const Parsed got = parsed(first + "\n{}\n", piece);
      ASSERT_EQ(got.clouds.size(), 2u) << first;
      EXPECT_EQ(got.clouds[0].line, first);
      EXPECT_EQ(got.garbage, "");
    }
}

TEST(LiveLines, ALastLineNeedsNoEnd) {
  FrameParser parser;
  std::vector<std::string> lines;
  const auto deliver = [&](LiveCloud& cloud) { lines.push_back(cloud.line); };
  const std::string bytes = "[1]\n[2]";
  parser.take({reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()}, Clock::now(),
              deliver, [](const std::string&) {});
  parser.end(Clock::now(), deliver);
  EXPECT_EQ(lines, (std::vector<std::string>{"[1]", "[2]"}));
  EXPECT_FALSE(parser.in_frame());
  FrameParser brief;
  brief.take({reinterpret_cast<const unsigned char*>("[]"), 2}, Clock::now(), deliver,
             [](const std::string&) {});
  brief.end(Clock::now(), deliver);
  EXPECT_EQ(lines.back(), "[]");
  EXPECT_FALSE(brief.in_frame());
}

}  // namespace
}  // namespace restage::live
