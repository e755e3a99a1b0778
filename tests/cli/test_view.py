"""restage view: pictures, animated pictures and pages of files made here (and of real characters, where they are at hand)."""
import json
import math
import os
import signal
import struct
import subprocess
import time
import unittest
import zlib

from support import CliTest, points
from test_characters import CHARACTERS, lacking

FRAMES = 31


def png(width, height, pixel):
    """An RGBA picture of pixel(x, y)."""
    raw = b"".join(b"\0" + b"".join(bytes(pixel(x, y)) for x in range(width)) for y in range(height))
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))  # noqa: E731
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b""))


def pixels(data):
    """Rows of (r, g, b) of an RGB PNG without interlacing."""
    width, height = struct.unpack(">II", data[16:24])
    assert data[24:26] == b"\x08\x02", "8-bit RGB"
    packed, at = b"", 8
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        packed += data[at + 8:at + 8 + size] if kind == b"IDAT" else b""
        at += 12 + size
    raw, line, before, out = zlib.decompress(packed), 3 * width, bytes(3 * width), []
    for y in range(height):
        kind, row = raw[y * (line + 1)], bytearray(raw[y * (line + 1) + 1:(y + 1) * (line + 1)])
        for k in range(line):
            left, up, corner = (row[k - 3], before[k], before[k - 3]) if k > 2 else (0, before[k], 0)
            nearest = min((left, up, corner), key=lambda v: abs(left + up - corner - v))
            row[k] = (row[k] + (0, left, up, (left + up) // 2, nearest)[kind]) & 255
        before = bytes(row)
        out.append([tuple(row[3 * x:3 * x + 3]) for x in range(width)])
    return out


def gif_frames(data):
    """Delays of the pictures, in hundredths of a second; reads every block to the end."""
    assert data[:6] == b"GIF89a"
    at, delays = 13 + 3 * 2 ** ((data[10] & 7) + 1), []
    while data[at] != 0x3b:
        if data[at] == 0x21:
            if data[at + 1] == 0xf9:
                delays.append(struct.unpack("<H", data[at + 4:at + 6])[0])
            at += 2
        else:
            assert data[at] == 0x2c
            at += 11
        while data[at]:
            at += data[at] + 1
        at += 1
    return delays


def webp_frames(data):
    """Durations of the pictures, in milliseconds."""
    assert data[:4] == b"RIFF" and data[8:12] == b"WEBP" and struct.unpack("<I", data[4:8])[0] + 8 == len(data)
    at, durations = 12, []
    while at < len(data):
        kind, size = struct.unpack("<4sI", data[at:at + 8])
        if kind == b"ANMF":
            durations.append(int.from_bytes(data[at + 20:at + 23], "little"))
        at += 8 + size + size % 2
    return durations


class Glb:
    """A box of a person's size whose front is a picture: left half red, right half green, as its viewer sees it. Skinned to a root
    and a head; in the animation the upper half bends aside."""

    def __init__(self):
        self.root = {"asset": {"version": "2.0"}, "bufferViews": [], "accessors": []}
        self.binary = b""
        places, uv, index = [], [], []
        for side, (a, b) in enumerate([((-.4, .2), (.4, .2)), ((.4, .2), (.4, -.2)), ((.4, -.2), (-.4, -.2)), ((-.4, -.2), (-.4, .2))]):
            first = len(places)
            for level in range(3):
                for u, (x, z) in enumerate((a, b)):
                    places.append((x, .85 * level, z))
                    uv.append((float(u) if side == 0 else .25, 1 - level / 2))
            for k in (first, first + 2):
                index += [k, k + 1, k + 3, k, k + 3, k + 2]
        joints = [(1, 0, 0, 0) if y > 1 else (0, 0, 0, 0) for _, y, _ in places]
        mesh = {"POSITION": self.add(places, "f", 5126, "VEC3"), "TEXCOORD_0": self.add(uv, "f", 5126, "VEC2"),
                "JOINTS_0": self.add(joints, "B", 5121, "VEC4"), "WEIGHTS_0": self.add([(1, 0, 0, 0)] * len(places), "f", 5126, "VEC4")}
        times = self.add([(k / 30,) for k in range(FRAMES)], "f", 5126, "SCALAR")
        turns = [(0, 0, math.sin(-.02 * k), math.cos(-.02 * k)) for k in range(FRAMES)]
        still = self.add([(0, 0, 0, 1)] * FRAMES, "f", 5126, "VEC4")
        bend = self.add(turns, "f", 5126, "VEC4")
        inverse = self.add([(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1), (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -.85, 0, 1)], "f", 5126, "MAT4")
        view = self.bytes(png(32, 32, lambda x, y: (255, 0, 0, 255) if x < 16 else (0, 255, 0, 0)))
        clip = lambda name, out: {"name": name, "samplers": [{"input": times, "output": out}],  # noqa: E731
                                  "channels": [{"sampler": 0, "target": {"node": 2, "path": "rotation"}}]}
        self.root.update(
            scenes=[{"nodes": [0, 1]}], nodes=[{"mesh": 0, "skin": 0}, {"name": "base", "children": [2]}, {"name": "upper", "translation": [0, .85, 0]}],
            skins=[{"joints": [1, 2], "inverseBindMatrices": inverse}],
            meshes=[{"primitives": [{"attributes": mesh, "indices": self.add([(i,) for i in index], "H", 5123, "SCALAR"), "material": 0}]}],
            animations=[clip("rest", still), clip("bend", bend)], images=[{"bufferView": view, "mimeType": "image/png", "name": "front"}],
            textures=[{"source": 0}], materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "extensions": {"KHR_materials_unlit": {}}}])

    def bytes(self, data):
        self.binary += bytes(-len(self.binary) % 4)
        self.root["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)})
        self.binary += data
        return len(self.root["bufferViews"]) - 1

    def add(self, rows, letter, component, kind):
        view = self.bytes(b"".join(struct.pack("<%d%s" % (len(row), letter), *row) for row in rows))
        self.root["accessors"].append({"bufferView": view, "componentType": component, "count": len(rows), "type": kind})
        return len(self.root["accessors"]) - 1

    def glb(self):
        text = json.dumps({**self.root, "buffers": [{"byteLength": len(self.binary)}]}).encode()
        text += b" " * (-len(text) % 4)
        data = self.binary + bytes(-len(self.binary) % 4)
        return struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(data), len(text), 0x4E4F534A) + text + \
            struct.pack("<II", len(data), 0x004E4942) + data


