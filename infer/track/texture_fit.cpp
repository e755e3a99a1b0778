#include "infer/track/texture_fit.h"

#include <algorithm>
#include <cmath>

#include "infer/registration/nearest_detail.h"

namespace restage {
namespace {

constexpr double kColourReach = 0.01;  // metres from a texel to a point that colours it
constexpr size_t kColourPoints = 4;    // that colour a texel together
constexpr int kSpreadRounds = 400;     // in which colours go from vertex to vertex
constexpr int kBorderRounds = 4;       // texels by which charts are made wider
constexpr float kUnknownColour = -1;

uint8_t byte_of(float x) {
  return static_cast<uint8_t>(std::lround(255 * std::clamp(x, 0.0f, 1.0f)));
}

bool known_colour(const PointColour& c) { return c[0] >= 0; }

}  // namespace

TextureFit::TextureFit(Mesh mesh, Atlas atlas, int size)
    : mesh_(std::move(mesh)), atlas_(std::move(atlas)), size_(size) {
  const std::vector<int32_t> faces = atlas_faces(atlas_, size_);
  for (size_t at = 0; at < faces.size(); ++at) {
    if (faces[at] < 0) continue;
    const auto& corners = atlas_.corners[static_cast<size_t>(faces[at])];
    const auto place = [&](size_t k) {
      return atlas_.places[static_cast<size_t>(corners[k])].cast<double>().eval();
    };
    const auto width = static_cast<size_t>(size_);
    const Eigen::Vector2d p((static_cast<double>(at % width) + 0.5) / size_,
                            1 - (static_cast<double>(at / width) + 0.5) / size_);
    Eigen::Matrix2d edges;
    edges << place(1) - place(0), place(2) - place(0);
    const Eigen::Vector2d by = edges.inverse() * (p - place(0));
    texels_.push_back(
        {faces[at],
         {static_cast<float>(1 - by.sum()), static_cast<float>(by[0]), static_cast<float>(by[1])}});
    places_.push_back(at);
  }
  samples_.resize(texels_.size());
}

void TextureFit::add(const std::vector<Vec3>& vertices, const std::vector<Vec3>& points,
                     const std::vector<PointColour>& colours) {
  if (points.empty()) return;
  const NearestPoint find(points);
  for (size_t t = 0; t < texels_.size(); ++t) {
    const Triangle& face = mesh_.faces[static_cast<size_t>(texels_[t].face)];
    Vec3 at = Vec3::Zero();
    for (size_t k = 0; k < 3; ++k)
      at += double{texels_[t].share[k]} * vertices[static_cast<size_t>(face[k])];
    double sum = 0;
    std::array<double, 3> mixed{};
    for (const uint32_t i : find.nearest(at, kColourPoints)) {
      const double squared = (points[i] - at).squaredNorm();
      if (squared > kColourReach * kColourReach) continue;
      const double weight = 1 / (squared + 1e-6);
      for (size_t k = 0; k < 3; ++k) mixed[k] += weight * double{colours[i][k]};
      sum += weight;
    }
    if (sum == 0) continue;
    std::array<uint8_t, 3>& sample = samples_[t].emplace_back();
    for (size_t k = 0; k < 3; ++k) sample[k] = byte_of(static_cast<float>(mixed[k] / sum));
  }
}

double TextureFit::seen() const {
  const auto count = std::count_if(samples_.begin(), samples_.end(),
                                   [](const auto& some) { return !some.empty(); });
  return samples_.empty() ? 0 : static_cast<double>(count) / static_cast<double>(samples_.size());
}

PointColour TextureFit::median_of(size_t texel) const {
  const auto& all = samples_[texel];
  if (all.empty()) return {kUnknownColour, kUnknownColour, kUnknownColour};
  PointColour out{};
  for (size_t k = 0; k < 3; ++k) {
    std::vector<uint8_t> channel;
    for (const auto& sample : all) channel.push_back(sample[k]);
    const auto middle = channel.begin() + std::ssize(channel) / 2;
    std::nth_element(channel.begin(), middle, channel.end());
    out[k] = static_cast<float>(*middle) / 255.0f;
  }
  return out;
}

/// The mean of what the texels about each vertex have; where none has a colour, what its
/// neighbours have.
std::vector<PointColour> TextureFit::vertex_colours(const std::vector<PointColour>& seen) const {
  const size_t count = mesh_.vertices.size();
  std::vector<PointColour> sums(count, PointColour{}), out(count);
  std::vector<float> weights(count, 0.0f);
  for (size_t t = 0; t < texels_.size(); ++t) {
    if (!known_colour(seen[t])) continue;
    const Triangle& face = mesh_.faces[static_cast<size_t>(texels_[t].face)];
    for (size_t k = 0; k < 3; ++k) {
      const auto v = static_cast<size_t>(face[k]);
      const float w = std::max(texels_[t].share[k], 0.0f);
      for (size_t c = 0; c < 3; ++c) sums[v][c] += w * seen[t][c];
      weights[v] += w;
    }
  }
  std::vector<bool> known(count);
  for (size_t v = 0; v < count; ++v) {
    known[v] = weights[v] > 0;
    for (size_t c = 0; c < 3; ++c) out[v][c] = known[v] ? sums[v][c] / weights[v] : kUnknownColour;
  }
  for (int round = 0; round < kSpreadRounds; ++round) {
    std::vector<PointColour> next(count, PointColour{});
    std::vector<float> of(count, 0.0f);
    for (const Triangle& face : mesh_.faces)
      for (size_t k = 0; k < 3; ++k) {
        const auto to = static_cast<size_t>(face[k]);
        for (const size_t other : {(k + 1) % 3, (k + 2) % 3}) {
          const PointColour& from = out[static_cast<size_t>(face[other])];
          if (known[to] || !known_colour(from)) continue;
          for (size_t c = 0; c < 3; ++c) next[to][c] += from[c];
          of[to] += 1;
        }
      }
    for (size_t v = 0; v < count; ++v)
      if (of[v] > 0)
        for (size_t c = 0; c < 3; ++c) out[v][c] = next[v][c] / of[v];
  }
  for (PointColour& colour : out)
    if (!known_colour(colour)) colour = {0.5f, 0.5f, 0.5f};
  return out;
}

Image TextureFit::picture() const {
  std::vector<PointColour> colours(texels_.size());
  for (size_t t = 0; t < texels_.size(); ++t) colours[t] = median_of(t);
  const std::vector<PointColour> around = vertex_colours(colours);
  const auto width = static_cast<size_t>(size_);
  std::vector<PointColour> all(width * width, {kUnknownColour, kUnknownColour, kUnknownColour});
  for (size_t t = 0; t < texels_.size(); ++t) {
    if (!known_colour(colours[t])) {
      const Triangle& face = mesh_.faces[static_cast<size_t>(texels_[t].face)];
      colours[t] = {};
      for (size_t k = 0; k < 3; ++k)
        for (size_t c = 0; c < 3; ++c)
          colours[t][c] += texels_[t].share[k] * around[static_cast<size_t>(face[k])][c];
      for (float& x : colours[t]) x = std::max(x, 0.0f);
    }
    all[places_[t]] = colours[t];
  }
  for (int round = 0; round < kBorderRounds; ++round) {
    const std::vector<PointColour> before = all;
    for (size_t at = 0; at < all.size(); ++at) {
      if (known_colour(before[at])) continue;
      PointColour sum{};
      float count = 0;
      for (const std::ptrdiff_t step :
           {std::ptrdiff_t{-1}, std::ptrdiff_t{1}, -std::ptrdiff_t{size_}, std::ptrdiff_t{size_}}) {
        const std::ptrdiff_t near = static_cast<std::ptrdiff_t>(at) + step;
        if (near < 0 || near >= std::ssize(all) || !known_colour(before[static_cast<size_t>(near)]))
          continue;
        for (size_t c = 0; c < 3; ++c) sum[c] += before[static_cast<size_t>(near)][c];
        count += 1;
      }
      if (count > 0)
        for (size_t c = 0; c < 3; ++c) all[at][c] = sum[c] / count;
    }
  }
  Image out(size_, size_, {128, 128, 128});
  for (size_t at = 0; at < all.size(); ++at)
    for (size_t c = 0; c < 3 && known_colour(all[at]); ++c)
      out.rgb[3 * at + c] = byte_of(all[at][c]);
  return out;
}

}  // namespace restage
