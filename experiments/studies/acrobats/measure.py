#!/usr/bin/env python3
"""People who do not stand, as `retarget --source-up y` moves a target by them: whole clouds, six cameras, one camera.

    restage data build configs/data/acrobats.yaml out=acrobats data=DATA_FOLDER
    python3 experiments/studies/acrobats/measure.py acrobats --out experiments/studies/acrobats/standard.json

A row for each take and kind of cloud: PA-MPJPE (mm) and Acc (mm per frame squared) against the target's truth; "source unchanged"
is the error of the source's true joints.
"""
import argparse
import json
import pathlib
import subprocess
import tempfile


def run(*words):
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True)
    return json.loads(done.stdout) if done.returncode == 0 else {"refused": done.stderr.strip()}


def judge(program, weights, folder, out):
    words = ["--weights", weights] if weights else []
    done = run(program, "retarget", "--source", folder / "source.h5", "--source-up", "y", "--target", folder / "target.ply", *words,
               "--out", out, "--json", "--quiet")
    if "refused" in done:
        return done
    found = run(program, "eval", "--pred", out, "--truth", folder / "truth.h5", "--source", folder / "source.h5", "--rest",
                folder / "rest.h5", "--json", "--quiet")
    if "refused" in found:
        return found
    kept = {name: found["mean"][name] for name in ("pa_mpjpe", "acc", "pa_mpvd")}
    return {**kept, "confidence": min(done["confidence"]), "source_unchanged": found["references"]["source_unchanged"]["pa_mpjpe"]}


def row(name, found):
    if "refused" in found:
        return f"| {name} | refused: {found['refused']} |"
    return f"| {name} | {1e3 * found['pa_mpjpe']:.1f} | {1e3 * found['acc']:.1f} | {1e3 * found['source_unchanged']:.1f} |"


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("benchmark", type=pathlib.Path, help="folder that 'restage data build' made")
    words.add_argument("--weights", help="default: the standard weights")
    words.add_argument("--program", default="build/release/restage")
    words.add_argument("--out", required=True, help="a JSON file")
    given = words.parse_args()
    results = {}
    with tempfile.TemporaryDirectory() as scratch:
        for folder in sorted(path.parent for path in given.benchmark.glob("*/*/source.h5")):
            name = "/".join(folder.parts[-2:])
            results[name] = judge(given.program, given.weights, folder, pathlib.Path(scratch) / "p.h5")
            print(row(name, results[name]), flush=True)
    pathlib.Path(given.out).write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
