#include "items.h"

#include <ATen/Parallel.h>
#include <unistd.h>

#include "extractors.h"
#include "motion.h"
#include "training.h"
#include "transfers.h"

namespace bench {
namespace {

double rate_of(bool dropout, double p) { return dropout ? p : 0; }

std::vector<double> summary(const Tensor& x) {
  const Tensor flat = x.contiguous().flatten();
  const int64_t n = flat.numel();
  return {flat.abs().sum(torch::kDouble).item<double>(), flat[n / 3].item<double>(),
          flat[n / 2].item<double>(), flat[n - 1].item<double>()};
}

// ---- training
// --------------------------------------------------------------------------------------

std::unique_ptr<Item> skeleton_training(const Inputs& in, std::shared_ptr<Extractor> net,
                                        const std::string& file, int64_t parameters) {
  in.load(*net, file, parameters);
  const Tensor points = in.at("clouds.points"), joints = in.at("clouds.joints");
  return std::make_unique<Training>(net->parameters(),
                                    [=] { return torch::mse_loss(net->forward(points), joints); });
}

std::unique_ptr<Item> motion_training(const Inputs& in, int64_t batch, bool dropout) {
  const auto net = std::make_shared<Smrm>(rate_of(dropout, 0.2));
  in.load(*net, "smrm", kSmrmParameters);
  const auto part = [&](const char* name) {
    return in.at(std::string("windows.") + name).slice(0, 0, batch).contiguous();
  };
  const Windows w{part("joints"), part("trans"), part("rest_a"),
                  part("rest_b"), part("sixd"),  part("self_mask")};
  return std::make_unique<Training>(net->parameters(), [=] { return motion_loss(*net, w); });
}

std::unique_ptr<Item> deformation_training(const Inputs& in, bool dropout) {
  const auto weights = std::make_shared<Mlp>(kJoints, rate_of(dropout, 0.2), true),
             offsets = std::make_shared<Mlp>(3, rate_of(dropout, 0.2), false);
  in.load(*weights, "weights", kWeightsParameters);
  in.load(*offsets, "offsets", kOffsetsParameters);
  std::vector<Tensor> parameters = weights->parameters();
  for (const Tensor& p : offsets->parameters()) parameters.push_back(p);
  const Tensor rest = in.at("pairs.rest_joints"), local = in.at("pairs.local"),
               points = in.at("pairs.rest_points"), truth = in.at("pairs.posed_points"),
               angles = in.at("pairs.axis_angle");
  return std::make_unique<Training>(parameters, [=] {
    const Posed posed = forward_kinematics(local, rest, rest.select(1, 0));
    const Tensor x = points + offsets->forward(angles, points);
    const Tensor y = skin(x, weights->forward(rest.flatten(1), points), posed, rest);
    return (y - truth).square().sum() / truth.size(0);
  });
}

// ---- online
// ----------------------------------------------------------------------------------------

/// An answer per frame, without gradients; `frames` come again and again.
class Online : public Item {
 public:
  Online(int64_t frames, std::function<Tensor(int64_t)> answer, bool flushed = false,
         int64_t check_frames = 1)
      : frames_(frames),
        check_frames_(check_frames),
        answer_(std::move(answer)),
        buffer_(flushed ? flush_numbers() : 0) {}
  void prepare() override {
    if (buffer_.empty()) return;
    const auto n = static_cast<int64_t>(buffer_.size());
    at::parallel_for(0, n, n / at::get_num_threads(), [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) buffer_[static_cast<size_t>(i)] += 1;
    });
  }
  void run() override {
    c10::InferenceMode guard;
    last_ = answer_(at_++ % frames_);
  }
  std::vector<double> check() override {
    for (int64_t i = 0; i < check_frames_; ++i) run();
    return summary(last_);
  }

