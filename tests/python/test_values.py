"""Metrics, the closed form, readers, the doctor."""
import json
from itertools import count

import numpy as np
import pytest
import restage
from restage import metrics

from conftest import LITE, ROOT

rng = np.random.default_rng(1)


def test_metrics_are_the_programs(program, tmp_path):
    h5py = pytest.importorskip("h5py")
    truth = {"joints": rng.normal(size=(6, 22, 3)), "vertices": rng.normal(size=(6, 40, 3))}
    pred = {k: v + 0.1 * rng.normal(size=v.shape) for k, v in truth.items()}
    for name, values in (("p.h5", pred), ("t.h5", truth)):
        with h5py.File(tmp_path / name, "w") as f:
            for key, v in values.items():
                f[key] = v
    told = program.json("eval", "--pred", tmp_path / "p.h5", "--truth", tmp_path / "t.h5")["mean"]
    ours = metrics.all(pred["joints"], truth["joints"], pred["vertices"], truth["vertices"])
    for name, value in told.items():
        assert ours[name] == value, name
        of_joints = name in ("mpjpe", "pa_mpjpe", "acc", "pa_acc")
        key = "joints" if of_joints else "vertices"
        assert getattr(metrics, name)(pred[key], truth[key]) == value


def test_metrics_that_cannot_be():
    joints = rng.normal(size=(2, 22, 3))
    assert metrics.mpjpe(joints, joints) == 0
    assert metrics.mpjpe(joints[0], joints[0]) == 0
    assert metrics.acc(joints, joints) is None
    assert metrics.pa_mpjpe(np.zeros((2, 22, 3)), joints) is None
    assert metrics.mpjpe(np.zeros((0, 22, 3)), np.zeros((0, 22, 3))) is None
    for name in metrics.names:
        width = 4 if name.startswith("rotation") else 3
        for points in ((3, 1), (1, 5), (3, 22), (0, 0), (4, 0), (0, 7), (3, 8)):
            shape = (*points, width)
            value = getattr(metrics, name)(np.full(shape, np.nan), np.zeros(shape))
            assert value is None or np.isfinite(value)
            value = getattr(metrics, name)(rng.normal(size=shape), rng.normal(size=shape))
            assert value is None or np.isfinite(value)
            more = {"joints": rng.normal(size=(shape[0], 22, 3))}
            if metrics.kinds[name] != "vertices":
                with pytest.raises(restage.InputError, match="say nothing to"):
                    getattr(metrics, name)(rng.normal(size=shape), rng.normal(size=shape), **more)
                continue
            value = getattr(metrics, name)(rng.normal(size=shape), rng.normal(size=shape), **more)
            assert value is None or np.isfinite(value)
    for bad in (np.zeros((2, 21, 3)), np.zeros(3), "x", None, np.zeros((2, 22, 2))):
        with pytest.raises(restage.InputError):
            metrics.mpjpe(bad, joints)
    with pytest.raises(restage.InputError, match="quaternions"):
        metrics.rotation_deg(joints, joints)


def test_metrics_of_rotations():
    truth = np.tile([1.0, 0, 0, 0], (4, 22, 1))
    pred = truth.copy()
    pred[0, :11] = [0, 1, 0, 0]  # half of a frame's joints turned by 180 degrees
    assert metrics.rotation_deg(pred, truth) == pytest.approx(180 / 8)
    assert metrics.rotation_over_90(pred, truth) == pytest.approx(1 / 8)
    assert metrics.all(pred_rotations=pred, true_rotations=truth)["rotation_deg"] == pytest.approx(180 / 8)


def test_convert_joints():
    joints = np.random.default_rng(0).normal(size=(2, 3, 22, 3))
    there = restage.convert_joints(joints, "makehuman", "smpl")
    assert there.shape == joints.shape and there.dtype == np.float64
    assert np.array_equal(there[1, 2], restage.convert_joints(joints[1, 2], "makehuman", "smpl"))
    assert np.allclose(restage.convert_joints(joints + [1, 2, 3], "makehuman", "smpl"), there + [1, 2, 3])
    assert 0.1 < np.linalg.norm(there - joints, axis=-1)[..., restage.JOINTS.index("spine2")].min()
    for bad in (lambda: restage.convert_joints(joints[..., :21, :], "makehuman", "smpl"),
                lambda: restage.convert_joints(joints, "makehuman", "cmu")):
        with pytest.raises(restage.InputError):
            bad()


def test_closed_form(walk):
    rest = np.asarray(restage.System(walk / "target.ply", LITE).rest_joints)
    still = restage.closed_form(np.repeat(rest[None], 3, 0), rest)
    assert still.joints.shape == (3, 22, 3) and still.rotations.shape == (3, 22, 4)
    assert np.allclose(still.joints[0] - still.joints[0, 0], rest - rest[0], atol=1e-6)
    assert np.allclose(still.rotations, [1, 0, 0, 0], atol=1e-6)
    assert restage.closed_form(np.zeros((0, 22, 3)), rest).joints.shape == (0, 22, 3)
    with pytest.raises(restage.InputError):
        restage.closed_form(np.zeros((2, 22, 3)), rest[:5])
    assert np.isfinite(restage.closed_form(np.zeros((2, 22, 3)), np.zeros((22, 3))).joints).all()


def test_readers(walk, program, tmp_path):
    mesh = restage.load_mesh(walk / "target.ply")
    assert mesh.vertices.dtype == np.float32 and mesh.faces.dtype == np.int32
    assert mesh.faces.max() < len(mesh.vertices)
    assert np.array_equal(restage.load_cloud(walk / "target.ply"), mesh.vertices)
    np.save(tmp_path / "clouds.npy", np.stack([mesh.vertices] * 2))
    clouds = restage.load_clouds(tmp_path / "clouds.npy", scale=2.0)
    assert len(clouds) == 2 and np.array_equal(clouds[1], 2 * mesh.vertices)


