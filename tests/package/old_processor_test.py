"""old_processor_test.py PROGRAM: the program on a processor without AVX (x86-64-v2), which qemu-user emulates, on three scans of the
sample: joints turn as here, to a hundredth of a degree. Exit code 77: qemu-x86_64 is missing.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = str(pathlib.Path(sys.argv.pop(1)).resolve())
OLD = ["qemu-x86_64", "-cpu", "Nehalem"]
AVX2 = """#include <immintrin.h>
int main(int argc, char **argv) {
  (void)argv;
  return _mm256_extract_epi32(_mm256_add_epi32(_mm256_set1_epi32(argc), _mm256_set1_epi32(argc)), 0) == 2 * argc ? 0 : 1;
}
"""


class OldProcessorTest(unittest.TestCase):
    def setUp(self):
        made = tempfile.TemporaryDirectory()
        self.addCleanup(made.cleanup)
        self.folder = pathlib.Path(made.name)

    def run_here(self, *words):
        return subprocess.run([str(word) for word in words], cwd=self.folder, capture_output=True, text=True)

    def done(self, *words):
        result = self.run_here(*words)
        self.assertEqual(result.returncode, 0, f"{words}: {result.stderr}")
        return result.stdout

    def test_the_emulated_processor_has_no_avx2(self):
        (self.folder / "avx2.c").write_text(AVX2)
        self.done(os.environ.get("CC", "cc"), "-O1", "-mavx2", "avx2.c", "-o", "avx2")
        self.assertNotEqual(self.run_here(*OLD, "./avx2").returncode, 0)

    def test_it_retargets_the_same(self):
        (self.folder / "scans").mkdir()
        for scan in sorted((ROOT / "docs/sample/scans").iterdir())[:3]:
            shutil.copy(scan, self.folder / "scans")
        numbers = []
        for name, words in (("here", []), ("old", OLD)):
            self.done(*words, PROGRAM, "retarget", "--source", "scans", "--fps", 6, "--target", ROOT / "docs/sample/hero.glb",
                      "--threads", 1, "--quiet", "--out", f"{name}.bvh")
            motion = (self.folder / f"{name}.bvh").read_text().split("MOTION")[1]
            numbers.append([float(word) for word in re.findall(r"-?\d+\.\d+", motion)])
        self.assertGreater(len(numbers[0]), 500)
        self.assertEqual(len(numbers[0]), len(numbers[1]))
        self.assertLess(max(abs(here - old) for here, old in zip(*numbers)), 0.01)


if __name__ == "__main__":
    if not shutil.which(OLD[0]):
        print(f"{OLD[0]} is missing (apt-get install qemu-user)")
        sys.exit(77)
    unittest.main()
