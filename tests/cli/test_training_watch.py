"""What a training says about itself: its profile, warnings before hours are lost, the noise of its gradients, how it ended."""
import json
import os
import signal
import time

from support import CliTest
from tiny_run import CONFIG

SKELETON = ["tiny.yaml", "stages=[skeleton]"]


class Watch(CliTest):
    def setUp(self):
        super().setUp()
        self.write("tiny.yaml", CONFIG)

    def train(self, *arguments):
        return self.done("train", *arguments, "--quiet").strip()

    def summary(self, run):
        return json.loads(self.bytes(run + "/summary.json"))


class Profile(Watch):
    def test_a_trace_of_every_stage(self):
        result = self.restage("train", "tiny.yaml", "--profile", "trace.json", "loop.micro_batches=2")
        self.assertEqual(result.code, 0, result.err)
        for words in ("skeleton: profile of 10 steps", "motion: profile of 10 steps", "when a backward pass begins", "backward"):
            self.assertIn(words, result.err)
        trace = json.loads(self.bytes("trace.json"))
        self.assertEqual(sorted(trace), ["displayTimeUnit", "otherData", "traceEvents"])
        spans = {}
        for event in trace["traceEvents"]:
            self.assertIn(event["ph"], ("X", "C", "M"))
            self.assertEqual(event["pid"], 1)
            if event["ph"] == "X":
                self.assertGreaterEqual(event["dur"], 0)
                self.assertIn(event["cat"], ("forward", "backward", "phase"))
                spans.setdefault(event["tid"], []).append((event["ts"], event["ts"] + event["dur"], event["name"]))
            elif event["ph"] == "C":
                self.assertGreaterEqual(event["args"]["MiB"], 0)
        for thread in spans.values():  # on a thread, spans lie within one another or apart, as the viewers need
            open_until = []
            for start, end, name in sorted(thread, key=lambda span: (span[0], -span[1])):
                while open_until and open_until[-1] <= start + 1e-3:
                    open_until.pop()
                if open_until:
                    self.assertLessEqual(end, open_until[-1] + 2e-3, name)
                open_until.append(end)
        for stage in trace["otherData"]["stages"]:
            calls = {(row["op"], row["module"], row["pass"]): row["calls"] for row in stage["ops"]}
            self.assertEqual(stage["steps"], 10)
            self.assertGreater(stage["phases"]["forward"], 0)
            self.assertGreaterEqual(stage["peak_bytes"], stage["bytes_at_backward"])
            self.assertGreater(stage["bytes_at_backward"], 0)
            if stage["stage"] == "deformation":  # ten steps of two micro-batches
                self.assertEqual({kind: calls["linear", "deformation/weights.fc2", kind] for kind in ("forward", "backward")},
                                 {"forward": 20, "backward": 20})
        run = result.out.strip()
        self.assertEqual(self.bytes(run + "/weights.safetensors"),
                         self.bytes(self.train("tiny.yaml", "loop.micro_batches=2") + "/weights.safetensors"), "watching changes nothing")

    def test_where_it_makes_no_sense(self):
        self.bad_input(["train", "tiny.yaml", "--profile", "trace.json", "--dry-run"], "--profile", "--fast-dev-run")
        self.bad_input(["train", "tiny.yaml", "--profile", "nowhere/trace.json"], "nowhere")
        self.assertEqual(self.json("train", *SKELETON, "--profile", "trace.json", "--fast-dev-run")["fast_dev_run"], True)
        self.assertTrue(json.loads(self.bytes("trace.json"))["traceEvents"])

    def test_a_training_that_is_stopped_leaves_its_trace(self):
        process = self.start("train", *SKELETON, "skeleton.optimiser.steps=1000000", "--profile", "trace.json", "--quiet")
        run = process.stdout.readline().strip()
        while not self.bytes(run + "/metrics.jsonl"):
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
        self.assertTrue(json.loads(self.bytes("trace.json"))["traceEvents"])
        self.assertEqual(self.summary(run)["end"], "stopped")


