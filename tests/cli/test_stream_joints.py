"""restage stream of joints without rotations, and of one of several people: what `retarget` makes of the same, moment by moment."""
import json
import math
import os
import struct
import time
import urllib.request

from test_gltf import character
from test_positions import REST
from test_stream import LITE, StreamTest, frame, free_port, joints_of

FRAMES, LEARNT = 60, 30  # of a take; those of its first second, which are answered by nothing
NAMES = """pelvis left_hip right_hip spine1 left_knee right_knee spine2 left_ankle right_ankle spine3 left_foot right_foot neck
left_collar right_collar head left_shoulder right_shoulder left_elbow right_elbow left_wrist right_wrist""".split()


def posed(f):
    """Arms swing, the person walks ahead and turns."""
    out, swing, turn = [list(x) for x in REST], -.6 + .5 * math.sin(f / 15), f / 90
    for sign, shoulder, elbow, wrist in ((1, 16, 18, 20), (-1, 17, 19, 21)):
        for j in (elbow, wrist):
            reach = abs(REST[j][0] - REST[shoulder][0])
            out[j] = [REST[shoulder][0] + sign * reach * math.cos(swing), 1.4 + reach * math.sin(swing), REST[j][2]]
    for x in out:
        x[2] += f / 60
        x[0], x[2] = x[0] * math.cos(turn) + x[2] * math.sin(turn), x[2] * math.cos(turn) - x[0] * math.sin(turn)
    return out


def line(f, joints=None, **more):
    said = dict(more) if more else {"joints": posed(f) if joints is None else joints}
    return (json.dumps({"time": f / 30, **said}) + "\n").encode()


