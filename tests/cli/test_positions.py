"""Positions of joints as a source; clouds that show several people."""
import json
import math
import os

from support import CliTest
from test_gltf import character

# A stick figure in T-pose, metres: SMPL's 22 joints in their order.
REST = [(0, .95, 0), (.09, .87, 0), (-.09, .87, 0), (0, 1.06, -.02), (.1, .48, .01), (-.1, .48, .01), (0, 1.2, -.02), (.1, .08, -.02),
        (-.1, .08, -.02), (0, 1.26, 0), (.1, .02, .11), (-.1, .02, .11), (0, 1.47, -.02), (.08, 1.38, 0), (-.08, 1.38, 0), (0, 1.56, .03),
        (.18, 1.4, -.01), (-.18, 1.4, -.01), (.44, 1.4, -.02), (-.44, 1.4, -.02), (.69, 1.4, -.02), (-.69, 1.4, -.02)]
FRAMES = 20


def posed(frame):
    """The arms come down and forward, the knees bend, the person walks along z."""
    turn = -1.2 * frame / FRAMES
    out = [list(x) for x in REST]
    for sign, shoulder, elbow, wrist in ((1, 16, 18, 20), (-1, 17, 19, 21)):
        for j in (elbow, wrist):
            reach = abs(REST[j][0] - REST[shoulder][0])
            out[j] = [REST[shoulder][0] + sign * reach * math.cos(turn), 1.4 + reach * math.sin(turn), REST[j][2]]
        out[wrist][2] += .2
        out[wrist][1] += .25 - math.dist(out[wrist], out[elbow])
    for x in out:
        x[2] += .02 * frame
    return out


def table(names):
    lines = ["frame,joint,x,y,z"]
    for f in range(FRAMES):
        lines += ["%d,%s,%.5f,%.5f,%.5f" % (f, name, *x) for name, x in zip(names, posed(f))]
    return "\n".join(lines) + "\n"


