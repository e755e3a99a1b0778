"""Cases of the systems of others (NPT, LART, 3D-CoreNet, H4D's first stage, TST) and of their parts, at small widths. Targets, reference
meshes, bases and faces are constants: no gradient is asked for them."""
import torch
from reference import corenet_h4d_tst as B2
from reference import npt_lart as B

from .case import weigh

FACES = torch.tensor([[0, 1, 2], [2, 3, 4], [4, 5, 6], [5, 6, 7], [7, 8, 9], [0, 9, 3]])
W, BODIES, V = (4, 6, 13), 2, 10


def instance_norm(draw):
    """In item 0, channel 1 varies so little that eps counts, and channel 2 is constant over the points."""
    x, probe = draw.rand(2, 4, 8), draw.rand(2, 4, 8)
    x[0, 1], x[0, 2] = 0.3 + 2e-3 * x[0, 1], 0.5

    def f(_, x):
        y = torch.nn.functional.instance_norm(x["x"])
        return {"y": y, "probe": probe.to(y.dtype), "loss": weigh(y, probe)}
    draw.case("instance_norm", {}, {"x": x}, f, {"eps": 1e-5, "variance": "biased", "affine": False})


def spadain(draw):
    nets = {"on": draw.init(B.Spadain(5)), "off": draw.init(B.Spadain(5, False)), "block": draw.init(B.SpadainBlock(5))}
    probes = {k: draw.rand(2, 5, 9) for k in nets}

    def f(m, x):
        y = {k: m[k](x["x"], x["mesh"]) for k in nets}
        return {**y, **{"probe_" + k: probes[k].to(x["x"].dtype) for k in nets}, "loss": sum(weigh(y[k], probes[k]) for k in nets)}
    draw.case("spadain", nets, {"x": draw.rand(2, 5, 9), "mesh": draw.rand(2, 3, 9, scale=.5)}, f, {"c": 5, "off": "no instance norm"})


def attention(draw, name, n, queries, keys, c, scale):
    net, probe = draw.init(B.CrossAttention(c)), draw.rand(n, c, queries)
    with torch.no_grad():
        net.gamma.fill_(0.7)
        if scale > 1:
            net.k.bias.copy_(draw.rand(c, scale=15))    # shifts whole rows of scores far beyond what exp can take in float32

    def f(m, x):
        y = m["att"](x["u"], x["z"], x["res"])
        return {"y": y, "probe": probe.to(y.dtype), "loss": weigh(y, probe)}
    inputs = {"u": draw.rand(n, c, queries, scale=scale), "z": draw.rand(n, c, keys, scale=scale), "res": draw.rand(n, c, queries)}
    draw.case(name, {"att": net}, inputs, f, {"c": c, "queries": queries, "keys": keys, "scores": "no 1/sqrt(c), softmax over keys"})


def cross_attention(draw):
    attention(draw, "cross_attention", 2, 5, 7, 6, 1)


def cross_attention_tiled(draw):
    """For implementations that work in blocks."""
    attention(draw, "cross_attention_tiled", 1, 37, 300, 8, 2)


def edge_loss(draw):
    ref = draw.rand(2, V, 3, scale=.5)

    def f(_, x):
        e = torch.stack([B.edge_loss(x["pred"][i], FACES, x["ref"].detach()[i]) for i in range(2)])
        return {"items": e, "loss": e.mean()}
    draw.case("edge_loss", {}, {"pred": ref + draw.rand(2, V, 3, scale=.2), "ref": ref, "faces": FACES}, f, {})


def metric_loss(draw):
    """Two points coincide: the gradient of their distance is 0."""
    out = draw.rand(2, 9, 3, scale=.5)
    out[1, 4] = out[1, 3]

    def f(_, x):
        return {"loss": B.metric_term(x["out"], x["m1"].detach(), x["mT"].detach(), 0.3)}
    draw.case("metric_loss", {}, {"out": out, "m1": draw.rand(2, 9, 3, scale=.5), "mT": draw.rand(2, 9, 3, scale=.5)}, f, {"alpha": 0.3})


