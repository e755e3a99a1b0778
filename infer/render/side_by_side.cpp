#include "infer/render/side_by_side.h"

#include <algorithm>

#include "infer/render/style.h"

namespace restage {
namespace {

constexpr size_t kAtOnce = 8;  // frames of one clip that are kept until the other's are drawn
constexpr double kLabelSize = 11;

/// Room for labels under the figures, pixels.
int label_room(const FilmOptions& options) { return std::min(28, options.height / 4); }

FilmOptions half_of(FilmOptions options) {
  options.height -= label_room(options);
  options.width /= 2;
  return options;
}

std::string fitting_label(std::string label, int width) {
  if (text_width(kLabelSize, label) <= width) return label;
  while (!label.empty() && text_width(kLabelSize, label + "...") > width) label.pop_back();
  return label + "...";
}

}  // namespace

SideBySide::SideBySide(const Clip& left, const Clip& right, const FilmOptions& options,
                       std::vector<std::string>& remarks)
    : options_(options),
      labels_{left.label, right.label},
      left_(left, half_of(options), remarks),
      right_(right, half_of(options), remarks) {
  Film::share(left_, right_);
  width_ = options.width > 0 ? options.width : left_.width() + right_.width();
}

Image SideBySide::together(const Image& left, const Image& right) const {
  const Rgb paper = options_.background.value_or(kPaper);
  const bool dark = paper[0] + paper[1] + paper[2] < 330;
  Image out(width_, options_.height, paper);
  paste(out, left, 0, 0);
  paste(out, right, width_ - right.width, 0);
  const int half = width_ / 2;
  for (int side = 0; side < 2; ++side) {
    const std::string label = fitting_label(labels_[static_cast<size_t>(side)], half - 8);
    draw_text(out, side * half + (half - text_width(kLabelSize, label)) / 2, left.height + 6,
              kLabelSize, dark ? kPaper : kInk, label);
  }
  return out;
}

void SideBySide::draw(const std::vector<size_t>& frames,
                      const std::function<void(const Image&)>& take) const {
  for (size_t at = 0; at < frames.size(); at += kAtOnce) {
    const auto first = frames.begin() + static_cast<std::ptrdiff_t>(at);
    const std::vector<size_t> some(
        first, first + static_cast<std::ptrdiff_t>(std::min(kAtOnce, frames.size() - at)));
    std::vector<Image> lefts;
    left_.draw(some, [&](const Image& image) { lefts.push_back(image); });
    size_t k = 0;
    right_.draw(some, [&](const Image& image) { take(together(lefts[k++], image)); });
  }
}

}  // namespace restage
