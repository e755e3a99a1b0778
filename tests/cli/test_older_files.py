"""Files that version 0.1 wrote are read for as long as docs/stability.md promises. tests/golden/files_0_1 was made once, and is never
made again: a program that cannot read it breaks the promise. Its commands, of which the clouds have three frames:

    restage data build --bodies 1 0 0 --motions 1 0 0 --out people.h5
    restage data perform --bodies people.h5 --frames 3 --out o          (o/source.h5 is scans.h5)
    restage retarget --source scans.h5 --target EIGHTH_OF_o/target.ply --out result.h5
    restage skeleton --source scans.h5 --out joints.h5

Weights files of then: experiments/weights/lite.safetensors, and WeightsBundle.OlderFilesAreUnderstood in tests/nn."""
import os
import unittest

from support import ROOT, CliTest

FILES = os.path.join(ROOT, "tests", "golden", "files_0_1")


def older(name):
    return os.path.join(FILES, name)


class OlderFiles(CliTest):
    def test_inspect_says_what_they_hold(self):
        for name, kind, counts in (("people.h5", "dataset", {"bodies": 1, "motions": 1, "frames": 177, "vertices": 5838}),
                                   ("scans.h5", "scans", {"frames": 3, "points": 3578, "joints": 22, "sequences": 1}),
                                   ("result.h5", "prediction", {"frames": 3, "vertices": 730, "joints": 22, "sequences": 1}),
                                   ("joints.h5", "prediction", {"frames": 3, "joints": 22, "sequences": 1})):
            found = self.json("data", "inspect", older(name))
            self.assertEqual((found["kind"], found["counts"], found["fps"]), (kind, counts, 30), name)
        self.assertEqual(self.json("data", "inspect", older("people.h5"))["joint_definition"], {"builtin": 1})
        self.assertEqual(self.json("data", "inspect", older("joints.h5"))["joint_definition"], {"makehuman": 1})

    def test_their_numbers_are_those_of_then(self):
        """A clip performed anew from the old bodies and motions is the old clip's: same people, same path, same unit."""
        self.done("data", "perform", "--bodies", older("people.h5"), "--frames", "3", "--out", "again")
        found = self.json("eval", "--pred", "again/truth.h5", "--truth", older("scans.h5"))
        self.assertLess(found["mean"]["mpjpe"], 1e-5)
        found = self.json("eval", "--pred", older("joints.h5"), "--truth", older("scans.h5"))
        self.assertLess(found["mean"]["mpjpe"], 0.1, "metres")
        same = self.json("eval", "--pred", older("result.h5"), "--truth", older("result.h5"))["mean"]
        self.assertEqual((same["mpjpe"], same["mpvd"]), (0, 0))

    def test_they_are_sources(self):
        """Clouds, a motion and a result of then go through the program of now."""
        self.done("doctor", older("scans.h5"))
        self.done("retarget", "--source", older("scans.h5"), "--target", self.mesh(), "--out", "clouds.glb")
        self.done("retarget", "--source", older("people.h5"), "--target", self.mesh(), "--out", "motion.glb")
        self.done("view", older("result.h5"), "--out", "result.png")
        for name in ("clouds.glb", "motion.glb", "result.png"):
            self.assertGreater(os.path.getsize(self.path(name)), 1000)

    def mesh(self):
        if not os.path.exists(self.path("o")):
            self.done("data", "perform", "--bodies", older("people.h5"), "--frames", "2", "--out", "o")
        return "o/target.ply"
