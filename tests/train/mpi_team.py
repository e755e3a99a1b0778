#!/usr/bin/env python3
"""Trainings by several processes (MPI): the bytes of one process, whatever their number; stopped, resumed, killed.

    python3 tests/train/mpi_team.py PROGRAM     (built with -DRESTAGE_MPI=ON)

Plain Python. Exit code 1 if anything differs."""
import hashlib
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "cli"))
PROGRAM = os.path.abspath(sys.argv.pop(1)) if len(sys.argv) > 1 else ""
os.environ.update(RESTAGE_PROGRAM=PROGRAM, RESTAGE_MAKE_H5="")  # tiny_run.py wants them
MPIRUN = ["mpirun", "--allow-run-as-root", "--oversubscribe"]


class MpiTeam(unittest.TestCase):
    def setUp(self):
        from tiny_run import CONFIG
        self.folder = tempfile.mkdtemp(prefix="restage-mpi-")
        # Dropout, a discriminator, and batch norm: what a micro-batch means must not depend on whose it is.
        config = CONFIG.replace("optimiser: {steps: 10, batch: 2}", "optimiser: {steps: 10, batch: 4}")
        with open(os.path.join(self.folder, "tiny.yaml"), "w") as f:
            f.write(config.replace("skeleton/patch_transformer", "skeleton/pointnet").replace(
                "{points: 64, width: 16, layers: 1, centres: 16, neighbours: 4}", "{points: 64}").replace("batch: 4", "batch: 8"))

    def words(self, ranks, *arguments, before=()):
        return [*MPIRUN, "-n", str(ranks), *before, PROGRAM, "train", *arguments, "--quiet", "--threads", "1"]

    def run_ranks(self, ranks, *arguments, before=(), **environment):
        done = subprocess.run(self.words(ranks, *arguments, before=before), cwd=self.folder, capture_output=True, text=True, timeout=120,
                              env={**os.environ, **environment})
        return done.returncode, done.stdout, done.stderr

    def trained(self, ranks, *arguments):
        code, out, err = self.run_ranks(ranks, *arguments)
        self.assertEqual(code, 0, err)
        self.assertEqual(out.count("\n"), 1, "only the first process speaks: " + out)
        return self.bytes_of(out.strip())

    def bytes_of(self, run):
        found = {}
        for name in ("weights.safetensors", "metrics.jsonl"):
            with open(os.path.join(self.folder, run, name), "rb") as f:
                found[name] = hashlib.sha256(f.read()).hexdigest()
        return found

    def test_any_number_of_processes_gives_the_same_bytes(self):
        alone = subprocess.run([PROGRAM, "train", "tiny.yaml", "loop.micro_batches=4", "--quiet"], cwd=self.folder, capture_output=True, text=True)
        self.assertEqual(alone.returncode, 0, alone.stderr)
        first = self.bytes_of(alone.stdout.strip())
        for ranks in (1, 2, 4):
            self.assertEqual(self.trained(ranks, "tiny.yaml", "loop.micro_batches=4"), first, "%d ranks" % ranks)
        self.assertNotEqual(self.trained(2, "tiny.yaml", "loop.micro_batches=2"), first)
        self.assertEqual(sorted(os.listdir(self.folder)), ["runs", "tiny.yaml"])

    def test_best_checkpoints_are_handed_on_by_all(self):
        words = ["tiny.yaml", "loop.micro_batches=2", "loop.export=best", "loop.validate_every=2"]
        self.assertEqual(self.trained(2, *words), self.trained(1, *words))

    def test_they_ask_the_extractor_together(self):
        words = ["tiny.yaml", "loop.micro_batches=4", "motion.answers.sequences=6", "motion.answers.frames=40", "motion.self_first_pass=true"]
        first = self.trained(1, *words)
        for ranks in (2, 4):
            self.assertEqual(self.trained(ranks, *words), first, "%d ranks" % ranks)

    def test_stopped_by_a_signal_and_resumed_by_another_number(self):
        words = ["tiny.yaml", "loop.micro_batches=4", "skeleton.optimiser.steps=60", "loop.checkpoint_every=1000",
                 "loop.export=best", "loop.validate_every=3"]
        whole = self.trained(1, *words)
        process = subprocess.Popen(self.words(2, *words), cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        run = process.stdout.readline().strip()
        metrics = os.path.join(self.folder, run, "metrics.jsonl")
        while not os.path.exists(metrics) or os.path.getsize(metrics) == 0:
            time.sleep(0.05)
        # One rank alone is told to stop.
        ranks = subprocess.run(["pgrep", "-P", str(process.pid)], capture_output=True, text=True).stdout.split()
        os.kill(int(ranks[-1]), signal.SIGTERM)
        out, err = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 143, err)
        self.assertTrue(os.listdir(os.path.join(self.folder, run, "checkpoints")))
        code, _, err = self.run_ranks(4, "resume=" + run)
        self.assertEqual(code, 0, err)
        self.assertEqual(self.bytes_of(run), whole)

    def test_a_rank_that_dies_takes_the_others_with_it(self):
        words = self.words(3, "tiny.yaml", "loop.micro_batches=3", "skeleton.optimiser.batch=6", "skeleton.optimiser.steps=100000",
                           "motion.optimiser.batch=6", "deformation.optimiser.batch=3")
        process = subprocess.Popen(words, cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        process.stdout.readline()
        ranks = subprocess.run(["pgrep", "-P", str(process.pid)], capture_output=True, text=True).stdout.split()
        self.assertEqual(len(ranks), 3)
        time.sleep(0.3)
        os.kill(int(ranks[1]), signal.SIGKILL)
        _, err = process.communicate(timeout=60)
        self.assertNotEqual(process.returncode, 0)
        self.assertIn("rank 1", err)
        self.assertIn(os.uname().nodename, err)

    def test_a_rank_that_fails_says_who_it_is(self):
        words = [*MPIRUN, "-n", "1", PROGRAM, "train", "tiny.yaml", "loop.micro_batches=2", "--quiet", ":",
                 "-n", "1", "-x", "TMPDIR=/nowhere/at/all", PROGRAM, "train", "tiny.yaml", "loop.micro_batches=2", "--quiet"]
        done = subprocess.run(words, cwd=self.folder, capture_output=True, text=True, timeout=60)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("restage: rank 1 of 2 on %s: " % os.uname().nodename, done.stderr)

    def test_bad_numbers(self):
        for ranks, words, environment, part in ((3, ["loop.micro_batches=4"], {}, "3 processes cannot divide"),
                                                (2, [], {}, "is 1, which 2 processes cannot divide"),
                                                (2, ["loop.micro_batches=2"], {"SLURM_NTASKS": "4"}, "Slurm has started 4 tasks, and MPI joins 2")):
            code, out, err = self.run_ranks(ranks, "tiny.yaml", *words, **environment)
            self.assertNotEqual(code, 0)
            self.assertIn(part, err)
            self.assertEqual(out, "")
        lonely = subprocess.run([PROGRAM, "train", "tiny.yaml", "--quiet"], cwd=self.folder, capture_output=True, text=True,
                                env={**os.environ, "SLURM_STEP_NUM_TASKS": "2"})
        self.assertEqual(lonely.returncode, 2)
        self.assertIn("MPI joins 1 of them", lonely.stderr)
        self.assertFalse(os.path.exists(os.path.join(self.folder, "runs")))


if __name__ == "__main__":
    unittest.main()
