"""One's own recordings: who moves by a file's path, and who is in training, validation and test."""
import random

from support import CliTest
from test_data import toy_bvh
from tiny_run import CONFIG

SPLITS = ("train", "validation", "test")


class People(CliTest):
    def people(self, frames):
        """A folder of recordings, one list of lengths for each person."""
        for name, lengths in frames.items():
            for i, n in enumerate(lengths):
                self.write("people/%s/take%d.bvh" % (name, i), toy_bvh(n))

    def imported(self):
        self.done("data", "import", "people", "--subjects", "([^/]+)/.*", "--out", "people.h5")
        return self.json("data", "inspect", "people.h5")


class Subjects(People):
    def test_are_named_by_folders_or_files(self):
        self.people({"ann": [5, 5], "bob": [5]})
        self.assertEqual(self.imported()["subjects"], {"ann": 2, "bob": 1})
        self.write("flat/ann-walk.bvh", toy_bvh())
        self.write("flat/bob_run.bvh", toy_bvh())
        self.done("data", "import", "flat", "--subjects", "^([a-z]+)[-_]", "--out", "flat.h5")
        self.assertEqual(self.json("data", "inspect", "flat.h5")["subjects"], {"ann": 1, "bob": 1})

    def test_nobody_is_guessed(self):
        self.people({"ann": [5], "bob": [5]})
        self.write("people/stray.bvh", toy_bvh())
        call = ["data", "import", "people", "--out", "x.h5", "--subjects"]
        self.bad_input(call + ["([^/]+)/.*"], "people", "1 of 3", "stray.bvh")
        self.bad_input(call + ["([^/]+"], "regular expression")
        self.bad_input(call + ["ann"], "group")
        self.bad_input(call + ["(x*)"], "3 of 3")
        self.write("a.ply", "ply")
        self.bad_input(["data", "import", "a.ply", "--subjects", "(.*)", "--out", "x.h5"], "--subjects")


