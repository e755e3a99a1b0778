"""restage train: the run directory, its files, resuming, stopping, and what is wrong with inputs."""
import json
import os
import random
import shutil
import signal
import time

from support import CliTest, small_disk
from tiny_run import CONFIG

LONG = ["stages=[skeleton]", "skeleton.optimiser.steps=1000000", "loop.checkpoint_every=1000000", "loop.validate_every=1000000"]


class Train(CliTest):
    def setUp(self):
        super().setUp()
        self.write("tiny.yaml", CONFIG)

    def train(self, *arguments):
        """A training that succeeds; its run directory."""
        return self.done("train", *arguments, "--quiet").strip()

    def weights_of(self, run):
        return self.bytes(os.path.join(run, "weights.safetensors"))

    def checkpoints(self, run):
        return [n for n in sorted(os.listdir(self.path(run + "/checkpoints"))) if n.endswith(".safetensors")]

    def begin(self, *arguments):
        """A training in the background and its run directory, which is the first that it prints."""
        process = self.start("train", *arguments)
        return process, process.stdout.readline().strip()


class Runs(Train):
    def test_a_run_is_judged_on_its_held_out_data(self):
        run = self.train("tiny.yaml", "data.bodies.test=2", "evaluation.sequences=2", "evaluation.frames=20")
        held = self.json("eval", "run=" + run, "--out", "judged")
        summed = self.json("eval", "run=" + run, "--anchor", 0)
        self.assertEqual((held["anchor"], summed["anchor"], len(held["sequences"])), (0.25, 0, 2))
        for found in (held, held["true_skeletons"]):
            self.assertEqual(sorted(found["references"]), ["closed_form", "rest_pose", "source_unchanged"])
        # From true skeletons. (What ten steps make of an extractor is good for neither.)
        closed, trained = held["true_skeletons"]["references"]["closed_form"]["mpjpe"], held["true_skeletons"]["mean"]["mpjpe"]
        self.assertLess(closed, trained, "ten steps of training")
        # The anchor moves the path and nothing else.
        self.assertAlmostEqual(held["mean"]["pa_mpjpe"], summed["mean"]["pa_mpjpe"], 6)
        self.assertNotAlmostEqual(held["mean"]["mpjpe"], summed["mean"]["mpjpe"], 3)
        self.assertIn("within 0.25 s", self.bytes("judged/metrics.md").decode())
        self.assertEqual(sorted(os.listdir(self.path("judged"))), ["metrics.md", "rest.h5", "source.h5", "target.ply", "truth.h5"])
        self.bad_input(["eval", "run=" + run, "--anchor", "-1"], "--anchor")
        self.bad_input(["eval", "run=" + run, "--out", "tiny.yaml"], "tiny.yaml", "cannot be made a folder")
        self.bad_input(["eval", "run=" + run, "--device", "abacus"], "'abacus' is none", "take one of: cpu")
        self.assertEqual(self.json("eval", "run=" + run, "--device", "cpu"), held)
        self.bad_input(["eval", "run=nowhere"], "nowhere")

    def test_any_stages_can_be_judged(self):
        small = ("data.bodies.test=2", "evaluation.sequences=1", "evaluation.frames=5")
        found = {}
        for stages in ("skeleton", "motion", "deformation", "skeleton,motion"):
            run = self.train("tiny.yaml", "stages=[%s]" % stages, *small)
            found[stages] = self.json("eval", "run=" + run)
            self.assertIn("Not measured", self.done("eval", "run=" + run), stages)
        self.assertEqual({k: v["condition"] for k, v in found.items()},
                         {"skeleton": "source_joints", "motion": "true_skeletons", "deformation": "true_poses", "skeleton,motion": "clouds"})
        for joints in (found["skeleton"], found["skeleton"]["rest_joints"]):
            self.assertGreater(joints["mean"]["mpjpe"], 0)
            self.assertIsNone(joints["mean"]["mpvd"], "an extractor has no surface")
        self.assertGreater(found["skeleton"]["extractor"]["joint_error_mm"], 0)
        self.assertNotIn("extractor", found["motion"])
        self.assertIn("clouds: no model for skeleton", found["motion"]["missing"])
        self.assertGreater(found["motion"]["mean"]["pa_mpjpe"], 0)
        self.assertIsNone(found["motion"]["mean"]["mpvd"], "no surface was trained")
        self.assertGreater(found["deformation"]["mean"]["mpvd"], 0)
        self.assertIn("true_skeletons", found["skeleton,motion"])

    def test_stages_from_elsewhere(self):
        first = self.train("tiny.yaml", "stages=[skeleton,motion]")
        # Taken as it is: not trained, part of the run's weights. Started from: other bits than from nothing.
        run = self.train("tiny.yaml", "skeleton.from=" + first, "motion.init=" + first, "seed=2")
        plain = self.train("tiny.yaml", "skeleton.from=" + first, "seed=2")
        encoder = self.train("tiny.yaml", "skeleton.from=" + first, "motion.init=" + first, "motion.init_names=[smrm.enc.*]", "seed=2")
        def part(where, model):
            self.done("weights", "export", "--source", where, "--model", model, "--out", "part.safetensors")
            return self.bytes("part.safetensors")
        self.assertEqual(part(run, "skeleton"), part(first, "skeleton"))
        self.assertEqual(self.checkpoints(run)[-1].split("-")[0], "motion")
        self.assertEqual(len({part(r, "motion") for r in (first, run, plain, encoder)}), 4)
        self.assertEqual(part(run, "deformation.weights"), part(plain, "deformation.weights"))
        for words, part in ((["skeleton.from=nowhere"], "nowhere"), (["deformation.from=" + first], "no model for deformation.weights"),
                            (["motion.init=" + first, "motion.sizes.hidden=8"], "smrm.enc.weight_ih_l0"),
                            (["motion.init=" + first, "motion.init_names=[smrm.encoder.*]"], "smrm.encoder.*"),
                            (["motion.init=" + first, "motion.init_names=[]"], "init_names is empty"),
                            (["motion.init=" + first, "motion.from=" + first], "motion.init")):
            self.bad_input(["train", "tiny.yaml", *words], part)

    def test_a_run_goes_on_as_it_was_or_not_at_all(self):
        run = self.train("tiny.yaml", "stages=[motion]")
        self.bad_input(["train", "resume=" + run, "--seed", "3"], "--seed")
        line = json.loads(self.bytes(run + "/provenance.json"))["command_line"]
        self.assertEqual(line, ["restage", "train", "tiny.yaml", "stages=[motion]", "--quiet"], "all of it")
        config = self.bytes(run + "/config.yaml").decode()
        self.write(run + "/config.yaml", config.replace("smoothness: 0.1", "smoothness: 0.2"))
        self.bad_input(["train", "resume=" + run], "motion.weights.smoothness", "0.1")
        self.write(run + "/config.yaml", config)
        self.done("train", "resume=" + run, "--quiet")

    def test_a_run_of_an_older_program_goes_on(self):
        run = self.train("tiny.yaml", "stages=[motion]", "motion.optimiser.steps=4")
        config, said = self.bytes(run + "/config.yaml").decode(), json.loads(self.bytes(run + "/provenance.json"))
        # As if the program that began it had not known these keys.
        older = dict(said, configuration={k: v for k, v in said["configuration"].items()
                                          if k not in ("loop.logs.0", "loop.ema", "motion.optimiser.lion.beta1")})
        old = config.replace("  logs:\n    - jsonl\n", "").replace("  ema: 0\n", "")
        self.assertLess(len(old), len(config))
        self.write(run + "/config.yaml", old)
        self.write(run + "/provenance.json", json.dumps(older))
        self.done("train", "resume=" + run, "--quiet")
        self.write(run + "/config.yaml", config)
        self.done("train", "resume=" + run, "--quiet")
        self.write(run + "/config.yaml", config.replace("  ema: 0\n", "  ema: 0.9\n"))
        self.bad_input(["train", "resume=" + run], "'loop.ema' of config.yaml is new and not its default")
        self.write(run + "/config.yaml", config)
        self.write(run + "/provenance.json", json.dumps(dict(older, configuration={})))
        self.bad_input(["train", "resume=" + run], "is new and not its default")

    def test_a_run_goes_on_with_its_data_elsewhere_and_more_steps(self):
        self.done("data", "build", "--bodies", 2, 2, 1, "--motions", 4, 2, 1, "--quiet", "--out", "old.h5")
        words = ["tiny.yaml", "stages=[skeleton]", "skeleton.optimiser.schedule.kind=constant"]
        run = self.train(*words, "data.source=old.h5", "skeleton.optimiser.steps=20")
        whole = self.train(*words, "data.source=old.h5", "skeleton.optimiser.steps=30")
        os.rename(self.path("old.h5"), self.path("new.h5"))
        self.bad_input(["train", "resume=" + run], "old.h5", "data.source=PATH")
        self.done("data", "build", "--bodies", 2, 2, 1, "--motions", 4, 2, 1, "--seed", 4, "--quiet", "--out", "other.h5")
        self.bad_input(["train", "resume=" + run, "data.source=other.h5"], "have changed")
        for word in ("seed=3", "skeleton.optimiser.batch=3", "skeleton.optimiser.steps=10", "motion.optimiser.steps=99"):
            self.bad_input(["train", "resume=" + run, "data.source=new.h5", word], word.split("=")[0])
        self.done("train", "resume=" + run, "data.source=new.h5", "skeleton.optimiser.steps=30", "loop.log_every=7", "--quiet")
        self.assertEqual(self.weights_of(run), self.weights_of(whole), "the same as 30 steps in one go")
        self.assertEqual(json.loads(self.bytes(run + "/provenance.json"))["resumed"][0]["command_line"][3], "data.source=new.h5")
        self.done("train", "resume=" + run, "--quiet")  # the folder says it now

    def test_variables_of_the_environment(self):
        text = self.bytes("tiny.yaml").decode()
        self.write("env.yaml", text.replace("seed:", "run_root: ${oc.env:RESTAGE_TEST_ROOT,here}/deep\nseed:", 1) if "seed:" in text
                   else text + "run_root: ${oc.env:RESTAGE_TEST_ROOT,here}/deep\n")
        keys = self.json("train", "env.yaml", "--print-config")["keys"]
        self.assertEqual(keys["run_root"], "here/deep")
        self.assertEqual(self.json("train", "tiny.yaml", "run_root=~/x", "--print-config")["keys"]["run_root"], os.path.expanduser("~/x"))
        self.bad_input(["train", "tiny.yaml", "run_root=${oc.env:NO_SUCH_NAME}"], "NO_SUCH_NAME")
        self.write("chosen.yaml", "include: ${oc.env:RESTAGE_TEST_BASE,tiny}.yaml\nseed: 5\n")
        self.assertEqual(self.json("train", "chosen.yaml", "--print-config")["keys"]["seed"], 5)
        os.environ["RESTAGE_TEST_BASE"] = "missing"
        self.addCleanup(os.environ.pop, "RESTAGE_TEST_BASE")
        self.bad_input(["train", "chosen.yaml"], "chosen.yaml:1", "the included file 'missing.yaml' does not exist")
        os.environ["RESTAGE_TEST_BASE"] = "${OTHER}/x"
        self.bad_input(["train", "chosen.yaml"], "chosen.yaml:1", "the variable 'RESTAGE_TEST_BASE' holds '${OTHER}/x'", "without ${")
        self.bad_input(["train", "tiny.yaml", "run_root=${oc.env:NO_SUCH_NAME,${HOME}}"], "'NO_SUCH_NAME'", "without ${")
        self.write("refers.yaml", "include: tiny.yaml\nname: ${name}_x\n")
        self.bad_input(["train", "refers.yaml"], "refers.yaml:2", "refers to 'name'")

    def test_what_must_be_known_of_the_weights_is_kept(self):
        run = self.train("tiny.yaml", "motion.windows.remove_heading=true", "motion.windows.translation=relative")
        self.done("weights", "export", "--source", run, "--model", "smrm", "--out", "alone.safetensors")
        self.done("weights", "import", "--source", "alone.safetensors", "--model", "smrm/rot6d", "--with", run, "--out", "again.safetensors")
        self.assertEqual(self.bytes("again.safetensors"), self.weights_of(run))

    def test_run_directory(self):
        result = self.restage("train", "tiny.yaml", "seed=5", "deformation.optimiser.steps=6")
        self.assertEqual(result.code, 0, result.err)
        run = result.out.strip()
        self.assertEqual(result.out, run + "\n", "the run directory and nothing else")
        self.assertTrue(run.startswith("runs/tiny-"), run)
        for name in ("config.yaml", "provenance.json", "metrics.jsonl", "log.txt", "checkpoints", "weights.safetensors"):
            self.assertTrue(os.path.exists(self.path(run + "/" + name)), name)
        self.assertEqual([n for n in os.listdir(self.folder) if n not in ("tiny.yaml", "runs")], [])
        self.assertEqual(os.listdir(self.path("runs")), [os.path.basename(run)])

        self.assertEqual(json.loads(self.bytes(run + "/provenance.json"))["seed"], 5)
        self.assertIn("seed 5", result.err)
        self.assertIn("seed 5", self.bytes(run + "/log.txt").decode())
        self.assertNotIn("\x1b", result.err, "standard error is no terminal")
        lines = [json.loads(line) for line in self.bytes(run + "/metrics.jsonl").decode().splitlines()]
        self.assertEqual([x["step"] for x in lines if x["stage"] == "deformation" and "loss" in x], [2, 4, 6])
        self.assertEqual([x["step"] for x in lines if x["stage"] == "skeleton" and "joint_error_mm" in x], [5, 10])
        self.assertEqual([n.rsplit("-", 1)[0] for n in self.checkpoints(run)],
                         ["deformation-000000004", "deformation-000000006", "motion-000000010", "skeleton-000000010"])

        # The resolved configuration stands for itself: no includes, overrides or defaults are needed.
        again = self.train(self.path(run + "/config.yaml"))
        self.assertNotEqual(again, run)
        self.assertEqual(self.weights_of(again), self.weights_of(run))
        self.assertEqual(self.bytes(again + "/config.yaml"), self.bytes(run + "/config.yaml"))

    def test_seeds(self):
        a, b, c = self.train("tiny.yaml"), self.train("tiny.yaml", "--seed", "4"), self.train("tiny.yaml", "seed=4")
        self.assertNotEqual(self.weights_of(a), self.weights_of(b))
        self.assertEqual(self.weights_of(b), self.weights_of(c))

    def test_other_processes_are_not_passed_over(self):
        os.environ["SLURM_STEP_NUM_TASKS"] = "3"  # srun without what the program needs: three times the same training
        self.addCleanup(os.environ.pop, "SLURM_STEP_NUM_TASKS")
        self.bad_input(["train", "tiny.yaml"], "3", "MPI")
        self.assertFalse(os.path.exists(self.path("runs")))

    def test_micro_batches(self):
        self.bad_input(["train", "tiny.yaml", "loop.micro_batches=3"], "cannot be cut into 3")
        whole, cut, again = (self.weights_of(self.train("tiny.yaml", "loop.micro_batches=%d" % n)) for n in (1, 2, 2))
        self.assertEqual(cut, again)
        self.assertNotEqual(whole, cut)

    def test_any_number_of_threads_gives_the_same_bytes(self):
        runs = [self.train("tiny.yaml", "--threads", n) for n in (1, 2, 3)]
        for run in runs[1:]:
            self.assertEqual(self.weights_of(run), self.weights_of(runs[0]))
            self.assertEqual(self.bytes(run + "/metrics.jsonl"), self.bytes(runs[0] + "/metrics.jsonl"))
            self.assertEqual(self.checkpoints(run), self.checkpoints(runs[0]))

    def test_json(self):
        found = self.json("train", "tiny.yaml", "stages=[deformation]")
        self.assertEqual(found["seed"], 3)
        self.assertTrue(os.path.isdir(self.path(found["run"])))

    def test_stages_and_data_of_choice(self):
        self.done("data", "build", "--out", "data.h5", "--bodies", "2", "2", "1", "--motions", "3", "2", "1")
        run = self.train("tiny.yaml", "data.source=data.h5", "stages=[deformation, skeleton]", "run_root=elsewhere/deep", "name=other")
        self.assertTrue(run.startswith("elsewhere/deep/other-"), run)
        self.assertIn("data.h5", self.bytes(run + "/provenance.json").decode())
        shown = self.json("weights", "show", run + "/weights.safetensors")
        self.assertFalse([t for t in shown["tensors"] if t["name"].startswith("smrm.")])

    def test_divergence_is_a_failure_that_names_op_and_module(self):
        result = self.restage("train", "tiny.yaml", "skeleton.optimiser.schedule.rate=1e25", "--quiet")
        self.assertEqual((result.code, result.err.count("\n")), (1, 1), result.err)
        self.assertIn("skeleton/patch_transformer", result.err)
        self.assertFalse(os.path.exists(self.path(result.out.strip() + "/weights.safetensors")))

    def test_full_disk(self):
        result = self.restage("train", "tiny.yaml", "--quiet", before=lambda: small_disk(1 << 14))
        self.one_line(result, 1, "checkpoints")
        run = result.out.strip()
        self.assertEqual(os.listdir(self.path(run + "/checkpoints")), [])
        self.done("train", "resume=" + run)  # once there is space
        self.assertEqual(self.weights_of(run), self.weights_of(self.train("tiny.yaml")))


