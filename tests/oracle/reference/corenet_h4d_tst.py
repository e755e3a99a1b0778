"""3D-CoreNet, H4D (first stage) and TST, after their public programs' layers (docs/systems).
Point sets are channels-first [N,3,V] except in H4D. Widths are arguments; the defaults are the full-size networks."""
import sys
import torch
from torch import nn
import torch.nn.functional as F
from . import npt_lart as B
from . import geometry as geo

TINY = sys.float_info.epsilon                              # 2.2e-16, added to vector lengths


# ---------------------------------------------------------------- 3D-CoreNet
def sinkhorn(C, steps=5, temperature=0.03, eps=1e-8):
    """C [N,n,m] similarities (rows: identity points) -> transport plan, and the plan with rows summing to 1.
    K = exp(-(1-C)/t); a starts at 1/n; each step: b = (1/m) / (K'a + eps), then a = (1/n) / (K b + eps)."""
    n, m = C.shape[1:]
    K = torch.exp(-(1 - C) / temperature)
    a = torch.full_like(C[:, :, :1], 1 / n)
    for _ in range(steps):
        b = (1 / m) / (K.transpose(1, 2) @ a + eps)
        a = (1 / n) / (K @ b + eps)
    T = a * K * b.transpose(1, 2)
    return T, T / T.sum(2, keepdim=True)


def unit_channels(x):
    return x / (x.norm(2, 1, keepdim=True) + TINY)


class PointResBlock(nn.Module):
    """act is one PReLU (a single slope) used twice: inside, and after the sum."""
    def __init__(self, c):
        super().__init__()
        self.conv1, self.conv2, self.act = nn.Conv1d(c, c, 1), nn.Conv1d(c, c, 1), nn.PReLU()

    def forward(self, x):
        h = self.act(F.instance_norm(self.conv1(x)))
        return self.act(x + F.instance_norm(self.conv2(h)))


class Correspondence(nn.Module):
    def __init__(self, w=(64, 128, 256), blocks=4):
        super().__init__()
        c = (3,) + tuple(w)
        self.convs = nn.ModuleList([nn.Conv1d(c[i], c[i + 1], 1) for i in range(3)])
        self.res = nn.ModuleList([PointResBlock(w[2]) for _ in range(blocks)])
        self.phi, self.theta = nn.Conv1d(w[2], w[2], 1), nn.Conv1d(w[2], w[2], 1)

    def features(self, x):
        for i, conv in enumerate(self.convs):
            x = F.instance_norm(conv(x if i == 0 else F.leaky_relu(x, 0.2)))
        x = unit_channels(x)
        for r in self.res:
            x = r(x)
        return x

    def forward(self, pose, ident):
        """-> identity features [N,C,V2], row-normalised plan [N,V2,V1], warped points [N,V2,3]"""
        f = self.features(ident)
        q, k = unit_channels(self.theta(f)), unit_channels(self.phi(self.features(pose)))
        T = sinkhorn(q.transpose(1, 2) @ k)[1]
        return f, T, T @ pose.transpose(1, 2)


class SpectralConv(nn.Module):
    """1x1 convolution with weight W / (u'W v). u and v are buffers. Every training-mode forward first does one power
    iteration, v = unit(W'u) then u = unit(W v), and keeps both; evaluation uses them as stored. No gradient through u, v."""
    def __init__(self, cin, cout, bias=True):
        super().__init__()
        conv = nn.Conv1d(cin, cout, 1, bias=bias)
        self.weight_orig, self.bias = conv.weight, conv.bias
        self.register_buffer("weight_u", F.normalize(torch.randn(cout), dim=0, eps=1e-12))
        self.register_buffer("weight_v", F.normalize(torch.randn(cin), dim=0, eps=1e-12))

    def forward(self, x):
        W = self.weight_orig.flatten(1)
        if self.training:
            with torch.no_grad():
                self.weight_v.copy_(F.normalize(W.t() @ self.weight_u, dim=0, eps=1e-12))
                self.weight_u.copy_(F.normalize(W @ self.weight_v, dim=0, eps=1e-12))
        sigma = self.weight_u.clone() @ (W @ self.weight_v.clone())
        return F.conv1d(x, (W / sigma)[:, :, None], self.bias)


