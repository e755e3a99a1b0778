"""What the tests of the command line share: running the program, the contract of its errors, files."""
import atexit
import json
import math
import os
import random
import shutil
import signal
import struct
import subprocess
import tempfile
import unittest

# Checksums that the program keeps (datasets/readers/file_sums.h) stay out of the user's folder.
CACHE = tempfile.mkdtemp(prefix="restage-cache-")
atexit.register(shutil.rmtree, CACHE, ignore_errors=True)
os.environ["XDG_CACHE_HOME"] = CACHE

PROGRAM = os.environ["RESTAGE_PROGRAM"]
MAKE_H5 = os.environ["RESTAGE_MAKE_H5"]
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
DATA = os.path.join(os.environ.get("RESTAGE_SHARED", os.path.join(ROOT, "..", "shared")), "data")


class Result:
    def __init__(self, done):
        self.code, self.out, self.err = done.returncode, done.stdout, done.stderr


class CliTest(unittest.TestCase):
    """Every test runs in an empty folder of its own."""

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="restage-cli-")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def path(self, name):
        return os.path.join(self.folder, name)

    # ---- running ----

    def restage(self, *arguments, stdout=subprocess.PIPE, before=None, timeout=120):
        result = Result(subprocess.run([PROGRAM, *map(str, arguments)], cwd=self.folder, stdout=stdout, stderr=subprocess.PIPE,
                                       text=True, timeout=timeout, preexec_fn=before, errors="replace"))
        # The library writes {fps} for a setting; the program has to say how that is written on a command line.
        self.assertNotRegex(result.err + (result.out or ""), r"(?<!\w)\{[a-z][a-z-]*\}", arguments)
        return result

    def start(self, *arguments):
        """The command in the background, which ends with the test."""
        process = subprocess.Popen([PROGRAM, *arguments], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for clean in (process.stderr.close, process.stdout.close, process.wait, process.kill):
            self.addCleanup(clean)
        return process

    def done(self, *arguments):
        """The command succeeds; its standard output."""
        result = self.restage(*arguments)
        self.assertEqual(result.code, 0, result.err)
        return result.out

    def json(self, *arguments):
        """Standard output is exactly one JSON document."""
        return json.loads(self.done(*arguments, "--json"))

    def one_line(self, result, code, *contains):
        """The contract of errors: exit code, one line on standard error, no words on standard output."""
        self.assertEqual(result.code, code, result.err)
        # On a slow machine a command says before its error what it has been doing for so long.
        result.err = "".join(line for line in result.err.splitlines(True) if not line.startswith("still at work: "))
        self.assertTrue(result.err.startswith("restage: "), result.err)
        self.assertEqual(result.err.count("\n"), 1, result.err)
        self.assertTrue(result.err.endswith("\n"), result.err)
        self.assertLess(len(result.err.encode()), 400, result.err)
        self.assertIn("; ", result.err)
        for text in contains:
            self.assertIn(text, result.err)

    def bad_input(self, arguments, *contains):
        before = sorted(os.listdir(self.folder))
        result = self.restage(*arguments)
        self.one_line(result, 2, *contains)
        self.assertEqual(result.out, "")
        self.assertEqual(sorted(os.listdir(self.folder)), before, "bad input must not leave files")

    # ---- files ----

    def h5(self, name, attributes=None, **datasets):
        """h5("p.h5", joints=(shape, values)) or (shape, values, type); a single value fills the shape."""
        description = {"datasets": {}, "attributes": attributes or {}}
        for key, (shape, values, *kind) in datasets.items():
            description["datasets"]["/" + key] = {"shape": shape, "values": values, "type": kind[0] if kind else "float64"}
        made = subprocess.run([MAKE_H5, self.path(name)], input=json.dumps(description), text=True, capture_output=True)
        self.assertEqual(made.returncode, 0, made.stderr)
        return name

    def bytes(self, name):
        with open(self.path(name), "rb") as f:
            return f.read()

    def vertices(self, name):
        """Of a binary PLY file that the program wrote."""
        head, _, body = self.bytes(name).partition(b"end_header\n")
        return list(struct.iter_unpack("<3f", body[:12 * int(head.split(b"element vertex ")[1].split()[0])]))

    def person(self, frames=12):
        """Points of a built-in body in T-pose; walk/ holds scans of another that moves, and what else `perform` writes."""
        if not os.path.exists(self.path("walk")):
            self.done("data", "build", "--bodies", 1, 0, 1, "--motions", 1, 0, 0, "--quiet", "--out", "data.h5")
            self.done("data", "perform", "--bodies", "data.h5", "--frames", frames, "--quiet", "--out", "walk")
        return self.vertices("walk/target.ply")

    def write(self, name, content):
        os.makedirs(os.path.dirname(self.path(name)), exist_ok=True)
        with open(self.path(name), "wb" if isinstance(content, bytes) else "w") as f:
            f.write(content)
        return name

    def ply(self, name, points, faces=()):
        """Binary little-endian PLY."""
        head = "ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % len(points)
        head += "property float x\nproperty float y\nproperty float z\n"
        if faces:
            head += "element face %d\nproperty list uchar int vertex_indices\n" % len(faces)
        body = b"".join(struct.pack("<3f", *p) for p in points)
        body += b"".join(struct.pack("<B3i", 3, *f) for f in faces)
        return self.write(name, (head + "end_header\n").encode() + body)


def needs_data(name):
    """Decorator of a test that needs a file of the data folder; where RESTAGE_CI is set, it fails without."""
    missing = not os.path.exists(os.path.join(DATA, name))
    if missing and os.environ.get("RESTAGE_CI"):
        raise FileNotFoundError(f"lacking, and required in CI: {os.path.join(DATA, name)} (set RESTAGE_SHARED)")
    return unittest.skipIf(missing, "no data folder (set RESTAGE_SHARED)")


def numbers(count, seed, scale=1.0):
    r = random.Random(seed)
    return [r.gauss(0, scale) for _ in range(count)]


def points(count, seed):
    x = numbers(3 * count, seed)
    return [tuple(x[3 * i:3 * i + 3]) for i in range(count)]


def sphere(count=500, radius=0.5):
    """Points evenly on a sphere of a person's size."""
    out = []
    for i in range(count):
        z, turn = (2 * i + 1) / count - 1, 2.39996 * i
        r = radius * math.sqrt(1 - z * z)
        out.append((r * math.cos(turn), r * math.sin(turn), radius * z))
    return out


def small_disk(limit=4096):
    """For `before`: files may not grow beyond 4 kB, as if the disk were full."""
    import resource
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
