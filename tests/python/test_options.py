"""Options as Python's signatures and stubs show them, and what is refused in Python as on the command line."""
import inspect
import json
import pathlib
import subprocess
import warnings

import numpy as np
import pytest
import restage

from conftest import PROGRAM


def two_sequences(path):
    """An HDF5 file of one cloud, and of two."""
    clouds = np.random.default_rng(0).normal(size=(3, 300, 3)) * [0.2, 0.5, 0.1] + [0, 1, 0]
    sets = {"/vertices": {"type": "float32", "shape": [3, 300, 3], "values": clouds.ravel().tolist()},
            "/sequence_offset": {"type": "int64", "shape": [3], "values": [0, 1, 3]}}
    make = pathlib.Path(PROGRAM).parent / "tests" / "make_h5"
    subprocess.run([make, path], input=json.dumps({"datasets": sets, "attributes": {}}), text=True, check=True)
    return clouds.astype(np.float32)


def test_several_sequences_are_not_joined(tmp_path):
    clouds = two_sequences(tmp_path / "two.h5")
    for call in (restage.load_clouds, restage.skeleton):
        with pytest.raises(restage.InputError, match="two.h5: holds 2 sequences; choose one with"):
            call(tmp_path / "two.h5")
    assert [c.tolist() for c in restage.load_clouds(tmp_path / "two.h5", sequence=1)] == clouds[1:].tolist()
    assert restage.skeleton(tmp_path / "two.h5", sequence=1).shape == (2, 22, 3)
    with pytest.raises(restage.InputError, match="'sequence' .* no file is named"):
        restage.skeleton(clouds[0], sequence=1)


def test_arrays_are_no_file_that_somebody_named(walk):
    for option in ({"out_fps": 24}, {"clip_name": "Walk"}, {"format": "ply"}, {"animation_only": True}, {"skeleton": "vrm"}):
        with pytest.raises(restage.InputError, match="^restage: the result: ") as error:
            restage.retarget(walk / "source.h5", walk / "target.ply", **option)
        assert "arrays" not in str(error.value)


def test_signatures_are_the_programs_options():
    shown = inspect.signature(restage.retarget).parameters
    assert list(shown)[:4] == ["source", "target", "weights", "out"]
    assert shown["source"].default is inspect.Parameter.empty
    for name, default in {"samples": 4, "anchor": 0.25, "out_fps": 30.0, "system": "chain", "foot_lock": True, "online": False, "force": False,
                          "bones": None, "seed": 0}.items():
        assert shown[name].default == default and type(shown[name].default) is type(default), name
        assert shown[name].kind is inspect.Parameter.KEYWORD_ONLY
    assert not {"json", "quiet", "help", "threads"} & set(shown)
    shown = inspect.signature(restage.System).parameters
    assert list(shown)[:2] == ["target", "weights"]
    assert shown["online"].default is True and "out" not in shown
    page = subprocess.run([PROGRAM, "retarget", "--help"], capture_output=True, text=True, check=True).stdout
    for name in inspect.signature(restage.retarget).parameters:
        assert "--%s" % name.replace("_", "-") in page or "--no-%s" % name.replace("_", "-") in page, name


def test_online_means_the_same_in_both(walk):
    clouds = restage.load_clouds(walk / "source.h5")
    for online in (True, False):
        result = restage.retarget(clouds, walk / "target.ply", online=online)
        system = restage.System(walk / "target.ply", online=online)
        frames = [frame for cloud in clouds for frame in system.push_all(cloud)] + system.finish()
        assert np.array_equal(np.stack([frame.joints for frame in frames]), result.joints)
    with pytest.warns(DeprecationWarning, match="--late of 'restage retarget' is called --no-online now"):
        late = restage.System(walk / "target.ply", late=True)
    assert late.push_all(clouds[0]) == []
    assert len(restage.System(walk / "target.ply", late=False).push_all(clouds[0])) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(restage.System(walk / "target.ply").push_all(clouds[0])) == 1
