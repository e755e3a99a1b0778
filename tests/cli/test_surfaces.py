"""Clouds and surfaces through `doctor` and `render`."""
import os
import struct

from support import CliTest, numbers, points, small_disk

TETRAHEDRON = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]


class Doctor(CliTest):
    def test_says_what_a_file_is(self):
        self.assertEqual(self.json("doctor", self.ply("a.ply", TETRAHEDRON, FACES))["kind"], "mesh")
        found = self.json("doctor", self.ply("b.ply", points(200, 1)))
        self.assertEqual((found["kind"], found["facts"]["points"], found["notes"]), ("cloud", 200, []))
        found = self.json("doctor", self.ply("c.ply", points(3, 1)))
        self.assertIn("3 distinct points", found["notes"][0])
        self.assertIn("centimetres", self.json("doctor", self.ply("d.ply", [(170 * x, 170 * y, z) for x, y, z in points(100, 2)]))["notes"][0])
        self.assertEqual(self.json("doctor", self.h5("p.h5", joints=([2, 22, 3], [0.0])))["kind"], "prediction")
        for i in (1, 2, 10):
            self.ply("frames/f%d.ply" % i, points(100 + i, i))
        found = self.json("doctor", "frames")
        self.assertEqual((found["kind"], found["facts"]["frames"], found["facts"]["most_points"]), ("frames", 3, 110))

    def test_bad_files(self):
        bad = lambda name, *words: self.bad_input(["doctor", name], name, *words)
        good = self.bytes(self.ply("good.ply", TETRAHEDRON, FACES))
        for part in (0.99, 0.6, 0.3, 0.02):
            bad(self.write("cut.ply", good[:int(len(good) * part)]))
        bad(self.ply("nan.ply", TETRAHEDRON + [(float("nan"), 0, 0)]))
        bad(self.ply("inf.ply", TETRAHEDRON + [(float("inf"), 0, 0)]))
        bad(self.ply("face.ply", TETRAHEDRON, FACES + [(0, 1, 4)]), "face")
        bad(self.ply("minus.ply", TETRAHEDRON, FACES + [(0, 1, -1)]), "face")
        bad(self.ply("empty.ply", []))
        bad(self.write("zero.ply", b""))
        bad(self.write("zero.obj", b""))
        bad(self.write("face.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"), "face")
        bad(self.write("nan.obj", "v 0 0 nan\n"))
        bad(self.write("huge.ply", good.replace(b"element vertex 4", b"element vertex 4000000000000")))
        bad(self.write("what.xyz", struct.pack("<4I", 1, 2, 3, 4)), "kind")
        bad(self.write("a.bvh", "HIERARCHY\nROOT hips\n{\n"))
        bad(self.write("a.yaml", "key: [1, 2\n"), "a.yaml")
        bad("none.ply")
        os.mkdir(self.path("hollow"))
        bad("hollow")


class Render(CliTest):
    def setUp(self):
        super().setUp()
        corners = [x for p in TETRAHEDRON for x in p]
        self.h5("result.h5", vertices=([3, 4, 3], corners * 3, "float32"), faces=([4, 3], [i for f in FACES for i in f], "int64"),
                joints=([3, 22, 3], numbers(198, 1)))
        for i in range(3):
            self.ply("scans/s%d.ply" % i, points(150 + i, i))

    def test_sheet_and_page(self):
        self.done("render", "result.h5", "--source", "scans", "--truth", "result.h5", "--out", "sheet.png")
        self.assertEqual(self.bytes("sheet.png")[:8], b"\x89PNG\r\n\x1a\n")
        self.done("render", "result.h5", "--source", "scans", "--out", "page.html")
        page = self.bytes("page.html").decode()
        self.assertIn("<html", page.lower())
        for outside in ("src=\"http", "href=\"http", "@import", "fetch("):
            self.assertNotIn(outside, page)

    def test_joints_alone_and_single_meshes(self):
        self.h5("joints.h5", joints=([2, 22, 3], numbers(132, 1)))
        self.done("render", "joints.h5", "--out", "a.png")
        self.done("render", self.ply("one.ply", TETRAHEDRON, FACES), "--out", "b.png")

    def test_bad_input(self):
        self.bad_input(["render", "result.h5", "--out", "sheet.gif"], "sheet.gif")
        self.bad_input(["render", "none.h5", "--out", "sheet.png"], "none.h5")
        self.bad_input(["render", "result.h5", "--out", "nowhere/sheet.png"], "nowhere")
        self.bad_input(["render", "result.h5", "--out", "sheet.png", "--sequence", 1], "sequence")
        self.bad_input(["render", "result.h5", "--source", self.ply("e.ply", []), "--out", "sheet.png"], "e.ply")
        self.ply("scans/s1.ply", TETRAHEDRON + [(float("nan"), 0, 0)])
        self.bad_input(["render", "result.h5", "--source", "scans", "--out", "sheet.png"], "s1.ply")

    def test_full_disk(self):
        result = self.restage("render", "result.h5", "--source", "scans", "--out", "sheet.png", before=small_disk)
        self.one_line(result, 1, "sheet.png")
        self.assertNotIn("sheet.png", os.listdir(self.folder))
