"""--max-memory holds for HDF5 too: what has to be in memory at once is refused beyond it, what can be streamed is not."""
from support import CliTest, points
from tiny_run import weights


class MaxMemory(CliTest):
    def test_a_large_frame(self):
        self.h5("big.h5", vertices=([1, 300000, 3], [0.5], "float32"))
        self.ply("hero.ply", points(90, 7))
        retarget = ["retarget", "--target", "hero.ply", "--weights", weights("tiny"), "--force", "--out", "out.h5", "--source"]
        for command in (["eval", "--pred", "big.h5", "--truth", "big.h5"], ["data", "verify", "big.h5"],
                        ["render", "big.h5", "--out", "x.png"], [*retarget, "big.h5"]):
            result = self.restage(*command, "--max-memory", "2MB")
            self.assertNotEqual(result.code, 0, command)
            self.assertIn("--max-memory", result.err + result.out, command)
        self.done("data", "verify", "big.h5", "--max-memory", "20MB")

    def test_many_small_frames(self):
        cloud = [x for p in points(1000, 1) for x in p]
        self.h5("long.h5", vertices=([300, 1000, 3], cloud * 300, "float32"))  # 3.6 MB
        self.ply("hero.ply", points(90, 7))
        found = self.json("retarget", "--source", "long.h5", "--target", "hero.ply", "--weights", weights("tiny"), "--force", "--out", "out.h5",
                          "--every", 100, "--max-memory", "2MB")
        self.assertEqual(found["frames"], 3)
