"""restage assess: what a capture's joints show without a truth."""
import os
import unittest

from support import ROOT, CliTest

WEIGHTS = os.path.join(ROOT, "experiments", "weights", "lite.safetensors")
KEYS = {"frames", "bone_length_sd_mm", "swaps", "jitter_mm", "surface_mm", "confidence", "floor_mm"}


class Assess(CliTest):
    def test_figures_of_a_capture(self):
        self.person(frames=30)
        call = ["assess", "walk/source.h5", "--weights", WEIGHTS]
        found = self.json(*call)
        self.assertLessEqual(KEYS, set(found))
        self.assertEqual(found["frames"], 30)
        for key in ("bone_length_sd_mm", "jitter_mm", "surface_mm"):
            self.assertGreater(found[key], 0.1, key)
            self.assertLess(found[key], 200, key)
        self.assertLessEqual(found["swaps"], 0.5)
        self.assertEqual(self.json(*call, "--threads", "1"), found)
        self.assertIn("bone lengths", self.done(*call))

    def test_bad_input(self):
        self.write("empty/readme.txt", "nothing")
        self.bad_input(["assess", "empty/", "--weights", WEIGHTS], "empty")
        self.ply("few/f1.ply", [(0.1 * k, 0.05 * k, 0) for k in range(9)])
        self.bad_input(["assess", "few/", "--weights", WEIGHTS, "--force"], "few", "person")
        self.bad_input(["assess", "few/", "--weights", WEIGHTS, "--samples", "0"], "--samples")


if __name__ == "__main__":
    unittest.main()
