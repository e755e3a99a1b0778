"""Networks that are written in Python (own_networks.py): they train, resume, are saved, and run where those of C++ do."""
import json
import os
import pathlib
import signal
import socket
import struct
import subprocess

import numpy as np
import pytest
import restage
from restage import layers, ops

import own_networks
from conftest import LITE, PROGRAM, ROOT, python

NETWORKS = ROOT / "tests/python/own_networks.py"
TINY = """run_root: {folder}
name: t
seed: 3
data: {{bodies: {{train: 2, validation: 2, test: 2}}, motions: {{train: 2, validation: 1, test: 1}}}}
loop: {{log_every: 1, validate_every: 2, checkpoint_every: 100, micro_batches: {parts}}}
evaluation: {{sequences: 1, frames: 6}}
stages: [{stage}]
"""
STAGES = {
    "motion": "motion: {{model: {model}, sizes: {sizes}, optimiser: {{steps: 4, batch: 4}}, windows: {{frames: 8}}, "
              "validation_windows: 2, validation_frames: 8}}\n",
    "skeleton": "skeleton: {{model: {model}, sizes: {sizes}, optimiser: {{steps: 4, batch: 4}}, validation_clouds: 4}}\n",
    "deformation": "deformation: {{model: {model}, sizes: {sizes}, optimiser: {{steps: 4, batch: 2}}, pairs: {{points: 32}}, "
                   "validation_pairs: 2}}\n",
    "transfer": "transfer: {{model: {model}, sizes: {sizes}, optimiser: {{steps: 4, batch: 2}}, pairs: {{points: 32, "
                "vertices: 40}}, validation_pairs: 2}}\n",
}


def configuration(folder, stage, model, sizes="{}", more="", parts=1):
    path = folder / f"{model.replace('/', '_')}.yaml"
    path.write_text(TINY.format(folder=folder, stage=stage, parts=parts) + STAGES[stage].format(model=model, sizes=sizes) + more)
    return path


def tensors(run):
    return {name: tensor.numpy() for name, tensor in restage.load_safetensors(run.weights)[0].items()}


def same(a, b):
    return list(a) == list(b) and all(np.array_equal(a[name], b[name]) for name in a)


def program(*words, cwd=None):
    """python3 -m restage in a process of its own."""
    return python("-m", "restage", *words, cwd=cwd, text=True, timeout=300)


# ---- the network itself ----

def test_members_have_the_names_of_their_attributes():
    net = restage.model("tiny/points", {"width": 8}, seed=1)
    assert list(net.named_parameters()) == ["each.0.weight", "each.0.bias", "each.1.weight", "each.1.bias",
                                            "head.joints.weight", "head.joints.bias"]
    assert isinstance(net.own, own_networks.Points) and restage.model("skeleton/pointnet").own is None
    again, other = restage.model("tiny/points", {"width": 8}, seed=1), restage.model("tiny/points", {"width": 8}, seed=2)
    values = [n.state_dict()["each.0.weight"].numpy() for n in (net, again, other)]
    assert np.array_equal(values[0], values[1]) and not np.array_equal(values[0], values[2])
    with pytest.raises(restage.InputError, match="witdh.*did you mean 'width'"):
        restage.model("tiny/points", {"witdh": 8})
    assert "tiny/points" in restage.models()
    assert restage.command("info", "tiny/points")["parameters"] == 16 * 3 + 16 + 16 * 16 + 16 + 66 * 16 + 66


def test_members_of_lists_objects_and_visit():
    class Part:
        def __init__(self):
            self.w = restage.Parameter(np.ones(2))

    @restage.model("tiny/visited", role="deformation.weights")
    class Visited:
        def __init__(self):
            self.hidden = restage.Parameter(np.ones(1))
            self.shared = self.again = Part()
            self.many = ({"a": Part()}, [restage.model("deformation/bones")])

        def visit(self, fields):
            fields("first", self.shared)
            fields("second", self.again)
            fields("many", self.many)

        def forward(self, ctx, x):
            return self.many[1][0](x.rest, x.points, ctx=ctx)

    net = restage.model("tiny/visited")
    inside = [name for name in net.named_parameters() if name.startswith("many.1.0.")]
    assert inside and [name for name in net.named_parameters() if name not in inside] == ["first.w", "many.0.a.w"]
    rest, points = np.random.default_rng(1).normal(size=(1, 22, 3)), np.zeros((1, 4, 3), np.float32)
    weights = net(rest.astype(np.float32), points)
    assert np.allclose(weights.numpy().sum(-1), 1)


