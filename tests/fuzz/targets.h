// The readers, and what comes after them (after_reading.h), as functions of bytes: what libFuzzer
// calls (fuzz_main.cpp), and the test of cut files (cut_files_test.cpp).
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace restage::fuzz {

struct Target {
  std::string_view name;
  std::string_view words;  ///< its dictionary: dictionaries/WORDS.dict
  size_t longest;          ///< bytes of an input
  size_t allocation;       ///< MiB that one allocation may take; targets.cpp has the arithmetic
  int damaged;             ///< so many damaged files are read in the ordinary tests
  /// Reads the bytes in every way there is. InputError if they are refused; nothing else may come
  /// out.
  void (*read)(const std::string& bytes);
};
const std::vector<Target>& targets();

/// What becomes of a seed that is cut short.
enum class Cut {
  refused,    ///< its format says how much there should be
  any,        ///< line by line: it is refused in the middle of a line, or is a whole shorter file
  never_cut,  ///< no file format, but a form that suits the fuzzer
};

/// A small valid file to begin from.
struct Seed {
  std::string name, bytes;
  Cut cut = Cut::refused;
};
std::vector<Seed> seeds(std::string_view target);

/// A new file with these bytes, in a folder that goes away with the program; its path.
std::string file_of(const std::string& bytes, const std::string& name);

/// Arrays of an NPZ one after the other, without the checksums that would keep damage from the
/// importers: name, zero, length (4 bytes), bytes.
std::string framed(const std::vector<std::pair<std::string, std::string>>& arrays);

}  // namespace restage::fuzz
