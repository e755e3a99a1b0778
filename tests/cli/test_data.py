"""restage data."""
import lzma
import os

from support import CliTest, numbers, small_disk


JOINTS = """pelvis left_hip right_hip spine1 left_knee right_knee spine2 left_ankle right_ankle spine3 left_foot right_foot neck
left_collar right_collar head left_shoulder right_shoulder left_elbow right_elbow left_wrist right_wrist""".split()
NAMES = """Hips LeftUpLeg RightUpLeg Spine LeftLeg RightLeg Spine1 LeftFoot RightFoot Spine2 LeftToeBase RightToeBase Neck
LeftShoulder RightShoulder Head LeftArm RightArm LeftForeArm RightForeArm LeftHand RightHand""".split()
PARENTS = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19]
OFFSETS = [(0, 95, 0), (9, -5, 0), (-9, -5, 0), (0, 10, 0), (0, -41, 0), (0, -41, 0), (0, 12, 0), (0, -42, 0), (0, -42, 0), (0, 12, 0),
           (0, -6, 14), (0, -6, 14), (0, 15, 0), (5, 10, 0), (-5, 10, 0), (0, 10, 2), (13, 0, 0), (-13, 0, 0), (27, 0, 0), (-27, 0, 0),
           (25, 0, 0), (-25, 0, 0)]


def toy_bvh(frames=5):
    """A T-pose that walks ahead: Mixamo names, centimetres, 60 frames a second."""
    def joint(j):
        text = ("ROOT" if j == 0 else "JOINT") + " mixamorig:%s\n{\nOFFSET %g %g %g\n" % (NAMES[j], *OFFSETS[j])
        text += "CHANNELS 6 Xposition Yposition Zposition" if j == 0 else "CHANNELS 3"
        text += " Zrotation Xrotation Yrotation\n"
        children = [joint(k) for k in range(len(PARENTS)) if PARENTS[k] == j]
        return text + ("".join(children) or "End Site\n{\nOFFSET 0 5 0\n}\n") + "}\n"
    motion = "".join("0 95 %g" % f + " 0" * 66 + "\n" for f in range(frames))
    return "HIERARCHY\n%sMOTION\nFrames: %d\nFrame Time: 0.0166667\n%s" % (joint(0), frames, motion)


