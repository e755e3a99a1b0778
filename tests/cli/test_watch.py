"""restage watch: a sweep as it runs, and the pages and pictures that follow it."""
import os
import pty
import re
import select
import signal
import subprocess
import time
import xml.dom.minidom

from support import PROGRAM, CliTest
from tiny_run import CONFIG

BASE = CONFIG.replace("motions: {train: 4, validation: 2, test: 1}", "motions: {train: 4, validation: 2, test: 2}").replace(
    "bodies: {train: 2, validation: 2, test: 1}", "bodies: {train: 2, validation: 2, test: 2}") + "evaluation: {sequences: 1, frames: 5}\n"
# One short trial, and one that runs until it is stopped.
SWEEP = "base: configs/tiny.yaml\nset: {stages: [deformation]}\ngrid: {deformation.optimiser.steps: [4, 1000000]}\n"


class Watch(CliTest):
    def setUp(self):
        super().setUp()
        self.write("configs/tiny.yaml", BASE)
        self.write("s.yaml", SWEEP)

    def live(self):
        return self.json("watch", "d", "--once")

    def until(self, condition, seconds=60):
        end = time.monotonic() + seconds
        while not condition():
            self.assertLess(time.monotonic(), end, "waited too long")
            time.sleep(0.05)

    def running(self):
        """A sweep in the background of which one trial is done and one has been validated."""
        process = self.start("sweep", "run", "s.yaml", "--out", "d", "--jobs", "2")
        self.until(lambda: os.path.exists(self.path("d/plan.json")))
        self.until(lambda: (lambda live: live["best"] and live["running"] and live["running"][0]["now"])(self.live()))
        return process

    def in_a_terminal(self, *words):
        """The process, and what it has drawn so far."""
        ours, theirs = pty.openpty()
        process = subprocess.Popen([PROGRAM, *words], cwd=self.folder, stdin=theirs, stdout=theirs, stderr=theirs,
                                   env=dict(os.environ, TERM="xterm"))
        os.close(theirs)
        self.addCleanup(os.close, ours)

        def read(until, seconds=30):
            text, end = b"", time.monotonic() + seconds
            while not until(text) and time.monotonic() < end:
                if select.select([ours], [], [], 0.1)[0]:
                    try:
                        text += os.read(ours, 65536)
                    except OSError:  # the other end is closed
                        break
            return text.decode()
        return process, read

    def test_while_it_runs_and_after(self):
        process = self.running()
        live = self.live()
        self.assertEqual(live["metric"], "deformation.with_offsets_mm")
        self.assertEqual((live["counts"]["done"], live["counts"]["running"]), (1, 1))
        one = live["running"][0]
        self.assertEqual((one["stage"], one["steps"]), ("deformation", 1000000))
        self.assertGreater(one["step"], 0)
        text = self.done("watch", "d", "--once")
        head, best, heading, trial = text.splitlines()
        self.assertRegex(head, r"^d   1 done, 1 running")
        self.assertIn(live["best"]["id"], best)
        self.assertRegex(trial, "^%s deformation +[█░]{16} +\\d+ %% +[\\d:]+ +[\\d.]+ +[\\d.]+ +[▁▂▃▄▅▆▇█]+ +steps=1000000" % one["id"])
        self.assertRegex(heading, "^trial +stage +left +now +best +values$")
        self.assertNotIn("\x1b", text)
        # In a terminal it draws over itself, and ^C leaves nothing behind.
        watch, read = self.in_a_terminal("watch", "d", "--every", "0.1")
        drawn = read(lambda text: text.count(b"\x1b[4A\r\x1b[J") >= 2)
        self.assertGreaterEqual(drawn.count("\x1b[4A\r\x1b[J"), 2)
        for line in re.split(r"\r\n", drawn):
            self.assertLessEqual(len(re.sub(r"\x1b\[\w+|\r", "", line)), 80)
        watch.send_signal(signal.SIGINT)
        self.assertEqual(watch.wait(30), 130)
        self.assertNotIn("restage:", read(lambda text: False, 0.3))
        process.send_signal(signal.SIGTERM)
        process.stderr.read()
        process.wait(60)
        self.assertRegex(self.done("watch", "d"), "^d   1 done, 1 stopped\n")  # over: it ends by itself

    def test_a_search_is_over_when_its_space_is(self):
        self.write("s.yaml", "base: configs/tiny.yaml\nset: {stages: [deformation], deformation.optimiser.steps: 3}\n"
                   "search: {kind: tpe, trials: 9, startup: 2, metric: deformation.skinning_mm, space: {deformation.optimiser.batch: {integer: [1, 2]}}}\n")
        self.done("sweep", "run", "s.yaml", "--out", "d", "--jobs", "2")
        self.assertEqual(self.live()["to_come"], 0)
        self.assertRegex(self.done("watch", "d"), "^d   2 done\n")  # it ends, though nine were asked for

    def test_a_page_that_follows(self):
        process = self.running()
        follower = self.start("report", "d", "--out", "r.html", "--every", "1")
        self.until(lambda: os.path.exists(self.path("r.html")))
        page = self.bytes("r.html").decode()
        self.assertIn('<meta http-equiv="refresh" content="1">', page)
        self.assertIn("<h2>All trials</h2>", page)
        process.send_signal(signal.SIGTERM)
        process.stderr.read()
        process.wait(60)
        self.assertEqual(follower.wait(60), 0, follower.stderr.read())
        self.assertNotIn("http-equiv=\"refresh\"", self.bytes("r.html").decode())
        self.done("report", "d", "--out", "once.html")
        self.assertNotIn("http-equiv=\"refresh\"", self.bytes("once.html").decode())
        self.bad_input(["report", "d", "--out", "r2.html", "--every", "-1"], "--every")

    def test_pictures_and_failures_on_the_page(self):
        self.write("s.yaml", "base: configs/tiny.yaml\nset: {stages: [deformation], deformation.optimiser.steps: 3}\n"
                   "search: {kind: latin, trials: 8, metric: deformation.skinning_mm, space: {deformation.optimiser.schedule.rate: {log_uniform: [1e-5, 1e-2]}}}\n")
        self.done("sweep", "run", "s.yaml", "--out", "d", "--jobs", "2")
        self.done("report", "d", "--out", "r.html")
        page = self.bytes("r.html").decode()
        pictures = re.findall(r'<div class="picture">(<svg.*?</svg>)', page, re.S)
        for picture in pictures:
            xml.dom.minidom.parseString(picture)
        titles = re.findall("<h2>(.*?)</h2>", page)
        self.assertEqual([t for t in titles if t in ("All trials", "Trial after trial", "Which key mattered", "What each value gave")],
                         ["All trials", "Trial after trial", "Which key mattered", "What each value gave"])
        self.assertEqual(len(pictures), 4)
        self.assertIn("functional ANOVA", page)
        self.assertIn("deformation.optimiser.schedule.rate", pictures[2])
        self.assertEqual(pictures[3].count("<circle"), 8)
        self.assertIn("Best: %s, trial %s" % ("%.4g" % self.live()["best"]["value"], self.live()["best"]["id"]), page)
        # A failed trial shows the end of its log.
        self.assertNotIn("Failed trials", titles)
        self.write("s.yaml", "base: configs/tiny.yaml\ngrid: {skeleton.optimiser.schedule.rate: [1e25]}\n")
        self.assertEqual(self.restage("sweep", "run", "s.yaml", "--out", "bad").code, 1)
        self.done("report", "bad", "--out", "bad.html")
        failed = re.search("<h2>Failed trials</h2>.*?<pre>(.*?)</pre>", self.bytes("bad.html").decode(), re.S).group(1)
        self.assertIn("skeleton/patch_transformer", failed)

    def test_bad_input(self):
        self.bad_input(["watch", "nowhere"], "nowhere")
        self.done("sweep", "plan", "s.yaml", "--out", "d")
        self.bad_input(["watch", "d", "--metric", "deformation.skinning"], "did you mean 'deformation.skinning_mm'")
        self.bad_input(["watch", "d", "--every", "-1"], "--every")
        self.bad_input(["watch", "d", "--json"], "--once")
        self.assertRegex(self.done("watch", "d", "--once"), "^d   0 done, 2 pending\nbest   none yet\n$")


if __name__ == "__main__":
    import unittest
    unittest.main()
