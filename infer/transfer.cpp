#include "infer/transfer.h"

#include <algorithm>
#include <chrono>
#include <numeric>

#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "infer/cloud_input.h"
#include "nn/geometry/box.h"

namespace restage {
namespace {

void move(Points& points, const Point& by) {
  for (Point& p : points) p += by;
}

}  // namespace

Transfer::Transfer(const Bundle& weights, const std::string& weights_name, Mesh target,
                   const std::string& where, const RetargetOptions& options)
    : target_(std::move(target)), seed_(options.seed) {
  const TrainedModel& found = weights.need("transfer", weights_name);
  model_ = std::dynamic_pointer_cast<TransferModel>(found.net);
  if (model_ == nullptr) weights.need_as<TransferModel>("transfer", weights_name);
  if (model_->corresponding())
    throw InputError(
        weights_name,
        "holds " + found.model + ", which needs the source's points in the target's order",
        "give weights of another model");
  if (options.fps != kFps)
    throw InputError("",
                     format("the source has %g frames a second, and this system answers each cloud",
                            options.fps),
                     "give clouds at 30 frames a second");
  if (target_.vertices.empty())
    throw InputError(where, "has no vertices", "give a mesh or a cloud");
  points_ = trained_points(found, weights_name);
  if (points_ == 0 || model_->equal_counts()) points_ = std::ssize(target_.vertices);
  Points centred = target_.vertices;
  const Box box = box_of(centred);
  height_ = box.sizes().y();
  move(centred, -box.center());
  order_.resize(centred.size());
  std::iota(order_.begin(), order_.end(), size_t{0});
  Rng rng(RngKey{seed_, 0}.fold("transfer.vertices"));
  for (size_t i = 0; i < order_.size(); ++i)
    std::swap(order_[i], order_[i + rng.below(order_.size() - i)]);
  Points shuffled;
  for (const size_t i : order_) shuffled.push_back(centred[i]);
  identity_ = tensor_of_points(shuffled, {1, std::ssize(shuffled), 3}).to(device_of(*model_));
}

Points Transfer::answer() {
  const int64_t t = model_->frames();
  Points all;
  for (int64_t k = 0; k < t; ++k) {
    const auto back = static_cast<size_t>(t - 1 - k);
    const Points& frame = back < window_.size() ? window_[window_.size() - 1 - back] : window_[0];
    all.insert(all.end(), frame.begin(), frame.end());
  }
  Context ctx;
  const Tensor pose = tensor_of_points(all, {1, t, points_, 3}).to(identity_.device());
  const Tensor made = model_->forward(ctx, {pose, identity_, true}).value.cpu();
  const int64_t v = made.size(2);
  Points out(static_cast<size_t>(v));
  const float* from = made.data<float>() + 3 * v * (made.size(1) - 1);
  for (size_t i = 0; i < out.size(); ++i) out[order_[i]] = Eigen::Map<const Point>(from + 3 * i);
  return out;
}

std::span<const RetargetedFrame> Transfer::push(const Points& cloud, const std::string& source) {
  require_body(cloud, source);
  const auto begun = std::chrono::steady_clock::now();
  const Box there = box_of(cloud);
  tallest_ = std::max(tallest_, there.sizes().y());
  Points seen =
      some_of(cloud, static_cast<size_t>(points_), RngKey{seed_, 0}.fold("transfer.points"));
  move(seen, -there.center());
  window_.push_back(std::move(seen));
  while (std::ssize(window_) > model_->frames()) window_.pop_front();
  Points posed = answer();
  const Box box = box_of(posed);
  const float scale = tallest_ > 0 ? height_ / tallest_ : 1;
  const Point below(scale * there.center().x(), scale * there.min().y(),
                    scale * there.center().z());
  move(posed, below - Point(box.center().x(), box.min().y(), box.center().z()));
  frames_.clear();
  for (int64_t k = 1; k <= missed_; ++k) {
    const float share = static_cast<float>(k) / static_cast<float>(missed_ + 1);
    RetargetedFrame& filled = frames_.emplace_back();
    filled.vertices = posed;
    for (size_t i = 0; shown_ && i < posed.size(); ++i)
      filled.vertices[i] = (1 - share) * (*shown_)[i] + share * posed[i];
    filled.filled = true;
  }
  missed_ = 0;
  frames_.emplace_back().vertices = posed;
  shown_ = std::move(posed);
  times_.deformation =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  return frames_;
}

std::span<const RetargetedFrame> Transfer::finish() {
  frames_.clear();
  for (; shown_ && missed_ > 0; --missed_) {
    RetargetedFrame& filled = frames_.emplace_back();
    filled.vertices = *shown_;
    filled.filled = true;
  }
  return frames_;
}

void Transfer::restart() {
  window_.clear();
  shown_.reset();
  missed_ = 0;
  tallest_ = 0;
}

}  // namespace restage
