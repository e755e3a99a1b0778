"""restage skeleton: joints of clouds."""
import math
import os
import random
import struct

from support import CliTest, points, small_disk
from tiny_run import weights


class Skeleton(CliTest):
    def setUp(self):
        super().setUp()
        self.w = weights("tiny")
        self.cloud = points(300, 1)

    def joints(self, name, *options):
        frames = self.json("skeleton", "--weights", self.w, "--source", name, *options)["frames"]
        for frame in frames:
            self.assertEqual((len(frame["joints"]), {len(p) for p in frame["joints"]}), (22, {3}))
        return [frame["joints"] for frame in frames]


class Joints(Skeleton):
    def test_one_cloud(self):
        self.ply("a.ply", self.cloud)
        found = self.json("skeleton", "--weights", self.w, "--source", "a.ply")
        self.assertEqual([f["source"] for f in found["frames"]], ["a.ply"])
        self.assertEqual(found["seed"], 0)
        text = self.done("skeleton", "--weights", self.w, "--source", "a.ply")
        self.assertIn("left_wrist", text.lower().replace(" ", "_"))
        self.assertIn("seed 0", text)

    def test_frames_without_points(self):
        for f, cloud in enumerate((self.cloud, [], self.cloud)):
            self.ply("in/f%d.ply" % f, cloud)
        self.assertIn("1 frame without points", self.restage("skeleton", "--weights", self.w, "--source", "in", "--out", "j.h5").err)
        self.assertEqual({k: v for k, v in self.json("data", "inspect", "j.h5")["counts"].items() if k in ("frames", "filled")}, {"frames": 3, "filled": 1})
        self.assertEqual(len(self.joints("in")), 2)
        self.write("in/f1.ply", "ply")
        self.bad_input(["skeleton", "--weights", self.w, "--source", "in"], "in/f1.ply", "doctor --fix")

    def test_frames_before_the_first_with_points_keep_their_time(self):
        for f, cloud in enumerate(([], [], points(300, 2), [], self.cloud)):
            self.ply("in/f%d.ply" % f, cloud)
        result = self.restage("skeleton", "--weights", self.w, "--source", "in", "--out", "j.h5")
        self.assertIn("3 frames without points", result.err)
        counts = self.json("data", "inspect", "j.h5")["counts"]
        self.assertEqual((counts["frames"], counts["filled"]), (5, 3))
        first, last = ([x for p in joints for x in p] for joints in self.joints("in"))
        self.h5("truth.h5", joints=([5, 22, 3], first * 4 + last))
        self.assertLess(self.json("eval", "--pred", "j.h5", "--truth", "truth.h5")["mean"]["mpjpe"], 1e-6)

    def test_one_of_several_sequences(self):
        flat = [[x for p in points(300, k) for x in p] for k in range(3)]
        self.h5("two.h5", vertices=([3, 300, 3], flat[0] + flat[1] + flat[2], "float32"), sequence_offset=([3], [0, 1, 3], "int64"))
        self.bad_input(["skeleton", "--weights", self.w, "--source", "two.h5", "--out", "j.h5"], "two.h5", "holds 2 sequences", "--sequence N")
        self.h5("second.h5", vertices=([2, 300, 3], flat[1] + flat[2], "float32"))
        self.assertEqual(self.joints("two.h5", "--sequence", 1), self.joints("second.h5"))
        self.bad_input(["skeleton", "--weights", self.w, "--source", "two.h5", "--sequence", 2], "two.h5", "sequence")

    def test_an_extractor_that_knows_says_how_far_it_may_be_off(self):
        self.ply("a.ply", self.cloud)
        sure = weights("sure", "skeleton.sizes.uncertainty=true", "stages=[skeleton]")
        call = ("skeleton", "--weights", sure, "--source", "a.ply")
        radius = self.json(*call)["frames"][0]["radius"]
        self.assertEqual(len(radius), 22)
        self.assertIn("+- %.3f" % radius[21], self.done(*call))
        self.done(*call, "--out", "claimed.h5")
        evaluated = ("eval", "--pred", "claimed.h5", "--truth", "claimed.h5")
        self.assertEqual(self.json(*evaluated)["joints_within_radius"], 1)
        self.assertIn("100.0 % of the true joints", self.done(*evaluated))
        self.assertNotIn("radius", self.json("skeleton", "--weights", self.w, "--source", "a.ply")["frames"][0])

    def test_order_of_points_does_not_matter(self):
        for count in (64, 300, 1200):
            cloud = points(count, count)
            self.ply("a.ply", cloud)
            random.Random(1).shuffle(cloud)
            self.ply("b.ply", cloud)
            self.write("c.obj", "".join("v %r %r %r\n" % struct.unpack("<3f", struct.pack("<3f", *p)) for p in reversed(cloud)))
            a = self.joints("a.ply")
            self.assertEqual(a, self.joints("b.ply"))
            self.assertEqual(a, self.joints("c.obj"))
            self.assertNotEqual(a, self.joints("a.ply", "--seed", "1") if count != 64 else None)

    def test_any_number_of_threads_and_samples(self):
        self.ply("a.ply", self.cloud)
        results = [self.done("skeleton", "--weights", self.w, "--source", "a.ply", "--json", "--samples", "8", "--threads", n) for n in (1, 2, 3)]
        self.assertEqual(results[0], results[1])
        self.assertEqual(results[0], results[2])

    def test_folder_in_natural_order(self):
        clouds = {i: points(100 + i, i) for i in (1, 2, 10)}
        for i, cloud in clouds.items():
            self.ply("scans/f%d.ply" % i, cloud)
            self.ply("one%d.ply" % i, cloud)
        found = self.json("skeleton", "--weights", self.w, "--source", "scans")["frames"]
        self.assertEqual([os.path.basename(f["source"]) for f in found], ["f1.ply", "f2.ply", "f10.ply"])
        for frame, i in zip(found, clouds):
            self.assertEqual(frame["joints"], self.joints("one%d.ply" % i)[0])

    def test_hdf5_in_and_out(self):
        flat = [x for p in self.cloud for x in p]
        self.h5("in.h5", vertices=([2, 300, 3], flat * 2, "float32"))
        self.ply("a.ply", self.cloud)
        self.assertEqual(self.joints("in.h5"), self.joints("a.ply") * 2)
        self.assertIn("j.h5", self.done("skeleton", "--weights", self.w, "--source", "in.h5", "--out", "j.h5"))
        counts = self.json("data", "inspect", "j.h5")["counts"]
        self.assertEqual(counts["frames"], 2)
        truth = [x for p in self.joints("a.ply")[0] for x in p]
        self.h5("truth.h5", joints=([2, 22, 3], truth * 2))
        self.assertLess(self.json("eval", "--pred", "j.h5", "--truth", "truth.h5")["mean"]["mpjpe"], 1e-6)

    def test_run_directory_as_weights(self):
        os.mkdir(self.path("run"))
        with open(self.w, "rb") as f:
            self.write("run/weights.safetensors", f.read())
        self.ply("a.ply", self.cloud)
        self.assertEqual(self.json("skeleton", "--weights", "run", "--source", "a.ply")["frames"],
                         self.json("skeleton", "--weights", self.w, "--source", "a.ply")["frames"])


    def test_weights_that_come_with_the_program_have_names(self):
        self.ply("a.ply", self.cloud)
        call = ("skeleton", "--source", "a.ply")
        self.assertEqual(self.json(*call, "--weights", "lite"), self.json(*call, "--weights", "experiments/weights/lite.safetensors"))
        standard = self.json(*call)["frames"][0]
        self.assertIn("radius", standard)
        self.bad_input([*call, "--weights", "standart"], "standart", "standard or lite")
        os.mkdir(self.path("standard"))  # of clouds, say
        self.assertEqual(standard, self.json(*call, "--weights", "standard")["frames"][0])
        os.rmdir(self.path("standard"))
        os.symlink(self.w, self.path("standard"))
        self.assertNotIn("radius", self.json(*call, "--weights", "standard")["frames"][0], "one's own file comes first")


