"""Folders of frames as people have them: frames that are there twice, cannot be read or show nothing; units by name."""
import json
import os

from support import CliTest, sphere
from test_data import toy_bvh

POINTER = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 132\n"


def moved(step, scale=1.0):
    return [(scale * (x + 0.01 * step), scale * (y + 1), scale * z) for x, y, z in sphere(120)]


class Frames(CliTest):
    def frames_in(self, name, *files, scale=1.0):
        for i, file in enumerate(files):
            self.ply("%s/%s" % (name, file), moved(i, scale))
        return name

    def everywhere(self, name, *words):
        """The commands that read a folder of frames refuse it in one line."""
        for command in (["data", "import", name, "--out", "x.h5"], ["doctor", name], ["render", name, "--out", "x.png"]):
            self.bad_input(command, *words)

    def test_a_frame_that_is_there_twice(self):
        self.everywhere(self.frames_in("pads", "f0.ply", "f00.ply", "f1.ply"), "pads", "f0.ply", "f00.ply", "keep one of the two")
        self.frames_in("kinds", "frame_0000.ply", "frame_0001.ply")
        self.write("kinds/frame_0.obj", "".join("v %g %g %g\n" % p for p in moved(0)))
        self.everywhere("kinds", "frame_0000.ply", "frame_0.obj", "holds one frame twice")
        self.everywhere(self.frames_in("either", "take1.9.ply", "take1.11.ply"), "cannot be told", "rename the frames")

    def test_the_order_is_said(self):
        self.frames_in("stamps", "1700000000.99999999.ply", "1700000000.100000000.ply", "1700000001.5.ply")
        self.assertIn("seconds and nanoseconds", self.done("data", "import", "stamps", "--out", "x.h5"))
        self.assertIn("seconds and nanoseconds", self.restage("doctor", "stamps").out)

    def test_folders_with_strays(self):
        for f in range(5):
            if f != 2:
                self.ply("in/%04d/mesh.ply" % f, moved(f))
            self.write("in/%04d/log.md" % f, "")
        found = self.json("data", "import", "in", "--out", "x.h5")
        self.assertEqual((found["sequences"], found["frames"]), (1, 5))
        self.assertIn("1 folder holds no 'mesh.ply'", " ".join(found["reports"][0]["remarks"]))
        self.assertIn("1 frame shows too little", " ".join(found["reports"][0]["remarks"]))
        self.assertIn("1 frame without any point", self.restage("doctor", "in").out)
        for f in range(5):
            self.ply("all/%04d/mesh.ply" % f, moved(f))
            self.ply("all/%04d/floor.ply" % f, moved(0))
        self.everywhere("all", "floor.ply", "mesh.ply", "leave one of them in each folder")
        os.remove(self.path("all/0001/floor.ply"))
        found = self.json("data", "import", "all", "--out", "x.h5")
        self.assertEqual((found["sequences"], found["frames"]), (1, 5))
        self.assertIn("'mesh.ply' is taken of each, and left out are 'floor.ply'", " ".join(found["reports"][0]["remarks"]))

    def test_what_cannot_be_read_is_a_frame_without_points(self):
        self.frames_in("in", *("%d.ply" % f for f in range(8)))
        self.write("in/3.ply", self.bytes("in/3.ply")[:-40])
        self.write("in/5.ply", POINTER)
        found = self.json("data", "import", "in", "--out", "x.h5")
        said = " ".join(found["reports"][0]["remarks"])
        self.assertEqual(found["frames"], 8)
        for words in ("2 frames could not be read", "in/3.ply: is cut short", "in/5.ply: is a Git LFS pointer"):
            self.assertIn(words, said)
        known = ("--up", "y", "--scale", 1, "--facing", "z")
        result = self.restage("doctor", "in", "--json", "--fix", "mended.h5", *known)
        self.assertIn(result.code, (0, 1), result.err)
        self.assertIn("in/3.ply: is cut short", " ".join(json.loads(result.out)["notes"]))
        self.assertEqual(self.json("data", "inspect", "mended.h5")["counts"]["frames"], 8)
        for f in range(6):
            self.write("in/%d.ply" % f, POINTER)
        self.everywhere("in", "6 of 8 frames are Git LFS pointers", "git lfs pull")

    def test_long_gaps_keep_their_time(self):
        self.frames_in("in", *("%03d.ply" % f for f in range(50)))
        for f in list(range(2)) + list(range(6, 41)):
            self.ply("in/%03d.ply" % f, [])
        known = ("--up", "y", "--scale", 1, "--facing", "z")
        for out in ("mended.h5", "mended/"):
            result = self.restage("doctor", "in", "--json", "--fix", out, *known)
            self.assertIn(result.code, (0, 1), result.err)
            for words in ("in gaps 35 frames without points", "left out: 2 frames without points before the first"):
                self.assertIn(words, " ".join(json.loads(result.out)["fixed"]["remarks"]))
        self.assertEqual(self.json("data", "inspect", "mended.h5")["counts"]["frames"], 48)
        self.assertEqual(self.json("data", "verify", "mended.h5")["problems"], [])
        self.assertEqual(len(os.listdir(self.path("mended"))), 48)
        found = json.loads(self.restage("doctor", "mended.h5", "--json").out)
        self.assertIn("35 frames without any point, before 4", " ".join(found["notes"]))
        self.assertEqual(self.vertices("mended/frame_%06d.ply" % 10), [])
        self.assertNotEqual(self.vertices("mended/frame_%06d.ply" % 45), [])

    def test_units_by_name(self):
        self.frames_in("mm", "1.ply", "2.ply", scale=1000)
        self.done("data", "import", "mm", "--scale", "0.001", "--out", "a.h5")
        for unit in ("mm", "MM", "millimetres"):
            self.done("data", "import", "mm", "--scale", unit, "--out", "b.h5")
            self.assertEqual(self.bytes("a.h5"), self.bytes("b.h5"))
        in_metres = self.restage("doctor", "mm", "--scale", "0.001", "--json").out
        for unit in ("mm", "millimetre", "Millimeters", "millimetres"):
            self.assertEqual(self.restage("doctor", "mm", "--scale", unit, "--json").out, in_metres)
        for unit, metres in (("centimetre", "0.01"), ("meter", "1"), ("inches", "0.0254"), ("foot", "0.3048"), ("feet", "0.3048")):
            self.assertEqual(self.restage("doctor", "mm", "--scale", unit, "--json").out,
                             self.restage("doctor", "mm", "--scale", metres, "--json").out)
        for command in (["data", "import", "mm", "--out", "x.h5"], ["doctor", "mm"]):
            self.bad_input(command + ["--scale", "furlong"], "--scale 'furlong'", "mm, cm, m")
            self.bad_input(command + ["--scale", "1,5"], "--scale '1,5'", "metres per unit")

    def test_files_of_other_kinds(self):
        self.write("walk.bvh", b"Kaydara FBX Binary  \x00\x1a\x00")
        self.write("hero.glb", b"PK\x03\x04" + bytes(40))
        self.write("model.pmx", b"PMX ")
        for name, *words in (("walk.bvh", "is FBX", "Blender"), ("hero.glb", "is a zip archive", "unzip"), ("model.pmx", "MikuMikuDance", "MMD Tools")):
            self.bad_input(["data", "import", name, "--out", "x.h5"], name, *words)
            self.bad_input(["doctor", name], name, *words)
        self.write("comma.bvh", toy_bvh().replace("Frame Time: 0.0166667", "Frame Time: 0,0166667"))
        self.assertIn("60", json.dumps(self.json("data", "import", "comma.bvh", "--out", "x.h5")["reports"][0]["facts"]["rate"]))
