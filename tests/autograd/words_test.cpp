// Texts from words and numbers, and the parts of an InputError.
#include "autograd/base/words.h"

#include <gtest/gtest.h>

#include <map>
#include <vector>

#include "tests/support/errors.h"

namespace restage {
namespace {

using Names = std::vector<std::string>;

TEST(Words, ListsAreJoined) {
  EXPECT_EQ(joined(Names{}), "");
  EXPECT_EQ(joined(Names{"a"}), "a");
  EXPECT_EQ(joined(Names{"", "b", ""}), ", b, ") << "an empty word is a word";
  EXPECT_EQ(joined(std::vector{1, 2, 3}, {}, ","), "1,2,3");
  const std::map<std::string, int> counts = {{"a", 1}, {"b", 2}};
  EXPECT_EQ(joined(counts, [](const auto& one) { return cat(one.second, " ", one.first); }),
            "1 a, 2 b");
}

TEST(Words, LongListsAreCut) {
  const std::vector all = {1, 2, 3, 4};
  EXPECT_EQ(listed(all, 4), "1, 2, 3, 4");
  EXPECT_EQ(listed(all, 2), "1, 2 and 2 more");
  EXPECT_EQ(listed(Names{}, 2), "");
  EXPECT_EQ(cut_list(Names{"abcd", "e", "f"}, 4), "abcd, e, ...");
  EXPECT_EQ(cut_list(Names{"abcd", "e"}, 10), "abcd, e");
}

TEST(Words, OneIsNoPlural) {
  EXPECT_EQ(counted(0, "frame"), "0 frames");
  EXPECT_EQ(counted(1, "frame"), "1 frame");
  EXPECT_EQ(counted(2, "frame"), "2 frames");
  EXPECT_EQ(counted(1, "mesh", "meshes"), "1 mesh");
  EXPECT_EQ(counted(3, "mesh", "meshes"), "3 meshes");
}

TEST(Words, OnlyLettersOfAsciiBecomeSmall) {
  EXPECT_EQ(lower_case("Hero-01.GLB \xC3\x84"), "hero-01.glb \xC3\x84");
}

TEST(InputErrors, KeepTheirPartsWhateverTheySay) {
  const InputError error("a; b.ply:3", "is x; and y", "do this; or that");
  EXPECT_STREQ(error.what(), "a; b.ply:3: is x; and y; do this; or that");
  EXPECT_EQ(error.where(), "a; b.ply:3");
  EXPECT_EQ(error.cause(), "is x; and y");
  EXPECT_EQ(error.mend(), "do this; or that");
  EXPECT_EQ(error.complaint(), "a; b.ply:3: is x; and y");
  EXPECT_EQ(InputError("", "is x", "mend it").complaint(), "is x");
}

TEST(InputErrors, ALineOfAnotherProcessIsSplitAtItsLastSemicolon) {
  const InputError error = InputError::of_line("a.ply: is x; and y; mend it so");
  EXPECT_STREQ(error.what(), "a.ply: is x; and y; mend it so");
  EXPECT_EQ(error.complaint(), "a.ply: is x; and y");
  EXPECT_EQ(error.mend(), "mend it so");
  EXPECT_STREQ(InputError::of_line("a.ply: holds no points").what(),
               "a.ply: holds no points; mend it");
}

}  // namespace
}  // namespace restage
