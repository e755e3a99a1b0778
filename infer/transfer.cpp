#include "infer/transfer.h"

#include <algorithm>
#include <numeric>

#include "autograd/base/error.h"
#include "autograd/base/format.h"
#include "autograd/ops/layout.h"
#include "infer/cloud_input.h"
#include "nn/geometry/box.h"

namespace restage {
namespace {

void move(Points& points, const Point& by) {
  for (Point& p : points) p += by;
}

/// Puts the middle of the floor of the points' box to `below`.
void stand(Points& points, const Point& below) {
  const Box box = box_of(points);
  move(points, below - Point(box.center().x(), box.min().y(), box.center().z()));
}

Points in_order(const Points& points, const std::vector<int32_t>& order) {
  Points out;
  for (const int32_t i : order) out.push_back(points[static_cast<size_t>(i)]);
  return out;
}

/// All numbers below `count`.
std::vector<int32_t> all_of(size_t count) {
  std::vector<int32_t> out(count);
  std::iota(out.begin(), out.end(), 0);
  return out;
}

/// The vertices of the target that the network is shown, in this order. A training that thinned
/// bodies has noted to how many vertices, and, where they had to correspond, to which.
std::vector<int32_t> shown_vertices(const TrainedModel& model, bool corresponding,
                                    const Points& target, const std::string& weights_name,
                                    const RngKey& key) {
  const auto trained = static_cast<size_t>(trained_vertices(model, weights_name));
  if (corresponding && trained > 0) return kept_vertices(model, weights_name);
  std::vector<int32_t> out = trained > 0 && trained < target.size() ? evenly_spread(target, trained)
                                                                    : all_of(target.size());
  if (corresponding) return out;
  if (out.size() < EmbeddedMesh::kFewest) out = all_of(target.size());  // the others coincide
  Rng rng(key);
  for (size_t i = 0; i < out.size(); ++i) std::swap(out[i], out[i + rng.below(out.size() - i)]);
  return out;
}

}  // namespace

bool needs_correspondence(const Bundle& weights) {
  const auto* model = weights.find_as<TransferModel>("transfer");
  return model != nullptr && model->corresponding();
}

Transfer::Transfer(const Bundle& weights, const std::string& weights_name, Mesh target,
                   const std::string& where, const RetargetOptions& options)
    : target_(std::move(target)), seed_(options.seed) {
  const TrainedModel& found = weights.need("transfer", weights_name);
  model_ = std::dynamic_pointer_cast<TransferModel>(found.net);
  if (model_ == nullptr) weights.need_as<TransferModel>("transfer", weights_name);
  if (target_.vertices.size() < 2)
    throw InputError(where,
                     "has " + std::string(target_.vertices.empty() ? "no" : "one") + " vertex",
                     "give a mesh or a cloud");
  Points centred = target_.vertices;
  const Box box = box_of(centred);
  height_ = box.sizes().y();
  move(centred, -box.center());
  const std::vector<int32_t> shown =
      shown_vertices(found, model_->corresponding(), centred, weights_name,
                     RngKey{seed_, 0}.fold("transfer.vertices"));
  const int64_t whole = kept_of(found, weights_name);
  if (whole > 0 && whole != std::ssize(centred)) refuse_mesh(where, weights_name);
  for (const int32_t i : shown)
    if (i >= std::ssize(centred)) refuse_mesh(where, weights_name);
  if (shown.size() < std::min(EmbeddedMesh::kFewest, centred.size()))
    refuse_mesh(where, weights_name);
  points_ = trained_points(found, weights_name);
  if (points_ == 0 || model_->equal_counts()) points_ = std::ssize(shown);
  identity_ =
      tensor_of_points(in_order(centred, shown), {1, std::ssize(shown), 3}).to(device_of(*model_));
  if (model_->corresponding()) try {
      Context ctx;
      const Shape window = {1, model_->frames(), points_, 3};
      model_->forward(ctx, {Tensor::zeros(window, DType::f32, identity_.device()), identity_});
    } catch (const ShapeError&) {
      refuse_mesh(where, weights_name);
    }
  embedded_.emplace(target_.vertices, shown);
}

/// The network was trained on a mesh of one kind, and the target is another.
void Transfer::refuse_mesh(const std::string& where, const std::string& weights_name) const {
  throw InputError(where,
                   "has " + std::to_string(target_.vertices.size()) + " vertices, and " +
                       weights_name + " holds a network for another mesh",
                   "give a target of the mesh that the network was trained on");
}

/// What the network is given of a cloud: some of it, or the vertices that it needs.
Points Transfer::seen_of(const Points& cloud, const std::string& source) const {
  if (!model_->corresponding())
    return some_of(cloud, static_cast<size_t>(points_), RngKey{seed_, 0}.fold("transfer.points"));
  if (cloud.size() != target_.vertices.size())
    throw InputError(source,
                     "has " + std::to_string(cloud.size()) +
                         " points that can be used, and this network needs the target's " +
                         std::to_string(target_.vertices.size()) + " vertices in their order",
                     "give meshes of the source that correspond to the target, or weights of "
                     "another model");
  return in_order(cloud, embedded_->nodes());
}

/// The last clouds as the network takes them, [1, t, points, 3].
Tensor Transfer::seen_window() const {
  const int64_t t = model_->frames();
  Points all;
  for (int64_t k = 0; k < t; ++k) {
    const auto back = static_cast<size_t>(t - 1 - k);
    const Points& frame = back < window_.size() ? window_[window_.size() - 1 - back] : window_[0];
    all.insert(all.end(), frame.begin(), frame.end());
  }
  return tensor_of_points(all, {1, t, points_, 3}).to(identity_.device());
}

/// All vertices of the target, from those that the network moved, [..., v, 3].
Points Transfer::of_all(const Tensor& moved) const {
  const Tensor made = moved.cpu();
  const int64_t v = made.size(2);
  const float* from = made.data<float>() + 3 * v * (made.size(1) - 1);
  Points out(static_cast<size_t>(v));
  for (size_t i = 0; i < out.size(); ++i) out[i] = Eigen::Map<const Point>(from + 3 * i);
  return (*embedded_)(out);
}

void Transfer::mix(const RetargetedFrame& before, double share, RetargetedFrame& frame) const {
  const auto t = static_cast<float>(share);
  Context ctx;
  if (const auto made =
          model_->between(ctx, {concat({before_.window, now_.window}, 0), identity_}, t)) {
    frame.vertices = of_all(made->value);
    stand(frame.vertices, (1 - t) * before_.below + t * now_.below);
  } else {
    for (size_t i = 0; i < frame.vertices.size(); ++i)
      frame.vertices[i] = (1 - t) * before.vertices[i] + t * frame.vertices[i];
  }
}

void Transfer::answer(const Points& cloud, const std::string& source, const Show& show) {
  require_body(cloud, source);
  {
    const Stopwatch watch(&times_.deformation);
    perform(cloud, source);
  }
  show_after_gap(missed(), frame_, show);
}

/// The frame of a cloud.
void Transfer::perform(const Points& cloud, const std::string& source) {
  const Box there = box_of(cloud);
  tallest_ = std::max(tallest_, there.sizes().y());
  Points seen = seen_of(cloud, source);
  move(seen, -there.center());
  window_.push_back(std::move(seen));
  while (std::ssize(window_) > model_->frames()) window_.pop_front();
  before_ = std::move(now_);
  Context ctx;
  now_.window = seen_window();
  frame_.vertices = of_all(model_->forward(ctx, {now_.window, identity_, true}).value);
  const float scale = tallest_ > 0 ? height_ / tallest_ : 1;
  now_.below =
      Point(scale * there.center().x(), scale * there.min().y(), scale * there.center().z());
  stand(frame_.vertices, now_.below);
}

void Transfer::forget() {
  EachCloud::forget();
  window_.clear();
  tallest_ = 0;
}

}  // namespace restage