class Split(People):
    def test_nobody_is_in_two_and_the_shares_are_about_right(self):
        r = random.Random(7)
        lengths = {"p%02d" % i: [r.randint(4, 40) for _ in range(r.randint(1, 3))] for i in range(20)}
        self.people(lengths)
        self.imported()
        found = self.json("data", "split", "people.h5", "--out", "data.h5")
        dealt = [name for split in SPLITS for name in found[split]["subjects"]]
        self.assertEqual(sorted(dealt), sorted(lengths))
        whole = sum(found[split]["seconds"] for split in SPLITS)
        for split, share in zip(SPLITS, (0.8, 0.1, 0.1)):
            self.assertAlmostEqual(found[split]["seconds"] / whole, share, delta=0.08, msg=split)
        inspected = self.json("data", "inspect", "data.h5")
        self.assertEqual({s: c["motions"] for s, c in inspected["splits"].items()},
                         {s: sum(len(lengths[n]) for n in found[s]["subjects"]) for s in SPLITS})
        self.assertEqual(self.json("data", "verify", "data.h5")["problems"], [])
        again = self.json("data", "split", "people.h5", "--out", "data.h5")
        self.assertEqual(again, found)
        other = self.json("data", "split", "people.h5", "--seed", 1, "--out", "other.h5")
        self.assertNotEqual([other[s]["subjects"] for s in SPLITS], [found[s]["subjects"] for s in SPLITS])
        text = self.done("data", "split", "people.h5", "--shares", "0.5,0,0.5", "--out", "data.h5")
        self.assertRegex(text, r"\| validation \| +0 \| +0: - \|")

    def test_bodies_are_dealt_and_go_with_their_people(self):
        self.done("data", "build", "--bodies", 6, 0, 0, "--motions", 0, 0, 0, "--out", "bodies.h5")
        found = self.json("data", "split", "bodies.h5", "--out", "split.h5")
        self.assertEqual([len(found[s]["bodies"]) for s in SPLITS], [4, 1, 1])
        bodies = sorted(name for s in SPLITS for name in found[s]["bodies"])
        self.people({name: [30] for name in bodies[:3]} | {"zoe": [30], "yan": [30]})
        self.imported()
        self.done("data", "merge", "bodies.h5", "people.h5", "--out", "all.h5")
        for seed in range(4):
            found = self.json("data", "split", "all.h5", "--seed", seed, "--shares", "0.4,0.3,0.3", "--out", "split.h5")
            for split in SPLITS:
                own = [name for name in found[split]["subjects"] if name in bodies]
                self.assertLessEqual(set(own), set(found[split]["bodies"]), split)
            self.assertEqual(sorted(name for s in SPLITS for name in found[s]["bodies"]), bodies)

    def test_some_people_and_bodies_that_stay_where_they_are(self):
        self.done("data", "build", "--bodies", 4, 2, 2, "--motions", 0, 0, 0, "--out", "bodies.h5")
        where = {s: c["bodies"] for s, c in self.json("data", "inspect", "bodies.h5")["splits"].items()}
        self.people({name: [10] for name in ("ann", "bob", "eve", "zoe")})
        self.imported()
        self.done("data", "merge", "bodies.h5", "people.h5", "--out", "all.h5")
        found = self.json("data", "split", "all.h5", "--only", "ann,bob,eve", "--bodies", "all.h5", "--out", "few.h5")
        self.assertEqual(sorted(n for s in SPLITS for n in found[s]["subjects"]), ["ann", "bob", "eve"])
        few = self.json("data", "inspect", "few.h5")
        self.assertEqual(few["subjects"], {"ann": 1, "bob": 1, "eve": 1})
        self.assertEqual({s: c["bodies"] for s, c in few["splits"].items()}, where)
        self.bad_input(["data", "split", "all.h5", "--only", "ann,tom", "--out", "x.h5"], "all.h5", "'tom'")

    def test_too_few_people(self):
        self.people({"ann": [30, 40], "bob": [50]})
        self.imported()
        self.bad_input(["data", "split", "people.h5", "--out", "data.h5"], "people.h5", "2 subjects for 3 splits", "--by clip")
        found = self.json("data", "split", "people.h5", "--by", "clip", "--out", "data.h5")
        dealt = [n for s in SPLITS for n in found[s]["subjects"]]
        self.assertEqual(sorted(n.split("/")[0] for n in dealt), ["ann", "ann", "bob"])
        self.assertEqual([len(found[s]["subjects"]) for s in SPLITS], [1, 1, 1])
        two = self.json("data", "split", "people.h5", "--shares", "0.5,0,0.5", "--out", "data.h5")
        self.assertEqual([len(two[s]["subjects"]) for s in SPLITS], [1, 0, 1])

    def test_bad_input(self):
        self.people({"ann": [5], "bob": [5], "eve": [5]})
        self.imported()
        call = ["data", "split", "people.h5", "--out", "x.h5"]
        for shares in ("0.8,0.1", "0.8,0.1,0.2", "1.2,-0.1,-0.1", "a,b,c", "nan,0.5,0.5"):
            self.bad_input(call + ["--shares", shares], "--shares")
        self.bad_input(call + ["--by", "day"], "--by", "subject")
        self.bad_input(["data", "split", "people.h5", "--out", "people.h5"], "people.h5")
        self.bad_input(["data", "split", "none.h5", "--out", "x.h5"], "none.h5")


class Told(People):
    def test_what_is_wrong_with_data_before_training(self):
        self.write("tiny.yaml", CONFIG)
        self.people({"ann": [40, 40, 40]})
        self.imported()
        self.done("data", "build", "--bodies", 2, 2, 0, "--motions", 0, 2, 0, "--out", "others.h5")
        self.done("data", "merge", "others.h5", "people.h5", "--out", "data.h5")
        result = self.restage("train", "tiny.yaml", "data.source=data.h5", "stages=[skeleton]", "--dry-run")
        self.assertEqual(result.code, 0, result.err)
        for words in ("one subject ('ann')", "2 bodies to train on", "no bodies of split 'test'", "no motions of split 'test'"):
            self.assertIn(words, result.err)
