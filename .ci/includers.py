#!/usr/bin/env python3
"""The sources that see a change: the given files, and all that include one of them, directly or not.

    git diff --name-only COMMIT | includers.py"""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"', re.M)

listed = subprocess.run(["git", "-C", ROOT, "ls-files", "*.cpp", "*.h", "*.inc"], capture_output=True, text=True, check=True)
users = {}
for name in listed.stdout.split():
    if (ROOT / name).exists():
        for used in INCLUDE.findall((ROOT / name).read_text(errors="replace")):
            users.setdefault(used, set()).add(name)
seen, open_names = set(), [line.strip() for line in sys.stdin if line.strip()]
while open_names:
    name = open_names.pop()
    if name not in seen:
        seen.add(name)
        open_names += users.get(name, ())
print("\n".join(sorted(name for name in seen if (ROOT / name).exists())))
