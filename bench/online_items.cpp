// Online frames: each part by itself, and whole frames as `restage retarget` does them.
#include <unistd.h>

#include "autograd/base/parallel_each.h"
#include "bench/items.h"
#include "bench/work.h"
#include "infer/retargeter.h"
#include "nn/models/registry.h"

namespace restage::bench {
namespace {

/// Plays the frames of the performance again and again.
class Frames {
 public:
  explicit Frames(int64_t count) : count_(count) {}
  int64_t next() { return at_++ % count_; }

 private:
  int64_t count_, at_ = 0;
};

Joints joints_of(const Tensor& t) {
  Joints out;
  for (size_t j = 0; j < kJoints; ++j)
    out[j] = Eigen::Map<const Point>(t.data<float>() + 3 * j).cast<double>();
  return out;
}

Points points_of(const Tensor& t) {
  Points out(static_cast<size_t>(t.numel() / 3));
  for (size_t i = 0; i < out.size(); ++i) out[i] = Eigen::Map<const Point>(t.data<float>() + 3 * i);
  return out;
}

class SkeletonOnline : public Item {
 public:
  SkeletonOnline(const Inputs& inputs, const std::string& variant, bool)
      : net_(make_model_as<SkeletonModel>("skeleton/point_transformer",
                                          model_config("skeleton/point_transformer"), Init{})),
        clouds_(inputs.at("frames.clouds")),
        frames_(clouds_.size(0)) {
    inputs.load(*net_, variant, "skeleton");
    make_dense(*net_, variant);
  }
  void run() override { joints_ = extract(frames_.next()); }
  std::vector<double> check() override {
    joints_ = extract(0);
    return summary(joints_);
  }

 private:
  Tensor extract(int64_t frame) {
    Context ctx;
    return net_->forward(ctx, clouds_.rows(frame, frame + 1)).joints.value;
  }
  std::shared_ptr<SkeletonModel> net_;
  Tensor clouds_, joints_;
  Frames frames_;
};

/// As large as the last cache, at least 64 and at most 512 MiB. LibTorch's program does the same.
int64_t flush_bytes() {
  const int64_t l3 = sysconf(_SC_LEVEL3_CACHE_SIZE);
  return std::clamp<int64_t>(l3, 64 << 20, 512 << 20);
}

/// Empties the caches between repetitions, so that weights have to come from memory.
class CacheFlush {
 public:
  /// Without `on`, run() is not to be called and no memory is taken.
  explicit CacheFlush(bool on) : buffer_(on ? static_cast<size_t>(flush_bytes() / 8) : 0) {}
  /// Reads and writes the whole buffer, all threads a part of it.
  void run() {
    const auto n = static_cast<int64_t>(buffer_.size());
    parallel_each(n, (n + threads() - 1) / threads(), [&](int64_t i) { buffer_[i] += 1; });
  }

 private:
  std::vector<int64_t> buffer_;
};

/// `flushed`: the weights come from memory, as they do when an extractor ran in between.
template <bool flushed>
class MotionOnline : public Item {
 public:
  MotionOnline(const Inputs& inputs, const std::string& variant, bool)
      : net_(SmrmConfig{}, Init{}),
        joints_(inputs.at("frames.joints")),
        rest_(inputs.at("target.joints").reshape({1, kJoints, 3})),
        trans_(Tensor::zeros({1, 1, 3})),
        frames_(joints_.size(0)) {
    inputs.load(net_, variant, "smrm");
  }
  void prepare() override {
    if (flushed) flush_.run();
  }
  void run() override { step(frames_.next()); }
  std::vector<double> check() override {
    for (int64_t i = 0; i < 3; ++i) step(i);
    return summary(answer_.joints.value);
  }

