"""restage sweep plan, run, status, stop and restage trial (the contract of experiments)."""
import glob
import json
import os
import shutil
import signal
import subprocess
import time

from support import PROGRAM, CliTest
from tiny_run import CONFIG, weights

# About a second a trial, half of which is evaluation.
BASE = CONFIG.replace("motions: {train: 4, validation: 2, test: 1}", "motions: {train: 4, validation: 2, test: 2}").replace(
    "bodies: {train: 2, validation: 2, test: 1}", "bodies: {train: 2, validation: 2, test: 2}") + "evaluation: {sequences: 1, frames: 5}\n"
SWEEP = """name: smoothness
base: configs/tiny.yaml
set: {deformation.optimiser.steps: 4}
grid:
  motion.weights.smoothness: [0, 0.1]
zip:
  - {motion.windows.frames: [5, 8], motion.optimiser.batch: [4, 2]}
cases:
  quaternion: {motion.model: smrm/quaternion}
  6D: {motion.model: smrm/rot6d}
exclude:
  - {motion.windows.frames: 5, motion.weights.smoothness: 0.0}
seeds: [1, 2]
"""
SHORT = "base: configs/tiny.yaml\ngrid:\n  motion.optimiser.steps: [2, 3]\n"


class Sweep(CliTest):
    def setUp(self):
        super().setUp()
        self.write("configs/tiny.yaml", BASE)
        self.write("sweep.yaml", SHORT)

    def plan(self, *arguments):
        return self.json("sweep", "plan", "sweep.yaml", *arguments)

    def result(self, trial, folder="d"):
        return json.loads(self.bytes("%s/trials/%s/result.json" % (folder, trial)))

    def wait_for(self, condition, seconds=60):
        end = time.monotonic() + seconds
        while not condition():
            self.assertLess(time.monotonic(), end, "waited too long")
            time.sleep(0.02)

    def sweeper(self, *arguments):
        """A sweep in the background, of which a trial runs."""
        process = self.start("sweep", "run", "sweep.yaml", "--out", "d", *arguments)
        self.wait_for(lambda: os.path.exists(self.path("d/plan.json")) and self.running())
        return process

    def running(self, folder="d"):
        return [t["id"] for t in self.json("sweep", "status", folder)["trials"] if t["state"] == "running"]


