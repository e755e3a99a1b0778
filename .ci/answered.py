#!/usr/bin/env python3
"""Committed results answer whoever runs the papers again: data imported now, planned by the program of now, ask for the trials of
the committed plans. answered.py PROGRAM DATA_FOLDER. Prints each table that asks for other trials; exit code 1 if there is one."""
import json
import pathlib
import subprocess
import sys
import tempfile

import yaml

ROOT = pathlib.Path(__file__).resolve().parents[1]
program, data = (str(pathlib.Path(word).resolve()) for word in sys.argv[1:])
OTHER_PROGRAM = {"ours_switches", "ours_sensitivity"}  # docs/decisions.md, "Training and sweeps"


def run(*words, cwd):
    subprocess.run([program, *words, "--quiet"], cwd=cwd, check=True, stdout=subprocess.DEVNULL)


def questions(plan):
    return {(trial["case"], trial["seed"]): trial["id"] for trial in json.loads(plan.read_text())["trials"]}


different = []
with tempfile.TemporaryDirectory() as folder:
    run("data", "import", data, "--out", "real.h5", cwd=folder)
    run("data", "build", str(ROOT / "configs/data/open_benchmark.yaml"), "out=benchmark", "data=" + data, cwd=folder)
    for name in ("experiments", "configs"):
        (pathlib.Path(folder) / name).symlink_to(ROOT / name)
    for paper in sorted(ROOT.glob("experiments/studies/*/paper.yaml")):
        name, committed = paper.parent.name, paper.parent / "results/lite.json"
        if name in OTHER_PROGRAM or not committed.exists():
            continue
        words = [str(word) for word in yaml.safe_load(paper.read_text())["lite"]["words"]]
        run("sweep", "plan", f"experiments/studies/{name}/sweep.yaml", *words, "store=store", "--out", name, cwd=folder)
        asked, known = questions(pathlib.Path(folder) / name / "plan.json"), questions(committed)
        same = sum(known.get(key) == trial for key, trial in asked.items())
        print(f"{name}: {same} of {len(asked)} trials are those of the committed plan")
        if asked != known:
            different.append(name)
if different:
    print("other trials than those of the committed results are asked for: " + ", ".join(different) +
          "; what was trained is lost to whoever runs the papers again, unless the question did change")
sys.exit(bool(different))
