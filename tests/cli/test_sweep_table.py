"""restage sweep table, sweep export and compare on made-up trials."""
import csv
import io
import json
import os
import statistics
import xml.dom.minidom

from support import CliTest


class Tables(CliTest):
    def setUp(self):
        super().setUp()
        self.trials = []
        for a in (0, 0.1):
            for seed in (1, 2, 3):
                self.put(f"{len(self.trials) + 1:012x}", seed, a)
        self.write("s/plan.json", json.dumps({"trials": self.trials}))

    def put(self, name, seed, a, **changes):
        trial = {"id": name, "case": "", "seed": seed, "overrides": {"motion.weights.smoothness": a}, "artifacts": {"motion": "0" * 12}}
        values = [0.1 + a + 0.01 * seed + 0.001 * s * seed for s in range(5)]
        sequences = [{"name": f"clip{s}", "frames": 60, "mpjpe": v, "mpvd": None} for s, v in enumerate(values)]
        result = {**trial, "state": "done", "error": None, "seconds": 1.0,
                  "metrics": {"naked": {"mean": {"mpjpe": statistics.mean(values), "mpvd": None}, "sequences": sequences}}}
        self.write(f"s/trials/{name}/result.json", json.dumps({**result, **changes}))
        self.write(f"s/trials/{name}/config.yaml", f"name: x\nseed: {seed}\nmotion: {{weights: {{smoothness: {a}}}, batch: 4}}\n")
        self.trials.append(trial)

    def test_json(self):
        table = self.json("sweep", "table", "s", "--against", "motion.weights.smoothness=0")
        self.assertEqual(table["against"], "motion.weights.smoothness=0")
        self.assertEqual(table["trials"], {"done": 6, "failed": 0, "stopped": 0, "pending": 0, "damaged": 0})
        row = table["rows"][1]
        self.assertEqual((row["seeds"], row["n"], row["overrides"]), ([1, 2, 3], 3, {"motion.weights.smoothness": 0.1}))
        cell = row["metrics"]["naked"]["mpjpe"]
        means = [0.2 + 0.012 * seed for seed in (1, 2, 3)]
        self.assertAlmostEqual(cell["mean"], statistics.mean(means), 12)
        self.assertAlmostEqual(cell["deviation"], statistics.stdev(means), 12)
        self.assertTrue(cell["low"] < min(means) < cell["mean"] < max(means) < cell["high"], "three seeds are few")
        self.assertAlmostEqual(cell["difference"]["low"], 0.1, 9)
        self.assertIsNone(row["metrics"]["naked"]["mpvd"]["mean"])
        again = self.json("sweep", "table", "s", "--threads", 1, "--against", "motion.weights.smoothness=0")
        self.assertEqual(again, table)

    def test_files(self):
        for ending in ("md", "csv", "tex", "svg"):
            self.done("sweep", "table", "s", "--columns", "mpjpe,mpvd", "--out", "t." + ending)
        rows = list(csv.DictReader(io.StringIO(self.bytes("t.csv").decode())))
        self.assertEqual([(r["metric"], r["n"]) for r in rows], [("mpjpe", "3"), ("mpvd", "0")] * 2)
        cell = self.json("sweep", "table", "s")["rows"][0]["metrics"]["naked"]["mpjpe"]
        self.assertEqual(float(rows[0]["low"]), cell["low"])
        self.assertIn(b"\\toprule", self.bytes("t.tex"))
        self.assertEqual(xml.dom.minidom.parseString(self.bytes("t.svg")).documentElement.tagName, "svg")
        self.assertIn("naked", self.bytes("t.md").decode())

    def test_damage_is_told_in_one_line(self):
        self.write("s/trials/000000000001/result.json", '{"id": "0000')
        self.put("000000000002", 2, 0, state="failed", error="restage: out of memory")
        result = self.restage("sweep", "table", "s", "--json")
        self.assertEqual(result.code, 0, result.err)
        self.assertEqual(sum("000000000001/result.json" in line for line in result.err.splitlines()), 1, result.err)
        table = json.loads(result.out)
        self.assertEqual((table["trials"]["failed"], table["trials"]["damaged"], table["rows"][0]["n"]), (1, 1, 1))
        self.assertIsNone(table["rows"][0]["metrics"]["naked"]["mpjpe"]["deviation"])
        self.bad_input(["sweep", "table", "s", "--out", "nowhere/t.csv"], "nowhere/t.csv")

    def test_two_trials_give_an_interval_with_a_warning(self):
        told = [n for n in self.json("sweep", "table", "s")["notices"] if "n = 2" in n]
        self.assertEqual(told, [])
        self.write("s/plan.json", json.dumps({"trials": [t for t in self.trials if (t["seed"], t["overrides"]["motion.weights.smoothness"]) != (3, 0)]}))
        result = self.restage("sweep", "table", "s", "--out", "t.md")
        said = [line for line in result.err.splitlines() if "n = 2" in line]
        self.assertEqual(len(said), 1, result.err)
        self.assertIn("two trials stand behind 'motion.weights.smoothness=0'", said[0])
        self.assertEqual(self.bytes("t.md").decode().count("n = 2"), 1)

    def test_bad_input(self):
        self.bad_input(["sweep", "table", "nowhere"], "nowhere", "trials")
        self.bad_input(["sweep", "table", "s", "--out", "t.pdf"], "t.pdf", ".svg")
        self.bad_input(["sweep", "table", "s", "--rows", "motion.weights.smothness"], "motion.weights.smoothness")
        self.bad_input(["sweep", "table", "s", "--columns", "mpjep"], "mpjpe")
        self.bad_input(["sweep", "table", "s", "--against", "motion"], "2 rows", "'motion.weights.smoothness=0.1'")
        self.bad_input(["sweep", "export", "s", "--engine", "slurmm", "--out", "x"], "slurm")
        self.bad_input(["sweep", "export", "s/trials", "--engine", "slurm", "--out", "x"], "sweep plan")
        self.write("s/plan.json", '{"trials": [{"id": "../../x"}]}')
        self.bad_input(["sweep", "export", "s", "--engine", "parallel", "--out", "x"], "plan.json", "12 hex digits")

    def test_compare(self):
        one, two = "s/trials/000000000001", "s/trials/000000000004"
        for place, last in ((one, 0.5), (two, 0.25)):
            lines = [{"step": s, "stage": "motion", "loss": last + 1 / s} for s in (1, 2, 4)]
            self.write(place + "/metrics.jsonl", "\n".join(map(json.dumps, lines)) + '\n{"step": 5, "sta')
        seen = self.json("compare", one, two, "--out", "c.svg")
        self.assertEqual(seen["differs"], {"motion.weights.smoothness": ["0", "0.1"]})
        self.assertAlmostEqual(seen["runs"][1]["metrics"]["motion.loss"], 0.5)
        self.assertAlmostEqual(seen["runs"][0]["metrics"]["naked: mpjpe"], 0.112)
        picture = xml.dom.minidom.parseString(self.bytes("c.svg"))
        self.assertEqual(len(picture.getElementsByTagName("polyline")), 2)
        self.done("compare", one, two, "--out", "curves/")
        self.assertEqual(self.bytes("curves/curves.svg"), self.bytes("c.svg"))
        self.assertIn("the same", self.done("compare", one, one))
        os.remove(self.path(one + "/metrics.jsonl"))  # a trial's curves are those of its artifacts
        self.write("s/plan.json", json.dumps({"trials": [], "directory": "..", "store": "runs/store"}))
        self.write("runs/store/motion-000000000000/metrics.jsonl", '{"step": 3, "stage": "motion", "loss": 7}\n')
        self.assertEqual(self.json("compare", one, two)["runs"][0]["metrics"]["motion.loss"], 7)
        self.bad_input(["compare", "s"], "neither a run nor a trial")
        self.bad_input(["compare", one, "--out", "c.png"], ".svg")


if __name__ == "__main__":
    import unittest
    unittest.main()