class Data(CliTest):
    def test_build_inspect_verify(self):
        for name, seed, threads in (("a.h5", 3, 1), ("b.h5", 3, 2), ("c.h5", 4, 3)):
            self.done("data", "build", "--bodies", 1, 0, 1, "--motions", 1, 1, 0, "--seed", seed, "--threads", threads, "--out", name)
        content = {name: self.bytes(name) for name in ("a.h5", "b.h5", "c.h5")}
        self.assertEqual(content["a.h5"], content["b.h5"], "same seed, same bits for any number of threads")
        self.assertNotEqual(content["a.h5"], content["c.h5"])
        found = self.json("data", "inspect", "a.h5")
        self.assertEqual(found["counts"]["bodies"], 2)
        self.assertEqual(found["counts"]["motions"], 2)
        self.assertEqual(found["units"], "metres")
        self.assertEqual(found["license"], "CC0-1.0")
        self.assertEqual(found["splits"]["train"], {"bodies": 1, "motions": 1, "frames": found["splits"]["train"]["frames"]})
        self.assertAlmostEqual(found["seconds"], found["counts"]["frames"] / 30)
        self.assertTrue(1.4 < found["heights"]["least"] <= found["heights"]["most"] < 2.1, found["heights"])
        self.assertEqual(sum(found["actions"].values()), 2)
        text = self.done("data", "inspect", "a.h5", "--plot", "sheet.png")
        for words in ("kind        dataset", "heights", "validation", "sheet.png"):
            self.assertIn(words, text)
        self.assertEqual(self.bytes("sheet.png")[:8], b"\x89PNG\r\n\x1a\n")
        self.bad_input(["data", "inspect", "a.h5", "--plot", "sheet.jpg"], "sheet.jpg")
        self.assertEqual(self.json("data", "verify", "a.h5")["problems"], [])
        self.assertIn("bodies", self.done("doctor", "a.h5"))

    def test_verify_finds_damage(self):
        self.h5("bad.h5", joints=([2, 22, 3], numbers(131, 1) + ["inf"]))
        result = self.restage("data", "verify", "bad.h5")
        self.assertEqual((result.code, result.err), (1, ""))
        self.assertIn("bad.h5:/joints", result.out)

    def test_inspect_looks_into_what_others_made(self):
        self.write("walk.bvh", toy_bvh())
        text = self.done("data", "inspect", "walk.bvh", "--plot", "walk.png")
        for words in ("Mixamo (profile mixamo)", "kind        motions", "walk.png"):
            self.assertIn(words, text)
        found = self.json("data", "inspect", "walk.bvh")
        self.assertEqual((found["kind"], found["counts"]["motions"]), ("motions", 1))
        self.assertEqual(found["reports"][0]["file"], "walk.bvh")
        self.assertEqual(sorted(os.listdir(self.folder)), ["walk.bvh", "walk.png"])
        self.write("cut.bvh", toy_bvh()[:600])
        self.bad_input(["data", "inspect", "cut.bvh"], "cut.bvh")
        self.write("built/manifest.json", "{}")
        self.bad_input(["data", "inspect", "built"], "data verify")
        self.write("words.txt", "hello")
        self.bad_input(["data", "inspect", "words.txt"], "HDF5")

    def test_import_reports_what_was_found(self):
        self.write("walk.bvh", toy_bvh())
        text = self.done("data", "import", "walk.bvh", "--out", "walk.h5")
        for words in ("Mixamo (profile mixamo)", "centimetres, by the legs", "y, by the rest pose",
                      "60 fps -> 30 fps, slerp: 5 frames -> 3", "zero rotations"):
            self.assertIn(words, text)
        document = self.json("data", "import", "walk.bvh", "--fps", 30, "--subject", "ann", "--out", "walk.h5")
        self.assertEqual(document["frames"], 5)
        self.assertEqual([r["file"] for r in document["reports"]], ["walk.bvh"])
        self.assertIn("as they are", document["reports"][0]["facts"]["rate"])
        os.makedirs(self.path("many"))
        for name in ("1.bvh", "2.bvh"):
            self.write("many/" + name, toy_bvh())
        lines = self.done("data", "import", "many", "--out", "many.h5").splitlines()
        self.assertEqual(len(lines), 3, lines)
        self.assertTrue(lines[0].startswith("many/1.bvh: Mixamo"), lines[0])
        self.assertIn("rest pose", self.done("data", "import", "many", "--verbose", "--out", "many.h5"))

    def test_import_of_a_folder_skips_and_lists(self):
        self.write("many/a.bvh", toy_bvh())
        self.write("many/a.bvh.xz", lzma.compress(toy_bvh().encode()))
        self.write("many/b.bvh", "HIERARCHY")
        call = ["data", "import", "many", "--out", "many.h5"]
        result = self.restage(*call)
        self.assertEqual((result.code, result.err), (0, ""))
        self.assertIn("skipped many/a.bvh.xz: its motion 'a' has the name of one in many/a.bvh;", result.out)
        self.assertIn("skipped many/b.bvh", result.out)
        self.assertEqual(self.json("data", "inspect", "many.h5")["counts"]["motions"], 1)
        os.remove(self.path("many.h5"))
        self.write("bad/1.bvh", "HIERARCHY")
        self.write("bad/2.bvh", "HIERARCHY")
        self.bad_input(["data", "import", "bad", "--out", "x.h5"], "bad: all 2 files were skipped, the first: bad/1.bvh")
        self.bad_input(call + ["--facing", "y"], "all 3 files were skipped, the first: many/a.bvh: stands along", "--facing")
        # Options that no file can make right are not the files' fault.
        self.bad_input(call + ["--facing", "y", "--up=-y"], "--facing lies along --up")
        self.bad_input(call + ["--split", "nope"], "--split 'nope'", "validation")
        self.bad_input(call + ["--asf", "none.asf"], "--asf")
        self.bad_input(["data", "import", "", "--out", "x.h5"], "--source is empty")

    def test_import_with_a_profile(self):
        suit = toy_bvh()
        for joint, name in zip(JOINTS, NAMES):
            suit = suit.replace("mixamorig:%s\n" % name, "b %d\n" % JOINTS.index(joint))
        self.write("suit.bvh", suit)
        self.bad_input(["data", "import", "suit.bvh", "--out", "x.h5"], "suit.bvh", "--bones")
        self.bad_input(["data", "import", "suit.bvh", "--bones", "miximo", "--out", "x.h5"], "did you mean 'mixamo'?")
        self.bad_input(["data", "import", "suit.bvh", "--bones", "none.yaml", "--out", "x.h5"], "none.yaml")
        self.bad_input(["data", "import", "suit.bvh", "--up", "north", "--out", "x.h5"], "--up", "north")
        self.bad_input(["data", "import", "suit.bvh", "--fps", "nan", "--out", "x.h5"], "--fps")
        profile = "title: Suit\njoints:\n" + "".join("  %s: b_%d\n" % (joint, j) for j, joint in enumerate(JOINTS))
        self.write("suit.yaml", profile)
        self.assertIn("Suit (profile suit)", self.done("data", "import", "suit.bvh", "--bones", "suit.yaml", "--out", "s.h5"))
        self.write("suit.YML", profile)
        old = self.done("data", "import", "suit.bvh", "--profile", "suit.YML", "--out", "s.h5")  # the option's older name
        self.assertIn("Suit (profile suit)", old)
        self.write("bad.yaml", profile.replace("  head:", "  heed:"))
        self.bad_input(["data", "import", "suit.bvh", "--bones", "bad.yaml", "--out", "x.h5"], "bad.yaml:", "'head'")

    def test_merge(self):
        self.done("data", "build", "--bodies", 1, 0, 0, "--motions", 0, 0, 0, "--out", "bodies.h5")
        self.write("walk.bvh", toy_bvh())
        self.done("data", "import", "walk.bvh", "--license", "mine", "--out", "walk.h5")
        merged = self.json("data", "merge", "bodies.h5", "walk.h5", "--out", "all.h5")
        self.assertEqual((merged["bodies"], merged["motions"]), (1, 1))
        found = self.json("data", "inspect", "all.h5")
        self.assertEqual(found["kind"], "dataset")
        self.assertEqual(found["license"], "CC0-1.0; mine")
        self.bad_input(["data", "merge", "walk.h5", "all.h5", "--out", "x.h5"], "'walk'", "--prefix")
        self.done("data", "merge", "walk.h5", "all.h5", "--prefix", "--out", "both.h5")
        self.assertEqual(self.json("data", "inspect", "both.h5")["counts"]["motions"], 2)
        self.assertEqual(self.json("data", "verify", "both.h5")["problems"], [])
        self.bad_input(["data", "merge", "walk.h5", "--out", "x.h5"], "two or more")

    def test_bad_input(self):
        self.bad_input(["data", "inspect", "none.h5"], "none.h5")
        self.bad_input(["data", "inspect", self.h5("else.h5", other=([3], [1.0]))], "else.h5")
        self.bad_input(["data", "inspect", self.h5("new.h5", {"restage_schema": 99}, joints=([1, 22, 3], [0.0]))], "version")
        self.bad_input(["data", "verify", self.write("text.h5", "text")], "text.h5")
        self.bad_input(["data", "build", "--out", "x.h5", "--bodies", 1, 2], "--bodies")
        self.bad_input(["data", "build", "--out", "x.h5", "--bodies", -1, 0, 0], "--bodies")
        self.bad_input(["data", "build", "--out", "nowhere/x.h5", "--bodies", 1, 0, 0], "nowhere")
        self.bad_input(["data", "import", "nothing", "--out", "x.h5"], "nothing")

    def test_a_list_of_values_that_takes_the_file(self):
        self.write("clips.h5", b"")
        for words in (["import", "--without", "ShovelHand", "clips.h5"], ["import", "--betas", "zeros", "clips.h5"],
                      ["split", "--shares", "8", "1", "1", "clips.h5"], ["split", "--only", "ann", "clips.h5"]):
            self.bad_input(["data", *words, "--out", "o.h5"], words[1] + " takes several values, and took 'clips.h5' for one of them",
                           "put 'clips.h5' before " + words[1])
        self.bad_input(["data", "import", "--without", "A", "B", "--out", "o.h5"], "--source is required")

    def test_no_more_frames_are_performed_than_a_motion_has(self):
        self.done("data", "build", "--bodies", 1, 0, 0, "--motions", 1, 0, 0, "--quiet", "--out", "data.h5")
        call = ["data", "perform", "--bodies", "data.h5", "--out", "walk"]
        self.bad_input([*call, "--frames", 99999], "frames", "--first and --frames")
        self.bad_input([*call, "--first", 1, "--frames", 99999], "frames", "--first and --frames")
        self.assertFalse(os.path.exists(self.path("walk")))

    def test_full_disk(self):
        result = self.restage("data", "build", "--bodies", 1, 0, 0, "--motions", 0, 0, 0, "--quiet", "--out", "x.h5", before=small_disk)
        self.one_line(result, 1, "x.h5")
        self.assertEqual(os.listdir(self.folder), [])
