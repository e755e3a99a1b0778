#!/usr/bin/env python3
"""The open benchmark's table (docs/benchmark.md): trains, predicts and measures; ./run benchmark calls it.

    benchmark.py run --program RESTAGE --benchmark DIR --out DIR [--seeds 1,2,3] [--sets test,naked,clothed,scans]
    benchmark.py table DIR

`run` leaves one JSON file a row and seed in OUT: lite-1.json, ..., references.json, register.json, with the metrics of
every sequence. What is there already is not done again, so a long run may be cut off and taken up. `table` puts such
files together as Markdown. Python's standard library only.
"""
import argparse
import hashlib
import json
import os
import pathlib
import re
import shutil
import statistics
import subprocess
import sys
import tempfile

SETS = {"test": "AMASS-style", "naked": "naked", "clothed": "clothed", "scans": "scans"}
ROWS = {"lite": "Restage lite", "rest_pose": "rest pose", "source_unchanged": "source skeleton unchanged",
        "closed_form": "closed form", "register": "register then repose"}
REFERENCES = ("rest_pose", "source_unchanged", "closed_form")
METRICS = [("mpjpe", "MPJPE", "cm", 100), ("pa_mpjpe", "PA-MPJPE", "cm", 100), ("acc", "Acc", "mm/frame²", 1000),
           ("pa_acc", "PA-Acc", "mm/frame²", 1000), ("mpvd", "MPVD", "cm", 100), ("pa_mpvd", "PA-MPVD", "cm", 100),
           ("medl", "MEDL", "mm", 1)]
EVERY = 30         # "register then repose": one frame per second,
MOST_FRAMES = 300  # and no more than this in a set


def say(text):
    print(text, file=sys.stderr, flush=True)


class Failed(Exception):
    """A command that refused its input, with its words."""


class Restage:
    def __init__(self, program):
        self.program = program

    def __call__(self, *arguments, allowed=(0,), json_wanted=False):
        command = [self.program, *map(str, arguments), "--quiet", *(["--json"] if json_wanted else [])]
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        if done.returncode not in allowed:
            words = done.stderr.strip().splitlines()
            raise Failed(words[-1] if words else f"restage {arguments[0]}: exit code {done.returncode}")
        return json.loads(done.stdout) if json_wanted else done.stdout


# ---- the sequences -----------------------------------------------------------------------------------------------

