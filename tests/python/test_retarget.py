"""restage.retarget, System, skeleton: the program's bits, from files and from arrays."""
import copy
import pickle
import threading

import numpy as np
import pytest
import restage

from conftest import LITE

h5py = pytest.importorskip("h5py")


@pytest.fixture(scope="module")
def source(walk):
    return walk / "source.h5"


@pytest.fixture(scope="module")
def truth(walk, source, program, tmp_path_factory):
    """The program's own result."""
    out = tmp_path_factory.mktemp("truth") / "truth.h5"
    program.done("retarget", "--source", source, "--target", walk / "target.ply", "--weights", LITE, "--out", out)
    with h5py.File(out) as f:
        return {name: f[name][:] for name in ("vertices", "joints", "rotations", "confidence") if name in f}, out


def same(frames, truth, first=0):
    for name, values in truth.items():
        assert getattr(frames, name).dtype == np.float32
        assert np.array_equal(getattr(frames, name), values), name


def test_arrays_are_the_programs(walk, source, truth):
    result = restage.retarget(source, walk / "target.ply", LITE)
    same(result, truth[0])
    assert len(result) == len(truth[0]["joints"]) and result.filled == []
    assert result.faces.shape[1] == 3 and result.report["frames"] == len(result)


def test_files_are_the_programs(walk, source, truth, tmp_path):
    report = restage.retarget(str(source), str(walk / "target.ply"), LITE, out=tmp_path / "r.h5")
    assert report["frames"] == len(truth[0]["joints"])
    assert (tmp_path / "r.h5").read_bytes() == truth[1].read_bytes()
    with h5py.File(tmp_path / "r.h5") as f:
        for name, values in truth[0].items():
            assert np.array_equal(f[name][:], values), name


def test_clouds_in_memory(walk, source, truth, tmp_path):
    clouds = restage.load_clouds(source)
    same(restage.retarget(clouds, walk / "target.ply", LITE), truth[0])
    same(restage.retarget([c.astype(np.float64) for c in clouds], walk / "target.ply", LITE), truth[0])
    restage.retarget(clouds, walk / "target.ply", LITE, out=tmp_path / "r.h5")
    with h5py.File(tmp_path / "r.h5") as f:
        assert np.array_equal(f["vertices"][:], truth[0]["vertices"])


def test_units_by_name(source):
    metres = restage.load_clouds(source)[0]
    for scale in ("mm", 0.001, np.float32(0.001), "0.001"):
        assert np.allclose(restage.load_clouds(source, scale=scale)[0], 0.001 * metres, atol=1e-6)
    with pytest.raises(restage.InputError, match="give metres per unit"):
        restage.load_clouds(source, scale="stone")


def test_none_is_a_missing_frame(walk, source, truth):
    clouds = restage.load_clouds(source)
    clouds[2] = None
    result = restage.retarget(clouds, walk / "target.ply", LITE)
    assert result.filled == [2] and len(result) == len(clouds)
    assert np.array_equal(result.vertices[:2], truth[0]["vertices"][:2])
    with pytest.raises(restage.InputError, match="holds no points"):
        restage.retarget([None, None], walk / "target.ply", LITE)


def test_a_cloud_without_points_is_a_missing_frame(walk, source, truth):
    for empty in (np.zeros((0, 3), np.float32), np.full((70, 3), np.nan)):
        clouds = restage.load_clouds(source)
        clouds[2] = empty
        result = restage.retarget(clouds, walk / "target.ply", LITE)
        assert result.filled == [2] and [m["frame"] for m in result.report["missing"]] == [2]
        assert result.report["points_left_out"] == len(empty)
        assert np.array_equal(result.vertices[:2], truth[0]["vertices"][:2])


def test_missing_numbers_are_counted(walk, source, truth):
    clouds = restage.load_clouds(source)
    clouds[1] = np.concatenate([clouds[1], np.float32([[np.nan, 0, 0], [0, np.inf, 0], [0, 0, -np.inf]])])
    result = restage.retarget(clouds, walk / "target.ply", LITE)
    same(result, truth[0])
    assert result.report["points_left_out"] == 3
    system = restage.System(walk / "target.ply", LITE)
    assert sum(len(system.push_all(cloud)) for cloud in clouds) == len(clouds)
    assert system.points_left_out == 3


def test_points_far_from_all_others_are_left_out(walk, source, truth):
    system = restage.System(walk / "target.ply", LITE)
    clouds = [np.concatenate([cloud, np.float32([[40, 3, -20]])]) for cloud in restage.load_clouds(source)]
    frames = [f for cloud in clouds for f in system.push_all(cloud)]
    assert np.array_equal([f.joints for f in frames], truth[0]["joints"])


