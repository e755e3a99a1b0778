// Texts of words in lines, as motion capture (BVH, ASF, AMC) and MakeHuman write them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "autograd/base/words.h"

namespace restage {

/// Lines of a text as words, with the line number for messages. The text must outlive it. Lines end
/// with LF, CR LF or CR, words with blanks or commas; a byte order mark and what editors of old
/// leave at the end (NUL, ^Z) are no words. InputError for UTF-16.
class WordLines {
 public:
  WordLines(std::string_view text, const std::string& path);

  /// Goes to the next line with words; false at the end.
  bool next();
  /// The words of the line (its first 65,537); never empty after a next() that was true.
  const std::vector<std::string_view>& words() const { return words_; }
  /// InputError "file:line: what is wrong; how to mend it"; before the first line without it.
  [[noreturn]] void fail(const std::string& wrong, const std::string& fix) const;
  /// The word as a finite number of at most 1e9; else fail().
  double number(std::string_view word) const;
  /// Short and printable, for messages: at most 40 bytes of UTF-8, a '?' for what is no character.
  static std::string quoted(std::string_view word);

 private:
  std::string_view text_;
  std::string path_;
  size_t at_ = 0, number_ = 0;
  std::vector<std::string_view> words_;
};

/// Whether `a` is the word `lower`, whatever its case.
bool same_word(std::string_view a, std::string_view lower);

}  // namespace restage
