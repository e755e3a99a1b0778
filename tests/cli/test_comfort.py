"""What makes a training day pleasant: looks before training, event files, tables, failed steps repeated."""
import csv
import io
import json
import os
import struct

from support import CliTest
from tiny_run import CONFIG

SKELETON = ["stages=[skeleton]", "skeleton.validation_clouds=2"]


def crc32c(data):
    """Bit by bit, unlike the program's."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0x82F63B78 if crc & 1 else 0)
    crc ^= 0xFFFFFFFF
    return ((crc >> 15 | crc << 17) + 0xA282EAD8) & 0xFFFFFFFF


def fields(message):
    """(number, value) of a protobuf message: integers, floats by their width, bytes."""
    at, out = 0, []

    def varint():
        nonlocal at
        value = shift = 0
        while True:
            byte = message[at]
            at += 1
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value

    while at < len(message):
        key = varint()
        if key & 7 == 0:
            value = varint()
        else:
            length = {1: 8, 5: 4}.get(key & 7)
            length = varint() if length is None else length
            value = message[at:at + length]
            at += length
            value = struct.unpack("<d", value)[0] if key & 7 == 1 else struct.unpack("<f", value)[0] if key & 7 == 5 else value
        out.append((key >> 3, value))
    return out


def events(data):
    """The records of an event file, whose checksums must fit."""
    while data:
        length, check = struct.unpack("<QI", data[:12])
        assert check == crc32c(data[:8]), "checksum of a length"
        body = data[12:12 + length]
        assert struct.unpack("<I", data[12 + length:16 + length])[0] == crc32c(body), "checksum of a record"
        yield dict(fields(body))
        data = data[16 + length:]


class Comfort(CliTest):
    def setUp(self):
        super().setUp()
        self.write("tiny.yaml", CONFIG)

    def train(self, *arguments):
        return self.done("train", "tiny.yaml", *arguments, "--quiet").strip()

    def files(self):
        return sorted(os.listdir(self.folder))


class Looks(Comfort):
    def test_the_resolved_configuration(self):
        text = self.done("train", "tiny.yaml", "motion.optimiser.steps=77", "--seed", 9, "--print-config")
        self.assertIn("seed: 9\n", text)
        self.assertIn("steps: 77\n", text)
        self.write("again.yaml", text)
        self.assertEqual(self.done("train", "again.yaml", "--print-config"), text)
        self.assertEqual(self.files(), ["again.yaml", "tiny.yaml"])

    def test_dry_run_forecasts_and_writes_nothing(self):
        found = self.json("train", "tiny.yaml", "--dry-run")
        self.assertEqual([s["stage"] for s in found["stages"]], ["skeleton", "motion", "deformation"])
        for stage in found["stages"]:
            self.assertEqual(stage["steps"], 10)
            self.assertGreater(stage["parameters"], 1000)
            self.assertGreater(stage["memory_bytes"], 4 * stage["parameters"])
            self.assertGreater(stage["seconds"], 0)
        self.assertAlmostEqual(found["seconds"], sum(s["seconds"] for s in found["stages"]))
        self.assertIn("nothing was written", self.done("train", "tiny.yaml", "--dry-run"))
        self.assertEqual(self.files(), ["tiny.yaml"])
        self.bad_input(["train", "tiny.yaml", "--dry-run", "motion.windows.frames=100000"], "frames")

    def test_fast_dev_run_keeps_nothing(self):
        self.assertEqual(self.json("train", "tiny.yaml", "--fast-dev-run", "--csv", "--tensorboard")["stages"], ["skeleton", "motion", "deformation"])
        self.assertEqual(self.files(), ["tiny.yaml"])
        self.bad_input(["train", "tiny.yaml", "--fast-dev-run", "skeleton.from=none.safetensors"], "none.safetensors")

    def test_find_rate_draws_one_picture_and_writes_nothing_else(self):
        found = self.json("train", "tiny.yaml", "stages=[skeleton, deformation]", "--find-rate", "rate.svg")
        self.assertEqual([s["stage"] for s in found["stages"]], ["skeleton", "deformation"])
        for stage in found["stages"]:
            self.assertGreater(stage["steps"], 20)
        self.assertGreater(found["stages"][0]["suggested"], 1e-4)
        self.assertLess(found["stages"][0]["suggested"], 1)
        self.assertEqual(self.files(), ["rate.svg", "tiny.yaml"])
        picture = self.bytes("rate.svg").decode()
        self.assertTrue(picture.startswith("<svg ") and picture.endswith("</svg>\n"))
        for words in ("skeleton: loss over learning rate", "deformation: loss", "suggested: "):
            self.assertIn(words, picture)
        self.bad_input(["train", "tiny.yaml", "--find-rate", "rate.jpg"], "rate.jpg")
        self.bad_input(["train", "tiny.yaml", "--find-rate", "rate.svg", "--dry-run"], "--dry-run")
        self.bad_input(["train", "tiny.yaml", "--find-rate", "nowhere/rate.svg"], "nowhere")
        self.assertEqual(self.files(), ["rate.svg", "tiny.yaml"])

    def test_groups_are_refused_by_name_before_any_work(self):
        self.bad_input(["train", "tiny.yaml", "motion.optimiser.groups=[{match: smrm.encc.*, rate: 0.1}]"], "motion.optimiser.groups", "smrm.encc.*", "did you mean 'smrm.enc.*'")
        self.assertEqual(self.files(), ["tiny.yaml"])
        run = self.train("stages=[deformation]", "deformation.optimiser.kind=adamw", "deformation.optimiser.groups=[{match: deformation.weights.*, frozen_until: 4, decay: 0.1}]", "loop.keep_best=1")
        self.assertEqual(len(os.listdir(self.path(run + "/best"))), 1)

    def test_one_batch_again_and_again(self):
        arguments = [*SKELETON, "skeleton.optimiser.steps=400", "loop.log_every=1", "loop.validate_every=400"]
        run = self.train(*arguments, "--overfit-batches", 1)
        losses = lambda r: [json.loads(l)["loss"] for l in self.bytes(r + "/metrics.jsonl").decode().splitlines() if "loss" in l]
        one, many = losses(run), losses(self.train(*arguments))
        self.assertEqual(one[0], many[0])
        self.assertLess(sum(one[-10:]), 0.7 * sum(many[-10:]))
        self.assertIn("overfit_batches: 1\n", self.bytes(run + "/config.yaml").decode())
        self.bad_input(["train", "tiny.yaml", "--overfit-batches", "-1"], "--overfit-batches")
        self.bad_input(["train", "resume=" + run, "--overfit-batches", "1"], "--overfit-batches")


class Logs(Comfort):
    def read(self, run, stage):
        folder = os.path.join(run, "tensorboard", stage)
        names = sorted(os.listdir(self.path(folder)))
        return [list(events(self.bytes(os.path.join(folder, name)))) for name in names]

    def test_event_files(self):
        run = self.train("--tensorboard")
        lines = [json.loads(line) for line in self.bytes(run + "/metrics.jsonl").decode().splitlines()]
        for stage in ("skeleton", "motion", "deformation"):
            (found,) = self.read(run, stage)
            self.assertEqual(found[0][3], b"brain.Event:2")
            scalars, histograms, pictures = {}, {}, {}
            for event in found[2:]:
                value = dict(fields(dict(fields(event[5]))[1]))
                kind = scalars if 2 in value else histograms if 5 in value else pictures
                kind.setdefault(value[1].decode(), {})[event[2]] = value
            expected = {(stage + "/" + name, line["step"]): value for line in lines if line["stage"] == stage
                        for name, value in line.items() if name not in ("stage", "step")}
            self.assertEqual({(tag, step) for tag, steps in scalars.items() for step in steps}, set(expected))
            for (tag, step), value in expected.items():
                self.assertAlmostEqual(scalars[tag][step][2], value, delta=1e-6 * abs(value) + 1e-9, msg=tag)
            self.assertGreater(len(histograms), 4)
            for steps in histograms.values():
                self.assertEqual(sorted(steps), [5, 10])
                histogram = dict(fields(steps[10][5]))
                buckets = struct.unpack("<30d", histogram[7])
                self.assertEqual(sum(buckets), histogram[3])
                self.assertLessEqual(histogram[1], histogram[4] / histogram[3])
                self.assertEqual(struct.unpack("<30d", histogram[6])[-1], histogram[2])
            image = dict(fields(pictures[stage + "/held out"][10][4]))
            self.assertEqual(image[4][:8], b"\x89PNG\r\n\x1a\n")
            self.assertEqual(struct.unpack(">II", image[4][16:24]), (image[2], image[1]))

    def test_a_resumed_run_voids_what_it_repeats(self):
        run = self.train(*SKELETON, "--tensorboard", "loop.keep_every=4", "loop.checkpoint_every=4")
        for name in sorted(os.listdir(self.path(run + "/checkpoints")))[1:]:
            os.remove(self.path(run + "/checkpoints/" + name))
        self.done("train", "resume=" + run, "--tensorboard")
        starts = [dict(fields(file[1][7]))[1] for file in self.read(run, "skeleton")]
        self.assertEqual(starts, [1, 1])
        self.assertEqual(sorted(file[1][2] for file in self.read(run, "skeleton")), [0, 4])

    def test_table(self):
        run = self.train("--csv")
        rows = list(csv.DictReader(io.StringIO(self.bytes(run + "/metrics.csv").decode())))
        lines = [json.loads(line) for line in self.bytes(run + "/metrics.jsonl").decode().splitlines()]
        expected = [(line["stage"], str(line["step"]), name, value) for line in lines for name, value in line.items() if name not in ("stage", "step")]
        self.assertEqual([(r["stage"], r["step"], r["name"], float(r["value"])) for r in rows], expected)
        plain = self.train()
        self.assertFalse(os.path.exists(self.path(plain + "/metrics.csv")))
        self.assertEqual(self.bytes(plain + "/weights.safetensors"), self.bytes(run + "/weights.safetensors"), "watching changes nothing")


class Failed(Comfort):
    def test_a_step_that_is_not_finite_can_be_repeated(self):
        for stage, more in (("skeleton", ["loop.checkpoint_every=1"]), ("motion", ["motion.weights.adversarial=0.01"]),
                            ("deformation", ["deformation.optimiser.schedule.warmup=4"])):
            result = self.restage("train", "tiny.yaml", "stages=[%s]" % stage, "%s.optimiser.schedule.rate=1e25" % stage, *more, "--quiet")
            self.one_line(result, 1, "infinite or NaN", "restage replay")
            file = result.err.split("'restage replay ")[1].split("'")[0]
            self.assertTrue(os.path.exists(self.path(file)), file)
            found = self.json("replay", file)
            self.assertEqual((found["finite"], found["same"], found["same_examples"], found["stage"]), (False, True, True, stage))
            self.assertIn(found["error"], result.err)
            self.assertIn("infinite or NaN", self.done("replay", file))
        self.write("no.safetensors", b"nothing")
        self.bad_input(["replay", "no.safetensors"], "no.safetensors")
        self.bad_input(["replay", self.train(*SKELETON) + "/weights.safetensors"], "failed step")
