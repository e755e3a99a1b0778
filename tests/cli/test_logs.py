"""loop.logs: what a training writes for other programs, read by the formats that they publish."""
import csv
import io
import json
import os
import re
import signal
import struct
import time
import urllib.parse
import zlib

import yaml
from support import CliTest
from test_comfort import fields
from tiny_run import CONFIG

ALL = "loop.logs=[jsonl, csv, tensorboard, wandb, mlflow]"
BLOCK = 32768


def records(data):
    """The records of a .wandb file: LevelDB's log format with zlib's CRC, as wandb/sdk/internal/datastore.py reads it."""
    assert struct.unpack("<4sHB", data[:7]) == (b":W&B", zlib.crc32(b"Weights & Biases") & 0xFFFF, 0)
    at, record = 7, None
    while at < len(data):
        left = BLOCK - at % BLOCK
        if left < 7:
            assert data[at:at + left] == bytes(left), "padding"
            at += left
            continue
        checksum, length, kind = struct.unpack("<IHB", data[at:at + 7])
        part = data[at + 7:at + 7 + length]
        assert len(part) == length and at % BLOCK + 7 + length <= BLOCK, "a part crosses its block"
        assert zlib.crc32(part, zlib.crc32(bytes([kind]))) == checksum, "checksum"
        at += 7 + length
        assert (kind in (1, 2)) == (record is None), "order of parts"
        record = part if record is None else record + part
        if kind in (1, 4):
            yield record
            record = None
    assert record is None, "the last record is not whole"


NAMES = {2: "history", 3: "summary", 5: "config", 12: "metric", 17: "run", 18: "exit", 20: "final", 21: "header", 22: "footer"}


def items(message, field=1):
    """{key: value} of the items of a history, summary or config (wandb_internal.proto)."""
    out = {}
    for number, value in fields(message):
        if number == field:
            item = dict(fields(value))
            out[item[1].decode()] = json.loads(item[16])
    return out


def wandb_run(data):
    """{kind: [message]} of a .wandb file; the records are numbered one by one."""
    out = {}
    for i, record in enumerate(records(data)):
        (first, number), (kind, message) = fields(record)
        assert (first, number) == (1, i)
        out.setdefault(NAMES[kind], []).append(message)
    return out


def mlflow_run(store):
    """The only run in a file store, as mlflow/store/tracking/file_store.py reads it."""
    (experiment,) = [n for n in os.listdir(store) if n != ".trash"]
    with open(os.path.join(store, experiment, "meta.yaml")) as f:
        about = yaml.safe_load(f)
    assert about["experiment_id"] == experiment and about["lifecycle_stage"] == "active"
    (run,) = [n for n in os.listdir(os.path.join(store, experiment)) if n not in ("meta.yaml", "tags")]
    assert re.fullmatch("[a-zA-Z0-9][\\w\\-]{0,255}", run)
    folder = os.path.join(store, experiment, run)
    with open(os.path.join(folder, "meta.yaml")) as f:
        meta = yaml.safe_load(f)
    assert (meta["run_id"], meta["run_uuid"], meta["experiment_id"]) == (run, run, experiment)
    def below(part):
        for where, _, names in os.walk(os.path.join(folder, part)):
            for name in names:
                path = os.path.join(where, name)
                key = os.path.relpath(path, os.path.join(folder, part))
                assert re.fullmatch(r"[/\w.\- ]{1,250}", key), key
                with open(path) as f:
                    yield key, f.read()
    metrics = {}
    for key, text in below("metrics"):
        for line in text.splitlines():
            time, value, step = line.split(" ")
            metrics.setdefault(key, []).append((int(time), float(value), int(step)))
    return {"experiment": about, "meta": meta, "metrics": metrics, "params": dict(below("params")), "tags": dict(below("tags"))}


