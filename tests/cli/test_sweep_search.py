"""Sweeps that search: random values, Latin hypercubes, and TPE by ask and tell."""
import json
import os

from support import CliTest
from tiny_run import CONFIG

# About half a second a trial: skinning weights alone.
BASE = CONFIG.replace("motions: {train: 4, validation: 2, test: 1}", "motions: {train: 4, validation: 2, test: 2}").replace(
    "bodies: {train: 2, validation: 2, test: 1}", "bodies: {train: 2, validation: 2, test: 2}") + "evaluation: {sequences: 1, frames: 5}\n"
SPACE = """  space:
    deformation.optimiser.schedule.rate: {log_uniform: [1e-5, 1e-1]}
    deformation.optimiser:
      batch: {integer: [1, 3]}
    deformation.pairs.points: {choice: [16, 32]}
"""
SET = "base: configs/tiny.yaml\nset: {stages: [deformation], deformation.optimiser.steps: 4}\n"
TPE = SET + "search:\n  kind: tpe\n  trials: 5\n  startup: 3\n  metric: deformation.skinning_mm\n" + SPACE
RATE, BATCH, POINTS = "deformation.optimiser.schedule.rate", "deformation.optimiser.batch", "deformation.pairs.points"


class Search(CliTest):
    def setUp(self):
        super().setUp()
        self.write("configs/tiny.yaml", BASE)

    def plan(self, *words):
        return self.json("sweep", "plan", "s.yaml", *words)["trials"]

    def values(self, trials):
        return [tuple(t["overrides"][key] for key in (RATE, BATCH, POINTS)) for t in trials]

    def result(self, trial):
        return json.loads(self.bytes("d/trials/%s/result.json" % trial))


