"""H4D's first stage: trained, measured, used, refused."""
import os
import subprocess
import unittest

from support import MAKE_H5, ROOT, CliTest

SMOKE = os.path.join(ROOT, "configs", "h4d", "smoke.yaml")
MAKE_CORPUS = os.path.join(os.path.dirname(MAKE_H5), "make_corpus")


class H4d(CliTest):
    def setUp(self):
        super().setUp()
        subprocess.run([MAKE_CORPUS, self.path("boxes.h5")], check=True)

    def trained(self, *overrides):
        return self.done("train", SMOKE, "--quiet", "data.source=boxes.h5", *overrides).strip()

    def test_it_is_trained_measured_and_used(self):
        weights = self.trained()
        said = self.json("eval", "run=" + weights)
        self.assertGreater(said["mean"]["mpvd"], 0)
        self.assertGreater(said["mean"]["mpjpe"], 0)
        cloud = [(0.2 * (k % 7) - 0.6, 0.05 * (k % 35), 0.1 * (k % 3)) for k in range(300)]
        for f in range(4):  # fewer than a window has
            self.ply("scans/f%d.ply" % f, [(x + 0.1 * f, y, z) for x, y, z in cloud])
        self.ply("hero.ply", cloud[:120])
        call = ["retarget", "--system", "h4d", "--force", "--source", "scans", "--target", "hero.ply", "--weights", weights]
        self.assertEqual(self.json(*call, "--out", "frames/")["frames"], 4)
        first = self.bytes("frames/frame_000001.ply")
        self.done(*call, "--out", "again/", "--threads", "1")
        self.assertEqual(self.bytes("again/frame_000001.ply"), first)
        for name in ("hero.glb", "hero.h5", "hero.bvh"):
            self.done(*call, "--out", name)
        self.bad_input(call + ["--out", "x/", "--fps", "60"], "60 frames a second")
        self.bad_input(["retarget", "--force", "--source", "scans", "--target", "hero.ply", "--weights", weights, "--out", "x/"], "no model for skeleton")

    def test_the_same_bits_again_and_for_other_threads(self):
        one = self.bytes(os.path.join(self.trained(), "weights.safetensors"))
        self.assertEqual(self.bytes(os.path.join(self.trained("--threads", "1"), "weights.safetensors")), one)

    def test_refusals(self):
        call = ["train", SMOKE, "--quiet"]
        self.bad_input(call + ["data.one_mesh=false", "data.bodies={train: 2, validation: 1, test: 1}",
                               "data.motions={train: 2, validation: 1, test: 1}"], "one topology", "benchmark")
        call.append("data.source=boxes.h5")
        self.bad_input(call + ["codes.sizes={pose: 72}"], "sizes.pose")
        self.bad_input(call + ["codes.sizes={frames: 60}"], "no motion has 60 frames")
        self.bad_input(call + ["codes.windows.points=0"], "points")


if __name__ == "__main__":
    unittest.main()