class Resume(Train):
    def test_killed_at_any_moment(self):
        whole = self.train("tiny.yaml", "loop.checkpoint_every=1")
        r, kills = random.Random(), 0
        process, run = self.begin("tiny.yaml", "loop.checkpoint_every=1", "--quiet")
        while True:
            time.sleep(r.uniform(0, 0.02 + 0.06 * kills))
            process.kill()
            code = process.wait()
            kills += code == -signal.SIGKILL
            if code == 0 or kills == 4:
                break
            process, again = self.begin("resume=" + run, "--quiet")
            self.assertEqual(again, run)
        self.assertGreater(kills, 0)
        self.assertEqual(self.done("train", "resume=" + run, "--quiet").strip(), run)
        self.assertEqual(self.weights_of(run), self.weights_of(whole), "after %d kills" % kills)
        self.assertEqual(self.bytes(run + "/metrics.jsonl"), self.bytes(whole + "/metrics.jsonl"))
        self.assertEqual(sorted(os.listdir(self.path("runs"))), sorted(os.path.basename(r) for r in (whole, run)))

    def test_signals_write_a_checkpoint(self):
        for number, code in ((signal.SIGTERM, 143), (signal.SIGINT, 130), (signal.SIGUSR1, 138), (signal.SIGHUP, 129)):
            process, run = self.begin("tiny.yaml", *LONG)
            while "1/1000000" not in process.stderr.readline():
                pass
            process.send_signal(number)
            time.sleep(0.01)  # timeout(1) sends its signal to the program, then to the program's group
            process.send_signal(number)
            process.stderr.read()
            self.assertEqual(process.wait(60), code)
            self.assertEqual(len(self.checkpoints(run)), 1)
            self.assertFalse(os.path.exists(self.path(run + "/weights.safetensors")))

    def test_stopped_and_resumed_is_the_same_as_at_one_go(self):
        arguments = ["tiny.yaml", "stages=[skeleton]", "skeleton.optimiser.steps=400", "loop.checkpoint_every=1000", "loop.validate_every=150"]
        whole = self.train(*arguments)
        process, run = self.begin(*arguments)
        process.stderr.readline()
        process.stderr.readline()
        process.send_signal(signal.SIGTERM)
        process.stderr.read()
        self.assertIn(process.wait(60), (143, 0))
        self.done("train", "resume=" + run)
        self.assertEqual(self.weights_of(run), self.weights_of(whole))
        self.assertEqual(self.bytes(run + "/metrics.jsonl"), self.bytes(whole + "/metrics.jsonl"))

    def test_a_device_that_is_not_there_is_refused(self):
        before = sorted(os.listdir(self.path(".")))
        for device, why in (("cuda", "cuda is not in this program"), ("abacus", "'abacus' is none")):
            self.one_line(self.restage("train", "tiny.yaml", "device=" + device), 2, "device", why, "take one of: cpu")
        self.assertEqual(sorted(os.listdir(self.path("."))), before)

    def test_precision_is_float32_or_a_gpus(self):
        plain = self.train("tiny.yaml", "stages=[skeleton]")
        self.assertIn("precision: float32\n", self.bytes(plain + "/config.yaml").decode())
        self.assertNotIn("products in", self.bytes(plain + "/log.txt").decode())
        self.bad_input(["train", "tiny.yaml", "precision=tf32"], "precision", "only GPUs have", "float32, or device: cuda")
        for unknown in ("bfloat16", "float16"):
            self.bad_input(["train", "tiny.yaml", "precision=" + unknown], "precision", unknown, "float32", "tf32")

    def test_run_in_use(self):
        process, run = self.begin("tiny.yaml", *LONG)
        self.bad_input(["train", "resume=" + run], run, "another process")
        process.kill()

    def test_damaged_checkpoint_is_passed_over(self):
        run = self.train("tiny.yaml")
        good = self.weights_of(run)
        newest = self.path(run + "/checkpoints/" + [n for n in self.checkpoints(run) if n.startswith("deformation")][-1])
        with open(newest, "r+b") as f:
            f.seek(1000)
            f.write(b"damage")
        os.remove(self.path(run + "/weights.safetensors"))
        result = self.restage("train", "resume=" + run)
        self.assertEqual(result.code, 0, result.err)
        self.assertIn(os.path.basename(newest), result.err)
        self.assertEqual(self.weights_of(run), good)

    def test_what_cannot_go_on_is_told_before_anything_else(self):
        run = self.train("tiny.yaml")
        shutil.copytree(self.path(run), self.path("good"))

        def broken(name, *contains):
            self.bad_input(["train", "resume=" + run], name, *contains)
            shutil.rmtree(self.path(run))
            shutil.copytree(self.path("good"), self.path(run))

        for name in ("metrics.jsonl", "log.txt", "weights.safetensors"):
            os.remove(self.path(run + "/" + name))
            os.mkfifo(self.path(run + "/" + name))
            broken(name, "pipe")
            os.remove(self.path(run + "/" + name))
            os.symlink(name, self.path(run + "/" + name))
            broken(name, "links")
        first = [n for n in self.checkpoints(run) if n.startswith("skeleton")][-1]
        self.write(run + "/checkpoints/" + first, "damage")
        broken(run, "'skeleton'", "missing or damaged")
        last = self.path(run + "/checkpoints/" + [n for n in self.checkpoints(run) if n.startswith("deformation")][-1])
        os.remove(last)
        os.mkdir(last)
        self.done("train", "resume=" + run, "--quiet")  # from the one before

    def test_bad_resume(self):
        run = self.train("tiny.yaml", "stages=[deformation]")
        self.bad_input(["train", "resume=nowhere"], "nowhere", "run directory")
        self.bad_input(["train", "resume=runs"], "runs", "run directory")
        self.bad_input(["train", "resume="])
        self.bad_input(["train", "resume=" + run, "seed=4"], "'seed'")
        self.bad_input(["train", "tiny.yaml", "resume=" + run])
        self.write(run + "/config.yaml", CONFIG + "speling: 1\n")
        self.bad_input(["train", "resume=" + run], "config.yaml:", "'speling'")


