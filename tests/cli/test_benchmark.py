"""restage data build RECIPE, verify FOLDER, sheet, realism and fetch."""
import gzip
import hashlib
import json
import os
import shutil
import tarfile

from support import DATA, ROOT, CliTest, needs_data

RECIPE = os.path.join(ROOT, "configs", "data", "open_benchmark.yaml")
SMALL = ["train.bodies=[b000, b001]", 'train.clips=["13_11", "13_33"]', "validation.bodies=[b120]", 'validation.clips=["08_01"]',
         "test.bodies=[b140]", 'test.clips=["02_03"]',
         'motions=[{id: walking, clip: "02_01", frames: 20}, {id: throw, clip: "06_15", first: 60, frames: 20}]',
         "naked=[{source: male, target: female, motions: [walking]}]", "clothed=[{source: male, target: short_long, motions: [throw]}]",
         "scans=[{scanner: depth, motion: throw, source: worker, target: female, intruder: male}]"]


class Recipes(CliTest):
    """Wrong recipes, before any data is looked at."""

    def build(self, *arguments):
        return ["data", "build", *arguments, "out=out", "data=nowhere"]

    def test_bad_usage(self):
        self.bad_input(["data", "build"], "--out")
        self.bad_input(["data", "build", RECIPE], "place to write to")
        self.bad_input(["data", "build", "out=x", "data=y"], "no recipe")
        self.bad_input(self.build("none.yaml"), "none.yaml")
        self.bad_input(self.build(RECIPE, RECIPE), "two recipes")
        self.bad_input(self.build(RECIPE), "nowhere")

    def test_hostile_recipes(self):
        cases = {"boddies: [b000]\n": "boddies",
                 "train: {bodies: 3}\n": "train.bodies",
                 "train: [1, 2]\n": "train",
                 "seed: -1\n": "seed",
                 "seed: [[[\n": "r.yaml",
                 "characters: [{shape: {weight: 1}}]\n": "id",
                 "characters: [{id: a, shape: {weight: 2}}]\n": "weight",
                 "characters: [{id: '../../a'}]\n": "r.yaml: '../../a' cannot be the id",
                 "scanners: [{id: a, pixels: 100000000}]\n": "pixels",
                 "scanners: [{id: a, cameras: 0}]\n": "cameras",
                 "scanners: [{id: a, heights: []}]\n": "heights",
                 "scanners: [{id: a, noise: {dropout: .nan}}]\n": "dropout",
                 "motions: [{id: a, clip: x, frames: 1e300}]\n": "frames",
                 "naked: [{source: a, target: b}]\n": "no character 'a'",
                 "train: {bodies: [a]}\ntest: {bodies: [a]}\n": "'a' is in train and in test",
                 "include: r.yaml\n": "r.yaml",
                 "a: &a [*a]\n": "r.yaml",
                 "\x00\xff": "r.yaml",
                 "x" * 2000000: "r.yaml"}
        for text, words in cases.items():
            with self.subTest(text[:60]):
                self.write("r.yaml", text.encode("latin-1"))
                self.bad_input(self.build("r.yaml"), words)

    def test_recipes_that_contradict_themselves(self):
        two = "characters=[{id: a, body: b1}, {id: b}]"
        walk = "motions=[{id: walk, clip: x}]"
        pair = "{source: a, target: b}"
        scan = "{scanner: rig, motion: walk, source: a, target: b}"
        self.write("empty.yaml", "")
        bad = lambda word, *more: self.bad_input(self.build("empty.yaml", *more), word)
        bad("makes nothing")
        bad("makes nothing", two, "naked=[%s]" % pair)
        bad("'naked/walk-a-b' is listed twice", two, walk, "naked=[%s, {source: a, target: b, motions: [walk]}]" % pair)
        bad("'scans/walk-a-b-rig' is listed twice", two, walk, "scanners=[{id: rig}]", "scans=[%s, %s, intruder: b}]" % (scan, scan[:-1]))
        bad("listed twice in train", "train.clips=[x, x]")
        bad("in train and in test", "train.clips=[x]", "test.clips=[x]")
        bad("both a body and a shape", "characters=[{id: a, body: b1, shape: {age: 1}}]", "train.clips=[x]")
        bad("--bodies", "train.clips=[x]", "--bodies", 3, 3, 3)
        bad("out= is given twice", "train.clips=[x]", "--out", "there")
        self.write("bytes.yaml", b'protocol: "\xff\xfe"\ntrain: {clips: [x]}\n')
        self.bad_input(self.build("bytes.yaml"), "bytes.yaml:1", "UTF-8")

    def test_verify_and_sheet_want_their_folders(self):
        os.makedirs(self.path("empty"))
        self.bad_input(["data", "verify", "empty"], "manifest.json")
        self.bad_input(["data", "sheet", "empty", "--out", "x.png"], "no sequences")
        self.bad_input(["data", "sheet", "empty", "--out", "x.txt"], ".png")
        self.bad_input(["data", "realism", "none.h5"], "none.h5")


