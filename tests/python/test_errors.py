"""Errors: the program's line, for files as for arrays; nothing crashes; Ctrl-C works."""
import os
import signal
import socket
import threading
import time

import numpy as np
import pytest
import restage

from conftest import LITE


def line_of(result):
    return result.stderr.strip()


def test_types():
    assert issubclass(restage.InputError, ValueError) and issubclass(restage.WorkError, RuntimeError)


def test_the_programs_line(program, walk):
    for words, call in [
        (["retarget", "--source", "no.h5", "--target", walk / "target.ply", "--out", "r.h5"],
         lambda: restage.retarget("no.h5", walk / "target.ply", out="r.h5")),
        (["retarget", "--source", walk / "target.ply", "--target", walk / "target.ply", "--out", "r.xyz"],
         lambda: restage.retarget(walk / "target.ply", walk / "target.ply", out="r.xyz")),
        (["doctor", "no.ply"], lambda: restage.doctor("no.ply")),
        (["train", "no.yaml"], lambda: restage.command("train", "no.yaml")),
        (["skeleton", "--weights", LITE, "--source", "no"], lambda: restage.command("skeleton", weights=LITE, source="no")),
    ]:
        told = program(*words)
        assert told.returncode == 2
        with pytest.raises(restage.InputError) as error:
            call()
        assert str(error.value) == line_of(told)


def test_unknown_option(walk):
    with pytest.raises(restage.InputError, match="did you mean '--samples'"):
        restage.retarget("a", walk / "target.ply", sampels=3)
    for name in ("json", "help", "threads", "a=b"):
        with pytest.raises(restage.InputError, match="unknown option"):
            restage.retarget("a", walk / "target.ply", **{name: True})
    for value in (True, False, np.bool_(False)):
        with pytest.raises(restage.InputError, match="unknown option '--foot-lok'"):
            restage.System(walk / "target.ply", foot_lok=value)
        with pytest.raises(restage.InputError, match="'samples' is (True|False), and needs a value"):
            restage.retarget("a", walk / "target.ply", samples=value)
        with pytest.raises(restage.InputError, match="did you mean '--fix'"):
            restage.command("doctor", "a", fxi=value)
    for value in (0, "no", 1):
        with pytest.raises(restage.InputError, match="'foot-lock' is .*give True or False"):
            restage.retarget("a", walk / "target.ply", foot_lock=value)
    for word in ("--help", "-h"):
        with pytest.raises(restage.InputError, match="unknown option '%s'" % word):
            restage.doctor(word)


BAD = [None, 3, "text", [], [[1, 2]], np.zeros((5, 2)), np.zeros((0, 3)), np.zeros(3), np.zeros((4, 3), complex),
       np.array([["a", "b", "c"]]), np.full((70, 3), np.nan), [[1, 2, 3], [1]], np.zeros((2, 3), object), {1: 2}]


@pytest.mark.parametrize("bad", BAD, ids=lambda b: type(b).__name__)
def test_bad_clouds(walk, bad):
    system = restage.System(walk / "target.ply", LITE, samples=1)
    good = np.asarray(restage.load_cloud(walk / "target.ply"))
    before = system.push(good).vertices.copy()
    with pytest.raises(restage.InputError):
        system.push(bad)
    with pytest.raises(restage.InputError):
        restage.skeleton([bad], LITE)
    system.restart()
    assert np.array_equal(system.push(good).vertices, before)


def test_an_extractor_names_no_option_that_it_lacks(walk):
    cloud = np.asarray(restage.load_cloud(walk / "target.ply"))
    with pytest.raises(restage.InputError, match="give metres .restage doctor --fix OUT"):
        restage.Extractor(LITE)(1000 * cloud)


