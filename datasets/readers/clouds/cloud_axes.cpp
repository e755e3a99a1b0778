#include "datasets/readers/clouds/cloud_axes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "datasets/readers/arrays/npy.h"
#include "datasets/readers/clouds/point_path.h"
#include "datasets/readers/errors.h"

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

/// Of an array with an axis of numbers before that of the points, or pictures.
std::string channels_first(int64_t columns, const std::string& points, const char* before = "") {
  return columns == 3 ? cat("its axes are taken for [", before, "xyz, ", points, "]")
                      : cat("its axes are taken for [", before, columns, " numbers, ", points,
                            "], of the numbers the first three for x, y and z");
}

CloudAxes cloud(int64_t points, int64_t point_step, int64_t axis_step, std::string remark,
                int64_t columns = 3) {
  CloudAxes out;
  out.columns = columns;
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

std::optional<CloudAxes> of_two(int64_t a, int64_t b, int64_t vertices) {
  if (vertices > 1 && b > 3 && (b == 3 * vertices || a == 3 * vertices)) {
    const bool rows = b == 3 * vertices;
    const std::string remark =
        cat("its ", rows ? "rows" : "columns", " are taken for frames, x y z of ", vertices,
            " points one after the other");
    return rows ? sequence(a, b, cloud(vertices, 3, 1, remark))
                : sequence(b, 1, cloud(vertices, 3 * b, b, remark));
  }
  if (b == 3 || (are_columns(b) && a > b)) return cloud(a, b, 1, first_three(b), b);
  if ((a == 3 || are_columns(a)) && b > kMostColumns)
    return cloud(b, 1, b, channels_first(a, cat(b, " points")), a);
  return std::nullopt;
}

CloudAxes pictures(int64_t frames, int64_t height, int64_t width) {
  const int64_t points = height * width;
  return sequence(
      frames, 3 * points,
      cloud(points, 3, 1,
            cat("taken for pictures of a depth camera, ", height, " x ", width, " points")));
}

/// Training data: windows of so many frames.
CloudAxes windows(int64_t count, int64_t frames, int64_t points, int64_t columns) {
  const std::string also = first_three(columns);
  CloudAxes out = sequence(count * frames, columns * points,
                           cloud(points, columns, 1,
                                 cat("taken for ", count, " sequences of ", frames, " frames of ",
                                     points, " points", also.empty() ? "" : ", " + also),
                                 columns));
  out.sequences = std::max<int64_t>(count, 1);
  return out;
}

std::optional<CloudAxes> of_four(int64_t a, int64_t b, int64_t c, int64_t d) {
  if (d == 3 && is_picture(b, c)) return pictures(a, b, c);
  if (b == 3 && is_picture(c, d)) {
    const int64_t pixels = c * d;
    return sequence(a, 3 * pixels,
                    cloud(pixels, 1, pixels,
                          cat("taken for pictures of a depth camera, [frames, xyz, ", c, " x ", d,
                              " points]")));
  }
  if (d == 3 || (are_columns(d) && c >= kFewestPoints)) return windows(a, b, c, d);
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
  if (a == 3 && is_picture(b, c))
    all.push_back(
        cloud(b * c, 1, b * c,
              cat("taken for one picture of a depth camera, [xyz, ", b, " x ", c, " points]")));
  if (c == 3) all.push_back(sequence(a, b * c, cloud(b, c, 1, "")));
  const auto said = [&](const char* order) { return cat("its axes are taken for ", order); };
  if (b == 3)
    either(sequence(c, 1, cloud(a, b * c, c, said("[points, xyz, frames]"))),
           sequence(a, b * c, cloud(c, 1, c, said("[frames, xyz, points]"))));
  if (a == 3)
    either(sequence(c, 1, cloud(b, c, b * c, said("[xyz, points, frames]"))),
           sequence(b, c, cloud(c, 1, b * c, said("[xyz, frames, points]"))));
  if (are_columns(c)) all.push_back(sequence(a, b * c, cloud(b, c, 1, first_three(c), c)));
  if (are_columns(b) && c > kMostColumns)
    all.push_back(
        sequence(a, b * c, cloud(c, 1, c, channels_first(b, cat(c, " points"), "frames, "), b)));
  for (const CloudAxes& axes : all)
    if (axes.points >= kFewestPoints) return axes;
  return all.empty() ? std::nullopt : std::optional(all[0]);
}

// ---- what only the numbers tell ----------------------------------------------------------------

/// Equal steps upwards, as row numbers and times have them.
bool are_steps(const std::vector<double>& column) {
  if (column.size() < kFewestPoints) return false;
  const double step = (column.back() - column.front()) / static_cast<double>(column.size() - 1);
  if (!(step > 0)) return false;
  for (size_t i = 1; i < column.size(); ++i)
    if (!(std::abs(column[i] - column[i - 1] - step) < 0.02 * step)) return false;
  return true;
}

/// Whether the first number of the points, and not the second too, counts them: of the first frame,
/// at most of some thousand points.
bool are_numbered(const CloudAxes& axes, const ReadSteps& read) {
  const int64_t n = std::min<int64_t>(axes.points, 4096);
  const bool steps_are_points = !axes.sequence && axes.axis_step == 1;
  const bool steps_are_columns = !axes.sequence && axes.axis_step > 1;
  const std::vector<double> values = read(0, steps_are_points ? n : steps_are_columns ? 2 : 1);
  std::vector<double> first, second;
  for (int64_t i = 0; i < n; ++i) {
    first.push_back(values[i * axes.point_step]);
    second.push_back(values[i * axes.point_step + axes.axis_step]);
  }
  return are_steps(first) && !are_steps(second);
}

Points as_points(const std::vector<double>& values) {
  Points out(values.size() / 3);
  for (size_t i = 0; i < out.size(); ++i)
    for (size_t axis = 0; axis < 3; ++axis) out[i][axis] = static_cast<float>(values[3 * i + axis]);
  return out;
}

/// Whether the steps of the slowest axis of an array [A, B, 3] are points: each moves along a path,
/// or stays where it is while they lie far apart (and are not frames of somebody who runs far).
bool are_points(int64_t steps, const ReadSteps& read) {
  constexpr int64_t kLookedAt = 8;
  constexpr double kAnyStep = std::numeric_limits<double>::infinity();  // some have few frames
  constexpr size_t kShort = 8;                         // frames in which nobody gets far
  constexpr float kStays = 0.05f, kStaysShort = 0.3f;  // times the distance between points
  Point low = Point::Constant(std::numeric_limits<float>::infinity()), high = -low;
  float moved = 0;
  int64_t paths = 0;
  bool is_short = false;
  Points firsts;
  for (int64_t k = 0; k < kLookedAt; ++k) {
    const Points at = as_points(read(k * steps / kLookedAt, 1));
    is_short = at.size() < kShort;
    Point least = at[0], most = at[0];
    for (const Point& p : at) {
      least = least.cwiseMin(p);
      most = most.cwiseMax(p);
    }
    low = low.cwiseMin(at[0]);
    high = high.cwiseMax(at[0]);
    firsts.push_back(at[0]);
    moved = std::max(moved, (most - least).norm());
    paths += is_path(at, kAnyStep);
  }
  if (4 * paths >= 3 * kLookedAt) return true;
  return !is_path(firsts, kAnyStep) &&
         moved < (is_short ? kStaysShort : kStays) * (high - low).norm();
}

/// Whether `rows` rows of points are those of a depth camera's picture: neighbours lie side by
/// side, and most rows are thin strips of the whole. (The frames of a sequence are people, each
/// whole.)
bool is_picture_by_numbers(const std::vector<double>& values, int64_t rows, int64_t columns) {
  constexpr int64_t kLeastSide = 32, kMostAspect = 3;
  constexpr float kThin = 0.15f, kNear = 0.1f;  // of the whole
  if (std::min(rows, columns) < kLeastSide) return false;
  if (std::max(rows, columns) > kMostAspect * std::min(rows, columns)) return false;
  const Points points = as_points(values);
  Eigen::AlignedBox3f all;
  std::vector<Eigen::AlignedBox3f> boxes;
  std::vector<float> steps;
  for (int64_t r = 0; r < rows; ++r) {
    Eigen::AlignedBox3f box;
    const Point* before = nullptr;
    for (int64_t c = 0; c < columns; ++c) {
      const Point& p = points[static_cast<size_t>(r * columns + c)];
      if (!p.allFinite() || p.isZero(0)) {  // the camera saw nothing there
        before = nullptr;
        continue;
      }
      box.extend(p);
      if (before != nullptr) steps.push_back((p - *before).norm());
      before = &p;
    }
    if (box.isEmpty()) continue;
    all.extend(box);
    boxes.push_back(box);
  }
  if (boxes.empty() || steps.empty()) return false;
  const auto thin = std::count_if(boxes.begin(), boxes.end(), [&](const Eigen::AlignedBox3f& box) {
    return (box.sizes().array() / all.sizes().array().max(1e-9f)).minCoeff() < kThin;
  });
  std::nth_element(steps.begin(), steps.begin() + std::ssize(steps) / 2, steps.end());
  return 2 * thin > std::ssize(boxes) && steps[steps.size() / 2] < kNear * all.diagonal().norm();
}

}  // namespace

