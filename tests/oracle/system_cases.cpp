// Cases of the systems that the papers compare with: NPT, LART, 3D-CoreNet, H4D, TST. The oracle
// has channels before points, and one window of TST without a batch axis.
#include <span>

#include "autograd/ops/layout.h"
#include "autograd/ops/norm.h"
#include "nn/layers/cross_attention.h"
#include "nn/layers/lstm.h"
#include "nn/layers/transport.h"
#include "nn/losses/transfer.h"
#include "nn/models/corenet.h"
#include "nn/models/h4d.h"
#include "nn/models/lart.h"
#include "nn/models/npt.h"
#include "nn/models/tst.h"
#include "tests/oracle/case.h"

namespace restage::oracle {
namespace {

/// [n, c, v] and [n, v, c]: one into the other.
Var swapped(const Var& x) { return permute(x, {0, 2, 1}); }

Tensor faces_of(const Case& c) { return c.constant("faces").cast(DType::i32); }

std::array<int64_t, 3> three_widths(const Case& c, const std::string& prefix) {
  return {c.size(prefix + "0.weight", 0), c.size(prefix + "1.weight", 0),
          c.size(prefix + "2.weight", 0)};
}

void instance_norm_case(Case& c) {
  const Var y = swapped(instance_norm(swapped(c.in("x"))));
  c.out({{"y", y}});
  c.finish(dot(y, c.probe()));
}

void spadain(Case& c) {
  const int64_t width = c.count("c");
  Spadain on(width, c.init()), off(width, c.init());
  SpadainBlock block(width, true, c.init());
  c.load(on, "on.");
  c.load(off, "off.");
  c.load(block, "block.");
  const Var x = swapped(c.in("x")), mesh = swapped(c.in("mesh"));
  const Var y_on = swapped(on(c.ctx(), instance_norm(x), mesh)),
            y_off = swapped(off(c.ctx(), x, mesh)), y_block = swapped(block(c.ctx(), x, mesh));
  c.out({{"on", y_on}, {"off", y_off}, {"block", y_block}});
  c.finish(dot(y_on, c.probe("probe_on")) + dot(y_off, c.probe("probe_off")) +
           dot(y_block, c.probe("probe_block")));
}

void cross_attention_case(Case& c) {
  GatedCrossAttention net(c.count("c"), c.init());
  c.load(net);
  const Var y = swapped(net(c.ctx(), swapped(c.in("u")), swapped(c.in("z")), swapped(c.in("res"))));
  c.out({{"y", y}});
  c.finish(dot(y, c.probe()));
}

void edge_loss_case(Case& c) {
  const Var items = edge_loss(c.in("pred"), c.constant("ref"), faces_of(c));
  c.out({{"items", items}});
  c.finish(mean_all(items));
}

void metric_loss_case(Case& c) {
  c.finish(metric_loss(c.in("out"), c.constant("m1"), c.constant("mT"), c.number("alpha")));
}

void sinkhorn(Case& c) {
  const Var plan = transport_plan(c.in("C"), {.steps = static_cast<int>(c.count("steps")),
                                              .temperature = c.number("temperature"),
                                              .epsilon = c.number("eps")});
  const Var rows = transport_rows(plan);
  c.out({{"plan", plan}, {"rows", rows}});
  const Tensor probe = c.probe();
  const auto part = [&](int64_t i) { return probe.rows(i, i + 1).reshape(plan.shape()); };
  c.finish(dot(plan, part(0)) + dot(rows, part(1)));
}

void lstm_case(Case& c) {
  LstmLayer net(c.count("input"), c.count("hidden"), static_cast<int>(c.count("layers")), c.init());
  c.load(net);
  Var hidden, cell;
  const Var y = permute(net(c.ctx(), permute(c.in("x"), {1, 0, 2}), &hidden, &cell), {1, 0, 2});
  c.out({{"y", y}, {"hn", hidden}, {"cn", cell}});
  c.finish(dot(y, c.probe()));
}

template <bool pool>
void npt(Case& c) {
  Npt net({.widths = three_widths(c, "enc.convs."), .pool = pool}, c.init());
  c.load(net);
  const Var pose = swapped(c.in("pose")), mesh = swapped(c.in("mesh"));
  const Var posed =
      reshape(net.forward(c.ctx(), {reshape(pose, {pose.size(0), 1, pose.size(1), 3}), mesh}),
              mesh.shape());
  const Var edge = mean_all(edge_loss(posed, mesh.value, faces_of(c)));
  const Var rec = mse(posed, c.asked("gt"));
  c.out({{"y", posed}, {"edge", edge}, {"rec", rec}});
  c.finish(rec + edge * 0.0005);
}

void lart(Case& c) {
  Lart net({.widths = three_widths(c, "enc.convs."), .frames = c.size("time", 0)}, c.init());
  c.load(net);
  const Var pose = permute(c.in("pose"), {0, 1, 3, 2}), mesh = swapped(c.in("mesh"));
  const Var truth = c.asked("gt");
  const Var posed = net.forward(c.ctx(), {pose, mesh});
  const Var code = net.codes(c.ctx(), pose);
  const int64_t last = code.size(1) - 1;
  const double alpha = c.number("alpha");
  const auto of = [](const Var& x, int64_t t) {
    const Var frame = slice(x, 1, t, t + 1);
    return x.rank() == 3 ? frame : reshape(frame, {x.size(0), x.size(2), 3});
  };
  const Var between = of(code, 0) * (1 - alpha) + of(code, last) * alpha;
  // The case wants the gradient of the true meshes, too.
  const Var wanted =
      pair_distances(of(truth, 0)) * (1 - alpha) + pair_distances(of(truth, last)) * alpha;
  const Var metric = mse(pair_distances(of(net.decode(c.ctx(), between, mesh), 0)), wanted);
  const Var rec = mse(posed, truth);
  c.out({{"y", posed}, {"rec", rec}, {"metric", metric}});
  c.finish(rec + metric * c.number("metric_weight"));
}

void corenet(Case& c) {
  CoreNetConfig config;
  config.widths = three_widths(c, "corr.convs.");
  config.generator = three_widths(c, "convs.");
  config.blocks = c.listed("corr.res.", ".conv1.weight");
  CoreNet net(config, c.init());
  c.load(net);
  const Var mesh = swapped(c.in("mesh"));
  Correspondence::Found found;
  const Var posed = net.posed(c.ctx(), swapped(c.in("pose")), mesh, &found);
  const Var rec = mse(posed, c.asked("gt"));
  const Var edge = mean_all(edge_loss(posed, mesh.value, faces_of(c)));
  c.out({{"y", posed},
         {"warp", found.warped},
         {"plan_rows", found.rows},
         {"rec", rec},
         {"edge", edge}});
  c.finish(rec * c.number("rec_weight") + edge * c.number("edge_weight"));
}

void h4d(Case& c) {
  const int64_t joints = c.count("joints");
  H4d net({.shape = c.count("betas"),
           .pose = 3 * joints,
           .motion = c.count("root_pc") + c.count("joint_pc"),
           .hidden = c.count("hidden"),
           .features = c.count("feat"),
           .recurrent = c.count("gru")},
          c.init());
  c.load(net);
  const H4d::Codes codes = net.codes(c.ctx(), c.in("points"));
  const Var poses = net.poses(c.ctx(), codes,
                              {c.constant("rot_pc"), c.constant("rot_mean"), c.constant("joint_pc"),
                               c.constant("joint_mean")});
  // Its joints are a regressor's of the vertices, ours move along directions of their own.
  const Tensor mean = c.constant("template"), directions = c.constant("shape_basis");
  const int64_t v = mean.size(0), b = directions.size(2);
  const Var regressor(c.constant("regressor"));
  LinearBody body{mean,
                  directions,
                  matmul(regressor, Var(mean)).value,
                  matmul(regressor, Var(directions.reshape({v, 3 * b}))).value.reshape({-1, 3, b}),
                  c.constant("weights"),
                  {}};
  const Tensor parents = c.constant("parents").cpu();
  for (int64_t i = 0; i < parents.numel(); ++i)
    body.parents.push_back(static_cast<int>(parents.item(i)));
  const Var verts = pose_body(body, codes.shape, poses);
  const Var vert_loss = mean_all(abs(verts - c.asked("gt_verts")));
  const Var beta_loss = mean_all(smooth_length(codes.shape - c.asked("gt_beta"), 1e-24));
  c.out({{"beta", codes.shape},
         {"pose0", codes.pose},
         {"motion", codes.motion},
         {"poses", poses},
         {"verts", verts},
         {"vert_loss", vert_loss},
         {"beta_loss", beta_loss}});
  c.finish(vert_loss + beta_loss);
}

void tst(Case& c) {
  const int64_t vertices = c.size("tst.t_in.weight", 1) / 3;
  Tst net({.widths = three_widths(c, "tst.enc."),
           .vertices = vertices,
           .code = c.count("d"),
           .hidden = c.count("hidden"),
           .layers = c.count("layers"),
           .frames = c.count("frames")},
          c.init());
  TstDiscriminator judge({vertices, {c.size("dis.fc1.weight", 0), c.size("dis.fc2.weight", 0)}},
                         c.init());
  c.load(net, "tst.");
  c.load(judge, "dis.");
  const Var pose = swapped(c.in("pose")), mesh = swapped(c.in("mesh"));
  const int64_t t = pose.size(0), v = pose.size(1);
  const Var truth = c.asked("gt");
  const Var code = net.encode(c.ctx(), reshape(pose, {1, t, v, 3}));
  const Var posed = net.window(c.ctx(), pose, mesh), logits = judge.logits(c.ctx(), posed);
  // The sums of its program ("Arc 4, final"); ours are means, of the same terms.
  const double pairs = std::max(static_cast<double>(v * (v - 1)), 1.0);
  const Var adversarial = bce_with_logits(logits, 1),
            reconstruction = sum_all(square(posed - truth)),
            edge = sum_all(edge_loss(posed, mesh.value, faces_of(c))),
            distances =
                scale(sum_all(square(pair_distances(posed) - pair_distances(truth))), 1 / pairs);
  c.out({{"code", swapped(reshape(code, {t, v, code.size(3)}))},
         {"y", posed},
         {"prob", sigmoid(logits)},
         {"adv", adversarial},
         {"rec", reconstruction},
         {"edge", edge},
         {"dist", distances}});
  c.finish(adversarial + reconstruction * 2 + edge * 0.5 + distances * 0.5);
}

constexpr Entry kSystems[] = {
    {"instance_norm", instance_norm_case},
    {"spadain", spadain},
    {"cross_attention", cross_attention_case},
    {"edge_loss", edge_loss_case},
    {"metric_loss", metric_loss_case},
    {"sinkhorn", sinkhorn},
    {"lstm", lstm_case},
    {"npt_pool", npt<true>},
    {"npt", npt<false>},
    {"lart", lart},
    {"corenet_", corenet},
    {"h4d_stage1", h4d},
    {"tst", tst},
};

}  // namespace

std::span<const Entry> system_cases() { return kSystems; }

}  // namespace restage::oracle
