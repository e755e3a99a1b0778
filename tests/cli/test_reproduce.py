"""restage reproduce: a paper's experiments from their folder to a page with verdicts."""
import glob
import json
import os
import re
import shutil
import struct

from support import DATA, ROOT, CliTest, needs_data
from tiny_run import CONFIG

BASE = CONFIG.replace("motions: {train: 4, validation: 2, test: 1}", "motions: {train: 4, validation: 2, test: 2}").replace(
    "bodies: {train: 2, validation: 2, test: 1}", "bodies: {train: 2, validation: 2, test: 2}") + "evaluation: {sequences: 2, frames: 6}\n"
SWEEP = """base: ../../tiny.yaml
set: {stages: [motion]}
cases:
  untrained: {motion.optimiser.steps: 0}
  trained: {motion.optimiser.steps: 60}
seeds: [1, 2, 3]
"""
PAPER = """paper: somebody2024
table: "1"
title: does training help
metrics: [mpjpe, pa_mpjpe]
beside: [foot_slide_mm, peak_speed]
tables:
  - set: naked
    rows:
      - {row: untrained, printed: [0.5, 0.4]}
      - {row: trained, printed_as: ours, printed: [0.2, 0.1]}
      - {row: theirs, printed: [0.3, 0.2], not_run: it is nobody's}
claims:
  - {says: training helps, where: section 1, better: trained, than: untrained}
  - {says: ours beats theirs, where: section 2, better: trained, than: theirs}
smoke: {words: ["seeds=[1]", motion.windows.frames=6], set: true_skeletons}
lite: {set: true_skeletons, note: Tiny.}
"""


def jpeg_size(data):
    """Height and width, from the frame header of a baseline JPEG."""
    assert data[:2] == b"\xff\xd8", "no JPEG"
    at = 2
    while data[at:at + 2] != b"\xff\xc0":
        at += 2 + struct.unpack(">H", data[at + 2:at + 4])[0]
    return struct.unpack(">HH", data[at + 5:at + 9])


