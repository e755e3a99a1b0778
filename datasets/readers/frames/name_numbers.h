// The numbers in names of files, and what the marks beside them mean: shared by frame_names.cpp and
// name_hex.cpp.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace restage::numbered {

inline bool is_digit(char c) { return c >= '0' && c <= '9'; }

using Value = long double;  // of times in nanoseconds, exactly

/// A part of a name: text, or a number.
struct Piece {
  std::string text;  ///< as it stands in the name
  bool number = false, negative = false;
  std::string whole, fraction;  ///< digits before the point (without leading zeros) and behind it
  Value value() const;
};
using Pieces = std::vector<Piece>;

/// What a point or comma between two runs of digits is.
enum class Mark {
  parts,        ///< parts two numbers: take1.9, take1.10
  decimal,      ///< begins decimals: 0.05, 0.1
  nanoseconds,  ///< stands between seconds and nanoseconds that are written without leading zeros
};

struct Meaning {
  Mark mark = Mark::parts;
  bool letter_signs = false;  ///< a minus between a letter and a digit is a sign
  std::string remark;         ///< how the names were read, where they could be read otherwise
};

/// What the marks in these names mean. InputError naming `folder` where two readings give two
/// orders and nothing tells which is meant.
Meaning meaning_of(const std::vector<std::string>& names, const std::string& folder);

Pieces pieces_of(const std::string& name, const Meaning& meaning);
/// The name with # for each number.
std::string pattern_of(const Pieces& pieces);
/// Below, above or equal to 0: the order of a and b, which have the same pattern.
int compare(const Pieces& a, const Pieces& b);

/// Names that count in hexadecimal: what stands before and behind their numbers.
struct Hexadecimal {
  std::string before, behind;
  /// Nothing if the name is not of this kind.
  std::optional<Pieces> pieces_of(const std::string& name) const;
};

/// Nothing unless two names have numbers behind 0x, or the names count from 9 to a, or from f to
/// 10, in nearly even steps.
std::optional<Hexadecimal> hexadecimal_names(const std::vector<std::string>& names);

}  // namespace restage::numbered
