"""What the tests of the shared cases share: running a case's command, and comparing joints with the true ones."""
import array
import ast
import json
import math
import os
import shutil
import struct
import subprocess
import unittest
import zipfile

from support import CliTest, MAKE_H5, ROOT
from test_data import PARENTS

CASES = os.path.join(os.environ.get("RESTAGE_SHARED", os.path.join(ROOT, "..", "shared")), "cases")
WEIGHTS = os.path.join(ROOT, "experiments", "weights", "standard.safetensors")
TOLERANCE = 0.002  # metres


def read_npz(path, name):
    """Shape and values of a float array of an NPZ file."""
    data = zipfile.ZipFile(path).read(name + ".npy")
    size = struct.unpack("<H", data[8:10])[0]
    head = ast.literal_eval(data[10:10 + size].decode())
    if head["fortran_order"]:
        raise ValueError(path + ": Fortran order")
    values = array.array({"<f4": "f", "<f8": "d"}[head["descr"]])
    values.frombytes(data[10 + size:])
    return head["shape"], values.tolist()


def rows(values):
    return [values[i:i + 3] for i in range(0, len(values), 3)]


def distance_after_turn(found, truth):
    """The largest distance in metres of any joint after the best turn about y and shift of all frames as a whole.
    Lists of points; points that are NaN in the truth are free."""
    pairs = [(a, b) for a, b in zip(found, truth) if not any(map(math.isnan, b))]
    mean = [[sum(p[k][c] for p in pairs) / len(pairs) for c in range(3)] for k in (0, 1)]
    a = [[p[0][c] - mean[0][c] for c in range(3)] for p in pairs]
    b = [[p[1][c] - mean[1][c] for c in range(3)] for p in pairs]
    sine = sum(p[2] * q[0] - p[0] * q[2] for p, q in zip(a, b))
    cosine = sum(p[0] * q[0] + p[2] * q[2] for p, q in zip(a, b))
    angle = math.atan2(sine, cosine)
    s, c = math.sin(angle), math.cos(angle)
    return max(math.dist((c * p[0] + s * p[2], p[1], c * p[2] - s * p[0]), q) for p, q in zip(a, b))


def turned(q, v):
    """v turned by the unit quaternion q (w, x, y, z)."""
    w, u = q[0], q[1:]
    cross = lambda a, b: [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    t = [2 * x for x in cross(u, v)]
    return [a + w * b + c for a, b, c in zip(v, t, cross(u, t))]


def posed(rest, rotations, hips):
    """World positions of the joints from world rotations and the midpoint of both hips (datasets/README.md, Motions)."""
    out = [[0.0] * 3]
    for j in range(1, 22):
        p = PARENTS[j]
        step = turned(rotations[p], [a - b for a, b in zip(rest[j], rest[p])])
        out.append([a + b for a, b in zip(out[p], step)])
    middle = [(a + b) / 2 for a, b in zip(out[1], out[2])]
    return [[x - m + h for x, m, h in zip(joint, middle, hips)] for joint in out]


MISSING = not os.path.isdir(CASES)
if MISSING and os.environ.get("RESTAGE_CI"):
    raise FileNotFoundError("lacking, and required in CI: %s (set RESTAGE_SHARED)" % CASES)


@unittest.skipIf(MISSING, "no shared cases (set RESTAGE_SHARED)")
class CaseTest(CliTest):
    """A test in a copy of a case's folder."""

    def enter(self, case):
        for entry in os.listdir(os.path.join(CASES, case)):
            source = os.path.join(CASES, case, entry)
            (shutil.copytree if os.path.isdir(source) else shutil.copy)(source, self.path(entry))

    def motion(self, file):
        """The only motion of a file of `data import`: 22 points for every frame, in the world."""
        read = subprocess.run([MAKE_H5, "--read", self.path(file)], capture_output=True, text=True)
        self.assertEqual(read.returncode, 0, read.stderr)
        sets = {name.split("/")[-1]: value["values"] for name, value in json.loads(read.stdout).items()
                if name.startswith("/motions/")}
        rest, hips = rows(sets["rest"]), rows(sets["hips"])
        quaternions = [sets["rotations"][i:i + 4] for i in range(0, len(sets["rotations"]), 4)]
        return [posed(rest, quaternions[22 * f:22 * f + 22], hip) for f, hip in enumerate(hips)]

    def expect_true(self, arguments, frames=None):
        """`restage ARGUMENTS` writes out.h5, whose joints are those of truth.npz."""
        self.done(*arguments)
        shape, values = read_npz(self.path("truth.npz"), "joints")
        found = [joint for frame in self.motion("out.h5") for joint in frame]
        self.assertEqual(len(found), shape[0] * shape[1], "frames")
        if frames is not None:
            self.assertEqual(shape[0], frames)
        self.assertLess(distance_after_turn(found, rows(values)), TOLERANCE)
