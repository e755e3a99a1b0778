"""restage benchmark: answers of any program as a row of the open benchmark's table, and rows as a page."""
import glob
import json
import os
import shutil
import subprocess
import sys

from support import DATA, PROGRAM, ROOT, CliTest, needs_data, numbers

SMALL = os.path.join(ROOT, "configs", "data", "small_benchmark.yaml")


def trials(study):
    return sorted(glob.glob(os.path.join(ROOT, "experiments", "studies", study, "trials", "*", "result.json")))


@needs_data("body/makehuman.h5")
class Score(CliTest):
    @classmethod
    def setUpClass(cls):
        cls.made = CliTest()
        cls.made.setUp()
        cls.made.done("data", "build", SMALL, "out=small", "data=" + DATA, "test.bodies=[b143, b144]")

    @classmethod
    def tearDownClass(cls):
        cls.made.doCleanups()

    def setUp(self):
        super().setUp()
        os.symlink(self.made.path("small"), self.path("small"))

    def names(self, name):
        return sorted(os.listdir(self.path("small/" + name)))

    def true_answers(self, folder, sets=("naked", "clothed", "scans")):
        for name in sets:
            os.makedirs(self.path(folder + "/" + name))
            for sequence in self.names(name):
                shutil.copy(self.path("small/%s/%s/truth.h5" % (name, sequence)), self.path("%s/%s/%s.h5" % (folder, name, sequence)))

    def score(self, *words, sets="naked,clothed,scans"):
        return ["benchmark", "score", *words, "--benchmark", "small", "--sets", sets]

    def test_the_truth_has_no_error_and_the_row_says_where_it_is_from(self):
        self.true_answers("one")
        self.true_answers("two")
        done = self.json(*self.score("one", "two"), "--seeds", "3,7", "--method", "The truth", "--told", "everything", "--date", "2026-02-28",
                         "--note", "https://example.org", "--row", "row.json", "--out", "table.tex", "--quiet")
        row = json.loads(self.bytes("row.json"))
        self.assertEqual(done["row"], row)
        self.assertEqual((row["method"], row["told"], row["date"], row["note"]), ("The truth", "everything", "2026-02-28", "https://example.org"))
        self.assertEqual(row["restage"], self.json("--version")["version"])
        self.assertEqual(row["benchmark"]["protocol"], "small-benchmark-1")
        self.assertEqual(len(row["benchmark"]["sha256"]), 64)
        self.assertEqual([trial["seed"] for trial in row["trials"]], [3, 7])
        for trial in row["trials"]:
            for name in ("naked", "clothed", "scans"):
                self.assertEqual([s["name"] for s in trial["metrics"][name]["sequences"]], self.names(name))
                self.assertEqual(trial["metrics"][name]["mean"]["mpjpe"], 0)
        self.assertIn("references", row["trials"][0]["metrics"]["naked"])
        self.assertNotIn("references", row["trials"][1]["metrics"]["naked"])
        labels = [r["label"] for r in done["table"]["references"]]
        self.assertEqual(sorted(labels), ["closed form", "rest pose", "source unchanged"])
        self.assertEqual(done["table"]["against"], "source unchanged")
        self.assertIn("\\toprule", self.bytes("table.tex").decode())
        self.assertIn("label,case", self.done(*self.score("one", sets="naked"), "--format", "csv", "--quiet"))
        tex = subprocess.run([PROGRAM, *self.score("one", sets="naked"), "--format", "tex"], cwd=self.folder, capture_output=True, text=True)
        self.assertIn("\\toprule", tex.stdout)
        page = self.done("benchmark", "leaderboard", "row.json")
        self.assertIn("The truth", page)
        self.assertIn(row["benchmark"]["sha256"][:12], page)

    def test_figures_are_those_of_eval(self):
        """Of an answer to scans as well, which is in the doctor's frame."""
        for name, mended in (("naked", []), ("scans", ["--mended", "a/scans/%s.mended.h5" % self.names("scans")[0]])):
            folder = "small/%s/%s" % (name, self.names(name)[0])
            os.makedirs(self.path("a/" + name))
            source = folder + "/source.h5"
            if mended:
                self.restage("doctor", source, "--fix", mended[1])  # exit code 1: not all can be mended
                source = mended[1]
            answer = "a/%s/%s.h5" % (name, self.names(name)[0])
            self.done("retarget", "--source", source, "--target", folder + "/target.ply", "--weights",
                      os.path.join(ROOT, "experiments", "weights", "lite.safetensors"), "--out", answer)
            judged = self.json("eval", "--pred", answer, "--truth", folder + "/truth.h5", "--source", folder + "/source.h5", "--rest",
                               folder + "/rest.h5", *mended)
            row = self.json(*self.score("a", sets=name))["row"]["trials"][0]["metrics"][name]
            for metric, value in judged["mean"].items():
                if metric in row["mean"]:
                    self.assertEqual(row["mean"][metric], value, metric)
            self.assertEqual(row["references"]["closed_form"]["mean"]["mpjpe"], judged["references"]["closed_form"]["mpjpe"])

    def test_the_set_that_is_made_when_asked(self):
        self.done("benchmark", "sequences", "small", "--truth", "--out", "made")
        name = os.listdir(self.path("made/test"))[0]
        self.assertEqual(sorted(os.listdir(self.path("made/test/" + name))), ["rest.h5", "source.h5", "target.ply", "truth.h5"])
        os.makedirs(self.path("a/test"))
        shutil.copy(self.path("made/test/%s/truth.h5" % name), self.path("a/test/%s.h5" % name))
        row = self.json(*self.score("a", sets="test"))["row"]["trials"][0]["metrics"]["test"]
        self.assertEqual(([s["name"] for s in row["sequences"]], row["mean"]["mpjpe"]), ([name], 0))
        self.bad_input(["benchmark", "sequences", "small", "--out", "made"], "made/test", "is there already")
        self.done("benchmark", "sequences", "small", "--out", "bare")
        self.assertFalse(os.path.exists(self.path("bare/test/%s/truth.h5" % name)))

    def test_answers_that_are_missing(self):
        self.true_answers("a", ("naked",))
        name = self.names("clothed")[0]
        self.bad_input(self.score("a", sets="naked,clothed"), "a: lacks 1 of 2 answers: clothed/%s.h5" % name, "--refused", "--sets")
        done = self.json(*self.score("a", sets="naked,clothed"), "--refused", "clothed/" + name, "--quiet")["row"]
        self.assertEqual(done["refused"], ["clothed/" + name])
        self.assertIsNone(done["trials"][0]["metrics"]["clothed"]["mean"]["mpjpe"])
        self.bad_input([*self.score("a", sets="naked"), "--refused", "naked/nobody"], "naked/nobody", "no sequence")
        self.bad_input([*self.score("a", sets="naked"), "--refused", "naked/" + self.names("naked")[0]], "--refused")

    def test_answers_that_do_not_fit(self):
        name = self.names("naked")[0]
        os.makedirs(self.path("a/naked"))
        answer = "a/naked/%s.h5" % name
        said = lambda *words: self.bad_input(self.score("a", sets="naked"), name, *words)
        self.h5(answer, joints=([11, 22, 3], 0.5))
        said("has 11 frames", "12")
        self.h5(answer, joints=([12, 21, 3], 0.5))
        said("/joints")
        self.h5(answer, vertices=([12, 7, 3], 0.5))
        said("7 vertices", "target.ply")
        self.h5(answer, points=([12, 3], 0.5))
        said("/joints [F, 22, 3]")
        os.remove(self.path(answer))
        vertices = self.vertices("small/naked/%s/target.ply" % name)
        for frame in range(12):
            self.ply("a/naked/%s/%d.ply" % (name, frame), vertices)
        found = self.json(*self.score("a", sets="naked"), "--quiet")["row"]["trials"][0]["metrics"]["naked"]["mean"]
        self.assertIsNone(found["mpjpe"])
        self.assertGreater(found["pa_mpvd"], 0)
        self.ply("a/naked/%s/5.ply" % name, [(float("nan"), 0, 0), *vertices[1:]])
        said("5.ply")

    def test_joints_of_another_definition_are_converted(self):
        name = self.names("naked")[0]
        os.makedirs(self.path("a/naked"))
        answer, truth = "a/naked/%s.h5" % name, "small/naked/%s/truth.h5" % name
        joints = ([12, 22, 3], numbers(12 * 66, 3))
        self.h5(answer, joints=joints, attributes={"joint_definition": "smpl"})
        wanted = self.json("eval", "--pred", answer, "--truth", truth, "--joints", "makehuman")["mean"]["mpjpe"]
        score = lambda: self.json(*self.score("a", sets="naked"), "--quiet")["row"]["trials"][0]["metrics"]["naked"]["mean"]["mpjpe"]
        self.assertEqual(score(), wanted)
        self.h5(answer, joints=joints)
        self.assertNotEqual(score(), wanted)
        self.h5(answer, joints=joints, attributes={"joint_definition": "mine"})
        self.bad_input(self.score("a", sets="naked"), name, "mine")
        shutil.copy(self.path(truth), self.path(answer))
        self.write("a/naked/%s.mended.h5" % name, b"")
        self.bad_input(self.score("a", sets="naked"), name + ".mended.h5", "in the world already")

    def test_the_benchmark_is_what_its_manifest_says(self):
        os.remove(self.path("small"))
        shutil.copytree(self.made.path("small"), self.path("small"))
        self.true_answers("a", ("naked",))
        place = "small/naked/%s/target.ply" % self.names("naked")[0]
        self.write(place, self.bytes(place)[:-1] + b"?")
        self.bad_input(self.score("a", sets="naked"), place, "manifest.json")
        os.remove(self.path("small/manifest.json"))
        self.bad_input(self.score("a", sets="naked"), "manifest.json")

    def test_wrong_wishes(self):
        self.true_answers("a", ("naked",))
        good = self.score("a", sets="naked")
        self.bad_input(self.score("a", sets="nakid"), "nakid")
        self.bad_input(good[:3], "--benchmark")
        self.bad_input([*good, "--date", "yesterday"], "--date")
        self.bad_input([*good, "--date", "2026-13-01"], "--date")
        self.bad_input([*good, "--seeds", "1,2"], "--seeds")
        self.bad_input([*good, "--row", "r.json"], "--method")
        self.bad_input([*good, "--out", "r.doc"], "r.doc")
        self.bad_input([*good, "--case", "x"], "--case")
        self.bad_input(self.score("nowhere", sets="naked"), "nowhere")
        self.bad_input(self.score("a", "a", sets="naked") + ["--seeds", "1,1"], "--seeds")