@pytest.fixture
def bvh(tmp_path):
    """A recording of somebody who stands in T-pose and turns an arm."""
    tree = ("Hips", (0, 100, 0), [
        ("LeftUpLeg", (10, 0, 0), [("LeftLeg", (0, -45, 0), [("LeftFoot", (0, -45, 0), [("LeftToeBase", (0, -5, 12), [])])])]),
        ("RightUpLeg", (-10, 0, 0), [("RightLeg", (0, -45, 0), [("RightFoot", (0, -45, 0), [("RightToeBase", (0, -5, 12), [])])])]),
        ("Spine", (0, 10, 0), [("Spine1", (0, 12, 0), [("Spine2", (0, 12, 0), [
            ("Neck", (0, 18, 0), [("Head", (0, 10, 0), [])]),
            ("LeftShoulder", (5, 12, 0), [("LeftArm", (12, 0, 0), [("LeftForeArm", (28, 0, 0), [("LeftHand", (25, 0, 0), [])])])]),
            ("RightShoulder", (-5, 12, 0), [("RightArm", (-12, 0, 0), [("RightForeArm", (-28, 0, 0), [("RightHand", (-25, 0, 0), [])])])]),
        ])])])])
    number = count()

    def text(node, root=True):
        name, offset, children = node
        next(number)
        kind = "ROOT" if root else "JOINT"
        channels = "6 Xposition Yposition Zposition Zrotation Xrotation Yrotation" if root else "3 Zrotation Xrotation Yrotation"
        end = "" if children else "End Site\n{\nOFFSET 0 1 0\n}\n"
        inner = "".join(text(c, False) for c in children)
        return f"{kind} {name}\n{{\nOFFSET {' '.join(map(str, offset))}\nCHANNELS {channels}\n{inner}{end}}}\n"

    hierarchy = text(tree)
    zeros = 3 * next(number)
    rows = [" ".join(["0 100 0"] + ["0"] * (zeros - 3) + [str(5 * k), "0", "0"]) for k in range(4)]
    (tmp_path / "still.bvh").write_text(f"HIERARCHY\n{hierarchy}MOTION\nFrames: 4\nFrame Time: 0.0333333\n" + "\n".join(rows) + "\n")
    return tmp_path / "still.bvh"


def test_motion(bvh, tmp_path):
    clip = restage.load_motion(bvh)
    assert clip.joints.shape == (4, 22, 3) and clip.rotations.shape == (4, 22, 4)
    assert np.allclose(clip.rotations[0], [1, 0, 0, 0], atol=1e-6) and not np.allclose(clip.rotations[3], clip.rotations[0], atol=1e-2)
    with pytest.raises(restage.InputError):
        restage.load_motion(tmp_path / "no.bvh")


def test_a_skeleton_as_source(bvh, walk, program, tmp_path):
    h5py = pytest.importorskip("h5py")
    program.done("retarget", "--source", bvh, "--target", walk / "target.ply", "--weights", LITE, "--out", tmp_path / "t.h5")
    result = restage.retarget(bvh, walk / "target.ply", LITE)
    assert result.confidence is None and result.report["from"] == "skeleton"
    with h5py.File(tmp_path / "t.h5") as f:
        for name in ("vertices", "joints", "rotations"):
            assert np.array_equal(getattr(result, name), f[name][:]), name


def test_doctor(walk, program, tmp_path):
    told = program.json("doctor", walk / "target.ply")
    ours = restage.doctor(walk / "target.ply")
    assert ours == told and ours["usable"]
    clouds = restage.load_clouds(walk / "source.h5")
    np.save(tmp_path / "wide.npy", np.stack([100 * c[:200] for c in clouds[:5]]))
    assert restage.doctor(tmp_path / "wide.npy")["usable"] is False
    assert json.dumps(restage.command("info", "skeleton/pointnet")["parameters"]) == "1620811"


def test_version(program):
    assert restage.__version__ == program.json("--version")["version"]


SWEEP = """base: npt/smoke.yaml
cases:
  plain: {transfer.optimiser.steps: 2}
  longer: {transfer.optimiser.steps: 3}
seeds: [1, 2]
"""


def test_sweep_results(program, tmp_path):
    sweep = tmp_path / "sweep.yaml"
    sweep.write_text(SWEEP.replace("npt/smoke.yaml", str(ROOT / "configs/npt/smoke.yaml")))
    with pytest.raises(restage.InputError, match="no finished trial"):
        restage.sweep_results(tmp_path)
    with pytest.raises(restage.InputError, match="unknown key 'nonsense'"):
        restage.command("sweep", "run", sweep, "nonsense=1", out=tmp_path / "bad")
    restage.command("sweep", "run", sweep, out=tmp_path / "out", jobs=2)
    found = restage.sweep_results(tmp_path / "out")
    assert sorted(found["case"]) == ["longer", "longer", "plain", "plain"] and set(found["seed"]) == {1, 2}
    assert set(found["transfer.optimiser.steps"]) == {2, 3}
    assert found["clouds/mpvd"].dtype == np.float64 and (found["clouds/mpvd"] > 0).all()
    assert np.isnan(found["clouds/mpjpe"]).all()
    assert len({len(column) for column in found.values()}) == 1
    path = tmp_path / "out/trials" / found["trial"][0] / "result.json"
    for damaged in (b"", b"\xff\xfe", b"[]", b"{}"):
        path.write_bytes(damaged)
        with pytest.raises(restage.InputError, match="no result of a trial"):
            restage.sweep_results(tmp_path / "out")