def test_calls_give_what_the_role_gives():
    rng = np.random.default_rng(0)
    joints, trans, rest = (rng.normal(size=s).astype(np.float32) for s in ((2, 5, 22, 3), (2, 5, 3), (2, 22, 3)))
    net = restage.model("tiny/turns")
    tape = restage.Tape()
    answer = net(joints, trans, rest, tape=tape)
    assert answer["rotations"].shape == (2, 5, 22, 3, 3) and answer["joints"].shape == (2, 5, 22, 3)
    gradients = (answer["joints"] ** 2).sum().backward()
    assert gradients[net.named_parameters()["gru.weight_hh_l0"]] is not None
    assert restage.model("tiny/points")(np.zeros((3, 96, 3), np.float32))["joints"].shape == (3, 22, 3)
    vertices = restage.model("tiny/shift")(np.ones((1, 1, 7, 3), np.float32), np.zeros((1, 9, 3), np.float32))
    assert vertices.shape == (1, 1, 9, 3) and np.all(vertices.numpy() == 1)


@pytest.mark.parametrize("make, says", [
    (lambda: restage.model("tiny/x", role="motion")(3), "a class with a method forward"),
    (lambda: restage.model("tiny/x", role="codes")(own_networks.Turns), "no network of the role 'codes'"),
    (lambda: restage.model("a b", role="motion")(own_networks.Turns), "no name of a network"),
    (lambda: restage.model("smrm/rot6d", role="motion")(own_networks.Turns), "registered already"),
])
def test_what_is_no_network_is_refused(make, says):
    with pytest.raises((restage.InputError, restage.WorkError), match=says):
        make()


def test_sizes_need_defaults():
    with pytest.raises(restage.InputError, match="'width' has no default"):
        @restage.model("tiny/x", role="skeleton")
        class NoDefault:
            def __init__(self, width):
                pass

            def forward(self, ctx, x):
                pass


def test_a_wrong_answer_is_told():
    @restage.model("tiny/wrong", role="skeleton")
    class Wrong:
        points = 8

        def forward(self, ctx, x):
            return np.zeros((x.cloud.shape[0], 21, 3), np.float32)

    with pytest.raises(restage.ShapeError, match=r"tiny/wrong: forward\(\) gave 'joints' as \[1, 21, 3\] float32, and it must be "
                                                 r"\[1, 22, 3\]"):
        restage.model("tiny/wrong")(np.zeros((1, 8, 3), np.float32))


def test_a_ctx_is_of_its_call():
    kept = []

    @restage.model("tiny/keeps", role="skeleton")
    class Keeps:
        points = 8

        def forward(self, ctx, x):
            kept.append(ctx)
            return np.zeros((x.cloud.shape[0], 22, 3), np.float32)

    restage.model("tiny/keeps")(np.zeros((1, 8, 3), np.float32))
    with pytest.raises(restage.ShapeError, match="a call that is over"):
        kept[0].leaf(restage.Parameter(np.ones(1)))


# ---- training ----

def test_the_same_network_in_both_languages_has_the_same_bits(tmp_path):
    more = {"tiny/smrm": "{hidden: 16, dropout: 0.1}",
            "smrm/rot6d": "{hidden: 16, dropout: 0.1, layers: 2, standardise: true, rest_pose_start: true}"}
    ours, theirs = (restage.train(configuration(tmp_path, "motion", model, sizes, parts=2)) for model, sizes in more.items())
    assert same(tensors(ours), tensors(theirs))
    for figure in ("loss", "pa_mpjpe"):
        assert np.array_equal(ours.curves("motion")[figure], theirs.curves("motion")[figure], equal_nan=True)


@pytest.mark.parametrize("stage, model", [("motion", "tiny/turns"), ("skeleton", "tiny/points"), ("deformation", "tiny/field"),
                                          ("transfer", "tiny/shift")])
def test_a_resumed_training_has_the_same_bits(tmp_path, stage, model):
    class Enough(Exception):
        pass

    def stop(stage, done, figures):
        if done == 3:
            raise Enough

    config = configuration(tmp_path, stage, model)
    whole = restage.train(config)
    with pytest.raises(Enough):
        restage.train(config, on_step=stop)
    cut = next(folder for folder in sorted(tmp_path.glob("t-*")) if folder != pathlib.Path(whole))
    resumed = restage.train(f"resume={cut}")
    assert same(tensors(resumed), tensors(whole))
    start = restage.model(model).state_dict()
    assert any(not np.array_equal(value, start[name.split(".", {"deformation": 2}.get(stage, 1))[-1]].numpy())
               for name, value in tensors(whole).items() if not name.startswith("deformation.offsets")), "nothing was learned"


def test_threads_and_parts_do_not_change_bits(tmp_path):
    config = configuration(tmp_path, "motion", "tiny/turns", "{dropout: 0.2}", parts=2)
    runs = []
    for n in (1, 2):
        restage.set_threads(n)
        runs.append(tensors(restage.train(config)))
    restage.set_threads(0)
    assert same(*runs)


