"""Arrays (NPY, NPZ) on the command line: AMASS motions, body models, scans."""
import io
import math
import struct
import zipfile

import test_data
from support import CliTest, points
from tiny_run import weights


def npy(shape, values, kind="<f8"):
    """An NPY file; bare Python, as numpy would write it."""
    if kind[1] == "U":
        body = "".join(values).encode("utf-32-le")
    else:
        body = struct.pack("<%d%s" % (len(values), {"f8": "d", "f4": "f", "i4": "i"}[kind[1:]]), *values)
    head = "{'descr': '%s', 'fortran_order': False, 'shape': %s, }" % (kind, tuple(shape))
    head += " " * (-(len(head) + 11) % 64) + "\n"
    return b"\x93NUMPY\x01\0" + struct.pack("<H", len(head)) + head.encode() + body


def npz(**arrays):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays.items():
            with archive.open(name + ".npy", "w", force_zip64=True) as member:  # as numpy.savez does
                member.write(array)
    return out.getvalue()


PARENTS = test_data.PARENTS + \
    [p for wrist, first in ((20, 22), (21, 37)) for f in range(5) for p in (wrist, first + 3 * f, first + 3 * f + 1)]
JOINTS = [(0, .95, 0), (.09, .88, 0), (-.09, .88, 0), (0, 1.06, 0), (.1, .48, .01), (-.1, .48, .01), (0, 1.2, 0),
          (.1, .08, -.02), (-.1, .08, -.02), (0, 1.27, .02), (.11, .02, .1), (-.11, .02, .1), (0, 1.47, -.02),
          (.07, 1.39, 0), (-.07, 1.39, 0), (0, 1.56, .03), (.18, 1.41, 0), (-.18, 1.41, 0), (.44, 1.41, 0),
          (-.44, 1.41, 0), (.7, 1.41, 0), (-.7, 1.41, 0)] + [(.8, 1.41, 0)] * 15 + [(-.8, 1.41, 0)] * 15


def smplh(size=1):
    n = len(JOINTS)
    eye = [float(i == j) for i in range(n) for j in range(n)]
    return npz(v_template=npy((n, 3), [size * x for p in JOINTS for x in p]), shapedirs=npy((n, 3, 2), [.01] * (6 * n)),
               J_regressor=npy((n, n), eye), weights=npy((n, n), eye), f=npy((1, 3), [0, 1, 2], "<i4"),
               kintree_table=npy((2, n), PARENTS + list(range(n)), "<i4"))


def clip(frames=61, rate="mocap_framerate"):
    poses = ([math.pi / 2] + [0.0] * 155) * frames
    return npz(poses=npy((frames, 156), poses), trans=npy((frames, 3), [0.0] * (3 * frames)), betas=npy((2,), [1.0, -1.0]),
               gender=npy((), ["male"], "<U4"), **{rate: npy((), [120.0])})


def cloud(frames, points=80):
    return npy((frames, points, 3), [math.sin(1.7 * i) for i in range(3 * frames * points)], "<f4")


