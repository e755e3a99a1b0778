"""restage stream: clouds on a socket, a pipe or in a folder in, VMC bundles and a page out. What arrives is read by this
file's own few lines of OSC and WebSocket, joints are put together as a program that shows VRM characters does it, and
compared with what `restage retarget` makes of the same clouds."""
import base64
import json
import os
import random
import re
import select
import shutil
import signal
import socket
import struct
import subprocess
import tempfile
import time
import unittest
import urllib.request

import browser
from support import CliTest, PROGRAM, ROOT
from test_arrays import npy
from test_gltf import character
from test_view import pixels, png

LITE = os.path.join(ROOT, "experiments", "weights", "lite.safetensors")
# Unity's names of the 22 joints, in our order, and whose child each is.
BONES = """Hips LeftUpperLeg RightUpperLeg Spine LeftLowerLeg RightLowerLeg Chest LeftFoot RightFoot UpperChest LeftToes RightToes
Neck LeftShoulder RightShoulder Head LeftUpperArm RightUpperArm LeftLowerArm RightLowerArm LeftHand RightHand""".split()
PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19)


def free_port(kind=socket.SOCK_STREAM):
    with socket.socket(socket.AF_INET, kind) as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def frame(seconds, points):
    return struct.pack("<Id", len(points), seconds) + b"".join(struct.pack("<3f", *p) for p in points)


# ---- OSC ----

def osc_string(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), (end + 4) & ~3


def osc_message(data):
    path, at = osc_string(data, 0)
    types, at = osc_string(data, at)
    values = []
    for kind in types[1:]:
        if kind == "s":
            value, at = osc_string(data, at)
        else:
            value, at = struct.unpack_from(">" + kind, data, at)[0], at + 4
        values.append(value)
    return path, types[1:], values


def osc_bundle(data):
    assert data[:8] == b"#bundle\0", data[:20]
    out, at = [], 16
    while at < len(data):
        size = struct.unpack_from(">i", data, at)[0]
        out.append(osc_message(data[at + 4:at + 4 + size]))
        at += 4 + size
    return out


def times(q, v):
    """The vector turned by a quaternion x, y, z, w."""
    x, y, z, w = q
    t = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])]
    return [v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2], v[2] + w * t[2] + x * t[1] - y * t[0]]


def product(a, b):
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz)


def joints_of(bundle):
    """Where the 22 bones stand when each hangs in its parent, in our axes: Unity's x points the other way."""
    bones = {v[0]: (v[1:4], v[4:]) for path, _, v in bundle if path == "/VMC/Ext/Bone/Pos"}
    root = next(v for path, _, v in bundle if path == "/VMC/Ext/Root/Pos")
    assert root[0] == "root", root
    places, turns = [], []
    for name, parent in zip(BONES, PARENTS):
        p, q = bones[name]
        at, turn = (root[1:4], root[4:]) if parent < 0 else (places[parent], turns[parent])
        places.append([a + b for a, b in zip(at, times(turn, p))])
        turns.append(product(turn, q))
    return [(-x, y, z) for x, y, z in places]


