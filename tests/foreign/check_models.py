#!/usr/bin/env python3
"""Every command on models that nobody here made: Debian's assimp-testmodels, 90 PLY, OBJ, glTF and BVH files.

    tests/foreign/check_models.py [--program build/release/restage] [--models build/foreign] [--jobs 2] [--only NAME]

Hardly any of them is a person, many are broken on purpose. What is asked of every command is the contract of exit
codes alone: 0, 1 (only where the doctor calls a file unusable, or a check finds differences) or 2 with one line of under
400 characters and nothing on standard output; files appear whole or not at all; no signal, no hang, bounded memory,
no number in the output that is none. The package is downloaded where --models has none; ends with 1 if it cannot be had.
Plain Python, nothing else needed.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGE = "assimp-testmodels"
KINDS = {".ply", ".obj", ".gltf", ".glb", ".bvh"}
EXPECTED = 90
# Of a core; by the clock a busy machine may take five times as long.
MOST_SECONDS, MOST_MEMORY = 60, 1 << 30


def fetch(folder):
    """Downloads and unpacks the package into `folder`, unless it is there; the models in it."""
    def models():
        return sorted(p for p in folder.rglob("*") if p.suffix.lower() in KINDS and p.is_file())
    if not models():
        folder.mkdir(parents=True, exist_ok=True)
        get = ["apt-get", "download", PACKAGE]
        if subprocess.run(get, cwd=folder, stdout=subprocess.DEVNULL).returncode != 0:
            root = [] if os.getuid() == 0 else ["sudo"]
            subprocess.run([*root, "apt-get", "update"], stdout=subprocess.DEVNULL, check=False)
            subprocess.run(get, cwd=folder, stdout=subprocess.DEVNULL, check=False)
        for package in folder.glob("*.deb"):
            subprocess.run(["dpkg-deb", "-x", package, folder], check=True)
    if len(models()) < EXPECTED:
        sys.exit(f"{folder} holds {len(models())} of {EXPECTED} models: 'apt-get download {PACKAGE}' and unpack it there")
    return models()


def limits():
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (MOST_SECONDS, MOST_SECONDS))


class Run:
    """One command in an empty folder of its own."""

    def __init__(self, program, arguments, outputs=(), may_fail=False):
        self.arguments, self.outputs, self.may_fail = [str(a) for a in arguments], set(outputs), may_fail
        self.folder = tempfile.mkdtemp(prefix="restage-foreign-")
        try:
            self.start(program)
            self.problems = list(self.judge())
        finally:
            shutil.rmtree(self.folder)

    def start(self, program):
        out, err = (open(os.path.join(self.folder, name), "w+b") for name in (".out", ".err"))
        begin = time.monotonic()
        child = subprocess.Popen([program, *self.arguments, "--threads", "1"], cwd=self.folder, stdin=subprocess.DEVNULL,
                                 stdout=out, stderr=err, preexec_fn=limits)
        late = threading.Timer(5 * MOST_SECONDS, child.kill)
        late.start()
        _, status, used = os.wait4(child.pid, 0)
        late.cancel()
        child.returncode = os.waitstatus_to_exitcode(status)
        self.code, self.seconds, self.memory = child.returncode, used.ru_utime + used.ru_stime, used.ru_maxrss << 10
        self.hung = time.monotonic() - begin >= 5 * MOST_SECONDS or self.seconds >= MOST_SECONDS - 1
        self.text = []
        for file in (out, err):
            file.seek(0)
            self.text.append(file.read().decode(errors="replace"))
            file.close()
            os.unlink(file.name)

    def judge(self):
        out, err = self.text
        left = set(os.listdir(self.folder))
        if self.hung:
            yield f"took {self.seconds:.0f} s of a core and did not end"
        elif self.code < 0:
            yield f"died of {signal.Signals(-self.code).name}"
        elif self.code not in (0, 1, 2) or (self.code == 1 and not self.may_fail):
            yield f"exit code {self.code}: {err.strip()[-200:]}"
        if self.memory > MOST_MEMORY:
            yield f"took {self.memory >> 20} MiB"
        if self.code == 2:
            if err.count("\n") != 1 or not err.endswith("\n") or len(err.encode()) >= 400:
                yield f"no single short line: {err[:600]!r}"
            if not err.startswith("restage: ") or "; " not in err:
                yield f"not 'restage: what is wrong; how to mend it': {err!r}"
            if out:
                yield f"bad input, and words on standard output: {out[:100]!r}"
        whole = self.outputs if self.code in (0, 1) and self.outputs else set()
        if left != whole and not (self.code == 1 and not left):
            yield f"exit code {self.code} leaves {sorted(left) or 'nothing'}, not {sorted(whole) or 'nothing'}"
        if self.code == 0 and "--json" in self.arguments:
            try:
                document = json.loads(out)
            except ValueError:
                yield f"not one JSON document: {out[:100]!r}"
            else:
                if self.arguments[0] == "skeleton" and "null" in json.dumps(document):
                    yield "a joint that is no number"


def make_good(program, folder):
    """A short performance, its target in T-pose and a result, made by the program itself."""
    def do(*arguments):
        subprocess.run([program, *arguments, "--quiet"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    do("data", "build", "--bodies", "1", "0", "1", "--motions", "1", "0", "0", "--out", "data.h5")
    do("data", "perform", "--bodies", "data.h5", "--frames", "4", "--out", "walk")
    do("skeleton", "--input", "walk/target.ply", "--weights", WEIGHTS, "--out", "rest.h5")
    do("retarget", "--source", "walk", "--target", "walk/target.ply", "--weights", WEIGHTS, "--out", "good.h5")


WEIGHTS = str(ROOT / "experiments/weights/lite.safetensors")


def calls(i, model, good, frames):
    """What is done with model number i: arguments, files that must be there afterwards, whether 1 is an answer."""
    walk, target, result = f"{good}/walk", f"{good}/walk/target.ply", f"{good}/good.h5"
    retarget = ["retarget", "--weights", WEIGHTS, "--samples", 1]
    yield ["doctor", model], [], True
    yield ["doctor", model, "--target", "--json"], [], True
    told = ["--scale", 1, "--up", "y", "--facing", "z"]
    picture = ["x.png"] if i % 4 == 0 else []  # they take as long as all else
    yield (["doctor", model, "--fix", "x.ply", *told, *(["--picture"] + picture if picture else [])],
           ["x.ply", "x.ply.transform.json", *picture], True)
    yield ["doctor", model, "--fix", "x/"], ["x", "x.transform.json"], True
    yield ["doctor", frames, "--fix", "x/", *told], ["x", "x.transform.json"], True
    yield ["skeleton", "--weights", WEIGHTS, "--input", model, "--json"], [], False
    for force in ([], ["--force"]):
        yield [*retarget, "--source", walk, "--target", model, "--out", "x.glb", *force], ["x.glb"], False
        for source in (model, frames):
            yield [*retarget, "--source", source, "--target", target, "--out", "x.h5", *force], ["x.h5"], False
    yield ["data", "import", model, "--out", "x.h5"], ["x.h5"], False
    yield ["data", "import", frames, "--out", "x.h5"], ["x.h5"], False
    yield ["data", "inspect", model], [], False
    yield ["data", "verify", model], [], True
    yield ["render", frames, "--out", "x.png"], ["x.png"], False
    yield ["render", result, "--source", model, "--out", "x.html"], ["x.html"], False
    register = ["retarget", "--system", "register", "--rest", f"{good}/rest.h5", "--out", "x.h5", "--every", 1000]
    if i % 4 == 1:  # a second each
        yield [*register, "--source", walk, "--target", model], ["x.h5"], False
    if i % 4 == 3:
        yield [*register, "--source", frames, "--target", target], ["x.h5"], False
    yield ["weights", "show", model], [], False
    yield ["eval", "--pred", model, "--truth", result], [], False
    yield ["eval", "--pred", result, "--truth", model], [], False


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=ROOT / "build/release/restage")
    parser.add_argument("--models", type=pathlib.Path, default=ROOT / "build/foreign")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--only", default="", help="only models whose path has this in it")
    options = parser.parse_args()
    program = os.path.abspath(options.program)
    start = time.monotonic()
    models = [m for m in fetch(options.models.resolve()) if options.only in str(m)]
    with tempfile.TemporaryDirectory(prefix="restage-foreign-") as good:
        make_good(program, good)
        jobs = []
        for i, model in enumerate(models):
            frames = os.path.join(good, f"frames{i}")  # the model as the only one in a folder
            os.mkdir(frames)
            os.symlink(model, os.path.join(frames, "frame_1" + model.suffix))
            for beside in model.parent.iterdir():  # buffers and materials
                if beside.suffix.lower() not in KINDS:
                    os.symlink(beside, os.path.join(frames, beside.name))
            jobs += calls(i, model, good, frames)
        runs = []
        with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            for run in pool.map(lambda job: Run(program, *job), jobs):
                runs.append(run)
                for i, problem in enumerate(run.problems):
                    print(("" if i else f"restage {' '.join(run.arguments)}\n") + "  " + problem, flush=True)
    bad = [run for run in runs if run.problems]
    codes = {code: sum(run.code == code for run in runs) for code in sorted({run.code for run in runs})}
    longest, largest = max(runs, key=lambda r: r.seconds), max(runs, key=lambda r: r.memory)
    print(f"{len(models)} models, {len(runs)} commands in {time.monotonic() - start:.0f} s, "
          f"{sum(run.seconds for run in runs):.0f} s of a core; exit codes "
          + ", ".join(f"{n} times {code}" for code, n in codes.items()))
    print(f"the longest took {longest.seconds:.1f} s of a core (restage {' '.join(longest.arguments)}),")
    print(f"the largest {largest.memory >> 20} MiB (restage {' '.join(largest.arguments)})")
    if bad:
        sys.exit(f"{len(bad)} commands broke the contract; they stand above")


if __name__ == "__main__":
    main()
