#include "motion.h"

namespace bench {
namespace {

namespace nn = torch::nn;

nn::GRU gru(int64_t in, double dropout) {
  return nn::GRU(nn::GRUOptions(in, 512).num_layers(2).batch_first(true).dropout(dropout));
}

Tensor steps(const Tensor& joints) { return joints.slice(1, 1) - joints.slice(1, 0, -1); }

Tensor per_sample(const Tensor& x) { return x.flatten(1).mean(1); }

}  // namespace

Smrm::Smrm(double dropout)
    : enc(register_module("enc", gru(3 * kJoints + 3, dropout))),
      dec(register_module("dec", gru(512 + 3 * kJoints, dropout))),
      fc_rot(register_module("fc_rot", nn::Linear(512, 6 * kJoints))),
      fc_trans(register_module("fc_trans", nn::Linear(512, 3))) {}

SmrmOutput Smrm::forward(const Tensor& joints, const Tensor& trans, const Tensor& rest,
                         Tensor* encoder_state, Tensor* decoder_state) {
  const int64_t n = joints.size(0), t = joints.size(1);
  Tensor code, decoded;
  std::tie(code, *encoder_state) =
      enc->forward(torch::cat({joints.flatten(2), trans}, -1), *encoder_state);
  const Tensor target = rest.reshape({n, 1, -1}).expand({-1, t, -1});
  std::tie(decoded, *decoder_state) = dec->forward(torch::cat({code, target}, -1), *decoder_state);
  const Tensor local = sixd_to_matrix(fc_rot(decoded).view({n * t, kJoints, 6}));
  const Tensor bones = rest.unsqueeze(1).expand({-1, t, -1, -1}).reshape({n * t, kJoints, 3});
  const Posed posed = forward_kinematics(local, bones, torch::zeros({n * t, 3}));
  return {local.view({n, t, kJoints, 3, 3}), posed.joints.view({n, t, kJoints, 3}),
          fc_trans(decoded)};
}

Tensor motion_loss(Smrm& net, const Windows& w) {
  Tensor e, d, back_e, back_d;
  const SmrmOutput to_b = net.forward(w.joints, w.trans, w.rest_b, &e, &d);
  const SmrmOutput to_a = net.forward(to_b.joints, to_b.trans, w.rest_a, &back_e, &back_d);
  const Tensor cycle =
      torch::mse_loss(to_a.joints, w.joints) + torch::mse_loss(to_a.trans, w.trans);
  const Tensor rotation =
      torch::mse_loss(matrix_to_sixd(to_a.rotations).reshape(w.sixd.sizes()), w.sixd);
  const Tensor smoothness = torch::mse_loss(steps(to_a.joints), steps(w.joints));
  const Tensor self =
      per_sample((to_b.joints - w.joints).square()) + per_sample((to_b.trans - w.trans).square());
  return cycle + 0.01 * rotation + 0.1 * smoothness +
         (self * w.self_mask).sum() / w.self_mask.sum().clamp_min(1);
}

Mlp::Mlp(int64_t out, double dropout, bool softmax)
    : fc1(register_module("fc1", nn::Linear(3 * kJoints + 3, 256))),
      fc2(register_module("fc2", nn::Linear(256, 256))),
      fc3(register_module("fc3", nn::Linear(256, out))),
      drop(dropout),
      with_softmax(softmax) {
  register_module("drop", drop);
}

Tensor Mlp::forward(const Tensor& vector, const Tensor& points) {
  const Tensor x = torch::cat({vector.unsqueeze(1).expand({-1, points.size(1), -1}), points}, -1);
  Tensor h = drop(fc1(x)).relu_();
  h = drop(fc2(h)).relu_();
  const Tensor y = fc3(h);
  return with_softmax ? y.softmax(-1) : y;
}

}  // namespace bench