class AnyWayUp(CliTest):
    """Who lies or stands on the hands is seen as well as who stands: no training showed such clouds."""

    def seen(self, cloud):
        self.ply("cloud.ply", cloud)
        return self.json("skeleton", "--weights", "standard", "--source", "cloud.ply")["frames"][0]["joints"]

    def turned(self, points, axis, degrees):
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        if axis == "x":
            return [(x, c * y - s * z, s * y + c * z) for x, y, z in points]
        return [(c * x - s * y, s * x + c * y, z) for x, y, z in points]

    def test_one_cloud_turned_about_any_axis(self):
        cloud = self.person()
        upright = self.seen(cloud)
        for axis, degrees in (("x", 40), ("x", 90), ("x", -90), ("x", 180), ("z", 60), ("z", -90), ("z", 130)):
            found = self.turned(self.seen(self.turned(cloud, axis, degrees)), axis, -degrees)
            apart = sum(math.dist(a, b) for a, b in zip(found, upright)) / 22
            self.assertLess(apart, 0.02, (axis, degrees))


class BadClouds(Skeleton):
    def bad(self, name, *contains, w=None, more=()):
        self.bad_input(["skeleton", "--weights", w or self.w, "--source", name, *more], *contains)

    def test_clouds(self):
        good = self.bytes(self.ply("good.ply", self.cloud, [(0, 1, 2)]))
        bad = lambda name, *words: self.bad(name, name, *words)
        bad("none.ply")
        for part in (0.9, 0.2, 0.01):
            bad(self.write("cut.ply", good[:int(len(good) * part)]))
        bad(self.ply("empty.ply", []))
        for name, point in (("nan.ply", (0, float("nan"), 0)), ("inf.ply", (0, 0, float("-inf")))):
            done = self.restage("skeleton", "--weights", self.w, "--source", self.ply(name, self.cloud + [point]))
            self.assertEqual(done.code, 0, done.err)
            self.assertIn(name + ": left out 1 point whose", done.err)
        bad(self.ply("three.ply", points(3, 1)), "3 distinct points")
        bad(self.ply("same.ply", points(63, 1) * 20), "63 distinct points")
        bad(self.ply("huge.ply", [(3e38 * (-1) ** i, 3e38, z) for i, (_, _, z) in enumerate(self.cloud)]))
        bad(self.ply("face.ply", self.cloud, [(0, 1, 300)]), "face")
        bad(self.write("what.xyz", "1 2 3\n"))
        bad(self.ply("mm.ply", [(1e3 * x, 1e3 * y, 1e3 * z) for x, y, z in self.cloud]), "another size", "doctor --fix")
        self.bad("x" * 3000)

    def test_later_frames(self):
        for i in range(3):
            self.ply("scans/%d.ply" % i, points(100, i))
        self.ply("scans/3.ply", points(3, 1))
        self.bad("scans", "scans/3.ply", "3 distinct")
        self.bad("scans", "scans/3.ply", more=["--out", "j.h5"])
        self.bad("scans", "scans/3.ply", more=["--json"])
        os.mkdir(self.path("hollow"))
        self.bad("hollow", "hollow")

    def test_hdf5(self):
        self.h5("joints.h5", joints=([2, 22, 3], [0.0]))
        self.bad("joints.h5", "joints.h5")
        self.h5("shape.h5", vertices=([2, 100, 2], [0.0]))
        self.bad("shape.h5", "shape.h5")
        self.bad(self.write("text.h5", "no HDF5\n"), "text.h5")

    def test_weights(self):
        self.ply("a.ply", self.cloud)
        bad = lambda name, *words: self.bad("a.ply", name, *words, w=name)
        bad("none.safetensors")
        with open(self.w, "rb") as f:
            whole = f.read()
        bad(self.write("cut.safetensors", whole[:-100]))
        bad(self.write("noise.safetensors", b"\xff" * 1000))
        bad(weights("other", "stages=[deformation]"), "skeleton")
        os.mkdir(self.path("unfinished"))
        bad("unfinished")
        self.bad("a.ply", w="x" * 3000)

    def test_options(self):
        self.ply("a.ply", self.cloud)
        self.bad("a.ply", "--samples", more=["--samples", "0"])
        self.bad("a.ply", "nowhere", more=["--out", "nowhere/j.h5"])
        self.bad_input(["skeleton", "--weights", self.w], "--source")
        told = self.restage("skeleton", "--source", "a.ply")  # the standard weights, which see nobody there
        self.assertEqual(told.code, 0)
        self.assertIn("a.ply: the networks are unsure of most frames", told.err)

    def test_full_disk(self):
        for i in range(40):
            self.ply("scans/%d.ply" % i, points(100, i))
        before = sorted(os.listdir(self.folder))
        self.one_line(self.restage("skeleton", "--weights", self.w, "--source", "scans", "--out", "j.h5", before=small_disk), 1, "j.h5")
        self.assertEqual(sorted(os.listdir(self.folder)), before)
