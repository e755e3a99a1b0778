"""Checks of the reference itself: identities, round trips, numerical gradients, PyTorch's own layers where it has them.

    python3 tests/oracle/selftest.py        # Debian's python3-torch, python3-scipy; some seconds
"""
import numpy as np
import torch
from reference import corenet_h4d_tst as B2
from reference import geometry as geo
from reference import metrics as MT
from reference import models as M
from reference import npt_lart as B

torch.manual_seed(1)
d = torch.float64
w = torch.randn(200, 3, dtype=d)
w = w / w.norm(dim=-1, keepdim=True) * torch.rand(200, 1, dtype=d) * 3.1
R = geo.axis_angle_to_matrix(w)
eye = torch.eye(3, dtype=d)
assert (R @ R.transpose(-1, -2) - eye).abs().max() < 1e-12 and (torch.det(R) - 1).abs().max() < 1e-12
assert (geo.matrix_to_axis_angle(R) - w).abs().max() < 1e-9
assert (geo.rot6d_to_matrix(geo.matrix_to_rot6d(R)) - R).abs().max() < 1e-12
assert (geo.quat_to_matrix(geo.matrix_to_quat(R)) - R).abs().max() < 1e-12
x90 = geo.axis_angle_to_matrix(torch.tensor([np.pi / 2, 0, 0], dtype=d))
assert (x90 @ torch.tensor([0.0, 1, 0], dtype=d) - torch.tensor([0.0, 0, 1], dtype=d)).abs().max() < 1e-12
for f, n in ((geo.rot6d_to_matrix, 6), (geo.quat_to_matrix, 4), (geo.axis_angle_to_matrix, 3)):
    assert torch.autograd.gradcheck(f, torch.randn(4, n, dtype=d, requires_grad=True))

tp = torch.randn(22, 3, dtype=d)
I = eye.expand(22, 3, 3)
G, P = geo.fk(I, tp)
assert (P - tp).abs().max() < 1e-12                                  # rest pose gives rest joints
W = torch.softmax(torch.randn(9, 22, dtype=d), -1)
x = torch.randn(9, 3, dtype=d)
assert (geo.lbs(x, W, G, P, tp) - x).abs().max() < 1e-12             # and leaves points alone
Rl = R[:22].clone()
P1 = geo.fk(Rl, tp)[1]
Rl[geo.LEAVES] = R[50:55]
assert (geo.fk(Rl, tp)[1] - P1).abs().max() < 1e-12                  # leaf rotations move no joint
bl = lambda q: (q[1:] - q[torch.tensor(geo.PARENTS[1:])]).norm(dim=-1)
assert (bl(P1) - bl(tp)).abs().max() < 1e-12                         # bone lengths kept
hard = torch.eye(22, dtype=d)
G, P = geo.fk(Rl, tp)
assert (geo.lbs(tp, hard, G, P, tp) - P).abs().max() < 1e-12         # joints skinned to themselves follow

net = M.PointTransformerExtractor(64, 2, 8, 16, 8, (16, 8)).double().eval()
c = torch.randn(1, 64, 3, dtype=d)
perm = torch.randperm(64)
assert (net(c) - net(c[:, perm])).abs().max() < 1e-10                # order of points does not matter
assert M.knn(c, c, 1)[0, :, 0].equal(torch.arange(64))
f = M.fps(c, 64)
assert f.sort()[0].equal(torch.arange(64)[None])
gru = torch.nn.GRU(3, 4, 1, batch_first=True).double()
h, xs = torch.randn(1, 1, 4, dtype=d), torch.randn(1, 1, 3, dtype=d)
gi = gru.weight_ih_l0 @ xs[0, 0] + gru.bias_ih_l0
gh = gru.weight_hh_l0 @ h[0, 0] + gru.bias_hh_l0
r, z = torch.sigmoid(gi[:4] + gh[:4]), torch.sigmoid(gi[4:8] + gh[4:8])
new = torch.tanh(gi[8:] + r * gh[8:])
assert (gru(xs, h)[0][0, 0] - ((1 - z) * new + z * h[0, 0])).abs().max() < 1e-12

