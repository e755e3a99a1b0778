"""The program as a whole: usage, help, exit codes, standard output."""
import os
import re
import shutil
import signal
import subprocess
import time

from support import PROGRAM, CliTest


class Usage(CliTest):
    def test_help_and_version(self):
        self.assertRegex(self.done("--version"), r"^restage \d+\.\d+\.\d+\n$")
        self.assertEqual(list(self.json("--version")), ["version"])
        self.assertIn("eval", self.done("--help"))
        for group in ("data", "weights"):
            self.assertNotIn("restage eval", self.done(group, "--help"))
        for command in (["eval"], ["render"], ["doctor"], ["data", "build"], ["data", "import"], ["data", "inspect"], ["data", "verify"]):
            text = self.done(*command, "--help")
            self.assertIn("Examples:", text)
            self.assertIn("restage " + " ".join(command), text)

    def commands(self, *words):
        """Every command with its help, groups walked through."""
        text = self.done(*words, "--help")
        below = re.findall(r"^  ([a-z]+) {2,}", text.partition("ubcommands:")[2], re.M)
        return [found for word in below for found in self.commands(*words, word)] if below else [(words, text)]

    def test_every_flag_has_an_example(self):
        found = self.commands()
        self.assertGreater(len(found), 25)
        for words, text in found:
            own, examples = text.partition("Common options")[0], text.partition("Examples:")[2]
            for flag in re.findall(r"^  (?:-\w,)?(--[a-z-]+)", own, re.M):
                if flag != "--help":
                    self.assertRegex(examples, re.escape(flag) + "(?![a-z-])", "restage " + " ".join(words))

    def test_every_default_is_shown(self):
        seen = 0
        for words, page in self.commands():
            for entry in re.split(r"\n(?=  -)", page.partition("Examples:")[0])[1:]:
                takes_a_value = re.match(r"  (-\S+) (?:TEXT|INT|UINT|FLOAT)\S*(?: x \d+| \.\.\.)?( REQUIRED)?", entry)
                if takes_a_value and not takes_a_value[2]:
                    seen += 1
                    self.assertIn("(default: ", entry, "restage %s %s" % (" ".join(words), takes_a_value[1]))
        self.assertGreater(seen, 150)

    def completed(self, *words):
        """What bash offers for a half-written line."""
        script = self.write("completion.bash", self.done("completion", "bash"))
        line = " ".join("'%s'" % w for w in words)
        lines = 'source "%s"; COMP_WORDS=(restage %s); COMP_CWORD=%d; _restage; echo "${COMPREPLY[@]}"' % (script, line, len(words))
        return subprocess.run(["bash", "-c", lines], cwd=self.path("."), capture_output=True, text=True, check=True).stdout.split()

    def test_command_lines_are_completed(self):
        self.assertEqual(self.completed("retar"), ["retarget"])
        self.assertEqual(self.completed("data", "im"), ["import"])
        self.assertEqual(self.completed("reproduce", "rekik2024", "--budget", "l"), ["lite"])
        self.assertIn("--target", self.completed("retarget", "--source", "scans/", "--ta"))
        self.assertEqual(self.completed("train", "standard/f"), ["standard/finetune"])
        self.assertEqual(self.completed("reproduce", "rek"), ["rekik2024"])
        self.write("scan.ply", "")
        self.assertEqual(self.completed("doctor", "sca"), ["scan.ply"])
        self.write("a scan.ply", "")
        self.assertEqual(self.completed("doctor", "a"), ["a", "scan.ply"])  # one name: printed with its space
        self.assertEqual(self.json("completion", "fish")["script"], self.done("completion", "fish"))
        zsh, fish = self.done("completion", "zsh"), self.done("completion", "fish")
        for words, text in self.commands():
            self.assertIn("'" + " ".join(words) + "')", zsh)
            for flag in re.findall(r"^  (?:-\w,)?(--[a-z-]+)", text, re.M):
                self.assertIn(flag, zsh)
                self.assertIn("-l " + flag[2:] + " ", fish)
        for shell, text in (("zsh", zsh), ("fish", fish)):
            if shutil.which(shell):
                subprocess.run([shell, "-n", self.path(self.write("completion." + shell, text))], check=True)
        self.bad_input(["completion", "csh"], "csh")

    def test_what_comes_with_the_program_is_found_from_any_folder(self):
        said = self.json("doctor", "--self")
        self.assertNotIn("problem", said)
        self.assertGreater(said["frame_ms"], 0)
        self.assertEqual(said["threads"], len(os.sched_getaffinity(0)))
        self.assertTrue(os.path.isfile(said["weights"]))
        self.assertIn("skeleton", self.done("train", "demo", "--print-config"))
        self.assertIn("transfer", self.done("train", "npt/lite", "--print-config"))
        self.bad_input(["train", "npt/lit", "--print-config"], "did you mean 'npt/lite'")
        self.assertIn("trials", self.done("sweep", "plan", "experiments/studies/ours_switches/sweep.yaml"))
        self.bad_input(["doctor"], "--self")
        self.bad_input(["doctor", "x.ply", "--self"], "--self")
        self.bad_input(["doctor", "--self", "--picture", "p.png"], "--self alone")
        self.write("demo.yaml", "name: mine\nstages: []\n")  # one's own comes first
        self.bad_input(["train", "demo", "--print-config"], "demo.yaml:2", "stages")
        self.bad_input(["train", "/npt/lite", "--print-config"], "/npt/lite")

    def test_wrong_usage(self):
        self.bad_input([], "needs a command")
        self.bad_input(["evla"], "'evla'", "did you mean 'eval'")
        self.bad_input(["data"], "needs a command")
        self.bad_input(["data", "inspekt"], "did you mean 'inspect'")
        self.bad_input(["eval", "--perd", "x"], "'--perd'", "did you mean '--pred'")
        self.bad_input(["eval", "--pred"], "--pred needs a value")
        self.bad_input(["eval", "--pred", "a.h5", "--pred", "b.h5", "--truth", "c.h5"], "--pred is given twice")
        self.bad_input(["doctor", "x", "--verbose=high"], "--verbose takes no value")
        self.bad_input(["eval", "--pred", "a.h5"], "--truth")
        self.bad_input(["eval", "--pred", "a.h5", "--truth", "b.h5", "more"], "'more'")
        self.bad_input(["doctor", "x", "--threads", "many"], "'many' is no whole number, and --threads needs one")
        self.bad_input(["doctor", "x", "--fps", "fast"], "'fast' is no number, and --fps needs one")
        self.bad_input(["train"], "ARGUMENTS is required: CONFIG.yaml")
        self.bad_input(["doctor", "x", "--threads", "-1"], "--threads")
        self.bad_input(["doctor", "x", "--seed", "-1"], "--seed")
        self.bad_input(["doctor", "x", "--seed", str(2 ** 64)], "--seed")
        for out in ("", "-"):
            self.bad_input(["skeleton", "--weights", "w", "--source", "x", "--out", out], "--out")
        for empty in (["--weights", ""], ["--weights="]):
            self.bad_input(["skeleton", *empty, "--source", "x"], "--weights is empty")
        self.bad_input(["eval", "--pred", "a.h5", "--truth", "b.h5", "--anchor", 1], "--anchor")
        self.bad_input(["eval", "--pred", "a.h5", "--truth", "b.h5", "--out", "x"], "--out")
        self.bad_input(["eval", "run=x", "--every", 2], "--every")
        self.bad_input(["eval", "--pred", "p.h5", "--truth", "t.h5", "--device", "cpu"], "--device")

    def test_error_is_one_short_line_for_any_file_name(self):
        self.bad_input(["doctor", "no\nsuch\x1b[31mfile"], "cannot be read")
        self.bad_input(["doctor", "x" * 3000])
        self.bad_input(["doctor", "äöü" * 80])
        self.bad_input(["doctor", ""])


class Streams(CliTest):
    def test_full_standard_output_is_a_failure(self):
        with open("/dev/full", "w") as full:
            self.one_line(self.restage("--help", stdout=full), 1, "standard output")

    def test_closed_pipe_is_a_failure_and_not_a_signal(self):
        read, write = os.pipe()
        os.close(read)
        self.one_line(self.restage("--help", stdout=write), 1, "standard output")
        os.close(write)


class Signals(CliTest):
    def test_exit_codes(self):
        for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            with subprocess.Popen([PROGRAM, "data", "build", "--out", "big.h5", "--bodies", "500", "0", "0"], cwd=self.folder,
                                  stderr=subprocess.PIPE) as running:
                running.stderr.readline()  # the handlers are in place once something is logged
                time.sleep(0.1)
                running.send_signal(number)
                running.stderr.read()
                self.assertEqual(running.wait(60), code)
            self.assertEqual(os.listdir(self.folder), [])
