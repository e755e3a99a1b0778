#!/usr/bin/env python3
"""Writes docs/leaderboard.md: our rows, made from the committed trials, and the rows of others in experiments/leaderboard.

    python3 docs/make_leaderboard.py [PROGRAM]            writes the page
    python3 docs/make_leaderboard.py --check [PROGRAM]    1 if the page is not what this writes
    python3 docs/make_leaderboard.py --rows DIR [PROGRAM] writes our rows as files

PROGRAM: build/release/restage without it. 'restage benchmark score --row' writes the row of somebody else.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE, OTHERS, STUDIES = ROOT / "docs/leaderboard.md", ROOT / "experiments/leaderboard", ROOT / "experiments/studies"

# Our rows: file, study, its case, the row's name, what it is told, a remark.
OURS = (
    ("standard", "standard", "at once", "standard", "clouds", "shipped weights, answers at once"),
    ("standard_late", "standard", "two frames late", "standard, two frames late", "clouds", "shipped weights"),
    ("no_motion", "shipped", "no motion network", "no motion network", "clouds", "closed form of the extractor's joints"),
    ("lite", "benchmark", "Restage lite", "lite", "clouds", "an earlier program"),
    ("register", "benchmark", "register then repose", "register, then repose", "clouds, target's true joints",
     "an earlier program; every 30th frame"),
)


def make_row(program, path, study, case, method, told, note):
    trials = sorted(map(str, (STUDIES / study / "trials").glob("*/result.json")))
    subprocess.run([program, "benchmark", "score", *trials, "--case", case, "--method", method, "--told", told, "--note", note,
                    "--row", str(path), "--quiet", "--format", "csv"], check=True, stdout=subprocess.DEVNULL)


def make_rows(program, folder):
    folder.mkdir(parents=True, exist_ok=True)
    for name, *row in OURS:
        make_row(program, folder / (name + ".json"), *row)


def page(program):
    with tempfile.TemporaryDirectory() as folder:
        make_rows(program, Path(folder))
        rows = sorted([*Path(folder).glob("*.json"), *OTHERS.glob("*.json")], key=lambda row: row.name)
        return subprocess.run([program, "benchmark", "leaderboard", *map(str, rows)], check=True, capture_output=True, text=True).stdout


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", nargs="?", default=str(ROOT / "build/release/restage"))
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--rows", type=Path)
    asked = parser.parse_args(arguments)
    if asked.rows:
        make_rows(asked.program, asked.rows)
    elif not asked.check:
        PAGE.write_text(page(asked.program))
    elif PAGE.read_text() != page(asked.program):
        print("docs/leaderboard.md: is not what docs/make_leaderboard.py writes")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