class ElaIN(nn.Module):
    """Variance over points is the UNBIASED one, + 1e-5 (unlike instance norm). The mixing weight w is not squashed."""
    def __init__(self, c, ic):
        super().__init__()
        self.same, self.gamma, self.beta = nn.Conv1d(ic, c, 1), nn.Conv1d(c, c, 1), nn.Conv1d(c, c, 1)
        self.mix = nn.Conv1d(2 * c, c, 1)

    def forward(self, x, ident):
        a = self.same(ident)
        m, s = x.mean(2, keepdim=True), (x.var(2, unbiased=True, keepdim=True) + 1e-5).sqrt()
        w = self.mix(torch.cat((a.mean(2, keepdim=True), m), 1))
        gamma, beta = self.gamma(a) * w + s * (1 - w), self.beta(a) * w + m * (1 - w)
        return (x - m) / s * (1 + gamma) + beta


class ElaINBlock(nn.Module):
    def __init__(self, c, ic):
        super().__init__()
        self.n0, self.n1, self.ns = ElaIN(c, ic), ElaIN(c, ic), ElaIN(c, ic)
        self.c0, self.c1, self.cs = SpectralConv(c, c), SpectralConv(c, c), SpectralConv(c, c, bias=False)

    def forward(self, x, ident):
        act = lambda t: F.leaky_relu(t, 0.2)
        h = self.c0(act(self.n0(x, ident)))
        return self.cs(act(self.ns(x, ident))) + self.c1(act(self.n1(h, ident)))


class CoreNet(nn.Module):
    """fc looks at three neighbouring ROWS of the point list (zero padded), so the result depends on the points' order."""
    def __init__(self, w=(64, 128, 256), g=(1024, 512, 256), blocks=4):
        super().__init__()
        self.corr = Correspondence(w, blocks)
        self.fc = nn.Conv1d(3, g[0], 3, padding=1)
        c = (g[0],) + tuple(g)
        self.convs = nn.ModuleList([nn.Conv1d(c[i], c[i + 1], 1) for i in range(3)])
        self.blocks = nn.ModuleList([ElaINBlock(v, w[2]) for v in g])
        self.out = nn.Conv1d(g[2], 3, 1)

    def forward(self, pose, ident):
        """-> points [N,V2,3], warped points [N,V2,3], row-normalised plan [N,V2,V1]"""
        f, T, warp = self.corr(pose, ident)
        x = self.fc(warp.transpose(1, 2))
        for conv, blk in zip(self.convs, self.blocks):
            x = blk(conv(x), f)
        return (2 * torch.tanh(self.out(x))).transpose(1, 2), warp, T


def corenet_loss(y, gt, ident, faces, rec=1000.0, edge=0.5):
    """y, gt [N,V,3]; ident [N,3,V] gives the reference lengths. Returns the two raw terms and the total."""
    r, e = (y - gt).pow(2).mean(), B.edge_loss_batch(y, faces, ident.transpose(1, 2).detach())
    return r, e, rec * r + edge * e


# ---------------------------------------------------------------- H4D, first stage
class ResBlockFC(nn.Module):
    def __init__(self, cin, cout):
        super().__init__()
        self.fc_0, self.fc_1 = nn.Linear(cin, min(cin, cout)), nn.Linear(min(cin, cout), cout)
        self.shortcut = nn.Linear(cin, cout, bias=False)
        nn.init.zeros_(self.fc_1.weight)

    def forward(self, x):
        return self.shortcut(x) + self.fc_1(F.relu(self.fc_0(F.relu(x))))


