#!/usr/bin/env python3
"""What a training survives: SIGKILL at random moments; ENOSPC, EIO and short writes at every call of the system that makes
its files; a folder that cannot be written; a clock that jumps; damaged checkpoints. It ends well or with one clear line, its
last checkpoint is intact, and whatever goes on from there ends with the bytes of an undisturbed training.

    python3 tests/experiments/train_faults.py BUILD_DIR [--kills 50] [--every 1] [--seed N] [--only NAME,...]

--every K: of the calls, every K-th. Plain Python; calls fail by BUILD_DIR/tests/libfaults.so (tests/support/faults.c)."""
import argparse
import glob
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "cli"))

NAMES = {"ENOSPC": "No space left on device", "EIO": "Input/output error"}
NOBODY = 65534


class World:
    """A folder with a configuration, and what an undisturbed training of it leaves."""

    def __init__(self, build, folder, config):
        self.program, self.faults, self.folder = os.path.join(build, "restage"), os.path.join(build, "tests", "libfaults.so"), folder
        with open(os.path.join(folder, "tiny.yaml"), "w") as f:
            f.write(config)
        self.words = ["train", "tiny.yaml", "loop.checkpoint_every=1", "loop.export=best", "--quiet", "--threads", "1"]
        before = time.time()
        out, err, code = self.run(*self.words, "run_root=whole")
        self.seconds = time.time() - before
        assert code == 0, err
        self.whole = self.left(out.strip())
        self.short = [*self.words, "stages=[deformation]"]
        out, err, code = self.run(*self.short, "run_root=whole")
        assert code == 0, err
        self.whole_short = self.left(out.strip())

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def start(self, *arguments, faults=None, before=None):
        environment = dict(os.environ)
        if faults is not None:
            environment.update({"LD_PRELOAD": self.faults, **{k: str(v) for k, v in faults.items()}})
        return subprocess.Popen([self.program, *arguments], cwd=self.folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                text=True, preexec_fn=before)

    def run(self, *arguments, **more):
        process = self.start(*arguments, **more)
        return *process.communicate(timeout=300), process.returncode

    def left(self, run):
        """Weights and curves."""
        found = {}
        for name in ("weights.safetensors", "metrics.jsonl"):
            with open(self.path(run, name), "rb") as f:
                found[name] = f.read()
        return found

    def runs(self, root):
        """Complete ones, which have a configuration; drafts are hidden."""
        return [os.path.relpath(os.path.dirname(p), self.folder) for p in glob.glob(self.path(root, "*", "config.yaml"))]

    def ends_well(self, root, short=True):
        """Goes on with what is there, or anew, undisturbed; the same bytes."""
        runs = self.runs(root)
        assert len(runs) <= 1, runs
        words = ["train", "resume=" + runs[0], "--quiet"] if runs else [*(self.short if short else self.words), "run_root=" + root]
        out, err, code = self.run(*words)
        assert code == 0, err
        assert self.left(out.strip()) == (self.whole_short if short else self.whole), "other bytes"
        lost = [n for n in os.listdir(self.path(out.strip())) + os.listdir(self.path(out.strip(), "checkpoints")) if n.startswith(".") and n != ".lock"]
        assert not lost, lost
        shutil.rmtree(self.path(root))


def kills(world, options, chance):
    done = trainings = 0
    while done < options.kills:
        trainings += 1
        root = "killed%d" % trainings
        words = [*world.words, "run_root=" + root]
        while done < options.kills:
            process = world.start(*words)
            time.sleep(chance.uniform(0, 0.6 * world.seconds))
            process.kill()
            process.communicate()
            done += process.returncode == -signal.SIGKILL
            if process.returncode == 0:
                break
            assert process.returncode == -signal.SIGKILL, process.returncode
            runs = world.runs(root)
            words = ["train", "resume=" + runs[0], "--quiet", "--threads", str(chance.choice((1, 2)))] if runs else words
        world.ends_well(root, short=False)
    return "%d kills over %d trainings" % (done, trainings)