 private:
  void step(int64_t frame) {
    Context ctx;
    const Tensor joints = joints_.rows(frame, frame + 1).reshape({1, 1, kJoints, 3});
    answer_ = net_.forward(ctx, {joints, trans_, rest_, {}, {}}, &state_);
  }
  CacheFlush flush_{flushed};
  Smrm net_;
  Tensor joints_, rest_, trans_;
  MotionState state_;
  MotionOutput answer_;
  Frames frames_;
};

Bundle paper_models(const Inputs& inputs, const std::string& variant) {
  Bundle set;
  const auto fill = [&](const char* name, const char* file) {
    TrainedModel model{name, model_config(name), make_model(name, model_config(name), Init{}), {}};
    inputs.load(*model.net, variant, file);
    set.put(model_type(name).role, std::move(model));
  };
  fill("skeleton/point_transformer", "skeleton");
  fill("smrm/rot6d", "smrm");
  fill("deformation/weights", "weights");
  fill("deformation/offsets", "offsets");
  return set;
}

Mesh target_of(const Inputs& inputs) { return {points_of(inputs.at("target.points")), {}}; }

/// The target's points in one pose; the skinning weights are made once.
class DeformationOnline : public Item {
 public:
  DeformationOnline(const Inputs& inputs, const std::string& variant, bool)
      : surface_(paper_models(inputs, variant), "bench", target_of(inputs),
                 joints_of(inputs.at("target.joints"))),
        dense_(variant == "dense") {
    const Tensor& local = inputs.at("pairs.local");
    for (int64_t i = 0; i < local.size(0); ++i) {
      const float* r = local.data<float>() + i * kJoints * 9;
      for (size_t j = 0; j < kJoints; ++j) poses_[i].local[j] = matrix_at(r + 9 * j).cast<double>();
    }
  }
  void run() override { points_ = surface_(poses_[frames_.next()], dense_); }
  std::vector<double> check() override {
    points_ = surface_(poses_[0], dense_);
    return summary(tensor_of(points_));
  }

 private:
  Surface surface_;
  bool dense_;
  std::array<Pose, 4> poses_;
  Points points_;
  Frames frames_{4};
};

/// The papers take one choice of a cloud's points. Joints of untrained weights have no size that a
/// look at a cloud could follow.
RetargetOptions one_choice() {
  RetargetOptions out;
  out.samples = 1;
  out.any_size = false;
  out.any_way_up = false;
  return out;
}

/// Cloud in, posed target out.
class FrameOnline : public Item {
 public:
  FrameOnline(const Inputs& inputs, const std::string& variant, bool)
      : FrameOnline(inputs, paper_models(inputs, variant)) {}
  FrameOnline(const Inputs& inputs, const Bundle& models)
      : retargeter_(models, "bench", target_of(inputs), joints_of(inputs.at("target.joints")),
                    one_choice()) {
    const Tensor& clouds = inputs.at("frames.clouds");
    for (int64_t i = 0; i < clouds.size(0); ++i)
      clouds_.push_back(points_of(clouds.rows(i, i + 1)));
    frames_ = Frames(clouds.size(0));
  }
  static std::unique_ptr<Item> make_lite(const Inputs& inputs, const std::string&, bool) {
    return std::make_unique<FrameOnline>(inputs, load_bundle(inputs.lite()));
  }
  void run() override { push(frames_.next()); }
  /// Vertices of the third frame relative to the pelvis.
  std::vector<double> check() override {
    for (int64_t i = 0; i < 3; ++i) push(i);
    Points p = answer_.vertices;
    for (Point& x : p) x -= answer_.joints->front().cast<float>();
    return summary(tensor_of(p));
  }

 private:
  void push(int64_t frame) {
    retargeter_.push(clouds_[frame], "bench", [this](const RetargetedFrame& f) { answer_ = f; });
  }
  Retargeter retargeter_;
  std::vector<Points> clouds_;
  RetargetedFrame answer_;
  Frames frames_{1};
};

}  // namespace

std::vector<ItemInfo> online_items() {
  const double deformation = offsets_gflop(kSurfacePoints) + skinning_gflop(kSurfacePoints);
  return {ItemInfo("skeleton_online", "point transformer", "frame", 1, extractor_gflop(),
                   make_item<SkeletonOnline>, {"skeleton"}, {"dense"}),
          ItemInfo("smrm_online", "SMRM, caches flushed before every frame", "frame", 1,
                   motion_gflop(), make_item<MotionOnline<true>>),
          ItemInfo("smrm_online_warm", "SMRM, caches as the last frame left them", "frame", 1,
                   motion_gflop(), make_item<MotionOnline<false>>),
          ItemInfo("deformation_online", "offsets and skinning of 6,890 points", "frame", 1,
                   deformation, make_item<DeformationOnline>, {"offsets"}, {"dense"}),
          ItemInfo("frame_online", "whole frame, paper's models, one choice of points", "frame", 1,
                   extractor_gflop() + motion_gflop() + deformation, make_item<FrameOnline>,
                   {"skeleton", "offsets"}),
          ItemInfo("frame_online_lite", "whole frame, lite models, one choice of points", "frame",
                   1, 0, FrameOnline::make_lite, {}, {}, "lite")};
}

}  // namespace restage::bench