g = np.random.default_rng(0).normal(size=(5, 22, 3))
Q = R[0].numpy()
assert MT.pa_mean_distance(1.7 * g @ Q.T + 3, g) < 1e-12
assert MT.pa_mean_distance(g @ Q.T + 3, g, scale=False) < 1e-12
assert MT.pa_mean_distance(1.7 * g, g, scale=False) > 0.1
assert MT.pa_mean_distance(g * [1, 1, -1], g) > 0.1                  # mirror images are not aligned away
assert MT.acceleration_error(g + np.arange(5)[:, None, None] * [1, 2, 3], g) < 1e-12
assert MT.edge_length_difference_mm(g + 1, g) < 1e-9
assert abs(MT.edge_length_difference_mm(1.01 * g, g) / (10 * np.mean(
    [np.linalg.norm(a[:, None] - a[MT.neighbours(a)], axis=-1).mean() for a in g])) - 1) < 1e-9
assert abs(MT.pmd(g + 1, g) - 3) < 1e-12
# the other systems
rnd = lambda *s: torch.randn(*s, dtype=d)
sn, lib = B2.SpectralConv(5, 7).double(), torch.nn.utils.spectral_norm(torch.nn.Conv1d(5, 7, 1).double())
lib.load_state_dict({k: v for k, v in sn.state_dict().items()})
x = rnd(2, 5, 6)
for train in (True, True, False):                                    # same weights and same state as the library's, step by step
    sn.train(train), lib.train(train)
    assert (sn(x) - lib(x)).abs().max() < 1e-14 and (sn.weight_u - lib.weight_u).abs().max() < 1e-14
for _ in range(200):
    sn.train()(x)
s1 = torch.linalg.svdvals(sn.weight_orig.flatten(1))[0]
assert (sn.eval()(x) - torch.nn.functional.conv1d(x, sn.weight_orig / s1, sn.bias)).abs().max() < 1e-6
C = torch.rand(1, 6, 8, dtype=d) * 0.3 + 0.7
T, R = B2.sinkhorn(C)
assert (T.sum(2) - 1 / 6).abs().max() < 1e-6 and (R.sum(2) - 1).abs().max() < 1e-12
assert (B2.sinkhorn(C, steps=500)[0].sum(1) - 1 / 8).abs().max() < 1e-6
assert (B2.sinkhorn(C - 1.5)[1] - torch.softmax(C / 0.03, 2)).abs().max() < 1e-6       # tiny K: eps wins, the plan is a row softmax
assert torch.autograd.gradcheck(lambda c: B2.sinkhorn(c), C.clone().requires_grad_(True))
ela = B2.ElaIN(3, 4).double()
assert torch.autograd.gradcheck(ela, (rnd(1, 3, 5).requires_grad_(True), rnd(1, 4, 5).requires_grad_(True)))
y = rnd(2, 3, 50) * 5 + 2
a = torch.nn.functional.instance_norm(y)
assert (a.mean(2)).abs().max() < 1e-12 and (a.var(2, unbiased=False) - 1).abs().max() < 1e-5
pose, mesh, perm = rnd(1, 3, 20), rnd(1, 3, 20), torch.randperm(20)
npt, pool = B.NPT((4, 6, 13)).double(), B.NPT((4, 6, 13), pool=True).double()
assert (pool(pose[:, :, perm], mesh) - pool(pose, mesh)).abs().max() < 1e-12           # pooled: the pose's order does not matter
assert (npt(pose[:, :, perm], mesh) - npt(pose, mesh)).abs().max() > 1e-6              # plain: it does
for m in (npt, pool):
    assert (m(pose[:, :, perm], mesh[:, :, perm]) - m(pose, mesh)[:, perm]).abs().max() < 1e-12
