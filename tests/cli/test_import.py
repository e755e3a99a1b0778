"""restage data import: what is found in recordings is told, what does not fit is refused, nothing is ignored."""
import os
import re
import subprocess

from support import CliTest, DATA, needs_data
from test_data import JOINTS, NAMES, toy_bvh

RESTS = " 0" * 66
SAMPLES = os.path.join(os.path.dirname(os.environ["RESTAGE_MAKE_H5"]), "make_samples")


def frames(motion, seconds="0.0333333"):
    """toy_bvh() with these lines of 69 values as its frames."""
    head = toy_bvh(1).split("MOTION")[0]
    return head + "MOTION\nFrames: %d\nFrame Time: %s\n%s\n" % (len(motion), seconds, "\n".join(motion))


def exchanged(text):
    return text.replace("Left", "#").replace("Right", "Left").replace("#", "Right")


def biped(name):
    """3ds Max's names; a BVH file cannot hold the blanks."""
    side = {"L": "L_", "R": "R_"}.get(name[0] if name.startswith(("Left", "Right")) else "", "")
    part = name.replace("Left", "").replace("Right", "")
    parts = {"Hips": "Pelvis", "UpLeg": "Thigh", "Leg": "Calf", "Foot": "Foot", "ToeBase": "Toe0", "Shoulder": "Clavicle",
             "Arm": "UpperArm", "ForeArm": "Forearm", "Hand": "Hand"}
    return "Bip01_" + side + parts.get(part, part)


def rigify(name):
    parts = {"Hips": "spine", "Spine": "spine.001", "Spine1": "spine.002", "Spine2": "spine.003", "Neck": "spine.004",
             "Head": "spine.006", "UpLeg": "thigh", "Leg": "shin", "Foot": "foot", "ToeBase": "toe", "Shoulder": "shoulder",
             "Arm": "upper_arm", "ForeArm": "forearm", "Hand": "hand"}
    end = ".L" if name.startswith("Left") else ".R" if name.startswith("Right") else ""
    return "DEF-" + parts[name.replace("Left", "").replace("Right", "")] + end


