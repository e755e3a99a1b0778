"""restage data."""
import os

from support import CliTest, numbers, small_disk


class Data(CliTest):
    def test_build_inspect_verify(self):
        for name, seed, threads in (("a.h5", 3, 1), ("b.h5", 3, 2), ("c.h5", 4, 3)):
            self.done("data", "build", "--bodies", 1, 0, 1, "--motions", 1, 1, 0, "--seed", seed, "--threads", threads, "--out", name)
        content = {name: self.bytes(name) for name in ("a.h5", "b.h5", "c.h5")}
        self.assertEqual(content["a.h5"], content["b.h5"], "same seed, same bits for any number of threads")
        self.assertNotEqual(content["a.h5"], content["c.h5"])
        found = self.json("data", "inspect", "a.h5")
        self.assertEqual(found["counts"]["bodies"], 2)
        self.assertEqual(found["counts"]["motions"], 2)
        self.assertEqual(found["units"], "metres")
        self.assertIn("license", found)
        self.assertEqual(found["splits"]["train"], {"bodies": 1, "motions": 1, "frames": found["splits"]["train"]["frames"]})
        self.assertAlmostEqual(found["seconds"], found["counts"]["frames"] / 30)
        self.assertTrue(1.4 < found["heights"]["least"] <= found["heights"]["most"] < 2.1, found["heights"])
        self.assertEqual(sum(found["actions"].values()), 2)
        text = self.done("data", "inspect", "a.h5", "--plot", "sheet.png")
        for words in ("kind        dataset", "heights", "validation", "sheet.png"):
            self.assertIn(words, text)
        self.assertEqual(self.bytes("sheet.png")[:8], b"\x89PNG\r\n\x1a\n")
        self.bad_input(["data", "inspect", "a.h5", "--plot", "sheet.jpg"], "sheet.jpg")
        self.assertEqual(self.json("data", "verify", "a.h5")["problems"], [])
        self.assertIn("bodies", self.done("doctor", "a.h5"))

    def test_verify_finds_damage(self):
        self.h5("bad.h5", joints=([2, 22, 3], numbers(131, 1) + ["inf"]))
        result = self.restage("data", "verify", "bad.h5")
        self.assertEqual((result.code, result.err), (1, ""))
        self.assertIn("bad.h5:/joints", result.out)

    def test_bad_input(self):
        self.bad_input(["data", "inspect", "none.h5"], "none.h5")
        self.bad_input(["data", "inspect", self.h5("else.h5", other=([3], [1.0]))], "else.h5")
        self.bad_input(["data", "inspect", self.h5("new.h5", {"restage_schema": 99}, joints=([1, 22, 3], [0.0]))], "version")
        self.bad_input(["data", "verify", self.write("text.h5", "text")], "text.h5")
        self.bad_input(["data", "build", "--out", "x.h5", "--bodies", 1, 2], "--bodies")
        self.bad_input(["data", "build", "--out", "x.h5", "--bodies", -1, 0, 0], "--bodies")
        self.bad_input(["data", "build", "--out", "nowhere/x.h5", "--bodies", 1, 0, 0], "nowhere")
        self.bad_input(["data", "import", "nothing", "--out", "x.h5"], "nothing")

    def test_full_disk(self):
        result = self.restage("data", "build", "--bodies", 1, 0, 0, "--motions", 0, 0, 0, "--quiet", "--out", "x.h5", before=small_disk)
        self.one_line(result, 1, "x.h5")
        self.assertEqual(os.listdir(self.folder), [])
