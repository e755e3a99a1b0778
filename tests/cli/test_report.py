"""restage report: a page about runs, and about a sweep."""
import json
import os
import re

from support import CliTest
from tiny_run import CONFIG


TWO = ["data.bodies.test=2", "motion.windows.frames=8", "motion.validation_frames=8", "evaluation={sequences: 3, frames: 8}"]


class Report(CliTest):
    def train(self, *overrides):
        self.write("tiny.yaml", CONFIG)
        return self.done("train", "tiny.yaml", *overrides, "--quiet").strip()

    def page(self, name):
        return self.bytes(name).decode()

    def data(self, page):
        return json.loads(re.search(r'<script id="data" type="application/json">(.*?)</script>', page, re.S).group(1))

    def test_run(self):
        run = self.train(*TWO)
        said = self.json("report", run, "--out", "r.html")
        self.assertEqual((said["runs"], len(said["sequences"])), (1, 3))
        self.assertEqual([s.split(":")[0] for s in said["sequences"]], ["best", "middle", "worst"])
        page = self.page("r.html")
        figures = self.json("eval", "run=" + run)
        self.assertIn(f"<td>{figures['mean']['pa_mpjpe']:.4g} [", page)
        self.assertIn("<h3>true_skeletons</h3>", page)
        self.assertIn("What differs from the defaults", page)
        self.assertIn("tiny.yaml", page, "the command line stands under provenance")
        curves = {c["name"]: c["series"] for c in self.data(page)["curves"]}
        lines = [json.loads(line) for line in self.bytes(os.path.join(run, "metrics.jsonl")).splitlines()]
        losses = [(e["step"], e["loss"]) for e in lines if e["stage"] == "skeleton" and "loss" in e]
        self.assertEqual([tuple(p) for p in zip(*curves["skeleton.loss"][0]["points"])], losses)
        again = self.done("report", run, "--out", "r.html", "--no-play", "--threads", 1)
        self.assertNotIn("<iframe", self.page("r.html"))
        self.assertIn("r.html", again)

    def test_unmeasured_run_shows_its_curves(self):
        run = self.train("stages=[skeleton]")
        self.done("report", run, "--out", "r.html")
        self.assertIn("is not measured: 1 bodies", self.page("r.html"))
        os.remove(self.path(os.path.join(run, "weights.safetensors")))
        self.done("report", run, "--out", "r.html")
        self.assertIn("is not finished", self.page("r.html"))

    def test_sweep_plays_given_sequences(self):
        run = self.train(*TWO)
        self.done("eval", "run=" + run, "--out", "folder/")
        self.write("s.yaml", "base: tiny.yaml\nseeds: [1, 2]\nset: {data.bodies.test: 2, motion.windows.frames: 8, motion.validation_frames: 8, "
                   "evaluation.sequences: 2, evaluation.frames: 8}\n")
        self.done("sweep", "run", "s.yaml", "--out", "s", "--quiet")
        said = self.json("report", "s", "--sequence", "folder", "--out", "s.html")
        self.assertEqual((said["runs"], said["sequences"]), (2, ["folder"]))
        page = self.page("s.html")
        self.assertIn("2 done", page)
        self.assertEqual(len(self.data(page)["curves"][0]["series"]), 2, "the seeds have curves of their own")
        trial = os.listdir(self.path("s/trials"))[0]
        self.done("report", "s", "--sequence", "folder", "--trial", trial, "--out", "s.html")
        self.bad_input(["report", "s", "--sequence", "folder", "--trial", "0" * 12, "--out", "t.html"])
        self.bad_input(["report", "s", "--trial", trial, "--out", "t.html"])
        self.bad_input(["report", "s", run, "--out", "t.html"])
        self.bad_input(["report", "s", "--sequence", "nowhere", "--out", "t.html"])
        self.assertFalse(os.path.exists(self.path("t.html")))

    def test_what_a_run_says_of_itself_may_be_nested_without_end(self):
        run = self.train("stages=[skeleton]")
        facts = json.loads(self.bytes(os.path.join(run, "provenance.json")))
        facts["deep"] = "DEEP"
        self.write(os.path.join(run, "provenance.json"), json.dumps(facts).replace('"DEEP"', "[" * 200000 + "]" * 200000))
        self.done("report", run, "--out", "r.html", "--no-play")
        self.assertIn("tiny.yaml", self.page("r.html"))

    def test_the_page_can_be_written_is_asked_first(self):
        run = self.train("stages=[skeleton]")
        for out in ("/proc/page.html", "x" * 300 + ".html", run + "/config.yaml/page.html"):
            self.bad_input(["report", run, "--out", out], "page.html" if "page" in out else "x.html", "cannot be written")

    def test_names_that_are_no_text(self):
        run = self.train("stages=[skeleton]")
        os.rename(self.path(run), os.fsencode(self.path("odd")) + b"\xff")
        self.done("report", os.fsdecode(b"odd\xff"), "--out", "page.html", "--quiet")
        self.assertIn("odd\ufffd", self.page("page.html"))

    def test_bad_input(self):
        run = self.train("stages=[skeleton]")
        before = self.bytes(os.path.join(run, "config.yaml"))
        for arguments in (["nowhere", "--out", "r.html"], [run, "--out", "r.pdf"], [run], [run, "--out", "no/such/r.html"],
                          [run, "--out", "r.html", "--trial", "0" * 12], [run, "--out", "r.html", "--no-play", "--sequence", "x"]):
            self.bad_input(["report", *arguments])
        self.assertEqual(self.bytes(os.path.join(run, "config.yaml")), before)
        self.assertFalse(os.path.exists(self.path("r.html")))
