"""Rigged characters: the file that goes in comes out with one animation more. What is checked in the file is in
tests/datasets/characters_test.cpp; here are the command, its refusals, and, where they are at hand, real characters and a
checker that nobody of this repository wrote."""
import json
import math
import os
import struct
import subprocess
import sys
import unittest

from support import CliTest, ROOT, points
from tiny_run import TPOSES, weights
from test_data import JOINTS as NAMES
from test_gltf import character

CHARACTERS = os.path.join(os.environ.get("RESTAGE_SHARED", os.path.join(ROOT, "..", "shared")), "characters")
STANDARD = os.path.join(ROOT, "experiments", "weights", "standard.safetensors")


def python_with_numpy():
    for python in (sys.executable, "/usr/bin/python3"):
        if subprocess.run([python, "-c", "import numpy"], capture_output=True).returncode == 0:
            return python
    return None


def lacking():
    """Why the real characters cannot be checked; empty: they can."""
    why = "no shared characters (set RESTAGE_SHARED)" if not os.path.isdir(CHARACTERS) else \
        "" if python_with_numpy() else "no numpy for the checker"
    if why and os.environ.get("RESTAGE_CI"):
        raise FileNotFoundError("lacking, and required in CI: " + why)
    return why


@unittest.skipIf(lacking(), lacking())
class RealCharacters(CliTest):
    def check(self, name, out, *more):
        done = subprocess.run([python_with_numpy(), os.path.join(CHARACTERS, "check_rig.py"), os.path.join(CHARACTERS, name), self.path(out), *more],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, "".join(line for line in done.stdout.splitlines(True) if not line.startswith("PASS")) + done.stderr)

    def test_from_clouds(self):
        source = os.path.join(CHARACTERS, "source_dance.glb")
        for name in ("mixa_t", "mixa_a"):
            call = ["retarget", "--source", source, "--from-surface", "--target", os.path.join(CHARACTERS, name + ".glb"), "--weights", STANDARD]
            self.done(*call, "--out", name + ".glb")
            self.done(*call, "--out", "again.glb")
            self.assertEqual(self.bytes("again.glb"), self.bytes(name + ".glb"))
            truth = os.path.join(CHARACTERS, "truth_%s.npz" % name[-1])
            self.check(name + ".glb", name + ".glb", "--truth", truth, "--frames", "60", "--pa", ".02", "--mpjpe", ".03")
        self.check("mixa_t.glb", "mixa_t.glb", "--same", self.path("mixa_a.glb"))

    def test_fingers_that_a_file_cannot_hold_are_named(self):
        target = os.path.join(CHARACTERS, "mixa_t.glb")
        self.done("retarget", "--source", os.path.join(CHARACTERS, "source_dance.glb"), "--target", target, "--out", "hands.glb")
        content = self.bytes("hands.glb")
        length, = struct.unpack("<I", content[12:16])
        document = json.loads(content[20:20 + length])
        animation = document["animations"][-1]
        channel = next(c for c in animation["channels"] if c["target"]["path"] == "rotation")
        finger = next(i for i, node in enumerate(document["nodes"]) if node["name"].endswith("LeftHandIndex1"))
        animation["channels"].append({"sampler": channel["sampler"], "target": {"node": finger, "path": "rotation"}})
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        with open(self.path("hands.glb"), "wb") as f:
            f.write(content[:8] + struct.pack("<II", len(content) - length + len(text), len(text)) + content[16:20] + text + content[20 + length:])
        call = ["retarget", "--source", "hands.glb", "--target", target]
        for out, said in (("o.bvh", True), ("o.vrma", True), ("o.glb", False)):
            result = self.restage(*call, "--out", out)
            self.assertEqual((result.code, "fingers are not in the file" in result.err), (0, said), result.err)

    def test_a_file_that_was_saved_in_a_pose_or_mirrored(self):
        """As Blender exports it: nodes hold a pose, vertices lie in the world; and an armature of scale -0.01 above the same skin."""
        source = ["--source", os.path.join(CHARACTERS, "source_dance.glb")]
        with open(os.path.join(CHARACTERS, "mixa_t.glb"), "rb") as f:
            content = f.read()
        length, = struct.unpack("<I", content[12:16])
        for name in ("posed", "mirrored"):
            root = json.loads(content[20:20 + length])
            for node in root["nodes"]:
                if name == "posed" and node["name"] in ("mixamorig:Hips", "mixamorig:LeftUpLeg", "mixamorig:Spine"):
                    node["rotation"] = [0.0, 0.6, 0.0, 0.8] if "Hips" in node["name"] else [0.36, 0.48, 0.0, 0.8]
                if name == "mirrored" and node["name"] == "Armature":
                    node["scale"] = [-0.01, -0.01, -0.01]
                if name == "mirrored" and node["name"] == "mixamorig:Hips":  # where it was, through the mirror
                    node["translation"] = [-x for x in node["translation"]]
                    node["scale"] = [-1, -1, -1]
            text = json.dumps(root).encode()
            text += b" " * (-len(text) % 4)
            rest = content[20 + length:]
            self.write(name + ".glb", struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest)
            self.done("retarget", *source, "--target", name + ".glb", "--out", "out.h5")
            self.done("retarget", *source, "--target", os.path.join(CHARACTERS, "mixa_t.glb"), "--out", "plain.h5")
            off = self.json("eval", "--pred", "out.h5", "--truth", "plain.h5")["mean"]
            self.assertLess(max(off["mpjpe"], off["mpvd"]), 1e-3, name)

    def test_from_the_skeleton_of_the_same_person(self):
        for source, target in (("mixa_t", "mixa_a"), ("mixa_a", "mixa_t")):
            self.done("retarget", "--source", os.path.join(CHARACTERS, "ideal", source + ".glb"), "--target",
                      os.path.join(CHARACTERS, target + ".glb"), "--out", "out.glb")
            truth = os.path.join(CHARACTERS, "truth_%s.npz" % target[-1])
            self.check(target + ".glb", "out.glb", "--truth", truth, "--frames", "60", "--pa", ".001", "--mpjpe", ".001")

    def test_bvh_has_the_characters_own_names(self):
        call = ["retarget", "--source", os.path.join(CHARACTERS, "source_dance.glb"), "--target", os.path.join(CHARACTERS, "mixa_a.glb")]
        self.done(*call, "--out", "dance.bvh")
        text = self.bytes("dance.bvh").decode()
        self.assertIn("ROOT mixamorig:Hips\n", text)
        self.assertEqual(text.count("mixamorig:"), 22)
        # It comes back in by those names, and does the same.
        self.done(*call[:1], "--source", "dance.bvh", *call[3:], "--out", "again.glb")
        truth = os.path.join(CHARACTERS, "truth_a.npz")
        self.check("mixa_a.glb", "again.glb", "--truth", truth, "--frames", "60", "--pa", ".004", "--mpjpe", ".005")

    def test_vertices_are_those_that_the_document_shows(self):
        call = ["retarget", "--source", os.path.join(CHARACTERS, "source_dance.glb"), "--target", os.path.join(CHARACTERS, "mixa_a.glb")]
        self.done(*call, "--out", "a.glb")
        self.done(*call, "--out", "frames/")
        frames = [self.vertices("frames/" + name) for name in sorted(os.listdir(self.path("frames")))]
        head = "{'descr': '<f4', 'fortran_order': False, 'shape': (%d, %d, 3), }" % (len(frames), len(frames[0]))
        head += " " * (-(len(head) + 11) % 64) + "\n"
        flat = [x for frame in frames for point in frame for x in point]
        self.write("posed.npy", b"\x93NUMPY\x01\0" + struct.pack("<H", len(head)) + head.encode() + struct.pack("<%df" % len(flat), *flat))
        self.check("mixa_a.glb", "a.glb", "--surface", self.path("posed.npy"))