@needs_data("body/makehuman.h5")
class Benchmark(CliTest):
    def build(self, out, *more):
        return ["data", "build", RECIPE, "out=" + out, "data=" + DATA, *SMALL, *more]

    def test_the_data_folder_is_found(self):
        os.symlink(DATA, self.path("data"))
        command = [a for a in self.build("one") if not a.startswith("data=")]
        self.assertEqual(self.json(*command)["data"], "data")
        self.bad_input(command + ["train.bodies=[nobody]"], "no body 'nobody'")

    def test_places_that_cannot_be_taken_and_scanners_that_see_nobody(self):
        bad = lambda *more: self.bad_input(self.build("one", *more), "sees 0 points")
        bad("scanners=[{id: depth, pixels: 16, margin: 50}]")
        bad("scanners=[{id: depth, noise: {dropout: 1}}]")
        os.makedirs(self.path("empty"))
        os.symlink("empty", self.path("link"))
        self.bad_input(self.build("."), "is there already")
        os.remove(self.path("link"))
        os.rmdir(self.path("empty"))
        os.makedirs(self.path("apart/empty"))
        os.symlink("apart/empty", self.path("link"))
        self.done(*self.build("link", "naked=[]", "clothed=[]", "scans=[]"))
        self.assertTrue(os.path.islink(self.path("link")))
        self.assertEqual(self.json("data", "verify", "link")["problems"], [])

    def test_the_small_recipe(self):
        self.done("data", "build", os.path.join(ROOT, "configs", "data", "small_benchmark.yaml"), "out=small", "data=" + DATA)
        self.assertEqual(self.json("data", "verify", "small")["problems"], [])
        self.assertEqual(sorted(os.listdir(self.path("small"))), ["clothed", "manifest.json", "naked", "recipe.yaml", "scans",
                                                                  "test.h5", "train.h5", "validation.h5"])
        size = sum(os.path.getsize(os.path.join(at, name)) for at, _, names in os.walk(self.path("small")) for name in names)
        self.assertLess(size, 20e6)

    def recorded(self, figures, names):
        """Of figures with all variants, or of several such, those that a trial holds."""
        if "mpjpe" in figures:
            return {name: figures[name] for name in names}
        return {key: self.recorded(value, names) for key, value in figures.items()}

    def test_a_sweep_measures_as_the_commands_do(self):
        self.done("data", "build", os.path.join(ROOT, "configs", "data", "small_benchmark.yaml"), "out=small", "data=" + DATA)
        lite = os.path.join(ROOT, "experiments", "weights", "lite.safetensors")
        self.write("base.yaml", "".join("%s: {from: %s}\n" % (s, lite) for s in ("skeleton", "motion", "deformation"))
                   + "evaluation: {steady_bones: true, keep_limbs: true}\n")
        self.write("sweep.yaml", "base: base.yaml\nevaluate: {benchmark: small, sets: [naked, scans]}\n")
        self.done("sweep", "run", "sweep.yaml", "--out", "d")
        trial = os.listdir(self.path("d/trials"))[0]
        found = json.loads(self.bytes("d/trials/%s/result.json" % trial))["metrics"]
        for name, mended in (("naked", []), ("scans", ["--mended", "mended.h5"])):
            folder = "small/%s/%s" % (name, found[name]["sequences"][0]["name"])
            source, truth = folder + "/source.h5", folder + "/truth.h5"
            if mended:
                self.restage("doctor", source, "--fix", "mended.h5")  # exit code 1: not all can be mended
            self.done("retarget", "--source", "mended.h5" if mended else source, "--target", folder + "/target.ply", "--weights", lite,
                      "--out", name + ".h5")
            judged = self.json("eval", "--pred", name + ".h5", "--truth", truth, "--source", source, "--rest", folder + "/rest.h5", "--variants", *mended)
            judged = {k: self.recorded(v, found[name]["mean"]) for k, v in judged.items() if k in ("mean", "references")}
            self.assertEqual(found[name]["mean"], judged["mean"])
            references = {n: r["mean"] for n, r in found[name]["references"].items()}
            self.assertEqual(references, judged["references"])
            self.assertEqual(len(found[name]["joints"]), 22)
            self.assertAlmostEqual(sum(found[name]["joints"].values()) / 22, judged["mean"]["pa_mpjpe"], 12)
        # "Register then repose" is a system like any other.
        self.write("sweep.yaml", "base: base.yaml\nset: {stages: [], evaluation.system: register, evaluation.every: 5}\n"
                   "evaluate: {benchmark: small, sets: [naked]}\n")
        self.done("sweep", "run", "sweep.yaml", "--out", "r")
        trial = os.listdir(self.path("r/trials"))[0]
        found = json.loads(self.bytes("r/trials/%s/result.json" % trial))["metrics"]
        folder = "small/naked/" + found["naked"]["sequences"][0]["name"]
        self.done("retarget", "--source", folder + "/source.h5", "--target", folder + "/target.ply", "--system", "register", "--rest",
                  folder + "/rest.h5", "--every", "5", "--out", "r.h5")
        judged = self.json("eval", "--pred", "r.h5", "--truth", folder + "/truth.h5", "--every", "5", "--variants")["mean"]
        self.assertEqual(found["naked"]["mean"], self.recorded(judged, found["naked"]["mean"]))
        # Motions of the training onto bodies of the test.
        self.write("sweep.yaml", "base: base.yaml\nevaluate: {benchmark: small, sets: [seen]}\n")
        self.done("sweep", "run", "sweep.yaml", "--out", "seen")
        trial = os.listdir(self.path("seen/trials"))[0]
        found = json.loads(self.bytes("seen/trials/%s/result.json" % trial))["metrics"]["seen"]
        self.assertGreater(len(found["sequences"]), 0)
        self.assertGreater(found["mean"]["mpjpe"], 0)
        # One test body has nobody to retarget to; it was a division by zero.
        self.write("sweep.yaml", "base: base.yaml\nevaluate: {benchmark: small, sets: [test]}\n")
        failed = self.restage("sweep", "run", "sweep.yaml", "--out", "alone")
        self.assertEqual(failed.code, 1)
        self.assertIn("one body in its test split", failed.err)

    def test_build_verify_and_use(self):
        made = self.json(*self.build("one", "--threads", 1))
        self.assertEqual(made["files"], 3 + 2 + 3 * 4)
        self.assertEqual(made["seed"], 0)
        self.done(*self.build("two", "--threads", 2))
        self.assertEqual(self.bytes("one/manifest.json"), self.bytes("two/manifest.json"))
        self.assertEqual(self.json("data", "verify", "one")["problems"], [])
        # The recipe that is kept makes the same again.
        self.done("data", "build", "one/recipe.yaml", "out=three", "data=" + DATA)
        self.assertEqual(self.bytes("one/manifest.json"), self.bytes("three/manifest.json"))
        # Source, truth and rest fit what eval wants.
        pair = "one/naked/walking-male-female/"
        scores = self.json("eval", "--pred", pair + "truth.h5", "--truth", pair + "truth.h5", "--source", pair + "source.h5",
                           "--rest", pair + "rest.h5")
        self.assertEqual(scores["mean"]["mpjpe"], 0)
        self.assertGreater(scores["references"]["rest_pose"]["mpjpe"], scores["references"]["closed_form"]["mpjpe"])
        self.done("data", "sheet", "one/scans", "--out", "scans.png")
        self.done("data", "sheet", "one/test.h5", "--out", "test.png")
        self.assertEqual(self.bytes("test.png")[:4], b"\x89PNG")
        found = self.json("data", "realism", "one/test.h5")
        self.assertGreater(found["joints_inside"]["posed"], 0.95)
        self.assertGreater(found["knee_volume"]["mean"]["surface"], found["knee_volume"]["mean"]["linear_blend"])

    def test_verify_finds_differences(self):
        self.done(*self.build("one", "naked=[]", "clothed=[]", "scans=[]"))
        with open(self.path("one/test.h5"), "r+b") as f:
            f.seek(5000)
            f.write(b"?")
        self.write("one/stray.txt", "x")
        self.write("one/with\nbreak", "x")
        os.symlink("/etc", self.path("one/elsewhere"))
        result = self.restage("data", "verify", "one")
        self.assertEqual((result.code, result.err), (1, ""))
        self.assertIn("one/test.h5: is not what the manifest says", result.out)
        self.assertIn("one/stray.txt: is not in the manifest", result.out)
        self.assertIn("one/elsewhere: is not in the manifest", result.out)
        self.assertIn("one/with break: is not in the manifest", result.out)
        self.bad_input(self.build("one"), "is there already")


