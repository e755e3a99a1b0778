"""Files as arrays, and the reference that needs no network."""
import json
import os
import pathlib
from typing import NamedTuple

import numpy as np

from . import _core


class Mesh(NamedTuple):
    """A surface, or a cloud where there are no faces."""
    vertices: np.ndarray  #: float32 [V, 3], as the file has them (metres by convention)
    faces: np.ndarray  #: int32 [T, 3]


class Clip(NamedTuple):
    """A skeleton's motion, 30 frames a second, metres, y up."""
    name: str
    rest: np.ndarray  #: float64 [22, 3], the T-pose that turns are counted from
    joints: np.ndarray  #: float64 [F, 22, 3]
    rotations: np.ndarray  #: float32 [F, 22, 4], w x y z: world turns from the T-pose


class ClosedForm(NamedTuple):
    """What closed_form() gives."""
    joints: np.ndarray  #: float64 [F, 22, 3], world metres
    rotations: np.ndarray  #: float32 [F, 22, 4], w x y z: world turns from the T-pose


def load_mesh(path):
    """A PLY, OBJ, PCD or glTF file, or a table of points, as a Mesh."""
    return Mesh(*_core.load_mesh(path))


def load_cloud(path):
    """The points of such a file, float32 [n, 3]."""
    return load_mesh(path).vertices


def load_clouds(path, sequence=None, scale=1.0, up="y"):
    """The clouds of a file (HDF5, NPZ, NPY) or folder, as retarget() reads them: a list of float32 [n, 3], metres.

    A frame that cannot be read is None. scale: metres per unit, or "mm", "cm" ...; up: the axis that points up.
    """
    return _core.load_clouds(path, sequence, scale, up)


def load_motion(path, clip="", bones="", person=""):
    """The motion of a skeleton (BVH, AMC, glTF, VRM, AMASS, pose estimators, our motions) as a Clip.

    clip: which animation of a glTF file or motion of an HDF5 file; bones: a file that names its bones; person: whose
    motion, of several people's in a pose estimator's file.
    """
    return Clip(**_core.load_motion(path, clip, bones, str(person)))


def closed_form(source, target_rest, source_rest=None):
    """Retargeting without a network: the reference of every table.

    source: joints of the performer, [F, 22, 3], world metres; target_rest, source_rest: rest joints, [22, 3].
    """
    return ClosedForm(*_core.closed_form(source, target_rest, source_rest))


def _row_of(result):
    """A finished trial as a dict; None: it is not finished."""
    if result["state"] != "done":
        return None
    row = {"trial": result["id"], "case": result["case"] or "", "seed": result["seed"], "seconds": result["seconds"],
           **result["overrides"]}
    for name, scores in result["metrics"].items():
        for metric, value in scores["mean"].items():
            row["%s/%s" % (name, metric)] = np.nan if value is None else value
    return row


def sweep_results(folder):
    """The finished trials of a sweep as columns: a dict of arrays, one value a trial, which pandas.DataFrame() takes.

    "trial", "case", "seed", "seconds"; every key in which trials differ; "SET/METRIC", the mean over the set's
    sequences in metres (NaN: not measured). folder: what `restage sweep run --out` was given. InputError without
    a finished trial.
    """
    rows = []
    for path in sorted(pathlib.Path(os.fsdecode(folder)).glob("trials/*/result.json")):
        try:
            row = _row_of(json.loads(path.read_text()))
        except (ValueError, KeyError, AttributeError, TypeError):
            raise _core.InputError("restage: %s: is no result of a trial; remove it, and run the sweep again" % path) from None
        if row:
            rows.append(row)
    if not rows:
        raise _core.InputError("restage: %s: holds no finished trial of a sweep; give a folder that 'restage sweep run' "
                               "filled" % os.fsdecode(folder))
    names = list(dict.fromkeys(name for row in rows for name in row))
    return {name: np.array([row.get(name, np.nan if "/" in name else None) for row in rows]) for name in names}
