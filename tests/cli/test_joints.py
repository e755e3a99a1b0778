"""Definitions of joints: what files say, what is converted, what is refused (docs/joints.md)."""
import json
import os
import struct

from support import ROOT, CliTest, numbers

STANDARD = os.path.join(ROOT, "experiments", "weights", "standard.safetensors")
F = 4


class LookAhead(CliTest):
    """Standard weights hold two motion networks; retarget takes the one that looks ahead."""

    def test_retarget_looks_ahead_unless_told_otherwise(self):
        self.person()
        make = ["retarget", "--source", "walk/source.h5", "--target", "walk/target.ply"]
        late, online = (self.json(*make, "--out", name, *more) for name, more in (("late.h5", []), ("online.h5", ["--online"])))
        self.assertEqual((late["frames"], online["frames"]), (12, 12))
        apart = self.json("eval", "--pred", "late.h5", "--truth", "online.h5")["mean"]["mpjpe"]
        self.assertGreater(apart, 1e-4)
        self.assertLess(apart, 0.05)
        # The same network alone, as the file's only one.
        self.done("weights", "export", "--source", STANDARD, "--model", "motion.late", "--out", "m.safetensors")
        self.done("weights", "import", "--source", "m.safetensors", "--model", "smrm/hybrid", "--with", STANDARD, "--out", "one.safetensors")
        self.done(*make, "--weights", "one.safetensors", "--online", "--out", "one.h5")
        self.assertEqual(self.json("eval", "--pred", "one.h5", "--truth", "late.h5")["mean"]["mpjpe"], 0)
        self.done("weights", "import", "--source", "m.safetensors", "--model", "smrm/hybrid", "--role", "motion.late", "--with", STANDARD,
                  "--out", "both.safetensors")
        self.done(*make, "--weights", "both.safetensors", "--out", "both.h5")
        self.assertEqual(self.json("eval", "--pred", "both.h5", "--truth", "late.h5")["mean"]["mpjpe"], 0)
        for role in ("skeleton", "late", "motion.later"):
            self.bad_input(["weights", "import", "--source", "m.safetensors", "--model", "smrm/hybrid", "--role", role, "--out", "w.safetensors"],
                           role)

        self.bad_input(["weights", "export", "--source", STANDARD, "--model", "smrm/hybrid", "--out", "w.safetensors"], "two models")
        self.done("weights", "export", "--source", STANDARD, "--model", "motion", "--out", "now.safetensors")
        self.bad_input(["weights", "import", "--source", "now.safetensors", "--model", "smrm/hybrid", "--role", "motion.late",
                        "--out", "w.safetensors"], "now.safetensors", "look ahead")

    def test_networks_of_two_definitions_are_refused(self):
        self.person()
        make = ["retarget", "--source", "walk/source.h5", "--target", "walk/target.ply", "--weights", "w.safetensors", "--out", "r.h5"]
        for place in ("smrm", "motion.late", "skeleton"):
            for name in ("smpl", "two words"):
                self.relabelled("w.safetensors", place, name)
                self.bad_input(make, "w.safetensors", "joint")
        self.relabelled("w.safetensors", "motion.late", "smpl")
        self.done(*make, "--system", "copy")  # asks no motion network

    def relabelled(self, name, place, definition):
        """The standard weights, of which one network says that it knows other joints."""
        with open(STANDARD, "rb") as file:
            content = file.read()
        size = struct.unpack("<Q", content[:8])[0]
        header = json.loads(content[8:8 + size])
        models = json.loads(header["__metadata__"]["restage"])
        models["models"][place]["settings"]["joint_definition"] = definition
        header["__metadata__"]["restage"] = json.dumps(models)
        text = json.dumps(header).encode()
        text += b" " * (-len(text) % 8)
        self.write(name, struct.pack("<Q", len(text)) + text + content[8 + size:])

    def test_a_run_keeps_the_network_that_looks_ahead(self):
        self.person()
        self.write("c.yaml", "name: t\nrun_root: runs\nstages: [skeleton, motion]\ndata: {source: data.h5}\n"
                             "skeleton: {from: %s}\nmotion: {from: %s}\n" % (STANDARD, STANDARD))
        self.done("data", "build", "--bodies", 1, 1, 1, "--motions", 1, 1, 1, "--out", "data.h5")
        run = self.json("train", "c.yaml")["run"]
        self.assertIn("motion.late", self.done("weights", "show", run + "/weights.safetensors"))

    def test_systems_that_answer_at_once(self):
        self.person()
        make = ["retarget", "--source", "walk/source.h5", "--target", "walk/target.ply"]
        for system in ("copy", "refine"):
            self.done(*make, "--system", system, "--out", "a.h5")
            self.done(*make, "--system", system, "--online", "--out", "b.h5")
            self.assertEqual(self.json("eval", "--pred", "a.h5", "--truth", "b.h5")["mean"]["mpjpe"], 0, system)