class BadTraining(Train):
    def bad(self, text, *contains, overrides=()):
        """Bad input that makes no run directory."""
        self.write("bad.yaml", text)
        self.bad_input(["train", "bad.yaml", *overrides], *contains)

    def test_keys(self):
        self.bad(CONFIG + "lop: {log_every: 1}\n", "bad.yaml:%d: " % (CONFIG.count("\n") + 1), "'lop'", "'loop'")
        self.bad(CONFIG.replace("hidden: 16", "hiden: 16"), "bad.yaml:", "'hidden'")
        line = CONFIG[:CONFIG.index("windows:")].count("\n") + 1
        self.bad(CONFIG.replace("{frames: 10,", "{frame: 10,"), "bad.yaml:%d: " % line, "'frames'")
        self.bad_input(["train", "tiny.yaml", "motion.window.frames=10"], "motion.window", "windows")
        self.bad_input(["train", "tiny.yaml", "sed=1"], "'seed'")
        for name in ("../x", "a/b", "''"):
            self.bad_input(["train", "tiny.yaml", "name=" + name, "run_root=new"], "name")

    def test_values(self):
        self.bad(CONFIG.replace("seed: 3", "seed: three"), "bad.yaml:2: ")
        self.bad(CONFIG.replace("batch: 4", "batch: 0"), "bad.yaml:", "batch")
        self.bad(CONFIG.replace("batch: 4", "batch: 2147483647"), "bad.yaml:", "batch", "100000")
        self.bad(CONFIG.replace("batch: 4", "batch: [4]"), "bad.yaml:", "batch")
        self.bad(CONFIG + "stages: [skelton]\n", "bad.yaml:", "skeleton")
        self.bad(CONFIG.replace("patch_transformer", "patch_transformr"), "skeleton/patch_transformer")
        self.bad(CONFIG.replace("skeleton/patch_transformer", "smrm/rot6d"), "smrm/rot6d")
        self.bad(CONFIG + "seed: 4\n", "bad.yaml:")
        self.bad("seed: [1\n", "bad.yaml:")
        self.bad(CONFIG + "stages: []\n", "bad.yaml:", "stages")
        self.bad(CONFIG + "stages: [motion, motion]\n", "bad.yaml:", "stages")

    def test_sizes_that_do_not_go_together(self):
        self.bad(CONFIG.replace("{frames: 10,", "{frames: 100000,"))
        self.bad(CONFIG.replace("bodies: {train: 2, validation: 2", "bodies: {train: 2, validation: 0"))
        self.bad(CONFIG.replace("width: 16", "width: 17"))
        self.bad(CONFIG.replace("points: 64", "points: 100000000000"))

    def test_files(self):
        self.bad_input(["train", "none.yaml"], "none.yaml")
        self.bad_input(["train"], "ARGUMENTS")
        self.bad_input(["train", "seed=1"], "CONFIG.yaml")
        self.bad_input(["train", "tiny.yaml", "tiny.yaml"], "two configurations")
        self.bad_input(["train", "tiny.yaml", "data.source=none.h5"], "none.h5")
        self.h5("p.h5", joints=([2, 22, 3], [0.0]))
        self.bad_input(["train", "tiny.yaml", "data.source=p.h5"], "p.h5")
        self.bad_input(["train", "tiny.yaml", "data.source=tiny.yaml"], "tiny.yaml")
        self.bad_input(["train", "tiny.yaml", "run_root=tiny.yaml"], "tiny.yaml")
        self.bad_input(["train", "x" * 3000])