class View(CliTest):
    def setUp(self):
        super().setUp()
        self.glb = Glb()
        self.write("box.glb", self.glb.glb())

    def changed(self, name, change):
        glb = Glb()
        change(glb.root)
        return self.write(name, glb.glb())

    def picture(self, *arguments, file="box.glb"):
        self.done("view", file, "--out", "out.png", "--size", "80x100", *arguments)
        return pixels(self.bytes("out.png"))

    def colours(self, rows):
        """How many pixels are clearly red, green, and blue."""
        flat = [p for row in rows for p in row]
        return [sum(p[k] > 90 and p[k] > 1.6 * max(p[j] for j in range(3) if j != k) for p in flat) for k in range(3)]

    def test_a_picture_has_the_files_own_picture(self):
        rows = self.picture("--side", "front", "--frame", 0)
        self.assertEqual((len(rows), len(rows[0])), (100, 80))
        middle = rows[50]
        reds = [x for x, p in enumerate(middle) if p[0] > 200 and p[1] < 60]
        greens = [x for x, p in enumerate(middle) if p[1] > 200 and p[0] < 60]
        self.assertGreater(len(reds), 10)
        self.assertGreater(len(greens), 10)
        self.assertLess(max(reds), min(greens))
        self.assertEqual(self.colours(self.picture("--side", "back", "--frame", 0))[1], 0)

    def test_clips_frames_and_times(self):
        first, last = self.picture("--clip", "bend", "--frame", 0), self.picture("--clip", "bend", "--frame", 30)
        self.assertNotEqual(first, last)
        self.assertEqual(self.picture("--clip", "bend", "--time", 1), last)
        self.assertEqual(self.picture("--frame", 30), self.picture("--frame", 0), "the first clip rests")
        self.assertEqual(self.json("view", "box.glb", "--out", "x.png")["clip"], "rest")
        self.changed("ours.glb", lambda r: r["animations"][1].update(extras={"generator": "restage"}))
        self.assertEqual(self.json("view", "ours.glb", "--out", "x.png")["clip"], "bend")

    def test_animated_pictures(self):
        said = self.json("view", "box.glb", "--clip", "bend", "--size", "60x80", "--out", "x.webp")
        self.assertEqual((said["frames"], said["fps"], said["width"], said["height"]), (31, 30, 60, 80))
        self.assertEqual(said["bytes"], len(self.bytes("x.webp")))
        durations = webp_frames(self.bytes("x.webp"))
        self.assertAlmostEqual(sum(durations), 31000 / 30, delta=1)
        said = self.json("view", "box.glb", "--clip", "bend", "--size", "60x80", "--out", "x.gif")
        delays = gif_frames(self.bytes("x.gif"))
        self.assertEqual((len(delays), said["frames"], said["fps"]), (16, 16, 15))
        self.assertEqual(sum(delays), round(1600 / 15))
        self.assertEqual(self.json("view", "box.glb", "--every", 10, "--size", "60x80", "--out", "y.gif")["frames"], 4)
        self.assertEqual(sum(gif_frames(self.bytes("y.gif"))), round(400 / 3))
        again = self.bytes("x.webp"), self.bytes("x.gif")
        self.done("view", "box.glb", "--clip", "bend", "--size", "60x80", "--threads", 1, "--out", "x.webp")
        self.done("view", "box.glb", "--clip", "bend", "--size", "60x80", "--threads", 1, "--out", "x.gif")
        self.assertEqual((self.bytes("x.webp"), self.bytes("x.gif")), again, "the same bytes for any number of threads")

    def test_masks_veils_and_colours(self):
        def alpha(mode, **more):
            return lambda r: r["materials"][0].update(alphaMode=mode, **more)
        opaque = self.colours(self.picture("--side", "front"))
        self.changed("mask.glb", alpha("MASK"))
        masked = self.colours(self.picture("--side", "front", file="mask.glb"))
        self.assertEqual(masked[1], 0, "the green half has no opacity")
        self.assertGreater(masked[0], 0.9 * opaque[0])
        self.changed("blend.glb", alpha("BLEND"))
        self.assertEqual(self.colours(self.picture("--side", "front", file="blend.glb"))[1], 0)
        self.changed("blue.glb", lambda r: r["materials"][0].update(pbrMetallicRoughness={"baseColorFactor": [0, 0, 1, 1]}))
        self.assertGreater(self.colours(self.picture("--side", "front", file="blue.glb"))[2], sum(opaque) * 0.9)

    def test_pictures_that_cannot_be_decoded(self):
        def damage(root):
            view = root["bufferViews"][root["images"][0]["bufferView"]]
            view["byteLength"] //= 2
            root["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = [0, 0, 1, 1]
        self.changed("broken.glb", damage)
        result = self.restage("view", "broken.glb", "--size", "80x100", "--side", "front", "--out", "out.png")
        self.assertEqual(result.code, 0, result.err)
        self.assertIn("the picture 'front' is not drawn", result.err)
        self.assertGreater(self.colours(pixels(self.bytes("out.png")))[2], 500)
        for name, image in (("lost", {"uri": "lost.png"}), ("none", {}), ("far", {"uri": "../../x.png"}), ("wild", {"bufferView": 10 ** 6})):
            self.changed(name + ".glb", lambda r: r.update(images=[image]))
            result = self.restage("view", name + ".glb", "--size", "80x100", "--out", "out.png")
            self.assertEqual(result.code, 0, result.err)
            self.assertIn("left out", result.err)

    def test_a_page_holds_the_picture(self):
        self.done("view", "box.glb", "--out", "x.html")
        page = self.bytes("x.html").decode()
        self.assertIn('"materials":[{', page)
        self.assertIn("data:image/png;base64,", page)
        self.assertNotIn("http://", page.replace("http://www.w3.org", ""))

    def halves(self, *arguments):
        """Of two takes: the rows of the left and of the right half, without the labels."""
        self.done("view", "--compare", *arguments, "--size", "160x128", "--side", "front", "--out", "two.png")
        rows = pixels(self.bytes("two.png"))
        self.assertEqual((len(rows), len(rows[0])), (128, 160))
        return [row[:80] for row in rows[:100]], [row[80:] for row in rows[:100]], rows[100:]

    def test_two_takes_side_by_side(self):
        self.changed("blue.glb", lambda r: r["materials"][0].update(pbrMetallicRoughness={"baseColorFactor": [0, 0, 1, 1]}))
        left, right, labels = self.halves("box.glb", "blue.glb", "--frame", 0)
        red, green, blue = self.colours(left)
        self.assertTrue(red > 500 and green > 500 and blue == 0, (red, green, blue))
        self.assertEqual(self.colours(right)[:2], [0, 0])
        self.assertAlmostEqual(self.colours(right)[2], red + green, delta=100, msg="as large")  # but for where red meets green
        for side in (0, 80):  # a name below each
            self.assertGreater(sum(sum(p) < 400 for row in labels for p in row[side:side + 80]), 20)
        tall = Glb()
        for node in tall.root["nodes"][1:2]:
            node["scale"] = [2, 2, 2]
        self.write("tall.glb", tall.glb())
        left, right, _ = self.halves("box.glb", "tall.glb", "--frame", 0)
        self.assertAlmostEqual(sum(self.colours(right)) / sum(self.colours(left)), 4, delta=0.4)

    def test_the_shorter_take_holds_its_last_frame(self):
        short = Glb()
        for accessor in short.root["accessors"]:
            accessor["count"] = 11 if accessor["count"] == FRAMES else accessor["count"]
        self.write("short.glb", short.glb())
        clips = ["--clip", "bend", "--source-clip", "bend"]
        at = {f: self.halves("short.glb", "box.glb", *clips, "--frame", f) for f in (0, 10, 30)}
        self.assertNotEqual(at[0][0], at[10][0])
        self.assertEqual(at[10][0], at[30][0])
        self.assertNotEqual(at[10][1], at[30][1])
        self.assertEqual(at[10][0], self.halves("short.glb", "box.glb", *clips, "--time", 1)[0])
        for out, frames in (("two.webp", 31), ("two.gif", 16), ("two.html", 31), ("sheet.png", 31)):
            result = self.restage("view", "--compare", "short.glb", "box.glb", *clips, "--json", "--out", out, *(["--columns", 3] if out == "sheet.png" else []))
            self.assertEqual(result.code, 0, result.err)
            warned = [line for line in result.err.splitlines() if line.startswith("warning")]
            self.assertEqual(len(warned), 1, result.err)
            self.assertRegex(warned[0], "short.glb: bend ends after .* box.glb: bend after .* holds its last frame")
            self.assertEqual(json.loads(result.out)["frames"], frames)
        self.assertEqual(sum(webp_frames(self.bytes("two.webp"))), round(31000 / 30))
        page = self.bytes("two.html").decode()
        self.assertEqual(page.count('class="panel below"'), 2)
        meta = json.loads(page.split('<script id="meta" type="application/json">')[1].split("</script>")[0])
        self.assertEqual([len(clip["counts"]) for clip in meta["clips"]], [31, 31])
        self.assertEqual([clip["label"] for clip in meta["clips"]], ["short.glb: bend", "box.glb: bend"])
        self.assertTrue(all(clip["materials"] for clip in meta["clips"]))
        two = ["view", "--compare", "short.glb", "box.glb", "--out", "x.png"]
        self.bad_input(two + ["--frame", 31], "short.glb", "no frame 31", "0 to 30")
        self.bad_input(two + ["--time", 9], "short.glb", "nothing at 9 seconds")
        self.bad_input(two + ["--source-clip", "walk"], "short.glb", "holds no clip")
        self.bad_input(two + ["--source-sequence", 1], "--source-sequence")
        self.bad_input(two + ["--source-fps", 30], "--source-fps")
        self.bad_input(["view", "--compare", "gone.glb", "box.glb", "--out", "x.png"], "gone.glb")
        self.bad_input(["view", "--compare", "short.glb", "box.glb", "--out", "short.glb"], "short.glb")

    def test_other_files(self):
        person = self.person()
        self.ply("person.ply", person)
        self.assertEqual(self.json("view", "person.ply", "--out", "a.png")["frames"], 1)
        self.assertEqual(self.json("view", "walk/source.h5", "--size", "40x60", "--out", "a.webp")["frames"], 12)
        self.h5("result.h5", joints=((4, 22, 3), 0.0), vertices=((4, 60, 3), [x for f in range(4) for p in points(60, f) for x in p]))
        self.assertEqual(self.json("view", "result.h5", "--size", "40x60", "--every", 2, "--out", "a.gif")["frames"], 2)
        # A mesh of another kind wears its picture, as long as it is neither turned nor scaled.
        self.write("red.png", png(4, 4, lambda x, y: (255, 0, 0, 255)))
        self.write("red.mtl", "newmtl red\nmap_Kd red.png\n")
        self.write("red.obj", "mtllib red.mtl\nusemtl red\nv -1 0 0\nv 1 0 0\nv 1 2 0\nv -1 2 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n")
        self.assertGreater(self.colours(self.picture("--side", "front", file="red.obj"))[0], 500)
        self.assertEqual(self.colours(self.picture("--side", "front", "--up", "y", file="red.obj"))[0], 0)
        self.write("tri.obj", "v 0 0 0\nv 0 170 0\nv 50 0 0\nf 1 2 3\n")
        result = self.restage("view", "tri.obj", "--out", "a.png")
        self.assertIn("drawn as large as a person", result.err)

    def test_bones_without_a_mesh(self):
        def bones(root):
            for name in ("meshes", "skins"):
                del root[name]
            del root["nodes"][0]["mesh"], root["nodes"][0]["skin"]
        self.changed("bones.glb", bones)
        self.assertEqual(self.json("view", "bones.glb", "--out", "x.png")["frames"], 1)
        self.changed("nothing.glb", lambda r: (bones(r), r.pop("animations"), r.update(nodes=[{}], scenes=[])))
        self.bad_input(["view", "nothing.glb", "--out", "n.png"], "neither a mesh nor bones", "nothing to draw")

    def test_refusals(self):
        view = ["view", "box.glb", "--out"]
        self.bad_input(view + ["x.mp4"], "x.mp4", ".png, .webp, .gif or .html")
        self.bad_input(view + ["box.glb"], "box.glb")
        self.bad_input(view + ["no/folder/x.png"], "no/folder")
        self.bad_input(view + ["x.png", "--clip", "walk"], "holds no clip", "bend")
        self.bad_input(view + ["x.png", "--frame", 31], "has no frame 31", "--frame 0 to 30")
        self.bad_input(view + ["x.png", "--frame", -1], "has no frame -1")
        self.bad_input(view + ["x.png", "--time", 2], "nothing at 2 seconds", "0 to 1")
        self.bad_input(view + ["x.png", "--time", "nan"])
        self.bad_input(view + ["x.png", "--frame", 1, "--time", 1], "contradicts")
        self.bad_input(view + ["x.webp", "--frame", 1], "--frame")
        self.bad_input(view + ["x.png", "--every", 2], "--every")
        self.bad_input(view + ["x.gif", "--fps", 60], "1 to 50")
        self.bad_input(view + ["x.webp", "--fps", "nan"], "--fps")
        self.bad_input(view + ["x.webp", "--every", 0], "--every")
        for size in ("80", "80x", "8x8", "5000x80", "80x80x80", "-80x80", "99999999999x99999999999", "axb"):
            self.bad_input(view + ["x.png", "--size=" + size], "--size")
        self.bad_input(view + ["x.png", "--background", "mauve"], "mauve")
        self.bad_input(view + ["x.png", "--zoom", 0], "--zoom")
        self.bad_input(view + ["x.png", "--look", "tail"], "tail")
        self.bad_input(view + ["x.png", "--look", "head"], "does not say where to look for head")
        self.bad_input(view + ["x.html", "--look", "head"], "--look")
        self.bad_input(view + ["x.png", "--up", "z"], "box.glb", "leave --up out")
        self.bad_input(view + ["x.png", "--scale", "cm"], "box.glb", "leave --scale out")
        self.bad_input(view + ["x.png", "--sequence", 0], "box.glb", "leave --sequence out")
        self.bad_input(["view", "gone.glb", "--out", "x.png"], "gone.glb")
        self.write("empty.glb", b"")
        self.bad_input(["view", "empty.glb", "--out", "x.png"], "empty.glb")

    def test_without_a_display_it_says_so(self):
        for name in ("DISPLAY", "WAYLAND_DISPLAY"):
            before = os.environ.pop(name, None)
            if before is not None:
                self.addCleanup(os.environ.__setitem__, name, before)
        self.bad_input(["view", "box.glb"], "no display", "--out picture.png")

    def test_with_a_display_the_page_is_opened(self):
        self.write("bin/xdg-open", '#!/bin/sh\ncp "$1" "%s"\n' % self.path("opened.html"))
        os.chmod(self.path("bin/xdg-open"), 0o755)
        os.makedirs(self.path("tmp"))
        for name, value in (("DISPLAY", ":7"), ("TMPDIR", self.path("tmp")), ("XDG_CACHE_HOME", self.path("cache")), ("PATH", self.path("bin") + ":" + os.environ["PATH"])):
            self.addCleanup(lambda n, v: os.environ.pop(n) if v is None else os.environ.__setitem__(n, v), name, os.environ.get(name))
            os.environ[name] = value
        self.assertIn("box.html", self.done("view", "box.glb"))
        self.assertIn("</html>", self.bytes("opened.html").decode())
        self.write("bin/xdg-open", "#!/bin/sh\nexit 3\n")
        result = self.restage("view", "box.glb")
        self.assertEqual(result.code, 1)
        self.assertIn("no program opened the page", result.err)
        # The opener may be the browser itself, which stays.
        self.write("bin/xdg-open", '#!/bin/sh\necho $$ > "%s"\nexec sleep 60\n' % self.path("browser"))
        begun = time.monotonic()
        self.done("view", "box.glb")
        self.assertLess(time.monotonic() - begun, 20)
        os.kill(int(self.bytes("browser")), signal.SIGTERM)
        # One page a file, of this day: none of the calls has left a folder.
        self.assertEqual(os.listdir(self.path("tmp")), [])
        pages = self.path("cache/restage/view")
        self.assertEqual(os.listdir(pages), ["box.html"])
        os.utime(os.path.join(pages, "box.html"), (1e9, 1e9))
        self.write("bin/xdg-open", "#!/bin/sh\n")
        os.rename(self.path("box.glb"), self.path("other.glb"))
        self.done("view", "other.glb")
        self.assertEqual(os.listdir(pages), ["other.html"])

    def test_any_bytes_end_kindly(self):
        """Whole files with wild numbers in them end with a picture or with one line, never with a crash."""
        data = self.bytes("box.glb")
        for k in range(60):
            at = (k * 7919) % len(data)
            self.write("wild.glb", data[:at] + bytes([255 - data[at], (k * 37) & 255]) + data[at + 2:])
            result = self.restage("view", "wild.glb", "--size", "32x32", "--out", "wild.png")
            self.assertIn(result.code, (0, 2), "byte %d: %s" % (at, result.err))
            if result.code:
                self.one_line(result, 2)


@unittest.skipIf(lacking(), lacking())
class RealCharacters(CliTest):
    def test_whole_and_close_up(self):
        hero = os.path.join(CHARACTERS, "mixa_t.glb")
        for look in ("head", "hands", "left-hand", "right-hand", "feet"):
            self.done("view", hero, "--look", look, "--side", "front", "--size", "60x60", "--out", look + ".png")
            skin = [p for row in pixels(self.bytes(look + ".png")) for p in row if p[0] > 1.15 * p[2] + 8]
            self.assertGreater(len(skin), 60, look)
        self.done("retarget", "--source", os.path.join(CHARACTERS, "source_dance.glb"), "--target", hero, "--clip-name", "dance2", "--out", "x.glb")
        said = self.json("view", "x.glb", "--size", "60x80", "--out", "x.webp")
        self.assertEqual((said["clip"], said["frames"]), ("dance2", 60))
        # Its front is +z whatever the armature's own axes are: the face of a T-pose is seen from the front, not from behind.
        clothes = lambda name: sum(p[2] > 1.3 * p[0] for row in pixels(self.bytes(name)) for p in row)  # noqa: E731
        self.done("view", os.path.join(CHARACTERS, "mixa_a.glb"), "--size", "80x100", "--out", "a.png")
        self.done("view", hero, "--size", "80x100", "--out", "t.png")
        self.assertGreater(clothes("a.png"), 100)
        self.assertGreater(clothes("t.png"), 100)


if __name__ == "__main__":
    unittest.main()
