#!/usr/bin/env python3
"""Pages for people: every relative link and its anchor lead somewhere, every page that code names is there, every step of .ci/run
that a page or a workflow names is one, every place that repeats the version has that of CMakeLists.txt, and docs/decisions.md is short enough to be read. Prints one line for each fault; exit code 1 if
there is any."""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
DECISIONS = ROOT / "docs/decisions.md"
MOST_DECISIONS = 4_000  # words
faults = []


def pages():
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "-co", "--exclude-standard", "*.md"], capture_output=True, text=True, check=True)
    return [ROOT / name for name in listed.stdout.split("\n") if name and (ROOT / name).exists()]


def anchors(path):
    """The names that a reader of the page on a code host finds."""
    found, text = {}, re.sub(r"^```.*?^```", "", path.read_text(), flags=re.M | re.S)
    for title in re.findall(r"^#+ +(.*)$", text, re.M):
        title = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", title)
        name = re.sub(r"[^\w\- ]", "", title.strip().lower()).replace(" ", "-")
        found[name] = found.get(name, -1) + 1
        if found[name]:
            found["%s-%d" % (name, found[name])] = 0
    return set(found) | set(re.findall(r"<a (?:id|name)=\"([^\"]+)\"", text))


def check_links(path):
    text = re.sub(r"^```.*?^```", "", path.read_text(), flags=re.M | re.S)
    text = re.sub(r"`[^`\n]*`", "", text)
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", link):
            continue
        place, _, anchor = link.partition("#")
        target = (path.parent / place).resolve() if place else path
        if not target.exists():
            faults.append("%s: links to %s, which is not there" % (path.relative_to(ROOT), link))
        elif anchor and target.suffix == ".md" and anchor not in anchors(target):
            faults.append("%s: links to %s, which has no such heading" % (path.relative_to(ROOT), link))


def check_names_in_code():
    lines = subprocess.run(["git", "-C", ROOT, "grep", "-noE", r"docs/[A-Za-z0-9_/]+\.md(#[a-z0-9-]+)?", "--", ":!docs", ":!*.md"],
                           capture_output=True, text=True).stdout.splitlines()
    for line in lines:
        file, number, name = line.split(":", 2)
        place, _, anchor = name.partition("#")
        if not (ROOT / place).exists():
            faults.append("%s:%s: names %s, which is not there" % (file, number, place))
        elif anchor and anchor not in anchors(ROOT / place):
            faults.append("%s:%s: names %s, which has no such heading" % (file, number, name))


def check_steps():
    """What stands after .ci/run in code spans of pages, and in lists and lines of YAML, is a step."""
    steps = set(re.findall(r"^  check ([a-z]+) ", (ROOT / ".ci/run").read_text(), re.M)) | {"all"}
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "-co", "--exclude-standard", "*.md", "*.yml", "*.yaml"], capture_output=True, text=True, check=True)
    for name in filter(lambda n: n and (ROOT / n).exists(), listed.stdout.split("\n")):
        text = (ROOT / name).read_text()
        named = re.findall(r"`\.ci/run((?: [a-z]+)+)`" if name.endswith(".md") else r"\.ci/run((?: [a-z]+)+) *$", text, re.M)
        named += [words.replace(",", " ") for words in re.findall(r"^ *step: \[(.*)\]$", text, re.M)]
        for step in sorted(set(" ".join(named).split()) - steps):
            faults.append("%s: names '%s', which is no step of .ci/run" % (name, step))


def check_version():
    """What a user or a program reads as the version (the files of cmake/ports have a test of their own)."""
    version = re.search(r"project\(restage VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
    minor = version.rpartition(".")[0]
    for name, pattern, wanted in (("CITATION.cff", r"^version: (.*)$", version), ("README.md", r"restage[_-](\d+\.\d+\.\d+)", version),
                                  ("docs/install.md", r"restage[_-](\d+\.\d+\.\d+)", version),
                                  ("CHANGELOG.md", r"^## \[(\d+\.\d+\.\d+)\] - \d{4}-\d\d-\d\d$", version),
                                  ("docs/api.md", r"find_package\(restage ([\d.]+)", minor), ("docs/extending.md", r"find_package\(restage ([\d.]+)", minor),
                                  ("docs/stability.md", r"find_package\(restage ([\d.]+)", minor),
                                  ("tests/install/CMakeLists.txt", r"find_package\(restage ([\d.]+)", minor)):
        found = re.findall(pattern, (ROOT / name).read_text(), re.M)
        for one in found[:1] if name == "CHANGELOG.md" else found:  # a changelog begins with the newest
            if one != wanted:
                faults.append("%s: names %s, and CMakeLists.txt %s" % (name, one, version))
        if not found:
            faults.append("%s: names no version; %s is wanted" % (name, wanted))


for page in pages():
    check_links(page)
check_names_in_code()
check_steps()
check_version()


words = len(DECISIONS.read_text().split())
print("%d pages; decisions, %d words" % (len(pages()), words))
if words > MOST_DECISIONS:
    faults.append("docs/decisions.md: %d words, and %d are enough; git keeps what goes" % (words, MOST_DECISIONS))
print("\n".join(faults))
sys.exit(bool(faults))
