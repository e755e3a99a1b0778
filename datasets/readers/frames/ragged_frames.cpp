#include "datasets/readers/frames/ragged_frames.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numeric>
#include <string_view>

#include "datasets/readers/arrays/npy.h"
#include "datasets/readers/errors.h"
#include "datasets/readers/text/text.h"
#include "datasets/readers/text/word_lines.h"

namespace restage {
namespace {

using Numbers = std::vector<int64_t>;

constexpr std::string_view kLengths[] = {"lengths",
                                         "length",
                                         "lens",
                                         "counts",
                                         "count",
                                         "sizes",
                                         "numpoints",
                                         "npoints",
                                         "numpts",
                                         "npts",
                                         "numverts",
                                         "nverts",
                                         "numvertices",
                                         "nvertices",
                                         "num",
                                         "nums",
                                         "perframe",
                                         "numperframe",
                                         "pointnum",
                                         "pointsnum",
                                         "perscan",
                                         "percloud",
                                         "numframes",
                                         "nframes",
                                         "numpointsperframe",
                                         "npointsperframe",
                                         "seqlens",
                                         "seqlengths",
                                         "numvalid",
                                         "nvalid",
                                         "validpoints",
                                         "validlengths",
                                         "validcounts",
                                         "validnum",
                                         "lensequences",
                                         "lenseqs"};
constexpr std::string_view kOffsets[] = {
    "offset",    "offsets", "starts",     "start",    "splits",     "split",       "ptr",
    "ptrs",      "indptr",  "begins",     "begin",    "ends",       "end",         "cumsum",
    "cuseqlens", "bounds",  "boundaries", "startidx", "startindex", "startindices"};
constexpr std::string_view kOfPoints[] = {"",    "id",     "ids",     "index", "indices",
                                          "idx", "number", "numbers", "no",    "nr"};

template <size_t N>
bool is_in(const std::string_view (&list)[N], const std::string& word) {
  return std::find(std::begin(list), std::end(list), word) != std::end(list);
}

/// What an array is, by its name.
enum class Role { other, lengths, offsets, of_points };

/// `word`: of a name without marks, in small letters; `frames`: frames were named before it.
Role role_of_word(const std::string& word, bool frames) {
  if (is_in(kLengths, word)) return Role::lengths;
  if (is_in(kOffsets, word)) return Role::offsets;
  if (frames && is_in(kOfPoints, word)) return Role::of_points;
  for (const std::string_view before :
       {"frames", "frame", "batch", "points", "point", "pts", "clouds", "cloud", "scans", "scan",
        "rows", "row", "vertices", "vertex", "verts"}) {
    if (!word.starts_with(before)) continue;
    const bool here = before.starts_with("frame") || before == "batch";
    const Role role = role_of_word(word.substr(before.size()), frames || here);
    if (role != Role::other) return role;
  }
  return Role::other;
}

Role role_of(const std::string& name) {
  std::string word;
  for (const char c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) word += c;
  return role_of_word(lower_case(word), false);
}

/// Whole numbers; empty if one is none.
Numbers whole_numbers(const std::vector<double>& values) {
  Numbers out;
  for (const double value : values) {
    if (!(std::abs(value) < 1e15) || value != std::floor(value)) return {};
    out.push_back(static_cast<int64_t>(value));
  }
  return out;
}

bool is_growing(const Numbers& n) { return std::is_sorted(n.begin(), n.end()); }

/// The numbers as offsets from 0 to `points`; empty if they are none.
Numbers by_lengths(const Numbers& n, int64_t points) {
  Numbers out{0};
  for (const int64_t length : n) {
    if (length < 0 || length > points - out.back()) return {};
    out.push_back(out.back() + length);
  }
  return out.back() == points ? out : Numbers{};
}

Numbers by_offsets(Numbers n, int64_t points) {
  if (n.empty() || !is_growing(n) || n[0] < 0 || n.back() > points) return {};
  const bool from_zero = n[0] == 0, to_end = n.back() == points;
  const bool strict = std::adjacent_find(n.begin(), n.end()) == n.end();
  if (!from_zero && !to_end) return {};
  if (!(from_zero && to_end) && !strict) return {};
  if (!from_zero) n.insert(n.begin(), 0);
  if (!to_end) n.push_back(points);
  return n;
}

Numbers by_points(const Numbers& n, int64_t points) {
  if (std::ssize(n) != points || !is_growing(n)) return {};
  Numbers out{0};
  for (int64_t i = 1; i < points; ++i)
    if (n[static_cast<size_t>(i)] != n[static_cast<size_t>(i) - 1]) out.push_back(i);
  out.push_back(points);
  return out;
}

Numbers fitted(Role role, const Numbers& n, int64_t points) {
  switch (role) {
    case Role::lengths:
      return by_lengths(n, points);
    case Role::offsets:
      return by_offsets(n, points);
    case Role::of_points:
      return by_points(n, points);
    case Role::other:
      break;
  }
  // Two frames or more, of some points each on average.
  if (n.size() < 2 || 4 * std::ssize(n) > points) return {};
  Numbers out = by_lengths(n, points);
  if (out.empty() && n[0] == 0 && n.back() == points && n.size() > 2) out = by_offsets(n, points);
  return out;
}

/// One axis, or one number.
int64_t length_of(const BesideArray& array) {
  const int64_t count = std::accumulate(array.shape.begin(), array.shape.end(), int64_t{1},
                                        [](int64_t a, int64_t b) { return a * b; });
  const auto longer =
      std::count_if(array.shape.begin(), array.shape.end(), [](int64_t n) { return n != 1; });
  return longer <= 1 ? count : -1;
}

}  // namespace

bool names_lengths(const std::string& name) { return role_of(name) == Role::lengths; }

std::optional<RaggedFrames> ragged_frames(const std::string& file, int64_t points,
                                          const std::vector<BesideArray>& beside) {
  const BesideArray* unfit = nullptr;
  for (const bool named : {true, false})
    for (const BesideArray& array : beside) {
      const Role role = role_of(array.name);
      const int64_t length = length_of(array);
      if ((role != Role::other) != named || length == 0) continue;
      if (length < 0 || length > points + 1) {
        if (named && array.whole_type && role != Role::of_points) unfit = &array;
        continue;
      }
      if (role == Role::of_points && length != points) continue;  // a number for each frame
      if (!named && (!array.whole_type || 4 * length > points)) continue;
      const Numbers numbers = whole_numbers(array.read());
      if (numbers.empty()) continue;
      const bool one_frame = role == Role::offsets || numbers[0] == points || numbers[0] == 1;
      const bool filled_up = role == Role::lengths && numbers[0] < points;  // padding.h
      if (length == 1 && (one_frame || filled_up)) continue;
      Numbers offset = fitted(role, numbers, points);
      if (offset.size() > 2) return RaggedFrames{array.name, std::move(offset)};
      if (!offset.empty()) continue;
      const bool place = lower_case(array.name) == "offset" && length == 3;  // in the world
      if (named && array.whole_type && !place) unfit = &array;
    }
  if (unfit == nullptr) return std::nullopt;
  throw InputError(
      file,
      cat("holds ", points, " points and ", text::quote(unfit->name), " ", shape_text(unfit->shape),
          ", which does not part them into frames: its lengths do not add up to the "
          "number of points, and it does not grow from 0 to that number"),
      "save the frames as points [F, N, 3], or as arrays points_0, points_1 ...; or "
      "leave that array out if all points are one cloud");
}

}  // namespace restage