core = B2.CoreNet((3, 5, 6), (8, 6, 4), 2).double().train()
core(pose, mesh)
core.eval()
y0, w0, _ = core(pose, mesh)
y1, w1, _ = core(pose[:, :, perm], mesh)
y2, w2, _ = core(pose, mesh[:, :, perm])
assert (w1 - w0).abs().max() < 1e-12 and (y1 - y0).abs().max() < 1e-12
assert (w2 - w0[:, perm]).abs().max() < 1e-12                                          # the warp follows the identity's order,
assert (y2 - y0[:, perm]).abs().max() > 1e-6                                           # the generator's kernel of 3 does not
att = B.CrossAttention(8).double()
att.gamma.data.fill_(0.7)
u, z, res = rnd(1, 8, 37) * 4, rnd(1, 8, 300) * 4, rnd(1, 8, 37)
q, k, v = att.q(u)[0].t(), att.k(z)[0].t(), att.v(z)[0].t()
mx, den, acc = torch.full((37, 1), -np.inf, dtype=d), torch.zeros(37, 1, dtype=d), torch.zeros(37, 8, dtype=d)
for i in range(0, 300, 64):                                          # blocks of keys with a running maximum give the same
    s = q @ k[i:i + 64].t()
    m2 = torch.maximum(mx, s.max(1, keepdim=True)[0])
    e, old = torch.exp(s - m2), torch.exp(mx - m2)
    mx, den, acc = m2, den * old + e.sum(1, keepdim=True), acc * old + e @ v[i:i + 64]
assert (att(u, z, res)[0] - (0.7 * (acc / den).t() + res[0])).abs().max() < 1e-10
net = B2.H4DStage1(3, 15, 7, 6, 5, 4).double()
with torch.no_grad():
    for prm in net.parameters():
        prm.add_(0.2 * torch.randn_like(prm))
seq = rnd(2, 4, 12, 3)
for a, b in zip(net.codes(seq), net.codes(seq[:, :, torch.randperm(12)])):
    assert (a - b).abs().max() < 1e-12                               # sets of points
tmpl, basis, reg, wts = rnd(9, 3), rnd(9, 3, 3), torch.softmax(rnd(5, 9), 1), torch.softmax(rnd(9, 5), 1)
still = B2.linear_body(torch.zeros(1, 3, dtype=d), torch.zeros(1, 2, 15, dtype=d), tmpl, basis, reg, wts, [-1, 0, 1, 0, 3])
assert (still - tmpl).abs().max() < 1e-12                            # zero codes give the template
pc = rnd(2, 9), rnd(9), rnd(5, 36), rnd(36)
P = B2.h4d_poses(rnd(1, 15), torch.zeros(1, 7, dtype=d), *pc)
assert (P[0, 1:, :3] - P[0, :1, :3] - pc[1].reshape(3, 3)).abs().max() < 1e-12 and P.shape == (1, 4, 15)
lstm = torch.nn.LSTM(3, 4).double()
xs, h, c = rnd(1, 1, 3), rnd(1, 1, 4), rnd(1, 1, 4)
i, f, gg, o = (lstm.weight_ih_l0 @ xs[0, 0] + lstm.bias_ih_l0 + lstm.weight_hh_l0 @ h[0, 0] + lstm.bias_hh_l0).chunk(4)
cn = torch.sigmoid(f) * c[0, 0] + torch.sigmoid(i) * torch.tanh(gg)
assert (lstm(xs, (h, c))[0][0, 0] - torch.sigmoid(o) * torch.tanh(cn)).abs().max() < 1e-12
tst = B2.TST(10, (4, 6, 9), 7, 5).double()
ps, ms = rnd(5, 3, 10), rnd(5, 3, 10)
assert (tst(ps, ms)[:3] - tst(ps[:3], ms[:3])).abs().max() < 1e-12   # causal: later frames change nothing before them
assert (tst(ps, ms)[3:] - tst(ps[3:], ms[3:])).abs().max() > 1e-9
print("the reference agrees with itself")
