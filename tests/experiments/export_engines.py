#!/usr/bin/env python3
"""Runs the scripts of `restage sweep export` by the engines they are for: GNU parallel, Snakemake, and a Slurm of
one node that this test starts itself. Usage: export_engines.py RESTAGE [unittest arguments].

Twice: with a stand-in for the trials (a shell script that writes result.json), to see that every engine calls the
right commands, whatever the folder is called, and that result files alone decide what is done; and with real ones,
whose artifacts must have the bytes that our own pool makes. An engine that is not there is skipped with its reason;
with RESTAGE_CI=1 that is a failure.
"""
import contextlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

RESTAGE = os.path.abspath(sys.argv.pop(1))
IN_CI = os.environ.get("RESTAGE_CI") == "1"

# trial DIR ID [--stage STAGE] [--threads N]: writes down its call; fails as often as DIR/fail-ID has lines.
STAND_IN = r"""#!/bin/bash
[ "$1" = trial ] || exit 2
dir=$2 id=$3 stage=
shift 3
while [ $# -gt 0 ]; do case $1 in --stage) stage=$2 ;; --threads) threads=$2 ;; *) exit 2 ;; esac; shift 2; done
echo "$id $stage $threads" >> "$dir/calls.txt"
result=$dir/trials/$id/result.json
[ -z "$stage" ] || exit 0
grep -q '"done"' "$result" 2> /dev/null && exit 0
if [ -s "$dir/fail-$id" ]; then
  sed -i 1d "$dir/fail-$id"
  echo '{"state": "failed"}' > "$result"
  exit 1
fi
echo '{"state": "done"}' > "$result"
"""


# Real trials: two motion networks with two seeds over one deformation stage a seed.
BASE = """seed: 3
stages: [motion, deformation]
data:
  bodies: {train: 2, validation: 2, test: 2}
  motions: {train: 4, validation: 2, test: 2}
motion: {sizes: {hidden: 16}, optimiser: {steps: 8, batch: 4}, windows: {frames: 8}, validation_windows: 2, validation_frames: 8}
deformation: {optimiser: {steps: 8, batch: 2}, pairs: {points: 32}, validation_pairs: 2}
evaluation: {sequences: 1, frames: 5}
"""
SWEEP = "base: base.yaml\ngrid: {motion.weights.smoothness: [0, 0.1]}\nseeds: [1, 2]\n"


class NeedsPrograms(unittest.TestCase):
    def need(self, *programs):
        missing = [p for p in programs if not shutil.which(p, path=os.environ["PATH"] + ":/usr/sbin:/sbin")]
        if missing and IN_CI:
            self.fail(f"{', '.join(missing)} must be there in CI")
        if missing:
            self.skipTest(f"{', '.join(missing)} not installed")