class Receiver:
    """The program that shows the character."""

    def __init__(self):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.port = self.socket.getsockname()[1]

    def next(self, seconds=10, tracked=1):
        """The next bundle that says somebody is (1) or is not (0) seen; None: none came."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            self.socket.settimeout(left)
            try:
                bundle = osc_bundle(self.socket.recv(65536))
            except socket.timeout:
                return None
            if any(path == "/VMC/Ext/OK" and values[-1] == tracked for path, _, values in bundle):
                return bundle
        return None

    def all(self, seconds=0.5):
        out = []
        while (bundle := self.next(seconds)) is not None:
            out.append(bundle)
        return out


class StreamTest(CliTest):
    """Clouds of somebody who moves, and a target without a rig."""

    @classmethod
    def setUpClass(cls):
        cls.made = tempfile.mkdtemp(prefix="restage-stream-")
        cls.addClassCleanup(shutil.rmtree, cls.made, ignore_errors=True)
        for call in (["data", "build", "--bodies", "1", "0", "1", "--motions", "1", "0", "0", "--out", "data.h5"],
                     ["data", "perform", "--bodies", "data.h5", "--frames", "16", "--out", "walk"],
                     ["retarget", "--source", "walk/source.h5", "--target", "walk/target.ply", "--weights", LITE, "--out", "posed/"]):
            done = subprocess.run([PROGRAM, *call, "--quiet"], cwd=cls.made, capture_output=True, text=True)
            assert done.returncode == 0, done.stderr
        cls.target = os.path.join(cls.made, "walk", "target.ply")
        r, cls.clouds = random.Random(1), []
        for name in sorted(os.listdir(os.path.join(cls.made, "posed"))):
            with open(os.path.join(cls.made, "posed", name), "rb") as f:
                head, _, body = f.read().partition(b"end_header\n")
            count = int(head.split(b"element vertex ")[1].split()[0])
            cls.clouds.append(r.sample(list(struct.iter_unpack("<3f", body[:12 * count])), 1500))

    def setUp(self):
        super().setUp()
        self.receiver = Receiver()
        self.addCleanup(self.receiver.socket.close)

    def stream(self, source, *more, target=None):
        """The program, once it says that it is ready."""
        command = [PROGRAM, "stream", "--target", target or self.target, "--source", source, "--vmc", "127.0.0.1:%d" % self.receiver.port,
                   "--weights", LITE, "--json", *more]
        process = subprocess.Popen(command, cwd=self.folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        for clean in (process.stderr.close, process.stdout.close, process.stdin.close, process.wait, process.kill):
            self.addCleanup(clean)
        line = b""
        while not line.startswith(b"frames (clouds or joints) come from"):
            line = process.stderr.readline()
            self.assertTrue(line, "the program has ended")
        return process

    def sender(self, port):
        s = socket.create_connection(("127.0.0.1", port), timeout=10)
        self.addCleanup(s.close)
        return s

    def answer(self, send, points, seconds):
        """The bundle that follows a cloud."""
        send(frame(seconds, points))
        bundle = self.receiver.next()
        self.assertIsNotNone(bundle, "no bundle came")
        return bundle

    def ended(self, process, code=0):
        """The one document, and what was said."""
        out, err = process.communicate(timeout=30)
        self.assertEqual(process.returncode, code, err)
        document = json.loads(out)
        self.assertEqual(document["frames_in"], document["frames_out"] + document["dropped"])
        self.assertEqual(document["dropped"], sum(document["dropped_because"].values()))
        self.assertGreaterEqual(min(document["dropped_because"].values()), 0)
        return document, err.decode()

    def interrupted(self, process):
        process.send_signal(signal.SIGINT)
        return self.ended(process, 130)

    def check_same(self, bundles, target):
        """The joints that were put together are those of `retarget`, to a tenth of a millimetre."""
        for k, points in enumerate(self.clouds):
            self.ply("scans/f%02d.ply" % k, points)
        self.done("retarget", "--source", "scans", "--target", target, "--weights", LITE, "--contacts", "on", "--out", "truth.h5")
        values = [x for bundle in bundles for joint in joints_of(bundle) for x in joint]
        self.h5("mine.h5", joints=([len(bundles), 22, 3], values))
        self.assertLess(self.json("eval", "--pred", "mine.h5", "--truth", "truth.h5")["mean"]["mpjpe"], 1e-4)


class Streams(StreamTest):
    def test_socket_and_the_same_joints_as_retarget(self):
        port = free_port()
        process = self.stream("tcp://127.0.0.1:%d" % port)
        sender = self.sender(port)
        bundles = [self.answer(sender.sendall, points, 100 + k / 30) for k, points in enumerate(self.clouds)]
        self.check_same(bundles, self.target)
        messages = {}
        for path, types, _ in bundles[-1]:
            messages.setdefault(path, []).append(types)
        self.assertEqual({path: (len(types), set(types)) for path, types in messages.items()},
                         {"/VMC/Ext/OK": (1, {"iiii"}), "/VMC/Ext/T": (1, {"f"}), "/VMC/Ext/Root/Pos": (1, {"sfffffff"}),
                          "/VMC/Ext/Bone/Pos": (22, {"sfffffff"})})
        document, _ = self.interrupted(process)
        self.assertEqual((document["frames_in"], document["frames_out"]), (16, 16))
        latency = document["latency_ms"]
        self.assertTrue(0 < latency["p50"] <= latency["p99"] <= latency["max"], latency)

    def test_a_take_is_what_retarget_writes(self):
        """Clouds without gaps: the file is, byte by byte, that of `retarget --online`."""
        character(self.path("hero.glb"))
        for k, points in enumerate(self.clouds):
            self.ply("scans/f%02d.ply" % k, points)
        for target, out, more in ((self.target, "take.glb", ["--skeleton", "mixamo"]), (self.target, "take.bvh", []),
                                  ("hero.glb", "take.vrma", ["--clip-name", "Take"]), ("hero.glb", "hero_take.glb", ["--clip-name", "Take"]),
                                  ("hero.glb", "bones.gltf", ["--clip-name", "Take", "--animation-only"])):
            self.done("retarget", "--source", "scans", "--target", target, "--weights", LITE, "--contacts", "on", "--online", "--out", "truth_" + out, *more)
            process = self.stream("-", "--out", out, *more, target=target)
            for k, points in enumerate(self.clouds):
                self.answer(lambda data: (process.stdin.write(data), process.stdin.flush()), points, k / 30)
                self.assertFalse(os.path.exists(self.path(out)))
            process.stdin.close()
            process.stdin = None
            document, _ = self.ended(process)
            self.assertEqual((document["out"], document["take_frames"]), (out, 16))
            self.assertEqual(self.bytes(out), self.bytes("truth_" + out), out)

    def test_a_take_holds_the_last_pose_where_no_new_one_came(self):
        process = self.stream("-", "--out", "take.bvh")

        def send(k, seconds):
            return self.answer(lambda data: (process.stdin.write(data), process.stdin.flush()), self.clouds[k], seconds)
        for k, seconds in enumerate((0, 1 / 30, 5 / 30)):  # of three moments there are no clouds
            send(k, seconds)
        begun = time.monotonic()
        time.sleep(1)
        send(3, 100)  # the motion begins anew
        silence = time.monotonic() - begun
        time.sleep(0.5)
        begun = time.monotonic()
        document, _ = self.interrupted(process)  # what is shown to the end is in the file
        lines = self.bytes("take.bvh").decode().splitlines()
        rows = lines[lines.index(next(line for line in lines if line.startswith("Frame Time"))) + 1:]
        self.assertIn("Frames:%11d" % len(rows), lines)
        self.assertEqual(document["take_frames"], len(rows))
        # The poses are 0 1 1 1 1 2 2 ... 2 3 3 ... 3.
        runs = []
        for row in rows:
            if not runs or row != runs[-1][0]:
                runs.append([row, 0])
            runs[-1][1] += 1
        counts = [count for _, count in runs]
        self.assertEqual((len(counts), counts[:2]), (4, [1, 4]))
        self.assertAlmostEqual(counts[2], 30 * silence, delta=6)
        self.assertGreaterEqual(counts[3], 14)

    def test_a_take_is_whole_or_not_there(self):
        process = self.stream("-", "--out", "take.glb")
        document, err = self.interrupted(process)
        self.assertEqual((document["out"], document["take_frames"]), (None, 0))
        self.assertIn("take.glb is not written: no pose was shown", err)
        self.assertEqual(os.listdir(self.folder), [])
        process = self.stream("-", "--out", "take.bvh")
        self.answer(lambda data: (process.stdin.write(data), process.stdin.flush()), self.clouds[0], 0)
        process.kill()  # no time to write
        process.wait()
        self.assertNotIn("take.bvh", os.listdir(self.folder))
        process = self.stream("-", "--out", "late.glb")
        self.answer(lambda data: (process.stdin.write(data), process.stdin.flush()), self.clouds[0], 0)
        process.send_signal(signal.SIGTERM)
        self.ended(process, 143)
        self.assertEqual(self.bytes("late.glb")[:4], b"glTF")

    def test_while_the_source_is_silent_the_last_pose_goes_on(self):
        process = self.stream("-")
        first = self.answer(lambda data: (process.stdin.write(data), process.stdin.flush()), self.clouds[0], 0)
        silent = [self.receiver.next(tracked=0) for _ in range(10)]
        begun = time.monotonic()
        silent += [self.receiver.next(tracked=0) for _ in range(15)]
        self.assertGreater(time.monotonic() - begun, 0.3)  # 30 a second, no more
        for bundle in silent:
            self.assertEqual(joints_of(bundle), joints_of(first))
        # Whoever moves again is seen again.
        self.assertIsNotNone(self.answer(lambda data: (process.stdin.write(data), process.stdin.flush()), self.clouds[1], 2))
        process.stdin.close()
        process.stdin = None
        document, _ = self.ended(process)
        self.assertEqual(document["frames_out"], 2)
        self.assertGreaterEqual(document["repeated"], 25)

    def test_a_rigged_target_moves_by_its_own_bones(self):
        character(self.path("hero.glb"))
        process = self.stream("-", target="hero.glb")

        def send(data):
            process.stdin.write(data)
            process.stdin.flush()
        bundles = [self.answer(send, points, k / 30) for k, points in enumerate(self.clouds)]
        self.check_same(bundles, "hero.glb")
        send(frame(1, self.clouds[0])[:500])
        process.stdin.close()
        process.stdin = None
        document, err = self.ended(process)
        self.assertEqual((document["frames_in"], document["frames_out"]), (16, 16))
        self.assertIn("standard input ended in the middle of a frame", err)

    def test_a_pipe_of_nothing_or_garbage(self):
        process = self.stream("-")
        out, err = process.communicate(b"", timeout=30)
        self.assertEqual(process.returncode, 0, err)
        self.assertEqual(json.loads(out)["frames_in"], 0)
        self.assertIn("no frame came", err.decode())
        process = self.stream("-")
        out, err = process.communicate(b"ply\nformat ascii 1.0\n" * 9, timeout=30)
        self.assertEqual((process.returncode, out), (2, b""), err)
        self.assertEqual(err.decode().count("is no valid JSON"), 1, err)
        self.assertRegex(err.decode(), r"standard input:\d+: is no valid JSON: '(ply|format ascii 1.0)'")
        process = self.stream("-")
        out, err = process.communicate(b"\xee" * 400, timeout=30)
        self.assertEqual((process.returncode, out), (2, b""), err)
        self.assertIn("standard input: holds no frame; send frames as docs/stream.md says", err.decode())
        process = self.stream("-", "--out", "take.bvh")
        out, err = process.communicate(b"", timeout=30)
        self.assertEqual((process.returncode, out), (2, b""), err)
        self.assertIn("no frame came: take.bvh is not written", err.decode().splitlines()[-1])

    def test_clouds_whose_z_points_up(self):
        for given in ([], ["--force"]):
            process = self.stream("-", *given)
            for k, points in enumerate(self.clouds[:8]):
                process.stdin.write(frame(k / 30, [(x, -z, y) for x, y, z in points]))
                process.stdin.flush()
                if given or k < 7:
                    self.assertIsNotNone(self.receiver.next())
            out, err = process.communicate(timeout=30)
            if given:
                self.assertEqual(process.returncode, 0, err)
            else:
                self.assertEqual((process.returncode, out), (2, b""), err)
                self.assertIn("give --source-up z (--source-up y where people lie or hang), or --force", err.decode().splitlines()[-1])

    def test_a_second_person_who_leaves(self):
        process = self.stream("-")

        def send(k, points):
            process.stdin.write(frame(k / 30, points))
            process.stdin.flush()

        for k, points in enumerate(self.clouds[:8]):
            send(k, points + [(x + 1.5, y, z) for x, y, z in points])
            if k < 7:
                self.assertIsNotNone(self.receiver.next())
        for k in range(8, 300):
            send(k, self.clouds[k % len(self.clouds)])
            if self.receiver.next(0.1) is not None:
                break
        document, err = self.ended(process)
        self.assertEqual(document["dropped_because"]["unusable"], 8, err)
        self.assertIn("a second person", err)
        self.assertIn("let one person alone be in the clouds", err)

    def test_without_standard_input(self):
        command = '"$@" <&-'
        done = subprocess.run(["sh", "-c", command, "sh", PROGRAM, "stream", "--target", self.target, "--source", "-", "--vmc",
                               "127.0.0.1:%d" % self.receiver.port, "--weights", LITE, "--json"], cwd=self.folder, capture_output=True, timeout=30)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn(b"no frame came", done.stderr)

    def test_points_far_from_all_others(self):
        """Sensors' far away mistakes are left out, as `retarget` leaves them out."""
        self.clouds = [points + [(40, 3, -20)] for points in self.clouds]
        process = self.stream("-")

        def send(data):
            process.stdin.write(data)
            process.stdin.flush()
        bundles = [self.answer(send, points, k / 30) for k, points in enumerate(self.clouds)]
        self.check_same(bundles, self.target)
        process.stdin.close()
        process.stdin = None
        document, _ = self.ended(process)
        self.assertEqual(document["points_left_out"], 16)

    def test_a_cloud_of_very_many_points(self):
        process = self.stream("-")
        points = self.clouds[0]
        count = 400_000
        process.stdin.write(struct.pack("<Id", count, 0.0) + b"".join(struct.pack("<3f", *points[k % len(points)]) for k in range(count)))
        process.stdin.flush()
        self.assertIsNotNone(self.receiver.next())
        process.stdin.close()
        process.stdin = None
        document, err = self.ended(process)
        self.assertEqual(document["frames_out"], 1)
        self.assertIn("a cloud has 400000 points; one in 4 is used", err)

    def test_folder(self):
        os.mkdir(self.path("in"))
        self.ply("in/frame_9.ply", self.clouds[0])
        self.ply("in/frame_10.ply", self.clouds[1])
        process = self.stream("in", "--seconds", "6")
        self.assertIsNotNone(self.receiver.next())
        for k in range(2, 6):  # renamed into the folder
            self.ply("part.ply", self.clouds[k])
            os.rename(self.path("part.ply"), self.path("in/frame_%d.ply" % (9 + k)))
            self.assertIsNotNone(self.receiver.next())
        whole = self.bytes("in/frame_12.ply")
        with open(self.path("in/frame_20.ply"), "wb") as f:  # written slowly
            f.write(whole[:len(whole) // 2])
            f.flush()
            self.assertIsNone(self.receiver.next(0.3))
            f.write(whole[len(whole) // 2:])
        self.assertIsNotNone(self.receiver.next())
        self.write("in/frame_21.ply", whole[:len(whole) // 2])  # never whole
        self.write("in/notes.md", "no cloud")
        document, err = self.ended(process)
        self.assertEqual((document["frames_in"], document["frames_out"]), (8, 6))
        self.assertEqual((document["dropped_because"]["overtaken"], document["dropped_because"]["unusable"]), (1, 1))
        self.assertIn("frame_21.ply", err)

    def test_newest_wins(self):
        port = free_port()
        process = self.stream("tcp://127.0.0.1:%d" % port)
        sender = self.sender(port)
        burst = b"".join(frame(k / 30, self.clouds[k % 16]) for k in range(600))
        sender.sendall(burst)
        self.receiver.all()
        document, _ = self.interrupted(process)
        self.assertEqual(document["frames_in"], 600)
        self.assertGreater(document["dropped_because"]["overtaken"], 100)
        self.assertGreater(document["frames_out"], 0)

    def test_senders_that_stall_send_garbage_or_vanish(self):
        port = free_port()
        process = self.stream("tcp://127.0.0.1:%d" % port)
        nan = float("nan")
        first = self.sender(port)
        self.answer(first.sendall, self.clouds[0], 0)
        self.answer(first.sendall, self.clouds[1] + [(nan, 0, 0)], 1 / 30)  # a point that is none is left out
        first.sendall(frame(nan, self.clouds[2]))  # a time that is none
        for k, points in ((2, self.clouds[2][:10]), (3, [])):  # too few points
            first.sendall(frame(k / 30, points))
            self.assertIsNone(self.receiver.next(0.3))
        self.answer(first.sendall, self.clouds[3], 4 / 30)
        first.sendall(frame(5 / 30, self.clouds[4])[:700])  # stalls
        second = self.sender(port)
        second.sendall(b"\xff" * 100)  # garbage
        self.assertEqual(second.recv(1), b"")
        time.sleep(2.2)
        third = self.sender(port)  # the stalled one is replaced
        self.answer(third.sendall, self.clouds[0], 50)
        third.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        third.close()  # vanishes
        last = self.sender(port)
        self.answer(last.sendall, self.clouds[1], 3)
        time.sleep(2.5)  # silence
        document, err = self.interrupted(process)
        for words in ("4294967295 points", "its time is not a finite number", "a cloud was left out", "silent for two seconds",
                      "takes the place of sender"):
            self.assertIn(words, err)
        self.assertEqual((document["frames_in"], document["frames_out"], document["dropped_because"]["unusable"]), (8, 5, 3))
        self.assertEqual((document["restarts"], document["points_left_out"]), (2, 1))

    def test_two_senders_that_connect_again(self):
        """Two programs that send to one port: one of them is heard until it ends, whatever the other does."""
        port = free_port()
        process = self.stream("tcp://127.0.0.1:%d" % port)
        first, k, refused = self.sender(port), 0, 0
        self.answer(first.sendall, self.clouds[0], 0)
        for _ in range(3):
            other = self.sender(port)
            for _ in range(3):
                k += 1
                other.sendall(frame(1000 + k / 30, self.clouds[1]))
                refused += 1
                self.answer(first.sendall, self.clouds[k], k / 30)
            other.close()
        other = self.sender(port)
        first.close()
        time.sleep(0.2)
        self.answer(other.sendall, self.clouds[0], 2000)
        document, err = self.interrupted(process)
        self.assertEqual((document["frames_out"], document["restarts"]), (11, 1), err)
        self.assertEqual(document["dropped_because"]["other_sender"], refused)
        self.assertRegex(err, "sender [0-9]+ is not heard: sender 1 is sending; end one of the two")

    def test_a_clock_that_counts_milliseconds(self):
        port = free_port()
        process = self.stream("tcp://127.0.0.1:%d" % port)
        send = self.sender(port).sendall
        start = time.monotonic()
        for k in range(40):
            time.sleep(max(0, start + k / 30 - time.monotonic()))
            send(frame(1e6 + 1000 * k / 30, self.clouds[k % 16]))
        document, err = self.interrupted(process)
        self.assertLess(document["restarts"], 6, err)
        self.assertEqual(err.count("counts milliseconds"), 1, err)
        self.assertGreater(document["frames_out"], 20, err)

    def test_clouds_that_come_too_slowly(self):
        port = free_port()
        process = self.stream("tcp://127.0.0.1:%d" % port)
        send = self.sender(port).sendall
        for k in range(7):
            self.answer(send, self.clouds[k], k / 2)
            time.sleep(0.5)
        document, err = self.interrupted(process)
        self.assertEqual(document["restarts"], 6)
        self.assertEqual(err.count("the motion begins anew with every cloud"), 1, err)

    def test_a_file_of_many_clouds_in_the_folder(self):
        os.mkdir(self.path("in"))
        process = self.stream("in", "--seconds", "4")
        values = [x for k in range(10) for point in self.clouds[k % 2][:500] for x in point]
        self.write("part", npy((10, 500, 3), values, "<f4"))
        os.rename(self.path("part"), self.path("in/walk.npy"))
        self.assertIsNotNone(self.receiver.next())
        document, err = self.ended(process)
        self.assertEqual((document["frames_in"], document["frames_out"], document["dropped_because"]["overtaken"]), (10, 1, 9))
        self.assertIn("walk.npy holds 10 clouds, and the last is taken; write one cloud a file", err)

    def test_clocks_that_jump_stand_or_go_back(self):
        port = free_port()
        process = self.stream("tcp://127.0.0.1:%d" % port)
        send = self.sender(port).sendall
        for seconds in (0, 1 / 30, 5 / 30, 1e6, 1e6 + 1 / 30, 10, 10 + 1 / 30):  # a gap, a leap, back by days
            self.answer(send, self.clouds[0], seconds)
        for _ in range(12):
            send(frame(10, self.clouds[0]))
            time.sleep(0.05)
        self.assertIsNone(self.receiver.next(0.2))
        document, err = self.interrupted(process)
        self.assertEqual((document["frames_out"], document["restarts"]), (7, 2))
        self.assertGreater(document["dropped_because"]["late"], 9)
        self.assertIn("do not go on", err)

    def test_a_late_cloud_leaves_the_one_that_waits_alone(self):
        port = free_port()
        process = self.stream("tcp://127.0.0.1:%d" % port)
        send = self.sender(port).sendall
        self.answer(send, self.clouds[0], 0)
        send(frame(0.012, self.clouds[1]) + frame(0.005, self.clouds[0]))  # early, and older than that
        self.assertIsNotNone(self.receiver.next())
        document, _ = self.interrupted(process)
        self.assertEqual(document["frames_out"] + document["dropped_because"]["overtaken"] + document["dropped_because"]["late"], 3)

    def test_the_page_and_its_frames(self):
        port, page = free_port(), free_port()
        process = self.stream("tcp://127.0.0.1:%d" % port, "--ws", str(page))

        def ask(path, *more, host="127.0.0.1:%d" % page, method="GET"):
            s = self.sender(page)
            lines = ["%s %s HTTP/1.1" % (method, path), "Host: " + host, *more]
            s.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
            return s

        def read(s, seconds=3):
            data = b""
            while select.select([s], [], [], seconds)[0]:
                piece = s.recv(1 << 20)
                data += piece
                if not piece or data.endswith(b"</html>\n"):
                    break
            return data
        text = read(ask("/"))
        self.assertIn(b" 200 ", text.split(b"\r\n")[0])
        self.assertIn(b'"live":true', text)
        self.assertTrue(text.endswith(b"</html>\n"))
        self.assertIn(b" 404 ", read(ask("/etc/passwd"), 1).split(b"\r\n")[0])
        self.assertIn(b" 403 ", read(ask("/", host="elsewhere.example"), 1).split(b"\r\n")[0])  # a name that borrows our address
        self.assertIn(b" 405 ", read(ask("/", "Content-Length: 0", method="POST"), 1).split(b"\r\n")[0])
        for own in ("localhost:%d" % page, "[::1]:%d" % page):
            self.assertIn(b" 200 ", read(ask("/", host=own)).split(b"\r\n")[0])
        upgrade = ["Connection: Upgrade", "Upgrade: websocket", "Sec-WebSocket-Version: 13",
                   "Sec-WebSocket-Key: " + base64.b64encode(b"0123456789abcdef").decode()]
        self.assertNotIn(b" 101 ", read(ask("/", *upgrade, "Origin: http://elsewhere.example"), 1))
        web = ask("/", *upgrade, "Origin: http://127.0.0.1:%d" % page)
        self.answer(self.sender(port).sendall, self.clouds[0], 0)
        head, _, message = read(web, 1).partition(b"\r\n\r\n")
        self.assertIn(b" 101 ", head)
        self.assertEqual(message[0], 0x82)  # whole and binary
        at, size = (4, struct.unpack_from(">H", message, 2)[0]) if message[1] == 126 else (10, struct.unpack_from(">Q", message, 2)[0])
        count = struct.unpack_from("<I", message, at + 12)[0]
        self.assertEqual((size, len(message) - at), (16 + 12 * count, size))
        with open(self.target, "rb") as f:
            self.assertIn(b"element vertex %d\n" % count, f.read(1000))
        heights = struct.unpack_from("<%df" % (3 * count), message, at + 16)[1::3]
        self.assertTrue(1 < max(heights) - min(heights) < 2.5)
        self.interrupted(process)

    @unittest.skipUnless(browser.PROGRAM, "no Chromium found (set CHROMIUM)")
    def test_the_page_plays_in_a_browser(self):
        port, page = free_port(), free_port()
        process = self.stream("tcp://127.0.0.1:%d" % port, "--ws", str(page))
        shown = browser.Browser(self, "http://127.0.0.1:%d/" % page)
        send, drawn, k, until = self.sender(port).sendall, None, 0, time.monotonic() + 60
        while not drawn and time.monotonic() < until:
            for _ in range(15):
                send(frame(k / 30, self.clouds[k % 16]))
                time.sleep(1 / 30)
                k += 1
            dom = shown.page()
            drawn = re.search(r"s, frame ([1-9]\d*)</output>", dom)
        self.assertTrue(drawn, "no frame was drawn in a minute: " + dom[:300])
        self.assertIn('data-renderer="', dom)
        self.assertRegex(dom, r'<html[^>]* data-live="[1-9]')
        self.interrupted(process)

    def dressed(self, name):
        """The character with a picture on its body, whose second half of triangles has other texture coordinates for the same
        vertices; so what is drawn has more vertices than what moves."""
        character(self.path(name))
        data = self.bytes(name)
        size = struct.unpack("<I", data[12:16])[0]
        root, binary = json.loads(data[20:20 + size]), data[28 + size:]
        binary += bytes(-len(binary) % 4)

        def view(content):
            nonlocal binary
            root["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(content)})
            binary += content + bytes(-len(content) % 4)
            return len(root["bufferViews"]) - 1
        primitive = root["meshes"][0]["primitives"][0]
        count = root["accessors"][primitive["attributes"]["POSITION"]]["count"]
        corners = root["accessors"][primitive["indices"]]
        half = corners["count"] // 6 * 3
        second = {**corners, "count": corners["count"] - half,
                  "byteOffset": corners.get("byteOffset", 0) + half * {5121: 1, 5123: 2, 5125: 4}[corners["componentType"]]}
        corners["count"] = half
        root["accessors"].append(second)
        other = {**primitive, "indices": len(root["accessors"]) - 1, "attributes": dict(primitive["attributes"]), "material": 0}
        for one, u in ((primitive, 0.25), (other, 0.75)):
            root["accessors"].append({"bufferView": view(struct.pack("<2f", u, 0.5) * count), "componentType": 5126, "count": count, "type": "VEC2"})
            one["attributes"]["TEXCOORD_0"] = len(root["accessors"]) - 1
            one["material"] = 0
        root["meshes"][0]["primitives"] = [primitive, other]
        picture = png(32, 32, lambda x, y: (255, 0, 0, 255) if x < 16 else (0, 255, 0, 255))
        root.update(images=[{"bufferView": view(picture), "mimeType": "image/png"}], textures=[{"source": 0}],
                    materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "extensions": {"KHR_materials_unlit": {}}}],
                    buffers=[{"byteLength": len(binary)}])
        text = json.dumps(root).encode()
        text += b" " * (-len(text) % 4)
        self.write(name, struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(binary), len(text), 0x4E4F534A) + text +
                   struct.pack("<II", len(binary), 0x004E4942) + binary)
        return count

    def meta_of(self, page):
        with urllib.request.urlopen("http://127.0.0.1:%d/" % page) as answer:
            return json.loads(re.search(r'<script id="meta"[^>]*>(.*?)</script>', answer.read().decode()).group(1))

    def test_the_ground_of_the_page_is_that_of_the_motion(self):
        """Wherever the target's file has it."""
        with open(self.target, "rb") as f:
            head, _, body = f.read().partition(b"end_header\n")
        count = int(head.split(b"element vertex ")[1].split()[0])
        lifted = b"".join(struct.pack("<3f", x, y + 5, z) for x, y, z in struct.iter_unpack("<3f", body[:12 * count]))
        self.write("lifted.ply", head + b"end_header\n" + lifted + body[12 * count:])
        page = free_port()
        process = self.stream("-", "--ws", str(page), target="lifted.ply")
        clip = self.meta_of(page)["clips"][0]
        self.assertEqual(clip["floor"], 0)
        self.assertAlmostEqual(clip["low"][1], 0, delta=0.1)
        bundle = self.answer(lambda data: (process.stdin.write(data), process.stdin.flush()), self.clouds[0], 0)
        self.assertLess(max(y for _, y, _ in joints_of(bundle)), 2.5)
        self.interrupted(process)

    @unittest.skipUnless(browser.PROGRAM, "no Chromium found (set CHROMIUM)")
    def test_the_page_shows_the_characters_own_picture(self):
        count = self.dressed("hero.glb")
        port, page = free_port(), free_port()
        process = self.stream("tcp://127.0.0.1:%d" % port, "--ws", str(page), target="hero.glb")
        shown = browser.Browser(self, "http://127.0.0.1:%d/" % page)
        send, k, drawn, until = self.sender(port).sendall, 0, False, time.monotonic() + 60
        while not drawn and time.monotonic() < until:
            for _ in range(15):
                send(frame(k / 30, self.clouds[k % 16]))
                time.sleep(1 / 30)
                k += 1
            drawn = re.search(r"s, frame ([1-9]\d*)</output>", shown.page())
        self.assertTrue(drawn)
        meta = self.meta_of(page)
        self.assertEqual((meta["sent"], meta["clips"][0]["counts"], len(meta["clips"][0]["materials"])), (count, [2 * count], 1))
        self.write("seen.png", shown.picture())
        rows = pixels(self.bytes("seen.png"))
        flat = [p for row in rows for p in row]
        for colour in (0, 1):
            self.assertGreater(sum(p[colour] > 200 and max(p[j] for j in range(3) if j != colour) < 60 for p in flat), 100, "red, green")  # by the frame
        self.interrupted(process)

    def test_ends_after_so_many_seconds(self):
        start = time.monotonic()
        document = json.loads(self.done("stream", "--target", self.target, "--source", "tcp://127.0.0.1:%d" % free_port(), "--vmc",
                                        "127.0.0.1:%d" % self.receiver.port, "--weights", LITE, "--seconds", "0.5", "--json"))
        self.assertLess(time.monotonic() - start, 20)
        self.assertEqual(document["latency_ms"], {"p50": None, "p99": None, "max": None})
        self.assertEqual(document["frames_in"], 0)

    def test_bad_input_is_one_line(self):
        os.mkdir(self.path("in"))
        self.write("file", "x")
        good = {"--target": self.target, "--source": "in", "--vmc": "127.0.0.1:%d" % self.receiver.port, "--weights": LITE}

        def call(**other):
            options = {**good, **{"--" + key: value for key, value in other.items()}}
            return ["stream", *(word for pair in options.items() for word in pair)]
        for port in ("0", "65536", "x", "127.0.0.1", "127.0.0.1:", "127.0.0.1:-1", "127.0.0.1:1x"):
            self.bad_input(call(vmc=port), "--vmc", "port")
            self.bad_input(call(ws=port), "--ws", "port")
            self.bad_input(call(**{"source": "tcp://" + port}), "--source", "port")
        self.bad_input(call(ws=":"), "--ws", "port")
        self.bad_input(call(vmc="no.such.host.invalid:39539"), "--vmc", "no.such.host.invalid")
        self.bad_input(call(**{"source": "tcp://192.0.2.1:9000"}), "--source", "192.0.2.1")  # no address of this machine
        self.bad_input(call(**{"source": "nowhere"}), "nowhere", "no such folder")
        self.bad_input(call(**{"source": "file"}), "file", "no folder")
        self.bad_input(call(**{"source": "udp://127.0.0.1:1"}), "--source", "udp://")
        self.bad_input(call(target="nobody.ply"), "nobody.ply")
        self.bad_input(call(weights="nothing.safetensors"), "nothing.safetensors")
        self.bad_input(call(seconds="0"), "--seconds")
        self.bad_input(call(scale="0"), "--scale")
        self.bad_input(call(samples="0"), "--samples")
        self.bad_input(call(**{"source-up": "w"}), "--source-up")
        self.bad_input(call(**{"min-confidence": "0.5"}), "do not say how sure")  # of these weights
        character(self.path("hero.glb"))
        for out, words in (("take.h5", "is no animation"), ("takes/", "is no animation"), ("take.fbx", "Blender writes"), ("take.mp4", "no kind"),
                           ("no/take.glb", "a folder that is not there"), ("in/take.glb", "the folder from which clouds are read"),
                           ("take.vrm", "own file, which has no rig"), ("take.gltf", "own file, which has no rig")):
            self.bad_input(call(out=out), out, words)
        self.bad_input(call(target="hero.glb", out="hero.glb"), "hero.glb")
        self.bad_input(call(target="hero.glb", out="take.vrm"), "take.vrm", "would be no VRM character")
        self.bad_input(call(target="hero.glb", out="take.glb", skeleton="mixamo"), "hero.glb", "leave --skeleton out")
        self.bad_input(call(skeleton="mixamo"), "--skeleton is for the file of --out")
        self.bad_input(call(out="take.bvh") + ["--animation-only"], "take.bvh", "--animation-only")
        self.ply("dot.ply", [(0, 0, 0)] * 3)
        self.bad_input(call(target="dot.ply"), "dot.ply")
        with socket.socket() as busy:
            busy.bind(("127.0.0.1", 0))
            busy.listen()
            port = busy.getsockname()[1]
            self.bad_input(call(**{"source": "tcp://127.0.0.1:%d" % port}), "--source", "in use")
            self.bad_input(call(ws=str(port)), "--ws", "in use")
            self.bad_input(call(**{"source": "tcp://127.0.0.1:%d" % port, "ws": str(port)}), "same port")


if __name__ == "__main__":
    unittest.main()