class FetchData(CliTest):
    def listed(self, content, path, address):
        return "%s %d %s %s\n" % (hashlib.sha256(content).hexdigest(), len(content), path, address)

    def test_from_addresses_and_copies(self):
        self.write("origin/x", b"content")
        self.write("list.txt", self.listed(b"content", "body/x", "file://" + self.path("origin/x")))
        self.assertIn("1 files fetched", self.done("data", "fetch", "list.txt", "--out", "data"))
        self.assertEqual(self.bytes("data/body/x"), b"content")
        found = self.json("data", "fetch", "list.txt", "--out", "data")
        self.assertEqual((found["fetched"], found["present"], found["missing"]), (0, 1, []))
        self.done("data", "fetch", "list.txt", "--out", "copy", "--source", "data")
        self.assertEqual(self.bytes("copy/body/x"), b"content")

    def test_failures_say_what_to_do(self):
        self.write("list.txt", self.listed(b"x", "a", "https://localhost:1/a"))
        self.one_line(self.restage("data", "fetch", "list.txt", "--out", "data", "--quiet"), 1, "localhost", "--source FOLDER")
        self.write("list.txt", self.listed(b"x", "a", "-"))
        result = self.restage("data", "fetch", "list.txt", "--out", "data", "--quiet")
        self.assertEqual((result.code, result.err), (1, ""))
        self.assertIn("missing a", result.out)
        self.write("list.txt", "words\n")
        self.bad_input(["data", "fetch", "list.txt", "--out", "other"], "list.txt:1")
        self.bad_input(["data", "fetch", "none.txt", "--out", "other"], "none.txt")
        self.write("list.txt", self.listed(b"x", "a", "-"))
        self.bad_input(["data", "fetch", "list.txt", "--out", "other", "--source", "nowhere"], "nowhere")

    def test_what_is_wrong_is_told_before_anything_is_fetched(self):
        good = self.listed(b"x", "a", "-")
        self.write("copy/a", b"x")
        self.write("copy/b", b"?")
        self.write("own.csv", b"?")
        for wrong in (self.listed(b"y", "b", "-"), self.listed(b"y", "b", "makehuman:parts.txt"), self.listed(b"y", "b", "cmu:clips.txt"),
                      self.listed(b"y", "c", "own.csv"), self.listed(b"y", "c", "makehuman:nope.txt"), self.listed(b"y", "c", "cmu:nope.txt"),
                      self.listed(b"y", "c", "http://localhost/c")):
            self.write("parts.txt", self.listed(b"z", "d", "https://localhost:1/d"))
            self.write("clips.txt", "@one https://localhost:1/tree https://localhost:1/files\n" + "0" * 64 +
                       " 01_01a 01_01.bvh - 4 0 40 0 01 train walk\n")
            self.write("list.txt", good + wrong)
            self.bad_input(["data", "fetch", "list.txt", "--out", "data", "--source", "copy"])
        self.bad_input(["data", "fetch", "--out", "data"], "open_data.txt", "LIST")

    @needs_data("body/targets_original.tar.xz")
    def test_bodies_from_the_published_files_are_those_of_the_copy(self):
        originals = self.path("originals/body/makehuman")
        with tarfile.open(os.path.join(DATA, "body", "targets_original.tar.xz")) as targets:
            targets.extractall(originals)
        for name in ("base.obj", "rigs/game_engine.mhskel", "rigs/weights.game_engine.json"):
            with gzip.open(os.path.join(DATA, "body", name + ".gz")) as packed:
                self.write("originals/body/makehuman/" + os.path.basename(name), packed.read())
        listed = os.path.join(ROOT, "configs", "data", "open_data.txt")
        result = self.restage("data", "fetch", listed, "--out", "data", "--source", "originals")
        self.assertEqual(result.code, 1)  # motions and garments are not there
        self.assertNotIn("missing body/makehuman.h5", result.out)
        os.makedirs(self.path("copy/body"))
        for name in ("makehuman.h5", "bodies.csv"):
            shutil.copy(os.path.join(DATA, "body", name), self.path("copy/body/" + name))
        for folder in ("data", "copy"):
            os.rename(self.path(folder), self.path("source"))
            self.done("data", "import", "source", "--out", folder + ".h5")
            os.rename(self.path("source"), self.path(folder))
        self.assertEqual(self.bytes("data.h5"), self.bytes("copy.h5"))

    @needs_data("body/makehuman.h5")
    def test_the_projects_list_and_a_copy(self):
        found = self.json("data", "fetch", os.path.join(ROOT, "configs", "data", "open_data.txt"), "--out", "data", "--source", DATA)
        self.assertEqual(found["missing"], [])
        self.assertTrue(os.path.exists(self.path("data/cmu/clips30.h5")))