class RealTrials(NeedsPrograms):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="restage-engines-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        for name, text in (("base.yaml", BASE), ("sweep.yaml", SWEEP)):
            with open(os.path.join(cls.folder, name), "w") as f:
                f.write(text)
        cls.restage("sweep", "run", "sweep.yaml", "--out", "pool", "store=store-pool")

    @classmethod
    def restage(cls, *arguments):
        done = subprocess.run([RESTAGE, *arguments, "--quiet"], cwd=cls.folder, capture_output=True, text=True)
        if done.returncode != 0:
            raise AssertionError(done.stderr)
        return done.stdout

    def artifacts(self, engine):
        """{path: bytes} of a store; nothing that was in the making may be left."""
        found = {}
        for at, _, names in os.walk(os.path.join(self.folder, "store-" + engine)):
            for name in names:
                with open(os.path.join(at, name), "rb") as f:
                    found[os.path.relpath(f.name, os.path.join(self.folder, "store-" + engine))] = f.read()
        return found

    def check(self, engine, run, *more):
        self.restage("sweep", "plan", "sweep.yaml", "--out", engine, "store=store-" + engine)
        script = os.path.join(self.folder, engine + ".script")
        self.said = json.loads(self.restage("sweep", "export", engine, "--engine", engine, "--out", script, "--json", *more))
        self.assertEqual(run(script), 0)
        counts = json.loads(self.restage("sweep", "status", engine, "--json"))["counts"]
        self.assertEqual((counts["done"], counts["pending"] + counts["failed"] + counts["running"] + counts["stopped"]), (4, 0))
        self.assertEqual(len(self.artifacts("pool")), 6 * 4)
        self.assertEqual(self.artifacts(engine), self.artifacts("pool"))

    def test_parallel(self):
        self.need("parallel")

        def run(script):
            with open(script) as f:
                return subprocess.run(["parallel", "--will-cite", "-j2"], stdin=f, capture_output=True, timeout=300).returncode
        self.check("parallel", run)

    def test_snakemake(self):
        self.need("snakemake")
        self.check("snakemake", lambda script: subprocess.run(
            ["snakemake", "--cores", "2", "-s", script, "-d", self.folder], capture_output=True, timeout=300).returncode, "--measure")
        with open(os.path.join(self.folder, "snakemake.script")) as f:
            self.assertIn('"mem_mb": %d' % self.said["megabytes"], f.read())

    def test_slurm(self):
        self.need("munged", "slurmctld", "slurmd", "sbatch")
        if os.geteuid() != 0:
            self.skipTest("a Slurm of one's own needs root")
        with Slurm(self) as slurm:
            def run(script):
                """What Slurm understood of the script, then the jobs."""
                held = subprocess.run(["sbatch", "--hold", "--parsable", "--output=/dev/null", script], env=slurm.environment,
                                      capture_output=True, text=True, timeout=60)
                self.assertEqual(held.returncode, 0, held.stderr)
                job = held.stdout.strip()
                shown = subprocess.run(["scontrol", "show", "job", job], env=slurm.environment, capture_output=True, text=True).stdout
                subprocess.run(["scancel", job], env=slurm.environment)
                minutes = self.said["minutes"]
                for words in ("ArrayTaskId=0-3", "Requeue=1", "CPUs/Task=%d" % self.said["threads"], "MinMemoryNode=",
                              "TimeLimit=%02d:%02d:00" % (minutes // 60, minutes % 60)):
                    self.assertIn(words, shown)
                return subprocess.run(["sbatch", "--wait", "--output=/dev/null", script], env=slurm.environment,
                                      capture_output=True, timeout=300).returncode
            self.check("slurm", run, "--measure")
            with open(os.path.join(self.folder, "slurm.script")) as f:
                script = f.read()
            self.assertIn("#SBATCH --mem=%dM\n" % self.said["megabytes"], script)
            self.assertIn("#SBATCH --cpus-per-task=%d\n" % min(4, os.cpu_count()), script)
            self.assertTrue(10 <= self.said["minutes"] < 30, self.said)
            self.assertTrue(64 <= self.said["megabytes"] < 8000, self.said)


class Engines(NeedsPrograms):
    def setUp(self):
        base = tempfile.mkdtemp(prefix="restage-engines-")
        self.addCleanup(shutil.rmtree, base, ignore_errors=True)
        self.folder = os.path.join(base, "it's a $HOME \"sweep\" & more")
        os.makedirs(self.folder)
        self.program = os.path.join(base, "my restage")
        with open(self.program, "w") as f:
            f.write(STAND_IN)
        os.chmod(self.program, 0o755)
        self.ids = [f"{i:012x}" for i in range(1, 6)]
        # One extractor for all, two motion networks for two each, a fifth with all of its own.
        motion = ["m00000000001", "m00000000001", "m00000000002", "m00000000002", "m00000000003"]
        trials = [{"id": i, "case": "", "seed": n, "overrides": {}, "artifacts": {"skeleton": "s00000000001", "motion": m}}
                  for n, (i, m) in enumerate(zip(self.ids, motion))]
        with open(self.path("plan.json"), "w") as f:
            json.dump({"trials": trials, "artifacts": {"there": 0, "to_make": 4, "shared": 3}}, f)
        for i in self.ids:
            os.makedirs(self.path("trials", i))

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def export(self, engine, *more):
        script = self.path(f"the {engine} script")
        made = subprocess.run([RESTAGE, "sweep", "export", self.folder, "--engine", engine, "--out", script,
                               "--program", self.program, *more], capture_output=True, text=True)
        self.assertEqual(made.returncode, 0, made.stderr)
        return script

    def calls(self):
        """(id, stage, threads) since the last question, in order."""
        place = self.path("calls.txt")
        if not os.path.exists(place):
            return []
        with open(place) as f:
            lines = [tuple(line.rstrip("\n").split(" ")) for line in f]
        os.remove(place)
        return lines

    def states(self):
        found = {}
        for i in self.ids:
            if os.path.exists(self.path("trials", i, "result.json")):
                with open(self.path("trials", i, "result.json")) as f:
                    found[i] = json.load(f)["state"]
        return found

    def fail_once(self, i):
        with open(self.path("fail-" + i), "w") as f:
            f.write("x\n")

    def two_rounds(self, run, first_code_is_zero=False):
        """One trial fails and ends no other; the engine, called again, makes it; a result that is lost is made again."""
        self.fail_once(self.ids[2])
        code = run()
        if not first_code_is_zero:
            self.assertNotEqual(code, 0)
        self.assertEqual(self.states(), {i: "failed" if i == self.ids[2] else "done" for i in self.ids})
        first = self.calls()
        self.assertEqual(sorted(c[0] for c in first if not c[1]), self.ids)
        self.assertEqual(run(), 0)
        self.assertEqual(set(self.states().values()), {"done"})
        self.assertEqual(len(self.states()), 5)
        second = self.calls()
        os.remove(self.path("trials", self.ids[0], "result.json"))
        self.assertEqual(run(), 0)
        self.assertEqual(self.states()[self.ids[0]], "done")
        self.calls()
        return first, second

    def test_parallel(self):
        self.need("parallel")
        script = self.export("parallel", "--threads", "3")

        def run():
            with open(script) as f:
                return subprocess.run(["parallel", "--will-cite", "-j2"], stdin=f, capture_output=True, timeout=60).returncode
        first, _ = self.two_rounds(run)
        self.assertEqual({c[2] for c in first}, {"3"})

    def test_snakemake(self):
        self.need("snakemake")
        script = self.export("snakemake")

        def run():
            done = subprocess.run(["snakemake", "--cores", "2", "-k", "-s", script, "-d", os.path.dirname(self.folder)],
                                  capture_output=True, text=True, timeout=200)
            self.output = done.stderr
            return done.returncode
        first, second = self.two_rounds(run)
        stages = [c[1] for c in first if c[1]]
        self.assertEqual(sorted(stages), ["motion", "motion", "skeleton"], self.output)  # shared ones, once each
        self.assertEqual(stages[0], "skeleton")
        self.assertEqual([c[0] for c in second if not c[1]], [self.ids[2]])  # what is done is not even called
        self.assertEqual(run(), 0)
        self.assertEqual(self.calls(), [])

    def test_slurm(self):
        self.need("munged", "slurmctld", "slurmd", "sbatch")
        if os.geteuid() != 0:
            self.skipTest("a Slurm of one's own needs root")
        script = self.export("slurm", "--threads", "1")
        with Slurm(self) as slurm:
            def run():
                done = subprocess.run(["sbatch", "--wait", "--output=/dev/null", script], env=slurm.environment,
                                      capture_output=True, text=True, timeout=120)
                self.assertIn("Submitted batch job", done.stdout, done.stderr)
                return done.returncode
            first, _ = self.two_rounds(run)
            self.assertEqual({c[2] for c in first}, {"1"})

    def test_a_slurm_job_told_to_stop_passes_it_on_and_waits(self):
        """Slurm sends TERM to the script's shell alone; the trial needs time for its checkpoint."""
        with open(self.program, "w") as f:
            f.write('#!/bin/bash\ntrap \'sleep 1; echo checkpoint > "$2/checkpoint"; exit 143\' TERM\n'
                    'echo > "$2/started"; while true; do sleep 0.1; done\n')
        job = subprocess.Popen(["bash", self.export("slurm")], env=dict(os.environ, SLURM_ARRAY_TASK_ID="4"),
                               start_new_session=True)

        def end_all():  # what the shell started must not outlive it: it holds this test's output open
            with contextlib.suppress(ProcessLookupError):
                os.killpg(job.pid, signal.SIGKILL)
            job.wait()
        self.addCleanup(end_all)
        end = time.monotonic() + 30
        while not os.path.exists(self.path("started")) and time.monotonic() < end:
            time.sleep(0.05)
        job.terminate()
        self.assertEqual(job.wait(30), 143)
        self.assertTrue(os.path.exists(self.path("checkpoint")))

    def test_a_slurm_job_whose_time_is_up_queues_itself_again(self):
        """Slurm sends USR1 two minutes before: the trial writes a checkpoint, and goes on in the next job."""
        with open(self.program, "w") as f:
            f.write('#!/bin/bash\ntrap \'exit 143\' TERM\necho > "$2/started"; while true; do sleep 0.1; done\n')
        tools = os.path.join(os.path.dirname(self.program), "bin")
        os.mkdir(tools)
        with open(os.path.join(tools, "scontrol"), "w") as f:
            f.write('#!/bin/bash\necho "$*" >> "%s"\n' % os.path.join(tools, "said"))
        os.chmod(os.path.join(tools, "scontrol"), 0o755)
        script = self.export("slurm", "--mem", "3000", "--time", "95")
        with open(script) as f:
            text = f.read()
        self.assertIn("#SBATCH --mem=3000M\n#SBATCH --time=1:35:00\n", text)
        self.assertIn("#SBATCH --signal=B:USR1@120\n", text)
        for number, said in ((signal.SIGTERM, False), (signal.SIGUSR1, True)):
            job = subprocess.Popen(["bash", script], start_new_session=True,
                                   env=dict(os.environ, SLURM_ARRAY_TASK_ID="4", SLURM_JOB_ID="77", PATH=tools + ":" + os.environ["PATH"]))
            end = time.monotonic() + 30
            while not os.path.exists(self.path("started")) and time.monotonic() < end:
                time.sleep(0.05)
            job.send_signal(number)
            self.assertEqual(job.wait(30), 143)
            self.assertEqual(os.path.exists(os.path.join(tools, "said")), said)
            os.remove(self.path("started"))
        with open(os.path.join(tools, "said")) as f:
            self.assertEqual(f.read(), "requeue 77\n")

    def test_more_trials_than_an_array_may_have_tasks(self):
        trials = [{"id": f"{i:012x}", "case": "", "seed": i, "overrides": {}, "artifacts": {}} for i in range(2500)]
        with open(self.path("plan.json"), "w") as f:
            json.dump({"trials": trials}, f)
        script = self.export("slurm")
        with open(script) as f:
            self.assertIn("#SBATCH --array=0-999\n", f.read())
        subprocess.run(["bash", script], env=dict(os.environ, SLURM_ARRAY_TASK_ID="499"), timeout=60, stderr=subprocess.DEVNULL)
        self.assertEqual([int(c[0], 16) for c in self.calls()], [499, 1499, 2499])


class Slurm:
    """A Slurm of one node with its own key, ports and folders; everything ends and goes with the context."""

    def __init__(self, test):
        self.test, self.daemons = test, []

    def path(self, name):
        return os.path.join(self.folder, name)

    def __enter__(self):
        self.folder = tempfile.mkdtemp(prefix="restage-slurm-")
        os.chmod(self.folder, 0o755)  # munged refuses a socket in a closed folder
        self.environment = dict(os.environ, SLURM_CONF=self.path("slurm.conf"))
        try:
            self.configure()
            self.start("munged", "--foreground", "--force", "--key-file=" + self.path("munge.key"), "--socket=" + self.path("munge.socket"),
                       "--pid-file=" + self.path("munged.pid"), "--log-file=" + self.path("munged.log"), "--seed-file=" + self.path("munged.seed"))
            self.wait_for(lambda: os.path.exists(self.path("munge.socket")), "munged makes no socket")
            self.start("slurmctld", "-D", "-f", self.path("slurm.conf"))
            self.start("slurmd", "-D", "-f", self.path("slurm.conf"))
            self.wait_for(lambda: self.state() == "idle", "the node does not become idle")
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        for daemon in reversed(self.daemons):
            daemon.terminate()
            try:
                daemon.wait(20)
            except subprocess.TimeoutExpired:
                daemon.send_signal(signal.SIGKILL)
                daemon.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def configure(self):
        with open(self.path("munge.key"), "wb") as f:
            f.write(os.urandom(128))
        os.chmod(self.path("munge.key"), 0o400)
        for name in ("state", "spool"):
            os.mkdir(self.path(name))
        host = socket.gethostname().split(".")[0]
        lines = {"ClusterName": "restage", "SlurmctldHost": f"{host}(127.0.0.1)", "SlurmctldPort": free_port(), "SlurmdPort": free_port(),
                 "SlurmUser": "root", "SlurmdUser": "root", "AuthType": "auth/munge", "AuthInfo": "socket=" + self.path("munge.socket"),
                 "StateSaveLocation": self.path("state"), "SlurmdSpoolDir": self.path("spool"),
                 "SlurmctldPidFile": self.path("slurmctld.pid"), "SlurmdPidFile": self.path("slurmd.pid"),
                 "SlurmctldLogFile": self.path("slurmctld.log"), "SlurmdLogFile": self.path("slurmd.log"),
                 "ProctrackType": "proctrack/pgid", "TaskPlugin": "task/none", "JobAcctGatherType": "jobacct_gather/none",
                 "AccountingStorageType": "accounting_storage/none", "MpiDefault": "none", "SwitchType": "switch/none",
                 "ReturnToService": 2, "SchedulerType": "sched/builtin", "SelectType": "select/cons_tres", "SelectTypeParameters": "CR_CPU",
                 "SlurmdParameters": "config_overrides"}
        with open("/proc/meminfo") as f:
            memory = int(f.readline().split()[1]) // 1024
        with open(self.path("slurm.conf"), "w") as f:
            f.writelines(f"{key}={value}\n" for key, value in lines.items())
            f.write(f"NodeName={host} NodeAddr=127.0.0.1 CPUs={os.cpu_count()} RealMemory={memory} State=UNKNOWN\n")
            f.write(f"PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP\n")
        # slurmd wants a cgroup plugin although nothing uses one; this one looks for no cgroups before it must.
        with open(self.path("cgroup.conf"), "w") as f:
            f.write(f"CgroupPlugin=cgroup/v1\nCgroupMountpoint={self.path('cgroup')}\n")

    def start(self, program, *arguments):
        place = shutil.which(program, path=os.environ["PATH"] + ":/usr/sbin:/sbin")
        with open(self.path(program + ".out"), "w") as log:
            self.daemons.append(subprocess.Popen([place, *arguments], env=self.environment, stdout=log, stderr=log, stdin=subprocess.DEVNULL))

    def state(self):
        return subprocess.run(["sinfo", "-h", "-o", "%T"], env=self.environment, capture_output=True, text=True).stdout.strip()

    def wait_for(self, holds, wrong, seconds=60):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if holds():
                return
            time.sleep(0.5)
        words = wrong
        for name in ("munged.out", "slurmctld.out", "slurmd.out"):
            if os.path.exists(self.path(name)):
                with open(self.path(name), errors="replace") as f:
                    words += f"\n{name}: " + " | ".join(line.strip() for line in f if "rror" in line)[-300:]
        (self.test.fail if IN_CI else self.test.skipTest)("no Slurm can be started here: " + words)


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


if __name__ == "__main__":
    unittest.main()