class Plans(Sweep):
    def test_all_parts_of_a_sweep_file(self):
        self.write("sweep.yaml", SWEEP)
        before = sorted(os.listdir(self.folder))
        plan = self.plan()
        self.assertEqual(sorted(os.listdir(self.folder)), before, "planning changes nothing")
        trials = plan["trials"]
        # 2 cases x (2 x 2 - 1) x 2 seeds
        self.assertEqual(len({t["id"] for t in trials}), 12)
        for t in trials:
            self.assertRegex(t["id"], "^[0-9a-f]{12}$")
            self.assertEqual(sorted(t["overrides"]), ["motion.model", "motion.optimiser.batch", "motion.weights.smoothness", "motion.windows.frames"])
            self.assertEqual(t["overrides"]["motion.optimiser.batch"], {5: 4, 8: 2}[t["overrides"]["motion.windows.frames"]])
            self.assertNotEqual((t["overrides"]["motion.windows.frames"], t["overrides"]["motion.weights.smoothness"]), (5, 0))
        self.assertEqual({(t["case"], t["seed"]) for t in trials}, {(c, s) for c in ("quaternion", "6D") for s in (1, 2)})
        # Ten motion networks over one extractor train one extractor: two seeds of it here, and of the deformation.
        self.assertEqual(len({t["artifacts"]["skeleton"] for t in trials}), 2)
        self.assertEqual(plan["artifacts"], {"there": 0, "to_make": 2 + 12 + 2, "shared": 4})

    def test_ids_are_of_the_question(self):
        first = [t["id"] for t in self.plan()["trials"]]
        for same in (["name=other"], ["run_root=elsewhere"], ["loop.log_every=7"], ["--threads", "1"], ["seed=3"]):
            self.assertEqual([t["id"] for t in self.plan(*same)["trials"]], first, same)
        for other in (["seed=4"], ["motion.windows.noise=0.1"], ["data.seed=5"], ["evaluation.frames=6"]):
            self.assertFalse(set(first) & {t["id"] for t in self.plan(*other)["trials"]}, other)
        shutil.move(self.path("configs"), self.path("moved"))
        self.write("moved/sweep.yaml", SHORT.replace("configs/", "").replace("[2, 3]", "[ 02,3 ]").replace("02", "2"))
        self.assertEqual([t["id"] for t in self.json("sweep", "plan", "moved/sweep.yaml")["trials"]], first)

    def test_words_of_the_command_line(self):
        def steps(*words):
            return [t["overrides"].get("motion.optimiser.steps") for t in self.plan(*words)["trials"]]
        self.assertEqual(steps("motion.optimiser.steps=4,5,6"), [4, 5, 6])
        self.assertEqual(steps("motion.optimiser.steps=choice(7)"), [7])
        self.assertEqual(steps("motion.optimiser.steps=range(2,9,3)"), [2, 5, 8])
        self.assertEqual(steps("motion.optimiser.steps=range(3,1,-1)"), [3, 2])
        self.assertEqual(steps("motion.optimiser.steps=9"), [None])
        self.assertEqual([t["overrides"]["stages"] for t in self.plan("stages=[motion],[motion, skeleton]")["trials"]],
                         [["motion"], ["motion", "skeleton"]] * 2)
        self.assertEqual(len(self.plan("motion.windows.noise=range(0,0.3,0.1)")["trials"]), 6)
        self.assertEqual({t["seed"] for t in self.plan("seeds=range(1,4)")["trials"]}, {1, 2, 3})
        self.assertEqual({t["seed"] for t in self.plan("--seed", 8)["trials"]}, {8})
        self.bad_input(["sweep", "plan", "sweep.yaml", "data.source='a,b'"], "a,b")  # quotes keep a comma: one file, missing

    def test_what_trials_are_measured_on_may_come_from_the_command_line(self):
        for words in (["evaluate.benchmark=nowhere", "evaluate.sets=[naked]"], ["evaluate.sets=naked,clothed", "evaluate.benchmark=nowhere"]):
            self.bad_input(["sweep", "plan", "sweep.yaml", *words], "nowhere", "no benchmark")
        self.bad_input(["sweep", "plan", "sweep.yaml", "evaluate.benchmark=nowhere"], "'sets' is empty")
        self.bad_input(["sweep", "plan", "sweep.yaml", "evaluate.sets=[naked]"], "evaluate.benchmark=FOLDER")
        self.bad_input(["sweep", "plan", "sweep.yaml", "evaluate.set=[naked]"], "nothing of 'evaluate'")

    def test_scans_and_the_anchor_are_part_of_the_question(self):
        self.write("sweep.yaml", "base: configs/tiny.yaml\ncases:\n  a: {}\n  noisy: {evaluation.scans.noise: 0.05}\n"
                   "  holed: {evaluation.scans.hole: 0.3}\n  free: {evaluation.anchor: 0}\n")
        self.done("sweep", "run", "sweep.yaml", "--out", "d")
        found = {}
        for trial in os.listdir(self.path("d/trials")):
            result = self.result(trial)
            found[result["case"]] = result["metrics"]["clouds"]["mean"]
        for case in ("noisy", "holed"):
            self.assertNotEqual(found[case]["pa_mpjpe"], found["a"]["pa_mpjpe"], case)
        self.assertAlmostEqual(found["free"]["pa_mpjpe"], found["a"]["pa_mpjpe"], 6)
        self.assertNotEqual(found["free"]["mpjpe"], found["a"]["mpjpe"])
        self.write("small/manifest.json", "{}")
        self.bad_input(["sweep", "plan", "sweep.yaml", "evaluate.benchmark=small", "evaluate.sets=[naked]"], "small/manifest.json")
        self.write("small/manifest.json", json.dumps({"restage_benchmark": 1, "protocol": "p", "seed": 0, "license": "",
                                                      "provenance": "", "inputs": {}, "files": {}}))
        self.bad_input(["sweep", "plan", "sweep.yaml", "evaluate.benchmark=small", "evaluate.sets=[naked]"], "benchmark's scans are as they are")

    def test_another_base_may_come_from_the_command_line(self):
        first = [t["id"] for t in self.plan()["trials"]]
        self.write("other.yaml", BASE.replace("hidden: 16", "hidden: 8"))
        self.write("same.yaml", BASE)
        self.assertEqual([t["id"] for t in self.plan("base=same.yaml")["trials"]], first)
        self.assertFalse(set(first) & {t["id"] for t in self.plan("base=other.yaml")["trials"]})
        self.bad_input(["sweep", "plan", "sweep.yaml", "base=none.yaml"], "none.yaml", "does not exist")
        self.write("by_name.yaml", "base: standard/finetune\ngrid: {data.seed: [1, 2]}\n")
        self.assertEqual(len(self.json("sweep", "plan", "by_name.yaml", "data.source=builtin", "data.bodies={train: 2, validation: 2, test: 2}",
                                       "data.motions={train: 2, validation: 2, test: 1}")["trials"]), 2)

    def test_out_is_ready_for_any_engine(self):
        self.write("sweep.yaml", SWEEP)
        self.done("sweep", "plan", "sweep.yaml", "--out", "d", "deformation.optimiser.steps=2,3")
        again = self.json("sweep", "plan", "d/sweep.yaml")  # the resolved file stands for itself
        self.assertEqual(sorted(os.listdir(self.path("d"))), ["plan.json", "sweep.yaml", "trials"])
        self.assertEqual(sorted(os.listdir(self.path("d/trials"))), sorted(t["id"] for t in again["trials"]))

    def test_before_and_after_fine_tuning(self):
        self.write("fine.yaml", CONFIG.replace("motion:\n  sizes", "motion:\n  init: %s\n  sizes" % weights("tiny")))
        before = "cases: {before: {motion.init: none, motion.from: %s}, after: {}}\n" % weights("tiny")
        self.write("sweep.yaml", "base: fine.yaml\nset: {data.bodies.test: 2}\n" + before)
        stages = [sorted(t["artifacts"]) for t in self.json("sweep", "plan", "sweep.yaml")["trials"]]
        self.assertEqual(stages, [["deformation", "skeleton"], ["deformation", "motion", "skeleton"]])

    def test_measured_forecast(self):
        found = self.plan("--measure")["forecast"]
        self.assertGreater(found["seconds"], 0)
        self.assertGreater(found["memory_bytes"], 1000)


