"""Files of other makes that real users brought, from the shared cases: clouds, folders of frames, arrays, HDF5 sequences,
ASF/AMC, motions of body models. Each is read right, or refused in one line that says what to do."""
import json
import os

from cases import CaseTest, WEIGHTS

IMPORT = ("data", "import")


class DataCases(CaseTest):
    def imported(self, source, **counts):
        """`data import SOURCE` gives these counts; all that was remarked."""
        found = self.json(*IMPORT, source, "--out", "out.h5")
        for key, count in counts.items():
            self.assertEqual(found[key], count, (source, key))
        return "\n".join(remark for report in found["reports"] for remark in report["remarks"])

    def points(self, source, count):
        """SOURCE is one cloud of so many points."""
        self.imported(source, frames=1)
        self.assertEqual(self.json("data", "inspect", "out.h5")["counts"]["points"], count)

    def retargeted(self, *options, frames):
        """`retarget` of src/ makes so many frames; what it said."""
        done = self.restage("retarget", "--source", "src", "--target", "target.ply", "--weights", WEIGHTS, "--out", "out.h5", *options)
        self.assertEqual(done.code, 0, done.err)
        self.assertEqual(self.json("data", "inspect", "out.h5")["counts"]["frames"], frames)
        return done.err

    # ---- recordings and motions of body models ----

    def test_m03_dof_l(self):
        for case in ("m03_dof_l", "m03b_dof_tx"):
            with self.subTest(case):
                self.enter(case)
                self.expect_true([*IMPORT, "01_01.amc", "--fps", "30", "--out", "out.h5"], 12)

    def test_m05b_every_4th(self):
        self.enter("m05b_every_4th")
        self.expect_true([*IMPORT, "01_01.amc", "--fps", "30", "--out", "out.h5"], 12)
        self.assertIn("one in 4", self.done(*IMPORT, "01_01.amc", "--fps", "30", "--out", "out.h5"))

    def test_a01_split(self):
        self.enter("a01_split")
        self.expect_true([*IMPORT, "split.npz", "--body-model", "models", "--out", "out.h5"], 3)

    def test_a01_p72(self):
        self.enter("a01_p72")
        self.expect_true([*IMPORT, "p72.npz", "--body-model", "models", "--out", "out.h5"], 3)

    def test_a01_romp(self):
        self.enter("a01_romp")
        self.expect_true([*IMPORT, "romp.npz", "--body-model", "models", "--out", "out.h5"], 3)
        self.bad_input([*IMPORT, "romp.npz", "--out", "other.h5"], "romp.npz", "--body-model")

    def test_x01_npz_taken_for_cloud(self):
        self.enter("x01_npz_taken_for_cloud")
        self.bad_input([*IMPORT, "params.npz", "--out", "out.h5"], "params.npz", "motion", "--body-model")

    # ---- other kinds of files ----

    def test_t04_fbx(self):
        self.enter("t04_fbx")
        self.bad_input([*IMPORT, "walk.fbx", "--out", "out.h5"], "walk.fbx", "FBX", "Blender", "GLB")

    def test_p10_bvh_source(self):
        self.enter("p10_bvh_source")
        self.done("retarget", "--source", "walk.bvh", "--target", "target.ply", "--weights", WEIGHTS, "--out", "out.h5")
        self.assertEqual(self.json("data", "inspect", "out.h5")["counts"]["frames"], 3)

    def test_y01_obj(self):
        self.enter("y01_obj")
        self.bad_input([*IMPORT, "a.obj", "--out", "out.h5"], "a.obj:1", "comma")

    # ---- clouds ----

    def test_p01_minus_y(self):
        """Axis and unit are told; the result is that of the same points upright and in metres."""
        self.enter("p01_minus_y")
        self.retargeted("--scale", "0.001", "--source-up", "-y", frames=4)
        told = self.bytes("out.h5")
        for name in sorted(os.listdir(self.path("src"))):
            with open(self.path("src/" + name)) as f:
                head, _, body = f.read().partition("end_header\n")
            rows = [[float(x) for x in line.split()[:3]] for line in body.splitlines()]
            text = "".join("%r %r %r\n" % (0.001 * x, -0.001 * y, -0.001 * z) for x, y, z in rows)
            self.write("src/" + name, head + "end_header\n" + text)
        self.retargeted(frames=4)
        upright = self.bytes("out.h5")
        self.write("told.h5", told)
        self.write("upright.h5", upright)
        found = self.json("eval", "--pred", "told.h5", "--truth", "upright.h5")
        self.assertLess(found["mean"]["mpjpe"], 0.002)

    def test_p03_one(self):
        self.enter("p03_one")
        self.points("one.obj", 80)

    def test_p04_columns_and_text(self):
        for case, name in (("p04_npy6", "a.npy"), ("p04_xyz", "a.xyz")):
            with self.subTest(case):
                self.enter(case)
                self.points(name, 80)

    def test_p07_dfaust(self):
        self.enter("p07_dfaust")
        self.assertIn("[points, xyz, frames]", self.imported("registrations_m.hdf5", frames=4, sequences=1))

    # ---- folders ----

    def test_p05_both(self):
        self.enter("p05_both")
        self.assertIn("left out 8 .obj files", self.imported("src", frames=8, sequences=1))

    def test_p05_nested(self):
        self.enter("p05_nested")
        self.assertIn("a folder a frame", self.imported("src", frames=8, sequences=1))

    def test_p05_stamp(self):
        self.enter("p05_stamp")
        self.imported("src", frames=8, sequences=1)
        # Each of the test's frames is a step further on: their order is that of time.
        found = json.loads(self.restage("doctor", "src", "--json").out)  # 80 points show nobody
        self.assertEqual(found["facts"]["frames"], 8)
        self.assertFalse([f for f in found["findings"] if f["topic"] in ("missing frames", "repeated frames")], found["findings"])

    # ---- points and frames that are not there ----

    def test_p06_nan(self):
        self.enter("p06_nan")
        self.assertIn("NaN or infinite", self.imported("src", frames=3))
        self.assertIn("NaN or infinite", self.retargeted(frames=3))

    def test_p06b_nan_msvc(self):
        self.enter("p06b_nan_msvc")
        self.assertIn("NaN or infinite", self.imported("src", frames=3))
        self.assertIn("NaN or infinite", self.done("doctor", "src", "--fix", "out.h5"))
        self.assertEqual(self.json("data", "verify", "out.h5")["problems"], [])

    def test_p08_empty_frame(self):
        self.enter("p08_empty_frame")
        found = self.json("doctor", "src", "--fix", "out.h5")
        self.assertIn("1 frame without any point", " ".join(found["notes"]))
        self.assertEqual(self.json("data", "inspect", "out.h5")["counts"]["frames"], 4)
        self.assertIn("1 frame shows too little", self.imported("src", frames=4))
