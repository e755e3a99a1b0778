"""Long sequences take no more memory than short ones."""
import os
import struct
import subprocess
import unittest

from support import CliTest, PROGRAM, ROOT, sphere
from tiny_run import TPOSES, weights

LITE = os.path.join(ROOT, "experiments", "weights", "lite.safetensors")
MIB = 1 << 20
ROOM = 128 * MIB  # that reading in pieces may take: pieces of 16 MiB and what HDF5 keeps of each data set


class Memory(CliTest):
    def peak(self, *arguments, codes=(0,)):
        """Peak of the program alone, in bytes."""
        with open(os.devnull, "wb") as nowhere:
            process = subprocess.Popen([PROGRAM, *map(str, arguments)], cwd=self.folder, stdout=nowhere, stderr=subprocess.PIPE)
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            said = process.stderr.read()
            process.stderr.close()
        self.assertIn(process.returncode, codes, said)
        return used.ru_maxrss << 10

    def long_file(self, name, frames, vertices):
        """As doubles its vertices take 24 bytes each."""
        return self.h5(name, vertices=([frames, vertices, 3], [0.5], "float32"))

    def stays(self, call, short, long, growth, codes=(0,)):
        """`growth`: of the vertices as doubles, from the short file to the long one."""
        more = self.peak(*call(long), codes=codes) - self.peak(*call(short), codes=codes)
        self.assertGreater(growth, 2 * ROOM, "the test would show nothing")
        self.assertLess(more, ROOM, call(long))

    def test_surfaces(self):
        self.long_file("short.h5", 10, 20000)
        self.long_file("long.h5", 700, 20000)
        growth = 690 * 20000 * 24
        self.stays(lambda name: ["data", "verify", name], "short.h5", "long.h5", growth)
        self.stays(lambda name: ["doctor", name, "--up", "y", "--scale", 1, "--fix", "out.h5"], "short.h5", "long.h5", growth, codes=(0, 1))

    def test_eval(self):
        # Few vertices, as the errors of edges take long.
        self.long_file("short.h5", 1000, 6)
        self.long_file("long.h5", 1000000, 6)
        self.stays(lambda name: ["eval", "--pred", name, "--truth", name], "short.h5", "long.h5", 2 * 999000 * 6 * 24)

    def test_scans(self):
        for name, points in (("short.h5", 1000), ("long.h5", 24000000)):
            self.h5(name, points=([points, 3], [0.5], "float32"), frame_offset=([2], [0, points], "int64"))
        self.stays(lambda name: ["data", "verify", name], "short.h5", "long.h5", 24000000 * 12)

    def test_adapt_keeps_what_it_looks_at(self):
        """Of a large cloud a few thousand points are kept, and no room for the others."""
        few, many, frames = 9000, 400000, 60
        for name, count in (("few", few), ("many", many)):
            shape = "(%d, %d, 3)" % (frames, count)
            header = ("{'descr': '<f4', 'fortran_order': False, 'shape': %s, }" % shape).ljust(117).encode() + b"\n"
            cloud = b"".join(struct.pack("<3f", *p) for p in sphere(3000)) * (count // 3000)
            with open(self.path(name + ".npy"), "wb") as f:
                f.write(b"\x93NUMPY\x01\x00\x76\x00" + header)
                for _ in range(frames):
                    f.write(cloud + cloud[:12 * count - len(cloud)])
        call = lambda name: ["adapt", "--source", name + ".npy", "--weights", LITE, "--steps", 1, "--samples", 1, "--force", "--out", "w.safetensors"]  # noqa: E731
        self.stays(call, "few", "many", frames * (many - few) * 12, codes=(0, 1, 2))

    def test_render(self):
        self.long_file("short.h5", 10, 20000)
        self.long_file("long.h5", 1400, 20000)
        self.stays(lambda name: ["render", name, "--columns", 3, "--out", "x.png"], "short.h5", "long.h5", 1390 * 20000 * 12)

    def test_gaps(self):
        """Frames of a gap are made one after the other, whatever makes them."""
        target = self.person()
        copies = 80000 // len(target) + 1
        self.ply("dense.ply", [(x + 1e-4 * k, y, z) for k in range(copies) for x, y, z in target])
        for name, missing in (("short", 2), ("long", 300)):
            for k in range(missing + 2):
                self.ply("%s/f%03d.ply" % (name, k), [] if 0 < k <= missing else target)
        for system in (["--weights", weights("tposes", *TPOSES)], ["--system", "register", "--rest", "walk/rest.h5"]):
            self.stays(lambda name: ["retarget", "--source", name, "--target", "dense.ply", *system, "--out", "r.glb", "--force"],
                       "short", "long", 298 * copies * len(target) * 12)


if __name__ == "__main__":
    unittest.main()
