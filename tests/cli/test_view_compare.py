"""restage view --compare: which source is drawn beside a result, how it is read, and which frames stand together."""
import os
import shutil

from support import CliTest, points
from tiny_run import weights

FRAMES = 12
SCALE = 1 / 1024  # exact, so that equal pictures are equal bytes


class RenderSource(CliTest):
    """A source of 60 frames a second, z up, in strange units; plain/ has what it shows at 30, y up, in metres."""

    def setUp(self):
        super().setUp()
        self.ply("hero.ply", points(90, 7))
        for i in range(FRAMES):
            cloud = [(x + 0.05 * i, y, z) for x, y, z in points(120, i)]
            self.ply("odd/f%d.ply" % i, [(x / SCALE, -z / SCALE, y / SCALE) for x, y, z in cloud])
            if i % 2 == 0:
                self.ply("plain/f%d.ply" % i, cloud)
        os.mkdir(self.path("results"))
        self.done(*self.retarget("results/r.h5", "--source", "odd", *self.how()))

    def how(self):
        return ["--fps", 60, "--source-up", "z", "--scale", SCALE]

    def retarget(self, out, *more):
        return ["retarget", "--target", "hero.ply", "--weights", weights("tiny"), "--force", "--out", out, *more]

    def compared(self):
        return ["--source-fps", 60, "--source-up", "z", "--source-scale", SCALE]

    def sheet(self, result, *arguments):
        """The picture, and what is said of it; beside the remembered source, where no other is named."""
        beside = () if {"--compare", "--columns"} & set(arguments) else ("--compare", "source")
        found = self.json("view", result, *beside, *arguments, "--out", "sheet.png")
        return self.bytes("sheet.png"), found

    def test_a_source_that_states_its_times(self):
        self.done(*self.retarget("moving.glb", "--source", "plain"))
        self.done(*self.retarget("again.h5", "--source", "moving.glb", "--from-surface"))
        self.assertEqual(self.sheet("again.h5")[1]["source"], "moving.glb")
        self.bad_input(["view", "again.h5", "--compare", "source", "--source-fps", 60, "--out", "x.png"], "key times")

    def test_a_result_knows_its_source(self):
        wanted, _ = self.sheet("results/r.h5", "--compare", "plain", "--source-scale", 1)
        remembered, found = self.sheet("results/r.h5")
        self.assertEqual((found["source"], found["fps"], found["frames"]), ("odd", 30, FRAMES // 2))
        self.assertEqual(remembered, wanted)
        self.assertEqual(self.sheet("results/r.h5", "--compare", "odd")[0], wanted, "named, read as remembered")
        self.assertNotEqual(self.sheet("results/r.h5", "--columns", 8)[0], wanted)
        self.done("view", "results/r.h5", "--compare", "source", "--out", "page.html")
        self.assertIn(">source<", self.bytes("page.html").decode())
        # Seen from elsewhere, and moved as a whole.
        os.mkdir(self.path("moved"))
        for name in ("odd", "results"):
            os.rename(self.path(name), self.path("moved/" + name))
        self.assertEqual(self.sheet("moved/results/r.h5")[0], wanted)

    def test_options_say_how_a_source_is_read(self):
        wanted, _ = self.sheet("results/r.h5")
        shutil.copytree(self.path("odd"), self.path("copy"))
        self.assertEqual(self.sheet("results/r.h5", "--compare", "copy", *self.compared())[0], wanted)
        for k in (0, 2, 4):  # each of them is needed
            left = self.compared()[:k] + self.compared()[k + 2:]
            self.assertNotEqual(self.sheet("results/r.h5", "--compare", "copy", *left)[0], wanted, left)
        for option, value in (("--source-fps", 30), ("--source-up", "-z"), ("--source-scale", SCALE / 2)):
            self.assertNotEqual(self.sheet("results/r.h5", option, value)[0], wanted, option)
        # Somebody as large as a house would be an empty row: it is said.
        result = self.restage("view", "results/r.h5", "--compare", "copy", "--out", "sheet.png")
        self.assertEqual(result.code, 0, result.err)
        self.assertIn("--source-scale", result.err)
        self.assertIn("copy", result.err)
        self.assertNotIn("scale", self.restage("view", "results/r.h5", "--compare", "source", "--out", "sheet.png").err)

    def test_a_source_that_is_gone(self):
        shutil.rmtree(self.path("odd"))
        result = self.restage("view", "results/r.h5", "--compare", "source", "--out", "sheet.png")
        self.assertEqual(result.code, 0, result.err)
        self.assertIn("odd, is not there any more", result.err)
        self.bad_input(["view", "results/r.h5", "--compare", "odd", "--out", "a.png"], "odd")

    def test_rows_are_paired_by_time(self):
        self.done(*self.retarget("third.h5", "--source", "plain", "--every", 3))
        picture, found = self.sheet("third.h5", "--truth", "results/r.h5")
        self.assertEqual((found["fps"], found["frames"]), (10, 2))
        for i in (0, 3):
            self.ply("picked/f%d.ply" % i, self.vertices("plain/f%d.ply" % (2 * i)))
        self.assertEqual(self.sheet("third.h5", "--truth", "results/r.h5", "--compare", "picked", "--source-fps", 10)[0], picture)
        self.assertNotEqual(self.sheet("third.h5", "--truth", "results/r.h5", "--compare", "picked")[0], picture)

    def test_bad_frames_of_the_source(self):
        wanted, _ = self.sheet("results/r.h5")
        self.write("odd/f4.ply", self.bytes("odd/f4.ply")[:-10])
        result = self.restage("view", "results/r.h5", "--compare", "source", "--out", "sheet.png")
        self.assertEqual(result.code, 0, result.err)
        self.assertIn("f4.ply", result.err)
        self.assertNotEqual(self.bytes("sheet.png"), wanted)

    def test_one_of_several_sequences(self):
        clouds = [points(100, 20 + i) for i in range(6)]
        self.h5("two.h5", vertices=([6, 100, 3], [x for cloud in clouds for p in cloud for x in p], "float32"),
                sequence_offset=([3], [0, 3, 6], "int64"))
        self.done(*self.retarget("second.h5", "--source", "two.h5", "--sequence", 1))
        wanted, found = self.sheet("second.h5")
        self.assertEqual((found["source"], found["frames"]), ("two.h5", 3))
        self.assertEqual(self.sheet("second.h5", "--source-sequence", 1)[0], wanted)
        self.assertNotEqual(self.sheet("second.h5", "--source-sequence", 0)[0], wanted)
        self.bad_input(["view", "second.h5", "--compare", "source", "--source-sequence", 2, "--out", "a.png"], "two.h5", "sequence")

    def test_of_several_sequences_none_is_shown_silently(self):
        """Of clouds, of surfaces with joints, of joints alone: the first is not taken for all."""
        both = dict(vertices=([4, 100, 3], [x for k in range(4) for p in points(100, k) for x in p]), joints=([4, 22, 3], [0.1 * k for k in range(264)]))
        offset = dict(sequence_offset=([3], [0, 2, 4], "int64"))
        for name, data in (("both", both), ("joints", {"joints": both["joints"]}), ("surface", {"vertices": both["vertices"]})):
            self.h5(name + ".h5", **data, **offset)
            for command in ("view", "render"):
                self.bad_input([command, name + ".h5", "--out", "a.png"], name + ".h5", "holds 2 sequences", "--sequence N")
                self.done(command, name + ".h5", "--sequence", 1, "--out", command + ".png")
        self.bad_input(["view", "both.h5", "--look", "head", "--out", "a.png"], "both.h5", "holds 2 sequences")

    def test_a_close_up_leaves_a_source_without_joints_out(self):
        result = self.restage("view", "results/r.h5", "--compare", "source", "--look", "head", "--out", "sheet.png")
        self.assertEqual(result.code, 0, result.err)
        self.assertIn("odd", result.err)
        self.bad_input(["view", "results/r.h5", "--compare", "odd", "--look", "head", "--out", "a.png"], "odd", "joints")

    def test_bad_options(self):
        self.ply("one.ply", points(50, 1))
        for option in (("--source-scale", 2), ("--source-up", "z"), ("--source-clip", "Walk"), ("--source-sequence", 0)):
            self.bad_input(["view", "one.ply", "--truth", "one.ply", *option, "--out", "a.png"], option[0], "there is none")
            self.bad_input(["view", "results/r.h5", *option, "--out", "a.png"], option[0], "--compare")
        for k in range(9):
            self.ply("longer/f%d.ply" % k, points(50, k))
        self.bad_input(["view", "results/r.h5", "--truth", "longer", "--out", "a.png"], "longer", "has 9 frames", "the same motion")
        self.bad_input(["view", "results/r.h5", "--compare", "source", "--columns", 4, "--out", "a.html"], "--columns", "sheet")
        for option in (("--source-scale", 0), ("--source-up", "w"), ("--source-fps", 0), ("--source-fps", "nan")):
            self.bad_input(["view", "results/r.h5", "--compare", "source", *option, "--out", "a.png"], option[0])
        self.bad_input(["view", "results/r.h5", "--compare", "source", "--source-clip", "Walk", "--out", "a.png"], "odd", "no clips")
        for option in (("--frame", 3), ("--time", 1), ("--size", "80x80"), ("--zoom", 2), ("--background", "black"), ("--every", 2)):
            self.bad_input(["view", "results/r.h5", "--compare", "source", *option, "--out", "a.png"], option[0])
        self.bad_input(["view", "results/r.h5", "--compare", "source", "--out", "a.webp"], "--compare", "animation")
        self.bad_input(["view", "results/r.h5", "--truth", "results/r.h5", "--out", "a.webp"], "--truth", "animation")
        self.bad_input(["view", "results/r.h5", "--compare", "source", "--fps", 15, "--out", "a.png"], "--fps", "--compare")
        self.bad_input(["view", "one.ply", "--compare", "source", "--out", "a.png"], "one.ply", "made from")
        self.h5("two.h5", vertices=([4, 3, 3], [0.1 * k for k in range(36)]), sequence_offset=([3], [0, 2, 4], "int64"))
        self.bad_input(["view", "results/r.h5", "--compare", "two.h5", "--out", "a.png"], "two.h5", "--source-sequence N")
        self.bad_input(["view", "results/r.h5", "--side", "left", "--azimuth", 3, "--out", "a.png"], "--side", "--azimuth")

    def test_a_recording_beside_what_was_made_of_it(self):
        self.done("data", "build", "--bodies", 1, 0, 0, "--motions", 1, 0, 0, "--quiet", "--out", "m.h5")
        found = self.json("view", "results/r.h5", "--compare", "m.h5", "--out", "sheet.png")
        self.assertEqual((found["source"], found["frames"]), ("m.h5", FRAMES // 2))

    def test_scans_beside_what_was_made_of_them_as_an_animation(self):
        """Both at one rate: --source-fps says how fast the scans were taken."""
        self.done(*self.retarget("moving.glb", "--source", "plain"))
        found = {}
        for fps in (30, 15):
            found[fps] = self.json("view", "moving.glb", "--compare", "plain", "--source-fps", fps, "--size", "160x80", "--out", "%d.webp" % fps)
            self.assertEqual((found[fps]["source"], found[fps]["width"], found[fps]["fps"]), ("plain", 160, 30))
        self.assertEqual(found[30]["frames"], FRAMES // 2)
        self.assertEqual(found[15]["frames"], 2 * (FRAMES // 2) - 1, "slower scans last longer; the character holds its last frame")
        self.assertNotEqual(self.bytes("30.webp"), self.bytes("15.webp"))
        # Read as is said: the same person in other units and axes is the same picture.
        self.json("view", "moving.glb", "--compare", "odd", *self.compared(), "--size", "160x80", "--out", "odd.webp")
        self.done("view", "moving.glb", "--compare", "odd", "--source-fps", 60, "--size", "160x80", "--out", "lying.webp")
        self.assertNotEqual(self.bytes("odd.webp"), self.bytes("lying.webp"))

    def test_the_older_name_of_the_command(self):
        """render goes on working, with the names that its options had; a remark says the new ones."""
        wanted, _ = self.sheet("results/r.h5")
        self.assertIn("'restage view' now", self.restage("render", "results/r.h5", "--out", "old.png").err)
        self.assertEqual(self.bytes("old.png"), wanted)
        shutil.copytree(self.path("odd"), self.path("copy"))
        result = self.restage("render", "results/r.h5", "--source", "copy", *self.how(), "--out", "old.png")
        self.assertEqual((result.code, self.bytes("old.png")), (0, wanted), result.err)
        self.assertIn("--source-scale", result.err)
        self.done("render", "results/r.h5", "--no-source", "--fps", 15, "--out", "page.html")
        self.assertEqual(self.json("render", "results/r.h5", "--no-source", "--fps", 15, "--out", "old.png")["fps"], 15)
        self.bad_input(["render", "results/r.h5", "--no-source", "--source", "odd", "--out", "a.png"], "--no-source")
        self.bad_input(["render", "results/r.h5", "--out", "a.gif"], "a.gif")