 private:
  /// As large as the last cache, like ../online_items.cpp.
  static size_t flush_numbers() {
    const int64_t l3 = sysconf(_SC_LEVEL3_CACHE_SIZE);
    return static_cast<size_t>(std::min<int64_t>(std::max<int64_t>(l3, 64 << 20), 512 << 20) / 8);
  }
  int64_t frames_, check_frames_, at_ = 0;
  std::function<Tensor(int64_t)> answer_;
  std::vector<int64_t> buffer_;
  Tensor last_;
};

/// Frames one by one, as tensors of batch one.
std::vector<Tensor> frames_of(const Tensor& all) { return all.split(1); }

std::unique_ptr<Item> skeleton_online(const Inputs& in) {
  const auto net = point_transformer();
  in.load(*net, "skeleton", kPointTransformerParameters);
  net->eval();
  const auto clouds = frames_of(in.at("frames.clouds"));
  return std::make_unique<Online>(clouds.size(),
                                  [=](int64_t i) { return net->forward(clouds[i]); });
}

/// SMRM with its state from frame to frame.
struct MotionState {
  explicit MotionState(const Inputs& in) : net(0), rest(in.at("target.joints").unsqueeze(0)) {
    in.load(net, "smrm", kSmrmParameters);
    net.eval();
  }
  SmrmOutput step(const Tensor& joints, const Tensor& trans) {
    return net.forward(joints.unsqueeze(0), trans.view({1, 1, 3}), rest, &encoder, &decoder);
  }
  Smrm net;
  Tensor rest, encoder, decoder;
};

std::unique_ptr<Item> motion_online(const Inputs& in, bool flushed) {
  const auto motion = std::make_shared<MotionState>(in);
  const auto joints = frames_of(in.at("frames.joints"));
  const Tensor still = torch::zeros({3});
  return std::make_unique<Online>(
      joints.size(), [=](int64_t i) { return motion->step(joints[i], still).joints; }, flushed, 3);
}

/// The target: its skinning weights are made once.
struct Target {
  explicit Target(const Inputs& in)
      : offsets(3, 0, false),
        points(in.at("target.points").unsqueeze(0)),
        rest(in.at("target.joints").unsqueeze(0)) {
    in.load(offsets, "offsets", kOffsetsParameters);
    offsets.eval();
    Mlp net(kJoints, 0, true);
    in.load(net, "weights", kWeightsParameters);
    net.eval();
    c10::InferenceMode guard;
    weights = net.forward(rest.flatten(1), points);
  }
  Tensor pose(const Tensor& local, const Tensor& angles, const Tensor& root) {
    const Posed posed = forward_kinematics(local, rest, root);
    return skin(points + offsets.forward(angles, points), weights, posed, rest);
  }
  Mlp offsets;
  Tensor points, rest, weights;
};

std::unique_ptr<Item> deformation_online(const Inputs& in) {
  const auto target = std::make_shared<Target>(in);
  const auto local = frames_of(in.at("pairs.local")), angles = frames_of(in.at("pairs.axis_angle"));
  const Tensor origin = torch::zeros({1, 3});
  return std::make_unique<Online>(
      local.size(), [=](int64_t i) { return target->pose(local[i], angles[i], origin); });
}

/// Cloud in, posed target out; the pelvis moves with the velocities that SMRM gives. The points of
/// each frame were chosen before, as the other program chooses them (../inputs.cpp).
std::unique_ptr<Item> frame_online(const Inputs& in) {
  const auto net = point_transformer();
  in.load(*net, "skeleton", kPointTransformerParameters);
  net->eval();
  const auto motion = std::make_shared<MotionState>(in);
  const auto target = std::make_shared<Target>(in);
  const auto clouds = frames_of(in.at("frames.chosen"));
  const auto pelvis = std::make_shared<Tensor>();
  return std::make_unique<Online>(
      clouds.size(),
      [=](int64_t i) {
        const Tensor centre = clouds[i].mean(1, true);
        const Tensor joints = net->forward(clouds[i] - centre) + centre;
        const Tensor root = joints.select(1, 0);
        const Tensor velocity = pelvis->defined() ? 30 * (root - *pelvis) : torch::zeros({1, 3});
        *pelvis = root;
        const SmrmOutput b = motion->step(joints - root.unsqueeze(1), velocity);
        const Tensor local = b.rotations.view({1, kJoints, 3, 3});
        const Tensor angles = matrix_to_axis_angle(local.view({-1, 3, 3})).view({1, -1});
        return target->pose(local, angles, torch::zeros({1, 3}));
      },
      false, 3);
}

// ---- kernels
// ---------------------------------------------------------------------------------------

std::unique_ptr<Item> product(const Tensor& a, const Tensor& b) {
  return std::make_unique<Online>(1, [=](int64_t) { return torch::mm(a, b); });
}

Tensor filled(int64_t rows, int64_t columns, double value) {
  return torch::full({rows, columns}, value);
}

std::unique_ptr<Item> attention(const Inputs& in, bool backward) {
  const auto block = std::make_shared<VectorAttention>(32, 512);
  in.load(*block, "skeleton", 0, "backbone.transformer1.");
  const Tensor xyz = in.at("clouds.points").slice(0, 0, 1), f = in.at("kernel.features");
  if (!backward)
    return std::make_unique<Online>(1, [=](int64_t) { return block->forward(xyz, f); });
  return std::make_unique<Training>(block->parameters(),
                                    [=] { return block->forward(xyz, f).square().mean(); });
}

/// So many points of 64 channels over as many others.
std::unique_ptr<Item> attention_over(const Inputs& in, int64_t points) {
  std::vector<Tensor> all;
  for (const char* part : {"queries", "keys", "values"}) {
    const Tensor some = in.at(std::string("kernel.") + part).slice(1, 0, points);
    all.push_back(some.transpose(1, 2).contiguous().requires_grad_());
  }
  return std::make_unique<Gradients>(
      all, [=] { return attend(all[0], all[1], all[2]).square().mean(); });
}

std::unique_ptr<Item> recurrent(const Inputs& in) {
  torch::nn::GRU gru(torch::nn::GRUOptions(578, 512).num_layers(2).batch_first(true));
  in.load(*gru, "smrm", 0, "dec.");
  const Tensor x = in.at("kernel.sequence");
  return std::make_unique<Training>(
      gru->parameters(), [=]() mutable { return std::get<0>(gru->forward(x)).square().mean(); });
}

}  // namespace

