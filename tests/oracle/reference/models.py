"""Networks of the method (docs/method.md). Widths are arguments so that small copies can be made;
the defaults are the full-size models. Parameter names follow PyTorch state-dict style."""
import math
import torch
from torch import nn
import torch.nn.functional as F
from . import geometry as geo

J = 22


# ---------------------------------------------------------------- neighbourhoods
def knn(query, ref, k):
    """Indices of the k nearest ref points of each query point, nearest first; equal distances are
    ordered by index (stable sort); k is clipped to the number of ref points."""
    d = (query[:, :, None] - ref[:, None]).pow(2).sum(-1)
    return torch.sort(d, dim=-1, stable=True)[1][:, :, :k]


def fps(x, m):
    """Farthest point sampling. Starts at the point farthest from the centroid; every argmax takes
    the lowest index among equals."""
    n, N, _ = x.shape
    first = lambda v: (v == v.max(1, keepdim=True)[0]).to(torch.int64).argmax(1)
    cur = first((x - x.mean(1, keepdim=True)).pow(2).sum(-1))
    dist = torch.full((n, N), 1e10, dtype=x.dtype)
    out, rows = [], torch.arange(n)
    for _ in range(m):
        out.append(cur)
        dist = torch.minimum(dist, (x - x[rows, cur][:, None]).pow(2).sum(-1))
        cur = first(dist)
    return torch.stack(out, 1)


def pick(x, idx):
    """x [N,V,C], idx [N,...] -> [N,...,C]"""
    flat = idx.reshape(idx.shape[0], -1, 1).expand(-1, -1, x.shape[-1])
    return torch.gather(x, 1, flat).reshape(*idx.shape, x.shape[-1])


# ---------------------------------------------------------------- point transformer extractor
class VectorAttention(nn.Module):
    def __init__(self, c, d, k):
        super().__init__()
        self.k = k
        self.fc1, self.fc2 = nn.Linear(c, d), nn.Linear(d, c)
        self.fc_delta = nn.Sequential(nn.Linear(3, d), nn.ReLU(), nn.Linear(d, d))
        self.fc_gamma = nn.Sequential(nn.Linear(d, d), nn.ReLU(), nn.Linear(d, d))
        self.w_qs = nn.Linear(d, d, bias=False)
        self.w_ks = nn.Linear(d, d, bias=False)
        self.w_vs = nn.Linear(d, d, bias=False)

    def forward(self, xyz, f):
        idx = knn(xyz, xyz, self.k)
        h = self.fc1(f)
        delta = self.fc_delta(xyz[:, :, None] - pick(xyz, idx))
        e = self.fc_gamma(self.w_qs(h)[:, :, None] - pick(self.w_ks(h), idx) + delta)
        a = torch.softmax(e / math.sqrt(e.shape[-1]), dim=2)
        return f + self.fc2((a * (pick(self.w_vs(h), idx) + delta)).sum(2))


class SetAbstraction(nn.Module):
    def __init__(self, m, k, cin, cout):
        super().__init__()
        self.m, self.k = m, k
        self.mlp_convs = nn.ModuleList([nn.Conv2d(cin, cout, 1), nn.Conv2d(cout, cout, 1)])
        self.mlp_bns = nn.ModuleList([nn.BatchNorm2d(cout), nn.BatchNorm2d(cout)])

    def forward(self, xyz, f):
        centre = pick(xyz, fps(xyz, self.m))
        idx = knn(centre, xyz, self.k)
        g = torch.cat((pick(xyz, idx) - centre[:, :, None], pick(f, idx)), -1)
        g = g.permute(0, 3, 2, 1)                       # N, 3+C, k, m
        for conv, bn in zip(self.mlp_convs, self.mlp_bns):
            g = F.relu(bn(conv(g)))
        return centre, g.max(2)[0].transpose(1, 2)


