"""README's three commands on docs/sample, run as they stand there, and the picture that they should give."""
import os
import re
import shlex
import struct
import zlib

from support import ROOT, CliTest

SAMPLE = os.path.join(ROOT, "docs", "sample")


def commands():
    """Of the block of README.md that names the sample."""
    with open(os.path.join(ROOT, "README.md")) as page:
        block = next(b for b in re.findall(r"```\n(.*?)```", page.read(), re.S) if "docs/sample" in b)
    return [shlex.split(line) for line in block.replace("\\\n", " ").splitlines() if not line.startswith("#")]


def pixels(path):
    """Width, height and the bytes of a PNG picture of 8-bit colours without palette."""
    with open(path, "rb") as file:
        data, at, packed = file.read(), 8, b""
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colours = struct.unpack_from(">IIBB", body)
        elif kind == b"IDAT":
            packed += body
        at += 12 + length
    step = {2: 3, 6: 4}[colours]
    assert depth == 8
    lines, row, out = zlib.decompress(packed), bytearray(width * step), bytearray()
    for y in range(height):
        start = y * (width * step + 1)
        how, before, row = lines[start], row, bytearray(lines[start + 1:start + 1 + width * step])
        for i in range(len(row)):
            left, corner = (row[i - step], before[i - step]) if i >= step else (0, 0)
            if how == 4:
                far = [(abs(before[i] - corner), 0, left), (abs(left - corner), 1, before[i]), (abs(left + before[i] - 2 * corner), 2, corner)]
                row[i] = (row[i] + min(far)[2]) & 255
            else:
                row[i] = (row[i] + (0, left, before[i], (left + before[i]) // 2)[how]) & 255
        out += row
    return width, height, step, bytes(out)


class Sample(CliTest):
    def test_readmes_three_commands(self):
        os.symlink(os.path.join(ROOT, "docs"), self.path("docs"))
        found = commands()
        self.assertEqual([c[:2] for c in found], [["restage", "doctor"], ["restage", "retarget"], ["restage", "view"]])
        said = [self.done(*command[1:]) for command in found]
        self.assertIn("in our frame already", said[0])
        picture = found[2][found[2].index("--out") + 1]
        shown, wanted = pixels(self.path(picture)), pixels(os.path.join(ROOT, "docs", "images", "sample.png"))
        self.assertEqual(shown[:3], wanted[:3])
        off = sum(abs(a - b) for a, b in zip(shown[3], wanted[3])) / len(wanted[3])
        self.assertLess(off, 4, "grey levels of 255; another character is off by 6, other weights by 1.5")

    def test_it_is_small(self):
        sizes = [os.path.getsize(os.path.join(folder, name)) for folder, _, names in os.walk(SAMPLE) for name in names]
        self.assertEqual(len(os.listdir(os.path.join(SAMPLE, "scans"))), 10)
        self.assertLess(sum(sizes), 2_000_000)