class Designs(Search):
    def test_random_and_latin(self):
        for kind in ("random", "latin"):
            self.write("s.yaml", SET + "search:\n  kind: %s\n  trials: 8\n" % kind + SPACE + "seeds: [1, 2]\n")
            trials = self.plan()
            self.assertEqual(len(trials), 16)
            values = self.values(trials)
            self.assertEqual(len(set(values)), 8)
            for rate, batch, points in values:
                self.assertTrue(1e-5 <= rate <= 1e-1 and batch in (1, 2, 3) and points in (16, 32))
            self.assertEqual(self.values(self.plan()), values)
            self.assertNotEqual(self.values(self.plan("search.seed=1")), values)
            more = self.values(self.plan("search.trials=12"))
            self.assertEqual(more[:16] == values, kind == "random")
        decades = sorted(int(2 * (5 + __import__("math").log10(v[0]))) for v in self.values(self.plan("search.kind=latin"))[::2])
        self.assertEqual(decades, list(range(8)))
        self.assertEqual({t["overrides"].get(BATCH) for t in self.plan(BATCH + "=2")}, {None})
        self.done("sweep", "plan", "s.yaml", "--out", "d")
        self.assertEqual([t["id"] for t in self.json("sweep", "plan", "d/sweep.yaml")["trials"]], [t["id"] for t in self.plan()])

    def test_ranges_on_the_command_line(self):
        self.write("s.yaml", SET + "grid: {%s: [16, 32]}\n" % POINTS)
        trials = self.plan(RATE + "=log_uniform(1e-5,1e-1)", BATCH + "=integer(1, 3)", "search.trials=4", "search.kind=latin")
        self.assertEqual(len(trials), 8)
        self.assertEqual([points for _, _, points in self.values(trials)], [16] * 4 + [32] * 4)
        self.assertEqual(len({rate for rate, _, _ in self.values(trials)}), 4)
        trials = self.plan(POINTS + "=integer(10,40)")
        self.write("t.yaml", SET)
        asked = self.json("sweep", "plan", "t.yaml", BATCH + "=integer(1,9)", "search.startup=4", "search.metric=deformation.skinning_mm",
                          "search.kind=tpe")
        self.assertEqual(len(asked["trials"]), 4)
        self.assertEqual((len(trials), len({t["overrides"][POINTS] for t in trials})), (20, 20))
        for word, *contains in ((BATCH + "=integer(1,3)", "only 3 points"), (BATCH + "=integer(1)", "two ends"), (BATCH + "=integer(1,x)", "'x'"),
                                ("a b=uniform(0,1)", "no key"), (RATE + "=log_uniform(0,1)", "above 0")):
            self.bad_input(["sweep", "plan", "s.yaml", word], *contains)

    def test_bad_input(self):
        search = SET + "search: {kind: random, trials: 4, space: {%s}}\n"
        for text, line, *contains in (
                (SET + "search: {kind: rando, space: {a.b: {uniform: [0, 1]}}}\n", 3, "random"),
                (SET + "search: {kinds: random, space: {a.b: {uniform: [0, 1]}}}\n", 3, "did you mean 'kind'"),
                (SET + "search: {kind: random}\n", 3, "'space'"),
                (SET + "search: [1]\n", 3, "section"),
                (search % "a.b: {unform: [0, 1]}", 3, "did you mean 'uniform'"),
                (search % "a.b: [0, 1]", 3, "no range", "log_uniform"),
                (search % "a.b: {uniform: [1, 0]}", 3, "high to low"),
                (search % "a.b: {uniform: [1, 2, 3]}", 3, "lowest and the highest"),
                (search % "a.b: {integer: [0.5, 3]}", 3, "whole number"),
                (search % "a.b: {log_uniform: [0, 3]}", 3, "above 0"),
                (search % "a.b: {choice: [1, 1.0]}", 3, "twice"),
                (search % (BATCH + ": {integer: [1, 3]}"), 3, "only 3 points"),
                (search % "deformation.optimiser.batsh: {integer: [1, 30]}", 3, "'batch'"),
                (search % "stages: {choice: [[motion], [deformation]]}" + "grid: {a: [1]}\n", 3, "'set'"),
                (search % (BATCH + ": {integer: [1, 9]}") + "grid: {%s: [1, 2]}\n" % BATCH, 3, "'grid'"),
                (search % "seed: {integer: [1, 9]}", 3, "seeds"),
                (SET + "search: {kind: tpe, space: {%s: {integer: [1, 9]}}}\n" % BATCH, 3, "'metric'"),
                (TPE.replace("skinning_mm", "skining_mm"), 7, "did you mean 'deformation.skinning_mm'"),
                (TPE + "seeds: [1, 2]\n", 3, "one seed"),
                (TPE + "grid: {%s: [1, 2]}\n" % "deformation.optimiser.steps", 3, "steps"),
        ):
            with self.subTest(text):
                self.write("bad.yaml", text)
                self.bad_input(["sweep", "plan", "bad.yaml"], "bad.yaml:", *contains)
        self.write("s.yaml", TPE)
        self.bad_input(["sweep", "plan", "s.yaml", "search.trials=many"], "search.trials")
        self.bad_input(["sweep", "plan", "s.yaml", "search.trial=5"], "did you mean 'trials'")
        self.write("grid.yaml", SET + "grid: {%s: [1, 2]}\n" % BATCH)
        self.bad_input(["sweep", "plan", "grid.yaml", "search.trials=5"], "has none")
        self.done("sweep", "plan", "grid.yaml", "--out", "grid")
        self.bad_input(["sweep", "ask", "grid"], "asks for no trials")


