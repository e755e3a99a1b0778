"""Cases of the method: rotations, skeletons, the extractors, the motion networks with their losses, the deformation networks."""
import torch
from reference import geometry as geo
from reference import models as M

from .case import weigh

FRAMES, PEOPLE = 6, 2


def body(draw, n):
    """A plausible rest skeleton for each of n people, root at the origin."""
    joints = torch.zeros(n, 22, 3, dtype=torch.float64)
    for j in range(1, 22):
        joints[:, j] = joints[:, geo.PARENTS[j]] + draw.rand(n, 3, scale=0.15)
    return joints


def motion(draw, rest):
    """Turns of all joints, the joints that follow from them, root at the origin, and a path."""
    turns = geo.axis_angle_to_matrix(draw.rand(len(rest), FRAMES, 22, 3, scale=0.4))
    still = torch.zeros(len(rest), FRAMES, 3).double()
    joints = geo.fk(turns, rest[:, None].expand(-1, FRAMES, -1, -1), root=still)[1]
    return turns, joints, draw.rand(len(rest), FRAMES, 3, scale=0.3)


def rotations(draw):
    """One turn is tiny, one nearly half a circle, one small."""
    w = draw.rand(6, 3)
    w[1] *= 1e-5
    w[2] = w[2] / w[2].norm() * 3.1
    w[3] = torch.tensor([1e-3, 0, 0])
    probes = [draw.rand(6, 3, 3) for _ in range(3)]

    def f(_, x):
        A, S, Q = geo.axis_angle_to_matrix(x["aa"]), geo.rot6d_to_matrix(x["sixd"]), geo.quat_to_matrix(x["quat"])
        return {"aa": A, "sixd": S, "quat": Q, "aa_back": geo.matrix_to_axis_angle(S.detach()), "quat_back": geo.matrix_to_quat(S.detach()),
                "loss": sum(weigh(a, p) for a, p in zip((A, S, Q), probes)), "probe": torch.stack(probes).to(A.dtype)}
    draw.case("rotations", {}, {"aa": w, "sixd": draw.rand(6, 6), "quat": draw.rand(6, 4)}, f, {"note": "probe[i] weights the three matrices"})


def fk_lbs(draw):
    pj, pv = draw.rand(2, 22, 3), draw.rand(2, 11, 3)

    def f(_, x):
        R = geo.rot6d_to_matrix(x["sixd"])
        G, P = geo.fk(R, x["tpose"], root=x["root"])
        y = geo.lbs(x["points"], x["weights"], G, P, x["tpose"])
        return {"R": R, "G": G, "joints": P, "verts": y, "probe_j": pj.to(P.dtype), "probe_v": pv.to(P.dtype), "loss": weigh(P, pj) + weigh(y, pv)}
    draw.case("fk_lbs", {}, {"sixd": draw.rand(2, 22, 6), "tpose": body(draw, 2), "points": draw.rand(2, 11, 3, scale=0.4),
                             "weights": torch.softmax(draw.rand(2, 11, 22, scale=2), -1), "root": draw.rand(2, 3)}, f, {"parents": geo.PARENTS})


def neighbourhoods(draw):
    def f(_, x):
        c = x["cloud"]
        i = M.fps(c, 16)
        s = M.pick(c, i)
        return {"fps": i, "knn_self": M.knn(c, c, 8), "knn_down": M.knn(s, c, 8), "loss": (s * s).sum()}
    draw.case("neighbourhoods", {}, {"cloud": draw.rand(2, 64, 3)}, f, {"fps": 16, "k": 8})


def gru(draw):
    probe = draw.rand(3, 6, 4)

    def f(m, x):
        y, hn = m["gru"](x["x"], x["h0"])
        return {"y": y, "hn": hn, "probe": probe.to(y.dtype), "loss": weigh(y, probe) + hn.sum()}
    net = draw.init(torch.nn.GRU(5, 4, 2, batch_first=True))
    draw.case("gru", {"gru": net}, {"x": draw.rand(3, 6, 5), "h0": draw.rand(2, 3, 4)}, f, {"input": 5, "hidden": 4, "layers": 2})


def joints_of_clouds(m, x):
    y = m["net"](x["cloud"])
    return {"joints": y, "loss": (y - x["target"]).pow(2).mean()}


def extractor(draw):
    net = draw.init(M.PointTransformerExtractor(64, 2, 8, 16, 8, (16, 8)))
    inputs = {"cloud": draw.rand(2, 64, 3), "target": draw.rand(2, 22, 3)}
    meta = {"n_points": 64, "blocks": 2, "k": 8, "d": 16, "base": 8, "head": (16, 8)}
    draw.case("extractor_train", {"net": net}, inputs, joints_of_clouds, meta, True)
    draw.case("extractor_eval", {"net": net}, inputs, joints_of_clouds, meta)