class Characters(CliTest):
    """hero.glb: 22 bones in an A-pose, z up."""

    def setUp(self):
        super().setUp()
        self.vertex_count, _ = character(self.path("hero.glb"))

    def glb(self, name):
        content = self.bytes(name)
        return json.loads(content[20:20 + struct.unpack("<I", content[12:16])[0]])

    def rename(self, name, out, names):
        """The same file with other names of nodes."""
        content = self.bytes(name)
        length, = struct.unpack("<I", content[12:16])
        root = json.loads(content[20:20 + length])
        for node in root["nodes"]:
            node["name"] = names.get(node["name"], node["name"])
        text = json.dumps(root).encode()
        text += b" " * (-len(text) % 4)
        rest = content[20 + length:]
        self.write(out, struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest)

    def test_names_endings_and_refusals(self):
        for i in range(4):
            self.ply("scans/f%d.ply" % i, points(120, i))
        call = ["retarget", "--weights", weights("tposes", *TPOSES), "--force", "--source", "scans", "--target", "hero.glb", "--out"]
        before = self.glb("hero.glb")
        self.done(*call, "named.glb", "--clip-name", "Dance 1")
        after = self.glb("named.glb")
        self.assertEqual([a["name"] for a in after["animations"][len(before.get("animations", [])):]], ["Dance 1"])
        for part in ("nodes", "meshes", "skins", "scenes"):
            self.assertEqual(after[part], before[part], part)
        self.done(*call, "alone.glb", "--animation-only")
        alone = self.glb("alone.glb")
        self.assertEqual((len(alone["animations"]), "meshes" in alone), (1, False))
        self.done(*call, "text.gltf")
        self.assertEqual(json.loads(self.bytes("text.gltf"))["nodes"], before["nodes"])
        self.bad_input(call + ["x.vrm"], "x.vrm", "no VRM character", ".glb")
        self.bad_input(call + ["x.h5", "--clip-name", "a"], "x.h5", "--clip-name")
        self.bad_input(call + ["folder/", "--animation-only"], "--animation-only")
        self.bad_input(call + ["hero.glb"], "hero.glb")
        self.h5("rest.h5", joints=([1, 22, 3], 0.5))
        self.bad_input(call + ["x.glb", "--rest", "rest.h5"], "hero.glb", "leave --rest out")
        self.bad_input([*call, "x.vrm", "--animation-only"], "x.vrm")
        self.bad_input([*call, "nowhere/x.glb"], "nowhere/x.glb", "make the folder")
        self.done(*call, "twice.glb", "--clip-name", "Dance 1")
        again = [word.replace("hero.glb", "twice.glb") for word in call]
        self.bad_input(again + ["x.glb", "--clip-name", "Dance 1"], "twice.glb", "has an animation 'Dance 1' already")
        names = [node["name"] for node in before["nodes"]]
        self.rename("hero.glb", "odd.glb", {name: "b%d" % i for i, name in enumerate(names)})
        odd = [word.replace("hero.glb", "odd.glb") for word in call]
        self.bad_input(odd + ["x.glb"], "odd.glb", "was not recognised", "--bones", "--skeleton restage")
        self.done(*odd, "ours.glb", "--skeleton", "restage")
        self.ply("plain.ply", points(90, 7))
        plain = [word.replace("hero.glb", "plain.ply") for word in call]
        self.bad_input(plain + ["x.vrm"], "x.vrm", "no rig")
        self.bad_input(plain + ["x.gltf"], "x.gltf", "no rig")
        self.bad_input(plain + ["x.glb", "--animation-only"], "--animation-only")

    def bvh(self, name):
        """A person of 22 joints who walks 3 frames of 60 a second ahead, and lifts the left arm."""
        tree = {"Hips": [("LeftUpLeg", (9, -6, 0)), ("RightUpLeg", (-9, -6, 0)), ("Spine", (0, 10, 0))], "LeftUpLeg": [("LeftLeg", (0, -42, 0))],
                "LeftLeg": [("LeftFoot", (0, -40, 0))], "LeftFoot": [("LeftToeBase", (0, -5, 12))], "RightUpLeg": [("RightLeg", (0, -42, 0))],
                "RightLeg": [("RightFoot", (0, -40, 0))], "RightFoot": [("RightToeBase", (0, -5, 12))], "Spine": [("Spine1", (0, 12, 0))],
                "Spine1": [("Spine2", (0, 12, 0))], "Spine2": [("Neck", (0, 18, 0)), ("LeftShoulder", (6, 14, 0)), ("RightShoulder", (-6, 14, 0))],
                "Neck": [("Head", (0, 10, 0))], "LeftShoulder": [("LeftArm", (12, 0, 0))], "LeftArm": [("LeftForeArm", (28, 0, 0))],
                "LeftForeArm": [("LeftHand", (25, 0, 0))], "RightShoulder": [("RightArm", (-12, 0, 0))], "RightArm": [("RightForeArm", (-28, 0, 0))],
                "RightForeArm": [("RightHand", (-25, 0, 0))]}
        order = []

        def write(bone, offset, word):
            order.append(bone)
            channels = "6 Xposition Yposition Zposition Zrotation Xrotation Yrotation" if bone == "Hips" else "3 Zrotation Xrotation Yrotation"
            inner = "".join(write(child, at, "JOINT") for child, at in tree.get(bone, [])) or "End Site\n{\nOFFSET 0 5 0\n}\n"
            return "%s %s\n{\nOFFSET %g %g %g\nCHANNELS %s\n%s}\n" % (word, bone, *offset, channels, inner)
        text = "HIERARCHY\n" + write("Hips", (0, 95, 0), "ROOT") + "MOTION\nFrames: 3\nFrame Time: 0.0166667\n"
        for frame in range(3):
            turns = ["%g 0 0" % (20 * frame if bone == "LeftArm" else 0) for bone in order]
            text += "0 95 %g %s\n" % (10 * frame, " ".join(turns))
        return self.write(name, text)

    def test_a_source_with_a_skeleton(self):
        self.bvh("walk.bvh")
        call = ["retarget", "--source", "walk.bvh", "--target", "hero.glb"]
        said = self.json(*call, "--out", "out.glb")  # no weights: no network is asked
        self.assertEqual((said["frames"], said["from"]), (2, "skeleton"))
        self.assertEqual(self.glb("out.glb")["animations"][-1]["name"], "walk")
        self.done(*call, "--out", "out.h5")
        self.done(*call, "--out", "out.bvh")
        self.done(*call, "--out", "frames/")
        self.assertEqual(len(os.listdir(self.path("frames"))), 2)
        # What came out goes in again.
        self.done("retarget", "--source", "out.glb", "--clip", "walk", "--target", "hero.glb", "--out", "again.glb")
        first, again = (self.last_turns(name) for name in ("out.glb", "again.glb"))
        self.assertLess(max(abs(a - b) for a, b in zip(first, again)), 1e-5)
        for option in (["--samples", "8"], ["--min-confidence", "0.5"], ["--system", "refine"], ["--sequence", "0"], ["--profile"]):
            self.bad_input([*call, "--out", "x.glb", *option], "walk.bvh", option[0], "--from-surface")
        for option in (["--weights", "lite"], ["--device", "cuda"], ["--asf", "walk.asf"]):
            self.bad_input([*call, "--out", "x.glb", *option], "walk.bvh", "leave " + option[0] + " out")
        self.bad_input([*call, "--out", "x.glb", "--weights", "w"], "w:", "standard or lite")
        self.bad_input([*call, "--out", "x.glb", "--format", "ply"], "x.glb", "leave --format out")
        self.bad_input([*call, "--out", "x.glb", "--clip", "walk"], "leave --clip out")
        self.bad_input([*call, "--out", "x.glb", "--body-model", "hero.glb"], "walk.bvh", "leave --body-model out")
        self.bad_input([*call, "--out", "x.glb", "--from-surface"], "walk.bvh")
        self.bad_input(["retarget", "--source", "none.bvh", "--target", "hero.glb", "--out", "x.glb"], "none.bvh")

    def test_bones_of_a_source(self):
        self.bvh("walk.bvh")
        with open(self.path("walk.bvh")) as f:
            self.write("odd.bvh", f.read().replace("LeftArm", "Odd"))
        call = ["retarget", "--source", "odd.bvh", "--target", "hero.glb", "--out", "out.glb"]
        self.bad_input(call, "odd.bvh", "left_shoulder")
        names = dict(zip(NAMES, "Hips LeftUpLeg RightUpLeg Spine LeftLeg RightLeg Spine1 LeftFoot RightFoot Spine2 LeftToeBase RightToeBase Neck "
                                "LeftShoulder RightShoulder Head Odd RightArm LeftForeArm RightForeArm LeftHand RightHand".split()))
        self.write("odd.yaml", "title: Odd\njoints:\n" + "".join("  %s: %s\n" % pair for pair in names.items()))
        self.done(*call, "--source-bones", "odd.yaml")
        self.ply("scans/f0.ply", points(120, 0))
        self.bad_input(["retarget", "--source", "scans", "--source-bones", "odd.yaml", "--target", "hero.glb", "--out", "x.glb"], "leave --source-bones, --body-model, --layout and --asf out")

    def test_rates_and_vrm_animations(self):
        self.bvh("walk.bvh")
        call = ["retarget", "--source", "walk.bvh", "--target", "hero.glb", "--out"]
        for name, fps, frames in (("a.glb", 60, 3), ("b.vrma", 120, 5), ("c.bvh", 24, 1), ("d.glb", 30, 2)):
            said = self.json(*call, name, "--out-fps", str(fps))
            self.assertEqual((said["frames"], said["fps"]), (frames, fps))
        animation = self.glb("a.glb")["animations"][-1]
        self.assertEqual(self.glb("a.glb")["accessors"][animation["samplers"][0]["input"]]["count"], 3)
        vrma = self.glb("b.vrma")
        self.assertEqual(vrma["extensionsUsed"], ["VRMC_vrm_animation"])
        bones = vrma["extensions"]["VRMC_vrm_animation"]["humanoid"]["humanBones"]
        self.assertEqual((len(bones), bones["hips"]["node"]), (22, 0))
        # The file is a source again, and says the same.
        self.done("retarget", "--source", "b.vrma", "--target", "hero.glb", "--out", "again.glb")
        self.done(*call, "once.glb")
        self.assertLess(max(abs(a - b) for a, b in zip(self.last_turns("again.glb"), self.last_turns("once.glb"))), 1e-5)
        self.bad_input(call + ["x.h5", "--out-fps", "24"], "x.h5", "30 frames a second")
        self.bad_input(call + ["x.glb", "--out-fps", "0"], "--out-fps")

    def test_a_skeleton_for_a_target_without_one(self):
        for i in range(4):
            self.ply("scans/f%d.ply" % i, points(120, i))
        self.ply("plain.ply", points(90, 7))
        call = ["retarget", "--weights", weights("tposes", *TPOSES), "--force", "--source", "scans", "--target", "plain.ply", "--out"]
        names = {"mixamo": "mixamorig:LeftForeArm", "vrm": "leftLowerArm", "unreal": "lowerarm_l", "smpl": "left_hand", "restage": "left_elbow"}
        for skeleton, bone in names.items():
            self.done(*call, "a.glb", "--skeleton", skeleton)
            self.assertIn(bone, [node["name"] for node in self.glb("a.glb")["nodes"]])
        said = self.restage(*call, "a.glb")
        self.assertIn("from the exact one on average", said.err)
        self.assertGreater(self.glb("a.glb")["asset"]["extras"]["surface_error_mm"]["max"], 0)
        self.done(*call, "a.bvh", "--skeleton", "unreal")
        self.assertIn("JOINT lowerarm_l\n", self.bytes("a.bvh").decode())
        self.bad_input(call + ["x.glb", "--skeleton", "biped"], "--skeleton", "mixamo")
        self.bad_input(call + ["x.h5", "--skeleton", "vrm"], "x.h5", "--skeleton")
        self.bad_input(["retarget", *call[1:6], "--target", "hero.glb", "--out", "x.glb", "--skeleton", "vrm"], "hero.glb", "leave --skeleton out")

    def last_turns(self, name):
        """All numbers of the last animation of a GLB."""
        root = self.glb(name)
        content = self.bytes(name)
        binary = content[28 + struct.unpack("<I", content[12:16])[0]:]
        out = []
        for sampler in root["animations"][-1]["samplers"]:
            accessor = root["accessors"][sampler["output"]]
            view = root["bufferViews"][accessor["bufferView"]]
            at = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
            out += struct.unpack_from("<%df" % (accessor["count"] * {"VEC3": 3, "VEC4": 4}[accessor["type"]]), binary, at)
        return out