class Joints(CliTest):
    def setUp(self):
        super().setUp()
        self.joints = numbers(F * 66, 1)

    def labelled(self, name, definition, joints=None):
        """A file of joints that says which ones they are."""
        self.h5(name, joints=([F, 22, 3], joints or self.joints), attributes={"joint_definition": definition})

    def test_files_say_what_they_hold(self):
        self.person()
        self.assertEqual(self.json("data", "inspect", "data.h5")["joint_definition"], {"builtin": 2})
        self.assertIn("builtin", self.done("data", "inspect", "walk/truth.h5"))
        self.done("skeleton", "--weights", STANDARD, "--source", "walk/source.h5", "--out", "own.h5")
        self.assertEqual(self.json("data", "inspect", "own.h5")["joint_definition"], {"makehuman": 1})
        result = self.restage("eval", "--pred", "own.h5", "--truth", "walk/truth.h5", "--json")
        self.assertEqual(result.code, 0, result.err)
        self.assertIn("'makehuman'", result.err)
        self.assertIn("'builtin'", result.err)

    def test_skeleton_and_retarget_convert(self):
        self.person()
        call = ["skeleton", "--weights", STANDARD, "--source", "walk/target.ply"]
        own, smpl = (self.json(*call, *more)["frames"][0]["joints"] for more in ([], ["--joints", "smpl"]))
        self.assertEqual(self.json(*call, "--joints", "makehuman")["frames"][0]["joints"], own)
        hips = [abs(j[1][0] - j[2][0]) for j in (own, smpl)]
        self.assertLess(hips[1], 0.8 * hips[0])
        self.assertEqual(self.json(*call, "--joints", "smpl")["joint_definition"], "smpl")
        make = ["retarget", "--source", "walk/source.h5", "--target", "walk/target.ply"]
        self.done(*make, "--out", "own.h5")
        self.done(*make, "--out", "smpl.h5", "--joints", "smpl")
        self.assertEqual(self.json("data", "inspect", "smpl.h5")["joint_definition"], {"smpl": 1})
        # eval makes the same of the other file.
        same = self.json("eval", "--pred", "own.h5", "--truth", "smpl.h5", "--joints", "smpl")["mean"]
        self.assertLess(same["mpjpe"], 1e-6)
        self.bad_input(["eval", "--pred", "own.h5", "--truth", "smpl.h5"], "smpl.h5", "--joints")
        self.bad_input([*make, "--out", "r.glb", "--joints", "smpl"], "r.glb", "--joints")
        self.bad_input([*make, "--out", "r.h5", "--joints", "cmu"], "cmu", "docs/joints.md")

    def test_eval_takes_a_silent_file_as_asked(self):
        self.h5("plain.h5", joints=([F, 22, 3], self.joints))
        self.labelled("own.h5", "makehuman")
        without = self.restage("eval", "--pred", "plain.h5", "--truth", "own.h5", "--json")
        self.assertEqual(without.code, 0)
        self.assertIn("taken as 'makehuman': plain.h5", without.err)
        asked = self.json("eval", "--pred", "plain.h5", "--truth", "own.h5", "--joints", "smpl")
        self.assertGreater(asked["mean"]["mpjpe"], 0.01)
        self.labelled("mine.h5", "mine")
        self.bad_input(["eval", "--pred", "mine.h5", "--truth", "own.h5"], "mine")
        self.bad_input(["eval", "--pred", "mine.h5", "--truth", "own.h5", "--joints", "smpl"], "mine.h5", "mine")
        self.bad_input(["eval", "--pred", "plain.h5", "--truth", "plain.h5", "--joints", "cmu"], "cmu", "smpl")
        self.labelled("odd.h5", "two words")
        self.bad_input(["eval", "--pred", "odd.h5", "--truth", "own.h5"], "odd.h5", "joint_definition")

    def test_bodies_of_two_definitions_are_not_merged(self):
        self.person()
        self.done("data", "build", "--bodies", 1, 0, 1, "--motions", 1, 0, 0, "--seed", 3, "--out", "more.h5")
        self.done("data", "merge", "data.h5", "more.h5", "--prefix", "--out", "all.h5")
        self.assertEqual(self.json("data", "inspect", "all.h5")["joint_definition"], {"builtin": 4})

