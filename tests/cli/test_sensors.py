"""What sensors and data sets bring, from the file to the result: LiDAR, glTF points, windows, maps' coordinates."""
import json
import os
import random
import struct
import subprocess

from support import CliTest, PROGRAM, ROOT, sphere

LITE = os.path.join(ROOT, "experiments", "weights", "lite.safetensors")


def person(step, far=(0, 0, 0)):
    return [(0.4 * x + 0.01 * step + far[0], 1.6 * y + 0.8 + far[1], 0.3 * z + far[2]) for x, y, z in sphere(200)]


def glb(points):
    body = b"".join(struct.pack("<3f", *p) for p in points)
    scene = json.dumps({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 0}]}],
                        "accessors": [{"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3"}],
                        "bufferViews": [{"buffer": 0, "byteLength": len(body)}], "buffers": [{"byteLength": len(body)}]}).encode()
    scene += b" " * (-len(scene) % 4)
    chunks = struct.pack("<I4s", len(scene), b"JSON") + scene + struct.pack("<I4s", len(body), b"BIN\0") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


class Sensors(CliTest):
    def test_bare_numbers_of_a_lidar(self):
        for f in range(4):
            self.write("in/%06d.bin" % f, b"".join(struct.pack("<4f", *p, 0.3) for p in person(f)))
        found = self.json("data", "import", "in", "--out", "x.h5")
        self.assertEqual((found["sequences"], found["frames"]), (1, 4))
        self.assertEqual(self.json("data", "import", "in/000000.bin", "--out", "x.h5")["frames"], 1)
        self.assertIn("cloud", self.restage("doctor", "in/000000.bin").out)
        self.write("other.bin", b"abc" * 500)
        self.bad_input(["data", "import", "other.bin", "--out", "y.h5"], "other.bin", "numpy.fromfile")

    def test_gltf_files_of_points_are_frames(self):
        for f in range(5):
            self.write("in/scan_%d.glb" % f, glb(person(f)))
        found = self.json("data", "import", "in", "--out", "x.h5")
        self.assertEqual((found["sequences"], found["frames"]), (1, 5))
        self.assertEqual(self.json("data", "import", "in/scan_0.glb", "--out", "x.h5")["frames"], 1)

    def test_inspect_tells_what_import_reads_of_hdf5(self):
        values = [x for f in range(6) for p in person(f) for x in p]
        self.h5("w.h5", point_clouds=([2, 3, 200, 3], values), shape=([2, 3, 10], 0.5))
        found = self.json("data", "inspect", "w.h5")
        self.assertEqual((found["kind"], found["counts"]["sequences"], found["counts"]["frames"]), ("scans", 2, 6))
        self.assertEqual(self.json("data", "import", "w.h5", "--out", "x.h5")["sequences"], 2)

    def test_the_doctor_moves_sequences_of_maps_to_the_origin(self):
        far = (432099.3, 5412301.0, 213.6)
        for f in range(3):
            body = "".join("%.6f %.6f %.6f\n" % p for p in person(f, far))
            self.write("in/%d.xyz" % f, body)
        self.h5("seq.h5", cloud=([3, 200, 3], [x for f in range(3) for p in person(f, far) for x in p]))
        known = ("--up", "y", "--scale", 1, "--facing", "z")
        for source in ("in", "seq.h5"):
            self.bad_input(["data", "import", source, "--out", "x.h5"], "from the origin", "restage doctor SOURCE --fix OUT")
            result = self.restage("doctor", source, "--fix", "mended.h5", *known)
            self.assertIn(result.code, (0, 1), result.err)
            self.assertIn("far from the origin", result.out)
            found = self.json("data", "import", "mended.h5", "--out", "x.h5")
            self.assertEqual(found["frames"], 3)
            note = self.json("data", "inspect", "mended.h5")["transform"]
            self.assertAlmostEqual(note["offset"][0], far[0], delta=1)

    def test_clouds_too_sparse_for_the_confidence(self):
        """One line says so, once a run; dense clouds, and weights without a confidence, have none."""
        self.person(6)
        self.done("doctor", "walk/source.h5", "--fix", "good/")
        chance = random.Random(2)
        for name in sorted(os.listdir(self.path("good"))):
            points = self.vertices("good/" + name)
            for count in (120, 600):
                some = chance.sample(points, count)
                self.ply("%d/%s" % (count, name), some + some[:7])  # repeats do not count
        says = "with 120 points a frame (median) the confidence promises too much"
        for count in (120, 600):
            wanted = int(count == 120)
            folder = str(count)
            moved = self.restage("retarget", folder, "walk/target.ply", "--out", folder + ".h5")
            joints = self.restage("skeleton", folder, "--out", folder + "_joints.h5")
            for told in (moved, joints):
                self.assertEqual(told.code, 0, told.err)
                self.assertEqual(told.err.count(says), wanted, told.err)
                self.assertEqual(told.err.count("the confidence promises too much"), wanted, told.err)
            found = [f for f in self.json("doctor", folder)["findings"] if f["topic"] == "sparse"]
            self.assertEqual([f["weight"] for f in found], ["note"] * wanted)
            if found:
                self.assertRegex(found[0]["what"], r"^1[12]\d points show the person in a frame \(median\)")
        lite = self.restage("retarget", "120", "walk/target.ply", "--weights", LITE, "--out", "lite.h5")
        self.assertEqual(lite.code, 0, lite.err)
        self.assertNotIn("confidence", lite.err)
        name = sorted(os.listdir(self.path("120")))[0]
        self.assertIn("sparse", self.restage("doctor", "120/" + name).out)
        self.assertNotIn("sparse", self.restage("doctor", "120/" + name, "--target").out)
        self.assertNotIn("sparse", self.restage("doctor", "good/" + name).out)
        self.live(says)

    def live(self, says):
        """The same of a stream, when thirty clouds have come, or all."""
        clouds = [self.vertices("120/" + name) for name in sorted(os.listdir(self.path("120")))]
        for count in (4, 40):
            sent = b"".join(struct.pack("<Id", len(c), k / 30) + b"".join(struct.pack("<3f", *p) for p in c)
                            for k, c in ((k, clouds[k % len(clouds)]) for k in range(count)))
            done = subprocess.run([PROGRAM, "stream", "--target", "walk/target.ply", "--source", "-", "--vmc", "127.0.0.1:9"], cwd=self.folder,
                                  input=sent, capture_output=True, timeout=120)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(done.stderr.decode().count(says), 1, done.stderr)