class Arrays(CliTest):
    def test_amass(self):
        self.write("model.npz", smplh())
        self.write("amass/ann/walk_poses.npz", clip())
        self.write("amass/ben/run_stageii.npz", clip(121, "mocap_frame_rate"))
        self.write("amass/ben/shape.npz", npz(betas=npy((2,), [0.0, 0.0])))
        self.write("amass/ben/broken.npz", clip()[:-30])
        text = self.done("data", "import", "amass", "--body-model", "model.npz", "--out", "a.h5", "--verbose")
        for expected in ("2 motions, 47 frames", "SMPL-H, poses [61, 156]", "120 fps (mocap_frame_rate), 121 frames -> 30 fps, 31",
                         "2 of 2 betas", "left out 1 files that hold a shape", "skipped amass/ben/broken.npz"):
            self.assertIn(expected, text)
        text = self.done("data", "import", "amass", "--body-model", "model.npz", "--out", "a.h5")
        self.assertIn("amass/ann/walk_poses.npz: SMPL-H; model.npz; z up; 120 fps\n", text)
        found = self.json("data", "import", "amass", "--body-model", "model.npz", "--out", "b.h5")
        self.assertEqual((found["motions"], found["shapes"], len(found["skipped"])), (2, 1, 1))
        self.assertEqual([r["file"] for r in found["reports"]], ["amass/ann/walk_poses.npz", "amass/ben/run_stageii.npz"])
        self.assertEqual(found["reports"][0]["facts"]["gender"], "male")
        self.assertIn("remarks", found["reports"][0])
        self.assertEqual(self.bytes("a.h5"), self.bytes("b.h5"))
        self.assertEqual(self.json("data", "verify", "a.h5")["problems"], [])
        self.bad_input(["data", "import", "amass", "--out", "x.h5"], "amass", "--body-model")
        self.bad_input(["data", "import", "amass/ben/broken.npz", "--out", "x.h5"], "broken.npz")
        self.bad_input(["data", "import", "amass/ben/shape.npz", "--out", "x.h5"], "--betas")
        self.bad_input(["data", "import", "amass", "--body-model", "none.npz", "--out", "x.h5"], "none.npz")
        self.bad_input(["doctor", "amass/ann/walk_poses.npz"], "walk_poses.npz", "restage data import")

    def test_body_model(self):
        self.write("SMPLH_MALE.npz", smplh())
        self.write("ann.npz", npz(betas=npy((2,), [1.0, -1.0])))
        text = self.done("data", "import", "SMPLH_MALE.npz", "--betas", "zeros", "ann.npz", "--split", "test", "--out", "b.h5")
        self.assertIn("2 bodies", text)
        self.assertEqual(self.json("data", "inspect", "b.h5")["counts"]["bodies"], 2)
        self.assertEqual(self.json("data", "verify", "b.h5")["problems"], [])
        self.bad_input(["data", "import", "SMPLH_MALE.npz", "--betas", "none.npz", "--out", "x.h5"], "none.npz")
        for size in (10, 0.01):
            self.bad_input(["data", "import", self.write("big.npz", smplh(size)), "--out", "x.h5"], "big.npz", "no person's size")

    def test_a_body_model_that_is_none(self):
        self.write("a_poses.npz", clip())
        bad = lambda model, *words: self.bad_input(["data", "import", "a_poses.npz", "--body-model", model, "--out", "x.h5"], *words)
        bad(self.write("old/m.pkl", "x"), "old/m.pkl", "pickle", "docs/formats.md")
        bad("old", "old/m.pkl", "pickle", "docs/formats.md")
        self.write("broken/m.npz", smplh()[:-30])
        bad("broken", "holds no SMPL", "among 1 files, the first: broken/m.npz")
        self.write("model.npz", smplh())
        objects = npy((), ["x"], "<U1").replace(b"'<U1'", b"'|O' ")
        self.write("a_poses.npz", npz(poses=npy((3, 156), [0.0] * 468), trans=npy((3, 3), [0.0] * 9),
                                      betas=npy((1,), [0.0]), mocap_framerate=objects))
        bad("model.npz", "a_poses.npz:mocap_framerate", "--fps")

    def test_a_damaged_frame_is_held(self):
        for take in "abc":
            for f in (1, 2, 3):
                self.ply("tree/%s/%d.ply" % (take, f), points(80 + f, f))
        self.write("tree/b/2.ply", self.bytes("tree/b/2.ply")[:-9])
        found = self.json("data", "import", "tree", "--out", "t.h5")
        self.assertEqual((found["sequences"], found["frames"], len(found["reports"]), found["skipped"]), (3, 9, 3, []))
        remarks = " ".join(found["reports"][1]["remarks"])
        self.assertIn("1 frame could not be read and counts as a frame without points: tree/b/2.ply: is cut short", remarks)
        self.assertIn("1 frame shows too little", remarks)
        self.assertEqual(self.json("data", "verify", "t.h5")["problems"], [])
        self.assertEqual(self.json("data", "inspect", "t.h5")["counts"]["points"], 2 * (81 + 82 + 83) + 81 + 81 + 83)
        for f in (1, 2, 3):
            self.write("tree/b/%d.ply" % f, "x")
        found = self.json("data", "import", "tree", "--out", "t.h5")
        self.assertEqual((found["sequences"], len(found["skipped"])), (2, 1))
        self.assertIn("tree/b/1.ply: is not a PLY file", found["skipped"][0])
        self.bad_input(["data", "import", "tree/b", "--out", "x.h5"], "tree/b/1.ply: is not a PLY file")

    def test_scans(self):
        self.write("walk.npz", npz(points=cloud(7)))
        self.assertIn("1 scan sequences, 4 frames", self.done("data", "import", "walk.npz", "--fps", 60, "--out", "s.h5"))
        self.assertEqual(self.json("data", "inspect", "s.h5")["counts"]["frames"], 4)
        for f in (1, 2, 3):
            self.ply("scans/take1/%d.ply" % f, [(f, 0, 0)] + [(20 * (i % 9), 10 * i, 20 * i) for i in range(80)])
        found = self.json("data", "import", "scans", "--scale", 0.001, "--up", "z", "--out", "t.h5")
        self.assertEqual((found["sequences"], found["frames"]), (1, 3))
        self.assertIn("--scale", found["reports"][0]["facts"]["scale"])
        self.bad_input(["data", "import", "walk.npz", "--fps", 0.1, "--out", "x.h5"], "--fps")
        self.bad_input(["data", "import", self.write("o.npy", npy((2,), [1.0, 2.0])), "--out", "x.h5"], "o.npy", "[2]")

    def test_paths_are_no_scans(self):
        walk = npy((200, 3), [v for f in range(200) for v in (math.sin(.05 * f), .9 + .03 * math.sin(.3 * f), .025 * f)])
        self.write("walk.npy", walk)
        self.bad_input(["data", "import", "walk.npy", "--out", "x.h5"], "walk.npy", "one moving point", "--force")
        self.write("walk.npz", npz(root_pos=walk, gyro=walk))
        self.bad_input(["data", "import", "walk.npz", "--out", "x.h5"], "walk.npz", "holds no points", "root_pos")
        self.assertEqual(self.restage("doctor", "walk.npy").code, 1)
        self.assertIn("one moving point", self.restage("doctor", "walk.npy").out)
        self.done("data", "import", "walk.npy", "--force", "--out", "x.h5")

    def test_a_body_model_in_other_units(self):
        self.write("model.npz", smplh())
        poses, call = npy((61, 156), ([math.pi / 2] + [0.0] * 155) * 61), ["--body-model", "model.npz", "--out", "x.h5"]
        trans = lambda unit: npy((61, 3), [unit * v for f in range(61) for v in (.02 * f, 0, 0)])
        motion = lambda name, unit, **more: self.write(name, npz(
            poses=poses, trans=trans(unit), betas=npy((2,), [0.0, 0.0]), mocap_framerate=npy((), [60.0]), **more))
        motion("cm.npz", 100)
        self.bad_input(["data", "import", "cm.npz", *call], "cm.npz:trans", "--scale 0.01", "centimetres")
        self.done("data", "import", "cm.npz", "--scale", .01, *call)
        motion("aist.npz", 93, smpl_scaling=npy((1,), [93.0]))
        self.assertIn("divided by 93", self.done("data", "import", "aist.npz", *call, "--verbose"))
        self.write("half.npz", npz(root_orient=trans(1), trans=trans(1), betas=npy((2,), [0.0, 0.0])))
        self.bad_input(["data", "import", "half.npz", *call], "half.npz", "not of the other joints", "add pose_body")

    def test_retarget_reads_arrays(self):
        self.write("walk.npz", npz(points=cloud(2)))
        self.write("walk.npy", cloud(2))
        for name in ("walk.npz", "walk.npy"):
            found = self.json("skeleton", "--weights", weights("tiny"), "--source", name)
            self.assertEqual([f["source"] for f in found["frames"]], [name + ":0", name + ":1"])

    def test_memory_limit(self):
        self.write("bomb.npz", npz(points=npy((1, 300000, 3), [i / 180 for i in range(297)] * 3030 + [0.0] * 90)))
        self.bad_input(["data", "import", "bomb.npz", "--max-memory", "2MB", "--out", "x.h5"], "--max-memory")
        self.bad_input(["doctor", "bomb.npz", "--max-memory", "2MB"], "--max-memory")
        self.done("data", "import", "bomb.npz", "--max-memory", "8MB", "--out", "x.h5")
        for wrong in ("much", "-1", "4XB", "", "1e99GB", "10"):
            self.bad_input(["data", "import", "bomb.npz", "--max-memory=" + wrong, "--out", "y.h5"], "--max-memory")