def test_pairs(recipe):
    """The AMASS-style set, by rule: clip i from body i, to the next body of the circle, then the one after, ... so
    that all 7 are sources and targets about equally often. (recipe.yaml as `data build` writes it: lists on one line.)"""
    found = re.search(r"^test:\n  bodies: \[(.*)\]\n  clips: \[(.*)\]$", recipe, re.M)
    bodies, clips = (re.findall(r"[^\s,\"]+", part) for part in found.groups())
    n = len(bodies)
    for i, clip in enumerate(clips):
        yield clip, bodies[i % n], bodies[(i + 1 + i // n % (n - 1)) % n]


class Sequence:
    """Files of one sequence: in the benchmark's folder, or made for the time of a `with` block."""

    def __init__(self, name, folder=None, make=None):
        self.name, self.folder, self.make = name, folder, make

    def __enter__(self):
        self.work = tempfile.mkdtemp(prefix="restage-benchmark-")
        if self.make:
            self.folder = os.path.join(self.work, "sequence")
            self.make(self.folder)
        return self

    def __exit__(self, *ignored):
        shutil.rmtree(self.work, ignore_errors=True)

    def file(self, name):
        return os.path.join(self.folder, name)

    def scratch(self, name):
        return os.path.join(self.work, name)

    def without_paths(self, text):
        return text.replace(os.path.join(self.folder or "", ""), "").replace(os.path.join(self.work, ""), "")[:300]


def sequences(restage, benchmark, name):
    if name != "test":
        for folder in sorted(pathlib.Path(benchmark, name).iterdir()):
            yield Sequence(folder.name, str(folder))
        return
    data = os.path.join(benchmark, "test.h5")
    for clip, source, target in test_pairs(pathlib.Path(benchmark, "recipe.yaml").read_text()):
        yield Sequence(f"{clip}-{source}-{target}", make=lambda folder, c=clip, s=source, t=target: restage(
            "data", "perform", "--bodies", data, "--motion", c, "--body", s, "--target", t, "--out", folder))


# ---- the rows ----------------------------------------------------------------------------------------------------

def source_clouds(restage, sequence, in_scans):
    """The clouds as a user would use them, and what eval must know of them. Scans go through the doctor."""
    if not in_scans:
        return sequence.file("source.h5"), []
    mended = sequence.scratch("mended.h5")
    restage("doctor", sequence.file("source.h5"), "--fix", mended)  # exit code 1: the doctor cannot mend it
    return mended, ["--mended", mended]


def measure(restage, sequence, predicted, *options):
    return restage("eval", "--pred", predicted, "--truth", sequence.file("truth.h5"), "--source", sequence.file("source.h5"),
                   "--rest", sequence.file("rest.h5"), *options, json_wanted=True)


def lite(weights):
    def row(restage, sequence, in_scans):
        clouds, options = source_clouds(restage, sequence, in_scans)
        result = sequence.scratch("result.h5")
        restage("retarget", "--source", clouds, "--target", sequence.file("target.ply"), "--weights", weights, "--out", result)
        return measure(restage, sequence, result, *options)
    return row


def register(restage, sequence, in_scans):
    clouds, options = source_clouds(restage, sequence, in_scans)
    result = sequence.scratch("result.h5")
    restage("retarget", "--system", "register", "--source", clouds, "--target", sequence.file("target.ply"), "--rest", sequence.file("rest.h5"),
            "--every", EVERY, "--out", result)
    return measure(restage, sequence, result, "--every", EVERY, *options)


def references(restage, sequence, in_scans):
    return measure(restage, sequence, sequence.file("truth.h5"))


def entry(name, found):
    out = {"name": name, **found["sequences"][0]}
    if "mended" in found:
        out["mended"] = found["mended"]
    return out


def run_row(restage, arguments, name, row, about):
    """Fills OUT/NAME.json, sequence by sequence."""
    path = pathlib.Path(arguments.out, name + ".json")
    made = {**about, "row": name.split("-")[0], "sets": {}}
    if path.exists():
        made = json.loads(path.read_text())
        if any(made.get(key) != value for key, value in about.items()):
            sys.exit(f"{path} is of another benchmark or run; give another --out, or remove it")
    for set_name in arguments.sets:
        done = made["sets"].setdefault(set_name, [])
        frames = sum(e.get("frames", 0) for e in done)
        for sequence in sequences(restage, arguments.benchmark, set_name):
            if any(e["name"] == sequence.name for e in done):
                continue
            if name == "register" and frames >= MOST_FRAMES:
                break
            with sequence:
                try:
                    found = row(restage, sequence, set_name == "scans")
                    done.append(entry(sequence.name, found))
                    if name == "references":
                        done[-1] = {"name": sequence.name, "frames": done[-1]["frames"], **found["references"]}
                except Failed as failure:
                    done.append({"name": sequence.name, "failed": sequence.without_paths(str(failure))})
            frames += done[-1].get("frames", 0)
            say(f"{name}: {set_name}/{sequence.name}: " + (done[-1].get("failed") or "done"))
            write(path, made)
    write(path, made)


def write(path, document):
    part = path.with_suffix(".part")
    part.write_text(json.dumps(document, indent=1) + "\n")
    os.replace(part, path)


def trained(arguments, seed):
    """The weights of the lite system with a seed; trained, or the rest of it, if they are not there."""
    runs = pathlib.Path(arguments.out, "runs", f"seed{seed}")
    done = sorted(runs.glob("*/weights.safetensors"))
    if done:
        return str(done[-1])
    begun = sorted(p.parent for p in runs.glob("*/config.yaml"))
    command = [f"resume={begun[-1]}"] if begun else [
        arguments.config, f"seed={seed}", f"data.source={arguments.benchmark}", f"run_root={runs}", *arguments.override]
    say(f"training with seed {seed}")
    subprocess.run([arguments.program, "train", *command], check=True, stdout=sys.stderr)
    return str(sorted(runs.glob("*/weights.safetensors"))[-1])


def run(arguments):
    restage = Restage(arguments.program)
    os.makedirs(arguments.out, exist_ok=True)
    manifest = pathlib.Path(arguments.benchmark, "manifest.json").read_bytes()
    about = {"protocol": json.loads(manifest)["protocol"], "benchmark": hashlib.sha256(manifest).hexdigest()}
    if "references" in arguments.rows:
        run_row(restage, arguments, "references", references, about)
    if "lite" in arguments.rows:
        for seed in arguments.seeds:
            run_row(restage, arguments, f"lite-{seed}", lite(trained(arguments, seed)), {**about, "seed": seed})
    if "register" in arguments.rows:
        run_row(restage, arguments, "register", register, about)


# ---- the table ---------------------------------------------------------------------------------------------------

def means(entries, metric):
    """Of one run: over its sequences, equal weight each. Nothing if no sequence has a value."""
    values = [e[metric] for e in entries if e.get(metric) is not None]
    return statistics.fmean(values) if values else None


def cell(values, factor):
    """Mean over the runs, and sample deviation if there is more than one."""
    values = [factor * v for v in values if v is not None]
    if not values:
        return "-"
    text = f"{statistics.fmean(values):.2f}"
    return text + (f" ± {statistics.stdev(values):.2f}" if len(values) > 1 else "")


def runs_by_row(documents):
    """{row: [{set: [entries]}, one a run]}"""
    out = {}
    for d in documents:
        if d["row"] != "references":
            out.setdefault(d["row"], []).append(d["sets"])
            continue
        for r in REFERENCES:
            out.setdefault(r, []).append({s: [{**e[r], "name": e["name"], "frames": e["frames"]} for e in entries]
                                          for s, entries in d["sets"].items()})
    return out


def table(documents):
    if len({d["benchmark"] for d in documents}) > 1:
        raise ValueError("the files are of different benchmarks")
    rows = runs_by_row(documents)
    lines = []
    for set_name, title in SETS.items():
        body, notes = [], []
        for row, words in ROWS.items():
            runs = [r[set_name] for r in rows.get(row, []) if r.get(set_name)]
            if not runs:
                continue
            if row == "lite":
                words += f", {len(runs)} seed" + "s" * (len(runs) > 1)
            body.append("| " + " | ".join([words] + [cell([means(r, m) for r in runs], f) for m, _, _, f in METRICS]) + " |")
            frames = sum(e.get("frames", 0) for e in runs[0])
            failed = sorted({e["name"] for r in runs for e in r if "failed" in e})
            if row in ("lite", "register"):
                notes.append(f"{ROWS[row]}: {len(runs[0]) - len(failed)} of {len(runs[0])} sequences, {frames} frames" +
                             (f"; failed: {', '.join(failed)}" if failed else ""))
        if body:
            lines += [f"**{title}**", "", "| | " + " | ".join(f"{t} [{u}]" for _, t, u, _ in METRICS) + " |",
                      "|---|" + "---|" * len(METRICS), *body, "", ". ".join(notes) + ".", ""]
    return "\n".join(lines)


def read_folder(folder):
    paths = sorted(pathlib.Path(folder).glob("*.json"))
    if not paths:
        sys.exit(f"{folder} holds no results (*.json)")
    return [json.loads(p.read_text()) for p in paths]


def listed(allowed=None):
    def read(text):
        items = text.split(",")
        for item in items:
            if allowed and item not in allowed:
                raise argparse.ArgumentTypeError(f"there is no '{item}'; there are {', '.join(allowed)}")
        return items
    return read


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = p.add_subparsers(dest="command", required=True)
    r = commands.add_parser("run")
    r.add_argument("--program", required=True)
    r.add_argument("--benchmark", required=True, help="the folder that 'restage data build' made")
    r.add_argument("--out", required=True)
    r.add_argument("--config", default="configs/lite/all.yaml")
    r.add_argument("--override", action="append", default=[], help="key=value for the training; not the benchmark then")
    r.add_argument("--seeds", type=lambda t: [int(s) for s in t.split(",")], default=[1, 2, 3])
    r.add_argument("--sets", type=listed(list(SETS)), default=list(SETS))
    r.add_argument("--rows", type=listed(["references", "lite", "register"]), default=["references", "lite", "register"])
    t = commands.add_parser("table")
    t.add_argument("folder")
    return p.parse_args()


def main():
    a = arguments()
    if a.command == "run":
        run(a)
        print(table(read_folder(a.out)))
    else:
        print(table(read_folder(a.folder)))


if __name__ == "__main__":
    main()