class Logs(CliTest):
    def setUp(self):
        super().setUp()
        self.write("tiny.yaml", CONFIG)

    def lines(self, run):
        return [json.loads(line) for line in self.bytes(run + "/metrics.jsonl").decode().splitlines()]

    def wandb(self, run):
        (folder,) = os.listdir(self.path(run + "/wandb"))
        found = re.fullmatch(r"offline-run-(\d{8}_\d{6})-([a-z0-9]{8})", folder)
        data = self.bytes("%s/wandb/%s/run-%s.wandb" % (run, folder, found[2]))
        return found[2], wandb_run(data)

    def check_logs(self, run, status):
        """Every log says what metrics.jsonl says, each line once."""
        lines = self.lines(run)
        expected = [(line["stage"] + "/" + name, line["step"], value) for line in lines for name, value in line.items()
                    if name not in ("stage", "step")]
        name, found = self.wandb(run)
        rows = [items(row) for row in found["history"]]
        self.assertEqual([(key, row[key.split("/")[0] + "/step"], value) for row in rows for key, value in row.items()
                          if key[0] != "_" and not key.endswith("/step")], expected)
        self.assertEqual([row["_step"] for row in rows], list(range(len(lines))))
        self.assertEqual([row["_timestamp"] for row in rows], sorted(row["_timestamp"] for row in rows))
        kept = mlflow_run(self.path("runs/mlruns"))
        self.assertEqual(sorted((key, step, value) for key, points in kept["metrics"].items() for _, value, step in points), sorted(expected))
        self.assertEqual(kept["meta"]["status"], status)
        return name, found, kept

    def test_logs_of_other_programs_say_what_metrics_jsonl_says(self):
        run = self.done("train", "tiny.yaml", ALL, "--quiet").strip()
        name, found, kept = self.check_logs(run, 3)
        self.assertEqual([len(found[kind]) for kind in ("header", "run", "config", "exit", "final", "footer")], [1] * 6)
        about = dict(fields(found["run"][0]))
        self.assertEqual((about[1].decode(), about[3], about[8].decode()), (name, b"tiny", os.path.basename(run)))
        config = items(found["config"][0])
        self.assertEqual((config["skeleton.optimiser.batch"], config["loop.logs"]), (4, ["jsonl", "csv", "tensorboard", "wandb", "mlflow"]))
        self.assertEqual(config, items(dict(fields(found["run"][0]))[4]))
        axes = {dict(fields(m))[1].decode(): dict(fields(m)).get(4, b"").decode() for m in found["metric"]}
        self.assertEqual((axes["skeleton/loss"], axes["skeleton/step"]), ("skeleton/step", ""))
        self.assertEqual(dict(fields(found["exit"][0])).get(1, 0), 0)
        last = {}
        for message in found["summary"]:
            last.update(items(message))
        self.assertEqual(last["deformation/step"], 10)
        self.assertEqual(kept["params"]["skeleton.optimiser.batch"], "4")
        self.assertEqual(kept["params"]["name"], "tiny")
        self.assertEqual((kept["experiment"]["name"], kept["tags"]["mlflow.runName"]), ("tiny", os.path.basename(run)))
        place = urllib.parse.urlparse(kept["meta"]["artifact_uri"])
        self.assertTrue(os.path.isdir(urllib.parse.unquote(place.path)))
        self.assertGreaterEqual(kept["meta"]["end_time"], kept["meta"]["start_time"])
        self.assertTrue(list(csv.DictReader(io.StringIO(self.bytes(run + "/metrics.csv").decode()))))
        self.assertTrue(os.listdir(self.path(run + "/tensorboard/skeleton")))
        self.bad_input(["train", "tiny.yaml", "loop.logs=[comet]"], "loop.logs", "wandb")

    def test_a_resumed_run_has_each_step_once(self):
        run = self.done("train", "tiny.yaml", ALL, "loop.keep_every=4", "loop.checkpoint_every=4", "--quiet").strip()
        name, before, _ = self.check_logs(run, 3)
        whole = self.bytes(run + "/metrics.jsonl")
        for file in os.listdir(self.path(run + "/checkpoints")):
            if not file.startswith("skeleton-000000004"):
                os.remove(self.path(run + "/checkpoints/" + file))
        self.done("train", "resume=" + run, "--quiet")
        self.assertEqual(self.bytes(run + "/metrics.jsonl"), whole)
        again, after, _ = self.check_logs(run, 3)
        self.assertEqual(again, name)
        times = lambda found: [items(row)["_timestamp"] for row in found["history"]]
        self.assertEqual(times(after)[:2], times(before)[:2], "the lines that stay keep their times")
        self.assertGreater(times(after)[2], times(before)[-1])

    def test_a_log_that_is_asked_for_later_has_the_steps_before_it(self):
        run = self.done("train", "tiny.yaml", "stages=[deformation]", "--quiet").strip()
        self.assertFalse(os.path.exists(self.path(run + "/wandb")))
        self.done("train", "resume=" + run, "loop.logs=[wandb, mlflow]", "deformation.optimiser.steps=20", "--quiet")
        self.check_logs(run, 3)
        self.done("train", "resume=" + run, "loop.logs=[jsonl]", "--quiet")

    def test_a_long_record_lies_in_several_blocks(self):
        names = ["number-%06d" % i for i in range(4000)]  # of no use without init
        self.write("long.yaml", CONFIG.replace("deformation:\n", "deformation:\n  init_names: [%s]\n" % ", ".join(names)))
        run = self.done("train", "long.yaml", "stages=[deformation]", "loop.logs=[wandb, mlflow]", "loop.log_every=1", "--quiet").strip()
        _, found, kept = self.check_logs(run, 3)
        self.assertEqual(items(found["config"][0])["deformation.init_names"], names)
        self.assertLessEqual(len(kept["params"]["deformation.init_names"]), 6000)

    def test_a_run_that_was_killed_has_each_step_once(self):
        process = self.start("train", "tiny.yaml", "loop.logs=[wandb, mlflow]", "stages=[deformation]", "deformation.optimiser.steps=1000000", "--quiet")
        run = process.stdout.readline().strip()
        checkpoints = lambda: [int(n.split("-")[1]) for n in os.listdir(self.path(run + "/checkpoints")) if n.endswith(".safetensors")]
        while not checkpoints():
            time.sleep(0.05)
        process.kill()
        process.communicate(timeout=60)
        self.done("train", "resume=" + run, "deformation.optimiser.steps=%d" % (max(checkpoints()) + 7), "--quiet")
        self.check_logs(run, 3)

    def test_a_run_that_is_stopped_says_so(self):
        process = self.start("train", "tiny.yaml", "loop.logs=[wandb, mlflow]", "stages=[deformation]", "deformation.optimiser.steps=1000000", "--quiet")
        run = process.stdout.readline().strip()
        while not self.bytes(run + "/metrics.jsonl"):
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
        _, found, kept = self.check_logs(run, 5)
        self.assertEqual(dict(fields(found["exit"][0]))[1], 1)