def sinkhorn(draw):
    """Item 0: similar points. Item 1: as at the start of a training, where eps outweighs K."""
    similar = 0.6 + 0.4 * torch.rand(7, 9, generator=draw.generator, dtype=torch.float64)
    C = torch.stack((similar, draw.rand(7, 9, scale=.2).clamp(-1, 1)))
    probe = draw.rand(2, 2, 7, 9)

    def f(_, x):
        T, R = B2.sinkhorn(x["C"])
        return {"plan": T, "rows": R, "probe": probe.to(T.dtype), "loss": weigh(T, probe[0]) + weigh(R, probe[1])}
    draw.case("sinkhorn", {}, {"C": C}, f, {"steps": 5, "temperature": 0.03, "eps": 1e-8, "note": "probe[0] weights plan, probe[1] rows"})


def lstm(draw):
    probe = draw.rand(6, 2, 3)

    def f(m, x):
        y, (h, c) = m["lstm"](x["x"])
        return {"y": y, "hn": h, "cn": c, "probe": probe.to(y.dtype), "loss": weigh(y, probe)}
    meta = {"input": 4, "hidden": 3, "layers": 2, "layout": "[T,N,C], gates i f g o"}
    draw.case("lstm", {"lstm": draw.init(torch.nn.LSTM(4, 3, 2))}, {"x": draw.rand(6, 2, 4)}, f, meta)


def npt_of(draw, name, pool, pose_points):
    def f(m, x):
        y = m["npt"](x["pose"], x["mesh"])
        edge = B.edge_loss_batch(y, FACES, x["mesh"].detach().transpose(1, 2))
        rec = (y - x["gt"].detach()).pow(2).mean()
        return {"y": y, "edge": edge, "rec": rec, "loss": rec + 0.0005 * edge}
    inputs = {"pose": draw.rand(BODIES, 3, pose_points, scale=.5), "mesh": draw.rand(BODIES, 3, V, scale=.5),
              "gt": draw.rand(BODIES, V, 3, scale=.5), "faces": FACES}
    draw.case(name, {"npt": draw.init(B.NPT(W, pool=pool))}, inputs, f, {"w": W})


def npt(draw):
    npt_of(draw, "npt", False, V)


def npt_pool(draw):
    npt_of(draw, "npt_pool", True, 14)


def lart(draw):
    def f(m, x):
        y = m["lart"](x["pose"], x["mesh"])
        z = m["lart"].code(x["pose"])
        metric = B.metric_loss(m["lart"], x["mesh"], z[:, 0], z[:, 2], x["gt"][:, 0], x["gt"][:, 2], 0.3)
        rec = (y - x["gt"]).pow(2).mean()
        return {"y": y, "rec": rec, "metric": metric, "loss": rec + 0.1 * metric}
    inputs = {"pose": draw.rand(BODIES, 3, 3, 14, scale=.5), "mesh": draw.rand(BODIES, 3, V, scale=.5), "gt": draw.rand(BODIES, 3, V, 3, scale=.5)}
    meta = {"w": (4, 6, 16), "frames": 3, "alpha": 0.3, "metric_weight": 0.1}
    draw.case("lart", {"lart": draw.init(B.LART((4, 6, 16), 3))}, inputs, f, meta)


def unit(v):
    return v / v.norm()


def shape_corenet(draw, net):
    """Parameters that make a plan which is neither flat nor one-hot, outputs away from the flat ends of tanh, and a state of the spectral
    norms that belongs to the weights."""
    with torch.no_grad():
        common = draw.rand(6, scale=2)
        for name, p in net.named_parameters():
            if name.endswith("act.weight"):
                p.copy_(0.25 + draw.rand(1, scale=.05))
            if name in ("corr.phi.bias", "corr.theta.bias"):
                p.add_(common)
        net.out.weight.mul_(0.1)
        for m in net.modules():
            if isinstance(m, B2.SpectralConv):
                m.weight_v.copy_(unit(m.weight_orig.flatten(1).t() @ draw.rand(m.weight_u.numel())))
                m.weight_u.copy_(unit(m.weight_orig.flatten(1) @ m.weight_v))
    return net


