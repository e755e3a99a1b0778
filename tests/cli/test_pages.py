"""Commands of all pages: each names a command that there is, and options of that command; options with a choice get one of it.

What a line does is another matter: README's sample, docs/your_data.md, docs/python.md and the notebooks are run by tests of their own."""
import json
import os
import re
import shlex
import subprocess
import unittest

from support import ROOT, CliTest

# Written on pages and no command line: a placeholder, not a name.
PLACEHOLDERS = {"COMMAND", "X", "COMMAND...", "NAME"}


def pages():
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "*.md"], capture_output=True, text=True)
    names = listed.stdout.split() if listed.returncode == 0 else []
    return [name for name in names if not name.startswith("docs/reproduction/") and name != "CHANGELOG.md"]


def command_lines(text):
    """(line number, words behind `restage`) of fenced blocks and of code within lines."""
    found, fenced, kept = [], None, ""
    for number, line in enumerate(text.split("\n"), 1):
        fence = re.match(r"\s*```(\w*)", line)
        if fence:
            fenced = fence[1] if fenced is None else None
            continue
        if fenced is None:
            spans = [(span, True) for span in re.findall(r"`([^`]+)`", line)]
        elif fenced in ("", "sh", "bash", "console"):
            line = kept + line.strip()
            if line.endswith("\\"):
                kept = line[:-1]
                continue
            kept, spans = "", [(line, False)]
        else:
            continue
        for span, inline in spans:
            for part in re.split(r"\s\|\s|&&|;", re.sub(r"^\$ ", "", span)):
                begin = re.match(r"\s*(?:[A-Z_]+=\S+ )*(?:\S*/)?(?:python3 -m )?restage\s+(.*)", part)
                if begin:
                    try:
                        found.append((number, shlex.split(begin[1], comments=not inline)))
                    except ValueError:  # a quote of the sentence around
                        continue
    return found


class Pages(CliTest):
    def setUp(self):
        super().setUp()
        self.tree = json.loads(self.done("completion", "json"))

    def faults_of(self, words):
        """What is wrong with the words behind `restage`."""
        command, words = self.tree, list(words)
        while words and not words[0].startswith("-") and command["commands"]:
            if words[0] in PLACEHOLDERS or not re.match(r"[a-z]", words[0]):
                return []
            below = [one for one in command["commands"] if one["name"] == words[0]]
            if not below:
                return ["no command %r" % words[0]]
            command = below[0]
            words.pop(0)
        known = {name: option for option in command["options"] + command["arguments"] for name in [option["name"], *option["formerly"]]}
        known["-h"] = known["--help"]
        faults = []
        for place, word in enumerate(words):
            if not re.match(r"--?[a-z]", word):
                continue
            name, equals, value = word.partition("=")
            if name == "--python":  # of python3 -m restage
                continue
            if name not in known:
                faults.append("no option %r of %r" % (name, command["name"]))
                continue
            choices = known[name]["choices"]
            given = value if equals else words[place + 1] if place + 1 < len(words) else ""
            if choices and given and re.fullmatch(r"[a-z0-9]+", given) and given not in choices:
                faults.append("%s of %r is one of %s, not %r" % (name, command["name"], choices, given))
        return faults

    @unittest.skipUnless(pages(), "no git, or no clone")
    def test_commands_and_options_are_there(self):
        count, faults = 0, []
        for page in pages():
            with open(os.path.join(ROOT, page)) as file:
                lines = command_lines(file.read())
            count += len(lines)
            faults += ["%s:%d: restage %s: %s" % (page, number, " ".join(words)[:60], fault) for number, words in lines for fault in self.faults_of(words)]
        self.assertEqual(faults, [])
        self.assertGreater(count, 500)

    def test_faults_are_noticed(self):
        text = "`restage retarget --sauce x`\n```\n$ restage dance\na | build/restage view x --out y \\\n  --columnz 3 # --no\n```\n```python\nrestage nonsense\n```\n"
        lines = command_lines(text)
        self.assertEqual([number for number, _ in lines], [1, 3, 5])
        said = [self.faults_of(words) for _, words in lines]
        self.assertEqual(said, [["no option '--sauce' of 'retarget'"], ["no command 'dance'"], ["no option '--columnz' of 'view'"]])
        self.assertEqual(self.faults_of(["retarget", "--floor", "of"]), ["--floor of 'retarget' is one of %s, not 'of'" % self.choices("retarget", "--floor")])

    def choices(self, command, option):
        found = [one for one in self.tree["commands"] if one["name"] == command][0]
        return [one["choices"] for one in found["options"] if one["name"] == option][0]


if __name__ == "__main__":
    unittest.main()
