"""Definitions of joints: what files say, what is converted, what is refused (docs/joints.md)."""
import os

from support import ROOT, CliTest, numbers

STANDARD = os.path.join(ROOT, "experiments", "weights", "standard.safetensors")
F = 4


class Joints(CliTest):
    def setUp(self):
        super().setUp()
        self.joints = numbers(F * 66, 1)

    def labelled(self, name, definition, joints=None):
        """A file of joints that says which ones they are."""
        self.h5(name, joints=([F, 22, 3], joints or self.joints), attributes={"joint_definition": definition})

    def test_files_say_what_they_hold(self):
        self.person()
        self.assertEqual(self.json("data", "inspect", "data.h5")["joints"], {"builtin": 2})
        self.assertIn("builtin", self.done("data", "inspect", "walk/truth.h5"))
        self.done("skeleton", "--weights", STANDARD, "--input", "walk/source.h5", "--out", "own.h5")
        self.assertEqual(self.json("data", "inspect", "own.h5")["joints"], {"makehuman": 1})
        result = self.restage("eval", "--pred", "own.h5", "--truth", "walk/truth.h5", "--json")
        self.assertEqual(result.code, 0, result.err)
        self.assertIn("'makehuman'", result.err)
        self.assertIn("'builtin'", result.err)

    def test_skeleton_and_retarget_convert(self):
        self.person()
        call = ["skeleton", "--weights", STANDARD, "--input", "walk/target.ply"]
        own, smpl = (self.json(*call, *more)["frames"][0]["joints"] for more in ([], ["--joints", "smpl"]))
        self.assertEqual(self.json(*call, "--joints", "makehuman")["frames"][0]["joints"], own)
        hips = [abs(j[1][0] - j[2][0]) for j in (own, smpl)]
        self.assertLess(hips[1], 0.8 * hips[0])
        self.assertEqual(self.json(*call, "--joints", "smpl")["joints"], "smpl")
        make = ["retarget", "--source", "walk/source.h5", "--target", "walk/target.ply"]
        self.done(*make, "--out", "own.h5")
        self.done(*make, "--out", "smpl.h5", "--joints", "smpl")
        self.assertEqual(self.json("data", "inspect", "smpl.h5")["joints"], {"smpl": 1})
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
        self.assertIn("plain.h5 does not say which joints it holds: taken as 'makehuman'", without.err)
        asked = self.json("eval", "--pred", "plain.h5", "--truth", "own.h5", "--joints", "smpl")
        self.assertGreater(asked["mean"]["mpjpe"], 0.01)
        self.labelled("mine.h5", "mine")
        self.bad_input(["eval", "--pred", "mine.h5", "--truth", "own.h5"], "mine")
        self.bad_input(["eval", "--pred", "mine.h5", "--truth", "own.h5", "--joints", "smpl"], "mine.h5", "mine")

    def test_bodies_of_two_definitions_are_not_merged(self):
        self.person()
        self.done("data", "build", "--bodies", 1, 0, 1, "--motions", 1, 0, 0, "--seed", 3, "--out", "more.h5")
        self.done("data", "merge", "data.h5", "more.h5", "--prefix", "--out", "all.h5")
        self.assertEqual(self.json("data", "inspect", "all.h5")["joints"], {"builtin": 4})