def turned(axis, degrees, m):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    r = {"X": ((1, 0, 0), (0, c, -s), (0, s, c)), "Y": ((c, 0, s), (0, 1, 0), (-s, 0, c)), "Z": ((c, -s, 0), (s, c, 0), (0, 0, 1))}[axis]
    return [[sum(m[i][k] * r[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def bvh_joints(text):
    """Where our joints are in a BVH file, frame by frame, metres."""
    lines, joints, stack = text.split("\n"), [], []
    start = lines.index("MOTION")
    for words in (one.split() for one in lines[:start]):
        if words and words[0] in ("ROOT", "JOINT", "End"):
            joints.append({"parent": stack[-1] if stack else None, "channels": [], "name": words[1].lower()})
            stack.append(len(joints) - 1)
        elif words and words[0] == "OFFSET":
            joints[stack[-1]]["offset"] = [float(x) for x in words[1:]]
        elif words and words[0] == "CHANNELS":
            joints[stack[-1]]["channels"] = words[2:]
        elif words and words[0] == "}":
            stack.pop()
    out = []
    for row in lines[start + 3:]:
        values, places = iter(float(x) for x in row.split()), []
        if not row.strip():
            continue
        for one in joints:
            move, turn = list(one["offset"]), [[float(i == j) for j in range(3)] for i in range(3)]
            for channel in one["channels"]:
                if channel.endswith("position"):
                    move["XYZ".index(channel[0])] = next(values)
                else:
                    turn = turned(channel[0], next(values), turn)
            if one["parent"] is None:
                places.append((move, turn))
                continue
            at, m = places[one["parent"]]
            places.append(([at[i] + sum(m[i][k] * move[k] for k in range(3)) for i in range(3)],
                           [[sum(m[i][k] * turn[k][j] for k in range(3)) for j in range(3)] for i in range(3)]))
        of = {one["name"]: [x / 100 for x in at] for (at, _), one in zip(places, joints)}  # centimetres
        out.append([of[name] for name in NAMES])
    return out


def apart(a, b):
    """Mean and largest distance of joints."""
    all_of = [math.dist(x, y) for one, other in zip(a, b) for x, y in zip(one, other)]
    return sum(all_of) / len(all_of), max(all_of)


class Lines(StreamTest):
    def setUp(self):
        super().setUp()
        character(self.path("hero.glb"))

    def perform(self, send, lines):
        """The bundles behind the first second: of the last lines, one each."""
        bundles = []
        for k, data in enumerate(lines):
            send(data)
            if k < LEARNT - 1:
                time.sleep(.02)
                continue
            bundle = self.receiver.next(10 if bundles or k > LEARNT + 8 else .5)  # the very first lines may be overtaken
            self.assertTrue(bundle is not None or not bundles and k <= LEARNT + 8, k)
            bundles += [bundle] if bundle is not None else []
        return bundles

    def writer(self, process):
        return lambda data: (process.stdin.write(data), process.stdin.flush())

    def closed(self, process, code=0):
        process.stdin.close()
        process.stdin = None
        return self.ended(process, code)

    def test_a_take_is_nearly_that_of_retarget(self):
        """Where bones point is exact in both; the floor is found in the first second here, in the whole take there."""
        lines = [line(f) for f in range(FRAMES)]
        self.write("take.jsonl", b"".join(lines))
        for target, more in (("hero.glb", []), (self.target, ["--weights", LITE])):
            self.done("retarget", "--source", "take.jsonl", "--target", target, "--out", "truth.bvh", *more)
            process = self.stream("-", "--out", "take.bvh", target=target)
            bundles = self.perform(self.writer(process), lines)
            document, err = self.closed(process)
            self.assertEqual(document["frames_out"], len(bundles))
            self.assertEqual(document["take_frames"], len(bundles))
            self.assertIn("22 joints a frame", err)
            self.assertIn("up: y", err)
            mine, truth = (bvh_joints(self.bytes(name).decode()) for name in ("take.bvh", "truth.bvh"))
            mean, most = apart(mine, truth[-len(bundles):])
            self.assertLess(mean, .006, target)
            self.assertLess(most, .04, target)
            self.assertLess(apart([joints_of(b) for b in bundles], mine)[1], .001, "the file holds what was sent")

    def test_names_gaps_and_broken_lines(self):
        process = self.stream("-", target="hero.glb")
        send = self.writer(process)

        def named(f, without=()):
            return line(f, joints={name: x for name, x in zip(NAMES, posed(f)) if name not in without})
        bundles = self.perform(send, [named(f, ["head"]) for f in range(40)])
        send(b'{"time": 1.34, "joints": {"pelvis": [1, 2\n')  # the 41st
        send(line(41, joints={"pelvis": None, "head": None}))
        send(b"\n")
        time.sleep(.1)
        for f in range(44, 50):  # three moments are missing, and from now on joints
            send(named(f, ["left_wrist", "right_hip"]))
            bundles.append(self.receiver.next())
            self.assertIsNotNone(bundles[-1])
        places = joints_of(bundles[-1])
        wrist, truth = [a - b for a, b in zip(places[20], places[0])], [a - b for a, b in zip(posed(49)[20], posed(49)[0])]
        self.assertGreater(sum(a * b for a, b in zip(wrist, truth)) / math.hypot(*wrist) / math.hypot(*truth), .9)
        document, err = self.closed(process)
        self.assertEqual(document["frames_out"], len(bundles))
        self.assertLessEqual(document["dropped_because"]["unusable"], 2)
        self.assertGreaterEqual(document["dropped_because"]["unusable"], 1)
        self.assertIn("a line was left out: standard input:4", err)
        self.assertEqual(document["restarts"], 0)

    def test_millimetres_whose_z_points_up_on_a_socket(self):
        port = free_port()
        process = self.stream("tcp://127.0.0.1:%d" % port, "--source-up", "z", "--scale", "mm", "--layout", "smpl22", target="hero.glb")
        lines = [line(f, joints=[[1000 * x, -1000 * z, 1000 * y] for x, y, z in posed(f)]) for f in range(40)]
        first = self.sender(port)
        bundles = self.perform(first.sendall, lines)
        first.close()
        # Another sender may be another person, from whom it is learnt anew.
        again = self.perform(self.sender(port).sendall, lines)
        document, err = self.interrupted(process)
        self.assertIn("up: z, as given", err)
        self.assertEqual(err.count("up: z"), 2)
        self.assertLess(apart([joints_of(b) for b in bundles[-8:]], [joints_of(b) for b in again[-8:]])[1], .005)
        self.assertGreater(min(joints_of(b)[15][1] for b in bundles), joints_of(bundles[0])[0][1], "the head is up")

    def test_feet_stay_above_the_floor_and_hands_outside(self):
        """After the first second the person sinks by 4 cm, and the hands are in front of the belly."""
        def sunk(f):
            out = [[x, y - (.04 if f > 32 else 0), z] for x, y, z in REST]
            for sign, elbow, wrist in ((1, 18, 20), (-1, 19, 21)):
                out[elbow], out[wrist] = [sign * .25, 1.16, -.02], [sign * .06, 1.06, .1]
            return out
        ways = {}
        for kept in (("on", "on"), ("off", "on"), ("on", "off")):
            process = self.stream("-", "--floor", kept[0], "--contacts", kept[1], target="hero.glb")
            bundles = self.perform(self.writer(process), [line(f, joints=sunk(f)) for f in range(50)])
            self.closed(process)
            ways[kept] = joints_of(bundles[-1])
        both, no_floor, no_contacts = ways.values()
        self.assertGreater(min(both[7][1], both[8][1]), min(no_floor[7][1], no_floor[8][1]) + .02)
        self.assertGreater(math.dist(both[20], no_contacts[20]), .003)
        self.assertLess(math.dist(both[16], no_contacts[16]), .001)

    def test_the_page_shows_them(self):
        page = free_port()
        process = self.stream("-", "--ws", str(page))
        with urllib.request.urlopen("http://127.0.0.1:%d/" % page, timeout=10) as answer:
            self.assertIn(b'"live":true', answer.read())
        web = self.sender(page)
        web.sendall(("GET / HTTP/1.1\r\nHost: 127.0.0.1:%d\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                     "Sec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==\r\n\r\n" % page).encode())
        self.perform(self.writer(process), [line(f) for f in range(34)])
        data = b""
        while b"\r\n\r\n" not in data or len(data) < 20000:
            more = web.recv(1 << 16)
            self.assertTrue(more, "the page was closed after %d bytes" % len(data))
            data += more
        message = data.partition(b"\r\n\r\n")[2]
        count = struct.unpack_from("<I", message, (4 if message[1] == 126 else 10) + 12)[0]
        with open(self.target, "rb") as f:
            self.assertIn(b"element vertex %d\n" % count, f.read(1000))
        self.closed(process)

    def test_what_cannot_be_used_ends_the_stream(self):
        joints = posed(0)
        for lines, words, more in (
                ([b"{ no\n"] * 3, "standard input:1: is no valid JSON", []),
                ([line(f, joints=joints[:21]) for f in range(30)], "holds 21 joints a frame", []),
                ([line(f, joints={"a": [1, 2, 3], "b": [2, 3, 4]}) for f in range(30)], "both hips and both shoulders", []),
                ([line(f) for f in range(30)], "--layout coco17 has 17", ["--layout", "coco17"]),
                ([line(f, bodies=[{"joints": joints}, {"joints": joints}]) for f in range(30)], "--person N", []),
                ([line(f) for f in range(3)], "--samples is for clouds", ["--samples", "2"]),
                ([frame(0, self.clouds[0])], "--layout is for joints", ["--layout", "smpl22"])):
            process = self.stream("-", "--out", "take.bvh", *more, target="hero.glb")
            for data in lines:
                try:
                    self.writer(process)(data)
                except BrokenPipeError:  # it has ended
                    break
                time.sleep(.04)
            out, err = process.communicate(timeout=30)
            self.assertEqual((process.returncode, out), (2, b""), err)
            last = err.decode().splitlines()[-1]
            self.assertTrue(last.startswith("restage: ") and words in last, last)
            self.assertEqual(err.decode().count(words), 1, err)
            self.assertFalse(os.path.exists(self.path("take.bvh")))

    def test_lines_that_come_all_at_once(self):
        """A file in a pipe is no stream, and what was to be written is not."""
        lines = b"".join(line(f) for f in range(90))
        process = self.stream("-", target="hero.glb")
        out, err = process.communicate(lines, timeout=30)
        self.assertEqual(process.returncode, 0, err)
        self.assertIn(b"lines came faster than they can be taken", err)
        self.assertIn(b"restage retarget --source take.jsonl", err)
        process = self.stream("-", "--out", "take.bvh", target="hero.glb")
        out, err = process.communicate(lines, timeout=30)
        self.assertEqual((process.returncode, out), (2, b""), err)
        self.assertIn(b"take.bvh is not written", err.splitlines()[-1])

    def test_what_is_no_line_of_joints_and_who_has_gone(self):
        process = self.stream("-", target="hero.glb")
        send = self.writer(process)
        send(b"INFO tracker started\n")
        time.sleep(.1)

        def somebody(f, who):
            return line(f, bodies=[{"body_id": who, "joints": posed(f)}])
        bundles = self.perform(send, [somebody(f, 3) for f in range(36)])
        send(b'{"time": 1.2, "x": "' + b"a" * 1200000 + b'"}\n')
        time.sleep(.1)
        send(somebody(37, 3))
        self.assertIsNotNone(self.receiver.next())
        send(somebody(38, 8))
        time.sleep(.1)
        document, err = self.closed(process)
        self.assertEqual(document["frames_out"], len(bundles) + 1)
        self.assertIn("line 38 is longer than 1 MB", err)
        self.assertIn("standard input:1: is no valid JSON: 'INFO tracker started'", err)
        self.assertIn("whose id is 3; others are there: 8", err)

    def test_less_than_a_second_moves_nobody(self):
        process = self.stream("-", target="hero.glb")
        self.writer(process)(b"[\n\n")
        for f in range(10):
            self.writer(process)(line(f))
            time.sleep(.05)
        document, err = self.closed(process)
        self.assertEqual(document["frames_out"], 0)
        # A slow machine takes less than half of them.
        self.assertRegex(err, "a second of them has to be learnt from|came faster than they can be taken")

    def test_one_of_several_in_lines(self):
        def both(f):
            return line(f, bodies=[{"body_id": 4, "joints": [[x + 3, y, z] for x, y, z in posed(f)]}, {"body_id": 9, "joints": posed(f)}])
        ways = []
        for person in ("1", "nearest", "0"):
            process = self.stream("-", "--person", person, target="hero.glb")
            ways.append([joints_of(b) for b in self.perform(self.writer(process), [both(f) for f in range(36)])][-4:])
            self.closed(process)
        self.assertLess(apart(ways[0], ways[1])[1], .005)
        self.assertGreater(apart(ways[0], ways[2])[0], 1)


class People(StreamTest):
    def passing(self):
        """Two who walk past each other; the one who comes from +x is nearer."""
        clouds = []
        for k, points in enumerate(self.clouds):
            x = .8 - 1.6 * k / 15
            clouds.append([(p[0] - x, p[1], p[2] + 1.7) for p in points] + [(p[0] + x, p[1], p[2] + .2) for p in self.clouds[-1 - k]])
        return clouds

    def test_one_of_two_who_pass_each_other(self):
        """Byte by byte what `retarget --online` makes of that person."""
        clouds = self.passing()
        for k, points in enumerate(clouds):
            self.ply("scans/f%02d.ply" % k, points)
        self.bad_input(["retarget", "--source", "scans", "--target", self.target, "--out", "x.bvh"], "a second person", "--person N")
        made = []
        for person, same in (("0", "0"), ("1", "1"), ("nearest", "1")):
            self.done("retarget", "--source", "scans", "--target", self.target, "--weights", LITE, "--contacts", "on", "--online", "--person", same,
                      "--out", "truth.bvh")
            process = self.stream("-", "--person", person, "--out", "take.bvh")
            for k, points in enumerate(clouds):
                self.answer(lambda data: (process.stdin.write(data), process.stdin.flush()), points, k / 30)
            process.stdin.close()
            process.stdin = None
            document, _ = self.ended(process)
            self.assertEqual(document["take_frames"], 16)
            made.append(self.bytes("take.bvh"))
            self.assertEqual(made[-1], self.bytes("truth.bvh"), person)
        self.assertNotEqual(made[0], made[1])

    def test_who_is_not_there(self):
        process = self.stream("-", "--person", "2")
        for k, points in enumerate(self.passing()):
            process.stdin.write(frame(k / 30, points))
            process.stdin.flush()
            time.sleep(.02)
        process.stdin.close()
        process.stdin = None
        document, err = self.ended(process)
        self.assertEqual(document["frames_out"], 0)
        self.assertIn("shows 2 people, no number 2", err)
        call = ["stream", "--target", self.target, "--source", "-", "--vmc", "39539"]
        self.bad_input([*call, "--person", "left"], "--person", "nearest")
        self.bad_input([*call, "--layout", "left"], "--layout", "coco17")
