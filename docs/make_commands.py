#!/usr/bin/env python3
"""Writes docs/commands.md from the program's own table of commands and options.

    python3 docs/make_commands.py [PROGRAM]            writes the page
    python3 docs/make_commands.py --check [PROGRAM]    1 if the page is not what this writes

PROGRAM: build/release/restage without it. `restage completion json` prints the table.
"""

import html
import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs/commands.md"

HEAD = """# All commands and options

<!-- Written by docs/make_commands.py from 'restage completion json'. Change the program's words, not this page. -->

`restage COMMAND --help` prints the same. [Which command](which_command.md) goes by task.

* A word in capitals stands for a value of your own. `...`: several values.
* Options without a value switch something on, or off (`--no-...`).
* In Python the options are keywords, with `_` for `-` ([python.md](python.md)).
* Exit codes: 0 done, 1 the work failed, 2 bad input, 130 stopped by Ctrl-C, 143 stopped by `kill`.

"""
WORDS = {"text": "TEXT", "whole": "NUMBER", "number": "NUMBER", "number_or_unit": "NUMBER or UNIT", "flag": "TEXT"}


def cell(text):
    """Text of a help page inside a table: nothing in it is markup."""
    return html.escape(" ".join(text.split()), quote=False).replace("|", "\\|").replace("*", "\\*").replace("_", "\\_")


def code(text):
    return "`%s`" % " ".join(text.split()).replace("|", "\\|")


def value_of(option):
    if not option["value"]:
        return ""
    word = " \\| ".join(code(choice) for choice in option["choices"]) or WORDS[option["kind"]]
    return word + (" ..." if option["several"] else "")


DEFAULT = re.compile(r" ?\(default: ((?:[^()]|\([^()]*\))*)\)\Z")


def default_of(option):
    if option["required"]:
        return "(required)"
    said = DEFAULT.search(option["help"])
    if said and said[1] != option["default"]:
        return cell(said[1])
    return code(option["default"]) if option["default"] else ""


def help_of(option):
    older = option["formerly"]
    return cell(DEFAULT.sub("", option["help"])) + (" (formerly %s)" % ", ".join(map(code, older)) if older else "")


def rows(options, name="option"):
    lines = ["|%s|value|default|what it does|" % name, "|---|---|---|---|"]
    for option in options:
        lines.append("| %s | %s | %s | %s" % (code(option["name"]), value_of(option), default_of(option), help_of(option)))
    return "\n".join(lines) + "\n"


def own(command, common):
    return [option for option in command["options"] if option["name"] not in common]


def section(command, words, common):
    name = " ".join([*words, command["name"]])
    out = "## %s\n\n%s.\n" % (name, cell(command["help"][:1].upper() + command["help"][1:]).rstrip("."))
    if command["arguments"]:
        out += "\n" + rows(command["arguments"], "word")
    if own(command, common):
        out += "\n" + rows(own(command, common))
    if command["examples"]:
        out += "\n```\n%s\n```\n" % command["examples"]
    for part in command["commands"]:
        out += "\n" + section(part, [*words, command["name"]], common)
    return out


def page(tree):
    common = [option for option in tree["options"] if option["name"] != "--version"]
    names = {option["name"] for option in common}
    links = ["* [%s](#restage-%s): %s" % (command["name"], command["name"], cell(command["help"])) for command in tree["commands"]]
    body = "\n".join(section(command, ["restage"], names) for command in tree["commands"])
    return HEAD + "\n".join(links) + "\n\n## Options of every command\n\n" + rows(common) + "\n" + body


def first_difference(have, want):
    have, want = have.splitlines(), want.splitlines()
    for i in range(max(len(have), len(want))):
        a, b = (lines[i] if i < len(lines) else "(no line)" for lines in (have, want))
        if a != b:
            return "docs/commands.md:%d: is not what docs/make_commands.py writes\n  is:     %s\n  should: %s" % (i + 1, a, b)
    return None


def main(arguments):
    check = arguments[:1] == ["--check"]
    program = arguments[check:] or [str(ROOT / "build/release/restage")]
    if len(program) != 1 or program[0].startswith("-"):
        print(__doc__.strip(), file=sys.stderr)
        return 2
    told = subprocess.run([program[0], "completion", "json"], capture_output=True, text=True, check=True)
    wanted = page(json.loads(told.stdout))
    if not check:
        PAGE.write_text(wanted)
        return 0
    fault = first_difference(PAGE.read_text() if PAGE.exists() else "", wanted)
    print(fault or "docs/commands.md: is what docs/make_commands.py writes")
    return 1 if fault else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
