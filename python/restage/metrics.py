"""The metrics of `restage eval`, by the names of its JSON.

Each takes a prediction and the truth, [frames, points, 3] in metres (one frame may come as [points, 3]), and
returns a float, or None where it cannot be computed (too few frames or points), never 0. mpjpe, acc and their
kin look at joints; mpvd, medl, pmd and their kin at vertices; rotation_deg and rotation_over_90 at world rotations,
[frames, 22, 4], quaternions w x y z.
"""
from . import _core

names = [name for name, *_ in _core.all_metrics()]
units = {name: unit for name, _, unit, *_ in _core.all_metrics()}
kinds = {name: kind for name, *_, kind in _core.all_metrics()}


def _metric(name, title, unit, text, what):
    def measure(pred, truth, joints=None):
        return _core.measure(name, pred, truth, joints)

    shape = "[frames, 22, 4], quaternions w x y z" if what == "rotations" else "[frames, points, 3], metres"
    measure.__name__ = measure.__qualname__ = name
    measure.__doc__ = f"""{title}: {text}, {unit}.

    pred, truth: {what}, {shape}. joints: true joints [frames, 22, 3], for leaf_pa_mpvd."""
    return measure


for _row in _core.all_metrics():
    globals()[_row[0]] = _metric(*_row)


def all(pred_joints=None, true_joints=None, pred_vertices=None, true_vertices=None,  # noqa: A001
        pred_rotations=None, true_rotations=None):
    """Every metric that can be computed, by name; the others are None."""
    given = {"joints": (pred_joints, true_joints), "vertices": (pred_vertices, true_vertices),
             "rotations": (pred_rotations, true_rotations)}
    out = {}
    for name, _, _, _, what in _core.all_metrics():
        pred, truth = given[what]
        there = pred is not None and truth is not None
        out[name] = _core.measure(name, pred, truth, true_joints if what == "vertices" else None) if there else None
    return out


__all__ = ["all", "kinds", "names", "units", *names]
