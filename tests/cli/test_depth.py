"""Pictures of a depth camera: import makes clouds of the person, and retarget moves a target by them."""
import math
import struct
import zlib

from support import CliTest

WIDTH, HEIGHT, FOCAL = 160, 120, 140.0
MIDDLE = ((WIDTH - 1) / 2, (HEIGHT - 1) / 2)
NUMBERS = "%g,%g,%g,%g" % (FOCAL, FOCAL, *MIDDLE)
EYE = (0.0, 1.3, 3.0)  # the person stands at the origin and faces +z, to the camera
FRAMES, WALL = 12, 4.0


def png(rows, bits=16, colour=0):
    """A PNG file of these rows of whole numbers (of colours: three in a row for each pixel)."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    width = len(rows[0]) // (3 if colour == 2 else 1)
    body = b"".join(b"\0" + struct.pack(">%d%s" % (len(row), "H" if bits == 16 else "B"), *row) for row in rows)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, len(rows), bits, colour, 0, 0, 0)) + \
        chunk(b"IDAT", zlib.compress(body)) + chunk(b"IEND", b"")


def picture(vertices, tilt=0.0, unit=0.001):
    """What a camera that looks down by `tilt` sees of somebody on a floor before a wall."""
    c, s = math.cos(tilt), math.sin(tilt)
    depth = [[0.0] * WIDTH for _ in range(HEIGHT)]
    for v in range(HEIGHT):
        for u in range(WIDTH):
            up, ahead = -(v - MIDDLE[1]) / FOCAL, 1.0
            y, z = c * up - s * ahead, -(c * ahead + s * up)
            far = [WALL / -z] if z < 0 else []
            far += [EYE[1] / -y] if y < 0 else []
            depth[v][u] = min(far, default=0.0)
    for p in vertices:
        x, y, z = (a - b for a, b in zip(p, EYE))
        up, ahead = c * y - s * z, -c * z - s * y
        u, v = round(FOCAL * x / ahead + MIDDLE[0]), round(-FOCAL * up / ahead + MIDDLE[1])
        for row in depth[max(0, v - 1):v + 2]:
            for k in range(max(0, u - 1), min(WIDTH, u + 2)):
                row[k] = min(row[k] or ahead, ahead)
    return png([[round(z / unit) if z < 8 else 0 for z in row] for row in depth])


class Depth(CliTest):
    def recording(self, name, tilt=0.0, unit=0.001, names="%06d"):
        self.person(FRAMES)
        self.restage("doctor", "walk/truth.h5", "--fix", "surfaces/", "--up", "y", "--scale", 1, "--facing", "z")
        for f in range(FRAMES):
            self.write(("%s/" + names + ".png") % (name, f), picture(self.vertices("surfaces/frame_%06d.ply" % f), tilt, unit))
        return name

    def test_two_commands(self):
        self.recording("depth", tilt=0.2)
        self.write("camera.json", '{"width": %d, "height": %d, "intrinsic_matrix": [%g, 0, 0, 0, %g, 0, %g, %g, 1]}' % (WIDTH, HEIGHT, FOCAL, FOCAL, *MIDDLE))
        found = self.json("data", "import", "depth", "--intrinsics", "camera.json", "--out", "seen.h5")
        self.assertEqual((found["sequences"], found["frames"]), (1, FRAMES))
        said = " ".join(found["reports"][0]["remarks"])
        self.assertIn("on floors and walls", said)
        self.assertIn("turned by 11.", said)
        self.done("retarget", "--source", "seen.h5", "--target", "walk/target.ply", "--rest", "walk/rest.h5", "--out", "out.h5")
        self.assertLess(self.json("eval", "--pred", "out.h5", "--truth", "walk/truth.h5")["mean"]["pa_mpjpe"], 0.06)

    def test_units_rates_and_background(self):
        self.recording("tum/depth", unit=0.0002, names="13050311%02d.5")
        wrong = ["data", "import", "tum", "--intrinsics", NUMBERS, "--out", "x.h5"]
        found = self.json(*wrong[:-1], "a.h5", "--depth-scale", "0.0002", "--fps", 30)
        self.assertIn("0.0002 m a unit", found["reports"][0]["facts"]["depth"])
        whole = self.json(*wrong[:-1], "b.h5", "--depth-scale", "0.0002", "--fps", 30, "--keep-background")
        self.assertIn(str(WIDTH * HEIGHT), whole["reports"][0]["facts"]["points"])
        timed = self.json(*wrong[:-1], "c.h5", "--depth-scale", "0.0002")
        self.assertIn("1 fps (the file's)", timed["reports"][0]["facts"]["rate"])

    def test_what_is_missing_or_wrong(self):
        self.write("depth/0.png", png([[3000] * 16] * 16))
        self.write("depth/1.png", png([[3000] * 16] * 16))
        self.bad_input(["data", "import", "depth", "--out", "x.h5"], "depth: ", "--intrinsics FX,FY,CX,CY")
        bad = lambda given, *words: self.bad_input(["data", "import", "depth", "--intrinsics", given, "--out", "x.h5"], *words)
        bad("5,5", "has 2 numbers", "4 or 9")
        bad("none.json", "'none.json'", "nor a file")
        bad("600,600,320,240", "0.png: is 16 x 16", "pictures of 640 x 480")
        bad(self.write("k.json", '{"w": 640, "h": 480, "fx": 600, "fy": 600, "cx": 320, "cy": 240}'), "k.json", "640 x 480", "16 x 16")
        bad("20,20,7.5,7.5", "shows nobody", "--keep-background")
        self.write("depth/0.png", png([[9] * 48] * 16, 8, 2))
        bad("20,20,7.5,7.5", "0.png: is a picture of colours")
        self.bad_input(["data", "import", "depth/1.png", "--depth-scale", 0, "--intrinsics", "20,20,7.5,7.5", "--out", "x.h5"], "--depth-scale")
        self.ply("cloud.ply", [(0, 0, 0)] * 70)
        self.bad_input(["data", "import", "cloud.ply", "--intrinsics", NUMBERS, "--out", "x.h5"], "cloud.ply: is of no kind")
        self.bad_input(["data", "import", "cloud.ply", "--keep-background", "--out", "x.h5"], "cloud.ply", "--keep-background", "depth pictures")
