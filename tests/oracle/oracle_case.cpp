#include "tests/oracle/oracle_case.h"

#include <cmath>
#include <functional>
#include <limits>
#include <memory>

#include "autograd/base/error.h"
#include "autograd/ops/elementwise.h"
#include "autograd/ops/layout.h"
#include "autograd/ops/points.h"
#include "autograd/ops/reduce.h"
#include "autograd/ops/rotation.h"
#include "nn/layers/gru.h"
#include "nn/losses/deformation.h"
#include "nn/losses/motion.h"
#include "nn/models/deformation.h"
#include "nn/models/point_transformer.h"
#include "nn/models/pointnet.h"
#include "nn/models/smrm.h"
#include "nn/weights/state.h"
#include "tests/oracle/case.h"

namespace restage::oracle {
namespace {

// ---- geometry -----------------------------------------------------------------------------------

void rotations(Case& c) {
  const Var aa = axis_angle_to_matrix(c.in("aa")), sixd = sixd_to_matrix(c.in("sixd")),
            quat = quaternion_to_matrix(c.in("quat"));
  c.out({{"aa", aa},
         {"sixd", sixd},
         {"quat", quat},
         {"aa_back", matrix_to_axis_angle(sixd.value)},
         {"quat_back", matrix_to_quaternion(sixd.value)}});
  const Tensor probe = c.probe();
  const auto part = [&](int64_t i, const Var& x) {
    return dot(x, probe.rows(i, i + 1).reshape(x.shape()));
  };
  c.finish(part(0, aa) + part(1, sixd) + part(2, quat));
}

void fk_lbs(Case& c) {
  const Var local = sixd_to_matrix(c.in("sixd"));
  const Var posed = forward_kinematics(local, c.in("tpose"), c.in("root"), joint_parents());
  const Var joints = joints_of(posed);
  const Var verts = linear_blend_skinning(c.in("points"), c.in("weights"), posed, c.in("tpose"));
  c.out({{"R", local}, {"G", rotations_of(posed)}, {"joints", joints}, {"verts", verts}});
  c.finish(dot(joints, c.probe("probe_j")) + dot(verts, c.probe("probe_v")));
}

void neighbourhoods(Case& c) {
  const Var cloud = c.in("cloud");
  const Tensor picked = fps(cloud.value, c.count("fps"));
  const Var centres = gather(cloud, picked);
  c.index("fps", picked);
  c.index("knn_self", knn(cloud.value, cloud.value, c.count("k")));
  c.index("knn_down", knn(centres.value, cloud.value, c.count("k")));
  c.finish(sum_all(square(centres)));
}

// ---- layers and extractors ----------------------------------------------------------------------

/// Layers of a stacked GRU whose parameters begin with `prefix`.
int gru_layers(const Case& c, const std::string& prefix) {
  int layers = 0;
  while (c.has_parameter(prefix + "weight_ih_l" + std::to_string(layers))) ++layers;
  return layers;
}

void gru_case(Case& c) {
  GruLayer gru(c.size("weight_ih_l0", 1), c.size("weight_hh_l0", 1), gru_layers(c, ""), 0,
               c.init());
  c.load(gru);
  Var state = c.in("h0");
  const Var y = gru(c.ctx(), c.in("x"), &state);
  c.out({{"y", y}, {"hn", state}});
  c.finish(dot(y, c.probe()) + sum_all(state));
}

void vector_attention(Case& c) {
  VectorAttention net(c.size("fc1.weight", 1), c.size("fc1.weight", 0), c.count("k"), c.init());
  c.load(net);
  const Var xyz = c.in("xyz");
  const Var y = net(c.ctx(), xyz, c.in("f"));
  c.out({{"y", y}});
  c.index("knn", knn(xyz.value, xyz.value, c.count("k")));
  c.finish(dot(y, c.probe()));
}

void run_extractor(Case& c, SkeletonModel& net) {
  c.load(net);
  const Var joints = net.forward(c.ctx(), c.in("cloud")).joints;
  c.out({{"joints", joints}});
  c.finish(mse(joints, c.in("target")));
}

void extractor(Case& c) {
  PointTransformerConfig config;
  config.points = c.count("n_points");
  config.neighbours = c.count("k");
  config.width = c.size("backbone.transformer1.w_qs.weight", 0);
  config.base = c.size("backbone.fc1.0.weight", 0);
  config.blocks = 0;
  while (c.has_parameter("backbone.transformers." + std::to_string(config.blocks) + ".fc1.weight"))
    ++config.blocks;
  config.head1 = c.size("fc2.0.weight", 0);
  config.head2 = c.size("fc2.2.weight", 0);
  PointTransformer net(config, c.init());
  run_extractor(c, net);
}

void pointnet(Case& c) {
  PointNetConfig config;
  const char* names[] = {"conv1", "conv2", "conv3", "fc1", "fc2"};
  for (size_t i = 0; i < 5; ++i) config.widths[i] = c.size(std::string(names[i]) + ".weight", 0);
  config.feature_transform = c.has_parameter("fstn.conv1.weight");
  config.relu3 = c.text("relu3") == "True";
  config.dropout = c.number("dropout");
  PointNet net(config, c.init());
  run_extractor(c, net);
}

// ---- motion -------------------------------------------------------------------------------------

std::unique_ptr<Smrm> make_smrm(const Case& c, const std::string& prefix) {
  SmrmConfig config;
  config.rotation = c.size(prefix + "fc_rot.weight", 0) == 6 * kJoints ? RotationForm::sixd
                                                                       : RotationForm::quaternion;
  config.hidden = c.size(prefix + "enc.weight_hh_l0", 1);
  config.layers = gru_layers(c, prefix + "enc.");
  config.dropout = 0;
  config.standardise = c.has_buffer(prefix + "joint_mean");
  return std::make_unique<Smrm>(config, c.init());
}

std::unique_ptr<Discriminator> make_discriminator(const Case& c, const std::string& prefix,
                                                  bool nkn_head = false) {
  DiscriminatorConfig config;
  for (size_t i = 0; i < 4; ++i)
    config.widths[i] = c.size(prefix + "convs." + std::to_string(i) + ".weight", 0);
  config.in = c.size(prefix + "convs.0.weight", 1);
  config.condition = c.size(prefix + "out.weight", 1) - config.widths[3];
  config.nkn_head = nkn_head;
  return std::make_unique<Discriminator>(config, c.init());
}

void smrm(Case& c) {
  const auto net = make_smrm(c, "");
  c.load(*net);
  MotionState state;
  const MotionOutput y =
      net->forward(c.ctx(), {c.in("joints"), c.in("trans"), c.in("tpose"), {}, {}}, &state);
  c.out({{"raw", y.raw},
         {"R", y.rotations},
         {"joints", y.joints},
         {"trans", y.trans},
         {"h_enc", state[0]},
         {"h_dec", state[1]}});
  c.finish(mse(y.joints, c.in("target")) + mean_all(square(y.trans)));
}

void motion_generator(Case& c) {
  const auto net = make_smrm(c, "net.");
  const auto dis = make_discriminator(c, "dis.");
  c.load(*net, "net.");
  c.load(*dis, "dis.");
  MotionBatch b;
  b.joints = b.input = c.in("A");
  b.trans = b.true_trans = c.in("tA");
  b.rest_a = c.in("tpA");
  b.rest_b = c.in("tpB");
  b.sixd = c.in("th6A");
  b.self_mask = c.constant("self_mask");
  const MotionLosses l = motion_losses(c.ctx(), *net, dis.get(), b, MotionWeights{}, true);
  c.out({{"cyc", l.cycle},
         {"rot", l.rotation},
         {"smooth", l.smoothness},
         {"adv", l.adversarial},
         {"self", l.self},
         {"B_joints", l.joints_b},
         {"B_trans", l.trans_b}});
  c.finish(l.total);
}

/// The default path: the standardised network, one supervised pass from what it sees (X, tX) to
/// what is true (A, tA).
void motion_self(Case& c) {
  const auto net = make_smrm(c, "");
  c.load(*net);
  MotionBatch b;
  b.joints = c.in("A");
  b.true_trans = c.in("tA");
  b.input = c.in("X");
  b.trans = c.in("tX");
  b.rest_a = c.in("tpA");
  b.sixd = c.in("th6A");
  MotionWeights weights;
  weights.rotation = c.number("rotation_weight");
  weights.smoothness = c.number("smoothness_weight");
  const MotionLosses l = self_losses(c.ctx(), *net, b, weights);
  c.out({{"cyc", l.cycle},
         {"rot", l.rotation},
         {"smooth", l.smoothness},
         {"joints", l.joints_b},
         {"trans", l.trans_b}});
  c.finish(l.total);
}

void motion_discriminator(Case& c) {
  const auto dis = make_discriminator(c, "");
  c.load(*dis);
  const DiscriminatorLosses l =
      discriminator_losses(c.ctx(), *dis, c.in("real"), c.in("t_real"), c.in("tp_real"),
                           c.constant("fake"), c.constant("t_fake"), c.in("tp_fake"));
  c.out({{"real", l.real}, {"fake", l.fake}});
  c.finish(l.total);
}

void discriminator_nkn(Case& c) {
  const auto dis = make_discriminator(c, "", true);
  c.load(*dis);
  const Var logit = (*dis)(c.ctx(), c.in("x"), c.in("cond"));
  c.out({{"logit", logit}});
  c.finish(mean_all(softplus(neg(logit))));
}

// ---- deformation --------------------------------------------------------------------------------

std::unique_ptr<Mlp3> make_mlp(const Case& c, const std::string& prefix, bool softmax,
                               double dropout) {
  return std::make_unique<Mlp3>(c.size(prefix + "fc1.weight", 1), c.size(prefix + "fc3.weight", 0),
                                MlpConfig{c.size(prefix + "fc1.weight", 0), dropout}, softmax,
                                c.init());
}

void deformation(Case& c) {
  WeightNet weights({c.size("W.fc1.weight", 0), 0}, c.init());
  OffsetNet offsets({c.size("O.fc1.weight", 0), 0}, c.init());
  c.load(weights, "W.");
  c.load(offsets, "O.");
  const Tensor aa = c.constant("aa");
  const Var local = axis_angle_to_matrix(aa);
  const DeformationOutput y = deform(c.ctx(), weights, &offsets, c.in("p"), c.in("tpose"), local,
                                     aa.reshape({aa.size(0), -1}));
  c.out({{"weights", y.weights}, {"offsets", y.offsets}, {"posed", y.posed}});
  c.finish(distance_sum(y.posed, c.in("q")));
}

void mlp_dropout_masks(Case& c) {
  const auto net = make_mlp(c, "", true, c.number("p"));
  c.load(*net);
  const Var y = net->with_masks(c.ctx(), c.in("x"), c.constant("mask1"), c.constant("mask2"));
  c.out({{"y", y}});
  c.finish(dot(y, c.probe()));
}

template <bool softmax>
void mlp(Case& c) {
  const auto net = make_mlp(c, "", softmax, 0);
  c.load(*net);
  const Var y = (*net)(c.ctx(), c.in("x"));
  c.out({{"y", y}});
  c.finish(sum_all(square(y - c.in("target"))));
}

constexpr Entry kCases[] = {
    {"rotations", rotations},
    {"fk_lbs", fk_lbs},
    {"neighbourhoods", neighbourhoods},
    {"gru", gru_case},
    {"vector_attention", vector_attention},
    {"extractor_", extractor},
    {"pointnet_", pointnet},
    {"smrm_", smrm},
    {"motion_generator", motion_generator},
    {"motion_self", motion_self},
    {"motion_discriminator", motion_discriminator},
    {"discriminator_nkn", discriminator_nkn},
    {"deformation", deformation},
    {"mlp_dropout_masks", mlp_dropout_masks},
    {"third_mlp", mlp<false>},
    {"v1_field", mlp<true>},
};

double largest(const Tensor& t) {
  double m = 0;
  for (int64_t i = 0; i < t.numel(); ++i) m = std::max(m, std::abs(t.item(i)));
  return m;
}

/// Relative distance of two tensors; `top` is the largest magnitude of their group.
double error(const Tensor& got, const Tensor& want, double top, bool exact, bool f32) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  if (got.numel() != want.numel()) return infinite;
  const double scale = largest(want);
  if (f32 && !exact && scale < 1e-5 * top) return largest(got) <= 1e-5 * top ? 0 : infinite;
  double d = 0;
  for (int64_t i = 0; i < want.numel(); ++i) {
    const double e = std::abs(got.item(i) - want.item(i));
    if (!std::isfinite(e) || (exact && e != 0)) return infinite;
    d = std::max(d, e);
  }
  return d / std::max({scale, 1e-3 * top, 1e-300});
}

}  // namespace

