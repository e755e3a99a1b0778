"""The open benchmark's sequences as arrays, and answers to them as files, which `restage benchmark score` measures.

for sequence in restage.benchmark.sequences("benchmark", "naked"):
    sequence.write("answers", vertices=my_network(sequence.clouds, sequence.target.vertices))

docs/benchmark.md has the protocol.
"""
import functools as _functools
import os as _os
import pathlib as _pathlib

import numpy as _np

from . import _core
from ._files import load_clouds, load_mesh

__all__ = ["Sequence", "sequences"]


class Sequence:
    """One sequence: what a method is told, and where its answer goes.

    name, set: as in the tables. folder: a pathlib.Path with source.h5, target.ply and rest.h5.
    """

    def __init__(self, folder, set):  # noqa: A002
        self.folder, self.set, self.name = _pathlib.Path(folder), set, _pathlib.Path(folder).name

    @_functools.cached_property
    def clouds(self):
        """The source's clouds, a list of float32 [n, 3], metres, y up, 30 frames a second (scans: as they were stored)."""
        return load_clouds(self.folder / "source.h5")

    @_functools.cached_property
    def target(self):
        """The target in T-pose, a Mesh: vertices float32 [V, 3], metres, y up, facing +z."""
        return load_mesh(self.folder / "target.ply")

    def write(self, answers, vertices=None, joints=None, rotations=None):
        """Writes the answer to ANSWERS/SET/NAME.h5, and returns that path.

        vertices: [F, V, 3], those of the target in its order; joints: [F, 22, 3]; both in the world, metres, one frame for
        each cloud. rotations: [F, 22, 4], w x y z, world turns from the T-pose. At least one of the first two. Needs h5py.
        InputError: other shapes, numbers that are not finite.
        """
        try:
            import h5py
        except ImportError as error:
            raise _core.InputError("restage: an answer is an HDF5 file, and h5py cannot be imported; install it (python3-h5py), "
                                   "or write a folder of PLY files for each sequence") from error
        frames = len(self.clouds)
        wanted = {"vertices": (vertices, (frames, len(self.target.vertices), 3)), "joints": (joints, (frames, 22, 3)),
                  "rotations": (rotations, (frames, 22, 4))}
        if vertices is None and joints is None:
            raise _core.InputError(f"restage: {self.set}/{self.name}: no answer; give vertices, joints or both")
        arrays = {key: _checked(f"{self.set}/{self.name}: {key}", value, shape) for key, (value, shape) in wanted.items()
                  if value is not None}
        path = _pathlib.Path(answers) / self.set / (self.name + ".h5")
        path.parent.mkdir(parents=True, exist_ok=True)
        unfinished = path.with_name(f".{path.name}.{_os.getpid()}")
        try:
            with h5py.File(unfinished, "w") as file:
                for key, value in arrays.items():
                    file[key] = value
            unfinished.replace(path)
        finally:
            unfinished.unlink(missing_ok=True)
        return path

    def __repr__(self):
        return f"Sequence({self.set}/{self.name})"


def _checked(name, value, shape):
    value = _np.asarray(_core.array_or_same(value, name), _np.float32)
    if value.shape != shape:
        raise _core.InputError(f"restage: {name} has the shape {list(value.shape)}; give {list(shape)}")
    if not _np.isfinite(value).all():
        raise _core.InputError(f"restage: {name} has numbers that are not finite; mend them, or give no answer")
    return value


def sequences(folder, set):  # noqa: A002
    """The sequences of a set, in the order of its tables: a list of Sequence.

    folder: the benchmark; of the sets test and seen what `restage benchmark sequences` wrote. InputError: no such set.
    """
    place = _pathlib.Path(_os.fsdecode(folder)) / set
    found = sorted(path for path in place.iterdir() if (path / "source.h5").exists()) if place.is_dir() else []
    if not found:
        raise _core.InputError(f"restage: {place} holds no sequences; give a benchmark and naked, clothed or scans, or what "
                               "'restage benchmark sequences' wrote for test and seen")
    return [Sequence(path, set) for path in found]