class Import(CliTest):
    def imported(self, name, text, *options):
        """The report of one file, and how many frames came of it."""
        self.write(name, text)
        found = self.json("data", "import", name, "--out", "out.h5", *options)
        return found["reports"][0], found["frames"]

    def test_only_the_daz_release_begins_with_what_is_no_recording(self):
        # From the rest pose into an arm's turn, as anybody may begin: 6 degrees a frame.
        slow = ["0 95 %d" % f + " 0" * 36 + " %d 0 0" % min(6 * f, 80) + " 0" * 27 for f in range(60)]
        report, count = self.imported("arm.bvh", frames(slow))
        self.assertEqual(count, 60)
        self.assertNotIn("beginning", report["facts"])
        names = dict(zip(NAMES, "hip lThigh rThigh abdomen lShin rShin - lFoot rFoot chest lToe rToe neck lCollar rCollar head "
                                "lShldr rShldr lForeArm rForeArm lHand rHand".split()))
        def daz(text):
            for name in sorted(names, key=len, reverse=True):
                text = text.replace("mixamorig:%s\n" % name, names[name] + "\n")
            # These figures have no bone between abdomen and chest: its lines, a brace of those that end the trunk, its three zeros.
            text = re.sub(r"JOINT -\n\{\nOFFSET.*\nCHANNELS.*\n", "", text).replace("}\nMOTION", "MOTION")
            return re.sub(r"(?m)^(0 95 \d+)( 0){36}", r"\1" + " 0" * 33, text)
        blend = ["0 95 %d" % f + " 0" * 36 + " %d 0 0" % min(20 * f, 80) + " 0" * 27 for f in range(60)]
        report, count = self.imported("daz.bvh", daz(frames(blend)))
        self.assertEqual(count, 49)
        self.assertIn("11 frames left out", report["facts"]["beginning"])
        self.assertEqual(self.imported("daz.bvh", daz(frames(blend)), "--drop-leading", 0)[1], 60)
        self.assertEqual(self.imported("daz.bvh", daz(frames(slow)))[1], 60, "a Daz figure that moves like a person")
        self.assertEqual(self.imported("arm.bvh", frames(slow), "--drop-leading", 20)[1], 40)
        os.makedirs(self.path("many"))
        for name in ("1.bvh", "2.bvh"):
            self.write("many/" + name, daz(frames(blend)))
        self.assertEqual(self.done("data", "import", "many", "--out", "out.h5").count("11 frames left out"), 2)

    def test_mirrored_recordings_are_refused(self):
        self.write("m.bvh", exchanged(toy_bvh()))
        self.bad_input(["data", "import", "m.bvh", "--out", "x.h5"], "m.bvh", "left and right are exchanged", "--force")
        report, _ = self.imported("m.bvh", exchanged(toy_bvh()), "--force")
        self.assertIn("left and right are exchanged", report["remarks"][-1])
        self.assertEqual(self.restage("doctor", "m.bvh").code, 1)
        self.write("in/m.bvh", exchanged(toy_bvh()))
        self.write("in/walk.bvh", toy_bvh())
        found = self.json("data", "import", "in", "--out", "out.h5")
        self.assertEqual((found["motions"], len(found["skipped"])), (1, 1))
        self.assertIn("left and right are exchanged", found["skipped"][0])

    def test_position_channels_of_bones(self):
        six = toy_bvh(1).replace("CHANNELS 3", "CHANNELS 6 Xposition Yposition Zposition").split("MOTION")[0]
        places = [line.split()[1:] for line in six.splitlines() if line.startswith("OFFSET")]
        names = [line.split()[0] for line in six.splitlines() if line.startswith(("OFFSET", "End"))]
        bones = [p for i, p in enumerate(places) if i > 0 and tuple(p) != ("0", "5", "0")]
        self.assertEqual(len(bones), 21, names)
        def moved(factor, stretch):
            rows = []
            for f in range(4):
                row = "0 95 0 0 0 0"
                for bone in bones:
                    row += "".join(" %g" % (factor * (1 + stretch * (-1) ** f) * float(x)) for x in bone) + " 0 0 0"
                rows.append(row)
            return six + "MOTION\nFrames: 4\nFrame Time: 0.0333333\n" + "\n".join(rows) + "\n"
        leg = lambda report: report["facts"]["units"].split(" is ")[1]
        report, _ = self.imported("same.bvh", moved(1, 0))
        self.assertNotIn("offsets", report["facts"])
        self.assertEqual((leg(report), report["remarks"]), ("0.83 m", []))
        report, _ = self.imported("true.bvh", moved(1.2, 0))
        self.assertIn("position channels of 21 joints", report["facts"]["offsets"])
        self.assertEqual((leg(report), report["remarks"]), ("1.00 m", []))
        report, _ = self.imported("delta.bvh", moved(0, 0))
        self.assertEqual(leg(report), "0.83 m", "all zero: counted from OFFSET")
        report, _ = self.imported("rubber.bvh", moved(1, 0.1))
        self.assertEqual(leg(report), "0.83 m")
        self.assertIn("0.042 m from its mean place", report["remarks"][0])

    def test_options_that_do_not_apply_are_refused(self):
        self.write("walk.bvh", toy_bvh())
        for option, value in (("--clip", "walk"), ("--garment", "shirt"), ("--body-model", "m.npz"), ("--asf", "a.asf"),
                              ("--betas", "zeros")):
            self.bad_input(["data", "import", "walk.bvh", "--out", "x.h5", option, value], "walk.bvh", option, "leave " + option)
        self.ply("scan.ply", [(0, i / 50, 0) for i in range(99)])
        for option, value in (("--facing", "z"), ("--bones", "mixamo"), ("--rest-frame", 0), ("--subject", "ann")):
            self.bad_input(["data", "import", "scan.ply", "--out", "x.h5", option, value], "scan.ply", option)
        for option, value in (("--scale", 0), ("--scale", -1), ("--fps", 0), ("--fps", -30), ("--rest-frame", -5),
                              ("--drop-leading", -1)):
            self.bad_input(["data", "import", "walk.bvh", "--out", "x.h5", option, value], option)

    def test_folders_below_and_what_is_ignored(self):
        self.write("style/aero/walk.bvh", toy_bvh())
        self.write("style/angry/walk.bvh", toy_bvh())
        self.write("style/angry/run.bvh", toy_bvh())
        self.write("style/readme.txt", "hello")
        self.write("style/angry/more.npz", "hello")
        found = self.json("data", "import", "style", "--out", "out.h5")
        self.assertEqual((found["motions"], found["skipped"], found["ignored"]), (3, [], {".npz": 1, ".txt": 1}))
        self.assertEqual(sorted(self.json("data", "inspect", "out.h5")["subjects"]), ["aero_walk", "angry_walk", "run"])
        self.assertIn("ignored 2 files of other kinds: 1 .npz, 1 .txt", self.done("data", "import", "style", "--out", "out.h5"))

    def test_rounded_frame_times_are_usual_rates(self):
        for seconds, fps in (("0.0333", 30), ("0.033", 30), ("0.0083", 120), ("0.0166", 60), ("0.042", 24), ("0.04", 25),
                             ("8.3e-3", 120), ("0.008", 125), ("0.033367", 29.97)):
            report, _ = self.imported("r.bvh", frames(["0 95 0" + RESTS] * 90, seconds))
            self.assertTrue(report["facts"]["rate"].startswith("%.4g fps" % fps) or fps == 30 or fps == 29.97, (seconds, report["facts"]))
            self.assertEqual("rounded" in report["facts"]["rate"], seconds in ("0.0333", "0.033", "0.0083", "0.0166", "0.042", "8.3e-3"),
                             (seconds, report["facts"]))
        self.assertEqual(self.imported("r.bvh", frames(["0 95 0" + RESTS] * 90, "0.0333"))[1], 90)

    def test_texts_as_programs_write_them(self):
        plain = toy_bvh()
        expected = self.imported("plain.bvh", plain)[1]
        same = self.bytes("out.h5").replace(b"plain", b"other")
        texts = {"mark": b"\xef\xbb\xbf" + plain.encode(), "cr": plain.replace("\n", "\r").encode(),
                 "crlf": plain.replace("\n", "\r\n").encode(), "end": plain.encode() + b"\x1a", "nul": plain.encode() + b"\0\0 \n\0",
                 "colon": plain.replace("Frames:", "Frames :").replace("Time:", "Time :").encode(),
                 "comma": plain.replace(" 0 0 0", ", 0,0 ,0").encode()}
        for name, text in texts.items():
            self.assertEqual(self.imported("other.bvh", text)[1], expected, name)
            self.assertEqual(len(self.bytes("out.h5")), len(same), name)
        self.bad_input(["data", "import", self.write("u.bvh", plain.encode("utf-16")), "--out", "x.h5"], "u.bvh", "UTF-16")
        self.bad_input(["data", "import", self.write("empty.bvh", ""), "--out", "x.h5"], "empty.bvh: is empty")
        head, motion = plain.split("\n0 95", 1)
        self.bad_input(["data", "import", self.write("d.bvh", head + "\n" + ("0 95" + motion).replace(" ", ",0 ").replace("\n", ",0\n")),
                        "--out", "x.h5"], "d.bvh:", "not with commas")
        self.bad_input(["data", "import", self.write("d.bvh", plain.replace("OFFSET 9 -5 0", "OFFSET 9,5 -5,1 0,0")), "--out", "x.h5"],
                       "d.bvh:", "decimal points")

    def test_names_of_biped_and_rigify(self):
        for family, rename in (("biped", biped), ("rigify", rigify)):
            text = toy_bvh()
            for name in NAMES:
                text = text.replace("mixamorig:%s\n" % name, rename(name) + "\n")
            report, _ = self.imported(family + ".bvh", text)
            self.assertIn("(profile %s)" % family, report["facts"]["names"])
            self.assertNotIn("placed", report["facts"]["names"])

    def test_own_recordings_get_no_remark_on_units(self):
        text = toy_bvh()
        for name, joint in zip(NAMES, JOINTS):
            text = text.replace("mixamorig:%s\n" % name, joint + "\n")
        self.assertEqual(self.imported("own.bvh", text)[0]["remarks"], [])

    def test_obj_lines_may_go_on(self):
        corner = "v %g %g %g\n"
        text = "".join(corner % (.01 * i, .02 * i, .001 * i * i) for i in range(80)) + "f 1 2 3\n"
        plain = self.write("plain.obj", text)
        joined = self.write("joined.obj", text.replace("v 0.01 ", "v 0.01 \\\n").replace("f 1 2", "f 1 \\\n 2"))
        marked = self.write("marked.obj", b"\xef\xbb\xbf" + text.replace("\n", "\r").encode())
        for name in (plain, joined, marked):
            found = self.json("data", "import", name, "--out", "o.h5")
            self.assertEqual(found["reports"][0]["facts"]["points"], "80", name)

    def test_scans_must_be_of_a_person(self):
        def ply(name, size, count=99, same=False):
            return self.ply(name, [(0, 0 if same else size * i / count, 0) for i in range(count)])
        self.bad_input(["data", "import", ply("few.ply", 1.7, 63), "--out", "x.h5"], "few.ply", "63", "64")
        self.bad_input(["data", "import", ply("same.ply", 1.7, 200, True), "--out", "x.h5"], "same.ply", "only 1 different")
        self.bad_input(["data", "import", ply("huge.ply", 1e30), "--out", "x.h5"], "huge.ply", "no person")
        self.bad_input(["data", "import", ply("ant.ply", 0.01), "--out", "x.h5"], "ant.ply", "no person")
        self.bad_input(["data", "import", ply("wrong.ply", 1.7), "--scale", 0.001, "--out", "x.h5"], "wrong.ply", "--scale")
        self.done("data", "import", ply("cm.ply", 170), "--scale", 0.01, "--out", "x.h5")
        self.bad_input(["data", "import", ply("cm.ply", 170), "--out", "x.h5"], "cm.ply", "--scale 0.01", "--force")
        self.done("data", "import", "cm.ply", "--force", "--out", "x.h5")
        found = self.json("data", "import", ply("dm.ply", 17), "--out", "x.h5")  # or people in a room
        self.assertIn("--scale 0.1", found["reports"][0]["remarks"][0])