class Reproduce(CliTest):
    def setUp(self):
        super().setUp()
        self.write("tiny.yaml", BASE)
        self.write("experiments/one/sweep.yaml", SWEEP)
        self.write("experiments/one/paper.yaml", PAPER)
        self.write("experiments/one/README.md", "# One\n")

    def reproduce(self, *words):
        return self.json("reproduce", "somebody2024", "--experiments", "experiments", "--quiet", *words)

    def text(self, name):
        return self.bytes(name).decode()

    def result(self, name):
        return json.loads(self.bytes(name))

    def test_runs_judges_keeps_and_makes_the_page_again(self):
        found = self.reproduce("--budget", "lite", "--out", "r", "--keep", "--jobs", 2)
        self.assertEqual(found["trials"], {"one": {"done": 6, "all": 6}})
        helps, beats = found["claims"]
        self.assertEqual([f["metric"] for f in helps["findings"]], ["mpjpe", "pa_mpjpe"])
        self.assertEqual({f["n"] for f in helps["findings"]}, {3})
        for f in helps["findings"]:
            self.assertEqual(f["verdict"], "holds" if f["high"] < 0 else "does not hold" if f["low"] > 0 else "cannot be told")
        self.assertEqual(beats["verdict"], "not run")
        page, table = self.text("r/somebody2024.md"), self.text("r/somebody2024/one.md")
        for part in ("training helps", "not run", "(somebody2024/one.md)", "(../experiments/one/README.md)", "6 done"):
            self.assertIn(part, page)
        for part in ("training helps", "ours (paper)", "theirs is not run: it is nobody's", "| **trained**", "Tiny.", "foot slide",
                     "(../../experiments/one/README.md)", "(../somebody2024.md)", "restage sweep run experiments/one/sweep.yaml"):
            self.assertIn(part, table)
        self.assertEqual(sorted(os.listdir(self.path("r/somebody2024"))), ["one.csv", "one.md", "one.svg", "one.tex"])
        kept = sorted(n for n in os.listdir(self.path("experiments/one/results")) if n != "references")
        self.assertEqual((len(kept), kept[-1]), (7, "lite.json"))
        self.assertNotIn("host", self.text("experiments/one/results/" + kept[0]))
        # Six trials measured the same references: true joints, whatever was trained.
        shared = os.listdir(self.path("experiments/one/results/references"))
        named = {n for name in kept[:-1] for s in self.result("experiments/one/results/" + name)["metrics"].values()
                 for n in s["references"].values()}
        self.assertEqual({n[:-5] for n in shared}, named)
        self.assertLess(len(named), 6)

        before = {name: self.bytes("r/one/trials/%s/result.json" % name[:-5]) for name in kept[:-1]}
        self.assertEqual(self.reproduce("--budget", "lite", "--out", "r"), found)
        self.assertEqual(before, {name: self.bytes("r/one/trials/%s/result.json" % name[:-5]) for name in kept[:-1]}, "nothing is done twice")

        # What is committed is as good as what was run: planned, but not made again; and without any planning.
        self.assertEqual(self.reproduce("--budget", "lite", "--out", "again"), found)
        self.assertFalse(os.path.exists(self.path("again/store")))
        for name in kept[:-1]:
            ran, taken = (self.result("%s/one/trials/%s/result.json" % (folder, name[:-5])) for folder in ("r", "again"))
            self.assertEqual({k: v for k, v in ran.items() if k not in ("host", "command")}, taken, "every digit is there")
        os.remove(self.path("tiny.yaml"))
        self.assertEqual(self.reproduce("--budget", "lite", "--out", "page/work", "--page", "page", "--no-run"), found)
        self.assertEqual(self.text("page/somebody2024/one.md"), table)
        head = lambda text: text[:text.index("Made by")]
        self.assertEqual(head(self.text("page/somebody2024.md")), head(page))
        self.reproduce("--budget", "lite", "--out", os.path.abspath(self.path("page/far")), "--page", "page", "--no-run")
        self.assertIn("--out runs/far ", self.text("page/somebody2024.md"))

    @needs_data("body/makehuman.h5")
    def test_pictures(self):
        self.done("data", "build", os.path.join(ROOT, "configs", "data", "small_benchmark.yaml"), "out=small", "data=" + DATA)
        sequence = os.listdir(self.path("small/scans"))[0]
        pictures = ("pictures:\n  - {says: Two moments, set: scans, sequence: %s, rows: [trained, untrained], moments: [0.1, 0.3]}\n"
                    "  - {says: The worst, set: naked, worst: 1, rows: [trained]}\n" % sequence)
        own = PAPER.replace("lite: {set: true_skeletons", "lite: {words: ['seeds=[2, 1]', evaluate.benchmark=small, 'evaluate.sets=[naked]']")
        self.write("experiments/one/paper.yaml", own + pictures)
        lite = os.path.join(ROOT, "experiments", "weights", "lite.safetensors")
        self.write("experiments/one/sweep.yaml", SWEEP.replace("{stages: [motion]}", "{skeleton.from: %s, deformation.from: %s}" % (lite, lite)))
        self.reproduce("--budget", "lite", "--out", "r", "--keep")
        shapes = []
        for number in (1, 2):
            name = "r/somebody2024/one-%d.jpg" % number
            self.assertIn("(one-%d.jpg)" % number, self.text("r/somebody2024/one.md"))
            shapes.append(jpeg_size(self.bytes(name)))
        # Lines of cells: source, rows, truth; columns: moments.
        self.assertAlmostEqual(shapes[0][0] / shapes[1][0], 4 / 3, 1)
        self.assertAlmostEqual(shapes[0][1] / shapes[1][1], 2 / 6, 1)
        self.assertIn("The worst: " + os.listdir(self.path("small/naked"))[0], self.text("r/somebody2024/one.md"))
        # The lowest seed's; the same bytes again; from results without weights the picture stays as it is.
        first = [self.bytes("r/somebody2024/one-%d.jpg" % n) for n in (1, 2)]
        self.reproduce("--budget", "lite", "--out", "r")
        self.assertEqual([self.bytes("r/somebody2024/one-%d.jpg" % n) for n in (1, 2)], first)
        shutil.rmtree(self.path("r/store"))
        self.write("r/somebody2024/one-1.jpg", "kept")
        os.remove(self.path("r/somebody2024/one-2.jpg"))
        self.reproduce("--budget", "lite", "--out", "r", "--no-run")
        self.assertEqual(self.bytes("r/somebody2024/one-1.jpg"), b"kept")
        self.assertIn("one-1.jpg", self.text("r/somebody2024/one.md"))
        self.assertNotIn("one-2.jpg", self.text("r/somebody2024/one.md"))
        # Bad recipes.
        for change, *contains in ((("rows: [trained]", "rows: [traind]"), "traind", "trained"), (("worst: 1, ", ""), "'worst'"),
                                  (("set: scans", "set: scan"), "scan"), (("rows: [trained]", "rows: []"), "'rows' is empty")):
            self.write("experiments/one/paper.yaml", own + pictures.replace(*change))
            self.bad_input(["reproduce", "somebody2024", "--experiments", "experiments", "--budget", "lite", "--out", "r"], "paper.yaml:", *contains)

    def test_too_few_seeds_tell_nothing_and_words_make_other_trials(self):
        found = self.reproduce("--budget", "smoke", "--out", "r")
        self.assertEqual(found["claims"][0]["verdict"], "cannot be told at smoke")
        self.assertEqual(found["claims"][0]["too_short"], [], "trained to its end, as the kept curve shows")
        self.assertEqual({f["verdict"] for f in found["claims"][0]["findings"]}, {"cannot be told"})
        self.assertEqual(found["trials"]["one"]["all"], 2)
        short = self.reproduce("--budget", "smoke", "--out", "short", "loop.validate_every=1000")["claims"][0]
        self.assertEqual((short["verdict"], short["so_far"]), ("not trained far enough", "cannot be told"))
        self.assertIn("and needs 5", short["too_short"][0])
        more = self.reproduce("--budget", "smoke", "--out", "r", "seeds=1,2,3")
        self.assertEqual(more["trials"]["one"], {"done": 6, "all": 6})
        self.assertEqual(self.text("r/somebody2024/one.md").count("* theirs is not run"), 1)

    def test_nothing_was_run(self):
        found = self.reproduce("--budget", "lite", "--out", "r", "--no-run")
        self.assertEqual({c["verdict"] for c in found["claims"]}, {"not run"})
        self.assertEqual(found["trials"]["one"]["done"], 0)

    def test_bad_input(self):
        how = ["--budget", "smoke", "--out", "r", "--experiments", "experiments"]
        self.bad_input(["reproduce", "somebody2023", *how], "somebody2023", "somebody2024")
        self.bad_input(["reproduce", "somebody2024", "--table", "7", *how], "'7'", "there are 1")
        self.bad_input(["reproduce", "somebody2024", "--budget", "big", "--out", "r"], "big")
        self.bad_input(["reproduce", "somebody2024", *how, "--jobs", "0"], "--jobs 0")
        self.bad_input(["reproduce", "somebody2024", *how, "seeds"], "'seeds'")
        self.bad_input(["reproduce", "somebody2024", *how, "--no-run", "seeds=1"], "'seeds=1'")
        self.bad_input(["reproduce", "somebody2024", *how[:4], "--experiments", "nowhere"], "nowhere", "--experiments")
        self.bad_input(["reproduce", "somebody2024", *how, "motion.windos.frames=5"], "windos")
        self.write("experiments/one/paper.yaml", PAPER.replace("row: trained", "row: traind"))
        self.bad_input(["reproduce", "somebody2024", *how], "paper.yaml:", "traind")
        os.remove(self.path("experiments/one/sweep.yaml"))
        self.write("experiments/one/paper.yaml", PAPER)
        self.bad_input(["reproduce", "somebody2024", *how], "sweep.yaml")
        self.assertFalse(os.path.exists(self.path("r/somebody2024.md")))


