"""docs/your_data.md: its lines are run as they stand, but for the length of the training."""
import os
import re
import shlex

from support import DATA, ROOT, CliTest, needs_data

SHORT = ["skeleton.optimiser.steps=2", "skeleton.validation_clouds=4", "motion.optimiser.steps=2", "motion.answers.sequences=4",
         "motion.validation_windows=2", "evaluation={sequences: 2, frames: 8}"]


def commands():
    with open(os.path.join(ROOT, "docs/your_data.md")) as page:
        blocks = re.findall(r"```\n(.*?)```", page.read(), re.S)
    return [shlex.split(line[2:]) for line in blocks[0].splitlines()]


class YourData(CliTest):
    @needs_data("cmu/bvh")
    def test_the_pages_commands(self):
        found = commands()
        self.assertEqual([c[1] for c in found], ["data", "data", "train", "eval", "report"], "five commands")
        for folder in ("configs", "experiments"):
            os.symlink(os.path.join(ROOT, folder), self.path(folder))
        os.symlink(os.path.join(DATA, "cmu/bvh"), self.path("recordings"))
        run = ""
        for command in found:
            arguments = [run if a == "RUN" else a.replace("run=RUN", "run=" + run) for a in command[1:]]
            if arguments[0] == "train":
                arguments += SHORT
            result = self.restage(*arguments, timeout=600)
            self.assertEqual(result.code, 0, result.err)
            if arguments[0] == "train":
                run = result.out.splitlines()[0]
            elif arguments[:2] == ["data", "split"]:
                self.assertRegex(result.out, r"\| train +\| +\d+ \| +\d+: 0")
            elif arguments[0] == "eval":
                self.assertIn("closed form", result.out)
        inspected = self.json("data", "inspect", "data.h5")
        self.assertEqual(len(inspected["subjects"]), 11, "people by the names of their files")
        self.assertIn("worst", self.bytes("report.html").decode())