class Samples(CliTest):
    """Each importer reads a file of its kind: the words of the command."""

    MADE = (  # by make_samples, in the style of a data set
        "mixamo.bvh", "lafan1.bvh", "100style.bvh", "soma.bvh", "AMASS --body-model samples/models --license AMASS",
        "models/SMPLX_NEUTRAL.npz --betas zeros samples/AMASS/ben/shape.npz", "mixamo.glb --license CC0-1.0", "unreal.glb", "hero.vrm",
        "4D-DRESS", "CAPE --fps 60", "walk.npy --fps 25")
    REAL = ("cmu/bvh/02_01.bvh.xz", "cmu/bvh_original_skeleton/01_01.bvh.xz", "foreign/makehuman_walk1.bvh.xz",
            "foreign/makehuman_benchmark.bvh.xz", "foreign/pymo_walk_meredith.bvh.xz", "cmu/asfamc/02_01.amc.xz --subject 02")

    def imports(self, words):
        with self.subTest(words=words):
            said = self.done("data", "import", *words.split(), "--out", "x.h5")
            self.assertIn("\nwrote x.h5", said)
            self.assertNotIn("skipped", said)
            self.assertEqual(self.json("data", "verify", "x.h5")["problems"], [])

    def test_small_files_in_the_style_of_a_data_set(self):
        subprocess.run([SAMPLES, self.path("samples")], check=True)
        for words in self.MADE:
            self.imports("samples/" + words)

    @needs_data("cmu/bvh/02_01.bvh.xz")
    def test_real_recordings(self):
        for words in self.REAL:
            self.imports(os.path.join(DATA, words))
        self.bad_input(["data", "import", os.path.join(DATA, "foreign/fairmotion_sinusoidal.bvh.xz"), "--out", "chain.h5"], "none of its 4 bones")