std::unique_ptr<Item> make_item(const std::string& name, const Inputs& in, bool dropout) {
  if (name == "skeleton_train")
    return skeleton_training(in, point_transformer(), "skeleton", kPointTransformerParameters);
  if (name == "pointnet_train")
    return skeleton_training(in, pointnet(rate_of(dropout, 0.3)), "pointnet", kPointNetParameters);
  if (name == "smrm_train_b16") return motion_training(in, 16, dropout);
  if (name == "smrm_train_b64") return motion_training(in, 64, dropout);
  if (name == "deformation_train") return deformation_training(in, dropout);
  if (name == "skeleton_online") return skeleton_online(in);
  if (name == "smrm_online") return motion_online(in, true);
  if (name == "smrm_online_warm") return motion_online(in, false);
  if (name == "deformation_online") return deformation_online(in);
  if (name == "frame_online") return frame_online(in);
  if (name == "sgemm_pairs") return product(filled(16384, 512, 0.25), filled(512, 512, 0.5));
  if (name == "sgemm_gradient")
    return product(filled(16384, 512, 0.25).t(), filled(16384, 512, 0.5));
  if (name == "sgemm_square") return product(filled(1024, 1024, 0.25), filled(1024, 1024, 0.5));
  if (name == "attention") return attention(in, false);
  if (name == "attention_train") return attention(in, true);
  if (name == "gru_train") return recurrent(in);
  if (name == "cross_attention_1k") return attention_over(in, 1024);
  if (name == "cross_attention_7k") return attention_over(in, 6890);
  if (name == "cross_attention_13k") return attention_over(in, 13380);
  return make_transfer_item(name, in);
}

}  // namespace bench
