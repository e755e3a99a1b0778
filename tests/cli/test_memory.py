"""Long sequences take no more memory than short ones."""
import os
import subprocess
import unittest

from support import CliTest, PROGRAM

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

    def test_render(self):
        self.long_file("short.h5", 10, 20000)
        self.long_file("long.h5", 1400, 20000)
        self.stays(lambda name: ["render", name, "--columns", 3, "--out", "x.png"], "short.h5", "long.h5", 1390 * 20000 * 12)


if __name__ == "__main__":
    unittest.main()
