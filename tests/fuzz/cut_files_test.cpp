// Data files that are cut short, at every percent of their length: each time one clear line, except
// where the format goes line by line (OBJ, AMC, YAML) and what is left is a whole shorter file. And
// files that are damaged anywhere: they are read, or refused in one line. Anything else (a crash,
// another exception) fails; the sanitizer build runs the same tests.
#include <gtest/gtest.h>

#include "autograd/base/rng.h"
#include "tests/fuzz/targets.h"
#include "tests/support/files.h"

#if defined(__SANITIZE_ADDRESS__)
// The HDF5 library itself forgets some memory when it refuses a damaged file.
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5\n"; }
#endif

namespace restage::fuzz {
namespace {

class CutFiles : public ::testing::TestWithParam<Target> {};

TEST_P(CutFiles, EverySeedIsRead) {
  for (const Seed& seed : seeds(GetParam().name)) {
    EXPECT_LE(seed.bytes.size(), GetParam().longest) << seed.name;
    EXPECT_NO_THROW(GetParam().read(seed.bytes)) << seed.name;
  }
}

TEST_P(CutFiles, EveryPercentIsOneClearLine) {
  for (const Seed& seed : seeds(GetParam().name)) {
    if (seed.cut == Cut::never_cut) continue;
    for (size_t percent = 0; percent < 100; ++percent) {
      const std::string cut = seed.bytes.substr(0, seed.bytes.size() * percent / 100);
      SCOPED_TRACE(seed.name + " at " + std::to_string(percent) + " %");
      const bool refused = !test::refusal_of([&] { GetParam().read(cut); }).empty();
      EXPECT_TRUE(refused || seed.cut == Cut::any);
    }
  }
}

/// The words of a target's dictionary, which chance would find slowly.
std::vector<std::string> words_of(const Target& target) {
  std::vector<std::string> out;
  std::ifstream file(RESTAGE_SOURCE_DIR "/tests/fuzz/dictionaries/" + std::string(target.words) +
                     ".dict");
  for (std::string line; std::getline(file, line);) {
    std::string word;
    for (size_t i = 1; i + 1 < line.size(); ++i) {
      const bool number = line.compare(i, 2, "\\x") == 0;
      if (line[i] == '\\') ++i;
      word += number ? static_cast<char>(std::stoi(line.substr(i + 1, 2), nullptr, 16)) : line[i];
      if (number) i += 2;
    }
    out.push_back(word);
  }
  return out;
}

/// One to four random edits, half of them near the beginning, where structure stands: a bit, a
/// byte, a digit, a number of eight bytes, a cut, a removal, a repeat, a word.
std::string damaged(std::string bytes, const std::vector<std::string>& words, Rng& rng) {
  for (uint64_t edits = 1 + rng.below(4); edits > 0 && !bytes.empty(); --edits) {
    const size_t at = rng.below(rng.below(2) ? bytes.size() : bytes.size() / 8 + 1);
    const size_t n = std::min<size_t>(1 + rng.below(60), bytes.size() - at);
    const auto kind = rng.below(words.empty() ? 7 : 8);
    if (kind == 0) bytes[at] = static_cast<char>(bytes[at] ^ (1 << rng.below(8)));
    if (kind == 1) bytes[at] = static_cast<char>(rng.below(256));
    if (kind == 2) bytes[at] = static_cast<char>('0' + rng.below(10));
    if (kind == 3) bytes.replace(at, n % 16, n % 16, rng.below(2) ? '\xff' : '9');
    if (kind == 4 && rng.below(8) == 0) bytes.resize(at);
    if (kind == 5) bytes.erase(at, n);
    if (kind == 6) bytes.insert(at, bytes.substr(rng.below(bytes.size()), rng.below(200)));
    if (kind == 7) bytes.insert(at, words[rng.below(words.size())]);
  }
  return bytes;
}

TEST_P(CutFiles, DamagedOnesAreReadOrRefused) {
  const std::vector<Seed> files = seeds(GetParam().name);
  const std::vector<std::string> words = words_of(GetParam());
  EXPECT_EQ(words.empty(), GetParam().words.empty());
  int read = 0, refused = 0;
  for (int round = 0; round < GetParam().damaged; ++round) {
    Rng rng(RngKey{7, static_cast<uint64_t>(round)}.fold(GetParam().name));
    const Seed& seed = files[static_cast<size_t>(round) % files.size()];
    const std::string bytes = damaged(seed.bytes, words, rng);
    SCOPED_TRACE(seed.name + ", round " + std::to_string(round));
    try {
      ++(test::refusal_of([&] { GetParam().read(bytes); }).empty() ? read : refused);
    } catch (const std::exception& error) {
      ADD_FAILURE() << "another exception than InputError: " << error.what();
    }
  }
  EXPECT_TRUE(read > 0 || GetParam().name == "xz") << "nothing passes";  // its checksum sees all
  EXPECT_GE(refused, GetParam().damaged / 10) << read << " read";
}

INSTANTIATE_TEST_SUITE_P(Readers, CutFiles, ::testing::ValuesIn(targets()),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace restage::fuzz
