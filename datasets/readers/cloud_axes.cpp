#include "datasets/readers/cloud_axes.h"

#include <algorithm>
#include <array>
#include <utility>

#include "datasets/readers/errors.h"
#include "datasets/readers/npy.h"

namespace restage {
namespace {

constexpr int64_t kMostColumns = 12;   // x y z, normal, colour and some more
constexpr int64_t kFewestPoints = 64;  // of a cloud that is of use

/// Height and width of depth cameras' pictures.
constexpr std::array<std::pair<int64_t, int64_t>, 14> kPictures = {{{576, 640},
                                                                    {288, 320},
                                                                    {512, 512},
                                                                    {1024, 1024},
                                                                    {480, 640},
                                                                    {240, 320},
                                                                    {424, 512},
                                                                    {720, 1280},
                                                                    {1080, 1920},
                                                                    {480, 848},
                                                                    {360, 640},
                                                                    {192, 256},
                                                                    {180, 240},
                                                                    {1536, 2048}}};

bool is_picture(int64_t height, int64_t width) {
  return std::any_of(kPictures.begin(), kPictures.end(), [&](const auto& known) {
    return known == std::pair(height, width) || known == std::pair(width, height);
  });
}

bool are_columns(int64_t n) { return n > 3 && n <= kMostColumns; }

std::string first_three(int64_t columns) {
  return columns == 3
             ? ""
             : cat("of its ", columns, " columns the first three are taken for x, y and z");
}

CloudAxes cloud(int64_t points, int64_t point_step, int64_t axis_step, std::string remark) {
  CloudAxes out;
  out.points = points;
  out.point_step = point_step;
  out.axis_step = axis_step;
  out.remark = std::move(remark);
  return out;
}

CloudAxes sequence(int64_t frames, int64_t frame_step, CloudAxes each) {
  each.sequence = true;
  each.frames = frames;
  each.frame_step = frame_step;
  return each;
}

std::optional<CloudAxes> of_two(int64_t a, int64_t b) {
  if (b == 3 || (are_columns(b) && a > b)) return cloud(a, b, 1, first_three(b));
  if (a == 3 && b > kMostColumns)
    return cloud(b, 1, b, cat("its axes are taken for [xyz, ", b, " points]"));
  return std::nullopt;
}

std::optional<CloudAxes> of_three(int64_t a, int64_t b, int64_t c, int64_t vertices) {
  std::vector<CloudAxes> all;  // the likeliest first
  const auto either = [&](const CloudAxes& x, const CloudAxes& y) {
    const bool x_first = x.points == vertices || (y.points != vertices && x.points >= y.points);
    all.push_back(x_first ? x : y);
    all.push_back(x_first ? y : x);
  };
  if (c == 3 && is_picture(a, b))
    all.push_back(cloud(a * b, 3, 1,
                        cat("taken for one picture of a depth camera, ", a, " x ", b, " points")));
  if (c == 3) all.push_back(sequence(a, b * c, cloud(b, c, 1, "")));
  const auto said = [&](const char* order) { return cat("its axes are taken for ", order); };
  if (b == 3)
    either(sequence(c, 1, cloud(a, b * c, c, said("[points, xyz, frames]"))),
           sequence(a, b * c, cloud(c, 1, c, said("[frames, xyz, points]"))));
  if (a == 3)
    either(sequence(c, 1, cloud(b, c, b * c, said("[xyz, points, frames]"))),
           sequence(b, c, cloud(c, 1, b * c, said("[xyz, frames, points]"))));
  if (are_columns(c)) all.push_back(sequence(a, b * c, cloud(b, c, 1, first_three(c))));
  for (const CloudAxes& axes : all)
    if (axes.points >= kFewestPoints) return axes;
  return all.empty() ? std::nullopt : std::optional(all[0]);
}

}  // namespace

std::optional<CloudAxes> cloud_axes(const std::vector<int64_t>& shape, int64_t vertices) {
  std::vector<int64_t> axes = shape;
  for (auto at = axes.begin(); axes.size() > 3 && at != axes.end();)
    at = *at == 1 ? axes.erase(at) : at + 1;
  if (axes.size() == 2) return of_two(axes[0], axes[1]);
  if (axes.size() == 3) return of_three(axes[0], axes[1], axes[2], vertices);
  if (axes.size() != 4 || axes[3] != 3) return std::nullopt;
  const int64_t points = axes[1] * axes[2];
  return sequence(
      axes[0], 3 * points,
      cloud(points, 3, 1,
            cat("taken for pictures of a depth camera, ", axes[1], " x ", axes[2], " points")));
}

}  // namespace restage