class Tpe(Search):
    def setUp(self):
        super().setUp()
        self.write("s.yaml", TPE)

    def ask(self, *words):
        return self.json("sweep", "ask", "d", *words)["trial"]

    def test_run_asks_until_there_are_enough(self):
        said = self.restage("sweep", "plan", "s.yaml", "--out", "d")
        self.assertIn("first of 5 trials", said.out)
        self.assertEqual(self.json("sweep", "status", "d")["trials"], [], "each is written when it is asked for")
        self.assertEqual(self.done("sweep", "run", "s.yaml", "--out", "d", "--jobs", "2"), "5 done\n")
        trials = self.json("sweep", "status", "d")["trials"]
        self.assertEqual(len({v for v in self.values(trials)}), 5)
        self.assertEqual(self.values(trials)[:3], self.values(self.plan()), "a Latin hypercube first")
        # Again, and with more trials: it goes on.
        self.assertEqual(self.done("sweep", "run", "s.yaml", "--out", "d"), "5 done\n")
        self.assertEqual(self.done("sweep", "run", "s.yaml", "--out", "d", "search.trials=6"), "6 done\n")
        self.assertEqual([t["id"] for t in self.json("sweep", "status", "d")["trials"]][:5], [t["id"] for t in trials])
        self.bad_input(["sweep", "export", "d", "--engine", "parallel", "--out", "x"], "one by one")
        self.write("s.yaml", TPE.replace("    deformation.pairs.points: {choice: [16, 32]}\n", "    deformation.pairs.points: {choice: [8]}\n"))
        self.bad_input(["sweep", "run", "s.yaml", "--out", "d"], "no value of '%s'" % POINTS)

    def test_driven_by_hand_it_is_deterministic(self):
        asked = {}
        for folder in ("d", "e"):
            self.done("sweep", "plan", "s.yaml", "--out", folder)
            asked[folder] = []
            for _ in range(6):  # more than `trials`, which are those of sweep run
                trial = self.json("sweep", "ask", folder)["trial"]
                asked[folder].append(trial)
                value = abs(trial["overrides"][RATE] - 0.003) + trial["overrides"][BATCH]
                self.done("sweep", "tell", folder, trial["id"], "--value", value)
        self.assertEqual(asked["d"], asked["e"])
        self.assertTrue(os.path.exists(self.path("d/trials/%s/config.yaml" % asked["d"][0]["id"])))
        self.assertEqual(self.json("sweep", "status", "d")["counts"]["done"], 6)

    def test_what_is_told_counts(self):
        self.done("sweep", "plan", "s.yaml", "--out", "d")
        first, second = self.ask(), self.ask("%s=0.05" % RATE, BATCH + "=2")
        self.assertEqual((second["overrides"][RATE], second["overrides"][BATCH]), (0.05, 2))
        self.bad_input(["sweep", "ask", "d", "%s=0.05" % RATE, BATCH + "=2", "%s=%d" % (POINTS, second["overrides"][POINTS])], second["id"])
        self.bad_input(["sweep", "ask", "d", "%s=5" % RATE], "outside", "0.1")
        self.bad_input(["sweep", "ask", "d", "%s=5" % POINTS], "its values are 16, 32")
        self.bad_input(["sweep", "ask", "d", "motion.x=5"], "no key that is searched")
        self.done("sweep", "tell", "d", first["id"], "--failed")
        status = self.json("sweep", "status", "d")
        self.assertEqual([t["state"] for t in status["trials"]], ["failed", "pending"])
        self.done("trial", "d", second["id"])
        measured = self.result(second["id"])
        self.done("sweep", "tell", "d", second["id"], "--value", "7")
        self.assertEqual(self.result(second["id"]), {**measured, "told": 7})
        self.assertIsNone(self.json("sweep", "ask", "d", "--up-to", "2")["trial"])
        self.bad_input(["sweep", "tell", "d", "0123456789ab", "--value", "1"], "no trial")
        self.bad_input(["sweep", "tell", "d", first["id"]], "nothing is told")
        self.bad_input(["sweep", "tell", "d", first["id"], "--value", "nan"], "--failed")
        # What was told to have failed is tried by the next run, as every failed trial.
        self.assertEqual(self.done("sweep", "run", "s.yaml", "--out", "d", "search.trials=3"), "3 done\n")

    def test_a_running_trial_is_not_told(self):
        self.done("sweep", "plan", "s.yaml", "--out", "d", "deformation.optimiser.steps=1000000")
        trial = self.ask()["id"]
        process = self.start("trial", "d", trial)
        while self.json("sweep", "status", "d")["counts"]["running"] == 0:
            self.assertIsNone(process.poll())
        self.one_line(self.restage("sweep", "tell", "d", trial, "--value", "1"), 1, str(process.pid))
        process.kill()
        process.wait()


if __name__ == "__main__":
    import unittest
    unittest.main()
