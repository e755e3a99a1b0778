#!/usr/bin/env python3
"""What a sweep survives: SIGKILL at random moments, two sweepers on one folder, want of memory, a full disk, a clock
that jumps. After each, the bytes of every artifact and result are those of an undisturbed sweep.

    python3 tests/experiments/kill_sweeps.py BUILD_DIR [--kills 50] [--seed N] [--only NAME,...]

Plain Python. The full disk needs root (a small tmpfs), the clock `faketime`; without them these are skipped, and it is
said. Exit code 1 if anything differs."""
import argparse
import contextlib
import hashlib
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "cli"))

SWEEP = """base: tiny.yaml
set: {motion.answers.sequences: 3, motion.answers.frames: 12}
grid: {motion.optimiser.steps: [6, 9]}
seeds: [1, 2]
retries: 1000
"""


def say(text):
    print(text, flush=True)


class World:
    """A folder with a configuration, a sweep file, and what an undisturbed sweep leaves."""

    def __init__(self, program, folder, config):
        self.program, self.folder = program, folder
        with open(self.path("tiny.yaml"), "w") as f:
            f.write(config)
        with open(self.path("sweep.yaml"), "w") as f:
            f.write(SWEEP)

    def path(self, name):
        return os.path.join(self.folder, name)

    def words(self, name, *more):
        return ["sweep", "run", "sweep.yaml", "--out", name, "store=%s-store" % name, "--jobs", "2", *more]

    def start(self, *arguments, prefix=(), before=None):
        return subprocess.Popen([*prefix, self.program, *arguments], cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                text=True, preexec_fn=before)

    def run(self, *arguments, **more):
        process = self.start(*arguments, **more)
        return process.communicate()[1], process.returncode

    def finish(self, name):
        """The sweep, undisturbed from here on."""
        words, code = self.run(*self.words(name))
        if code != 0:
            raise AssertionError("%s: exit code %d: %s" % (name, code, words[-600:]))

    def bytes_of(self, name):
        """Of every artifact and result, by path. Seconds, host and command of a result are of the machine; logs, metrics
        over time and provenance of a run hold times."""
        found = {}
        for root in (self.path(name) + "/trials", self.path(name) + "-store"):
            for folder, folders, files in os.walk(root):
                folders[:] = [f for f in folders if not f.startswith(".")]  # what is being made
                for file in files:
                    where = os.path.relpath(os.path.join(folder, file), root)
                    with open(os.path.join(folder, file), "rb") as f:
                        content = f.read()
                    if file == "result.json":
                        result = json.loads(content)
                        for key in ("seconds", "host", "command"):
                            result.pop(key)
                        content = json.dumps(result, sort_keys=True).encode()
                    elif not (file.endswith(".safetensors") or file in ("config.yaml", "metrics.jsonl", "artifact.json")) or "/checkpoints/" in where:
                        continue
                    found[where] = hashlib.sha256(content).hexdigest()
        return found

    def leftovers(self, name):
        """Drafts, leases and temporary files must not stay behind a finished sweep."""
        return [os.path.join(f, n) for root in (self.path(name), self.path(name) + "-store") for f, folders, files in os.walk(root)
                for n in folders + files if ".part" in n or "lease" in n]

    def same_as(self, whole, name):
        a, b = self.bytes_of(whole), self.bytes_of(name)
        if a != b:
            raise AssertionError("%s differs from the undisturbed sweep in %s" % (name, sorted(k for k in set(a) | set(b) if a.get(k) != b.get(k))[:5]))
        if not a:
            raise AssertionError("nothing to compare")
        if self.leftovers(name):
            raise AssertionError("left behind: %s" % self.leftovers(name)[:5])

    def status(self, name):
        done = subprocess.run([self.program, "sweep", "status", name, "--json"], cwd=self.folder, capture_output=True, text=True)
        return json.loads(done.stdout) if done.returncode == 0 else None

    def trial_processes(self, name):
        found = []
        for trial in (self.status(name) or {"trials": []})["trials"]:
            if trial["holder"]:
                found.append(int(trial["holder"].split()[1]))
        return found


def kill(pid):
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)


def kills(world, count, chance):
    """SIGKILL of the sweeper, of a trial, or of both, each time resumed."""
    hit = {"sweeper": 0, "trial": 0, "both": 0}
    folder = 0
    while sum(hit.values()) < count:
        folder += 1
        name = "killed-%d" % folder
        for _ in range(1000):
            what = chance.choice(sorted(hit))
            sweeper = world.start(*world.words(name))
            time.sleep(chance.uniform(0, world.seconds))
            trials = world.trial_processes(name) if what != "sweeper" else []
            alive = sweeper.poll() is None
            if what != "trial" and alive:
                sweeper.kill()
            for pid in trials:
                kill(pid)
            if alive and (what == "sweeper" or trials):
                hit[what] += 1
            words = sweeper.communicate()[1]  # one that lives tries a killed trial again, and ends well
            if sweeper.returncode not in (0, -signal.SIGKILL):
                raise AssertionError("exit code %d: %s" % (sweeper.returncode, words[-300:]))
            if sweeper.returncode == 0 or sum(hit.values()) >= count:
                break
        world.finish(name)
        world.same_as("whole", name)
        shutil.rmtree(world.path(name))
        shutil.rmtree(world.path(name) + "-store", ignore_errors=True)
    return "%d kills (%s) over %d sweeps" % (sum(hit.values()), ", ".join("%s %d" % x for x in sorted(hit.items())), folder)