def test_a_loss_and_a_figure_of_its_own(tmp_path):
    path = configuration(tmp_path, "motion", "tiny/judged")
    path.write_text(path.read_text().replace("loop: {", "loop: {export: best, monitor: [motion.calls], "))
    run = restage.train(path)
    curves = run.curves("motion")
    assert np.nanmax(curves["calls"]) > np.nanmin(curves["calls"]) > 0 and "cycle" not in curves
    with pytest.raises(restage.InputError, match="motion.calls.*does not measure"):
        restage.train(path, "motion.model=tiny/turns")


def test_on_validation_adds_figures_and_ends_a_stage(tmp_path):
    path = configuration(tmp_path, "motion", "tiny/turns")
    seen = []

    def judge(stage, done, figures):
        seen.append((stage, done, "pa_mpjpe" in figures))
        return {"mine": 10.0 - done} if done < 4 else False

    run = restage.train(path, {"motion.optimiser.steps": 8}, on_validation=judge)
    assert seen == [("motion", 2, True), ("motion", 4, True)]
    assert np.nanmax(run.curves("motion")["mine"]) == 8 and run.curves("motion")["step"].max() == 4 and run.weights
    with pytest.raises(restage.InputError, match="motion.mine"):
        restage.train(path, "loop.monitor=[motion.mine]", on_validation=judge)
    restage.train(path, "loop.monitor=[motion.mine]", "loop.export=best", "motion.optimiser.steps=2",
                  on_validation=lambda *of: {"mine": 1}, figures=["motion.mine"])
    with pytest.raises(ZeroDivisionError):
        restage.train(path, on_validation=lambda *of: 1 / 0)


@pytest.mark.parametrize("parts", [1, 2])
def test_an_exception_of_the_network_goes_up(tmp_path, parts):
    @restage.model("tiny/broken", role="motion")
    class Broken(own_networks.Turns):
        def forward(self, ctx, x):
            if ctx.training:
                raise KeyError("no such thing")
            return super().forward(ctx, x)

    with pytest.raises(KeyError, match="no such thing") as caught:
        restage.train(configuration(tmp_path, "motion", "tiny/broken", parts=parts))
    assert "forward" in [entry.name for entry in caught.traceback]


def test_ctrl_c_inside_the_network_ends_after_the_step(tmp_path):
    @restage.model("tiny/interrupted", role="motion")
    class Interrupted(own_networks.Turns):
        sent = False

        def forward(self, ctx, x):
            if ctx.training and not Interrupted.sent:
                Interrupted.sent = True
                signal.raise_signal(signal.SIGINT)
            return super().forward(ctx, x)

    config = configuration(tmp_path, "motion", "tiny/interrupted")
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # also where the tests run in the background
    try:
        with pytest.raises(KeyboardInterrupt):
            restage.train(config)
    finally:
        signal.signal(signal.SIGINT, before)
    cut = next(tmp_path.glob("t-*"))
    assert list((cut / "checkpoints").glob("motion-000000001-*"))
    assert same(tensors(restage.train(f"resume={cut}")), tensors(restage.train(config)))


def test_a_value_that_is_not_finite_is_named(tmp_path):
    @restage.model("tiny/infinite", role="motion")
    class Infinite(own_networks.Turns):
        def forward(self, ctx, x):
            y = super().forward(ctx, x)
            return {**y, "trans": y["trans"] / 0 if ctx.training else y["trans"]}

    with pytest.raises(restage.NonFiniteError, match="tiny/infinite.*restage replay"):
        restage.train(configuration(tmp_path, "motion", "tiny/infinite"))


def test_a_shape_that_does_not_fit_is_told():
    @restage.model("tiny/unbound", role="skeleton")
    class Unbound:
        points = 8

        def __init__(self):
            self.scale = restage.Parameter(np.ones(1))

        def forward(self, ctx, x):
            return x.cloud * self.scale

    with pytest.raises(restage.ShapeError, match=r"give ctx\.leaf"):
        restage.model("tiny/unbound")(np.zeros((1, 8, 3), np.float32))
    with pytest.raises(restage.ShapeError, match=r"give Tape\.leaf"):
        restage.ops.relu(restage.Parameter(np.ones(1)))


def test_a_layer_that_forward_makes_is_refused(tmp_path):
    @restage.model("tiny/late", role="motion")
    class Late(own_networks.Turns):
        def forward(self, ctx, x):
            out = super().forward(ctx, x)
            return dict(out, trans=layers.Linear(3, 3)(ctx, out["trans"]))

    with pytest.raises(restage.ShapeError, match=r"ctx\.leaf: a parameter \[3\] belongs to no attribute of the network"):
        restage.train(configuration(tmp_path, "motion", "tiny/late"))


