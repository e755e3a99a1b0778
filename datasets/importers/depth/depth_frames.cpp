#include "datasets/importers/depth/depth_frames.h"

#include <algorithm>
#include <cmath>

#include "autograd/base/format.h"
#include "datasets/readers/errors.h"

namespace restage {
namespace {

constexpr int64_t kMostKept = 20000, kMostLooked = 40000;   // points of a frame
constexpr int64_t kLooks = 40;                              // frames that tell the background
constexpr double kNearestRoom = 0.05, kFarthestRoom = 200;  // metres: usual depths

/// The smallest step whose grid has `most` pixels at most.
int grid_step(int width, int height, int64_t most) {
  int step = 1;
  while (int64_t{(width + step - 1) / step} * ((height + step - 1) / step) > most) ++step;
  return step;
}

/// InputError for depths in another unit.
void check_unit(const DepthPicture& picture, double scale) {
  std::vector<float> seen;
  for (const float depth : picture.depth)
    if (depth > 0) seen.push_back(depth);
  if (seen.empty()) return;
  std::nth_element(seen.begin(), seen.begin() + std::ssize(seen) / 2, seen.end());
  const double usual = seen[seen.size() / 2];
  if (usual > kNearestRoom && usual < kFarthestRoom) return;
  throw InputError(picture.source,
                   format("is %.4g m deep with %.4g m a unit, which no room is", usual, scale),
                   "give the metres a unit as {depth-scale} (millimetres 0.001; TUM 0.0002), or "
                   "{force}");
}

}  // namespace

DepthFrames::DepthFrames(std::unique_ptr<DepthPictures> pictures, const Intrinsics& camera,
                         bool keep_background, bool force)
    : pictures_(std::move(pictures)), camera_(camera) {
  const DepthPicture first = pictures_->picture(0);
  width_ = first.width, height_ = first.height;
  camera_ = fitted_to(camera, width_, height_, first.source, force);
  if (!force) check_unit(first, pictures_->scale());
  step_ = grid_step(width_, height_, keep_background ? kMostKept : kMostLooked);
  if (!keep_background) look_around();
}

void DepthFrames::look_around() {
  const auto cells = static_cast<size_t>((width_ + step_ - 1) / step_) *
                     static_cast<size_t>((height_ + step_ - 1) / step_);
  background_.emplace(cells);
  const int64_t n = std::min(frames(), kLooks);
  for (int64_t k = 0; k < n; ++k) {
    DepthPicture picture;
    try {
      picture = pictures_->picture(k * frames() / n);
    } catch (const InputError&) {
      continue;  // next() says so
    }
    if (picture.width == width_ && picture.height == height_) background_->look(points_of(picture));
  }
  background_->settle();
}

PicturePoints DepthFrames::points_of(const DepthPicture& picture) const {
  PicturePoints out;
  size_t cell = 0;
  for (int v = 0; v < height_; v += step_)
    for (int u = 0; u < width_; u += step_, ++cell) {
      const double z =
          picture
              .depth[static_cast<size_t>(v) * static_cast<size_t>(width_) + static_cast<size_t>(u)];
      if (!(z > 0)) continue;
      const Vec3 seen((u - camera_.cx) * z / camera_.fx, (v - camera_.cy) * z / camera_.fy, z);
      out.points.push_back(Vec3(seen.x(), -seen.y(), -seen.z()).cast<float>());
      out.cell.push_back(cell);
      out.depth.push_back(static_cast<float>(z));
    }
  return out;
}

std::optional<Frame> DepthFrames::next() {
  if (at_ == frames()) return std::nullopt;
  Frame frame;
  DepthPicture picture;
  try {
    picture = pictures_->picture(at_++);
  } catch (const InputError& error) {
    if (frames() == 1) throw;
    faulty_ = true;
    frame.fault = error;
    frame.source = error.where();
    return frame;
  }
  frame.source = picture.source;
  faulty_ = faulty_ || picture.width != width_ || picture.height != height_;
  if (picture.width != width_ || picture.height != height_)
    throw InputError(picture.source,
                     cat("is ", picture.width, " x ", picture.height, ", but the first is ", width_,
                         " x ", height_),
                     "give the pictures of one camera alone");
  const PicturePoints seen = points_of(picture);
  frame.points = background_ ? background_->person_in(seen) : seen.points;
  somebody_ = somebody_ || !frame.points.empty();
  const size_t n = frame.points.size(), most = static_cast<size_t>(kMostKept);
  for (size_t i = 0; n > most && i < most; ++i) frame.points[i] = frame.points[i * n / most];
  frame.points.resize(std::min(n, most));
  if (!background_ || !background_->floor()) return frame;
  const FlatPlane& floor = *background_->floor();
  const Mat3 level =
      Eigen::Quaterniond::FromTwoVectors(floor.normal, Vec3::UnitY()).toRotationMatrix();
  for (Point& p : frame.points)
    p = (level * p.cast<double>() - floor.offset * Vec3::UnitY()).cast<float>();
  return frame;
}

void DepthFrames::rewind() {
  at_ = 0;
  somebody_ = faulty_ = false;
  if (background_) background_->restart();
}

double DepthFrames::fps() const {
  if (const auto stated = pictures_->fps()) return *stated;
  return camera_.fps > 0 ? camera_.fps : kFps;
}

void DepthFrames::tell(ImportReport& report) const {
  report.fact("depth", format("%s, %d x %d, %.6g m a unit ({depth-scale})",
                              pictures_->kind().c_str(), width_, height_, pictures_->scale()));
  report.fact("camera", format("fx %.6g, fy %.6g, cx %.6g, cy %.6g pixels", camera_.fx, camera_.fy,
                               camera_.cx, camera_.cy));
  report.fact("pixels",
              step_ == 1 ? std::string("all") : cat("one of ", step_, " in each row and column"));
  if (!background_) report.fact("background", "kept");
}

std::vector<std::string> DepthFrames::remarks() const {
  std::vector<std::string> out = pictures_->remarks();
  if (!background_) return out;
  out.push_back("removed of all points ({keep-background} leaves them): " + background_->removed());
  if (const auto& floor = background_->floor()) {
    const double turned = std::acos(std::clamp(floor->normal.y(), -1.0, 1.0)) * 180 / M_PI;
    out.push_back(
        format("the floor is in view: turned by %.1f degrees so that it is level, and "
               "it is y = 0",
               turned));
  }
  return out;
}

}  // namespace restage