def vector_attention(draw):
    probe = draw.rand(2, 12, 6)

    def f(m, x):
        y = m["att"](x["xyz"], x["f"])
        return {"y": y, "knn": M.knn(x["xyz"], x["xyz"], 5), "probe": probe.to(y.dtype), "loss": weigh(y, probe)}
    net = draw.init(M.VectorAttention(6, 8, 5))
    draw.case("vector_attention", {"att": net}, {"xyz": draw.rand(2, 12, 3), "f": draw.rand(2, 12, 6)}, f, {"c": 6, "d": 8, "k": 5})


def pointnet(draw, tag, feature_transform):
    net = draw.init(M.PointNetExtractor(feature_transform, (8, 12, 20, 16, 12)))
    net.drop.p = 0.0
    meta = {"widths": (8, 12, 20, 16, 12), "feature_transform": feature_transform, "relu3": True, "dropout": 0}
    for name, train in (("train", True), ("eval", False)):
        inputs = {"cloud": draw.rand(8, 16, 3), "target": draw.rand(8, 22, 3)}
        draw.case("pointnet_%s_%s" % (tag, name), {"net": net}, inputs, joints_of_clouds, meta, train)


def pointnet_stn3(draw):
    pointnet(draw, "stn3", False)


def pointnet_stn3_stn8(draw):
    pointnet(draw, "stn3_stn8", True)


def smrm(draw, rot):
    joints, path = motion(draw, body(draw, PEOPLE))[1:]

    def f(m, x):
        raw, R, P, t, state = m["net"](x["joints"], x["trans"], x["tpose"])
        frames, carried = [], None
        for i in range(FRAMES):                     # frame by frame it says the same
            said = m["net"](x["joints"][:, i:i + 1], x["trans"][:, i:i + 1], x["tpose"], carried)
            carried = said[4]
            frames.append(said[2])
        assert (torch.cat(frames, 1) - P).abs().max() < 1e-5
        return {"raw": raw, "R": R, "joints": P, "trans": t, "h_enc": state[0], "h_dec": state[1],
                "loss": (P - x["target"]).pow(2).mean() + t.pow(2).mean()}
    net = draw.init(M.SMRM(rot, hidden=5, dropout=0.0))
    inputs = {"joints": joints, "trans": path, "tpose": body(draw, PEOPLE), "target": draw.rand(PEOPLE, FRAMES, 22, 3, scale=.3)}
    draw.case("smrm_" + rot, {"net": net}, inputs, f, {"hidden": 5, "layers": 2, "rot": rot})


def smrm_6d(draw):
    smrm(draw, "6d")


def smrm_quat(draw):
    smrm(draw, "quat")


def motion_generator(draw):
    """The whole loss. Item 1 is retargeted to its own body."""
    rest = body(draw, PEOPLE)
    turns, joints, path = motion(draw, rest)
    nets = {"net": draw.init(M.SMRM("6d", hidden=5, dropout=0.0)), "dis": draw.init(M.Discriminator(w=(2, 3, 4, 5)))}

    def f(m, x):
        L, fake = M.motion_losses(m["net"], m["dis"], x["A"], x["tA"], x["tpA"], x["tpB"], x["th6A"], x["self_mask"].detach())
        return {"cyc": L["cyc"], "rot": L["rot"], "smooth": L["smooth"], "adv": L["adv"], "self": L["self"], "loss": L["total"],
                "B_joints": fake[0], "B_trans": fake[1]}
    inputs = {"A": joints, "tA": path, "tpA": rest, "tpB": torch.stack((body(draw, 1)[0], rest[1])), "th6A": geo.matrix_to_rot6d(turns),
              "self_mask": torch.tensor([0.0, 1.0]).double()}
    draw.case("motion_generator", nets, inputs, f, {"hidden": 5, "dis": (2, 3, 4, 5), "self": "item 1"}, True)


def motion_discriminator(draw):
    rest = body(draw, PEOPLE)
    joints, path = motion(draw, rest)[1:]

    def f(m, x):
        real, fake = M.dis_losses(m["dis"], x["real"], x["t_real"], x["tp_real"], x["fake"], x["t_fake"], x["tp_fake"])
        return {"real": real, "fake": fake, "loss": real + fake}
    inputs = {"real": joints, "t_real": path, "tp_real": rest, "fake": joints.flip(0) * 1.1, "t_fake": path.flip(0), "tp_fake": body(draw, PEOPLE)}
    draw.case("motion_discriminator", {"dis": draw.init(M.Discriminator(w=(2, 3, 4, 5)))}, inputs, f, {"dis": (2, 3, 4, 5)}, True)