def test_push(walk, source, truth):
    system = restage.System(walk / "target.ply", LITE)
    frames = [f for cloud in restage.load_clouds(source) for f in system.push_all(cloud)] + system.finish()
    assert len(frames) == len(truth[0]["joints"])
    for k, frame in enumerate(frames):
        same(frame, {name: values[k] for name, values in truth[0].items() if name != "confidence"})
        if "confidence" in truth[0]:
            assert np.float32(frame.confidence) == truth[0]["confidence"][k]
    assert system.target_vertices.shape == truth[0]["vertices"].shape[1:]
    assert system.rest_joints.shape == (22, 3) and system.source_joints.shape == (22, 3)
    for other in (pickle.loads(pickle.dumps(frames[1])), copy.copy(frames[1])):
        same(other, {name: getattr(frames[1], name) for name in ("vertices", "joints", "rotations")})
        assert (other.confidence, other.filled) == (frames[1].confidence, frames[1].filled)
    for state in ((), (b"", b"1234", b"", None, False), (b"", b"", b"", None)):
        with pytest.raises(ValueError):
            restage.Frame.__new__(restage.Frame).__setstate__(state)


def test_threads_change_nothing(walk, source, truth):
    try:
        for n in (1, 3):
            restage.set_threads(n)
            assert restage.threads() == n
            same(restage.retarget(source, walk / "target.ply", LITE), truth[0])
            assert restage.threads() == n
    finally:
        restage.set_threads(0)


def test_frames_outlive_their_system(walk, source, truth):
    system = restage.System(walk / "target.ply", LITE)
    cloud = restage.load_clouds(source)[0]
    arrays = [system.push(cloud).vertices for _ in range(20)]
    copies = [a.copy() for a in arrays]
    system.restart()
    del system
    assert all(np.array_equal(a, b) for a, b in zip(arrays, copies))
    assert np.array_equal(arrays[0], truth[0]["vertices"][0])


def test_two_threads_push_into_one_system(walk, source):
    system = restage.System(walk / "target.ply", LITE, samples=1)
    cloud = restage.load_clouds(source)[0]
    got = []
    workers = [threading.Thread(target=lambda: got.extend(system.push_all(cloud) for _ in range(5))) for _ in range(3)]
    for w in workers:
        w.start()
    for w in workers:
        w.join()
    assert len(got) == 15


def test_options_are_the_programs(walk, source):
    few = restage.retarget(source, walk / "target.ply", LITE, every=2, foot_lock=False, samples=1, seed=3)
    assert len(few) == 4 and few.report["seed"] == 3


def test_skeleton(walk, source, program, tmp_path):
    told = program.json("skeleton", "--weights", LITE, "--input", source)
    joints = restage.skeleton(source, LITE)
    assert joints.shape == (8, 22, 3)
    assert np.array_equal(joints, [f["joints"] for f in told["frames"]])
    cloud = restage.load_clouds(source)[2]
    assert np.array_equal(restage.skeleton(cloud, LITE), joints[2])
    assert np.array_equal(restage.skeleton([cloud], LITE)[0], joints[2])
    assert np.array_equal(restage.skeleton(cloud.tolist(), LITE), joints[2])


def test_standard_weights(walk, source):
    assert restage.skeleton(restage.load_clouds(source)[0]).shape == (22, 3)


def test_the_network_that_looks_ahead(walk):
    clouds = restage.load_clouds(walk / "source.h5")[:8]
    for late in (True, False):
        result = restage.retarget(clouds, walk / "target.ply", online=not late)
        system = restage.System(walk / "target.ply", late=late)
        frames = [system.push_all(cloud) for cloud in clouds]
        assert [len(f) for f in frames] == [0 if late and k < 2 else 1 for k in range(8)]
        frames = sum(frames, []) + system.finish()
        assert np.array_equal(np.stack([f.vertices for f in frames]), result.vertices)
        assert np.array_equal(np.stack([f.joints for f in frames]), result.joints)
        assert system.finish() == []
        again = [f for cloud in clouds for f in system.push_all(cloud)] + system.finish()  # a new sequence
        assert np.array_equal(np.stack([f.vertices for f in again]), result.vertices)


def test_joints_of_another_definition(walk):
    clouds = restage.load_clouds(walk / "source.h5")[:3]
    own, smpl = (restage.retarget(clouds, walk / "target.ply", **more).joints for more in ({}, {"joints": "smpl"}))
    assert np.allclose(restage.convert_joints(own, "makehuman", "smpl"), smpl, atol=1e-6)
    found = restage.skeleton(clouds)
    assert np.allclose(restage.convert_joints(found, "makehuman", "smpl"), restage.skeleton(clouds, joints="smpl"))
    assert restage.Extractor().joint_definition == "makehuman"
