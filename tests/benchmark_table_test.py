#!/usr/bin/env python3
"""The rules of experiments/benchmark.py, on made-up results: nothing is trained here."""
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "experiments"))
import benchmark  # noqa: E402

RECIPE = """protocol: open-benchmark-1
train:
  bodies: [b000, b001]
  clips: ["01_01"]
test:
  bodies: [b140, b143, b146, b149, b152, b155, b158]
  clips: [%s]
characters: []
""" % ", ".join(f'"c{i:02d}"' for i in range(44))


def lite(seed, *values):
    return {"row": "lite", "seed": seed, "benchmark": "x",
            "sets": {"naked": [{"name": f"s{i}", "frames": 10, "mpjpe": v, "acc": None} for i, v in enumerate(values)]}}


class Pairs(unittest.TestCase):
    def test_every_clip_once_and_bodies_in_turn(self):
        pairs = list(benchmark.test_pairs(RECIPE))
        self.assertEqual([clip for clip, _, _ in pairs], [f"c{i:02d}" for i in range(44)])
        self.assertTrue(all(source != target for _, source, target in pairs))
        self.assertEqual(pairs[0][1:], ("b140", "b143"))
        self.assertEqual(pairs[7][1:], ("b140", "b146"))  # the second time round to the one after
        for which in (1, 2):
            counts = [sum(p[which] == b for p in pairs) for b in ("b140", "b143", "b146", "b149", "b152", "b155", "b158")]
            self.assertLessEqual(max(counts) - min(counts), 2, counts)
        self.assertEqual(len({p[1:] for p in pairs}), 42)  # all ordered pairs, two of them twice


class Table(unittest.TestCase):
    def test_mean_and_sample_deviation_over_runs(self):
        text = benchmark.table([lite(1, 0.01, 0.03), lite(2, 0.03, 0.05)])
        # Runs: 2 cm and 4 cm; mean 3, sample deviation sqrt(2).
        self.assertIn("| Restage lite, 2 seeds | 3.00 ± 1.41 | - |", text)
        self.assertIn("Restage lite: 2 of 2 sequences, 20 frames.", text)

    def test_one_run_has_no_deviation(self):
        self.assertIn("| Restage lite, 1 seed | 2.00 | - |", benchmark.table([lite(1, 0.01, 0.03)]))

    def test_failures_are_counted_and_named(self):
        one = lite(1, 0.01, 0.03)
        one["sets"]["naked"][1] = {"name": "s1", "failed": "the doctor cannot tell"}
        text = benchmark.table([one])
        self.assertIn("| Restage lite, 1 seed | 1.00 |", text)
        self.assertIn("1 of 2 sequences, 10 frames; failed: s1", text)

    def test_references_are_rows_of_their_own(self):
        entry = {"name": "s0", "frames": 10, **{r: {"mpjpe": 0.1 * (i + 1)} for i, r in enumerate(benchmark.REFERENCES)}}
        text = benchmark.table([{"row": "references", "benchmark": "x", "sets": {"clothed": [entry]}}])
        for words, value in (("rest pose", "10.00"), ("source skeleton unchanged", "20.00"), ("closed form", "30.00")):
            self.assertIn(f"| {words} | {value} |", text)
        self.assertTrue(text.startswith("**clothed**"))

    def test_different_benchmarks_do_not_mix(self):
        with self.assertRaises(ValueError):
            benchmark.table([lite(1, 0.01), {**lite(2, 0.01), "benchmark": "y"}])


if __name__ == "__main__":
    unittest.main()