def discriminator_nkn(draw):
    def f(m, x):
        y = m["dis"](x["x"], x["cond"])
        return {"logit": y, "loss": torch.nn.functional.softplus(-y).mean()}
    net = draw.init(M.Discriminator(70, 63, (2, 3, 4, 5), nkn_head=True))
    draw.case("discriminator_nkn", {"dis": net}, {"x": draw.rand(2, 59, 70), "cond": draw.rand(2, 63)}, f, {"frames": 60}, True)


def motion_self(draw):
    """The default way of motion: the standardised network, one supervised pass from noisy joints."""
    rest = body(draw, PEOPLE)
    turns, joints, path = motion(draw, rest)
    net = draw.init(M.StandardisedSMRM("6d", hidden=5, dropout=0.0))
    with torch.no_grad():
        for name, b in net.named_buffers():
            b.copy_(draw.rand(*b.shape, scale=0.1) if name.endswith("mean") else 0.5 + draw.rand(*b.shape, scale=0.2).abs())

    def f(m, x):
        L, made = M.self_losses(m["net"], x["A"], x["tA"], x["tpA"], x["th6A"], x["X"], x["tX"])
        return {"cyc": L["cyc"], "rot": L["rot"], "smooth": L["smooth"], "loss": L["total"], "joints": made[0], "trans": made[1]}
    inputs = {"A": joints, "tA": path, "tpA": rest, "th6A": geo.matrix_to_rot6d(turns), "X": joints + draw.rand(*joints.shape, scale=0.01),
              "tX": path + draw.rand(*path.shape, scale=0.05)}
    draw.case("motion_self", {"net": net}, inputs, f, {"hidden": 5, "layers": 2, "rot": "6d", "rotation_weight": 1, "smoothness_weight": 0.1})


def deformation(draw):
    def f(m, x):
        loss, y = M.geom_loss(m["W"], m["O"], x["tpose"], geo.axis_angle_to_matrix(x["aa"].detach()), x["aa"].detach(), x["p"], x["q"])
        return {"weights": m["W"](M.join_point(x["tpose"].flatten(1), x["p"])),
                "offsets": m["O"](M.join_point(x["aa"].detach().flatten(1), x["p"])), "posed": y, "loss": loss}
    nets = {"W": draw.init(M.WNet(12), 2), "O": draw.init(M.ONet(12), 2)}
    inputs = {"tpose": body(draw, 2), "aa": draw.rand(2, 22, 3, scale=.5), "p": draw.rand(2, 9, 3, scale=.4), "q": draw.rand(2, 9, 3, scale=.4)}
    draw.case("deformation", nets, inputs, f, {"width": 12})


def mlp_dropout_masks(draw):
    """Dropout with given masks; about a fifth of their entries is 0."""
    masks = [(draw.rand(7, 12) > -0.84).double() for _ in range(2)]
    probe = draw.rand(7, 22)

    def f(m, x):
        y = m["W"](x["x"], (x["mask1"].detach(), x["mask2"].detach()))
        return {"y": y, "probe": probe.to(y.dtype), "loss": weigh(y, probe)}
    draw.case("mlp_dropout_masks", {"W": draw.init(M.WNet(12), 2)}, {"x": draw.rand(7, 69), "mask1": masks[0], "mask2": masks[1]}, f, {"p": 0.2})


def plain_mlp(draw, name, net, outputs):
    def f(m, x):
        y = m["net"](x["x"])
        return {"y": y, "loss": (y - x["target"]).pow(2).sum()}
    draw.case(name, {"net": draw.init(net)}, {"x": draw.rand(5, 66), "target": draw.rand(5, outputs)}, f, {"width": 12})


def third_mlp(draw):
    plain_mlp(draw, "third_mlp", M.RootNet(12), 3)


def v1_field(draw):
    plain_mlp(draw, "v1_field", M.V1Field(12), 22)


BUILDERS = (rotations, fk_lbs, neighbourhoods, gru, extractor, vector_attention, pointnet_stn3, pointnet_stn3_stn8, smrm_6d, smrm_quat,
            motion_generator, motion_discriminator, discriminator_nkn, motion_self, deformation, mlp_dropout_masks, third_mlp, v1_field)
