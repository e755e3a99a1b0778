"""What pose estimators write: pickles of CPython itself, archives, several people."""
import collections
import math
import os
import pickle
import zlib

from support import CliTest
from test_arrays import npy, npz, smplh
from test_gltf import character

FRAMES = 8


def turns(frame, flip=False):
    """66 numbers of somebody who stands y up (or as a camera sees it) and bends the knees."""
    out = [0.0] * 66
    out[0] = math.pi if flip else 0.0
    out[12] = out[15] = 0.2 + .05 * frame
    return out


def person(away=0.0, flip=False):
    sign = -1 if flip else 1
    return {"global_orient": [turns(f, flip)[:3] for f in range(FRAMES)],
            "body_pose": [turns(f)[3:] for f in range(FRAMES)],
            "transl": [(.02 * f + away, sign * .9, 0.0) for f in range(FRAMES)], "betas": [0.0, 0.0]}


class Harm:
    """A pickle that would make a file."""

    def __reduce__(self):
        return os.system, ("touch harm",)


class Estimators(CliTest):
    def setUp(self):
        super().setUp()
        self.write("model.npz", smplh())

    def test_a_motion_of_every_protocol(self):
        whole = collections.OrderedDict(smpl_params_incam=person(5, True), smpl_params_global=person())
        files = {"%d.pkl" % n: pickle.dumps(whole, n) for n in range(pickle.HIGHEST_PROTOCOL + 1)}
        files["packed.joblib"] = zlib.compress(files["3.pkl"])
        for name, content in files.items():
            self.write(name, content)
            found = self.json("data", "import", name, "--body-model", "model.npz", "--out", "m.h5")
            self.assertEqual((found["motions"], found["frames"]), (1, FRAMES), name)
            self.assertEqual(found["reports"][0]["facts"]["found in"], "smpl_params_global", name)
        self.assertEqual(self.json("data", "verify", "m.h5")["problems"], [])
        self.write("camera.pkl", pickle.dumps({"smpl_params_incam": person(5, True)}))
        self.assertIn("turned about x by 180 degrees", self.done("data", "import", "camera.pkl", "--out", "m.h5"))

    def test_people(self):
        self.write("two.pkl", pickle.dumps({3: person(), 7: person(2)}))
        self.assertEqual(self.json("data", "import", "two.pkl", "--out", "m.h5")["motions"], 2)
        self.assertEqual(self.json("data", "import", "two.pkl", "--person", "7", "--out", "m.h5")["motions"], 1)
        self.bad_input(["data", "import", "two.pkl", "--person", "5", "--out", "x.h5"], "two.pkl", "no person '5'", "--person")
        self.bad_input(["retarget", "--source", "two.pkl", "--target", self.hero(), "--out", "x.glb"],
                       "two.pkl", "holds 2 people", "--person '3'")
        self.done("retarget", "--source", "two.pkl", "--person", "3", "--target", self.hero(), "--out", "x.glb")
        self.done("retarget", "--source", "two.pkl", "--person", "3", "--body-model", "model.npz", "--target", self.hero(), "--out", "x.glb")
        self.bad_input(["data", "import", self.hero(), "--person", "3", "--out", "x.h5"], "leave --person out")

    def hero(self):
        character(self.path("hero.glb"))
        return "hero.glb"

    def test_nothing_is_run(self):
        self.write("harm.pkl", pickle.dumps({"poses": Harm()}))
        for command in (["data", "import", "harm.pkl", "--out", "x.h5"],
                        ["retarget", "--source", "harm.pkl", "--target", self.hero(), "--out", "x.glb"]):
            self.bad_input(command, "harm.pkl", "asks to run 'posix.system'", "numpy.savez")
        self.assertFalse(os.path.exists(self.path("harm")))

    def test_what_is_no_motion_is_named(self):
        bad = lambda name, content, *words: self.bad_input(["data", "import", self.write(name, content), "--out", "x.h5"], name, *words)
        bad("a.pkl", pickle.dumps({"scores": [1, 2], "who": "ann"}), "it holds 'scores' (a list of 2), 'who'", "numpy.savez")
        bad("a.pkl", pickle.dumps({"x": 1})[:-2], "is a damaged pickle")
        bad("a.pt", pickle.dumps({}), "is a file of torch.save", "torch.load")
        bad("a.r3d", b"PK\3\4" + bytes(600), "Record3D")
        bad("a.npz", npz(depth=npy((8, 9), [1.0] * 72), intrinsics=npy((3, 3), [1.0] * 9)), "is 9 x 8, but the camera")