CloudAxes axes_by_numbers(CloudAxes axes, const std::vector<int64_t>& shape, const ReadSteps& read,
                          int64_t vertices) {
  if (axes.points == 0 || axes.frames == 0) return axes;
  if (axes.sequences > 1 && axes.columns == 3) {
    const int64_t rows = axes.frames / axes.sequences;
    if (is_picture_by_numbers(read(0, 1), rows, axes.points))
      return pictures(axes.sequences, rows, axes.points);
  }
  if (axes.columns > 3 && are_numbered(axes, read)) {
    axes.skipped = 1;
    axes.remark = cat("the first of its ", axes.columns,
                      " columns numbers the points: the three behind it are taken for x, y and z");
  }
  const bool plain = axes.sequence && shape.size() == 3 && shape[2] == 3 &&
                     axes.frames == shape[0] && axes.points == shape[1];
  const bool likely = plain && vertices == 0 && shape[0] >= kFewestPoints && shape[1] > 1;
  if (likely ? are_points(shape[0], read)
             : plain && vertices > 0 && vertices == shape[0] && vertices != shape[1])
    return sequence(
        shape[1], 3,
        cloud(shape[0], 3 * shape[1], 1,
              cat("its axes are taken for [", shape[0], " points, ", shape[1], " frames, xyz]")));
  return axes;
}