def corenet(draw):
    net = shape_corenet(draw, draw.init(B2.CoreNet((3, 5, 6), (8, 6, 4), 2)))

    def f(m, x):
        y, warp, T = m["net"](x["pose"], x["mesh"])
        rec, edge, loss = B2.corenet_loss(y, x["gt"].detach(), x["mesh"], FACES)
        return {"y": y, "warp": warp, "plan_rows": T, "rec": rec, "edge": edge, "loss": loss}
    inputs = {"pose": draw.rand(BODIES, 3, 12, scale=.5), "mesh": draw.rand(BODIES, 3, V, scale=.5), "gt": draw.rand(BODIES, V, 3, scale=.5),
              "faces": FACES}
    meta = {"w": (3, 5, 6), "g": (8, 6, 4), "blocks": 2, "rec_weight": 1000, "edge_weight": 0.5,
            "spectral": "one power iteration per training forward: v, then u"}
    draw.case("corenet_train", {"net": net}, inputs, f, meta, True)
    draw.case("corenet_eval", {"net": net}, inputs, f, meta)


def h4d_stage1(draw):
    joints, frames, points, betas, root, other = 5, 4, 9, 3, 2, 5
    net = draw.init(B2.H4DStage1(betas, 3 * joints, root + other, 6, 5, 4))
    body = {"template": draw.rand(points, 3, scale=.5), "shape_basis": draw.rand(points, 3, betas, scale=.1),
            "regressor": torch.softmax(draw.rand(joints, points), 1), "weights": torch.softmax(draw.rand(points, joints, scale=2), 1)}
    later = 3 * (frames - 1)
    codes = {"rot_pc": draw.rand(root, later, scale=.3), "rot_mean": draw.rand(later, scale=.1),
             "joint_pc": draw.rand(other, (joints - 1) * later, scale=.3), "joint_mean": draw.rand((joints - 1) * later, scale=.1)}

    def f(m, x):
        beta, pose0, motion = m["net"].codes(x["points"])
        poses = B2.h4d_poses(pose0, motion, *[x[k].detach() for k in codes])
        v = B2.linear_body(beta, poses, *[x[k].detach() for k in body], x["parents"].tolist())
        vert_loss, beta_loss = B2.h4d_stage1_loss(v, x["gt_verts"].detach(), beta, x["gt_beta"].detach())
        return {"beta": beta, "pose0": pose0, "motion": motion, "poses": poses, "verts": v, "vert_loss": vert_loss, "beta_loss": beta_loss,
                "loss": vert_loss + beta_loss}
    inputs = {"points": draw.rand(2, frames, 12, 3, scale=.5), "gt_verts": draw.rand(2, frames, points, 3, scale=.5),
              "gt_beta": draw.rand(2, betas), **body, "parents": torch.tensor([-1, 0, 1, 0, 3]), **codes}
    meta = {"betas": betas, "joints": joints, "root_pc": root, "joint_pc": other, "hidden": 6, "feat": 5, "gru": 4}
    draw.case("h4d_stage1", {"net": net}, inputs, f, meta)


def tst(draw):
    nets = {"tst": draw.init(B2.TST(V, (4, 6, 9), 7, 5)), "dis": draw.init(B2.TSTDiscriminator(V, (6, 4)))}
    with torch.no_grad():
        nets["tst"].out.weight.mul_(0.3)

    def f(m, x):
        y = m["tst"](x["pose"], x["mesh"])
        p = m["dis"](y)
        return {"code": m["tst"].encode(x["pose"]), "y": y, "prob": p, **B2.tst_loss(y, x["gt"].detach(), x["mesh"], FACES, p)}
    inputs = {"pose": draw.rand(5, 3, V, scale=.5), "mesh": draw.rand(5, 3, V, scale=.5), "gt": draw.rand(5, V, 3, scale=.5), "faces": FACES}
    meta = {"w": (4, 6, 9), "d": 7, "hidden": 5, "layers": 3, "frames": 5, "dis": (6, 4), "weights": "adv 1, rec 2, edge 0.5, dist 0.5"}
    draw.case("tst", nets, inputs, f, meta)


BUILDERS = (instance_norm, spadain, cross_attention, cross_attention_tiled, edge_loss, metric_loss, sinkhorn, lstm, npt, npt_pool, lart,
            corenet, h4d_stage1, tst)
