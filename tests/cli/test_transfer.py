"""Networks that move a mesh without a skeleton: trained, measured, used, refused."""
import os
import subprocess
import unittest

from support import MAKE_H5, ROOT, CliTest
from tiny_run import CONFIG

TRANSFER = CONFIG.replace("test: 1}\n  motions", "test: 2}\n  motions") + """
stages: [transfer]
transfer:
  model: transfer/npt_pool
  sizes: {widths: [8, 8, 13]}
  optimiser: {steps: 6, batch: 2}
  pairs: {points: 64, vertices: 100}
  validation_pairs: 2
evaluation: {system: transfer, sequences: 1, frames: 5}
"""
MAKE_CORPUS = os.path.join(os.path.dirname(MAKE_H5), "make_corpus")
SIZES = {"npt": "{widths: [8, 8, 13]}", "lart": "{widths: [8, 8, 16]}", "corenet": "{widths: [8, 8, 8], generator: [8, 8, 8], blocks: 1}"}


class Transfer(CliTest):
    def setUp(self):
        super().setUp()
        self.write("t.yaml", TRANSFER)

    def trained(self, *overrides):
        return self.done("train", "t.yaml", "--quiet", *overrides).strip()

    def test_every_network_is_trained_and_measured(self):
        for model, more in (("npt", ["transfer.pairs.points=0"]), ("lart", ["transfer.loss.metric=0.1", "transfer.loss.edge_reference=truth"]),
                            ("corenet", ["transfer.loss.reconstruction=1000"])):
            run = self.trained("name=" + model, "transfer.model=transfer/" + model, "transfer.sizes=" + SIZES[model], *more)
            said = self.json("eval", "run=" + run)
            self.assertGreater(said["mean"]["mpvd"], 0, model)
            self.assertIsNone(said["mean"]["mpjpe"], model)

    def test_smoke_configurations(self):
        for system in ("npt", "lart", "corenet", "tst"):
            run = self.done("train", os.path.join(ROOT, "configs", system, "smoke.yaml"), "--quiet").strip()
            self.assertGreater(self.json("eval", "run=" + run)["mean"]["mpvd"], 0, system)

    def test_the_same_bits_again_and_for_other_threads(self):
        one = self.bytes(os.path.join(self.trained(), "weights.safetensors"))
        self.assertEqual(self.bytes(os.path.join(self.trained("--threads", "1"), "weights.safetensors")), one)

    def test_a_mesh_is_moved(self):
        weights = self.trained()
        cloud = [(0.2 * (k % 7) - 0.6, 0.05 * (k % 35), 0.1 * (k % 3)) for k in range(300)]
        for f in range(3):
            self.ply("scans/f%d.ply" % f, [(x + 0.1 * f, y, z) for x, y, z in cloud])
        self.ply("hero.ply", cloud[:120])
        call = ["retarget", "--system", "transfer", "--force", "--source", "scans", "--target", "hero.ply", "--weights", weights]
        said = self.json(*call, "--out", "frames/")
        self.assertEqual(said["frames"], 3)
        first = self.bytes("frames/frame_000001.ply")
        self.done(*call, "--out", "again/")
        self.assertEqual(self.bytes("again/frame_000001.ply"), first)
        self.bad_input(call + ["--out", "x.glb"], "x.glb", "needs a skeleton")
        self.bad_input(call + ["--out", "x.h5"], "x.h5", "end --out in /")
        self.bad_input(call + ["--out", "x/", "--fps", "60"], "60 frames a second")
        for option in (["--samples", "8"], ["--min-confidence", "0.5"], ["--anchor", "1"], ["--no-foot-lock"], ["--no-keep-limbs"], ["--no-steady-bones"],
                       ["--rest", "hero.ply"], ["--floor", "on"]):
            self.bad_input(call + ["--out", "x/", *option], option[0] + " says nothing to --system transfer")
        self.bad_input(["retarget", "--force", "--source", "scans", "--target", "hero.ply", "--weights", weights, "--out", "x/"], "no model for skeleton")

    def test_a_network_that_needs_correspondence(self):
        subprocess.run([MAKE_CORPUS, self.path("boxes.h5")], check=True)
        self.bad_input(["train", os.path.join(ROOT, "configs/tst/smoke.yaml"), "--quiet", "data.one_mesh=false"], "one topology", "data.one_mesh")
        run = self.done("train", os.path.join(ROOT, "configs/tst/smoke.yaml"), "--quiet", "data.source=boxes.h5", "transfer.pairs.vertices=60",
                        "transfer.sizes.vertices=60").strip()
        said = self.json("eval", "run=" + run)
        self.assertGreater(said["mean"]["mpvd"], 0)
        self.assertEqual(said["condition"], "true_vertices")
        self.done("data", "perform", "--bodies", "boxes.h5", "--motions", "boxes.h5", "--out", "truth")
        call = ["retarget", "--system", "transfer", "--force", "--weights", run, "--target", "truth/target.ply", "--out", "frames/"]
        self.done(*call, "--source", "truth/truth.h5")  # the target's own vertices correspond to it
        self.bad_input(call + ["--source", "truth/source.h5"], "source.h5", "vertices in their order")

    def test_refusals(self):
        call = ["train", "t.yaml", "--quiet"]
        self.bad_input(call + ["transfer.pairs.points=200"], "points")
        self.bad_input(call + ["transfer.pairs.vertices=0"], "pairs.vertices")
        self.bad_input(call + ["transfer.loss.metric=1"], "transfer/lart")
        self.bad_input(call + ["transfer.model=transfer/lart", "transfer.sizes={frames: 1, widths: [8, 8, 16]}", "transfer.loss.metric=1"], "two frames")
        tst = ["transfer.model=transfer/tst", "transfer.sizes={widths: [8, 8, 8], vertices: 100, code: 8, hidden: 8}"]
        self.bad_input(call + tst, "shuffle")
        self.bad_input(call + tst + ["transfer.pairs.shuffle=false"], "faces")
        self.bad_input(call + ["data.bodies={train: 1, validation: 1, test: 1}", "transfer.pairs.shuffle=false", "transfer.model=transfer/tst",
                               "transfer.sizes={widths: [8, 8, 8], vertices: 90, code: 8, hidden: 8}"], "made for 90 vertices")
        self.bad_input(call + ["transfer.model=transfer/nbt"], "transfer/npt")
        self.bad_input(call + ["evaluation.system=transfr"], "evaluation.system", "did you mean 'transfer'")
        run = self.done(*call, "transfer.optimiser.steps=1", "evaluation.system=h4d").strip()
        self.bad_input(["eval", "run=" + run], "cannot be judged as evaluation.system=h4d", "no model for codes")


if __name__ == "__main__":
    unittest.main()