class Warnings(Watch):
    def test_weights_that_do_not_move_are_told_once(self):
        result = self.restage("train", *SKELETON, "skeleton.optimiser.schedule.rate=1e-30", "skeleton.optimiser.steps=40")
        run = result.out.strip()
        self.assertEqual(result.err.count("validations have given the same figures"), 1)
        self.assertEqual(self.bytes(run + "/log.txt").count(b"validations have given the same figures"), 1)
        summary = self.summary(run)
        self.assertEqual([(w["stage"], w["step"], w["kind"]) for w in summary["warnings"]], [("skeleton", 15, "constant_figures")])
        self.assertIn("is the rate 0", summary["warnings"][0]["said"])
        self.assertEqual((summary["end"], summary["stages"][0]["stage"], summary["stages"][0]["steps"]), ("finished", "skeleton", 40))
        last = [json.loads(line) for line in self.bytes(run + "/metrics.jsonl").decode().splitlines()][-1]
        self.assertEqual(summary["stages"][0]["figures"], {k: v for k, v in last.items() if k not in ("step", "stage")})
        self.done("train", "resume=" + run, "skeleton.optimiser.steps=45", "--quiet")
        self.assertEqual(len(self.summary(run)["warnings"]), 1, "warnings of before are kept")
        self.assertEqual(self.summary(self.train(*SKELETON))["warnings"], [])

    def test_a_monitor_that_does_nothing(self):
        run = self.train(*SKELETON, "loop.monitor=[motion.pa_mpjpe]", "loop.patience=9")
        self.assertEqual([w["kind"] for w in self.summary(run)["warnings"]], ["unused_monitor"])
        self.assertIn("motion.pa_mpjpe", self.summary(run)["warnings"][0]["said"])
        run = self.train(*SKELETON, "loop.monitor=[skeleton.joint_error_mm]")
        self.assertIn("loop.keep_best", self.summary(run)["warnings"][0]["said"])
        self.bad_input(["train", *SKELETON, "loop.monitor=[skeleton.ring_joint_error_mm]", "loop.patience=9"], "ring_joint_error_mm")


class Noise(Watch):
    def test_noise_is_logged_and_resumed(self):
        words = [*SKELETON, "loop.micro_batches=4", "loop.log_every=1", "loop.checkpoint_every=4", "loop.keep_every=4"]
        run = self.train(*words, "loop.gradient_noise=true")
        steps = lambda r: [line for line in map(json.loads, self.bytes(r + "/metrics.jsonl").decode().splitlines()) if "loss" in line]
        for line in steps(run):
            if line["gradient_square"] > 0:
                self.assertAlmostEqual(line["noise_scale"], line["noise_trace"] / line["gradient_square"], delta=1e-6 * abs(line["noise_scale"]))
            else:
                self.assertIsNone(line["noise_scale"])
            self.assertGreater(line["noise_trace"], 0)
        # The first step's: the norm of the whole gradient is what the stage logs.
        first = steps(run)[0]
        self.assertAlmostEqual(first["gradient_square"] + first["noise_trace"] / 4, first["gradient_norm"] ** 2, delta=1e-5 * first["gradient_norm"] ** 2)
        plain = self.train(*words)
        self.assertEqual(self.bytes(plain + "/weights.safetensors"), self.bytes(run + "/weights.safetensors"))
        self.assertNotIn("noise_scale", steps(plain)[0])
        whole = self.bytes(run + "/metrics.jsonl")
        for name in sorted(os.listdir(self.path(run + "/checkpoints")))[1:]:
            os.remove(self.path(run + "/checkpoints/" + name))
        self.done("train", "resume=" + run, "--quiet")
        self.assertEqual(self.bytes(run + "/metrics.jsonl"), whole)
        self.bad_input(["train", *SKELETON, "loop.gradient_noise=true"], "loop.gradient_noise", "loop.micro_batches")