class AnyPose(CliTest):
    """Targets without a rig that do not stand in T-pose; the standard weights put them into it."""
    def posed(self, name, degrees):
        """The built-in body with its arms that much below the horizontal; its height."""
        hero = self.person(frames=2)
        _, _, body = self.bytes("walk/target.ply").partition(b"end_header\n")
        faces = [f[1:] for f in struct.iter_unpack("<B3i", body[12 * len(hero):])]
        shoulder, height = 0.19, 0.81 * max(y for _, y, _ in hero)
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))

        def moved(x, y, z):
            if abs(x) < shoulder or y < 0.7 * height:
                return x, y, z
            out, up = abs(x) - shoulder, y - height
            return math.copysign(shoulder + c * out + s * up, x), height + c * up - s * out, z
        self.ply(name, [moved(*p) for p in hero], faces)
        return hero

    def test_a_pose_is_taken_without_a_word(self):
        hero = self.posed("a.ply", 50)
        self.assertEqual(self.restage("doctor", "a.ply", "--target").code, 1)  # it is no T-pose
        call = ["retarget", "--source", "data.h5", "--sequence", "0", "--target", "a.ply", "--weights", STANDARD, "--out"]
        said = self.restage(*call, "out.glb")
        self.assertEqual(said.code, 0, said.err)
        self.assertIn("a.ply: was put into T-pose (a limb was ", said.err)
        content = self.bytes("out.glb")
        length, = struct.unpack("<I", content[12:16])
        document = json.loads(content[20:20 + length])
        accessor = document["accessors"][document["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]
        at = 28 + length + document["bufferViews"][accessor["bufferView"]].get("byteOffset", 0)
        found = list(struct.iter_unpack("<3f", content[at:at + 12 * len(hero)]))
        off = sorted(math.dist(a, b) for a, b in zip(found, hero))
        self.assertLess(sum(off) / len(off), 0.03)
        self.assertLess(off[len(off) * 9 // 10], 0.06)

    def test_what_cannot_be_made_out_is_named(self):
        self.posed("down.ply", 95)  # the hands are in the thighs
        call = ["retarget", "--source", "data.h5", "--sequence", "0", "--target", "down.ply", "--weights", STANDARD, "--out", "x.glb"]
        refused = self.restage(*call)
        self.assertEqual(refused.code, 2)
        self.assertRegex(refused.err, r"down.ply: is not in T-pose, and its (left|right) (arm|leg) cannot be made out in its pose; ")
        self.done(*call, "--force")


if __name__ == "__main__":
    unittest.main()