class BadSweeps(Sweep):
    def bad(self, text, line, *contains, words=()):
        self.write("bad.yaml", text)
        self.bad_input(["sweep", "plan", "bad.yaml", *words], "bad.yaml:%d: " % line, *contains)

    def test_each_in_one_line_with_its_place(self):
        base = "base: configs/tiny.yaml\n"
        table = [
            (base + "grids: {a.b: [1]}\n", 2, "'grids'", "'grid'"),
            ("grid: {a.b: [1]}\n", 1, "'base' is missing"),
            ("base: none.yaml\n", 1, "none.yaml"),
            (base + "grid:\n  motion.windos.frames: [5, 6]\n", 3, "windos", "'windows'"),
            (base + "set:\n  motion.windows.frame: 5\n", 3, "'frames'"),
            (base + "grid:\n  motion.windows.frames: [5,\n    none]\n", 4, "motion.windows.frames"),
            (base + "grid:\n  motion.windows.frames: 5\n", 3, "list"),
            (base + "grid:\n  motion.windows.frames: []\n", 3, "list"),
            (base + "zip:\n  - motion.windows.frames: [5, 6]\n    motion.optimiser.batch: [1, 2, 3]\n", 4, "3 values", "has 2"),
            (base + "zip: {motion.windows.frames: [5, 6]}\n", 2, "list"),
            (base + "grid: {motion.windows.frames: [5, 6]}\nexclude:\n  - {motion.windows.frames: 7}\n", 4, "matches no"),
            (base + "grid: {motion.windows.frames: [5, 6]}\nexclude:\n  - {motion.window.frames: 5}\n", 4, "matches no", "'motion.windows.frames'"),
            (base + "grid: {motion.windows.frames: [5]}\nexclude: [{motion.windows.frames: 5}]\n", None, "no trial"),
            (base + "cases:\n  a: {motion.windows.frames: 5}\n  b: {motion.windows.frames: 5}\n", 4, "'a' and 'b'", "same trial"),
            (base + "cases:\n  a: {name: x}\n  b: {name: y}\n", 4, "'a' and 'b'", "same trial"),
            (base + "grid:\n  motion.weights.smoothness:\n    - 0\n    - 0.0\n", 5, "same trial"),
            (base + "grid:\n  loop.log_every:\n    - 1\n    - 2\n", 5, "same trial"),
            (base + "set:\n  stages: [motion]\n  skeleton.optimiser.steps: 5\n", 4, "no stage reads", "skeleton.optimiser.steps"),
            (base + "set: {stages: [motion]}\ngrid:\n  skeleton.optimiser.steps: [5, 6]\n", 4, "no stage reads"),
            (base + "cases:\n  a: {}\n  b:\n    stages: [motion]\n    skeleton.optimiser.steps: 5\n", 6, "no stage reads"),
            (base + "set: {motion.windows.frames: 7}\ngrid:\n  motion.windows.frames: [5, 6]\n", 4, "line 2"),
            (base + "grid:\n  motion.windows.frames: [5, 6]\nzip:\n  - {motion.windows.frames: [5, 6]}\n", 5, "line 3"),
            (base + "grid:\n  motion.windows.frames: [5, 6]\ncases:\n  a: {motion.windows.frames: 7}\n", 5, "line 3"),
            (base + "grid:\n  motion: {windows.frames: [5]}\n  motion.windows: {frames: [6]}\n", 4, "second time"),
            (base + "seeds: [1, 2, 1]\n", 2, "twice"),
            (base + "seeds: [a]\n", 2, "seeds"),
            (base + "grid: {seed: [1, 2]}\n", 2, "seeds"),
            (base + "evaluate: {benchmark: nowhere, sets: [naked]}\n", 2, "nowhere"),
            (base + "evaluate: {benchmark: nowhere}\n", 2, "sets"),
            (base + "evaluate: {benchmarks: nowhere}\n", 2, "'benchmark'"),
            (base + "retries: many\n", 2, "retries"),
            (base + "early_stop: {metric: motion.pa_mpjpe, rule: best}\n", 2, "median"),
            (base + "early_stop: {metric: motion.pa_mpjp}\n", 2, "did you mean 'motion.pa_mpjpe'"),
            (base + "early_stop: {metric: loss}\n", 2, "skeleton.joint_error_mm"),
            (base + "set: {stages: [motion]}\nearly_stop: {metric: skeleton.joint_error_mm}\n", 3, "no trial trains"),
            (base + "set: {evaluation.system: regster}\n", None, "did you mean 'register'"),
            (base + "set: {stages: []}\n", None, "at least one"),
        ]
        for text, line, *contains in table:
            with self.subTest(text):
                if line is None:
                    self.write("bad.yaml", text)
                    self.bad_input(["sweep", "plan", "bad.yaml"], "bad.yaml", *contains)
                else:
                    self.bad(text, line, *contains)

    def test_an_empty_case_is_a_case(self):
        self.write("sweep.yaml", "base: configs/tiny.yaml\ncases:\n  a: {}\n  b: {motion.windows.frames: 5}\n")
        self.assertEqual([t["case"] for t in self.plan()["trials"]], ["a", "b"])

    def test_a_key_of_all_trials_may_be_read_by_one(self):
        self.write("sweep.yaml", "base: configs/tiny.yaml\nset: {skeleton.optimiser.steps: 5}\ncases:\n  a: {}\n  b: {stages: [motion]}\n")
        self.assertEqual([len(t["artifacts"]) for t in self.plan()["trials"]], [3, 1])

    def test_words(self):
        for word, *contains in (["motion.windows.frames=5,,6", "empty"], ["motion.windows.frames=range(1,1)", "range"],
                                ["motion.windows.frames=range(a,b)", "numbers"], ["=5", "override"], ["motion.windows.frame=5,6", "'frames'"],
                                ["a b=5", "no key"], ["seeds=1,1", "twice"]):
            with self.subTest(word):
                self.bad_input(["sweep", "plan", "sweep.yaml", word], *contains)
        self.bad_input(["sweep", "plan", "sweep.yaml", "motion.windows.frames=5", "motion.windows.frames=6"], "second time")
        self.bad_input(["sweep", "plan", "sweep.yaml", "sweep.yaml"], "two sweep files")
        self.bad_input(["sweep", "plan", "a=1"], "no sweep file")
        self.bad_input(["sweep", "plan", "none.yaml"], "none.yaml")
        self.bad_input(["sweep", "run", "sweep.yaml"], "--out")
        self.bad_input(["sweep", "run", "sweep.yaml", "--out", "d", "--jobs", "0"], "--jobs")
        self.bad_input(["sweep", "run", "sweep.yaml", "--out", "configs"], "configs", "no sweep's folder")
        self.bad_input(["sweep", "run", "sweep.yaml", "--out", "d", "motion.window=1"], "motion.window")

    def test_folders(self):
        self.bad_input(["sweep", "status", "nowhere"], "nowhere")
        self.bad_input(["sweep", "stop", "configs"], "configs")
        self.bad_input(["trial", "nowhere", "0123456789ab"], "nowhere")
        self.done("sweep", "plan", "sweep.yaml", "--out", "d")
        self.bad_input(["trial", "d", "0123456789ab"], "no trial")
        os.rename(self.path("d"), os.fsencode(self.path("d")) + b"\xff")
        self.bad_input(["sweep", "export", os.fsdecode(b"d\xff"), "--engine", "snakemake", "--out", "Snakefile"], "UTF-8", "rename")
        self.bad_input(["sweep", "plan", "sweep.yaml", "data.bodies.test=1"], "no retargeting sequence")


