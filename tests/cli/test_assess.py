"""restage assess: what a capture's joints show without a truth."""
import json
import os
import re
import unittest

from support import ROOT, CliTest

WEIGHTS = os.path.join(ROOT, "experiments", "weights", "lite.safetensors")
STANDARD = os.path.join(ROOT, "experiments", "weights", "standard.safetensors")
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

    def test_a_page_of_the_capture(self):
        self.person(frames=12)
        os.makedirs(self.path("walk/frames"))
        self.done("retarget", "--source", "walk/source.h5", "--target", "walk/target.ply", "--weights", WEIGHTS, "--out", "walk/frames/")
        frames = sorted(os.listdir(self.path("walk/frames")))
        with open(self.path(os.path.join("walk/frames", frames[4])), "w") as f:
            f.write("ply\n")  # damaged
        result = self.restage("assess", "walk/frames/", "--weights", STANDARD, "--out", "page.html", "--json")
        self.assertEqual(result.code, 0, result.err)
        found, page = json.loads(result.out), self.bytes("page.html").decode()
        self.assertEqual((found["frames"], found["left_out"]), (11, 1))
        meta = json.loads(re.search(r'<script id="meta" type="application/json">(.*?)</script>', page)[1])
        self.assertEqual([(clip["label"], len(clip["counts"])) for clip in meta["clips"]], [("capture", 12), ("joints found", 12)])
        self.assertEqual(meta["clips"][1]["confidence"][4], 0)
        for said in ("bone lengths, standard deviation: %.4g mm" % found["bone_length_sd_mm"], "bones that vary most", "frames that shake most"):
            self.assertIn(said, page)
        self.bad_input(["assess", "walk/frames/", "--weights", WEIGHTS, "--out", "page.png"], "page.png", ".html")

    def test_frames_left_out_are_no_jitter(self):
        """Where frames are missing the person has gone on: what stands before and behind does not follow each other."""
        self.person(frames=60)
        self.done("retarget", "--source", "walk/source.h5", "--target", "walk/target.ply", "--weights", WEIGHTS, "--out", "frames/")
        names = sorted(os.listdir(self.path("frames")))
        whole = self.json("assess", "frames/", "--weights", WEIGHTS, "--samples", 1)
        for k in (18, 19, 20, 21, 22, 38, 39, 40, 41, 42):
            self.ply(os.path.join("frames", names[k]), [])
        found = self.json("assess", "frames/", "--weights", WEIGHTS, "--samples", 1)
        self.assertEqual((found["frames"], found["left_out"]), (50, 10))
        self.assertLess(found["jitter_mm"], 1.25 * whole["jitter_mm"])
        for frame in found["shakiest_frames"]:
            self.assertNotIn(frame, (15, 16, 17, 23, 24, 25, 35, 36, 37, 43, 44, 45), "beside a gap nothing is measured")

    def test_bad_input(self):
        self.write("empty/readme.txt", "nothing")
        self.bad_input(["assess", "empty/", "--weights", WEIGHTS], "empty")
        self.ply("few/f1.ply", [(0.1 * k, 0.05 * k, 0) for k in range(9)])
        self.bad_input(["assess", "few/", "--weights", WEIGHTS, "--force"], "few", "person")
        self.bad_input(["assess", "few/", "--weights", WEIGHTS, "--samples", "0"], "--samples")


if __name__ == "__main__":
    unittest.main()
