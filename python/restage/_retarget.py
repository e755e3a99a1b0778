"""Retargeting: the function, the system that takes clouds one by one, and the joints of clouds."""
import inspect
import json
import os
from dataclasses import dataclass, field

import numpy as np

from . import _core


@dataclass
class Result:
    """What retarget() gives. V vertices of the target in its own order, world metres, y up, 30 frames a second."""
    vertices: "np.ndarray | None"  #: float32 [F, V, 3]; None: the system gives no surface
    joints: "np.ndarray | None"  #: float32 [F, 22, 3]; None: the system has no skeleton
    rotations: "np.ndarray | None"  #: float32 [F, 22, 4], w x y z: world turns from the T-pose
    confidence: "np.ndarray | None"  #: float32 [F], 0 to 1; None: no network looked at clouds
    faces: np.ndarray  #: int32 [T, 3]
    filled: list  #: frames (from 0) with no cloud of the source behind them
    report: dict = field(repr=False)  #: what `restage retarget --json` prints

    def __len__(self):
        return self.report["frames"]


def retarget(source, target, weights=None, out=None, **options):
    """The target performs the source's motion.

    source: a file or folder, as the program takes it (clouds, or a skeleton's motion), or a sequence of clouds,
    each [n, 3] in metres, y up (whatever NumPy takes, and PyTorch's tensors on the CPU); None, or no points, where a frame is missing, which is filled in. target: a mesh or a
    character in T-pose. weights: a file or a run; None: the standard ones. out: a file or folder to write, as the
    program does; then the program's report comes back as a dict, else a Result of arrays. options: the program's, with _ for -: fps=60, source_up="z", scale=0.001,
    samples=8, min_confidence=0.5, foot_lock=False, force=True, seed=1, verbose=True (its log) ...
    """
    done = _core.retarget(source, target, weights, out, options)
    if out is not None:
        return json.loads(done)
    report = json.loads(done.pop("document"))
    report["out"] = None
    return Result(report=report, **done)


class System(_core.System):
    """Clouds in, frames out, as they come; memory does not grow.

    target, weights and options are those of retarget(), as far as they are of use: bones, system, rest, device,
    samples, anchor, min_confidence, foot_lock, steady_bones, fps, source_up, scale, force, seed. Each cloud is answered
    at once; online=False uses the network that looks two frames ahead, as retarget() does without online=True.
    """

    def __init__(self, target, weights=None, **options):
        super().__init__(target, weights, options)


def _show_options(of, command, own):
    """Shows the program's options with their defaults where Python shows what a function or class takes."""
    kinds = inspect.Parameter
    keywords = [kinds(name, kinds.KEYWORD_ONLY, default=default) for name, default in _core.option_defaults(command).items()
                if name not in own]
    first = [kinds(name, kinds.POSITIONAL_OR_KEYWORD, **({} if default is kinds.empty else {"default": default}))
             for name, default in own.items()]
    of.__signature__ = inspect.Signature(first + keywords)


_show_options(retarget, "retarget", {"source": inspect.Parameter.empty, "target": inspect.Parameter.empty, "weights": None, "out": None})
_show_options(System, "System", {"target": inspect.Parameter.empty, "weights": None})


class Extractor(_core.Extractor):
    __doc__ = _core.Extractor.__doc__


def skeleton(points, weights=None, samples=1, seed=0, device="cpu", joints=None, sequence=None):
    """The 22 joints of a cloud [n, 3], metres, y up: float64 [22, 3], in the cloud's own frame.

    Of a sequence of clouds, or of a file or folder of them, float64 [F, 22, 3]. Extractor keeps the network in
    memory between calls and gives the radius of each joint, too. joints="smpl" converts (docs/joints.md). sequence: which
    one of a file that holds several, from 0.
    """
    extractor = Extractor(weights, samples, seed, device)

    def extract(cloud, name="cloud"):
        found = extractor(cloud, name)[0]
        return _core.convert_joints(found, extractor.joint_definition, joints) if joints else found

    if not isinstance(points, (str, bytes, os.PathLike)):
        points = _core.array_or_same(points, "points")
    if isinstance(points, (str, bytes, os.PathLike)):
        clouds = _core.load_clouds(points, sequence, 1.0, "y")
        for k, cloud in enumerate(clouds):
            if cloud is None:
                raise _core.InputError(f"restage: {os.fsdecode(points)}: frame {k} cannot be read; mend it or leave it out")
    elif sequence is not None:
        raise _core.InputError("restage: 'sequence' chooses among those of a file, and no file is named; leave it out")
    elif np.ndim(points) == 2 if isinstance(points, np.ndarray) else _is_cloud(points):
        return extract(points)
    else:
        try:
            clouds = list(points)
        except TypeError:
            raise _core.InputError(f"restage: {type(points).__name__} is no cloud; give [n, 3] points, a list of them or a path") from None
    for k, cloud in enumerate(clouds):
        if cloud is None:
            raise _core.InputError(f"restage: clouds:{k}: is None, a frame that is missing; leave it out")
    joints = [extract(cloud, f"clouds:{k}") for k, cloud in enumerate(clouds)]
    return np.stack(joints) if joints else np.zeros((0, 22, 3))


def _is_cloud(points):
    """Whether a list holds points, not clouds."""
    try:
        return np.ndim(points[0]) == 1
    except (TypeError, IndexError, KeyError, ValueError):
        return False