std::optional<std::string> flat_mend(const std::vector<int64_t>& shape) {
  if (shape.empty() || shape.size() > 2 || shape.back() % 3 != 0 || shape.back() <= kMostColumns)
    return std::nullopt;
  const int64_t points = shape.back() / 3;
  const std::string form =
      shape.size() == 1 ? cat("(", points, ", 3)") : cat("(", shape[0], ", ", points, ", 3)");
  return cat("if ", shape.size() == 1 ? "it" : "each row", " holds x y z of ", points,
             " points one after the other, save array.reshape", form);
}

bool rows_are_frames(const CloudAxes& axes, const std::vector<int64_t>& shape,
                     const ReadSteps& read) {
  constexpr double kNear = 0.4;  // times the distance from the mean number
  const bool channels = shape.size() == 2 && !axes.sequence && axes.axis_step > 1;
  if (!channels || axes.columns == 3 || shape[1] % 3 != 0) return false;
  const auto n = static_cast<size_t>(shape[1]);
  const std::vector<double> rows = read(0, 3);
  double mean = 0, spread = 0;
  for (size_t i = 0; i < n; ++i) mean += rows[i] / static_cast<double>(n);
  for (size_t i = 0; i < n; ++i) spread += std::abs(rows[i] - mean);
  for (const size_t row : {0, 1}) {
    double change = 0;
    for (size_t i = 0; i < n; ++i) change += std::abs(rows[(row + 1) * n + i] - rows[row * n + i]);
    if (!(change < kNear * spread)) return false;
  }
  return true;
}

std::optional<CloudAxes> cloud_axes(const std::vector<int64_t>& shape, int64_t vertices) {
  std::vector<int64_t> axes = shape;
  for (auto at = axes.begin(); axes.size() > 3 && at != axes.end();)
    at = *at == 1 ? axes.erase(at) : at + 1;
  if (axes.size() == 2) return of_two(axes[0], axes[1], vertices);
  if (axes.size() == 3) return of_three(axes[0], axes[1], axes[2], vertices);
  if (axes.size() == 4) return of_four(axes[0], axes[1], axes[2], axes[3]);
  return std::nullopt;
}

}  // namespace restage
