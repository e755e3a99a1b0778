"""restage retarget --system register: retargeting without learning."""
from support import CliTest, points

FRAMES = 5


class Register(CliTest):
    def setUp(self):
        super().setUp()
        self.done("data", "build", "--bodies", 0, 0, 2, "--motions", 0, 0, 1, "--out", "data.h5", "--quiet")
        self.done("data", "perform", "--bodies", "data.h5", "--body", "builtin_test_0", "--target", "builtin_test_1",
                  "--frames", FRAMES, "--out", "walk", "--quiet")

    def call(self, out, *more, source="walk/source.h5", target="walk/target.ply", rest="walk/rest.h5"):
        return ["retarget", "--system", "register", "--source", source, "--target", target, "--rest", rest, "--out", out, *more]

    def test_a_motion(self):
        found = self.json(*self.call("out.h5"))
        self.assertEqual(found["frames"], FRAMES)
        scores = self.json("eval", "--pred", "out.h5", "--truth", "walk/truth.h5", "--source", "walk/source.h5", "--rest", "walk/rest.h5")
        self.assertLess(scores["mean"]["pa_mpjpe"], 0.8 * scores["references"]["rest_pose"]["pa_mpjpe"])
        self.assertLess(scores["mean"]["mpvd"], 0.3)
        # Every other frame, scored against the same truth; and the same bytes for any number of threads.
        for threads in (1, 2):
            self.done(*self.call(f"two{threads}.h5", "--every", 2, "--threads", threads))
        self.assertEqual(self.bytes("two1.h5"), self.bytes("two2.h5"))
        thin = self.json("eval", "--pred", "two1.h5", "--truth", "walk/truth.h5", "--every", 2)
        self.assertEqual(thin["sequences"][0]["frames"], 3)
        self.assertIsNone(thin["mean"]["acc"])

    def test_bad_input(self):
        bad = lambda *words, **files: self.bad_input(self.call("out.h5", **files), *words)
        bad("none.h5", source="none.h5")
        bad("none.ply", target="none.ply")
        bad("none.h5", rest="none.h5")
        bad("truth.h5:/joints", "one skeleton", rest="walk/truth.h5")
        bad("distinct points", target=self.ply("few.ply", points(10, 1)))
        bad("10 places", source=self.ply("few.ply", points(10, 1)))
        self.bad_input(self.call("out.glb", "--every", 2), ".h5")
        self.bad_input(self.call("out.h5", "--every", 0), "--every")