TensorFile answer(const TensorFile& question, const std::string& where, Device device) {
  Case c(question, where, device);
  const std::string name = c.text("case");
  for (const std::span<const Entry> table : {std::span<const Entry>(kCases), system_cases()})
    for (const Entry& entry : table) {
      if (!starts_with(name, entry.name)) continue;
      entry.run(c);
      c.answer().metadata = {{"case", name}, {"dtype", c.text("dtype")}};
      return std::move(c.answer());
    }
  throw InputError(where, "holds the unknown case " + name_in_quotes(name),
                   "give a case that is listed in the oracle's README");
}

std::vector<Difference> differences(const TensorFile& question, const TensorFile& answer,
                                    double tolerance) {
  const auto dtype = question.metadata.find("dtype");
  const bool f32 = dtype != question.metadata.end() && dtype->second == "f32";
  std::vector<Difference> out;
  for (const std::string kind : {"out.", "g.", "idx."}) {
    double top = 0;
    for (const auto& [name, tensor] : question.tensors)
      if (starts_with(name, kind)) top = std::max(top, largest(tensor));
    for (const auto& [name, tensor] : question.tensors) {
      if (!starts_with(name, kind) || starts_with(name, "out.probe") || name == "g.in.target" ||
          name == "g.in.self_mask")
        continue;
      const Tensor* got = answer.find(name);
      const double e = got == nullptr ? std::numeric_limits<double>::infinity()
                                      : error(*got, tensor, top, kind == "idx.", f32);
      if (!(e <= tolerance)) out.push_back({name, e});
    }
  }
  return out;
}

}  // namespace restage::oracle
