"""Batches to train networks of your own on: what the stages of `restage train` see.

for batch in restage.data.clouds("corpus.h5", batch=16, noise=0.01, steps=1000): batch is a dict of NumPy arrays, float32
and in metres unless a line below says otherwise. n is the number of examples of a batch.

source: a data set file (`restage data build`, `restage data import`), "builtin", the folder of a benchmark, or a
restage.Config, whose data, seed and sections then hold. batch: examples of a step. seed: of everything that is drawn.
split: "train", "validation" or "test". start: the number of the first batch. steps: how many batches; None: without an
end. ahead: so many batches are drawn beforehand by a thread that does not hold the GIL; 0: none. data: more keys of the
section `data`, such as {"subject": "anna"}. **options: the keys of the section that the function names, with the
defaults of a training (docs/config_reference.md). Wrong ones are an InputError.

Batch number k is a function of the data, the options, the seed and k: it is what the stage of such a configuration sees
in step k.
"""
import atexit as _atexit
import os as _os
import weakref as _weakref

from . import _core
from ._run import Config as _Config
from ._run import _path, _words

__all__ = ["Batches", "clouds", "examples", "pairs", "transfers", "windows"]

Batches = _core.Batches
_open = _weakref.WeakSet()


@_atexit.register
def _close():
    """No thread may draw while the program ends."""
    for batches in list(_open):
        batches.close()


def _batches(kind, source, words, **wishes):
    config = ""
    if isinstance(source, _Config):
        config, *given = source.words()
        words = given + words
    elif isinstance(source, (str, bytes, _os.PathLike)):
        words = _words([{"data.source": _os.fsdecode(_path(source))}]) + words
    else:
        raise _core.InputError(f"restage: {source!r} is no source of data; give a data set file, 'builtin', a folder or a Config")
    batches = _core.Batches(kind, config, words, **wishes)
    _open.add(batches)
    return batches


def _sampler(kind, stage, section, source, batch, seed, split, start, steps, ahead, data, options, **wishes):
    keys = {f"data.{key}": value for key, value in (data or {}).items()}
    if batch is not None:
        keys[f"{stage}.optimiser.batch"] = batch
    if seed is not None:
        keys["seed"] = seed
    keys.update((f"{stage}.{section}.{key}", value) for key, value in options.items())
    return _batches(kind, source, _words([keys]), split=split, start=start, steps=steps, ahead=ahead, **wishes)


def clouds(source, *, batch=None, seed=None, split="train", start=0, steps=None, ahead=2, data=None, points=None, rotations=None,
           skin_weights=None, **options):
    """Point clouds of posed bodies, and their joints: what the stage `skeleton` learns from.

    Keys: points [n, v, 3] and joints [n, 22, 3], relative to the mean of the points; centres [n, 3], that mean in the
    world; turns [n, 22, 6], the turn of each joint from the T-pose, columns 0 and 1 of its matrix (rotations=False: none);
    weights [n, v, 22], the skin weights of each point (skin_weights=True); with remembered=..., past [n, 22, 4], joints of
    the frame before as an extractor may have answered them, and the trust in them, 0 to 1; asked, int64: the rows whose
    past the stage replaces by what its own network answers.

    points: of a cloud (1024; of a Config: as its network asks). **options: the keys of skeleton.clouds, such as noise,
    dressed, one_camera, camera_ring.
    """
    if points is None and not isinstance(source, _Config):
        points = 1024
    return _sampler("clouds", "skeleton", "clouds", source, batch, seed, split, start, steps, ahead, data, options, points=points,
                    rotations=rotations, skin_weights=skin_weights)


def windows(source, *, batch=None, seed=None, split="train", start=0, steps=None, ahead=2, data=None, truth=None, **options):
    """Windows of A's motion, and B's skeleton: what the stage `motion` learns from (with motion.self_first_pass: false).

    Keys, t frames of 1/30 s: joints_a, input_a [n, t, 22, 3], A's joints as they are and as they are seen, relative to
    the pelvis; trans_a, input_trans_a [n, t, 3], its path as the key translation says (velocity: metres a second);
    rest_a, rest_b [n, 22, 3]; sixd_a [n, t, 132], local rotations, columns 0 and 1 of each matrix; standing [n, t, 2],
    1 where the left, right foot stands; self_mask [n], 1 where B is A; real_b [n, t, 22, 3] and real_trans_b [n, t, 3],
    a motion of B's; reframed [n, t, 3, 3] with remove_heading. truth=True adds B in A's motion: truth_b, truth_trans_b,
    truth_sixd_b, and the pelvises in the world, root_a and truth_root_b [n, t, 3].

    **options: the keys of motion.windows, such as frames, self_share, noise, translation.
    """
    return _sampler("windows", "motion", "windows", source, batch, seed, split, start, steps, ahead, data, options, truth=truth)


def pairs(source, *, batch=None, seed=None, split="train", start=0, steps=None, ahead=2, data=None, skin_weights=None, **options):
    """The same points of a body at rest and posed: what the stage `deformation` learns from.

    Keys: rest_points, posed_points, seen_points [n, v, 3] and rest_joints, seen_joints [n, 22, 3], relative to the pelvis;
    local [n, 22, 3, 3], local rotations, and axis_angle [n, 66], the same, radians; weights [n, v, 22] (skin_weights=True).

    **options: the keys of deformation.pairs, such as points, dressed, joint_noise.
    """
    return _sampler("pairs", "deformation", "pairs", source, batch, seed, split, start, steps, ahead, data, options,
                    skin_weights=skin_weights)


def transfers(source, *, batch=None, seed=None, split="train", start=0, steps=None, ahead=2, data=None, frames=None, **options):
    """A posed source, a target's mesh, and that mesh in the pose: what the stage `transfer` learns from.

    Keys, t frames: pose [n, t, p, 3]; identity [n, v, 3]; truth [n, t, v, 3]; faces, int32 [n, f, 3], of the target.
    The middle of the bounding box of each is the origin.

    frames: of a window (1; of a Config: as its network asks, and so are the points, where it needs all vertices). **options:
    the keys of transfer.pairs, such as points, vertices, identity, shuffle.
    """
    if frames is None and not isinstance(source, _Config):
        frames = 1
    return _sampler("transfers", "transfer", "pairs", source, batch, seed, split, start, steps, ahead, data, options, frames=frames)


def examples(config, stage, *overrides, split="train", start=0, steps=None, ahead=2):
    """What any stage of a configuration sees, step by step, to the last bit: Stage::examples() of the C++ code.

    config: a Config, a YAML file or the name of one. stage: "skeleton", "motion", ... The stage is made as a training makes
    it, with its network, so the functions above begin sooner. Keys: those of the functions above; the stage motion has
    its windows under "cycle." and "self.", as one pass or the other takes them.
    """
    source = config if isinstance(config, _Config) else _Config(config)
    return _batches("examples", source, _words(overrides), stage=_path(stage), split=split, start=start, steps=steps, ahead=ahead)
