// The few shapes that our plots are made of, as SVG text.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace restage::tables {

class Svg {
 public:
  void line(double x1, double y1, double x2, double y2, const std::string& colour,
            double width = 1);
  void dot(double x, double y, double radius, const std::string& colour);
  /// One line of `words`, whatever is in them; `anchor`: start, middle or end.
  void text(double x, double y, const std::string& words, const std::string& anchor = "start",
            int size = 11, const std::string& colour = "#222");
  void polyline(const std::vector<std::pair<double, double>>& points, const std::string& colour);
  /// The whole document, on white.
  std::string document(double width, double height) const;

 private:
  std::string body_;
};

/// Repeats after eight (Okabe and Ito's, which
/// colour-blind readers can tell apart).
std::string colour_of(size_t index);

/// An axis from values to places: a little wider than the values, with round marks.
struct Axis {
  Axis(double low, double high, double from, double to);
  double at(double value) const { return from + (value - low) / (high - low) * (to - from); }
  std::vector<double> marks() const;

  double low, high, from, to;
};

/// Four significant digits.
std::string short_number(double value);

}  // namespace restage::tables