class TransitionDown(nn.Module):
    def __init__(self, m, k, cin, cout):
        super().__init__()
        self.sa = SetAbstraction(m, k, cin, cout)

    def forward(self, xyz, f):
        return self.sa(xyz, f)


class Backbone(nn.Module):
    def __init__(self, n_points, blocks, k, d, base):
        super().__init__()
        self.fc1 = nn.Sequential(nn.Linear(3, base), nn.ReLU(), nn.Linear(base, base))
        self.transformer1 = VectorAttention(base, d, k)
        self.transition_downs, self.transformers = nn.ModuleList(), nn.ModuleList()
        for i in range(blocks):
            c = base * 2 ** (i + 1)
            self.transition_downs.append(TransitionDown(n_points // 4 ** (i + 1), k, c // 2 + 3, c))
            self.transformers.append(VectorAttention(c, d, k))

    def forward(self, xyz):
        f = self.transformer1(xyz, self.fc1(xyz))
        for down, att in zip(self.transition_downs, self.transformers):
            xyz, f = down(xyz, f)
            f = att(xyz, f)
        return xyz, f


class PointTransformerExtractor(nn.Module):
    """Table 6: cloud [N,V,3] -> joints [N,J,3]."""
    def __init__(self, n_points=1024, blocks=4, k=16, d=512, base=32, head=(256, 64), joints=J):
        super().__init__()
        self.backbone = Backbone(n_points, blocks, k, d, base)
        self.fc2 = nn.Sequential(nn.Linear(base * 2 ** blocks, head[0]), nn.ReLU(),
                                 nn.Linear(head[0], head[1]), nn.ReLU(), nn.Linear(head[1], joints * 3))

    def forward(self, x):
        return self.fc2(self.backbone(x)[1].mean(1)).reshape(x.shape[0], -1, 3)


# ---------------------------------------------------------------- PointNet extractor (v1)
class SpatialTransformer(nn.Module):
    """T-net giving a k x k matrix, identity added to the output."""
    def __init__(self, k=3, w=(64, 128, 1024, 512, 256)):
        super().__init__()
        self.k = k
        self.conv1, self.conv2, self.conv3 = nn.Conv1d(k, w[0], 1), nn.Conv1d(w[0], w[1], 1), nn.Conv1d(w[1], w[2], 1)
        self.fc1, self.fc2, self.fc3 = nn.Linear(w[2], w[3]), nn.Linear(w[3], w[4]), nn.Linear(w[4], k * k)
        self.bn1, self.bn2, self.bn3 = nn.BatchNorm1d(w[0]), nn.BatchNorm1d(w[1]), nn.BatchNorm1d(w[2])
        self.bn4, self.bn5 = nn.BatchNorm1d(w[3]), nn.BatchNorm1d(w[4])

    def forward(self, x):
        h = F.relu(self.bn1(self.conv1(x)))
        h = F.relu(self.bn2(self.conv2(h)))
        h = F.relu(self.bn3(self.conv3(h))).max(2)[0]
        h = F.relu(self.bn4(self.fc1(h)))
        h = F.relu(self.bn5(self.fc2(h)))
        return self.fc3(h).reshape(-1, self.k, self.k) + torch.eye(self.k, dtype=x.dtype)


class PointNetExtractor(nn.Module):
    """v1 Table 5 on the usual PointNet code base: cloud [N,V,3] -> joints [N,J,3].
    relu3: apply the ReLU of Table 5 row 4 (the public PointNet code has none there)."""
    def __init__(self, feature_transform=False, w=(64, 128, 1024, 512, 256), joints=J, relu3=True):
        super().__init__()
        self.relu3 = relu3
        self.stn = SpatialTransformer(3, w)
        self.fstn = SpatialTransformer(w[0], w) if feature_transform else None
        self.conv1, self.conv2, self.conv3 = nn.Conv1d(3, w[0], 1), nn.Conv1d(w[0], w[1], 1), nn.Conv1d(w[1], w[2], 1)
        self.bn1, self.bn2, self.bn3 = nn.BatchNorm1d(w[0]), nn.BatchNorm1d(w[1]), nn.BatchNorm1d(w[2])
        self.fc1, self.fc2, self.fc3 = nn.Linear(w[2], w[3]), nn.Linear(w[3], w[4]), nn.Linear(w[4], joints * 3)
        self.bn4, self.bn5, self.drop = nn.BatchNorm1d(w[3]), nn.BatchNorm1d(w[4]), nn.Dropout(0.3)

    def forward(self, cloud):
        x = (cloud @ self.stn(cloud.transpose(1, 2))).transpose(1, 2)       # points as rows: p A
        x = F.relu(self.bn1(self.conv1(x)))
        if self.fstn is not None:
            x = (x.transpose(1, 2) @ self.fstn(x)).transpose(1, 2)
        x = F.relu(self.bn2(self.conv2(x)))
        x = self.bn3(self.conv3(x))
        x = (F.relu(x) if self.relu3 else x).max(2)[0]
        x = F.relu(self.bn4(self.fc1(x)))
        x = F.relu(self.bn5(self.drop(self.fc2(x))))
        return self.fc3(x).reshape(cloud.shape[0], -1, 3)


# ---------------------------------------------------------------- motion retargeting (SMRM)
class SMRM(nn.Module):
    """Table 5. rot: '6d' (v2) or 'quat' (v1)."""
    def __init__(self, rot="6d", hidden=512, layers=2, joints=J, dropout=0.2):
        super().__init__()
        self.rot, self.joints = rot, joints
        self.enc = nn.GRU(3 * (joints + 1), hidden, layers, batch_first=True, dropout=dropout)
        self.dec = nn.GRU(hidden + 3 * joints, hidden, layers, batch_first=True, dropout=dropout)
        self.fc_rot = nn.Linear(hidden, joints * (6 if rot == "6d" else 4))
        self.fc_trans = nn.Linear(hidden, 3)

    def matrices(self, r):
        r = r.reshape(*r.shape[:-1], self.joints, -1)
        return geo.rot6d_to_matrix(r) if self.rot == "6d" else geo.quat_to_matrix(r)

    def forward(self, joints, trans, tpose, state=None):
        """joints [N,T,J,3] root-relative, trans [N,T,3], tpose [N,J,3] root-relative.
        Returns raw rotations [N,T,J*6], R [N,T,J,3,3], root-relative joints [N,T,J,3],
        trans [N,T,3] and the carried state (encoder, decoder)."""
        n, T = joints.shape[:2]
        h_e, h_d = state if state is not None else (None, None)
        e, h_e = self.enc(torch.cat((joints.reshape(n, T, -1), trans), -1), h_e)
        rest = tpose.reshape(n, 1, -1).expand(-1, T, -1)
        d, h_d = self.dec(torch.cat((e, rest), -1), h_d)
        raw, t = self.fc_rot(d), self.fc_trans(d)
        R = self.matrices(raw)
        P = geo.fk(R, tpose[:, None].expand(-1, T, -1, -1), root=torch.zeros_like(t))[1]
        return raw, R, P, t, (h_e, h_d)


class StandardisedSMRM(SMRM):
    """The SMRM with inputs and both outputs in units of the training set's deviation: (x - mean) / std per coordinate
    before the networks, raw * rot_std + rot_mean and t * trans_std + trans_mean after them. Statistics are buffers."""
    def __init__(self, rot="6d", hidden=512, layers=2, joints=J, dropout=0.2):
        super().__init__(rot, hidden, layers, joints, dropout)
        for name, n in (("joint", 3 * joints), ("rest", 3 * joints), ("trans", 3), ("rot", joints * (6 if rot == "6d" else 4))):
            self.register_buffer(name + "_mean", torch.zeros(n))
            self.register_buffer(name + "_std", torch.ones(n))

    def forward(self, joints, trans, tpose, state=None):
        n, T = joints.shape[:2]
        h_e, h_d = state if state is not None else (None, None)
        a = (joints.reshape(n, T, -1) - self.joint_mean) / self.joint_std
        v = (trans - self.trans_mean) / self.trans_std
        rest = ((tpose.reshape(n, 1, -1) - self.rest_mean) / self.rest_std).expand(-1, T, -1)
        e, h_e = self.enc(torch.cat((a, v), -1), h_e)
        d, h_d = self.dec(torch.cat((e, rest), -1), h_d)
        raw, t = self.fc_rot(d) * self.rot_std + self.rot_mean, self.fc_trans(d) * self.trans_std + self.trans_mean
        R = self.matrices(raw)
        P = geo.fk(R, tpose[:, None].expand(-1, T, -1, -1), root=torch.zeros_like(t))[1]
        return raw, R, P, t, (h_e, h_d)


def self_losses(net, A, tA, tpA, th6A, X, tX, lam_rot=1.0, lam_smooth=0.1):
    """One supervised pass A -> A from the (noisy) input X, tX: joints + translation, rotations, frame differences."""
    mse = lambda a, b: (a - b).pow(2).mean()
    raw, R, P, t, _ = net(X, tX, tpA)
    L = {"cyc": mse(P, A) + mse(t, tA), "rot": mse(geo.matrix_to_rot6d(R), th6A),
         "smooth": mse(P[:, 1:] - P[:, :-1], A[:, 1:] - A[:, :-1])}
    L["total"] = L["cyc"] + lam_rot * L["rot"] + lam_smooth * L["smooth"]
    return L, (P, t)


# ---------------------------------------------------------------- discriminators
def same_conv(x, conv, stride):
    """1-D convolution with output length ceil(L / stride), the larger half of the padding last."""
    L, k = x.shape[-1], conv.kernel_size[0]
    out = -(-L // stride)
    pad = max((out - 1) * stride + k - L, 0)
    return F.conv1d(F.pad(x, (pad // 2, pad - pad // 2)), conv.weight, conv.bias, stride)


class Discriminator(nn.Module):
    """The NKN discriminator with a length-independent last layer.
    x [N,T-1,cin] frame differences and the translation of the later frame, cond [N,cc] T-pose bone vectors -> logit [N]."""
    def __init__(self, cin=3 * J + 3, cc=3 * (J - 1), w=(32, 64, 128, 256), nkn_head=False):
        super().__init__()
        self.nkn_head = nkn_head
        c = [cin] + [w[0]] + [v + cc for v in w[1:]]
        self.convs = nn.ModuleList([nn.Conv1d(c[i], w[i], 4) for i in range(4)])
        self.bns = nn.ModuleList([nn.BatchNorm1d(v, eps=1e-5, momentum=0.1) for v in w[1:]])
        self.out = nn.Conv1d(c[4], 1, 4)

    def forward(self, x, cond):
        h = F.leaky_relu(same_conv(x.transpose(1, 2), self.convs[0], 2), 0.2)
        for conv, bn in zip(list(self.convs)[1:], self.bns):
            h = F.leaky_relu(bn(same_conv(h, conv, 2)), 0.2)
            h = torch.cat((h, cond[:, :, None].expand(-1, -1, h.shape[-1])), 1)
        if self.nkn_head:                    # original: VALID convolution over the last 4 steps
            return F.conv1d(h, self.out.weight, self.out.bias, 2)[:, 0, 0]
        return same_conv(h, self.out, 1)[:, 0].mean(1)


# ---------------------------------------------------------------- deformation networks
class MLP3(nn.Module):
    def __init__(self, cin, cout, w=256, p=0.2, softmax=False):
        super().__init__()
        self.fc1, self.fc2, self.fc3 = nn.Linear(cin, w), nn.Linear(w, w), nn.Linear(w, cout)
        self.p, self.softmax = p, softmax

    def forward(self, x, masks=None):
        """masks: two 0/1 tensors, to replace the random dropout by a given one."""
        drop = (lambda h, i: h * masks[i] / (1 - self.p)) if masks is not None else \
            (lambda h, i: F.dropout(h, self.p, self.training))
        h = F.relu(drop(self.fc1(x), 0))
        h = F.relu(drop(self.fc2(h), 1))
        y = self.fc3(h)
        return torch.softmax(y, -1) if self.softmax else y


def WNet(w=256):
    """[J_tpose (66), p (3)] -> 22 weights"""
    return MLP3(3 * J + 3, J, w, softmax=True)


def ONet(w=256):
    """[axis-angle of 22 joints (66), p (3)] -> offset"""
    return MLP3(3 * J + 3, 3, w)


def RootNet(w=256):
    """Third MLP implied by the papers' count of parameters: 66 -> 3. No paper says what it is for."""
    return MLP3(3 * J, 3, w)


def V1Field(w=256):
    """v1: [p - J_j for 22 joints (66)] -> 22 weights"""
    return MLP3(3 * J, J, w, softmax=True)


def join_point(vec, p):
    """vec [N,C], p [N,V,3] -> [N,V,C+3]"""
    return torch.cat((vec[:, None].expand(-1, p.shape[1], -1), p), -1)


# ---------------------------------------------------------------- losses
def motion_losses(net, dis, A, tA, tpA, tpB, th6A, self_mask=None, lam_rot=0.01, lam_smooth=0.1):
    """Generator side of equation 2 A [N,T,J,3], tA [N,T,3]."""
    mse = lambda a, b: (a - b).pow(2).mean()
    rawB, RB, PB, tB, _ = net(A, tA, tpB)
    raw, R, P, t, _ = net(PB, tB, tpA)
    L = {"cyc": mse(P, A) + mse(t, tA), "rot": mse(geo.matrix_to_rot6d(R), th6A)}
    L["smooth"] = mse(P[:, 1:] - P[:, :-1], A[:, 1:] - A[:, :-1])
    keep = torch.ones(A.shape[0], dtype=A.dtype) if self_mask is None else 1 - self_mask
    if self_mask is not None:
        k = self_mask.sum().clamp_min(1)
        per = (PB - A).pow(2).flatten(1).mean(1) + (tB - tA).pow(2).flatten(1).mean(1)
        L["self"] = (per * self_mask).sum() / k
    logit = dis(dis_input(PB, tB), bone_vectors(tpB))
    L["adv"] = (F.softplus(-logit) * keep).sum() / keep.sum().clamp_min(1)
    L["total"] = L["cyc"] + L["adv"] + lam_rot * L["rot"] + lam_smooth * L["smooth"] + L.get("self", 0)
    return L, (PB, tB)


def dis_losses(dis, real, t_real, tp_real, fake, t_fake, tp_fake):
    """BCE with label 1 for real and 0 for fake, each averaged over the batch, then added."""
    lr = F.softplus(-dis(dis_input(real, t_real), bone_vectors(tp_real))).mean()
    lf = F.softplus(dis(dis_input(fake.detach(), t_fake.detach()), bone_vectors(tp_fake))).mean()
    return lr, lf


def dis_input(P, t):
    d = (P[:, 1:] - P[:, :-1]).flatten(2)
    return torch.cat((d, t[:, 1:]), -1)          # t is a backward difference: same step as d


def bone_vectors(tpose):
    par = torch.tensor(geo.PARENTS[1:])
    return (tpose[:, 1:] - tpose[:, par]).flatten(1)


def geom_loss(W, O, tpose, R, aa, p, q, use_offsets=True, root=None):
    """Equation 4 (sum of squared distances)."""
    o = O(join_point(aa.flatten(1), p)) if use_offsets else torch.zeros_like(p)
    y = geo.retarget(R, tpose, W(join_point(tpose.flatten(1), p)), p + o, root)
    return (q - y).pow(2).sum(), y
