"""Rigged characters: the file that goes in comes out with one animation more. What is checked in the file is in
tests/datasets/characters_test.cpp; here are the command, its refusals, and, where they are at hand, real characters and a
checker that nobody of this repository wrote."""
import json
import os
import struct
import subprocess
import sys
import unittest

from support import CliTest, ROOT, points
from tiny_run import TPOSES, weights
from test_gltf import character

CHARACTERS = os.path.join(os.environ.get("RESTAGE_SHARED", os.path.join(ROOT, "..", "shared")), "characters")
STANDARD = os.path.join(ROOT, "experiments", "weights", "standard.safetensors")


def python_with_numpy():
    for python in (sys.executable, "/usr/bin/python3"):
        if subprocess.run([python, "-c", "import numpy"], capture_output=True).returncode == 0:
            return python
    return None


def lacking():
    """Why the real characters cannot be checked; empty: they can."""
    why = "no shared characters (set RESTAGE_SHARED)" if not os.path.isdir(CHARACTERS) else \
        "" if python_with_numpy() else "no numpy for the checker"
    if why and os.environ.get("RESTAGE_CI"):
        raise FileNotFoundError("lacking, and required in CI: " + why)
    return why


@unittest.skipIf(lacking(), lacking())
class RealCharacters(CliTest):
    def check(self, name, out, *more):
        done = subprocess.run([python_with_numpy(), os.path.join(CHARACTERS, "check_rig.py"), os.path.join(CHARACTERS, name), self.path(out), *more],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, "".join(line for line in done.stdout.splitlines(True) if not line.startswith("PASS")) + done.stderr)

    def test_from_clouds(self):
        source = os.path.join(CHARACTERS, "source_dance.glb")
        for name in ("mixa_t", "mixa_a"):
            call = ["retarget", "--source", source, "--target", os.path.join(CHARACTERS, name + ".glb"), "--weights", STANDARD]
            self.done(*call, "--out", name + ".glb")
            self.done(*call, "--out", "again.glb")
            self.assertEqual(self.bytes("again.glb"), self.bytes(name + ".glb"))
            truth = os.path.join(CHARACTERS, "truth_%s.npz" % name[-1])
            self.check(name + ".glb", name + ".glb", "--truth", truth, "--frames", "60", "--pa", ".02", "--mpjpe", ".03")
        self.check("mixa_t.glb", "mixa_t.glb", "--same", self.path("mixa_a.glb"))

    def test_vertices_are_those_that_the_document_shows(self):
        call = ["retarget", "--source", os.path.join(CHARACTERS, "source_dance.glb"), "--target", os.path.join(CHARACTERS, "mixa_a.glb"),
                "--weights", STANDARD]
        self.done(*call, "--out", "a.glb")
        self.done(*call, "--out", "frames/")
        frames = [self.vertices("frames/" + name) for name in sorted(os.listdir(self.path("frames")))]
        head = "{'descr': '<f4', 'fortran_order': False, 'shape': (%d, %d, 3), }" % (len(frames), len(frames[0]))
        head += " " * (-(len(head) + 11) % 64) + "\n"
        flat = [x for frame in frames for point in frame for x in point]
        self.write("posed.npy", b"\x93NUMPY\x01\0" + struct.pack("<H", len(head)) + head.encode() + struct.pack("<%df" % len(flat), *flat))
        self.check("mixa_a.glb", "a.glb", "--surface", self.path("posed.npy"))


class Characters(CliTest):
    """hero.glb: 22 bones in an A-pose, z up."""

    def setUp(self):
        super().setUp()
        self.vertex_count, _ = character(self.path("hero.glb"))

    def glb(self, name):
        content = self.bytes(name)
        return json.loads(content[20:20 + struct.unpack("<I", content[12:16])[0]])

    def test_names_endings_and_refusals(self):
        for i in range(4):
            self.ply("scans/f%d.ply" % i, points(120, i))
        call = ["retarget", "--weights", weights("tposes", *TPOSES), "--force", "--source", "scans", "--target", "hero.glb", "--out"]
        before = self.glb("hero.glb")
        self.done(*call, "named.glb", "--clip-name", "Dance 1")
        after = self.glb("named.glb")
        self.assertEqual([a["name"] for a in after["animations"][len(before.get("animations", [])):]], ["Dance 1"])
        for part in ("nodes", "meshes", "skins", "scenes"):
            self.assertEqual(after[part], before[part], part)
        self.done(*call, "alone.glb", "--animation-only")
        alone = self.glb("alone.glb")
        self.assertEqual((len(alone["animations"]), "meshes" in alone), (1, False))
        self.done(*call, "text.gltf")
        self.assertEqual(json.loads(self.bytes("text.gltf"))["nodes"], before["nodes"])
        self.bad_input(call + ["x.vrm"], "x.vrm", "no VRM character", ".glb")
        self.bad_input(call + ["x.h5", "--clip-name", "a"], "x.h5", "--clip-name")
        self.bad_input(call + ["folder/", "--animation-only"], "--animation-only")
        self.bad_input(call + ["hero.glb"], "hero.glb")
        self.h5("rest.h5", joints=([1, 22, 3], 0.5))
        self.bad_input(call + ["x.glb", "--rest", "rest.h5"], "hero.glb", "leave --rest out")
        self.ply("plain.ply", points(90, 7))
        plain = [word.replace("hero.glb", "plain.ply") for word in call]
        self.bad_input(plain + ["x.vrm"], "x.vrm", "no rig")
        self.bad_input(plain + ["x.gltf"], "x.gltf", "no rig")
        self.bad_input(plain + ["x.glb", "--animation-only"], "--animation-only")


if __name__ == "__main__":
    unittest.main()
