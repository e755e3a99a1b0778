#!/usr/bin/env python3
"""The rules of bench/measure.py, on made-up times: nothing is timed here."""
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "bench"))
import measure  # noqa: E402
import report  # noqa: E402


def times(*values, **more):
    return {"all": list(values), "ms": sorted(values)[len(values) // 2], "min": min(values), "max": max(values),
            "rounds": len(values), "peak_mib": 10.0, **more}


ITEM = {"name": "skeleton_train", "what": "x", "per": "cloud", "examples": 4, "gflop": 1.0,
        "ours": {"initial": times(10, 20, 10),
                 "trained": times(20, 40, 20, active=0.25, active_scores=0.5, done_gflop=0.6), "dense": times(80, 80, 80)},
        "libtorch": {"installed, 1T": times(200), "installed, 2T": times(60, 80, 50),
                     "tuned, 1T": times(90), "tuned, 2T": times(40, 60, 30)}}


class Process:
    """Answers at once with the number of the request."""

    def __init__(self):
        self.asked = 0

    def seconds(self):
        return 0.0

    def ask(self, request):
        self.asked += 1
        return {"ms": [self.asked]}


class Ratios(unittest.TestCase):
    def test_pairs_of_one_round(self):
        r = measure.ratios(ITEM)
        self.assertEqual(r["initial"], {"installed": 5.0, "tuned": 3.0, "best": 3.0})
        self.assertEqual(r["trained"]["best"], 1.5)

    def test_slower_weights_count_and_other_variants_do_not(self):
        item = {**ITEM, "ratios": measure.ratios(ITEM)}
        self.assertEqual(measure.least(item, "best"), 1.5)
        self.assertEqual(measure.least(item, "installed"), 2.5)
        self.assertLess(item["ratios"]["dense"]["best"], 1.5)

    def test_without_libtorch_there_are_none(self):
        alone = {**ITEM, "libtorch": {}}
        self.assertEqual(measure.ratios(alone), {})
        self.assertIsNone(measure.least({**alone, "ratios": {}}, "best"))


class Answers(unittest.TestCase):
    def agreement(self, theirs):
        class Side:
            def __init__(self, values):
                self.values = values

            def ask(self, request):
                return {"values": self.values}

            def close(self):
                pass

        class Programs:
            def start(self, side):
                return Side([1672.0, 0.5]) if side == "initial" else Side(theirs)

        return measure.agreement(Programs(), [{"name": "frame_online", "variants": ["initial"]}])

    def test_small_differences_are_told(self):
        found = self.agreement([1672.1, 0.5])
        self.assertAlmostEqual(found["frame_online"], 0.1 / 1672.1)
        self.assertIn("| frame_online | 6.0e-05 |", report.agreement(found))

    def test_other_answers_end_it(self):
        for theirs in ([1782.0, 0.5], [1672.0]):
            with self.assertRaises(SystemExit) as end:
                self.agreement(theirs)
            self.assertIn("they do not do the same work", str(end.exception))


class Reading(unittest.TestCase):
    ITEM = {"name": "reading_skeleton_lite", "what": "x", "per": "cloud", "examples": 12, "gflop": 0, "libtorch": {},
            "ours": {"training": times(11, 6, 30, processor=[22, 12, 60]), "loader": times(1, 2, 3, processor=[2, 4, 2]),
                     "loader_1fps": times(4, 4, 4)}}

    def test_pairs_of_one_round(self):
        r = measure.reading(self.ITEM)
        self.assertEqual(r["ratio"], 9.0)  # the median of 10, 2 and 9: what the step takes without reading
        self.assertEqual(r["processor_ratio"], 10.0)
        self.assertAlmostEqual(r["share"], 0.1)
        self.assertEqual((r["training_per_s"], r["loader_per_s"], r["loader_1fps_per_s"]), (1000 / 11, 500.0, 250.0))

    def test_table(self):
        found = {**measure.reading(self.ITEM), "memory": {"examples": [5000, 65000], "heap": [7.0, 7.04]}}
        text = report.reading({"items": [ITEM, self.ITEM], "reading": {self.ITEM["name"]: found}})
        self.assertIn("| reading_skeleton_lite | cloud | 90.9 | 500 | 250 | **9.0** | 10.0 | 10.0 % | 7.0 -> 7.0 |", text)
        self.assertNotIn("skeleton_train", text)
        self.assertEqual(report.reading({"items": [ITEM], "reading": {}}), "")


class DisturbedRequests(unittest.TestCase):
    def ask(self, foreign, patience):
        """Requests of which number i finds others using foreign[i] seconds."""
        process, clock = Process(), [0.0]
        busy = [0.0]
        original = measure.busy_seconds, measure.time.monotonic

        def monotonic():
            clock[0] += 0.5
            return clock[0]

        def busy_seconds():
            if process.asked > len(busy) - 1:
                busy.append(busy[-1] + foreign[process.asked - 1])
            return busy[-1]

        measure.busy_seconds, measure.time.monotonic = busy_seconds, monotonic
        try:
            quiet = measure.Quiet(patience)
            answer, load, _ = quiet.ask(process, "run")
        finally:
            measure.busy_seconds, measure.time.monotonic = original
        return answer["ms"][0], load, quiet.disturbed

    def test_repeats_until_undisturbed(self):
        self.assertEqual(self.ask([1.0, 1.0, 0.0], patience=5)[::2], (3, 0))

    def test_gives_up_with_the_least_disturbed(self):
        self.assertEqual(self.ask([0.5, 0.2, 0.9], patience=2)[::2], (2, 1))


class Report(unittest.TestCase):
    def test_tables(self):
        item = {**ITEM, "ratios": measure.ratios(ITEM)}
        text = report.markdown({
            "items": [item], "reading": {}, "machine": measure.machine(), "limited_to": "avx2", "quick": True, "agreement": {"skeleton_train": 1e-6},
            "disturbed": {"requests": 9, "above_limit": 1, "limit_cores": 0.05, "worst_cores": 0.5},
            "memory": {"skeleton_train": {"ours": 10.0, "libtorch_tuned": 40.0}}})
        self.assertIn("Not a result", text)
        self.assertIn("Disturbed", text)
        self.assertIn("| 0.250, 0.500 | 15 % |", text)
        self.assertIn("| skeleton_train | initial | 10 (10-20) | 200 (200-200) | 60 (50-80) |", text)


if __name__ == "__main__":
    unittest.main()
