"""restage.data: batches as the stages of a training see them."""
import copy
import os
import signal
import sys
import threading
import time

import numpy as np
import pytest
import restage
from restage import data

from conftest import LITE, python

@pytest.fixture(scope="module")
def corpus(program):
    program.done("data", "build", "--bodies", 2, 2, 1, "--motions", 3, 1, 1, "--quiet", "--out", "corpus.h5")
    return str(program.folder / "corpus.h5")


def config_of(tmp_path, stage, keys):
    """A configuration that says nothing but these keys."""
    (tmp_path / "c.yaml").write_text("stages: [%s]\n" % stage)
    return restage.Config(tmp_path / "c.yaml", keys)


def equal(a, b, prefix=""):
    a, b = dict(a), {key[len(prefix):]: value for key, value in b.items() if key.startswith(prefix)}
    a.pop("asked", None)  # no stage shows it
    assert list(a) == list(b)
    assert all(a[key].dtype == b[key].dtype and np.array_equal(a[key], b[key]) for key in a), [k for k in a if not np.array_equal(a[k], b[k])]


def differ(a, b):
    return any(a[key].shape != b[key].shape or not np.array_equal(a[key], b[key]) for key in a if key != "asked")


# name of the function: the stage, its section, its options, more keys of the configuration, the prefix of the examples
KINDS = {
    "clouds": ("skeleton", "clouds", {"noise": 0.01, "camera_ring": 0.5, "dressed": 0.5, "remembered": 0.6, "tpose_share": 0.2},
               {"skeleton.model": "skeleton/pointnet"}, ""),
    "windows": ("motion", "windows", {"frames": 12, "noise": 0.01, "self_share": 0.5, "translation": "relative"},
                {"motion.self_first_pass": False}, "cycle."),
    "pairs": ("deformation", "pairs", {"points": 200, "dressed": 0.5, "joint_noise": 0.01}, {}, ""),
    "transfers": ("transfer", "pairs", {"points": 100, "identity": "posed", "vertices": 300},
                  {"transfer.model": "transfer/npt_pool"}, ""),
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_batch_is_what_the_stage_sees(kind, corpus, tmp_path):
    stage, section, options, more, prefix = KINDS[kind]
    keys = {"data.source": corpus, "seed": 7, f"{stage}.optimiser.batch": 4, **more}
    keys.update((f"{stage}.{section}.{key}", value) for key, value in options.items())
    config = config_of(tmp_path, stage, keys)
    seen = data.examples(config, stage)
    mine = getattr(data, kind)(corpus, batch=4, seed=7, **options)
    theirs = getattr(data, kind)(config)
    for step in range(3):
        batch, example = next(mine), next(seen)
        assert len(batch) > 2 and all(len(value) == 4 for key, value in batch.items() if key != "asked")
        equal(batch, example, prefix)
        equal(next(theirs), example, prefix)
        if kind == "windows":
            assert batch["joints_a"].shape == (4, 12, 22, 3)
    other = getattr(data, kind)(corpus, batch=4, seed=8, **options)
    assert differ(next(other), mine.at(0))


def test_a_step_of_the_motion_has_two_kinds_of_windows(corpus, tmp_path):
    keys = {"data.source": corpus, "motion.optimiser.batch": 10, "motion.windows.self_share": 0.7, "motion.windows.frames": 8}
    batch = next(data.examples(config_of(tmp_path, "motion", keys), "motion"))
    assert batch["cycle.joints_a"].shape == (3, 8, 22, 3) and batch["self.joints_a"].shape == (7, 8, 22, 3)
    assert batch["self.self_mask"].all()
    keys["motion.answers.sequences"] = 2
    config = config_of(tmp_path, "skeleton, motion", keys)
    with pytest.raises(restage.InputError, match="skeleton.from"):
        data.examples(config, "motion")
    with pytest.raises(restage.InputError, match="examples"):
        data.windows(config)
    seen = {"motion.answers.views": 1, "motion.answers.frames": 12, "motion.validation_frames": 12, "motion.validation_windows": 1}
    batch = next(data.examples(config.replaced(seen, {"skeleton.from": LITE}), "motion"))
    far = np.linalg.norm(batch["self.input_a"] - batch["self.joints_a"], axis=-1)
    assert 0.002 < far.mean() < 0.3, "A is seen as an extractor answers"


def test_examples_of_any_stage(tmp_path):
    keys = {"data.one_mesh": True, "data.bodies.train": 2, "data.bodies.validation": 1, "data.motions.train": 2, "data.motions.validation": 1,
            "codes.optimiser.batch": 2, "codes.windows.points": 100, "codes.sizes.frames": 8, "codes.basis_windows": 20}
    batch = next(data.examples(config_of(tmp_path, "codes", keys), "codes"))
    assert batch["clouds"].shape == (2, 8, 100, 3) and batch["body"].dtype == np.int32


def test_what_a_batch_holds(corpus):
    batch = next(data.clouds(corpus, batch=3, points=100, skin_weights=True))
    assert {k: v.shape for k, v in batch.items()} == {"points": (3, 100, 3), "joints": (3, 22, 3), "weights": (3, 100, 22), "turns": (3, 22, 6),
                                                       "centres": (3, 3)}
    assert all(v.dtype == np.float32 and v.flags.writeable and v.flags.c_contiguous for v in batch.values())
    assert np.allclose(batch["points"].mean(1), 0, atol=1e-4) and np.allclose(batch["weights"].sum(2), 1, atol=1e-4)
    assert "turns" not in next(data.clouds(corpus, batch=1, points=64, rotations=False))
    batch = next(data.clouds(corpus, batch=32, points=64, remembered=1))
    assert batch["asked"].dtype == np.int64 and 0 < len(batch["asked"]) < 32
    assert batch["past"].shape == (32, 22, 4) and batch["past"].any((1, 2)).all()
    batch = next(data.windows(corpus, batch=2, frames=8, truth=True, self_share=0))
    assert batch["truth_b"].shape == (2, 8, 22, 3) and not batch["self_mask"].any()
    batch = next(data.transfers(corpus, batch=2, frames=3, points=50, vertices=200))
    assert batch["pose"].shape == (2, 3, 50, 3) and batch["faces"].dtype == np.int32
    assert next(data.pairs(corpus, batch=2, points=30, skin_weights=True))["weights"].shape == (2, 30, 22)


def test_order_and_number(corpus):
    def some(**options):
        return data.clouds(corpus, batch=2, points=64, **options)

    plain = list(some(steps=5))
    assert len(plain) == 5
    for ahead in (0, 1, 4):
        batches = some(steps=5, ahead=ahead)
        for k, batch in enumerate(batches):
            equal(batch, plain[k])
        assert batches.step == 5
        with pytest.raises(StopIteration):
            next(batches)
    batches = some(start=3)
    assert batches.step == 3
    equal(next(batches), plain[3])
    equal(batches.at(1), plain[1])
    equal(next(batches), plain[4])
    assert list(some(steps=0)) == [] and differ(plain[0], plain[1])
    batches.close()
    assert list(batches) == []
    again = list(data.clouds(restage.Config("lite/all", {"data.source": corpus, "skeleton.optimiser.batch": 2, "loop.overfit_batches": 2}), steps=4,
                             points=64))
    equal(again[0], again[2])
    equal(again[1], again[3])
    assert differ(again[0], again[1])


def test_splits(corpus):
    batches = {split: next(data.clouds(corpus, batch=2, points=64, split=split)) for split in ("train", "validation", "test")}
    assert differ(batches["train"], batches["validation"]) and differ(batches["train"], batches["test"])
    with pytest.raises(restage.InputError, match="nowhere"):
        data.clouds(corpus, split="nowhere")


def test_the_thread_needs_no_gil(corpus):
    batches = data.clouds(corpus, batch=2, points=64, ahead=3)
    next(batches)
    before = sys.getswitchinterval()
    sys.setswitchinterval(1000)  # nobody else gets the GIL now
    try:
        end = time.monotonic() + 60
        while batches.ready < 3 and time.monotonic() < end:
            pass
        assert batches.ready == 3
    finally:
        sys.setswitchinterval(before)


def test_several_threads_take_from_one(corpus):
    batches, taken = data.clouds(corpus, batch=1, points=64, steps=24), []
    takers = [threading.Thread(target=lambda: taken.extend(batches)) for _ in range(4)]
    for thread in takers:
        thread.start()
    for thread in takers:
        thread.join()
    assert len(taken) == 24 and len({batch["points"].tobytes() for batch in taken}) == 24


def test_ctrl_c_while_a_batch_is_drawn(corpus):
    batches = data.clouds(corpus, batch=1500, points=512, ahead=1, steps=1)
    timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        next(batches)
        time.sleep(60)  # where a fast machine has drawn it before
    timer.join()
    assert batches.step == 1 or len(next(batches)["points"]) == 1500


def test_a_program_that_stops_in_the_middle(corpus):
    script = "import restage.data\nb = restage.data.clouds(%r, batch=8, ahead=8)\nnext(b)\n" % corpus
    done = python("-c", script, text=True, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")


def test_after_a_fork(corpus):
    batches = data.clouds(corpus, batch=1, points=64)
    next(batches)
    child = os.fork()
    if child == 0:
        try:
            next(batches)
        except restage.InputError:
            os._exit(3)
        os._exit(4)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 3
    next(batches)


def test_wrong_wishes_are_refused(corpus, tmp_path):
    for bad, why in (({"nois": 1}, "noise"), ({"noise": -1}, "noise"), ({"batch": 0}, "batch"), ({"start": -1}, "start"), ({"steps": -1}, "steps"),
                     ({"ahead": -1}, "ahead"), ({"points": 0}, "points"), ({"points": 10 ** 9}, "points"), ({"seed": "x"}, "seed"),
                     ({"data": {"nothing": 1}}, "nothing"), ({"split": "all"}, "split"), ({"noise": object()}, "configuration")):
        with pytest.raises(restage.InputError, match=why):
            data.clouds(corpus, **bad)
    for source in (str(tmp_path / "none.h5"), 3, None, np.ones(3)):
        with pytest.raises(restage.InputError):
            data.clouds(source)
    with pytest.raises(restage.InputError, match="frames"):
        data.windows(corpus, frames=10 ** 6)
    with pytest.raises(restage.InputError, match="codez"):
        data.examples(restage.Config("demo"), "codez")
    with pytest.raises(restage.InputError, match="clouds"):
        data.examples(restage.Config("demo"), "clouds")
    with pytest.raises(TypeError):
        data.clouds(corpus, points="many")
    with pytest.raises(TypeError, match="start="):
        copy.copy(data.clouds(corpus, batch=1))
