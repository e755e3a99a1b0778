"""restage retarget where some frames of the source cannot be used: short gaps are filled and reported, long ones refused."""
import json
import os
import shutil
import struct
import tempfile

from support import ROOT, CliTest, points
from tiny_run import TPOSES, weights

FRAMES = 24
STANDARD = os.path.join(ROOT, "experiments", "weights", "standard.safetensors")
NAN = float("nan")


class Gaps(CliTest):
    """A person's scans, 30 a second: a gap may have ten frames."""

    made = None  # what every test begins with

    def setUp(self):
        super().setUp()
        self.w = weights("tposes", *TPOSES)
        if Gaps.made is None:
            self.person(FRAMES)
            self.done("doctor", "walk/source.h5", "--fix", "good/")
            Gaps.made = tempfile.mkdtemp(prefix="restage-cli-")
            self.addClassCleanup(shutil.rmtree, Gaps.made, ignore_errors=True)
            shutil.copytree(self.folder, Gaps.made, dirs_exist_ok=True)
        shutil.copytree(Gaps.made, self.folder, dirs_exist_ok=True)
        self.names = sorted(os.listdir(self.path("good")))
        self.frames = [self.vertices("good/" + name) for name in self.names]
        self.assertEqual(len(self.frames), FRAMES)

    def source(self, name, bad):
        """A copy in which frames are replaced: by points, by the bytes of a file, or (None) by no points."""
        for f, (file, frame) in enumerate(zip(self.names, self.frames)):
            what = bad.get(f, frame)
            if isinstance(what, bytes):
                self.write("%s/%s" % (name, file), what)
            else:
                self.ply("%s/%s" % (name, file), what or [])
        return name

    def call(self, out, *more, source="good", force=False):
        return ["retarget", "--source", source, "--target", "walk/target.ply", "--weights", self.w, "--out", out, *more] + (["--force"] if force else [])

    def filled(self, source, *more, force=False):
        """Frames of the source that are missing, and those of the result that are filled."""
        found = self.json(*self.call("out.h5", *more, source=source, force=force))
        self.assertEqual((found["source_frames"], found["frames"]), (FRAMES, FRAMES))
        self.assertEqual(self.json("data", "inspect", "out.h5")["counts"].get("filled", 0), len(found["filled"]))
        self.done("data", "verify", "out.h5")
        return [m["frame"] for m in found["missing"]], found["filled"], [m["why"] for m in found["missing"]]

    def test_missing_numbers_are_told_at_any_rate(self):
        for k, (name, frame) in enumerate(zip(self.names, self.frames)):
            if k not in (7, 12):
                self.ply("holes/" + name, frame)
        for every in (1, 2, 3):
            result = self.restage(*self.call("out.h5", "--every", every, source="holes"))
            self.assertEqual(result.code, 0, result.err)
            self.assertIn("2 numbers are missing in the names of the frames", result.err, "--every %d" % every)
        self.assertNotIn("missing in the names", self.restage(*self.call("out.h5", "--every", 2)).err)

    def test_every_kind_of_bad_frame(self):
        few, cut = self.frames[0][:10], self.bytes("good/" + self.names[0])[:-30]
        huge = [(100 * x, 100 * y, 100 * z) for x, y, z in self.frames[0]]
        bad = {3: few, 6: None, 9: [(NAN, NAN, NAN)] * 200, 12: cut, 15: huge, 18: [(1, 1, 1)] * 500}
        missing, filled, why = self.filled(self.source("bad", bad))
        self.assertEqual((missing, filled), (sorted(bad), sorted(bad)))
        for f, text in zip(missing, why):
            self.assertIn(self.names[f], text)
        for f, words in ((0, "10 distinct points"), (4, "another size")):
            self.assertIn(words, why[f])
        # What the doctor alone calls wrong is taken as it is where the user says so.
        missing, _, why = self.filled("bad", force=True)
        self.assertEqual(missing, [3, 6, 9, 12, 18])
        self.assertIn("1 distinct points", why[4])

    def test_a_frame_in_which_nobody_can_be_made_out(self):
        """One frame of the right size that lies, or is twice as large: without this it throws the target about."""
        self.w = STANDARD
        lying = [(x, -z, y) for x, y, z in self.frames[9]]
        large = [(2.5 * x, 2.5 * y, 2.5 * z) for x, y, z in self.frames[9]]
        self.done(*self.call("good.h5"))
        for name, frame, fault in (("lying", lying, "turned by"), ("large", large, "nobody who can be made out")):
            missing, filled, why = self.filled(self.source(name, {9: frame}))
            self.assertEqual((missing, filled), ([9], [9]), name)
            self.assertIn(fault, why[0])
            told = self.json("eval", "--pred", "out.h5", "--truth", "good.h5")
            self.assertLess(told["mean"]["mpjpe"], 0.004, name)
            self.assertEqual(self.filled(name, force=True)[:2], ([], []), name)
            self.assertEqual(self.json("assess", name, "--weights", STANDARD)["left_out"], 1, name)
        # What lasts is no slip of one frame.
        missing, _, _ = self.filled(self.source("lies", {f: [(x, -z, y) for x, y, z in self.frames[f]] for f in range(4, FRAMES)}))
        self.assertEqual(missing, list(range(4, 4 + len(missing))))
        self.assertIn(len(missing), range(1, 11))  # a third of a second

    def test_one_frame_in_millimetres_among_the_first(self):
        self.source("mixed", {6: [(1000 * x, 1000 * y, 1000 * z) for x, y, z in self.frames[6]]})
        self.assertEqual(self.filled("mixed")[:2], ([6], [6]))
        self.source("first", {0: [(1000 * x, 1000 * y, 1000 * z) for x, y, z in self.frames[0]]})
        self.assertIn("left out: the first 1 frame", self.done("doctor", "first", "--fix", "first.h5"))
        self.assertEqual(self.json(*self.call("out.h5", source="first.h5"))["frames"], FRAMES - 1)
        told = self.done("doctor", "mixed", "--fix", "mended.h5")
        self.assertIn("the frame before stands in", told)
        self.assertEqual(self.filled("mended.h5")[:2], ([], []))

    def test_somebody_who_comes_later(self):
        """The first frames alone are looked at in front; who comes behind them is found where the extractor is lost."""
        self.w = STANDARD
        both = {f: self.frames[f] + [(x + 1.5, y, z) for x, y, z in self.frames[f]] for f in range(10, FRAMES)}
        self.bad_input(self.call("new.h5", source=self.source("two", both)), "a second person is in the clouds before", "doctor --fix")
        self.done(*self.call("new.h5", source="two", force=True))

    def test_missing_numbers_are_told(self):
        for f, frame in enumerate(self.frames):
            self.ply("numbers/f%d.ply" % (f if f < 9 else f + 3), frame)
        self.assertIn("3 numbers are missing", self.restage(*self.call("out.h5", source="numbers")).err)
        self.assertNotIn("missing", self.restage(*self.call("out.h5")).err)

    def test_it_is_said(self):
        self.source("bad", {7: self.frames[0][:10], 8: None})
        result = self.restage(*self.call("out.h5", source="bad"))
        self.assertEqual(result.code, 0, result.err)
        self.assertIn("2 of the source's frames could not be used: 7 (bad/", result.err)
        self.assertIn("2 of the result's frames are filled", result.err)
        self.assertIn("7, 8", result.err)
        self.assertIn("2 of them filled", result.out)
        self.done(*self.call("out.glb", source="bad"))
        data = self.bytes("out.glb")
        scene = json.loads(data[20:20 + struct.unpack("<I", data[12:16])[0]])
        self.assertEqual(scene["animations"][0]["extras"]["filled"], [7, 8])
        for out in ("out.bvh", "frames/"):
            self.done(*self.call(out, source="bad"))
        self.assertEqual(len(os.listdir(self.path("frames"))), FRAMES)
        self.done(*self.call("clean.h5"))
        self.assertNotIn("filled", self.json("data", "inspect", "clean.h5")["counts"])

    def test_a_filled_frame_is_near_what_it_would_have_been(self):
        self.done(*self.call("clean.h5"))
        for first in (2, 20):  # these small weights let the person spin in between
            self.filled(self.source("bad%d" % first, {first: None, first + 1: None}))
            self.assertLess(self.json("eval", "--pred", "out.h5", "--truth", "clean.h5")["mean"]["mpjpe"], 0.02, first)

    def test_a_file_of_frames(self):
        clouds = [self.frames[f][:200] for f in range(FRAMES)]
        clouds[5], clouds[23] = clouds[5][:10], []
        offset = [0]
        for cloud in clouds:
            offset.append(offset[-1] + len(cloud))
        self.h5("scans.h5", points=([offset[-1], 3], [x for cloud in clouds for p in cloud for x in p], "float32"),
                frame_offset=([FRAMES + 1], offset, "int64"))
        self.assertEqual(self.filled("scans.h5")[:2], ([5, 23], [5, 23]))

    def test_points_that_are_not_finite_are_left_out_and_counted(self):
        self.source("bad", {4: self.frames[4] + [(NAN, 0, 0), (0, float("inf"), 0)]})
        result = self.restage(*self.call("out.h5", "--json", source="bad"))
        self.assertEqual((json.loads(result.out)["points_left_out"], json.loads(result.out)["missing"]), (2, []))
        self.assertIn("2 points of the source are NaN or infinite", result.err)
        self.done(*self.call("clean.bvh"))
        self.done(*self.call("bad.bvh", source="bad"))
        self.assertEqual(self.bytes("bad.bvh"), self.bytes("clean.bvh"))

    def test_how_long_a_gap_may_be(self):
        self.assertEqual(self.filled(self.source("ten", {f: None for f in range(5, 15)}))[0], list(range(5, 15)))
        self.source("eleven", {f: self.frames[f][:10] for f in range(5, 16)})
        for out in ("new.h5", "new.glb", "new.bvh", "new/"):
            self.bad_input(self.call(out, source="eleven"), self.names[5], "10 distinct points", "third of a second", "--force")
        self.assertEqual(self.filled("eleven", force=True)[0], list(range(5, 16)))
        # Measured in seconds of the source.
        self.source("five", {f: None for f in range(5, 10)})
        self.bad_input(self.call("new.h5", "--fps", "12", source="five"), self.names[5], "third of a second")
        self.done(*self.call("new.h5", "--fps", "15", source="five"))
        self.source("one", {5: None})
        self.done(*self.call("new.h5", "--fps", "2", source="one"))

    def test_what_was_there_survives_a_late_refusal(self):
        self.done(*self.call("out.h5"))
        self.done(*self.call("out.glb"))
        before = {n: self.bytes(n) for n in ("out.h5", "out.glb")}
        self.source("eleven", {f: None for f in range(5, 16)})
        for out in before:
            self.bad_input(self.call(out, source="eleven"), self.names[5])
        self.assertEqual({n: self.bytes(n) for n in before}, before)

    def test_the_first_frame(self):
        self.source("bad", {0: self.frames[0][:10], 1: None})
        for out in ("out.h5", "out.glb", "out.bvh", "frames/"):
            self.bad_input(self.call(out, source="bad"), self.names[0], "10 distinct points", "first frame", "--force")
        missing, filled, _ = self.filled("bad", force=True)
        self.assertEqual((missing, filled), ([0, 1], [0, 1]))

    def test_no_frame_at_all(self):
        self.source("bad", {f: None for f in range(FRAMES)})
        for force in (False, True):
            self.bad_input(self.call("out.h5", source="bad", force=force), self.names[0])

    def test_the_same_bytes_for_any_number_of_threads(self):
        self.source("bad", {7: None, 8: None, 20: self.frames[3][:4]})
        for n in (1, 2):
            self.done(*self.call("out%d.h5" % n, "--threads", n, source="bad"))
        self.assertEqual(self.bytes("out1.h5"), self.bytes("out2.h5"))


class WithoutLearning(CliTest):
    def test_register(self):
        self.done("data", "build", "--bodies", 0, 0, 2, "--motions", 0, 0, 1, "--out", "data.h5", "--quiet")
        self.done("data", "perform", "--bodies", "data.h5", "--body", "builtin_test_0", "--target", "builtin_test_1", "--frames", 3, "--out", "walk", "--quiet")
        self.done("doctor", "walk/source.h5", "--fix", "scans/")
        self.ply("scans/" + sorted(os.listdir(self.path("scans")))[1], points(10, 1))
        found = self.json("retarget", "--system", "register", "--source", "scans", "--target", "walk/target.ply", "--rest", "walk/rest.h5", "--out", "out.h5")
        self.assertEqual((found["frames"], found["filled"]), (3, [1]))
