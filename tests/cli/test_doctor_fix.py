"""What `restage doctor --fix` and `--picture` write."""
import json
import math
import os
import struct
import zlib

from support import ROOT, CliTest, numbers
from test_arrays import npy
from test_data import toy_bvh
from test_gltf import character


class DoctorFix(CliTest):
    def mesh(self, name):
        head, _, body = self.bytes(name).partition(b"end_header\n")
        count = lambda what: int(head.split(b"element %s " % what)[1].split()[0]) if b"element " + what in head else 0
        n = count(b"vertex")
        rest = body[12 * n:]
        return (list(struct.iter_unpack("<3f", body[:12 * n])),
                [struct.unpack_from("<3i", rest, 13 * i + 1) for i in range(count(b"face"))])

    def fix(self, name, out, code, *more):
        result = self.restage("doctor", name, "--json", "--fix", out, *more)
        self.assertEqual((result.code, result.err), (code, ""))
        return json.loads(result.out)

    def frames(self, folder, clouds):
        for i, cloud in enumerate(clouds):
            self.ply("%s/f%d.ply" % (folder, i), cloud)
        return folder

    def walk(self):
        """Twelve clouds of the person, each a little further on."""
        person = self.person()
        return [[(x, y, z + 0.02 * i) for x, y, z in person] for i in range(12)]

    def test_what_can_be_written_is_known_before_anything_is_read(self):
        for out in ("x.glb", "x.gltf", "x.npz", "x.npy", "x.stl", "x.png", "x.xyz", "x.hdf5"):
            self.bad_input(["doctor", "nothing.ply", "--fix", out], ".ply or .obj", ".h5", "folder")
        self.bad_input(["doctor", "nothing.ply", "--fix", ""], "--fix is empty")
        self.frames("walk12", self.walk())
        self.bad_input(["doctor", "walk12", "--fix", "x.ply"], "x.ply", "12 frames", ".h5")
        self.bad_input(["doctor", "walk/target.ply", "--fix", "x.h5"], "surfaces", ".ply")

    def test_points_that_are_no_numbers_are_told_and_left_out(self):
        nan, inf = float("nan"), float("inf")
        person, bad = self.person(), [(nan, 0, 0), (0, inf, 0), (0, 0, -inf)]
        faces = self.mesh("walk/target.ply")[1]
        cloud = person[:900] + bad + person[900:]
        shifted = [[i + 3 * (i >= 900) for i in face] for face in faces]
        self.write("bad.obj", "".join("v %.9g %.9g %.9g\n" % p for p in cloud).encode())
        self.write("bad.npy", npy((2, len(cloud), 3), 2 * [x for point in cloud for x in point], "<f4"))
        self.frames("bad_frames", [cloud, person])
        for name, out, said in ((self.ply("bad.ply", cloud), "a.ply", "3 points"),
                                (self.ply("mesh.ply", cloud, shifted + [(0, 1, 900)]), "b.ply", "3 points"),
                                ("bad.obj", "c.ply", "3 points"), ("bad.npy", "d.h5", "6 points"), ("bad_frames", "e.h5", "3 points")):
            found = json.loads(self.restage("doctor", name, "--json").out)
            wrong = [f for f in found["findings"] if f["topic"] == "non-finite"]
            self.assertEqual([f["weight"] for f in wrong], ["note"], name)
            self.assertIn("which retarget leaves out", wrong[0]["what"])
            self.assertTrue(wrong[0]["what"].startswith(said), wrong)
            self.assertTrue(found["usable"], found)
            self.assertEqual(self.restage("doctor", name).code, 0)
            self.assertTrue(self.fix(name, out, 0)["fixed"]["usable"], name)
        # A target that lacks a point would be another: retarget refuses it, and so does the doctor.
        self.assertEqual(self.restage("doctor", "bad.ply", "--as-target").code, 1)
        self.assertEqual(self.mesh("b.ply"), (person, faces))
        self.assertEqual(json.loads(self.done("doctor", "e.h5", "--json"))["facts"]["frames"], 2)

    def test_a_character_is_mended_as_retarget_takes_it(self):
        count, faces = character(self.path("hero.glb"))  # an A-pose, z up
        fixed = self.restage("doctor", "hero.glb", "--fix", "hero.ply", "--up", "y", "--scale", 1, "--facing", "z")
        self.assertEqual(fixed.err, "")
        self.assertIn("takes as its target", fixed.out)
        vertices, written = self.mesh("hero.ply")
        self.assertEqual((len(vertices), len(written)), (count, len(faces)))
        left, right = vertices[3 * 20], vertices[3 * 21]  # at the wrists: the arms are along x
        self.assertAlmostEqual(left[1], vertices[3 * 16][1], 1)
        self.assertTrue(left[0] > 0.6 > -0.6 > right[0])
        self.assertEqual(json.loads(self.bytes("hero.ply.transform.json"))["of"], "the surface that retarget takes as its target")

    def test_one_frame_of_any_kind_becomes_a_file(self):
        self.frames("one", [self.person()])
        self.assertTrue(self.fix("one", "one.ply", 0)["fixed"]["usable"])
        self.assertEqual(len(self.mesh("one.ply")[0]), len(set(self.person())))
        text = "".join("v %r %r %r\n" % p for p in self.person())
        self.assertEqual(self.fix(self.write("SHOUT.OBJ", text), "quiet.obj", 0)["kind"], "cloud")

    def test_json_says_what_was_written(self):
        self.ply("back.ply", [(-x, y, -z) for x, y, z in self.person()])
        found = self.fix("back.ply", "mended.ply", 0, "--as-target", "--picture", "p.png")
        self.assertEqual((found["picture"], found["usable"]), ("p.png", False))
        fixed = found["fixed"]
        self.assertEqual((fixed["file"], fixed["transform_file"], fixed["usable"], fixed["still_wrong"]),
                         ("mended.ply", "mended.ply.transform.json", True, []))
        self.assertIn("no normals, colours", " ".join(fixed["remarks"]))
        self.assertIsNone(self.fix("back.ply", "mended.h5", 0)["fixed"]["transform_file"])

    def test_what_is_still_wrong_is_said(self):
        arms = [(x, y - abs(x), z) for x, y, z in self.person()]  # hanging arms stay what they are
        found = self.fix(self.ply("arms.ply", arms), "arms2.ply", 1, "--as-target")
        self.assertIn("T-pose", found["fixed"]["still_wrong"][0]["what"])
        text = self.restage("doctor", "arms.ply", "--fix", "arms2.ply", "--as-target")
        self.assertEqual(text.code, 1)
        self.assertIn("wrote arms2.ply, still not usable:", text.out)

    def test_predictions_stay_predictions(self):
        self.person()
        vertices, faces = self.mesh("walk/target.ply")
        flat = lambda rows: [x for row in rows for x in row]
        joints = numbers(4 * 66, 3)
        far = [(100 * x, -100 * z, 100 * y) for x, y, z in vertices]
        self.h5("cm.h5", {"license": "CC0", "provenance": "mocap.cs.cmu.edu"}, joints=([4, 22, 3], joints),
                vertices=([4, len(far), 3], flat(far) * 4, "float32"), faces=([len(faces), 3], flat(faces), "int64"),
                sequence_offset=([3], [0, 1, 4], "int64"), source_to_world=([3, 4], [1, 0, 0, 5, 0, 1, 0, 6, 0, 0, 1, 7]))
        self.fix("cm.h5", "m.h5", 0)
        said = self.json("data", "inspect", "m.h5")
        self.assertEqual((said["kind"], said["license"]), ("prediction", "CC0"))
        self.assertEqual(said["counts"], {"frames": 4, "joints": 22, "vertices": len(far), "faces": len(faces), "sequences": 2})
        self.assertTrue(said["provenance"].startswith("mocap.cs.cmu.edu; repaired"))
        t = said["transform"]
        move = lambda p: [t["scale"] * sum(t["rotation"][i][j] * (p[j] - t["offset"][j]) for j in range(3)) for i in range(3)]
        # eval finds the joints where the transform puts them.
        moved = flat(move(joints[k:k + 3]) for k in range(0, len(joints), 3))
        self.h5("truth.h5", joints=([4, 22, 3], moved), vertices=([4, len(far), 3], flat(map(move, far)) * 4, "float64"),
                sequence_offset=([3], [0, 1, 4], "int64"))
        mean = self.json("eval", "--pred", "m.h5", "--truth", "truth.h5")["mean"]
        self.assertLess(mean["mpjpe"], 1e-9)
        self.assertLess(mean["mpvd"], 1e-6)

    def test_a_mirrored_prediction_stays_one_and_says_so(self):
        self.person()
        vertices, _ = self.mesh("walk/target.ply")
        # Hips, ankles, toes, shoulders: the left ones on the right of one who faces +z.
        joint = [[0, 1, 0] for _ in range(22)]
        for left, at in ((1, (-.1, .9, 0)), (7, (-.1, .1, 0)), (10, (-.1, 0, .15)), (16, (-.2, 1.4, 0))):
            joint[left] = list(at)
            joint[left + 1] = [-at[0], at[1], at[2]]
        self.h5("mir.h5", joints=([2, 22, 3], [x for p in joint for x in p] * 2),
                vertices=([2, len(vertices), 3], [x for p in vertices for x in p] * 2, "float32"))
        fixed = self.fix("mir.h5", "mir2.h5", 1)["fixed"]
        self.assertIn("exchanged", fixed["still_wrong"][0]["what"])
        self.assertEqual(self.json("data", "inspect", "mir2.h5")["counts"]["joints"], 22)

    def test_scans_keep_their_joints_and_where_they_are_from(self):
        self.person()
        self.assertEqual(self.json("data", "inspect", "walk/source.h5")["counts"]["joints"], 22)
        self.fix("walk/source.h5", "again.h5", 0)
        said = self.json("data", "inspect", "again.h5")
        was = self.json("data", "inspect", "walk/source.h5")
        self.assertEqual((said["counts"]["joints"], said["license"]), (22, was["license"]))
        self.assertTrue(said["provenance"].startswith(was["provenance"]))
        self.assertIn("joints are not kept", " ".join(self.fix("walk/source.h5", "folder", 0)["fixed"]["remarks"]))

    def test_repairs_add_up(self):
        self.frames("far", [[(50 + 100 * x, 100 * y, 100 * z) for x, y, z in c] for c in self.walk()])
        self.fix("far", "once.h5", 0)
        self.fix("once.h5", "twice.h5", 0)
        once, twice = (self.json("data", "inspect", name)["transform"] for name in ("once.h5", "twice.h5"))
        self.assertAlmostEqual(twice["scale"], 0.01)
        for a, b in zip(once["offset"], twice["offset"]):
            self.assertAlmostEqual(a, b, delta=1)  # centimetres

    def test_of_a_mesh_whole_pieces_are_left_out(self):
        self.person()
        vertices, faces = self.mesh("walk/target.ply")
        n = len(vertices)
        boxes = [(3 + x, y, z) for x in (0, .6) for y in (0, .6) for z in (0, .6)]
        box = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
        # The box stands first, so that all numbers move; the person's order stays.
        self.ply("both.ply", boxes + vertices, box + [tuple(v + 8 for v in f) for f in faces])
        known = ("--scale", 1, "--up", "y", "--facing", "z")
        found = self.fix("both.ply", "alone.ply", 0, *known)
        self.assertIn("8 points and 12 triangles", " ".join(found["fixed"]["remarks"]))
        self.fix("walk/target.ply", "self.ply", 0, *known)
        kept, its = self.mesh("alone.ply")
        self.assertEqual((len(kept), its), (n, faces))
        whole = self.mesh("self.ply")[0]
        for axis in range(3):
            shift = kept[0][axis] - whole[0][axis]
            self.assertLess(max(abs(p[axis] - q[axis] - shift) for p, q in zip(kept, whole)), 1e-5)

    def test_a_folder_plays_at_the_right_rate(self):
        clouds = self.walk()
        self.frames("twice", [c for c in clouds for _ in range(2)])  # 15 frames a second
        found = self.fix("twice", "again", 0)
        self.assertEqual(len(os.listdir(self.path("again"))), 24)
        self.assertIn("30 frames a second", " ".join(found["fixed"]["remarks"]))
        self.fix("twice", "again.h5", 0)
        said = self.json("data", "inspect", "again.h5")
        self.assertEqual((said["counts"]["frames"], said["fps"]), (12, 15))
        self.fix("again.h5", "slow", 0)
        self.assertEqual(len(os.listdir(self.path("slow"))), 24)

    def test_the_rate_is_told(self):
        self.frames("sixty", self.walk())
        found = self.fix("sixty", "sixty.h5", 0, "--fps", 60)
        self.assertEqual(found["facts"]["fps"], 60)
        self.assertEqual(self.json("data", "inspect", "sixty.h5")["fps"], 60)
        self.fix("sixty.h5", "again.h5", 0)  # a file that states its rate keeps it
        self.assertEqual(self.json("data", "inspect", "again.h5")["fps"], 60)
        self.fix("sixty.h5", "slow.h5", 0, "--fps", 24)
        self.assertEqual(self.json("data", "inspect", "slow.h5")["fps"], 24)
        found = self.fix("sixty", "thirty", 0, "--fps", 60)
        self.assertEqual(len(os.listdir(self.path("thirty"))), 6)
        self.assertIn("thinned", " ".join(found["fixed"]["remarks"]))
        for rate in (0, -1, "nan", 1e9):
            self.bad_input(["doctor", "sixty", "--fps", rate], "--fps")
        self.bad_input(["doctor", "walk/target.ply", "--fps", 60], "target.ply", "no sequence", "--fps")
        header = "{'descr': '<f4', 'fortran_order': False, 'shape': (0, 3), }"
        self.write("none.npy", b"\x93NUMPY\x01\x00\x76\x00" + header.ljust(117).encode() + b"\n")
        self.bad_input(["doctor", "none.npy"], "none.npy: holds no frame with points")
        self.write("none.glb", b"")
        self.bad_input(["doctor", "none.glb"], "none.glb: is empty")

    def test_an_option_that_says_nothing_is_refused(self):
        self.write("a.bvh", toy_bvh())
        self.write("a.yaml", "seed: 1\n")
        self.done("data", "import", "a.bvh", "--out", "motions.h5")
        lite = os.path.join(ROOT, "experiments", "weights", "lite.safetensors")
        for file in ("a.yaml", lite, "motions.h5"):
            for option in (["--scale", "mm"], ["--up", "z"], ["--facing", "x"], ["--fps", 60], ["--bones", "mixamo"], ["--as-target"]):
                self.bad_input(["doctor", file, *option], os.path.basename(file), "leave " + option[0] + " out")
        self.bad_input(["doctor", "a.bvh", "--as-target"], "a.bvh", "leave --as-target out")
        self.frames("walking", self.walk())
        self.bad_input(["doctor", "walking", "--as-target"], "walking", "leave --as-target out")

    def test_the_unit_of_a_recording_is_told(self):
        self.write("a.bvh", toy_bvh())  # centimetres
        facts = lambda *more: self.json("doctor", "a.bvh", *more)["facts"]  # noqa: E731
        self.assertEqual(facts()["metres_per_unit"], 0.01)
        self.assertEqual(facts("--scale", "0.012")["metres_per_unit"], 0.012)
        self.assertAlmostEqual(facts("--scale", "0.012")["leg_length"], 1.2 * facts()["leg_length"], delta=1e-6)
        self.assertNotEqual(facts("--up", "y", "--facing", "x"), facts())

    def test_people_are_turned_by_the_angle_found(self):
        turn = math.radians(35)
        person = [(x * math.cos(turn) + z * math.sin(turn), y, z * math.cos(turn) - x * math.sin(turn)) for x, y, z in self.person()]
        self.ply("turned.ply", person)
        self.assertEqual(self.restage("doctor", "turned.ply", "--as-target").code, 1)
        found = self.fix("turned.ply", "straight.ply", 0, "--as-target")
        self.assertAlmostEqual(found["frame"]["turned"], 35, delta=8)
        self.assertIn("turned by", " ".join(found["fixed"]["remarks"]))
        kept = json.loads(self.bytes("straight.ply.transform.json"))
        self.assertIn("degrees about the vertical", kept["turned"])
        for i in range(0, len(person), 100):  # as it says: scale R (p - t)
            want = [kept["scale"] * sum(kept["rotation"][r][c] * (person[i][c] - kept["offset"][c]) for c in range(3)) for r in range(3)]
            for a, b in zip(want, self.mesh("straight.ply")[0][i]):
                self.assertAlmostEqual(a, b, 5)

    def test_results_keep_how_sure_they_are(self):
        self.person()
        vertices, faces = self.mesh("walk/target.ply")
        flat = lambda rows: [x for row in rows for x in row]
        self.h5("r.h5", {"source": "scans"}, joints=([3, 22, 3], numbers(3 * 66, 3)),
                vertices=([3, len(vertices), 3], flat((100 * x, 100 * y, 100 * z) for x, y, z in vertices) * 3, "float32"),
                confidence=([3], [.5, .25, 1], "float32"), radius=([3, 22], [2.0], "float32"), mine=([3, 2], numbers(6, 1)), table=([5], [1.0]))
        remarks = " ".join(self.fix("r.h5", "m.h5", 0)["fixed"]["remarks"])
        self.assertIn("/table", remarks)
        self.assertIn("as they stand, neither turned nor scaled: /mine", remarks)
        self.assertEqual(self.json("data", "verify", "m.h5")["problems"], [])
        # The radius is 2 cm of centimetres: of joints 1 cm away all are within it, of joints 3 cm away none.
        for off, share in ((1, 1), (3, 0)):
            was = numbers(3 * 66, 3)
            self.h5("t.h5", joints=([3, 22, 3], [x + off * (i % 3 == 1) for i, x in enumerate(was)]),
                    vertices=([3, len(vertices), 3], flat((100 * x, 100 * y, 100 * z) for x, y, z in vertices) * 3, "float32"))
            self.fix("t.h5", "tm.h5", 0)
            self.assertEqual(self.json("eval", "--pred", "m.h5", "--truth", "tm.h5")["joints_within_radius"], share)
        self.assertIn("confidence", " ".join(self.fix("r.h5", "folder", 0)["fixed"]["remarks"]))

    def test_a_rate_that_would_fill_the_disk_is_refused(self):
        cloud = self.person()
        self.h5("still.h5", {"fps": 1e-6}, points=([2 * len(cloud), 3], [x for p in cloud for x in p] * 2, "float32"),
                frame_offset=([3], [0, len(cloud), 2 * len(cloud)], "int64"))
        self.bad_input(["doctor", "still.h5", "--fix", "folder"], "30 a second", ".h5")

    def test_sequences_are_not_joined(self):
        cloud = self.person()
        flat = [x for c in self.walk()[:4] for p in c for x in p]
        n = len(cloud)
        self.h5("two.h5", points=([4 * n, 3], flat, "float32"), frame_offset=([5], [0, n, 2 * n, 3 * n, 4 * n], "int64"),
                sequence_offset=([3], [0, 2, 4], "int64"))
        self.bad_input(["doctor", "two.h5", "--fix", "folder"], "2 sequences", ".h5")
        self.fix("two.h5", "mended.h5", 0)
        self.assertEqual(self.json("data", "inspect", "mended.h5")["counts"]["sequences"], 2)

    def double_ply(self, name, cloud, kind="double"):
        head = "ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % len(cloud)
        head += "".join("property %s %s\n" % (kind, axis) for axis in "xyz") + "end_header\n"
        return self.write(name, head.encode() + b"".join(struct.pack("<3d" if kind == "double" else "<3f", *p) for p in cloud))

    def test_far_from_the_origin(self):
        person = self.person()
        far = [(500000 + x, 5000000 + y, z) for x, y, z in person]
        self.double_ply("utm.ply", far)
        self.bad_input(["render", "utm.ply", "--out", "x.png"], "utm.ply", "from the origin", "doctor")
        found = self.fix("utm.ply", "near.ply", 0)
        self.assertIn("far from the origin", " ".join(found["notes"]))
        near = self.mesh("near.ply")[0]
        shift = [near[0][i] - person[0][i] for i in range(3)]
        self.assertLess(max(abs(a - b - s) for p, q in zip(near, person) for a, b, s in zip(p, q, shift)), 1e-5)
        kept = json.loads(self.bytes("near.ply.transform.json"))
        self.assertEqual(found["transform"]["offset"], kept["offset"])
        for i in range(3):
            self.assertAlmostEqual(near[0][i], far[0][i] - kept["offset"][i], 5)
        # What was single precision there is lost, and said to be.
        self.double_ply("lost.ply", far, "float")
        text = self.restage("doctor", "lost.ply")
        self.assertEqual(text.code, 1)
        self.assertIn("double precision", text.out)
        flat = [x for p in far for x in p]
        self.h5("utm.h5", points=([len(far), 3], flat), frame_offset=([2], [0, len(far)], "int64"))
        self.bad_input(["doctor", "utm.h5"], "from the origin", "subtract")

    def test_gaps_keep_their_time(self):
        for missing, frames, words in ((4, 16, "frames without points"), (40, 52, "frames without points"), (2000, 12, "over a minute")):
            for i, cloud in enumerate(self.walk()):
                self.ply("gap%d/f%d.ply" % (missing, i if i < 6 else i + missing), cloud)
            found = self.fix("gap%d" % missing, "out.h5", 0)
            fix = [f["fix"] for f in found["findings"] if f["topic"] == "missing frames"]
            self.assertIn(words, fix[0])
            self.assertIn(words, " ".join(found["fixed"]["remarks"]))
            self.assertEqual(self.json("data", "inspect", "out.h5")["counts"]["frames"], frames)

    def test_first_frames_of_something_else_are_left_out(self):
        clouds = self.walk()
        clouds[0] = [(3 * x, 3 * y, 3 * z) for x, y, z in clouds[0]]
        self.frames("first", clouds)
        found = self.fix("first", "out.h5", 0)
        self.assertIn("the first 1 frame, of another size", " ".join(found["fixed"]["remarks"]))
        self.assertEqual(self.json("data", "inspect", "out.h5")["counts"]["frames"], 11)

    def pixels(self, name):
        """Rows of RGB of a PNG."""
        data, at, packed, width, height = self.bytes(name), 8, b"", 0, 0
        while at < len(data):
            size, kind = struct.unpack(">I4s", data[at:at + 8])
            chunk = data[at + 8:at + 8 + size]
            if kind == b"IHDR":
                width, height = struct.unpack(">2I", chunk[:8])
            if kind == b"IDAT":
                packed += chunk
            at += size + 12
        raw, stride, rows, above = zlib.decompress(packed), 3 * width, [], bytes(3 * width)
        for y in range(height):
            filter_, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
            for i in range(stride):
                a, b, c = (row[i - 3] if i > 2 else 0), above[i], (above[i - 3] if i > 2 else 0)
                p = a + b - c
                paeth = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
                row[i] = (row[i] + (0, a, b, (a + b) // 2, paeth)[filter_]) % 256
            rows.append(bytes(row))
            above = row
        return rows

    def share(self, name, wanted, columns=(0, 1)):
        """Pixels whose colour is about so, in a part of the width."""
        rows = self.pixels(name)
        width = len(rows[0]) // 3
        return sum(wanted(*row[3 * x:3 * x + 3]) for row in rows[40:400] for x in range(int(columns[0] * width), int(columns[1] * width)))

    def test_pictures_show_the_frame_with_the_finding_and_all_of_it(self):
        clouds = self.walk()
        clouds[7] = clouds[7] + [(x + 2.5, y, z + 1) for x, y, z in clouds[7]]
        self.done("doctor", self.frames("late", clouds), "--picture", "p.png")
        orange = lambda r, g, b: r > 150 and r > g + 40 and g > b + 30
        for quarter in range(4):  # as it is, front, side, top
            self.assertGreater(self.share("p.png", orange, (quarter / 4, (quarter + 1) / 4)), 20, quarter)

    def test_inspect_plots_what_is_there(self):
        person = self.person()
        clouds = [[(100 * x, 100 * y, 100 * z) for x, y, z in c] for c in self.walk()]
        n = len(person)
        self.h5("cm.h5", points=([12 * n, 3], [x for c in clouds for p in c for x in p], "float32"),
                frame_offset=([13], [n * i for i in range(13)], "int64"), sequence_offset=([3], [0, 8, 12], "int64"))
        found = self.json("data", "inspect", "cm.h5", "--plot", "p.png")
        said = " ".join(found["plot"]["remarks"])
        self.assertIn("first of 2 sequences", said)
        self.assertRegex(said, r"drawn 0\.0\d+ times as large")
        blue = lambda r, g, b: b > r + 40 and b > 90
        self.assertGreater(self.share("p.png", blue), 8 * 300)