class Positions(CliTest):
    def hero(self):
        character(self.path("hero.glb"))
        return "hero.glb"

    def test_a_table_moves_a_character(self):
        self.write("joints.csv", table(range(22)))
        found = self.json("data", "import", "joints.csv", "--out", "m.h5")
        self.assertEqual((found["motions"], found["frames"]), (1, FRAMES))
        self.assertIn("SMPL", found["reports"][0]["facts"]["joints"])
        self.assertEqual(self.json("data", "verify", "m.h5")["problems"], [])
        hero = self.hero()
        self.done("retarget", "--source", "joints.csv", "--target", hero, "--out", "a.glb")
        self.done("retarget", "--source", "m.h5", "--target", hero, "--out", "b.glb")
        self.assertEqual(self.bytes("a.glb"), self.bytes("b.glb"), "the same motion, whichever way it comes")
        self.write("named.csv", table(["LeftX%d" % j for j in range(22)]))
        self.bad_input(["data", "import", "named.csv", "--out", "x.h5"], "named.csv", "both hips")

    def test_frames_of_a_tracker(self):
        frames = [{"bodies": [{"body_id": 1, "joint_positions": posed(f)}, {"body_id": 2, "joint_positions": posed(0)}],
                   "timestamp_usec": 50000 * f} for f in range(FRAMES)]
        self.write("two.json", json.dumps({"frames": frames}))
        self.bad_input(["data", "import", "two.json", "--out", "x.h5"], "2 people", "--person")
        found = self.json("data", "import", "two.json", "--person", "0", "--out", "m.h5")
        self.assertIn("20 fps", found["reports"][0]["facts"]["frame rate"])
        self.bad_input(["retarget", "--source", "two.json", "--person", "2", "--target", self.hero(), "--out", "x.glb"], "no number '2'")
        self.bad_input(["data", "import", "two.json", "--person", "0", "--layout", "coco17", "--out", "x.h5"], "22 joints a frame", "17")
        self.bad_input(["data", "import", "two.json", "--layout", "coco", "--out", "x.h5"], "--layout", "coco17")
        self.write("deep.json", "[" * 100000)
        self.bad_input(["data", "import", "deep.json", "--out", "x.h5"], "deep.json")

    def test_lines_of_json(self):
        """A file of what `restage stream` takes: with names too, which may be left out."""
        names = "pelvis left_hip right_hip spine1 left_knee right_knee spine2 left_ankle right_ankle spine3 left_foot right_foot neck " \
                "left_collar right_collar head left_shoulder right_shoulder left_elbow right_elbow left_wrist right_wrist"
        lists = ["%s\n" % json.dumps({"time": f / 25, "joints": posed(f)}) for f in range(FRAMES)]
        named = ["%s\n" % json.dumps({"time": f / 25, "joints": {n: x for n, x in zip(names.split(), posed(f)) if n != "head" or f > 3}})
                 for f in range(FRAMES)]
        lists[5] = lists[5].replace(json.dumps(posed(5)[0]), "null")
        self.write("list.jsonl", "".join(lists[:3]) + "\n" + "".join(lists[3:]))
        self.write("named.jsonl", "".join(named))
        for name in ("list", "named"):
            found = self.json("data", "import", name + ".jsonl", "--out", name + ".h5")
            self.assertEqual(found["frames"], 23, "20 frames of 25 a second")
            self.assertIn("25 fps", found["reports"][0]["facts"]["frame rate"])
            self.done("retarget", "--source", name + ".jsonl", "--target", self.hero(), "--out", name + ".glb")
        self.write("broken.jsonl", "".join(lists[:3]) + "\n{no\n" + "".join(lists[3:]))
        done = self.restage("data", "import", "broken.jsonl", "--out", "x.h5")
        self.assertEqual(done.code, 0, done.err)
        self.assertIn("1 line cannot be read and left out: broken.jsonl:5: is no valid JSON: '{no'", done.out + done.err)
        self.write("broken.jsonl", "{no\nno\n")
        self.bad_input(["data", "import", "broken.jsonl", "--out", "y.h5"], "broken.jsonl:1: is no valid JSON: '{no'")
        self.write("gap.jsonl", "".join(json.dumps({"time": f / 25 + (f > 9), "joints": posed(f)}) + "\n" for f in range(FRAMES)))
        self.bad_input(["data", "import", "gap.jsonl", "--out", "y.h5"], "gap.jsonl: has nothing for 1.04 s after line 10", "--force")
        self.assertEqual(self.json("data", "import", "gap.jsonl", "--force", "--out", "y.h5")["frames"], 53)
        for before, code in (("mixamorig:", 0), ("q", 2)):
            bones = dict(zip("Hips LeftUpLeg RightUpLeg LeftLeg RightLeg LeftFoot RightFoot Head LeftArm RightArm LeftForeArm RightForeArm LeftHand "
                             "RightHand Banana".split(), (0, 1, 2, 4, 5, 7, 8, 15, 16, 17, 18, 19, 20, 21, 3)))
            called = {before + (name if code == 0 else str(j)): j for name, j in bones.items()}
            self.write("bones.jsonl", "".join(json.dumps({"joints": {name: posed(f)[j] for name, j in called.items()}}) + "\n" for f in range(FRAMES)))
            if code == 0:
                done = self.restage("data", "import", "bones.jsonl", "--out", "z.h5")
                self.assertEqual(done.code, 0, done.err)
                self.assertIn("passed over are joints called 'mixamorig:Banana'", done.out + done.err)
            else:
                self.bad_input(["data", "import", "bones.jsonl", "--out", "q.h5"], "names that are not understood: 'q0', 'q1'", "left_hip")
        self.write("empty.jsonl", "\n")
        self.bad_input(["data", "import", "empty.jsonl", "--out", "x.h5"], "empty.jsonl")

    def frames(self, folder):
        """A JSON file for each frame."""
        for f in range(FRAMES):
            self.write("%s/%04d_keypoints.json" % (folder, f), json.dumps({"people": [{"joints": posed(f)}]}))

    def test_other_files_beside_frames(self):
        hero = self.hero()
        self.frames("plain")
        self.frames("notes")
        self.write("notes/README.txt", "Recorded on Monday\nby me\n")
        self.write("notes/.DS_Store", b"\0\1")
        for folder in ("plain", "notes"):
            result = self.restage("retarget", "--source", folder, "--target", hero, "--out", folder + ".bvh")
            self.assertEqual(result.code, 0, result.err)
            self.assertEqual(result.err.count("README.txt is no JSON, and is passed over"), int(folder == "notes"), result.err)
            self.assertNotIn("DS_Store", result.err)
        self.assertEqual(self.bytes("plain.bvh"), self.bytes("notes.bvh"))
        found = self.json("data", "import", "notes", "--out", "m.h5")
        self.assertEqual((found["motions"], found["frames"]), (1, FRAMES))
        self.write("notes/0007_keypoints.json", json.dumps({"people": []}))  # a frame that shows nobody
        self.assertEqual(self.json("data", "import", "notes", "--out", "m.h5")["frames"], FRAMES)
        self.write("notes/calibration.json", json.dumps({"camera": [1, 2, 3]}))
        self.assertIn("left out 'calibration.json'", " ".join(self.json("data", "import", "notes", "--out", "m.h5")["reports"][0]["remarks"]))
        os.rename(self.path("notes/calibration.json"), self.path("notes/0013_keypoints.json"))
        for command in (["data", "import", "notes", "--out", "x.h5"], ["retarget", "--source", "notes", "--target", hero, "--out", "x.glb"]):
            self.bad_input(command, "notes/0013_keypoints.json", "is no frame of joints", "move it")

    def test_a_folder_with_a_file_for_each_recording(self):
        hero = self.hero()
        self.write("one/a.csv", table(range(22)))
        self.bad_input(["retarget", "--source", "one", "--target", hero, "--out", "x.glb"], "one: is a folder with a recording", "one/a.csv")
        self.write("two/a.csv", table(range(22)))
        self.write("two/b.csv", table(range(22)))
        for name in "ab":
            self.write("both/%s.json" % name, json.dumps({"frames": [{"people": [{"joints": posed(f)}]} for f in range(FRAMES)]}))
        for folder, kind in (("two", "csv"), ("both", "json")):
            self.bad_input(["retarget", "--source", folder, "--target", hero, "--out", "x.glb"], folder + ": holds 2 recordings of joints",
                           "a." + kind, "b." + kind, "restage data import %s --out M.h5" % folder)
            self.assertEqual(self.json("data", "import", folder, "--out", "m.h5")["motions"], 2)

    def test_commands_of_clouds_name_those_of_joints(self):
        self.write("joints.csv", table(range(22)))
        self.frames("frames")
        for source in ("joints.csv", "frames"):
            for command in (["doctor", source], ["assess", source], ["skeleton", source], ["adapt", source, "--out", "w.safetensors"]):
                self.bad_input(command, source + ": holds 20 frames of joints without rotations", "SMPL", "restage retarget " + source,
                               "restage data import " + source)

    def test_people_in_clouds(self):
        self.person(FRAMES)
        self.done("doctor", "walk/source.h5", "--fix", "good/")
        names = sorted(os.listdir(self.path("good")))
        for name in names:
            alone = self.vertices("good/" + name)
            self.ply("two/" + name, alone + [(x + 1.6, y, z) for x, y, z in alone])
        found = self.json("doctor", "two", "--people", "--fix", "apart.h5")
        self.assertEqual([(p["person"], p["frames"]) for p in found["people"]], [(0, FRAMES), (1, FRAMES)])
        self.assertLess(found["people"][0]["middle"][0], found["people"][1]["middle"][0])
        self.assertEqual(self.json("data", "inspect", "apart.h5")["counts"]["sequences"], 2)
        self.bad_input(["doctor", "two", "--people", "--fix", "folder/"], "OUT.h5")
        notes = [f["topic"] for f in json.loads(self.restage("doctor", "two", "--json").out)["findings"]]
        self.assertNotIn("sparse", notes)
        self.write("joints.csv", table(range(22)))
        self.bad_input(["doctor", "joints.csv", "--people"], "holds 20 frames of joints without rotations")
        # The second comes in frame 8: the number that the doctor prints is taken, and the frames that show the person.
        for name in names[:8]:
            self.ply("two/" + name, self.vertices("good/" + name))
        late = self.json("doctor", "two", "--people", "--fix", "late.h5")
        self.assertEqual([(p["first"], p["last"]) for p in late["people"]], [(0, FRAMES - 1), (8, FRAMES - 1)])
        hero = self.hero()
        result = self.restage("retarget", "--source", "two", "--person", "1", "--target", hero, "--out", "late.bvh")
        self.assertEqual(result.code, 0, result.err)
        self.assertIn("person 1 is in sight in frames 8 to %d of %d" % (FRAMES - 1, FRAMES), result.err)
        self.done("retarget", "--source", "late.h5", "--sequence", "1", "--target", hero, "--out", "fixed.bvh")
        self.assertEqual(self.bytes("late.bvh"), self.bytes("fixed.bvh"))
        self.bad_input(["retarget", "--source", "two", "--person", "2", "--target", hero, "--out", "x.glb"], "shows 2 people, no number 2", "--people")
        self.bad_input(["retarget", "--source", "two", "--scale", "0.01", "--person", "0", "--target", hero, "--out", "x.glb"],
                       "shows nobody", "--scale")