def test_clouds_whose_z_points_up(walk):
    clouds = [np.asarray(c) for c in restage.load_clouds(walk / "source.h5")]
    lying = [np.stack([c[:, 0], -c[:, 2], c[:, 1]], axis=1) for c in clouds]
    system = restage.System(walk / "target.ply", LITE, samples=1)
    for cloud in lying[:7]:
        system.push(cloud)
    for _ in range(2):
        with pytest.raises(restage.InputError, match="give source_up z"):
            system.push(lying[7])
    upright = restage.System(walk / "target.ply", LITE, samples=1, source_up="z")
    forced = restage.System(walk / "target.ply", LITE, samples=1, force=True)
    assert all(s.push(c) for s in (upright, forced) for c in lying)


def test_a_second_person_who_leaves(walk):
    alone = [np.asarray(c) for c in restage.load_clouds(walk / "source.h5")][:8]
    both = [np.concatenate([c, c + np.float32([1.5, 0, 0])]) for c in alone]
    system = restage.System(walk / "target.ply", LITE, samples=1)
    assert all(system.push(c) for c in both[:7])
    for cloud in [both[7], *alone[:7]]:
        with pytest.raises(restage.InputError, match="a second person .* let one person alone be in the clouds"):
            system.push(cloud)
    assert system.push(alone[7]) and system.push(both[0])


