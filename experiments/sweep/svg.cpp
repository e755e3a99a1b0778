#include "experiments/sweep/svg.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>

#include "experiments/text.h"
#include "infer/render/html.h"

namespace restage::tables {
namespace {

std::string place(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", x);
  return text;
}

}  // namespace

void Svg::line(double x1, double y1, double x2, double y2, const std::string& colour,
               double width) {
  body_ += "<line x1=\"" + place(x1) + "\" y1=\"" + place(y1) + "\" x2=\"" + place(x2) +
           "\" y2=\"" + place(y2) + "\" stroke=\"" + colour + "\" stroke-width=\"" + place(width) +
           "\"/>\n";
}

void Svg::dot(double x, double y, double radius, const std::string& colour) {
  body_ += "<circle cx=\"" + place(x) + "\" cy=\"" + place(y) + "\" r=\"" + place(radius) +
           "\" fill=\"" + colour + "\"/>\n";
}

void Svg::text(double x, double y, const std::string& words, const std::string& anchor, int size,
               const std::string& colour) {
  body_ += "<text x=\"" + place(x) + "\" y=\"" + place(y) + "\" text-anchor=\"" + anchor +
           "\" font-size=\"" + std::to_string(size) + "\" fill=\"" + colour + "\">" +
           escape_html(on_one_line(words)) + "</text>\n";
}

void Svg::polyline(const std::vector<std::pair<double, double>>& points,
                   const std::string& colour) {
  body_ += "<polyline fill=\"none\" stroke-width=\"1.5\" stroke=\"" + colour + "\" points=\"";
  for (const auto& [x, y] : points) body_ += place(x) + "," + place(y) + " ";
  body_ += "\"/>\n";
}

std::string Svg::document(double width, double height) const {
  const std::string w = place(width), h = place(height);
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + w + "\" height=\"" + h +
         "\" viewBox=\"0 0 " + w + " " + h + "\" font-family=\"sans-serif\">\n<rect width=\"" + w +
         "\" height=\"" + h + "\" fill=\"white\"/>\n" + body_ + "</svg>\n";
}

std::string colour_of(size_t index) {
  static const char* const colours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                        "#56b4e9", "#e69f00", "#222222", "#b8a800"};
  return colours[index % std::size(colours)];
}

Axis::Axis(double lo, double hi, double f, double t) : low(lo), high(hi), from(f), to(t) {
  const double gap = std::max({(hi - lo) * 0.08, std::abs(hi) * 1e-3, 1e-12});
  low -= gap;
  high += gap;
}

std::vector<double> Axis::marks() const {
  const double raw = (high - low) / 3, power = std::pow(10, std::floor(std::log10(raw)));
  const double step = power * (raw / power >= 5 ? 5 : raw / power >= 2 ? 2 : 1);
  std::vector<double> out;
  for (double i = std::ceil(low / step); i * step <= high && out.size() < 10; ++i)
    out.push_back(i * step + 0.0);  // no -0
  return out;
}

std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

}  // namespace restage::tables
