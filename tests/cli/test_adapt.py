"""restage adapt: an extractor learns from captures, and nothing is written unless held-out frames gain."""
import json
import os
import unittest

from support import ROOT, CliTest

WEIGHTS = os.path.join(ROOT, "experiments", "weights", "lite.safetensors")


class Adapt(CliTest):
    def test_learns_or_writes_nothing(self):
        self.person(frames=60)
        call = ["adapt", "--source", "walk/source.h5", "--weights", WEIGHTS, "--steps", "12", "--samples", "4"]
        gained = self.restage(*call, "--out", "a.safetensors", "--json")
        again = self.restage(*call, "--out", "b.safetensors", "--json", "--threads", "1")
        self.assertEqual((gained.code, gained.out.replace("a.safe", "b.safe")), (again.code, again.out))
        if gained.code == 0:  # both ends are right: what is written has gained
            self.assertEqual(self.bytes("a.safetensors"), self.bytes("b.safetensors"))
        self.one_line(self.restage(*call, "--rate", "0.1", "--out", "c.safetensors"), 1, "did not gain", "nothing is written")
        self.assertFalse(os.path.exists(self.path("c.safetensors")))

    def test_gains_and_the_result_is_used(self):
        self.person(frames=90)
        done = self.json("adapt", "--source", "walk/source.h5", "--weights", WEIGHTS, "--steps", "80", "--batch", "8", "--out", "own.safetensors")
        before, after = done["before"], done["after"]
        self.assertGreater(done["gain"], 0.02)
        self.assertLess(after["jitter_mm"], before["jitter_mm"])
        self.assertEqual(done["frames"], {"taught": 67, "held_out": 23, "left_out": 0})
        self.done("retarget", "--source", "walk/source.h5", "--target", "walk/target.ply", "--weights", "own.safetensors", "--out", "r.h5")

    def test_frames_that_teach_nothing(self):
        self.person(frames=60)
        self.done("retarget", "--source", "walk/source.h5", "--target", "walk/target.ply", "--weights", WEIGHTS, "--out", "frames/")
        names = sorted(os.listdir(self.path("frames")))
        for name in names[40:]:  # the whole held-out part, and a little more
            with open(self.path("frames/" + name), "w") as f:
                f.write("ply\n")
        call = ["adapt", "--weights", WEIGHTS, "--steps", "80", "--batch", "8", "--samples", "4", "--json", "--out", "w.safetensors"]
        result = self.restage(*call, "--source", "frames/", "--source", "walk/source.h5")
        self.assertEqual(result.code, 0, result.err)
        self.assertEqual(json.loads(result.out)["frames"], {"taught": 85, "held_out": 30, "left_out": 5})
        self.assertIn("teaching nothing: 5 frames", result.err)
        self.assertIn(names[40], result.err)
        self.assertIsNone(json.loads(result.out)["before"]["confidence"])  # lite does not say how sure it is
        self.bad_input([*call, "--source", "frames/"], "held-out")
        for frame in range(4):
            self.ply("far/f%d.ply" % frame, [(0.1 * k, 0.05 * k, 0) for k in range(90)] + [(k * 1e29, 0, 0) for k in range(1, 40)])
        self.bad_input([*call, "--source", "far/", "--force"], "far/f0.ply", "20 m apart")

    def test_bad_input(self):
        self.person(frames=12)
        call = ["adapt", "--source", "walk/source.h5", "--weights", WEIGHTS]
        self.bad_input([*call, "--out", "w.safetensors"], "walk/source.h5", "too few")
        self.bad_input([*call, "--out", "w.h5"], "w.h5", ".safetensors")
        for option, value in (("--steps", "0"), ("--rate", "nan"), ("--samples", "0"), ("--held-out", "1"), ("--batch", "0")):
            self.bad_input([*call, "--out", "w.safetensors", option, value], option)
        self.bad_input(["adapt", "--source", "walk/source.h5", "--source", "none/", "--weights", WEIGHTS, "--out", "w.safetensors"], "none")
        self.bad_input(["adapt", "--source", "walk/source.h5", "--scale", "0.001", "--weights", WEIGHTS, "--out", "w.safetensors"], "walk/source.h5")
        self.assertFalse(os.path.exists(self.path("w.safetensors")))


if __name__ == "__main__":
    unittest.main()
