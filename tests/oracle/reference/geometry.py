"""Rotations, forward kinematics and linear blend skinning (docs/method.md).

Every function works on torch tensors of any float dtype, with free leading axes.
Matrices act on column vectors: y = R x.
"""
import torch

JOINT_NAMES = [
    "pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2",
    "left_ankle", "right_ankle", "spine3", "left_foot", "right_foot", "neck", "left_collar",
    "right_collar", "head", "left_shoulder", "right_shoulder", "left_elbow", "right_elbow",
    "left_wrist", "right_wrist"]
PARENTS = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19]
LEAVES = [10, 11, 15, 20, 21]
EPS_6D = 1e-8


def unit(v, eps=EPS_6D):
    """v / max(|v|, eps)"""
    return v / v.norm(dim=-1, keepdim=True).clamp_min(eps)


def rot6d_to_matrix(v):
    """v = (a1, a2), the first two COLUMNS before orthonormalisation -> [b1 b2 b3] as columns."""
    a1, a2 = v[..., :3], v[..., 3:]
    b1 = unit(a1)
    b2 = unit(a2 - (b1 * a2).sum(-1, keepdim=True) * b1)
    b3 = torch.cross(b1, b2, dim=-1)
    return torch.stack((b1, b2, b3), dim=-1)


def matrix_to_rot6d(R):
    return torch.cat((R[..., :, 0], R[..., :, 1]), dim=-1)


def quat_to_matrix(q):
    """q = (w, x, y, z), normalised here."""
    w, x, y, z = unit(q).unbind(-1)
    rows = (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y))
    return torch.stack(rows, dim=-1).reshape(*w.shape, 3, 3)


def matrix_to_quat(R):
    """The largest of the four squared components picks the branch; result has w >= 0."""
    m = lambda i, j: R[..., i, j]
    t = torch.stack((1 + m(0, 0) + m(1, 1) + m(2, 2), 1 + m(0, 0) - m(1, 1) - m(2, 2),
                     1 - m(0, 0) + m(1, 1) - m(2, 2), 1 - m(0, 0) - m(1, 1) + m(2, 2)), -1)
    a, b, c = m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1)
    d, e, f = m(1, 0) + m(0, 1), m(0, 2) + m(2, 0), m(2, 1) + m(1, 2)
    cand = torch.stack((torch.stack((t[..., 0], a, b, c), -1), torch.stack((a, t[..., 1], d, e), -1),
                        torch.stack((b, d, t[..., 2], f), -1), torch.stack((c, e, f, t[..., 3]), -1)), -2)
    pick = t.argmax(-1)[..., None, None].expand(*t.shape[:-1], 1, 4)
    q = unit(torch.gather(cand, -2, pick).squeeze(-2))
    return torch.where(q[..., :1] < 0, -q, q)


def axis_angle_to_matrix(w):
    """Rodrigues; Taylor coefficients below 1e-4 rad keep it smooth at zero."""
    t2 = (w * w).sum(-1, keepdim=True)
    small = t2 < 1e-8
    t = torch.where(small, torch.ones_like(t2), t2).sqrt()
    s = torch.where(small, 1 - t2 / 6, torch.sin(t) / t)[..., None]
    c = torch.where(small, 0.5 - t2 / 24, (1 - torch.cos(t)) / (t * t))[..., None]
    x, y, z = w.unbind(-1)
    o = torch.zeros_like(x)
    K = torch.stack((o, -z, y, z, o, -x, -y, x, o), -1).reshape(*x.shape, 3, 3)
    return torch.eye(3, dtype=w.dtype, device=w.device) + s * K + c * (K @ K)


def matrix_to_axis_angle(R):
    """Angle in [0, pi], via the quaternion (well conditioned at both ends)."""
    q = matrix_to_quat(R)
    n = q[..., 1:].norm(dim=-1, keepdim=True)
    ang = 2 * torch.atan2(n, q[..., :1])
    k = torch.where(n < 1e-8, torch.full_like(n, 2.0), ang / n.clamp_min(1e-12))
    return k * q[..., 1:]


def fk(R, tpose, parents=PARENTS, root=None):
    """Forward kinematics.

    R [...,J,3,3] local rotations, tpose [...,J,3] rest joints, root [...,3] posed root
    (None: the rest root). Returns global rotations G [...,J,3,3] and joints P [...,J,3].
    G_0 = R_0, P_0 = root;  G_j = G_p R_j,  P_j = P_p + G_p (tpose_j - tpose_p).
    """
    G, P = [R[..., 0, :, :]], [tpose[..., 0, :] if root is None else root]
    for j in range(1, len(parents)):
        p = parents[j]
        off = tpose[..., j, :] - tpose[..., p, :]
        P.append(P[p] + (G[p] @ off[..., None])[..., 0])
        G.append(G[p] @ R[..., j, :, :])
    P = torch.stack([x.expand(P[-1].shape) for x in P], dim=-2)
    return torch.stack(G, dim=-3), P


def lbs(x, W, G, P, tpose):
    """x [...,V,3] rest points, W [...,V,J], G/P from fk: y = sum_j W_j (G_j (x - tpose_j) + P_j)."""
    b = P - (G @ tpose[..., None])[..., 0]
    rot = torch.einsum("...vj,...jab->...vab", W, G)
    return (rot @ x[..., None])[..., 0] + W @ b


def retarget(R, tpose, W, x, root=None, parents=PARENTS):
    """Equation 3 of the paper: x = p + o."""
    G, P = fk(R, tpose, parents, root)
    return lbs(x, W, G, P, tpose)