class OurFolders(CliTest):
    """Every experiment of the repository can be read, and its page made of what is committed."""

    def test_pages(self):
        for name in ("experiments", "configs"):
            os.symlink(os.path.join(ROOT, name), self.path(name))
        committed = os.path.join(ROOT, "docs", "reproduction")
        for paper in ("rekik2024", "marsot2023", "chen2023"):
            found = self.json("reproduce", paper, "--budget", "lite", "--out", "r", "--no-run", "--quiet")
            self.assertGreater(len(found["claims"]), 0)
            page = self.bytes("r/%s.md" % paper).decode()
            self.assertTrue(page.startswith("# %s, run again\n\nClaims: " % paper))
            self.assertEqual(len(set(re.findall(r"\(%s/(\w+\.md)\)" % paper, page))), len(found["trials"]))
            same = lambda text: re.sub("[ -]+", " ", re.sub(r"\([^)]*/experiments/", "(experiments/", text.split("## ")[0]))
            with open(os.path.join(committed, paper + ".md"), encoding="utf-8") as file:
                self.assertEqual(same(page), same(file.read()), "the committed page is that of the committed results")
            bones = [claim["verdict"] for claim in found["claims"] if "bone length preservation" in claim["says"]]
            self.assertEqual(bones, ["not trained far enough"] if paper == "marsot2023" else [], "no curve was kept")

    def test_what_the_papers_budget_means(self):
        """Without any data; tests/experiments/schedule_test.cpp compares it with what is printed."""
        found = self.json("reproduce", "chen2023", "--table", "1", "--budget", "paper", "--plan", "--quiet")
        lart = next(row for row in found["rows"] if row["row"] == "LART")
        self.assertEqual((lart["stage"], lart["model"], lart["steps"], lart["batch"], lart["rate"], lart["hours"]),
                         ("transfer", "transfer/lart", 200000, 2, 5e-5, None))
        rows = self.json("reproduce", "rekik2024", "--table", "4.4-extractor", "--budget", "smoke", "--plan", "--quiet")["rows"]
        self.assertEqual(len(rows), 3)
        self.assertTrue(all(row["hours"] is not None for row in rows), "also of networks that need two examples")
        self.bad_input(["reproduce", "chen2023", "--budget", "lite", "--plan", "data.source=none.h5"], "none.h5", "not there")
        # With data, hours: of a step of two examples, as many times as there are examples.
        self.write("experiments/one/paper.yaml", PAPER)
        self.write("experiments/one/sweep.yaml", SWEEP)
        self.write("tiny.yaml", BASE)
        rows = self.json("reproduce", "somebody2024", "--budget", "lite", "--plan", "--experiments", "experiments")["rows"]
        self.assertEqual({(row["row"], row["stage"], row["batch"]) for row in rows}, {("trained", "motion", 4), ("untrained", "motion", 4)})
        for row in rows:
            self.assertTrue(0 <= row["hours"] < 0.1, row)
        self.assertIn("hours", self.done("reproduce", "somebody2024", "--budget", "lite", "--plan", "--experiments", "experiments"))

    def test_claims_by_the_papers_own_figures(self):
        for paper in ("rekik2024", "marsot2023", "chen2023"):
            found = self.json("reproduce", paper, "--printed")
            self.assertEqual({claim["verdict"] for claim in found["claims"]}, {"holds"}, found["claims"])
        self.write("experiments/one/paper.yaml", PAPER.replace("claims:", "contradicted: [no wonder]\nclaims:"))
        self.write("experiments/one/sweep.yaml", SWEEP)
        found = self.json("reproduce", "somebody2024", "--printed", "--experiments", "experiments")
        self.assertEqual(found["contradicted"], ["no wonder"])
        for words, *contains in ((["--printed", "--plan"], "two questions"), (["--printed", "--budget", "lite"], "--budget has no effect beside --printed"),
                                 (["--plan"], "--budget is missing"), (["--budget", "lite"], "--out is missing"),
                                 (["--plan", "--budget", "lite", "--out", "r"], "--out has no effect beside --plan"),
                                 (["--printed", "--jobs", "2"], "--jobs has no effect"), (["--printed", "--seed", "3"], "--seed has no effect"),
                                 (["--printed", "seeds=1"], "WORDS has no effect")):
            self.bad_input(["reproduce", "somebody2024", "--experiments", "experiments", *words], *contains)

    def test_codecheck_names_every_table(self):
        """The manifest names each page and each table of the papers and of ours, in every form, and only files that are there."""
        with open(os.path.join(ROOT, "docs", "reproduction", "codecheck.yml"), encoding="utf-8") as file:
            named = {n for n in re.findall(r"- file: (\S+)", file.read()) if n.startswith("docs/reproduction/")}
        there = {os.path.relpath(f, ROOT) for paper in ("rekik2024", "marsot2023", "chen2023", "ours")
                 for ending in (".md", "/*.md", "/*.csv", "/*.svg", "/*.tex")
                 for f in glob.glob(os.path.join(ROOT, "docs", "reproduction", paper + ending))}
        self.assertEqual(named, there)

    def test_what_is_committed_is_light_and_whole(self):
        """At most 9 MB of results and pages; every reference of a result is there, and none that no result names."""
        files = [f for part in ("experiments/**/results/**", "docs/reproduction/**")
                 for f in glob.glob(os.path.join(ROOT, part), recursive=True) if os.path.isfile(f)]
        self.assertGreater(len(files), 100)
        self.assertLess(sum(map(os.path.getsize, files)), 9e6, "committed results and pictures; see experiments/reproduce/evidence.h")
        for folder in glob.glob(os.path.join(ROOT, "experiments", "studies", "*", "results")):
            named = set()
            for name in glob.glob(os.path.join(folder, "*.json")):
                with open(name, encoding="utf-8") as file:
                    named |= {n for s in json.load(file).get("metrics", {}).values() for n in s.get("references", {}).values()}
            self.assertEqual(named, {os.path.basename(n)[:-5] for n in glob.glob(os.path.join(folder, "references", "*"))}, folder)