def test_an_answer_without_parameters_is_told(tmp_path):
    @restage.model("tiny/arrays", role="motion")
    class Arrays(own_networks.Turns):
        def forward(self, ctx, x):
            return {name: value.numpy() for name, value in super().forward(ctx, x).items() if name != "state"}

    with pytest.raises(restage.ShapeError, match=r"tiny/arrays: forward\(\)'s result depends on no parameter; use ctx\.leaf"):
        restage.train(configuration(tmp_path, "motion", "tiny/arrays"))


@pytest.mark.parametrize("figures, given, says", [
    (["feet"], {"feet": "x"}, r"validate\(\) gave 'x' for 'feet', which is no number"),
    (["feet"], {"feet": 1, "hands": 2}, r"validate\(\) gave 'hands', which 'figures' does not name"),
    (["feet"], {}, r"validate\(\) gave no 'feet'"),
    (["pa_mpjpe"], {"pa_mpjpe": 1}, "gives the figure 'pa_mpjpe', which is measured already"),
])
def test_wrong_figures_are_told(tmp_path, figures, given, says):
    names = figures

    @restage.model("tiny/figures", role="motion")
    class Figures(own_networks.Turns):
        figures = names

        def validate(self, measured):
            return given

    with pytest.raises(restage.InputError, match=says):
        restage.train(configuration(tmp_path, "motion", "tiny/figures"))


def test_figures_need_validate():
    with pytest.raises(restage.InputError, match="names the figure 'jerk' and has no method validate"):
        @restage.model("tiny/jerk", role="motion")
        class Jerk(own_networks.Turns):
            figures = ("jerk",)


# ---- files and systems ----

@pytest.fixture(scope="module")
def trained(cache, tmp_path_factory):
    """A weights file with an extractor and a motion network of Python, and the surface of lite."""
    folder = tmp_path_factory.mktemp("trained")
    config = configuration(folder, "motion", "tiny/turns", more=f"skeleton: {{model: tiny/points, optimiser: {{steps: 2, batch: 4}}"
                           f", validation_clouds: 4}}\ndeformation: {{from: {LITE}}}\n")
    return restage.train(config, "stages=[skeleton,motion,deformation]").weights


def test_a_weights_file_names_the_module_and_runs_nothing(trained, tmp_path):
    metadata = json.loads(restage.load_safetensors(trained)[1]["restage"])
    assert metadata["models"]["smrm"]["module"] == "own_networks"
    net = restage.load_model(trained, "motion")
    assert net.name == "tiny/turns" and net.own is not None
    script = "import restage, sys\ntry: restage.load_model(sys.argv[1], 'motion')\nexcept restage.InputError as e: print(e)"
    result = python("-c", script, trained, text=True,
                    env={**os.environ, "PYTHONPATH": os.environ["PYTHONPATH"] + ":" + str(NETWORKS.parent)})
    assert "needs the network 'tiny/turns', which the Python module 'own_networks' defines; import that module first" in result.stdout
    result = subprocess.run([PROGRAM, "weights", "export", "--source", trained, "--model", "motion", "--out", tmp_path / "m"], capture_output=True, text=True)
    assert result.returncode == 2 and "--python FILE.py" in result.stderr and result.stderr.count("\n") == 1
    result = program("weights", "export", "--source", trained, "--model", "motion", "--out", tmp_path / "m",
                     "--python", NETWORKS)
    assert result.returncode == 0 and (tmp_path / "m").exists(), result.stderr


def test_it_runs_in_a_system(trained, walk):
    clouds = restage.load_clouds(walk / "source.h5")
    whole = restage.retarget(walk / "source.h5", walk / "target.ply", trained, online=True, force=True)
    system = restage.System(walk / "target.ply", trained, fps=30, force=True)
    frames = [frame for cloud in clouds for frame in system.push_all(cloud)] + system.finish()
    assert len(frames) == len(clouds) and np.isfinite(frames[-1].vertices).all()
    assert whole.vertices.shape[1] == frames[0].vertices.shape[0]
    result = program("retarget", "--python", NETWORKS, walk / "source.h5", walk / "target.ply", walk.parent / "own.h5",
                     "--weights", trained, "--quiet", "--force")
    assert result.returncode == 0, result.stderr


def test_it_runs_in_a_stream(trained, walk):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        clouds = restage.load_clouds(walk / "source.h5")
        frames = b"".join(struct.pack("<Id", len(c), k / 30) + c.tobytes() for k, c in enumerate(clouds))
        result = python("-m", "restage", "stream", "-", walk / "target.ply", "--vmc",
                        f"127.0.0.1:{receiver.getsockname()[1]}", "--weights", trained, "--python", NETWORKS,
                        "--force", "--json", input=frames, timeout=120)
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)["frames_in"] == len(clouds)
