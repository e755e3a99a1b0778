"""restage eval."""
import math
import os
import shutil

from support import CliTest, numbers

METRICS = ["mpjpe", "pa_mpjpe", "acc", "pa_acc", "mpvd", "pa_mpvd", "medl", "pmd", "pmd_npt"]
F, V = 6, 12


class Eval(CliTest):
    def setUp(self):
        super().setUp()
        self.joints, self.vertices = numbers(F * 66, 1), numbers(F * V * 3, 2)
        self.h5("truth.h5", joints=([F, 22, 3], self.joints), vertices=([F, V, 3], self.vertices))
        self.h5("pred.h5", joints=([F, 22, 3], [x + 0.1 for x in self.joints]),
                vertices=([F, V, 3], [x + (0.2 if i % 3 == 1 else 0) for i, x in enumerate(self.vertices)], "float64"))

    def eval(self, pred, truth, *more):
        return self.json("eval", "--pred", pred, "--truth", truth, *more)

    def test_values(self):
        result = self.eval("pred.h5", "truth.h5")
        self.assertEqual(list(result), ["mean", "sequences"])
        self.assertEqual(list(result["mean"]), METRICS)
        self.assertEqual(list(result["sequences"][0]), ["frames"] + METRICS)
        self.assertEqual(result["sequences"][0]["frames"], F)
        for key, want in (("mpjpe", 0.1 * math.sqrt(3)), ("pa_mpjpe", 0), ("acc", 0), ("mpvd", 0.2), ("pa_mpvd", 0), ("medl", 0),
                          ("pmd", 0.04), ("pmd_npt", 0)):
            self.assertAlmostEqual(result["mean"][key], want, places=11, msg=key)

    def test_sequences_count_equally(self):
        offset = ([3], [0, 2, F], "int64")
        self.h5("two.h5", joints=([F, 22, 3], [x + (0.3 if i < 2 * 66 else 0.1) for i, x in enumerate(self.joints)]), sequence_offset=offset)
        result = self.eval("two.h5", "truth.h5")
        self.assertEqual([s["frames"] for s in result["sequences"]], [2, F - 2])
        self.assertAlmostEqual(result["mean"]["mpjpe"], 0.2 * math.sqrt(3), places=11)
        self.assertIsNone(result["sequences"][0]["acc"])
        self.assertIsNone(result["mean"]["mpvd"])
        self.assertAlmostEqual(result["mean"]["acc"], result["sequences"][1]["acc"], places=15)

    def test_what_cannot_be_computed_is_null(self):
        self.h5("flat.h5", joints=([F, 22, 3], [0.5]), vertices=([F, V, 3], self.vertices))
        mean = self.eval("flat.h5", "truth.h5")["mean"]
        self.assertIsNone(mean["pa_mpjpe"])
        self.assertIsNotNone(mean["mpjpe"])
        self.h5("few.h5", vertices=([F, 5, 3], numbers(F * 15, 3), "float32"))
        mean = self.eval("few.h5", "few.h5")["mean"]
        self.assertEqual((mean["mpjpe"], mean["medl"], mean["mpvd"]), (None, None, 0))

    def test_references(self):
        self.h5("rest.h5", joints=([1, 22, 3], numbers(66, 4)))
        references = self.eval("pred.h5", "truth.h5", "--source", "truth.h5", "--rest", "rest.h5")["references"]
        self.assertEqual(list(references), ["rest_pose", "source_unchanged", "closed_form"])
        self.assertEqual(references["source_unchanged"]["mpjpe"], 0)
        self.assertGreater(references["rest_pose"]["pa_mpjpe"], 0.1)
        self.assertIsNone(references["closed_form"]["mpvd"])
        self.assertEqual(list(references["closed_form"]), METRICS)
        # A body whose rest pose is the source's first frame: nothing is left to do in that frame.
        self.h5("first.h5", joints=([1, 22, 3], self.joints[:66]))
        self.h5("still.h5", joints=([2, 22, 3], self.joints[:66] * 2))
        references = self.eval("still.h5", "still.h5", "--source", "still.h5", "--rest", "first.h5")["references"]
        self.assertAlmostEqual(references["closed_form"]["mpjpe"], 0, places=9)
        self.assertAlmostEqual(references["rest_pose"]["mpjpe"], 0, places=9)

    def test_every(self):
        kept = [x + 0.1 for f in (0, 2, 4) for x in self.joints[66 * f:66 * (f + 1)]]
        self.h5("seconds.h5", joints=([3, 22, 3], kept))
        result = self.eval("seconds.h5", "truth.h5", "--every", 2)
        self.assertEqual(result["sequences"][0]["frames"], 3)
        self.assertAlmostEqual(result["mean"]["mpjpe"], 0.1 * math.sqrt(3), places=11)
        self.assertIsNone(result["mean"]["acc"])  # a second apart nothing is an acceleration
        self.h5("rest.h5", joints=([1, 22, 3], numbers(66, 4)))
        references = self.eval("seconds.h5", "truth.h5", "--every", 2, "--source", "truth.h5", "--rest", "rest.h5")["references"]
        self.assertEqual(references["source_unchanged"]["mpjpe"], 0)
        # Each sequence from its own first frame: 0, 2 of the first three frames and 3, 5 of the others.
        self.h5("two.h5", joints=([F, 22, 3], self.joints), sequence_offset=([3], [0, 3, F], "int64"))
        kept = [x for f in (0, 2, 3, 5) for x in self.joints[66 * f:66 * (f + 1)]]
        self.h5("four.h5", joints=([4, 22, 3], kept), sequence_offset=([3], [0, 2, 4], "int64"))
        result = self.eval("four.h5", "two.h5", "--every", 2)
        self.assertEqual([s["mpjpe"] for s in result["sequences"]], [0, 0])
        self.bad_input(["eval", "--pred", "pred.h5", "--truth", "truth.h5", "--every", 2], "frames")
        self.bad_input(["eval", "--pred", "pred.h5", "--truth", "truth.h5", "--every", 0], "--every")

    def test_mended_scans(self):
        # Scans in centimetres, x of theirs the world's y, y its z, z its x, and 1, 2, 3 m away. The doctor takes them
        # for decimetres, turns them by a quarter about y, and moves them to an origin of its own.
        places = [self.joints[3 * i:3 * i + 3] for i in range(F * 22)]
        scanned = [[100 * (y - 2), 100 * (z - 3), 100 * (x - 1)] for x, y, z in places]
        mended = [[-0.1 * (y - 6), 0.1 * (x - 5), 0.1 * (z - 7)] for x, y, z in scanned]
        flat = lambda rows: [x for row in rows for x in row]
        self.h5("truth.h5", joints=([F, 22, 3], self.joints),
                source_to_world=([3, 4], [0, 0, 0.01, 1, 0.01, 0, 0, 2, 0, 0.01, 0, 3]))
        self.h5("source.h5", joints=([F, 22, 3], flat(scanned)))
        self.h5("rest.h5", joints=([1, 22, 3], self.joints[:66]))  # of the source's own size: the path is not stretched
        note = '{"scale": 0.1, "rotation": [[0, -1, 0], [1, 0, 0], [0, 0, 1]], "offset": [5, 6, 7]}'
        self.h5("mended.h5", {"transform": note}, points=([1, 3], [0]), frame_offset=([2], [0, 1], "int64"))
        # What an ideal system would answer from them, of the size that it is: a tenth of what the doctor made of it.
        self.h5("pred.h5", joints=([F, 22, 3], [0.1 * x for x in flat(mended)]))
        files = ["--source", "source.h5", "--rest", "rest.h5"]
        result = self.eval("pred.h5", "truth.h5", "--mended", "mended.h5", *files)
        self.assertAlmostEqual(result["mean"]["mpjpe"], 0, places=9)
        self.assertAlmostEqual(result["mended"]["scale_error"], 10)
        self.assertAlmostEqual(result["mended"]["tilt_degrees"], 0)
        self.assertAlmostEqual(result["references"]["source_unchanged"]["mpjpe"], 0, places=9)
        half = 0.5 ** 0.5  # rotations come into the world, too
        self.h5("truth.h5", joints=([F, 22, 3], self.joints), rotations=([F, 22, 4], [0.5] * (88 * F)),
                source_to_world=([3, 4], [0, 0, 0.01, 1, 0.01, 0, 0, 2, 0, 0.01, 0, 3]))
        self.h5("pred.h5", joints=([F, 22, 3], [0.1 * x for x in flat(mended)]),
                rotations=([F, 22, 4], [half, 0, 0, half] * (22 * F)))
        self.assertAlmostEqual(self.eval("pred.h5", "truth.h5", "--mended", "mended.h5", *files)["rotation_deg"], 0, places=5)
        bad = lambda *words: self.bad_input(["eval", "--pred", "pred.h5", "--truth", "truth.h5", "--mended", "mended.h5", *files], *words)
        self.bad_input(["eval", "--pred", "pred.h5", "--truth", "truth.h5", "--mended", "mended.h5"], "--source")
        for text in ("", "{}", note.replace("0.1", "-1"), note.replace("[5, 6, 7]", "[5]"), note.replace("[5, 6, 7]", '"x"')):
            self.h5("mended.h5", {"transform": text}, points=([1, 3], [0]), frame_offset=([2], [0, 1], "int64"))
            bad("mended.h5", "how it was mended")
        self.h5("truth.h5", joints=([F, 22, 3], self.joints))
        bad("truth.h5", "where its scans are")
        self.h5("truth.h5", joints=([F, 22, 3], self.joints), source_to_world=([3, 4], [0]))
        bad("source_to_world")

    def test_table(self):
        self.h5("rest.h5", joints=([1, 22, 3], numbers(66, 4)))
        text = self.done("eval", "--pred", "pred.h5", "--truth", "truth.h5", "--source", "truth.h5", "--rest", "rest.h5", "--per-joint")
        for words in ("| prediction", "| rest pose", "| source unchanged", "| closed form", "PA-MPJPE [m]", "| left_wrist"):
            self.assertIn(words, text)

    def test_rotations(self):
        one = [1, 0, 0, 0] * (22 * F)
        turned = [0.5, 0, 3 ** 0.5 / 2, 0] + one[4:]  # 120 degrees, of the first joint in the first frame
        self.h5("pred.h5", joints=([F, 22, 3], self.joints), rotations=([F, 22, 4], turned))
        self.assertNotIn("rotation_deg", self.eval("pred.h5", "truth.h5"))
        self.h5("truth.h5", joints=([F, 22, 3], self.joints), rotations=([F, 22, 4], one))
        result = self.eval("pred.h5", "truth.h5", "--per-joint")
        self.assertAlmostEqual(result["rotation_deg"], 120 / (22 * F))
        self.assertAlmostEqual(result["rotation_over_90"], 1 / (22 * F))
        self.assertAlmostEqual(result["rotation_deg_by_joint"]["pelvis"], 120 / F)
        self.h5("first.h5", joints=([1, 22, 3], self.joints[:66]), rotations=([1, 22, 4], turned[:88]))
        self.assertAlmostEqual(self.eval("first.h5", "truth.h5", "--every", F)["rotation_deg"], 120 / 22)
        self.assertAlmostEqual(self.eval("pred.h5", "truth.h5", "--variants")["mean"]["rotation_deg"], 120 / (22 * F))
        self.h5("truth.h5", joints=([F, 22, 3], self.joints), rotations=([F, 22, 4], [2, 0, 0, 0] * (22 * F)))
        self.bad_input(["eval", "--pred", "pred.h5", "--truth", "truth.h5"], "rotations", "unit quaternion")

    def test_same_bits_for_any_number_of_threads(self):
        outputs = {self.done("eval", "--pred", "pred.h5", "--truth", "truth.h5", "--json", "--variants", "--threads", n) for n in (1, 2, 3)}
        self.assertEqual(len(outputs), 1)

    def test_bad_input(self):
        bad = lambda pred, *words: self.bad_input(["eval", "--pred", pred, "--truth", "truth.h5"], *words)
        bad("none.h5", "none.h5")
        bad(self.write("text.h5", "hello"), "text.h5")
        bad(self.h5("empty.h5"), "empty.h5", "joints")
        bad(self.h5("shape.h5", joints=([F, 21, 3], [0.0])), "shape.h5:/joints")
        bad(self.h5("short.h5", joints=([F - 1, 22, 3], [0.0])), "frames")
        bad(self.h5("other.h5", vertices=([F, V + 1, 3], [0.0])), "vertices")
        bad(self.h5("nan.h5", joints=([F, 22, 3], ["nan"])), "nan.h5:/joints")
        bad(self.h5("version.h5", {"restage_schema": 99}, joints=([F, 22, 3], [0.0])), "version")
        bad(self.h5("offset.h5", joints=([F, 22, 3], [0.0]), sequence_offset=([2], [0, F + 1], "int64")), "sequence_offset")
        content = self.bytes("truth.h5")
        for part in (0.95, 0.5, 0.1):
            bad(self.write("cut.h5", content[:int(len(content) * part)]), "cut.h5")
        self.bad_input(["eval", "--pred", "pred.h5", "--truth", "truth.h5", "--source", "truth.h5"], "--rest")
        self.bad_input(["eval", "--pred", ".", "--truth", "truth.h5", "--source", "truth.h5"], "--rest")

    def meshes(self, folder, frames=range(F), vertices=V):
        for f in frames:
            points = [self.vertices[3 * (f * V + v):][:3] for v in range(vertices)]
            self.write("%s/%d.obj" % (folder, f), "".join("v %.9g %.9g %.9g\n" % (x, y + 0.1, z) for x, y, z in points))

    def test_meshes_of_any_program(self):
        self.meshes("frames")
        self.meshes("two/take2", range(2))
        self.meshes("two/take10", range(2, F))
        self.h5("two.h5", vertices=([F, V, 3], self.vertices), sequence_offset=([3], [0, 2, F], "int64"))
        for pred, truth, sequences in (("frames", "truth.h5", [F]), ("two", "two.h5", [2, F - 2]), ("frames", "two.h5", [2, F - 2])):
            result = self.eval(pred, truth)
            self.assertAlmostEqual(result["mean"]["mpvd"], 0.1, 5)
            self.assertAlmostEqual(result["mean"]["pa_mpvd"], 0, 5)
            self.assertIsNone(result["mean"]["mpjpe"])
            self.assertEqual([s["frames"] for s in result["sequences"]], sequences)
        self.assertAlmostEqual(self.eval("frames", "truth.h5", "--every", 1)["mean"]["mpvd"], 0.1, 5)

    def test_folders_that_are_no_prediction(self):
        bad = lambda pred, *words: self.bad_input(["eval", "--pred", pred, "--truth", "truth.h5"], *words)
        os.makedirs(self.path("nothing"))
        bad("nothing", "nothing", "holds no PLY")
        self.meshes("both")
        self.meshes("both/more")
        bad("both", "both/0.obj", "may be a frame", "beside folders")
        self.meshes("few", range(F - 1))
        bad("few", "few", "has 5 frames", "has 6")
        self.meshes("gap", [0, 1, 3, 4, 5])
        bad("gap", "has 5 frames", "missing after gap/1.obj")
        self.meshes("gap", [3])
        os.rename(self.path("gap/3.obj"), self.path("gap/9.obj"))
        shutil.copy(self.path("gap/5.obj"), self.path("gap/3.obj"))
        told = self.restage("eval", "--pred", "gap", "--truth", "truth.h5")
        self.assertEqual(told.code, 0, told.err)
        self.assertIn("warning: gap: frames are missing after gap/1.obj", told.err)
        self.meshes("other", vertices=V - 1)
        bad("other", "11 vertices", "truth.h5 has 12")
        self.meshes("mixed", range(3))
        self.meshes("mixed", range(3, F), V - 1)
        bad("mixed", "mixed/3.obj", "has 11 vertices")
        self.meshes("nan", range(1, F))
        self.write("nan/0.obj", "v nan 0 0\n" * V)
        bad("nan", "nan/0.obj", "no numbers")