def system_calls(world, options, _):
    """Every call, with each kind of failure."""
    folder = world.path("faulty")
    count = world.path("count")
    _, err, code = world.run(*world.short, "run_root=faulty", faults={"RESTAGE_FAULT_FOLDER": folder, "RESTAGE_FAULT_COUNT": count})
    assert code == 0, err
    with open(count) as f:
        calls = int(f.read())
    assert calls > 50, calls
    world.ends_well("faulty")
    ends = {}
    for kind in ("ENOSPC", "EIO", "SHORT"):
        for at in range(1, calls + 1, options.every):
            _, err, code = world.run(*world.short, "run_root=faulty", faults={
                "RESTAGE_FAULT_FOLDER": folder, "RESTAGE_FAULT_AT": at, "RESTAGE_FAULT_KIND": kind})
            where = "%s at call %d of %d: " % (kind, at, calls)
            assert code in (0, 1), where + "exit code %d: %s" % (code, err[-400:])
            ends[kind, code] = ends.get((kind, code), 0) + 1
            if code == 1:
                assert kind != "SHORT", where + "a short write is no failure: " + err
                line = err.strip().splitlines()[-1]
                assert line.startswith("restage: ") and NAMES[kind] in line, where + repr(err[-400:])
            try:
                world.ends_well("faulty")
            except AssertionError as wrong:
                raise AssertionError(where + str(wrong)) from wrong
    told = ", ".join("%s %d told and %d survived" % (k, ends.get((k, 1), 0), ends.get((k, 0), 0)) for k in ("ENOSPC", "EIO", "SHORT"))
    return "%d calls of the system; every %d: %s" % (calls, options.every, told)


def read_only_folder(world, *_):
    os.mkdir(world.path("closed"))
    os.chmod(world.path("closed"), 0o555)
    as_nobody = (lambda: os.setuid(NOBODY)) if os.geteuid() == 0 else None
    if as_nobody:
        for folder in (world.folder, os.path.dirname(world.program)):
            if not os.stat(folder).st_mode & 0o005:
                os.chmod(folder, 0o755)
    try:
        _, err, code = world.run(*world.short, "run_root=closed", before=as_nobody)
    except PermissionError:
        return "skipped: another user cannot start the program here"
    if code == 126:
        return "skipped: another user cannot read the program here"
    assert code == 2 and err.count("\n") == 1 and "Permission denied" in err, (code, err)
    assert os.listdir(world.path("closed")) == []
    os.rmdir(world.path("closed"))
    return "told in one line"


def clock(world, *_):
    out, err, code = world.run(*world.words, "run_root=jumping", faults={"RESTAGE_CLOCK_JUMPS": 1})
    assert code == 0, err
    assert world.left(out.strip()) == world.whole, "other bytes"
    world.ends_well("jumping", short=False)
    return "jumps of a day to and fro, the same bytes"


def damage(world, options, chance):
    """One checkpoint after the other: told, and the one before is taken."""
    told = 0
    for keep in (2, 3, 4):
        out, err, code = world.run(*world.short, "run_root=damaged", "loop.keep=%d" % keep)
        assert code == 0, err
        run = out.strip()
        checkpoints = sorted(os.listdir(world.path(run, "checkpoints")))
        best = [c for c in checkpoints if c not in checkpoints[-keep:]]  # what it hands on stays as it is
        for name in checkpoints[-keep + 1:]:
            place = world.path(run, "checkpoints", name)
            with open(place, "r+b") as f:
                f.seek(chance.randrange(os.path.getsize(place)))
                byte = f.read(1)
                f.seek(-1, os.SEEK_CUR)
                f.write(bytes([byte[0] ^ 1]))
        os.remove(world.path(run, "weights.safetensors"))
        out, err, code = world.run("train", "resume=" + run)
        if code == 2 and not best:  # the best one was among the damaged ones
            assert "damaged" in err, err
        else:
            assert code == 0, err
            for name in checkpoints[-keep + 1:]:
                assert name in err, err
            told += keep - 1
            assert world.left(run) == world.whole_short, "other bytes"
        shutil.rmtree(world.path("damaged"))
    assert told > 0
    return "%d damaged checkpoints told" % told


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--seed", type=int, default=None)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    seed = random.randrange(1 << 32) if options.seed is None else options.seed
    build = os.path.abspath(options.build)
    os.environ["RESTAGE_PROGRAM"], os.environ["RESTAGE_MAKE_H5"] = os.path.join(build, "restage"), ""
    from tiny_run import CONFIG
    print("seed %d" % seed, flush=True)
    failed = 0
    with tempfile.TemporaryDirectory(prefix="restage-faults-") as folder:
        world = World(build, os.path.realpath(folder), CONFIG)
        for check in (kills, system_calls, read_only_folder, clock, damage):
            if options.only and check.__name__ not in options.only.split(","):
                continue
            try:
                said = check(world, options, random.Random("%d %s" % (seed, check.__name__)))
                print("%-18s %s" % (check.__name__, said), flush=True)
            except AssertionError as wrong:
                failed += 1
                print("%-18s FAILED: %s" % (check.__name__, wrong), flush=True)
                for root in ("faulty", "damaged", "closed", "jumping"):
                    shutil.rmtree(world.path(root), ignore_errors=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
