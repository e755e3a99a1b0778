"""One word for one thing: the same names of options in all commands, older names that go on working, defaults on every help
page, and no option that does nothing."""
import os
import shutil

from support import ROOT, CliTest, points
from test_data import toy_bvh
from tiny_run import weights


class Words(CliTest):
    def setUp(self):
        super().setUp()
        self.ply("a.ply", points(300, 1))
        self.w = weights("tiny")

    def once(self, *words):
        shutil.rmtree(self.path("again"), ignore_errors=True)
        return self.restage(*words)

    def test_older_names_go_on_working(self):
        """With one line on standard error, and the same result."""
        self.write("a.bvh", toy_bvh())
        self.person(4)
        for command, old, new in (
                (["skeleton", "--weights", self.w, "--json"], ["--input", "a.ply"], "--source"),
                (["view", "a.ply", "--out", "a.png"], ["--from", "left"], "--side"),
                (["doctor", "walk/target.ply"], ["--target"], "--as-target"),
                (["weights", "export", "--model", "smrm", "--out", "m.safetensors"], ["--from", self.w], "--source"),
                (["data", "import", "a.bvh", "--out", "m.h5"], ["--profile", "mixamo"], "--bones"),
                (["data", "perform", "--bodies", "data.h5", "--frames", 2, "--out", "again"], ["--target", "builtin_test_0"], "--answer")):
            before, now = (self.once(*command, *words) for words in (old, [new, *old[1:]]))
            self.assertEqual((before.code, before.out), (now.code, now.out), before.err + now.err)
            remarks = [line for line in before.err.splitlines() if "is called" in line]
            self.assertEqual(len(remarks), 1, before.err)
            self.assertIn("%s of 'restage %s' is called %s now" % (old[0], " ".join(command[:2 if command[0] in ("data", "weights") else 1]), new), remarks[0])
            self.assertNotIn("is called", now.err)
        same = self.done("skeleton", "--weights", self.w, "--input=a.ply")
        self.assertEqual(same, self.done("skeleton", "--weights", self.w, "a.ply"))
        self.bad_input(["skeleton", "--weights", self.w, "--input", "none.ply"], "none.ply")
        self.assertNotIn("is called", self.restage("skeleton", "--weights", self.w, "--input", "a.ply", "--quiet").err)
        self.bad_input(["adapt", "--source", "a.ply", "--views", "0", "--out", "w.safetensors"], "--samples")

    def test_source_target_and_out_need_no_names(self):
        self.person(4)
        call = ["retarget", "walk/source.h5", "walk/target.ply"]
        self.done(*call, "short.h5", "--weights", self.w, "--force")
        self.done("retarget", "--source", "walk/source.h5", "--target", "walk/target.ply", "--out", "long.h5", "--weights", self.w, "--force")
        self.assertEqual(self.bytes("short.h5"), self.bytes("long.h5"))
        self.bad_input([*call, "--weights", self.w], "--out is required")
        self.bad_input([*call, "a.h5", "b.h5"], "b.h5")
        self.bad_input(["retarget", "", "walk/target.ply", "a.h5"], "--source is empty")
        for command in (["assess", "--weights", self.w, "--force"], ["skeleton", "--weights", self.w], ["doctor"], ["view", "--out", "x.png"]):
            one, two = self.restage(*command, "a.ply"), self.restage(*command, "--source", "a.ply")
            self.assertEqual((one.code, one.out, one.err), (two.code, two.out, two.err))

    def test_what_switches_checks_off_is_never_proposed(self):
        for command, words in ((["eval"], ["--force", "--forse"]), (["adapt"], ["--forse", "--sourc"]), (["retarget"], ["--forc"])):
            for word in words:
                result = self.restage(*command, word, "x")
                self.assertEqual(result.code, 2)
                self.assertNotIn("did you mean '--force'", result.err)
        self.bad_input(["adapt", "--sourc", "x"], "did you mean '--source'")
        self.bad_input(["data", "import", "a.ply", "--fource", "--out", "x"], "--fource")

    def test_the_stub_of_python_is_the_table_of_options(self):
        with open(os.path.join(ROOT, "python", "restage", "_options.pyi")) as f:
            self.assertEqual(f.read(), self.done("completion", "python"), "restage completion python > python/restage/_options.pyi")