def two_sweepers(world, *_):
    both = [world.start(*world.words("two")) for _ in range(2)]
    ends = [(p.communicate()[1], p.returncode) for p in both]
    if any(code != 0 for _, code in ends):
        raise AssertionError("exit codes: %s" % ends)
    world.same_as("whole", "two")
    started = sum(words.count(" started") for words, _ in ends)
    if started > 2 * 4:  # one that comes second sees the lease and ends at once
        raise AssertionError("4 trials were started %d times" % started)
    return "4 trials, %d starts" % started


def no_memory(world, *_):
    """Trials that may not have the memory they need: all fail or are killed, the sweeper says so and ends; with memory it goes on."""
    def little():
        resource.setrlimit(resource.RLIMIT_AS, (world.little_memory, world.little_memory))
    world.run("sweep", "plan", "sweep.yaml", "--out", "memory", "store=memory-store")
    states = []
    for trial in world.status("memory")["trials"]:
        process = world.start("trial", "memory", trial["id"], before=little)
        words = process.communicate()[1]
        states.append(process.returncode)
        if process.returncode == 0:
            raise AssertionError("the limit was no limit")
    world.finish("memory")
    world.same_as("whole", "memory")
    return "exit codes %s, then all done" % sorted(set(states))


def hungry_trial(world, *_):
    """One trial of a sweep takes all memory; the others are done."""
    with open(world.path("hungry.yaml"), "w") as f:
        f.write("base: tiny.yaml\ncases:\n  modest: {}\n  hungry: {motion.optimiser.batch: 100000, motion.sizes.hidden: 512}\n")
    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
    words, code = world.run("sweep", "run", "hungry.yaml", "--out", "hungry", before=limit)
    states = {t["case"]: (t["state"], t["error"]) for t in world.status("hungry")["trials"]}
    if code != 1 or states["modest"][0] != "done" or states["hungry"][0] != "failed" or not states["hungry"][1]:
        raise AssertionError("exit code %d, %s, %s" % (code, states, words[-300:]))
    return "modest done, hungry failed: " + states["hungry"][1][:80]


def full_disk(world, *_):
    if os.geteuid() != 0:
        return "skipped: a small tmpfs needs root"
    place = world.path("small")
    os.mkdir(place)
    made = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=600k", "tmpfs", place], capture_output=True, text=True)
    if made.returncode != 0:
        return "skipped: no tmpfs can be mounted (%s)" % made.stderr.strip()
    try:
        for link in ("disk", "disk-store"):
            os.mkdir(os.path.join(place, link))
            os.symlink(os.path.join("small", link), world.path(link))
        with open(world.path("once.yaml"), "w") as f:
            f.write(SWEEP.replace("retries: 1000", "retries: 0"))
        words, code = world.run(*[w.replace("sweep.yaml", "once.yaml") for w in world.words("disk")])
        if code not in (1, 2):
            raise AssertionError("exit code %d on a full disk: %s" % (code, words[-300:]))
        if "terminate" in words:
            raise AssertionError(words[-300:])
        subprocess.run(["mount", "-o", "remount,size=200m", place], check=True)
        world.finish("disk")
        world.same_as("whole", "disk")
        return "exit code %d while full; with space, all done" % code
    finally:
        subprocess.run(["umount", place], check=False)


def jumping_clock(world, *_):
    if not shutil.which("faketime"):
        return "skipped: no faketime; no lease reads a wall clock"
    year = ("env", "FAKETIME_DONT_FAKE_MONOTONIC=1", "faketime")
    first = world.start(*world.words("clock"), prefix=(*year, "2031-01-01 00:00:00"))
    time.sleep(world.seconds / 3)
    second = world.start(*world.words("clock"), prefix=(*year, "1999-01-01 00:00:00"))
    ends = [(p.communicate()[1][-300:], p.returncode) for p in (first, second)]
    if any(code != 0 for _, code in ends):
        raise AssertionError("exit codes: %s" % ends)
    world.same_as("whole", "clock")
    return "two sweepers 32 years apart"


CHECKS = {"kills": kills, "two_sweepers": two_sweepers, "no_memory": no_memory, "hungry_trial": hungry_trial, "full_disk": full_disk,
          "jumping_clock": jumping_clock}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--kills", type=int, default=6)
    parser.add_argument("--seed", type=int, default=int.from_bytes(os.urandom(3), "little"))
    parser.add_argument("--only", default=",".join(CHECKS))
    options = parser.parse_args()
    build = os.path.abspath(options.build)
    os.environ["RESTAGE_PROGRAM"] = os.environ["RESTAGE_MAKE_H5"] = os.path.join(build, "restage")
    from test_sweep import BASE  # the tiny configuration of the command line's tests
    say("seed %d" % options.seed)
    folder = tempfile.mkdtemp(prefix="restage-kills-")
    failed = False
    try:
        world = World(os.path.join(build, "restage"), folder, BASE.replace("checkpoint_every: 4", "checkpoint_every: 1"))
        start = time.monotonic()
        world.finish("whole")
        world.seconds = time.monotonic() - start
        world.little_memory = 96 << 20
        say("undisturbed: %.1f s, %d files" % (world.seconds, len(world.bytes_of("whole"))))
        for name in options.only.split(","):
            start = time.monotonic()
            try:
                words = CHECKS[name](world, options.kills, random.Random(options.seed))
            except AssertionError as error:
                words, failed = "FAILED: %s" % error, True
            say("%-14s %s (%.0f s)" % (name, words, time.monotonic() - start))
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