class ResPointnet(nn.Module):
    """points [N,V,3] -> code [N,c]. After each of the first four blocks the maximum over points is joined to every point."""
    def __init__(self, c, h=128):
        super().__init__()
        self.fc_pos, self.fc_c = nn.Linear(3, 2 * h), nn.Linear(h, c)
        self.blocks = nn.ModuleList([ResBlockFC(2 * h, h) for _ in range(5)])

    def forward(self, p):
        x = self.fc_pos(p)
        for i, blk in enumerate(self.blocks):
            x = blk(x)
            m = x.max(1, keepdim=True)[0]
            x = torch.cat((x, m.expand_as(x)), 2) if i < 4 else m[:, 0]
        return self.fc_c(F.relu(x))


class PlainPointnet(nn.Module):
    """The same without shortcuts: relu, Linear(2h -> h), three times."""
    def __init__(self, c=128, h=128):
        super().__init__()
        self.fc_pos, self.fc_c = nn.Linear(3, 2 * h), nn.Linear(h, c)
        self.fc = nn.ModuleList([nn.Linear(2 * h, h) for _ in range(3)])

    def forward(self, p):
        x = self.fc_pos(p)
        for i, fc in enumerate(self.fc):
            x = fc(F.relu(x))
            m = x.max(1, keepdim=True)[0]
            x = torch.cat((x, m.expand_as(x)), 2) if i < 2 else m[:, 0]
        return self.fc_c(F.relu(x))


class TemporalEncoder(nn.Module):
    """[N,T,c] -> [N,T,out]: two GRU layers from a zero state, relu, Linear."""
    def __init__(self, cin, hidden, out):
        super().__init__()
        self.gru, self.linear = nn.GRU(cin, hidden, 2, batch_first=True), nn.Linear(hidden, out)

    def forward(self, x):
        return self.linear(F.relu(self.gru(x)[0]))


class H4DStage1(nn.Module):
    def __init__(self, betas=10, pose=72, motion=90, h=128, feat=128, gru=512):
        super().__init__()
        self.id_encoder, self.pose_encoder = ResPointnet(betas, h), ResPointnet(pose, h)
        self.point_encoder, self.motion_encoder = PlainPointnet(feat, h), TemporalEncoder(feat, gru, motion)

    def codes(self, seq):
        """seq [N,T,V,3] -> shape code, pose of frame 0 (axis-angle), motion code (last GRU step)"""
        n, T = seq.shape[:2]
        f = self.point_encoder(seq.flatten(0, 1)).reshape(n, T, -1)
        return self.id_encoder(seq[:, 0]), self.pose_encoder(seq[:, 0]), self.motion_encoder(f)[:, -1]


def h4d_poses(pose0, motion, rot_pc, rot_mean, joint_pc, joint_mean):
    """pose0 [N,3J]; rot_pc [r,3(T-1)], joint_pc [m,(3J-3)(T-1)], rows are components, columns frame by frame.
    Every later frame = frame 0 + change AGAINST FRAME 0 (axis-angle numbers added). -> [N,T,3J]"""
    n, r = motion.shape[0], rot_pc.shape[0]
    d = torch.cat(((motion[:, :r] @ rot_pc + rot_mean).reshape(n, -1, 3),
                   (motion[:, r:] @ joint_pc + joint_mean).reshape(n, -1, pose0.shape[1] - 3)), 2)
    return torch.cat((pose0[:, None], pose0[:, None] + d), 1)


def linear_body(beta, pose, template, shape_basis, regressor, weights, parents):
    """Stand-in for SMPL without pose blend shapes: v = template + shape_basis beta, joints = regressor v, skinning.
    beta [N,b], pose [N,T,3J], template [V,3], shape_basis [V,3,b], regressor [J,V], weights [V,J] -> [N,T,V,3].
    The posed root joint stays at the rest root joint: no translation."""
    v = (template + torch.einsum("vcb,nb->nvc", shape_basis, beta))[:, None].expand(-1, pose.shape[1], -1, -1)
    tp = regressor @ v
    G, P = geo.fk(geo.axis_angle_to_matrix(pose.reshape(*pose.shape[:2], -1, 3)), tp, parents)
    return geo.lbs(v, weights, G, P, tp)