def test_an_empty_text_is_no_name(walk, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    source, target = walk / "source.h5", walk / "target.ply"
    for call in (lambda: restage.retarget(source, target, LITE, out=""), lambda: restage.doctor(source, fix=""), lambda: restage.Extractor(""),
                 lambda: restage.retarget("", target, LITE), lambda: restage.System(target, b""), lambda: restage.System(target, LITE, rest="")):
        with pytest.raises(restage.InputError, match="empty text"):
            call()
    assert not list(tmp_path.iterdir())


def test_somebody_comes_later(walk):
    """A cloud that is unclear makes the system look again who is in the picture."""
    alone = [np.asarray(c) for c in restage.load_clouds(walk / "source.h5")]
    system = restage.System(walk / "target.ply", samples=1)
    for k in range(16):
        system.push(alone[k % len(alone)])
    refusals = []
    for k in range(16, 60):
        both = np.concatenate([alone[k % len(alone)], alone[k % len(alone)] + np.float32([1.2, 0, 0])])
        try:
            system.push(both)
        except restage.InputError as error:
            refusals.append(str(error))
            system.miss()
    assert len(refusals) > 30 and all("a second person is in the clouds" in text for text in refusals[8:]), refusals


def test_bad_sources(walk):
    for bad in (3, [], [np.zeros((5, 2))], np.zeros((3, 3)), [None], object()):
        with pytest.raises(restage.InputError):
            restage.retarget(bad, walk / "target.ply", LITE)
    for bad in (3, None, "a\0b", b"no", object()):
        with pytest.raises(restage.InputError):
            restage.retarget("a", bad, LITE)
        with pytest.raises(restage.InputError):
            restage.System(bad, LITE)
        with pytest.raises((restage.InputError, TypeError)):
            restage.load_mesh(bad)


def test_out_of_range(walk):
    for options in ({"samples": 0}, {"min_confidence": 2}, {"fps": 0}, {"every": 0}, {"scale": -1}, {"source_up": "q"},
                    {"samples": "many"}, {"device": "abacus"}, {"system": "magic"}):
        with pytest.raises(restage.InputError):
            restage.retarget([np.zeros((80, 3))], walk / "target.ply", LITE, **options)
    with pytest.raises(restage.InputError):
        restage.set_threads(-1)


def test_ctrl_c(walk):
    cloud = restage.load_cloud(walk / "target.ply")
    timer = threading.Timer(3.0, os.kill, (os.getpid(), signal.SIGINT))
    start = time.monotonic()
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        restage.retarget([cloud] * 3000, walk / "target.ply", LITE)
    assert time.monotonic() - start < 30


def test_ctrl_c_ends_a_command(walk, tmp_path):
    """One that has no steps of its own to look between."""
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        port = s.getsockname()[1]
    timer = threading.Timer(2.0, os.kill, (os.getpid(), signal.SIGINT))
    start = time.monotonic()
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        restage.command("stream", target=walk / "target.ply", weights=LITE, vmc="127.0.0.1:%d" % port, **{"in": "tcp://127.0.0.1:%d" % port})
    assert time.monotonic() - start < 30


def test_objects_that_are_not_there_yet(walk):
    class Rig(restage.System):
        def __init__(self, target):
            self.count = len(self.faces)
            super().__init__(target, LITE)

    with pytest.raises(TypeError, match="__init__ was not called"):
        Rig(walk / "target.ply")
    for kind, use in ((restage.System, lambda x: x.push(np.zeros((80, 3)))), (restage.System, lambda x: x.source_joints), (restage.Op, lambda x: x(np.zeros(3))),
                      (restage.Extractor, lambda x: x(np.zeros((80, 3)))), (restage.Var, lambda x: x.numpy()), (restage.Tensor, lambda x: x.numpy()),
                      (restage.Model, lambda x: x.count()), (restage.Tape, lambda x: x.leaf(np.zeros(3))), (restage.Parameter, lambda x: x.size),
                      (restage.Gradients, lambda x: x[restage.Parameter([1.0])]), (restage.Frame, lambda x: x.vertices), (restage.Adam, lambda x: x.state_dict()),
                      (restage.Report, lambda x: bool(x) and x.text)):
        with pytest.raises((TypeError, RuntimeError, restage.InputError)):
            use(kind.__new__(kind))


def test_threads_are_set_while_others_work(walk):
    clouds = restage.load_clouds(walk / "source.h5")[:4]
    expected = restage.retarget(clouds, walk / "target.ply", LITE).joints
    found = []

    def work():
        for n in (1, 2, 3) * 3:
            restage.set_threads(n)
            found.append(restage.retarget(clouds, walk / "target.ply", LITE).joints)

    threads = [threading.Thread(target=work) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    restage.set_threads(0)
    assert len(found) == 18 and all(np.array_equal(joints, expected) for joints in found)


def test_clouds_that_would_be_read_wrongly(walk):
    cloud = np.asarray(restage.load_clouds(walk / "source.h5")[0], np.float64)
    system = restage.System(walk / "target.ply", LITE, samples=1)
    masked = np.ma.masked_array(cloud, np.zeros(cloud.shape, bool))
    for take in (system.push, lambda c: restage.skeleton(c, LITE), lambda c: restage.retarget([c], walk / "target.ply", LITE)):
        with pytest.raises(restage.InputError, match="masked"):
            take(masked)
        with pytest.raises(restage.InputError, match="km from the origin"):
            take(cloud + [5.4e6, 0, 0])
    assert system.push(np.ma.compress_rows(masked)) is not None, "the mend that the message names"

    class Framed(np.ndarray):
        """As a pandas.DataFrame, which can be masked and is not."""

        def mask(self):
            raise AssertionError

    assert system.push(cloud.view(Framed)) is not None
    stray = cloud.copy()
    stray[0] = 3e5
    assert system.push(stray) is not None, "one point far away is no cloud far away"
    with pytest.raises(restage.InputError, match="another size"):
        restage.skeleton(cloud * 1000, LITE)
    for nothing in (None, 3, [cloud, None]):
        with pytest.raises(restage.InputError):
            restage.skeleton(nothing, LITE)
    restage.retarget([cloud], walk / "target.ply", LITE, foot_lock=np.bool_(False))
    for options in ({"samples": 8}, {"anchor": 1.0}, {"foot_lock": False}, {"keep_limbs": False}, {"min_confidence": 0.5}):
        name = "--" + ("no-" if False in options.values() else "") + next(iter(options)).replace("_", "-")
        with pytest.raises(restage.InputError, match=name + " says nothing to --system register"):
            restage.retarget([cloud], walk / "target.ply", LITE, system="register", rest=walk / "rest.h5", **options)
    with pytest.raises(restage.InputError, match="60 frames a second"):
        restage.retarget([cloud] * 4, walk / "target.ply", LITE, system="register", rest=walk / "rest.h5", fps=60)


def test_ctrl_c_ends_a_training(tmp_path):
    config = tmp_path / "c.yaml"
    config.write_text("stages: [deformation]\nrun_root: %s\nname: t\ndata: {bodies: {train: 1, validation: 1, test: 1}, motions: {train: 1, "
                      "validation: 1, test: 1}}\ndeformation: {optimiser: {steps: 100000, batch: 2}}\n" % tmp_path)
    seen = []

    def step(stage, done, figures):
        seen.append(done)
        if done == 5:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        restage.train(config, on_step=step)
    assert 5 <= seen[-1] <= 6 and list(tmp_path.glob("t-*/checkpoints/deformation-*"))
    # What stopped the training does not stop what comes after it.
    restage.command("data", "build", bodies=[1, 0, 0], motions=[1, 0, 0], out=tmp_path / "data.h5")


def test_the_lock_of_python_is_free(walk):
    """Another thread goes on while we compute."""
    cloud = restage.load_cloud(walk / "target.ply")
    counted = []
    stop = threading.Event()

    def count():
        while not stop.is_set():
            counted.append(1)
            time.sleep(0.001)

    worker = threading.Thread(target=count)
    worker.start()
    restage.retarget([cloud] * 20, walk / "target.ply", LITE)
    stop.set()
    worker.join()
    assert len(counted) > 10


PARAMETERS = [restage.Parameter(np.eye(2))]


@pytest.mark.parametrize("call, line", [
    (lambda: restage.Adam(rate="x"), "Adam(): parameters is missing; give a Model, a dict or a list of Parameters"),
    (lambda: restage.Adam(PARAMETERS, rate="x"), "Adam(): rate is 'x'; give a number"),
    (lambda: restage.AdamW(PARAMETERS, rate=None), "AdamW(): rate is None; give a number"),
    (lambda: restage.Muon(PARAMETERS, weight_decay=np.zeros((3, 2))), "Muon(): weight_decay is an array [3, 2]; give a number"),
    (lambda: restage.SGD(PARAMETERS, momentun=0.9), "SGD() has no argument 'momentun'; did you mean 'momentum'?"),
    (lambda: restage.Lion(PARAMETERS, 1, 2, 3, 4, 5, 6), "Lion() takes at most 5 arguments and was given 7; give parameters, rate, beta1, beta2, weight_decay"),
    (lambda: restage.Adam(PARAMETERS, parameters=PARAMETERS), "Adam(): parameters is given twice, by its place and by its name; give it once"),
    (lambda: restage.Adam(PARAMETERS).step(3), "Adam.step(): gradients is 3; give a restage.Gradients"),
    (lambda: restage.Adam(PARAMETERS).step(restage.Tape().backward(3)), "Tape.backward(): loss is 3; give a restage.Var"),
    (lambda: restage.Adam(PARAMETERS).load_state_dict([]), "Adam.load_state_dict(): state is []; give a dict"),
    (lambda: restage.Schedule(2.5), "Schedule(): steps is 2.5; give a whole number"),
    (lambda: restage.Schedule(10)("x"), "Schedule(): step is 'x'; give a whole number"),
    (lambda: restage.Average(PARAMETERS, "x"), "Average(): decay is 'x'; give a number or None"),
    (lambda: restage.Tape(3), "Tape() takes at most 0 arguments and was given 1; give none"),
    (lambda: restage.Tensor(), "Tensor(): array is missing; give numbers, such as an array of NumPy"),
    (lambda: restage.set_threads("x"), "set_threads(): n is 'x'; give a whole number"),
    (lambda: restage.load_model(3), "load_model(): role is missing; give text"),
])
def test_a_wrong_argument_is_told_in_one_line(call, line):
    with pytest.raises(restage.InputError) as error:
        call()
    assert str(error.value) == "restage: " + line
    assert isinstance(error.value, TypeError) and "\n" not in str(error.value)


def test_right_arguments_that_fail_say_what_they_said():
    with pytest.raises(restage.InputError, match="nesterov needs a momentum"):
        restage.SGD(PARAMETERS, nesterov=True)
    with pytest.raises(TypeError, match="state_dict"):
        __import__("copy").copy(restage.Adam(PARAMETERS))
