"""Evaluation metrics in numpy float64 (docs/metrics.md).

Sequences are [T, K, 3] in metres; K joints or vertices. `_mm` results are in millimetres."""
import numpy as np
from scipy.spatial import cKDTree


def mean_distance(pred, gt):
    """MPJPE on joints, MPVD on vertices."""
    return np.linalg.norm(pred - gt, axis=-1).mean()


def procrustes(src, dst, scale=True):
    """Best similarity (scale=True) or rigid map of src [K,3] onto dst: returns s, R, t, s R x + t.
    Reflections are excluded; equal weights."""
    ms, md = src.mean(0), dst.mean(0)
    X, Y = src - ms, dst - md
    U, S, Vt = np.linalg.svd(X.T @ Y)
    d = np.array([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))])
    R = (U * d @ Vt).T
    s = (S * d).sum() / (X * X).sum() if scale else 1.0
    t = md - s * R @ ms
    return s, R, t, s * src @ R.T + t


def align(pred, gt, mode="frame", scale=True):
    """mode 'frame': one map per frame; 'sequence': one map for all frames; 'root': subtract joint 0."""
    if mode == "frame":
        return np.stack([procrustes(p, g, scale)[3] for p, g in zip(pred, gt)])
    if mode == "sequence":
        return procrustes(pred.reshape(-1, 3), gt.reshape(-1, 3), scale)[3].reshape(pred.shape)
    if mode == "root":
        return pred - pred[:, :1] + gt[:, :1]
    raise ValueError(mode)


def pa_mean_distance(pred, gt, mode="frame", scale=True):
    return mean_distance(align(pred, gt, mode, scale), gt)


def acceleration_error(pred, gt):
    """Second differences without dividing by the time step: metres per frame squared."""
    a = lambda x: x[2:] - 2 * x[1:-1] + x[:-2]
    return np.linalg.norm(a(pred) - a(gt), axis=-1).mean()


def pa_acceleration_error(pred, gt, mode="frame", scale=True):
    return acceleration_error(align(pred, gt, mode, scale), gt)


def neighbours(points, k=6):
    """k nearest other points of every point, [K,k], nearest first. Ties: use generic positions."""
    d, idx = cKDTree(points).query(points, k + 1)
    n = len(points)
    out = np.empty((n, k), np.int64)
    for i in range(n):
        row = idx[i][idx[i] != i]
        out[i] = row[:k]
    return out


def edge_length_difference_mm(pred, gt, k=6, ref="frame"):
    """MEDL: mean |edge length - ground truth edge length|. ref 'frame': neighbours found anew in every
    ground-truth frame; 'first': once, in the first one; or an array [K,k] of neighbours."""
    fixed = ref if isinstance(ref, np.ndarray) else neighbours(gt[0], k) if ref == "first" else None
    tot = 0.0
    for p, g in zip(pred, gt):
        nb = neighbours(g, k) if fixed is None else fixed
        e = lambda x: np.linalg.norm(x[:, None] - x[nb], axis=-1)
        tot += np.abs(e(p) - e(g)).mean()
    return 1000 * tot / len(gt)


def pmd(pred, gt):
    """LART equation 5: mean SQUARED distance over frames and points (m^2)."""
    return ((pred - gt) ** 2).sum(-1).mean()


def pmd_npt(pred, gt):
    """NPT's script: mean of squared coordinate differences (a third of pmd) after moving the
    centre of each bounding box to the origin."""
    c = lambda x: x - (x.max(-2, keepdims=True) + x.min(-2, keepdims=True)) / 2
    return ((c(pred) - c(gt)) ** 2).mean()


def all_metrics(pj, gj, pv, gv):
    return {"MPJPE": mean_distance(pj, gj), "PA-MPJPE": pa_mean_distance(pj, gj),
            "Acc": acceleration_error(pj, gj), "PA-Acc": pa_acceleration_error(pj, gj),
            "MPVD": mean_distance(pv, gv), "PA-MPVD": pa_mean_distance(pv, gv),
            "MEDL_mm": edge_length_difference_mm(pv, gv)}