def h4d_stage1_loss(verts, gt_verts, beta, gt_beta):
    """mean absolute coordinate difference, and mean over the batch of the (unsquared) length of the shape difference"""
    return (verts - gt_verts).abs().mean(), (gt_beta - beta).norm(dim=-1).mean()


# ---------------------------------------------------------------- TST
class TST(nn.Module):
    """pose [T,3,V] (one window of T frames, vertices in correspondence), ident [T,3,V] -> [T,V,3].
    Point branch without any norm (leaky relu 0.01); temporal branch: all coordinates of a frame (x of all vertices, then y,
    then z) -> Linear, relu -> LSTM over the T frames from a zero state -> Linear, tanh, joined as 3 more channels."""
    def __init__(self, vertices=6890, w=(64, 128, 1024), d=1024, hidden=256, layers=3):
        super().__init__()
        c = (3,) + tuple(w)
        self.enc = nn.ModuleList([nn.Conv1d(c[i], c[i + 1], 1) for i in range(3)])
        self.t_in, self.t_out = nn.Linear(3 * vertices, d), nn.Linear(hidden, 3 * vertices)
        self.lstm = nn.LSTM(d, hidden, layers)
        b = w[2] + 6
        c = (b, b, b // 2, b // 4)
        self.convs = nn.ModuleList([nn.Conv1d(c[i], c[i + 1], 1) for i in range(3)])
        self.blocks = nn.ModuleList([B.SpadainBlock(v) for v in c[1:]])
        self.out = nn.Conv1d(c[3], 3, 1)

    def encode(self, pose):
        T = pose.shape[0]
        h = self.lstm(F.relu(self.t_in(pose.reshape(T, 1, -1))))[0]
        x = pose
        for conv in self.enc:
            x = F.leaky_relu(conv(x), 0.01)
        return torch.cat((x, torch.tanh(self.t_out(h)).reshape(T, 3, -1)), 1)

    def forward(self, pose, ident):
        x = torch.cat((self.encode(pose), ident), 1)
        for conv, blk in zip(self.convs, self.blocks):
            x = blk(F.instance_norm(conv(x)), ident)
        return (2 * torch.tanh(self.out(x))).transpose(1, 2)


class TSTDiscriminator(nn.Module):
    """[T,V,3] flattened vertex by vertex (x0 y0 z0 x1 ...) -> probability [T,1]"""
    def __init__(self, vertices=6890, w=(512, 128)):
        super().__init__()
        self.fc1, self.fc2, self.fc3 = nn.Linear(3 * vertices, w[0]), nn.Linear(w[0], w[1]), nn.Linear(w[1], 1)

    def forward(self, x):
        return torch.sigmoid(self.fc3(F.relu(self.fc2(F.relu(self.fc1(x.flatten(1)))))))


def tst_loss(y, gt, ident, faces, prob, adv=1.0, rec=2.0, edge=0.5, dist=0.5):
    """Generator loss: -log D (mean over frames), SUM of squared coordinate differences, edge loss SUMMED over frames (reference
    lengths from the identity mesh), squared differences of pairwise distances summed over pairs and frames / (V(V-1)/2)."""
    V = y.shape[1]
    d = lambda x: torch.cdist(x, x, compute_mode="donot_use_mm_for_euclid_dist")
    L = {"adv": F.binary_cross_entropy(prob, torch.ones_like(prob)), "rec": (y - gt).pow(2).sum(),
         "edge": B.edge_loss_batch(y, faces, ident.transpose(1, 2).detach()) * y.shape[0],
         "dist": (d(y) - d(gt)).pow(2).sum() / 2 / (V * (V - 1) / 2)}
    L["loss"] = adv * L["adv"] + rec * L["rec"] + edge * L["edge"] + dist * L["dist"]
    return L
