#!/usr/bin/env python3
"""What .ci/run has to prove again.

    proofs.py ask STEP SCRIPT PATH...      prints "proved DATE": nothing that the step depends on has changed since it passed;
                                           or "since COMMIT": it passed there, and what changed since can be told;
                                           or "all": it never passed, its script changed, or the commit is not known here
    proofs.py record STEP SCRIPT PATH...   the step passed on the content at hand

SCRIPT is what the step does, as text. PATHs are files and folders of the repository, as git's pathspecs (":!docs": not that);
DATA stands for the data folder.
The rows of .ci/proved: step, hash of the script, hash of the paths' content, date, commit. Only a clean checkout is
recorded, so that a row's commit has the content that the row's hash names."""
import datetime
import hashlib
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
FILE = ROOT / ".ci/proved"
DATA = ROOT.parent / "shared/data"


def git(*words):
    return subprocess.run(["git", "-C", ROOT, *words], capture_output=True, text=True, check=True).stdout


def short(text):
    return hashlib.sha256(text).hexdigest()[:16]


def listed(*paths):
    """Files of the repository below the paths; new ones that git does not know yet are among them."""
    names = git("ls-files", "-z", "-co", "--exclude-standard", "--", *paths).split("\0")
    return [name for name in sorted(set(names)) if name and (ROOT / name).is_file()]


def content(paths):
    own = [path for path in paths if path != "DATA"]
    for path in own:
        if not path.startswith(":!") and not listed(path):
            sys.exit(f".ci/run: a step depends on '{path}', which is not there")
    found = {name: ROOT / name for name in listed(*own)}
    if "DATA" in paths and DATA.is_dir():
        found.update(("DATA/" + p.relative_to(DATA).as_posix(), p) for p in sorted(DATA.rglob("*")) if p.is_file())
    return short("\n".join(f"{name} {hashlib.sha256(place.read_bytes()).hexdigest()}" for name, place in found.items()).encode())


def rows():
    lines = FILE.read_text().splitlines() if FILE.exists() else []
    return {words[0]: words[1:] for words in map(str.split, lines) if len(words) == 5}


def known(commit):
    return subprocess.run(["git", "-C", ROOT, "merge-base", "--is-ancestor", commit, "HEAD"], capture_output=True).returncode == 0


def ask(step, script, paths):
    row = rows().get(step)
    if not row or row[0] != short(script.encode()):
        return "all"
    if row[1] == content(paths):
        return f"proved {row[2]}"
    return f"since {row[3]}" if known(row[3]) else "all"


def record(step, script, paths):
    if git("status", "--porcelain", "--", ".", ":!.ci/proved"):
        return "not recorded: the checkout has changes that are not committed"
    now = rows()
    now[step] = [short(script.encode()), content(paths), datetime.date.today().isoformat(), git("rev-parse", "HEAD").strip()[:12]]
    FILE.write_text("".join(" ".join([name, *now[name]]) + "\n" for name in sorted(now)))
    return "recorded"


if __name__ == "__main__":
    verb, step, script, *paths = sys.argv[1:]
    print({"ask": ask, "record": record}[verb](step, script, paths))