class Leaderboard(CliTest):
    def row(self, name="row.json", method="Ours", study="shipped", *more):
        self.done("benchmark", "score", *trials(study), "--method", method, "--row", name, "--quiet", *more)
        return json.loads(self.bytes(name))

    def test_rows_of_a_sweep(self):
        cases = trials("benchmark")
        self.bad_input(["benchmark", "score", *cases], "Restage lite", "--case")
        self.bad_input(["benchmark", "score", *cases, "--case", "nobody"], "nobody")
        self.bad_input(["benchmark", "score", *cases, "--benchmark", "b"], "--benchmark")
        row = self.row("lite.json", "Lite", "benchmark", "--case", "Restage lite")
        self.assertEqual([trial["seed"] for trial in row["trials"]], [1, 2, 3])
        self.assertIsNone(row["restage"])  # nobody recorded it
        with open(trials("shipped")[0]) as file:
            document = json.load(file)["metrics"]
        row = self.row()
        self.assertEqual(row["trials"][0]["metrics"]["naked"]["sequences"], document["naked"]["sequences"])

    def test_the_page(self):
        self.row("lite.json", "Lite | 3", "benchmark", "--case", "Restage lite")
        self.row("ours.json", "Ours", "shipped")
        page = self.done("benchmark", "leaderboard", "lite.json", "ours.json")
        self.assertLess(page.index("| Ours"), page.index("| Lite"))  # the better one on top
        self.assertIn("Lite \\| 3", page)
        self.row("every.json", "Every 30th frame", "benchmark", "--case", "register then repose")
        page = self.done("benchmark", "leaderboard", "lite.json", "every.json")
        differences = page[page.index("## Difference"):page.index("## Where")]
        self.assertIn("Lite", differences)
        self.assertNotIn("Every 30th", differences)  # the references are of all frames
        page = self.done("benchmark", "leaderboard", "lite.json", "ours.json")
        self.done("benchmark", "leaderboard", "ours.json", "lite.json", "--out", "page.md", "--quiet")
        self.assertEqual(self.bytes("page.md").decode(), page)
        self.bad_input(["benchmark", "leaderboard", "ours.json", "ours.json"], "second row of 'Ours'")
        self.bad_input(["benchmark", "leaderboard", "ours.json", "--out", "ours.json"], "ours.json")

    def test_hostile_rows(self):
        row = self.row()
        for change in ({"format": "x"}, {"method": 3}, {"trials": []}, {"trials": [3]}, {"trials": [{"seed": -1, "metrics": {}}]},
                       {"benchmark": []}, {"refused": [1]}, {"trials": [{"seed": 1, "metrics": {"naked": {"mean": {"mpjpe": "x"}}}}]}):
            with self.subTest(change):
                self.write("bad.json", json.dumps({**row, **change}))
                self.bad_input(["benchmark", "leaderboard", "bad.json"], "bad.json")
        self.write("bad.json", "{")
        self.bad_input(["benchmark", "leaderboard", "bad.json"], "no JSON")
        self.bad_input(["benchmark", "leaderboard", "none.json"], "none.json")


class Pages(CliTest):
    """Pages that are made: of the committed rows, and of the program's table of options."""

    def check(self, script):
        done = subprocess.run([sys.executable, os.path.join(ROOT, "docs", script), "--check", PROGRAM], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_the_leaderboard(self):
        self.check("make_leaderboard.py")

    def test_the_commands(self):
        self.check("make_commands.py")
