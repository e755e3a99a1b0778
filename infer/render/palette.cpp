#include "infer/render/palette.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace restage {
namespace {

/// Colours that share their upper five bits.
struct Bin {
  std::array<double, 3> sum{};  // of each channel
  double count = 0;
  double mean(size_t channel) const { return sum[channel] / count; }
};

struct ColourBox {
  std::vector<Bin> bins;

  double count() const {
    double out = 0;
    for (const Bin& bin : bins) out += bin.count;
    return out;
  }
  /// The channel in which the colours differ most, and by how much.
  std::pair<size_t, double> widest() const {
    std::pair<size_t, double> out{0, -1};
    for (size_t c = 0; c < 3; ++c) {
      const auto [low, high] =
          std::minmax_element(bins.begin(), bins.end(),
                              [&](const Bin& a, const Bin& b) { return a.mean(c) < b.mean(c); });
      if (high->mean(c) - low->mean(c) > out.second) out = {c, high->mean(c) - low->mean(c)};
    }
    return out;
  }
  double urgency() const { return bins.size() < 2 ? 0 : widest().second * std::pow(count(), 0.35); }
  /// Cuts off the half with the higher values.
  ColourBox cut() {
    const size_t c = widest().first;
    std::sort(bins.begin(), bins.end(),
              [&](const Bin& a, const Bin& b) { return a.mean(c) < b.mean(c); });
    const double half = count() / 2;
    size_t at = 1;
    for (double sum = bins[0].count; at + 1 < bins.size() && sum < half; ++at)
      sum += bins[at].count;
    ColourBox out;
    out.bins.assign(bins.begin() + static_cast<std::ptrdiff_t>(at), bins.end());
    bins.resize(at);
    return out;
  }
  Rgb mean() const {
    Rgb out{};
    for (size_t c = 0; c < 3; ++c) {
      double sum = 0;
      for (const Bin& bin : bins) sum += bin.sum[c];
      out[c] = static_cast<uint8_t>(std::lround(sum / count()));
    }
    return out;
  }
};

int square_distance(const Rgb& a, const Rgb& b) {
  int out = 0;
  for (size_t c = 0; c < 3; ++c) out += (a[c] - b[c]) * (a[c] - b[c]);
  return out;
}

/// Bayer's 8 x 8 matrix, from -0.5 to 0.5.
float threshold(int x, int y) {
  int value = 0;
  for (int bit = 0; bit < 3; ++bit) {
    const int u = (x >> bit) & 1, v = (y >> bit) & 1;
    value = 4 * value + 2 * (u ^ v) + v;
  }
  return (static_cast<float>(value) + 0.5f) / 64 - 0.5f;
}

}  // namespace

Palette::Palette(const std::vector<Image>& pictures, size_t count) {
  std::map<int, Bin> bins;
  std::map<Rgb, int64_t> frequent;
  for (const Image& picture : pictures)
    for (size_t k = 0; k + 2 < picture.rgb.size(); k += 3) {
      const Rgb p = {picture.rgb[k], picture.rgb[k + 1], picture.rgb[k + 2]};
      ++frequent[p];
      Bin& bin = bins[(p[0] >> 3) << 10 | (p[1] >> 3) << 5 | p[2] >> 3];
      for (size_t c = 0; c < 3; ++c) bin.sum[c] += p[c];
      bin.count += 1;
    }
  colours_.push_back(
      std::max_element(frequent.begin(), frequent.end(), [](const auto& a, const auto& b) {
        return a.second < b.second;
      })->first);
  std::vector<ColourBox> boxes(1);
  for (const auto& [key, bin] : bins) boxes[0].bins.push_back(bin);
  std::vector<double> urgencies = {boxes[0].urgency()};
  while (boxes.size() + 1 < count) {
    const auto most = std::max_element(urgencies.begin(), urgencies.end());
    if (*most <= 0) break;
    const auto at = static_cast<size_t>(most - urgencies.begin());
    boxes.push_back(boxes[at].cut());
    urgencies[at] = boxes[at].urgency();
    urgencies.push_back(boxes.back().urgency());
  }
  if (count > 1)
    for (const ColourBox& box : boxes) colours_.push_back(box.mean());
  known_.assign(size_t{1} << 18, -1);
}

uint8_t Palette::nearest(const Rgb& colour) {
  int16_t& known =
      known_[static_cast<size_t>((colour[0] >> 2) << 12 | (colour[1] >> 2) << 6 | colour[2] >> 2)];
  if (known < 0)
    known = static_cast<int16_t>(std::min_element(colours_.begin(), colours_.end(),
                                                  [&](const Rgb& a, const Rgb& b) {
                                                    return square_distance(a, colour) <
                                                           square_distance(b, colour);
                                                  }) -
                                 colours_.begin());
  return static_cast<uint8_t>(known);
}

std::vector<uint8_t> Palette::indices(const Image& picture) {
  constexpr int kNear = 12;  // square of a distance that nobody sees
  std::vector<uint8_t> out;
  out.reserve(picture.rgb.size() / 3);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const Rgb p = picture.at(x, y);
      if (square_distance(p, colours_[0]) <= kNear) {
        out.push_back(0);
        continue;
      }
      const uint8_t first = nearest(p);
      const int off = square_distance(p, colours_[first]);
      if (off <= kNear) {
        out.push_back(first);
        continue;
      }
      const float reach = 2.4f * std::min(std::sqrt(static_cast<float>(off)), 14.0f);
      Rgb moved;
      for (size_t c = 0; c < 3; ++c)
        moved[c] = static_cast<uint8_t>(
            std::clamp(static_cast<float>(p[c]) + reach * threshold(x, y), 0.0f, 255.0f));
      out.push_back(nearest(moved));
    }
  return out;
}

}  // namespace restage
