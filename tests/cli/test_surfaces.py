"""Clouds and surfaces through `doctor` and `render`."""
import json
import os
import struct

from support import CliTest, numbers, points, small_disk, sphere

TETRAHEDRON = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]


class Doctor(CliTest):
    def doctor(self, name, code, *more):
        result = self.restage("doctor", name, "--json", *more)
        self.assertEqual((result.code, result.err), (code, ""))
        return json.loads(result.out)

    def test_says_what_a_file_is(self):
        self.assertEqual(self.doctor(self.ply("a.ply", TETRAHEDRON, FACES), 1)["kind"], "mesh")
        found = self.doctor(self.ply("b.ply", points(200, 1)), 1)
        self.assertEqual((found["kind"], found["facts"]["points"], found["usable"]), ("cloud", 200, False))
        self.assertIn("no unit", " ".join(found["notes"]))
        self.assertIn("nobody", " ".join(self.doctor(self.ply("sphere.ply", sphere()), 1)["notes"]))
        found = self.doctor(self.ply("c.ply", points(3, 1)), 1)
        self.assertIn("3 distinct points", found["notes"][0])
        self.assertEqual(self.doctor(self.h5("p.h5", joints=([2, 22, 3], [0.0])), 1)["kind"], "prediction")
        for i in (1, 2, 10):
            self.ply("frames/f%d.ply" % i, points(100 + i, i))
        found = self.doctor("frames", 1)
        self.assertEqual((found["kind"], found["facts"]["frames"], found["facts"]["most_points"]), ("frames", 3, 110))

    def test_foreign_axes_and_units_are_found_and_mended(self):
        person = self.person()
        found = self.doctor(self.ply("good.ply", person), 0, "--as-target")
        self.assertEqual(found["notes"], [])
        self.ply("foreign.ply", [(100 * x, -100 * z, 100 * y) for x, y, z in person])
        found = self.doctor("foreign.ply", 1)
        said = {f["topic"]: f for f in found["findings"]}
        self.assertIn("1 cm", said["units"]["what"])
        self.assertIn("--source-up z", said["up"]["fix"])
        self.assertIn("+z is up", said["up"]["what"])
        self.assertIn("faces -y", said["facing"]["what"])
        frame = found["frame"]
        self.assertEqual((frame["unit"], frame["metres_per_unit"], frame["up"], frame["facing"]), ("cm", 0.01, "+z", "-y"))
        self.assertTrue(1.2 < frame["height"] < 2.3)
        text = self.restage("doctor", "foreign.ply")
        self.assertEqual((text.code, text.err), (1, ""))
        for words in ("not usable", "--scale 0.01", "p' = 0.01 R (p - t)"):
            self.assertIn(words, text.out)
        found = self.doctor("foreign.ply", 0, "--fix", "mended.ply")
        self.assertEqual((found["fixed"]["file"], found["fixed"]["transform_file"]), ("mended.ply", "mended.ply.transform.json"))
        back = self.vertices("mended.ply")
        self.assertEqual(len(back), len(person))
        self.assertLess(max(abs(a - b) for p, q in zip(back, person) for a, b in zip(p, q)), 0.06)
        self.assertEqual(self.doctor("mended.ply", 0)["notes"], [])
        kept = json.loads(self.bytes("mended.ply.transform.json"))
        scale, turn, offset = kept["scale"], kept["rotation"], kept["offset"]
        for p, q in zip(self.vertices("foreign.ply")[:20], back):
            r = [a - b for a, b in zip(p, offset)]
            for i in range(3):
                self.assertAlmostEqual(q[i], scale * sum(turn[i][j] * r[j] for j in range(3)), 4)

    def test_sequences_are_mended(self):
        self.person()
        self.assertEqual(self.doctor("walk/source.h5", 0)["kind"], "scans")
        self.done("doctor", "walk/source.h5", "--fix", "frames/")
        for i, name in enumerate(sorted(os.listdir(self.path("frames")))):
            if i != 5:  # one is lost, and all are turned
                self.ply("turned/f%d.ply" % i, [(x, -z, y) for x, y, z in self.vertices("frames/" + name)])
        found = self.doctor("turned", 1)
        self.assertIn("1 number missing", " ".join(found["notes"]))
        self.doctor("turned", 0, "--fix", "again/")
        self.assertEqual(len(os.listdir(self.path("again"))), 12)
        self.doctor("turned", 0, "--fix", "again.h5")
        found = self.json("data", "inspect", "again.h5")
        self.assertEqual((found["counts"]["frames"], found["transform"]["scale"]), (12, 1))
        self.assertEqual(self.doctor("again.h5", 0)["facts"]["frames"], 12)

    def test_scale_given_and_declared_units(self):
        person = self.person()
        self.ply("cm.ply", [(100 * x, 100 * y, 100 * z) for x, y, z in person])
        self.doctor("cm.ply", 0, "--scale", "0.01")
        self.assertIn("m tall", self.doctor("cm.ply", 1, "--scale", "1")["notes"][0])
        flat = [100 * x for p in person for x in p]
        self.h5("declared.h5", {"units": "centimetres"}, points=([len(person), 3], flat), frame_offset=([2], [0, len(person)], "int64"))
        notes = " ".join(self.doctor("declared.h5", 1)["notes"])
        for words in ("1 cm", "the file says 'centimetres'"):
            self.assertIn(words, notes)

    def test_picture(self):
        self.ply("odd.ply", self.person() + [(3, 3, 3), (2, -1, 2)])
        self.assertIn("2 stray points", self.done("doctor", "odd.ply", "--picture", "sheet.png"))
        self.assertEqual(self.bytes("sheet.png")[:8], b"\x89PNG\r\n\x1a\n")
        self.bad_input(["doctor", "odd.ply", "--picture", "sheet.gif"], "sheet.gif")
        self.bad_input(["doctor", "data.h5", "--picture", "sheet.png"], "dataset")

    def test_bad_options(self):
        self.ply("ball.ply", points(200, 1))
        self.bad_input(["doctor", "ball.ply", "--fix", "x.ply"], "cannot be repaired", "--up")
        self.bad_input(["doctor", "ball.ply", "--fix", "x.ply", "--picture", "x.png"], "cannot be repaired")
        os.mkdir(self.path("y.ply.transform.json"))
        self.bad_input(["doctor", "ball.ply", "--fix", "y.ply", "--up", "y", "--scale", "0.3"], "y.ply.transform.json")
        self.done("doctor", "ball.ply", "--fix", "x.ply", "--up", "y", "--scale", "0.3")
        for scale in ("0", "inf", "nan", "1e300", "1e-30"):
            self.bad_input(["doctor", "ball.ply", "--scale", scale], "--scale")
        self.bad_input(["doctor", "ball.ply", "--up", "w"], "--up")
        self.bad_input(["doctor", "ball.ply", "--scale", "-1"], "--scale")
        self.bad_input(["doctor", "ball.ply", "--up", "+y", "--facing=-y"], "nobody")

    def test_bad_files(self):
        bad = lambda name, *words: self.bad_input(["doctor", name], name, *words)
        good = self.bytes(self.ply("good.ply", TETRAHEDRON, FACES))
        for part in (0.99, 0.6, 0.3, 0.02):
            bad(self.write("cut.ply", good[:int(len(good) * part)]))
        bad(self.ply("nan.ply", [(float("nan"), 0, 0)]), "NaN")
        bad(self.ply("face.ply", TETRAHEDRON, FACES + [(0, 1, 4)]), "face")
        bad(self.ply("minus.ply", TETRAHEDRON, FACES + [(0, 1, -1)]), "face")
        bad(self.ply("empty.ply", []))
        bad(self.write("zero.ply", b""))
        bad(self.write("zero.obj", b""))
        bad(self.write("face.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"), "face")
        bad(self.write("nan.obj", "v 0 0 nan\n"))
        bad(self.write("huge.ply", good.replace(b"element vertex 4", b"element vertex 4000000000000")))
        bad(self.write("what.bin", struct.pack("<4I", 1, 2, 3, 4)), "kind")
        bad(self.write("what.xyz", struct.pack("<4I", 1, 2, 3, 4)))
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
        self.done("view", "result.h5", "--compare", "scans", "--truth", "result.h5", "--out", "sheet.png")
        self.assertEqual(self.bytes("sheet.png")[:8], b"\x89PNG\r\n\x1a\n")
        self.done("view", "result.h5", "--compare", "scans", "--out", "page.html")
        page = self.bytes("page.html").decode()
        self.assertIn("<html", page.lower())
        for outside in ("src=\"http", "href=\"http", "@import", "fetch("):
            self.assertNotIn(outside, page)

    def test_close_up_of_a_joint(self):
        width = lambda name: int.from_bytes(self.bytes(name)[16:20], "big")
        self.done("view", "result.h5", "--look", "left_wrist", "--within", "0.2", "--azimuth", "90", "--out", "hand.png", "--columns", "3")
        self.done("view", "result.h5", "--look", "neck", "--within", "0.2", "--azimuth", "90", "--out", "head.png", "--columns", "3")
        self.assertEqual(width("hand.png"), width("head.png"))
        self.assertNotEqual(self.bytes("hand.png"), self.bytes("head.png"))
        self.bad_input(["view", "result.h5", "--look", "left_rist", "--out", "a.png"], "left_wrist")
        self.bad_input(["view", "result.h5", "--look", "head", "--out", "a.html"], "--look")
        self.bad_input(["view", "result.h5", "--compare", "scans", "--look", "head", "--out", "a.png"], "scans", "joints")
        self.bad_input(["view", "result.h5", "--look", "head", "--within", "0", "--out", "a.png"], "--within")
        self.bad_input(["view", "result.h5", "--within", "0.2", "--out", "a.png"], "--within", "--look")
        self.bad_input(["view", "result.h5", "--azimuth", "nan", "--out", "a.png"], "--azimuth")
        self.bad_input(["view", "result.h5", "--azimuth", "9", "--out", "a.html"], "--azimuth", "sheet")

    def test_joints_alone_and_single_meshes(self):
        self.h5("joints.h5", joints=([2, 22, 3], numbers(132, 1)))
        self.done("view", "joints.h5", "--columns", 2, "--out", "a.png")
        self.done("view", self.ply("one.ply", TETRAHEDRON, FACES), "--columns", 2, "--out", "b.png")

    def test_bad_input(self):
        self.bad_input(["view", "result.h5", "--compare", "source", "--out", "sheet.bmp"], "sheet.bmp")
        self.bad_input(["view", "none.h5", "--compare", "source", "--out", "sheet.png"], "none.h5")
        self.bad_input(["view", "result.h5", "--compare", "scans", "--out", "nowhere/sheet.png"], "nowhere")
        self.bad_input(["view", "result.h5", "--compare", "scans", "--out", "sheet.png", "--sequence", 1], "sequence")
        self.bad_input(["view", "result.h5", "--compare", "source", "--out", "sheet.png"], "made from")
        self.bad_input(["view", "result.h5", "--compare", self.ply("e.ply", []), "--out", "sheet.png"], "e.ply")
        for i in range(3):
            self.ply("scans/s%d.ply" % i, [])
        self.bad_input(["view", "result.h5", "--compare", "scans", "--out", "sheet.png"], "s0.ply")

    def test_full_disk(self):
        result = self.restage("view", "result.h5", "--compare", "scans", "--out", "sheet.png", before=small_disk)
        self.one_line(result, 1, "sheet.png")
        self.assertNotIn("sheet.png", os.listdir(self.folder))