class Runs(Sweep):
    def test_from_file_to_results_and_on(self):
        result = self.restage("sweep", "run", "sweep.yaml", "--out", "d", "--jobs", "2")
        self.assertEqual(result.code, 0, result.err)
        self.assertEqual(result.out, "2 done\n")
        plan = self.plan()["trials"]
        for trial in plan:
            found = self.result(trial["id"])
            for key in ("id", "case", "seed", "overrides", "artifacts"):
                self.assertEqual(found[key], trial[key])
            self.assertEqual((found["state"], found["error"]), ("done", None))
            self.assertGreater(found["seconds"], 0)
            for name, metrics in found["metrics"].items():
                self.assertIn("mpjpe", metrics["mean"], name)
                self.assertTrue(metrics["sequences"][0]["name"])
            self.assertTrue(found["metrics"])
            self.assertTrue({"config.yaml", "result.json", "log.txt"} <= set(os.listdir(self.path("d/trials/" + trial["id"]))))
        # Again: nothing is done twice. More seeds: what is done is kept.
        before = [self.bytes("d/trials/%s/result.json" % t["id"]) for t in plan]
        self.done("sweep", "run", "sweep.yaml", "--out", "d")
        more = self.restage("sweep", "run", "sweep.yaml", "--out", "d", "seeds=3,4")
        self.assertEqual((more.code, more.out), (0, "4 done\n"), more.err)
        self.assertEqual([self.bytes("d/trials/%s/result.json" % t["id"]) for t in plan], before)
        self.assertEqual(self.done("trial", "d", plan[0]["id"]), "trial %s was done before\n" % plan[0]["id"])
        # An edited base asks other questions; what is there belongs to its id and is told, not used.
        self.write("configs/tiny.yaml", BASE.replace("self_share: 0.25", "self_share: 0.5"))
        changed = self.restage("sweep", "run", "sweep.yaml", "--out", "d")
        self.assertIn("4 trials in d are not of this sweep", changed.err)
        self.assertEqual(self.json("sweep", "status", "d")["counts"]["done"], 2)
        self.assertEqual(self.json("sweep", "status", "d")["counts"], {"pending": 0, "running": 0, "done": 2, "failed": 0, "stopped": 0})

    def test_motion_networks_share_what_their_extractor_was_asked(self):
        self.write("sweep.yaml", SHORT + "set: {motion.answers.sequences: 3, motion.answers.frames: 12}\n")
        self.done("sweep", "run", "sweep.yaml", "--out", "d", "store=store")
        logs = [self.bytes("d/trials/%s/log.txt" % t["id"]).decode() for t in self.plan()["trials"]]
        self.assertEqual(sorted(log.count("the extractor is asked") for log in logs), [0, 2])
        self.assertEqual([name[:8] for name in os.listdir(self.path("store/answers"))], ["answers-"] * 2)
        # The same bytes as without: they are a place to look, and nothing that a result depends on.
        shutil.rmtree(self.path("store/answers"))
        first = self.result(self.plan()["trials"][0]["id"])
        shutil.rmtree(self.path("store/motion-" + first["artifacts"]["motion"]))
        shutil.rmtree(self.path("d"))
        self.done("sweep", "run", "sweep.yaml", "--out", "d", "store=store")
        again = self.result(first["id"])
        self.assertEqual((again["artifacts"], again["metrics"]), (first["artifacts"], first["metrics"]))

    def test_from_another_folder(self):
        self.done("sweep", "plan", "sweep.yaml", "--out", "d")
        trial = self.plan()["trials"][0]["id"]
        done = subprocess.run([PROGRAM, "trial", self.path("d"), trial], cwd="/", capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.result(trial)["state"], "done")

    def test_a_failing_trial_ends_no_other(self):
        self.write("sweep.yaml", SHORT + "cases:\n  good: {}\n  bad: {skeleton.optimiser.schedule.rate: 1e25}\nretries: 1\n")
        result = self.restage("sweep", "run", "sweep.yaml", "--out", "d")
        self.assertEqual(result.code, 1, result.err)
        self.assertEqual(result.out, "2 done, 2 failed\n")
        self.assertEqual(result.err.count("is tried again"), 2)
        for trial in self.json("sweep", "status", "d")["trials"]:
            if trial["case"] == "bad":
                self.assertEqual(trial["state"], "failed")
                self.assertIn("skeleton/patch_transformer", trial["error"])
        self.assertIn("skeleton/patch_transformer", self.done("sweep", "status", "d"))

    def test_early_stop(self):
        text = ("base: configs/tiny.yaml\nset: {stages: [deformation], deformation.optimiser.steps: 60}\nseeds: [1, 2, 3]\n"
                "grid: {deformation.optimiser.schedule.rate: [0.005, 1e-9]}\n")
        rule = "early_stop: {metric: deformation.skinning_mm, rule: %s, after: 0.3}\n"
        name = "median"  # asha: tests/experiments/early_stop_test.cpp
        self.write("sweep.yaml", text + rule % "median")
        run = self.restage("sweep", "run", "sweep.yaml", "--out", name, "store=store-" + name)
        self.assertEqual((run.code, run.out), (0, "3 done, 3 stopped\n"), run.err)
        for trial in self.json("sweep", "status", name)["trials"]:
            bad = trial["overrides"]["deformation.optimiser.schedule.rate"] < 1e-3
            self.assertEqual(trial["state"], "stopped" if bad else "done")
            if bad:
                self.assertIn("stopped early by %s after 20 of 60 steps: deformation.skinning_mm" % name, trial["error"])
                self.assertEqual(self.result(trial["id"], name)["early_stop"]["rule"], name)
                self.assertEqual(self.done("trial", name, trial["id"]), "trial %s was stopped before\n" % trial["id"])
        self.assertEqual(self.json("sweep", "table", name)["trials"]["stopped"], 3)
        before = os.stat(self.path("store-" + name)).st_mtime_ns
        self.assertEqual(self.done("sweep", "run", "sweep.yaml", "--out", name, "store=store-" + name), "3 done, 3 stopped\n")
        self.assertEqual(os.stat(self.path("store-" + name)).st_mtime_ns, before, "nothing was left to do")
        # Without the rule what was stopped goes on, to the bytes of a sweep that never had one.
        self.write("sweep.yaml", text)
        for out, store in (("median", "store-median"), ("whole", "store-whole")):
            self.assertEqual(self.done("sweep", "run", "sweep.yaml", "--out", out, "store=" + store), "6 done\n")
        self.assertEqual(sorted(os.listdir(self.path("store-median"))), sorted(os.listdir(self.path("store-whole"))))
        for artifact in os.listdir(self.path("store-whole")):
            self.assertEqual(self.bytes(f"store-median/{artifact}/artifact.json"), self.bytes(f"store-whole/{artifact}/artifact.json"))

    def test_a_case_with_a_seed_of_its_own(self):
        self.write("sweep.yaml", "base: configs/tiny.yaml\nseeds: [1, 2]\ncases:\n  learned: {stages: [motion]}\n"
                   "  register: {stages: [], evaluation.system: register, evaluation.every: 2, evaluation.frames: 3, seed: 7}\n")
        self.assertEqual([(t["case"], t["seed"]) for t in self.plan()["trials"]], [("learned", 1), ("learned", 2), ("register", 7)])
        self.done("sweep", "run", "sweep.yaml", "--out", "d")
        table = self.json("sweep", "table", "d")
        self.assertEqual([(row["label"], row["n"]) for row in table["rows"]], [("learned", 2), ("register", 1)])
        found = table["rows"][1]["metrics"]["clouds"]
        self.assertLess(found["pa_mpjpe"]["mean"], 0.3)
        self.assertIsNone(found["acc"]["mean"], "every second frame has no acceleration")
        self.bad_input(["train", "configs/tiny.yaml", "stages=[]", "evaluation.system=register"], "nothing to train")
        # What needs no learning stands beside what was learned.
        self.assertEqual([row["label"] for row in table["references"]], ["closed form", "rest pose", "source unchanged"])
        self.assertLess(table["references"][0]["metrics"]["true_skeletons"]["pa_mpjpe"]["mean"],
                        table["rows"][0]["metrics"]["true_skeletons"]["pa_mpjpe"]["mean"])

    def test_every_second_frame_in_all_conditions(self):
        self.write("sweep.yaml", "base: configs/tiny.yaml\nset: {evaluation.every: 2}\n")
        self.done("sweep", "run", "sweep.yaml", "--out", "d")
        found = self.result(os.listdir(self.path("d/trials"))[0])["metrics"]
        self.assertEqual(sorted(found), ["clouds", "true_poses", "true_skeletons"])
        for name, scores in found.items():
            self.assertEqual(scores["sequences"][0]["frames"], 3, name)  # of five
            self.assertIsNone(scores["mean"]["acc"], name)

    def test_a_motion_model_without_a_network(self):
        self.write("sweep.yaml", "base: configs/tiny.yaml\ncases:\n  network: {}\n"
                   "  closed form: {motion.model: motion/closed_form, motion.sizes: {}, motion.optimiser.steps: 0}\n")
        self.done("sweep", "run", "sweep.yaml", "--out", "d")
        table = self.json("sweep", "table", "d")
        closed = next(row for row in table["rows"] if row["label"] == "closed form")["metrics"]
        reference = next(row for row in table["references"] if row["label"] == "closed form")["metrics"]
        # From clouds it does what the reference does with the same extracted joints.
        self.assertAlmostEqual(closed["clouds"]["pa_mpjpe"]["mean"], reference["clouds"]["pa_mpjpe"]["mean"], places=5)
        self.bad_input(["train", "configs/tiny.yaml", "motion.model=motion/closed_form", "motion.sizes={}"], "motion", "nothing to learn", "optimiser.steps=0")

    def test_one_trial_is_run_by_one(self):
        self.done("sweep", "plan", "sweep.yaml", "--out", "d", "skeleton.optimiser.steps=1000000")
        trial = os.listdir(self.path("d/trials"))[0]
        first = self.start("trial", "d", trial)
        self.wait_for(self.running)
        second = self.restage("trial", "d", trial)
        self.one_line(second, 1, str(first.pid), trial)
        first.kill()
        first.wait()
        self.assertEqual(self.running(), [], "a dead holder is known at once")
        third = self.start("trial", "d", trial)
        self.wait_for(self.running)
        third.send_signal(signal.SIGTERM)
        third.stderr.read()
        self.assertEqual(third.wait(60), 143)
        self.assertEqual(self.result(trial)["state"], "stopped")

    def test_stopped_and_gone_on(self):
        self.write("sweep.yaml", "base: configs/tiny.yaml\nset: {stages: [deformation], deformation.optimiser.steps: 300}\nseeds: [1, 2, 3]\n")
        whole = self.restage("sweep", "run", "sweep.yaml", "--out", "whole", "store=whole-store")
        self.assertEqual(whole.code, 0, whole.err)
        sweeper = self.sweeper("store=d-store", "--jobs", "2")
        self.done("sweep", "stop", "d")
        self.assertEqual(sweeper.wait(60), 1)
        self.assertIn("goes on", sweeper.stderr.read())
        counts = self.json("sweep", "status", "d")["counts"]
        self.assertEqual((counts["running"], counts["failed"]), (0, 0))
        self.assertGreater(counts["stopped"] + counts["pending"], 0)
        self.done("sweep", "run", "sweep.yaml", "--out", "d", "store=d-store")
        artifacts = sorted(os.listdir(self.path("whole-store")))
        self.assertEqual(sorted(os.listdir(self.path("d-store"))), artifacts, "three artifacts and nothing else")
        self.assertEqual(len(artifacts), 3)
        for artifact in artifacts:
            for name in ("weights.safetensors", "metrics.jsonl", "config.yaml", "artifact.json"):
                self.assertEqual(self.bytes(f"d-store/{artifact}/{name}"), self.bytes(f"whole-store/{artifact}/{name}"))

    def test_stages_are_trained_once_and_damage_is_made_good(self):
        self.write("sweep.yaml", "base: configs/tiny.yaml\nset: {stages: [skeleton, motion]}\ngrid: {motion.weights.smoothness: [0, 0.1]}\n")
        self.done("sweep", "run", "sweep.yaml", "--out", "d")
        store = lambda: sorted(os.listdir(self.path("runs/store")))
        self.assertEqual([n.split("-")[0] for n in store()], ["motion", "motion", "skeleton"])
        plan = self.json("sweep", "plan", "sweep.yaml")
        self.assertEqual(plan["artifacts"], {"there": 3, "to_make": 0, "shared": 1})
        # A stage alone, for engines: nothing to do, nothing done.
        trial = plan["trials"][0]["id"]
        self.done("trial", "d", trial, "--stage", "motion")
        self.bad_input(["trial", "d", trial, "--stage", "deformation"], "deformation")
        # Damage is told by its checksum, and the artifact is made again to the same bytes.
        weights = "runs/store/" + store()[-1] + "/weights.safetensors"
        good = self.bytes(weights)
        with open(self.path(weights), "r+b") as f:
            f.seek(len(good) - 3)
            f.write(b"???")
        shutil.rmtree(self.path("d"))
        again = self.restage("sweep", "run", "sweep.yaml", "--out", "d")
        self.assertEqual(again.code, 0, again.err)
        self.assertEqual(self.bytes(weights), good)

    def test_stages_taken_and_started_from(self):
        self.done("train", "configs/tiny.yaml", "stages=[skeleton,motion]", "--quiet")
        run = "runs/" + [n for n in os.listdir(self.path("runs")) if n != "store"][0]
        self.write("sweep.yaml", "base: configs/tiny.yaml\nset: {stages: [skeleton, motion], skeleton.from: %s}\n"
                   "cases:\n  tuned: {motion.init: %s}\n  new: {}\n" % (run, run))
        plan = self.json("sweep", "plan", "sweep.yaml")
        self.assertEqual([sorted(t["artifacts"]) for t in plan["trials"]], [["motion"], ["motion"]])
        self.assertEqual(len({t["artifacts"]["motion"] for t in plan["trials"]}), 2)
        self.done("sweep", "run", "sweep.yaml", "--out", "d")
        tuned, new = [self.result(t["id"])["metrics"]["clouds"]["mean"]["mpjpe"] for t in plan["trials"]]
        self.assertNotEqual(tuned, new)
        self.bad_input(["sweep", "plan", "sweep.yaml", "skeleton.optimiser.steps=3"], "skeleton.optimiser.steps")
        self.bad_input(["sweep", "plan", "sweep.yaml", "motion.init=nowhere.safetensors"], "nowhere.safetensors")

    def unreadable(self, name):
        """A file that is good and cannot be read, by a link that leads to itself (root needs no permission); what makes it good again."""
        os.rename(self.path(name), self.path("good"))
        os.symlink(os.path.basename(name), self.path(name))

        def mended():
            os.remove(self.path(name))
            os.rename(self.path("good"), self.path(name))
        return mended

    def test_an_artifact_that_cannot_be_read_is_not_made_again(self):
        self.done("sweep", "run", "sweep.yaml", "--out", "d")
        before = sorted(os.listdir(self.path("runs/store")))
        weights = "runs/store/%s/weights.safetensors" % next(n for n in before if n.startswith("skeleton-"))
        mended = self.unreadable(weights)
        result = self.restage("sweep", "run", "sweep.yaml", "--out", "d", "motion.optimiser.steps=4")
        self.assertEqual((result.code, result.out), (1, "1 failed\n"), result.err)
        self.assertIn(weights + ": cannot be read (Too many levels of symbolic links)", result.err)
        mended()
        self.assertEqual(sorted(os.listdir(self.path("runs/store"))), before, "nothing is made, nothing is moved aside")
        self.assertEqual(self.done("sweep", "run", "sweep.yaml", "--out", "d", "motion.optimiser.steps=4"), "1 done\n")

    def test_a_result_that_cannot_be_read_is_not_run_again(self):
        self.done("sweep", "run", "sweep.yaml", "--out", "d")
        result = "d/trials/%s/result.json" % self.plan()["trials"][0]["id"]
        good = self.bytes(result)
        mended = self.unreadable(result)
        for command in (["run", "sweep.yaml", "--out", "d"], ["status", "d"], ["table", "d"]):
            self.one_line(self.restage("sweep", *command), 2, result + ": cannot be read")
        mended()
        self.assertEqual(self.bytes(result), good)

    def test_a_stop_waits_for_the_step(self):
        # Sweeper and trial both see the request, while a step is on.
        sweeper = self.sweeper("skeleton.optimiser.steps=1000000", "skeleton.optimiser.batch=6000", "store=d-store")
        logs = self.path("d-store/.skeleton-*.partial/log.txt")
        self.wait_for(lambda: any(b"1000000 steps" in self.bytes(f) for f in glob.glob(logs)))  # from here on steps are made
        self.done("sweep", "stop", "d")
        self.assertEqual(sweeper.wait(120), 1, sweeper.stderr.read())
        self.assertEqual(self.json("sweep", "status", "d")["counts"]["stopped"], 1, "it ended by itself")
        kept = [n for f, _, names in os.walk(self.path("d-store")) for n in names if n.startswith("skeleton-0")]
        self.assertEqual(len(kept), 1, "with a checkpoint")

    def test_what_killed_processes_left_is_tidied_up(self):
        self.done("sweep", "run", "sweep.yaml", "--out", "d")
        files = lambda: sorted(os.path.join(f, n) for f, _, names in os.walk(self.path("d")) for n in names)
        whole = files()
        first, second = (self.path("d/trials/" + t) for t in sorted(os.listdir(self.path("d/trials"))))
        for name in (first + "/lease.2", first + "/lease.part0123456789abcdef", first + "/result.json.part77", second + "/result.json.part78",
                     self.path("d/plan.json.part79")):
            self.write(name, "torn")
        os.remove(second + "/result.json")  # killed while it wrote this; and a sweeper while it planned
        os.remove(self.path("d/plan.json"))
        self.done("sweep", "run", "sweep.yaml", "--out", "d")
        self.assertEqual(files(), whole)
        self.write(first + "/lease.1", "torn")  # engines call trials
        self.done("trial", "d", os.path.basename(first))
        self.assertEqual(files(), whole)

    def test_signals_are_passed_on(self):
        for number, code in ((signal.SIGTERM, 143), (signal.SIGINT, 130)):
            sweeper = self.sweeper("skeleton.optimiser.steps=1000000")
            sweeper.send_signal(number)
            sweeper.stderr.read()
            self.assertEqual(sweeper.wait(60), code)
            self.assertEqual(self.running(), [])
            self.assertEqual(self.json("sweep", "status", "d")["counts"]["stopped"], 1)

    def test_a_killed_sweeper_ends_its_trials(self):
        sweeper = self.sweeper("skeleton.optimiser.steps=1000000", "store=d-store")
        status = self.json("sweep", "status", "d")["trials"][0]
        logs = self.path("d-store/.skeleton-*.partial/log.txt")
        self.wait_for(lambda: any(b"1000000 steps" in self.bytes(f) for f in glob.glob(logs)))
        sweeper.kill()
        sweeper.wait()
        self.wait_for(lambda: not self.running())
        self.wait_for(lambda: not os.path.exists("/proc/" + status["holder"].split()[1]))
        self.assertEqual(self.result(status["id"])["state"], "stopped")
        kept = [n for f, _, names in os.walk(self.path("d-store")) for n in names if n.startswith("skeleton-0")]
        self.assertTrue(kept, "with a checkpoint")
        # One that was told of a caller that is gone does not begin.
        gone = self.restage("trial", "d", status["id"], "--ends-with", 2 ** 22 - 1)
        self.assertEqual(gone.code, 143)

    def test_a_caller_that_ignores_its_children(self):
        """A program inherits from its caller that the ends of its children are ignored."""
        result = self.restage("sweep", "run", "sweep.yaml", "--out", "d", timeout=90,
                              before=lambda: signal.signal(signal.SIGCHLD, signal.SIG_IGN))
        self.assertEqual(result.code, 0, result.err)
        self.assertEqual({t["state"] for t in self.json("sweep", "status", "d")["trials"]}, {"done"})

    def test_a_killed_trial_is_told(self):
        sweeper = self.sweeper("skeleton.optimiser.steps=1000000", "motion.optimiser.steps=2")
        holder = self.json("sweep", "status", "d")["trials"][0]["holder"]
        os.kill(int(holder.split()[1]), signal.SIGKILL)
        self.assertEqual(sweeper.wait(60), 1)
        failed = self.json("sweep", "status", "d")["trials"][0]
        self.assertEqual(failed["state"], "failed")
        self.assertIn("signal 9", failed["error"])
