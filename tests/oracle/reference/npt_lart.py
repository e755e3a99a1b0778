"""NPT, layer by layer as its public program has it, and a reconstruction of LART from its paper (docs/systems/npt.md, lart.md)."""
import torch
from torch import nn
import torch.nn.functional as F


class PoseEncoder(nn.Module):
    def __init__(self, w=(64, 128, 1024)):
        super().__init__()
        c = (3,) + tuple(w)
        self.convs = nn.ModuleList([nn.Conv1d(c[i], c[i + 1], 1) for i in range(3)])

    def forward(self, x):
        for conv in self.convs:
            x = F.relu(F.instance_norm(conv(x)))
        return x


class Spadain(nn.Module):
    """norm=False skips the instance normalisation. That is needed where x is one pooled code repeated
    at every point: normalising over points would turn it into zeros and lose the pose."""
    def __init__(self, c, norm=True):
        super().__init__()
        self.norm, self.scale, self.shift = norm, nn.Conv1d(3, c, 1), nn.Conv1d(3, c, 1)

    def forward(self, x, mesh):
        return self.scale(mesh) * (F.instance_norm(x) if self.norm else x) + self.shift(mesh)


class SpadainBlock(nn.Module):
    def __init__(self, c, norm=True):
        super().__init__()
        self.n1, self.n2, self.n3 = Spadain(c, norm), Spadain(c, norm), Spadain(c, norm)
        self.c1, self.c2, self.c3 = nn.Conv1d(c, c, 1), nn.Conv1d(c, c, 1), nn.Conv1d(c, c, 1)

    def forward(self, x, mesh):
        h = self.c1(F.relu(self.n1(x, mesh)))
        h = self.c2(F.relu(self.n2(h, mesh)))
        return h + self.c3(F.relu(self.n3(x, mesh)))


class NPT(nn.Module):
    """pose [N,3,V1], identity mesh [N,3,V2] -> [N,V2,3]. pool=True: max-pooled pose code."""
    def __init__(self, w=(64, 128, 1024), pool=False):
        super().__init__()
        self.pool, b = pool, w[2] + 3
        self.enc = PoseEncoder(w)
        c = (b, b, b // 2, b // 4)
        self.convs = nn.ModuleList([nn.Conv1d(c[i], c[i + 1], 1) for i in range(3)])
        self.blocks = nn.ModuleList([SpadainBlock(v, norm=not (pool and i == 0)) for i, v in enumerate(c[1:])])
        self.out = nn.Conv1d(c[3], 3, 1)

    def forward(self, pose, mesh):
        z = self.enc(pose)
        if self.pool:
            z = z.max(2, keepdim=True)[0].expand(-1, -1, mesh.shape[2])
        x = torch.cat((z, mesh), 1)
        for conv, blk in zip(self.convs, self.blocks):
            x = blk(conv(x), mesh)
        return (2 * torch.tanh(self.out(x))).transpose(1, 2)


class CrossAttention(nn.Module):
    """query from the target mesh code, key and value from the pose code, residual on the pose code.
    With other numbers of queries and keys the residual is given: res [N,C,queries]."""
    def __init__(self, c):
        super().__init__()
        self.q, self.k, self.v = nn.Conv1d(c, c, 1), nn.Conv1d(c, c, 1), nn.Conv1d(c, c, 1)
        self.gamma = nn.Parameter(torch.zeros(1))

    def forward(self, z_id, z, res=None):
        a = torch.softmax(self.q(z_id).transpose(1, 2) @ self.k(z), -1)     # rows: target points
        return self.gamma * (self.v(z) @ a.transpose(1, 2)) + (z if res is None else res)


class LART(nn.Module):
    """driving [N,T,3,V1], target mesh [N,3,V2] -> [N,T,V2,3] (reconstruction, docs/systems/lart.md)."""
    def __init__(self, w=(64, 128, 1024), frames=3):
        super().__init__()
        c0 = w[2]
        self.enc = PoseEncoder(w)
        self.time = nn.Parameter(torch.zeros(frames, c0))
        c = (c0, c0, c0 // 2, c0 // 2, c0 // 4)
        self.convs = nn.ModuleList([nn.Conv1d(c[i], c[i + 1], 1) for i in range(4)])
        self.att = nn.ModuleList([CrossAttention(v) for v in c[1:]])
        self.blocks = nn.ModuleList([SpadainBlock(v, norm=i > 0) for i, v in enumerate(c[1:])])
        self.out = nn.Conv1d(c[4], 3, 1)

    def code(self, pose):
        n, T, _, v = pose.shape
        return self.enc(pose.reshape(n * T, 3, v)).max(2)[0].reshape(n, T, -1) + self.time[:T]

    def decode(self, z, mesh):
        """z [N,C] one frame code"""
        zi, x = self.enc(mesh), z[:, :, None].expand(-1, -1, mesh.shape[2])
        for conv, att, blk in zip(self.convs, self.att, self.blocks):
            zi, x = conv(zi), conv(x)
            x = blk(att(zi, x), mesh)
        return (2 * torch.tanh(self.out(x))).transpose(1, 2)

    def forward(self, pose, mesh):
        z = self.code(pose)
        return torch.stack([self.decode(z[:, t], mesh) for t in range(z.shape[1])], 1)


def edge_loss(pred, faces, ref):
    """NPT: mean over faces of the three |length / reference length - 1| added. pred, ref [V,3]."""
    total = 0
    for a, b in ((0, 1), (1, 2), (0, 2)):
        e = lambda x: (x[faces[:, a]] - x[faces[:, b]]).pow(2).sum(-1).sqrt()
        total = total + (e(pred) / e(ref) - 1).abs()
    return total.mean()


def edge_loss_batch(pred, faces, ref):
    """pred, ref [N,V,3]: mean over the items."""
    return sum(edge_loss(p, faces, r) for p, r in zip(pred, ref)) / len(pred)


def metric_term(out, m1, mT, alpha):
    """LART equation 3 with D the matrix of pairwise distances, averaged over its entries (a zero distance has gradient 0).
    out: decoded mesh; m1, mT: ground-truth target meshes of the end frames; all [N,V,3]."""
    d = lambda x: torch.cdist(x, x, compute_mode="donot_use_mm_for_euclid_dist")
    return (d(out) - ((1 - alpha) * d(m1) + alpha * d(mT))).pow(2).mean()


def metric_loss(model, mesh, z1, zT, m1, mT, alpha):
    return metric_term(model.decode((1 - alpha) * z1 + alpha * zT, mesh), m1, mT, alpha)
