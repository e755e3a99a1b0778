"""restage retarget: sequences of clouds in, a moving target out; by networks, and without learning (--system register)."""
import json
import os
import struct

from support import CliTest, numbers, points, small_disk, sphere
from tiny_run import TPOSES, weights

FRAMES = 5
TARGET = points(90, 77)
FACES = [(i, i + 1, i + 2) for i in range(0, 88, 2)]


class Retarget(CliTest):
    def setUp(self):
        super().setUp()
        self.w = weights("tiny")
        for i in range(FRAMES):
            self.ply("scans/f%d.ply" % i, points(120 + 10 * i, i))
        self.ply("hero.ply", TARGET, FACES)

    def call(self, out, *more, source="scans", target="hero.ply", w=None, force=True):
        return ["retarget", "--source", source, "--target", target, "--weights", w or self.w, "--out", out, *more] + (["--force"] if force else [])

    def counts(self, name):
        return self.json("data", "inspect", name)["counts"]


class Outputs(Retarget):
    def test_hdf5(self):
        self.assertIn("out.h5", self.done(*self.call("out.h5")))
        counts = self.counts("out.h5")
        self.assertEqual((counts["frames"], counts["vertices"]), (FRAMES, len(TARGET)))
        found = self.json("eval", "--pred", "out.h5", "--truth", "out.h5")
        self.assertEqual([s["frames"] for s in found["sequences"]], [FRAMES])
        self.assertEqual((found["mean"]["mpjpe"], found["mean"]["mpvd"]), (0, 0))
        # Another choice of points, other joints; the same choice, the same bytes.
        self.done(*self.call("again.h5"))
        self.assertEqual(self.bytes("again.h5"), self.bytes("out.h5"))
        self.done(*self.call("other.h5", "--seed", "1"))
        self.assertGreater(self.json("eval", "--pred", "other.h5", "--truth", "out.h5")["mean"]["mpjpe"], 0)

    def test_json(self):
        found = self.json(*self.call("out.h5"))
        self.assertEqual({k: found[k] for k in ("out", "source_frames", "frames", "seed")},
                         {"out": "out.h5", "source_frames": FRAMES, "frames": FRAMES, "seed": 0})

    def test_any_number_of_threads_gives_the_same_bytes(self):
        for kind in ("h5", "glb"):
            for n in (1, 2, 3):
                self.done(*self.call("out%d.%s" % (n, kind), "--threads", n))
            self.assertEqual(self.bytes("out1." + kind), self.bytes("out2." + kind))
            self.assertEqual(self.bytes("out1." + kind), self.bytes("out3." + kind))

    def test_glb(self):
        self.done(*self.call("out.glb"))
        data = self.bytes("out.glb")
        magic, version, length, size, kind = struct.unpack("<4sIII4s", data[:20])
        self.assertEqual((magic, version, length, kind), (b"glTF", 2, len(data), b"JSON"))
        scene = json.loads(data[20:20 + size])
        self.assertEqual((len(scene["skins"]), len(scene["skins"][0]["joints"]), len(scene["animations"])), (1, 22, 1))
        primitive = scene["meshes"][0]["primitives"][0]
        count = lambda accessor: scene["accessors"][accessor]["count"]
        self.assertEqual((count(primitive["attributes"]["POSITION"]), count(primitive["indices"])), (len(TARGET), 3 * len(FACES)))
        self.assertEqual({count(s["input"]) for s in scene["animations"][0]["samplers"]}, {FRAMES})

    def test_bvh(self):
        self.done(*self.call("out.bvh"))
        text = self.bytes("out.bvh").decode()
        self.assertEqual((text.count("JOINT"), text.count("ROOT")), (21, 1))
        self.assertRegex(text, r"\nFrames: +%d\n" % FRAMES)
        self.assertEqual(len(text.split("Frame Time:")[1].strip().splitlines()) - 1, FRAMES)

    def test_folders_keep_vertices_order_and_faces(self):
        self.done(*self.call("frames/"))
        self.done(*self.call("objs/", "--format", "obj"))
        self.done(*self.call("out.h5", "--contacts", "on"))
        names = sorted(os.listdir(self.path("frames")))
        self.assertEqual(len(names), FRAMES)
        first = self.bytes("frames/" + names[0])
        self.assertIn(b"element vertex %d\n" % len(TARGET), first)
        self.assertIn(b"element face %d\n" % len(FACES), first)
        obj = self.bytes("objs/" + sorted(os.listdir(self.path("objs")))[0]).decode().splitlines()
        self.assertEqual([tuple(int(i.split("/")[0]) - 1 for i in line.split()[1:]) for line in obj if line.startswith("f ")], FACES)
        self.assertEqual(sum(line.startswith("v ") for line in obj), len(TARGET))
        # The frames are the vertices of the HDF5 file, in its order.
        flat = [float(x) for name in sorted(os.listdir(self.path("objs"))) for line in self.bytes("objs/" + name).decode().splitlines()
                if line.startswith("v ") for x in line.split()[1:4]]
        self.h5("objs.h5", vertices=([FRAMES, len(TARGET), 3], flat))
        self.assertLess(self.json("eval", "--pred", "objs.h5", "--truth", "out.h5")["mean"]["mpvd"], 1e-5)
        self.done(*self.call("frames/"))  # its own frames are replaced
        self.assertEqual(sorted(os.listdir(self.path("frames"))), names)

    def test_frames_of_others_are_not_deleted(self):
        self.ply("captured/frame_000000.ply", points(100, 1))
        self.ply("captured/frame_000001.ply", points(100, 2))
        before = self.bytes("captured/frame_000001.ply")
        self.bad_input(self.call("captured/"), "captured", "frame_00000", "did not write")
        self.assertEqual(sorted(os.listdir(self.path("captured"))), ["frame_000000.ply", "frame_000001.ply"])
        self.assertEqual(self.bytes("captured/frame_000001.ply"), before)

    def test_every_so_many_frames(self):
        found = self.json(*self.call("out.h5", "--every", 3))
        self.assertEqual((found["source_frames"], found["frames"], found["fps"]), (FRAMES, 2, 10))
        self.assertEqual(self.json("render", "out.h5", "--out", "sheet.png")["fps"], 10, "the file's")
        self.assertEqual(self.json(*self.call("out.bvh"))["fps"], 30)
        # What is not read cannot be wrong.
        self.ply("scans/f1.ply", points(3, 1))
        self.assertEqual(self.json(*self.call("out.h5", "--every", 3))["missing"], [])

    def test_target_may_be_a_cloud(self):
        self.ply("cloud.ply", TARGET)
        for out in ("out.h5", "out.glb", "out.bvh", "frames/"):
            self.done(*self.call(out, target="cloud.ply"))
        self.assertEqual(self.counts("out.h5")["vertices"], len(TARGET))


class Sources(Retarget):
    def same(self, a, b):
        self.assertEqual(self.bytes(a), self.bytes(b))

    def test_rates(self):
        for fps, frames in ((30, FRAMES), (60, (FRAMES + 1) // 2), (15, 2 * FRAMES - 1)):
            found = self.json(*self.call("out.h5", "--fps", fps))
            self.assertEqual((found["source_frames"], found["frames"]), (FRAMES, frames))
            self.assertEqual(self.counts("out.h5")["frames"], frames)

    def test_up_axis_and_scale(self):
        turns = {"z": lambda x, y, z: (x, -z, y), "-y": lambda x, y, z: (x, -y, -z), "-z": lambda x, y, z: (x, z, -y)}
        for i in range(FRAMES):
            cloud = points(120 + 10 * i, i)
            for up, turn in turns.items():
                self.ply("up%s/f%d.ply" % (up, i), [turn(*p) for p in cloud])
            self.ply("half/f%d.ply" % i, [(x / 2, y / 2, z / 2) for x, y, z in cloud])
        self.done(*self.call("out.bvh"))
        for up in turns:
            self.done(*self.call("z.bvh", "--source-up", up, source="up" + up))
            self.same("z.bvh", "out.bvh")
        self.done(*self.call("half.bvh", "--scale", "2", source="half"))
        self.same("half.bvh", "out.bvh")
        for up in ("w", "auto"):
            self.bad_input(self.call("out.h5", "--source-up", up), "--source-up", "-z")

    def test_hdf5_and_shuffled_clouds(self):
        cloud = points(150, 3)
        for i in range(3):
            self.ply("same/%d.ply" % i, cloud)
            self.ply("turned/%d.ply" % i, cloud[::-1])
        self.h5("same.h5", vertices=([3, 150, 3], [x for p in cloud for x in p] * 3, "float32"))
        for name in ("same", "turned", "same.h5"):
            self.done(*self.call("out_%s.bvh" % name, source=name))
        self.same("out_same.bvh", "out_turned.bvh")
        self.same("out_same.bvh", "out_same.h5.bvh")

    def test_one_frame(self):
        self.done(*self.call("out.h5", source="scans/f0.ply"))
        self.assertEqual(self.counts("out.h5")["frames"], 1)

    def test_profile(self):
        for given in (["--profile", "names.yaml"], ["--profile=names.yaml"]):  # which `data import` takes for --bones
            self.bad_input(self.call("out.h5", *given), "prints timings", "--bones names.yaml")
        result = self.restage(*self.call("out.h5", "--profile"))
        self.assertEqual(result.code, 0, result.err)
        self.assertIn("ms a frame", result.err)
        self.assertNotIn("ms a frame", result.out)
        self.assertNotIn("profile", self.json(*self.call("out.h5")))
        found = self.json(*self.call("out.h5", "--profile"))["profile"]
        self.assertEqual(list(found), ["read", "extract", "motion", "deformation", "write", "frame"])
        for row in found.values():
            self.assertEqual(list(row), ["p50", "p95", "p99", "max"])
            self.assertEqual(sorted(row.values()), list(row.values()))
            self.assertGreater(row["p50"], 0)
            self.assertLessEqual(row["max"], found["frame"]["max"])


class DoctorsWords(Retarget):
    """Axes and units that would make nonsense of the result are refused with the option that mends them."""

    def setUp(self):
        super().setUp()
        self.w = weights("tposes", *TPOSES)
        self.person(10)
        self.done("doctor", "walk/source.h5", "--fix", "good/")
        self.frames = [self.vertices("good/" + name) for name in sorted(os.listdir(self.path("good")))]

    def source(self, name, move):
        for i, frame in enumerate(self.frames):
            self.ply("%s/f%d.ply" % (name, i), [move(*p) for p in frame])
        return name

    def test_source(self):
        call = lambda *more, **inputs: self.call("out.h5", *more, target="walk/target.ply", force=False, **inputs)
        self.done(*call(source="good"))
        self.assertEqual(self.counts("out.h5")["frames"], 10)
        self.source("z", lambda x, y, z: (x, -z, y))
        self.bad_input(call(source="z"), "z: ", "+z", "--source-up z", "--force")
        self.done(*call("--source-up", "z", source="z"))
        self.done(*call("--force", source="z"))
        self.source("cm", lambda x, y, z: (100 * x, 100 * y, 100 * z))
        self.bad_input(call(source="cm"), "1 cm", "--scale 0.01")
        self.done(*call("--scale", "0.01", source="cm"))
        # What is given already is taken into account.
        self.bad_input(call("--scale", "0.1", source="cm"), "--scale 0.01")
        self.bad_input(call("--scale", "0.01", source="good"), "leave --scale out")
        # Who says where up is is believed, and warned.
        self.assertIn("--source-up z was given, and is taken", self.restage(*call("--source-up", "z", source="good")).err)
        for scale in ("0", "inf", "nan", "1e300", "1e-30"):
            self.bad_input(call("--scale", scale, source="good"), "--scale")

    def test_what_is_no_person(self):
        call = lambda source: self.call("out.h5", target="walk/target.ply", source=source, force=False)
        self.bad_input(call("scans"), "no unit", "--force")
        self.bad_input(call(self.ply("sphere.ply", sphere())), "nobody", "--force")
        for name, by in (("km", 1e-3), ("feet", 1 / 0.3048), ("huge", 1e30)):
            self.source(name, lambda x, y, z: (by * x, by * y, by * z))
            self.bad_input(call(name), name, "--scale", "--force")
        ground = [(0.1 * (i % 40) - 2, 0.001 * (i % 7), 0.1 * (i // 40) - 2) for i in range(1600)]
        for i, frame in enumerate(self.frames):
            self.ply("ground/f%d.ply" % i, frame + ground)
            self.ply("late/f%d.ply" % i, [(100 * x, 100 * y, 100 * z) for x, y, z in frame] if i >= 8 else frame)
        self.bad_input(call("ground"), "a floor", "doctor", "--force")
        # Two frames of ten are a gap, which is too long where there are three frames a second.
        self.bad_input(call("late") + ["--fps", "3"], "f8.ply", "another size than people", "--force")
        self.assertNotIn("out.h5", os.listdir(self.folder))

    def test_target(self):
        hero = self.vertices("walk/target.ply")
        call = lambda name: self.call("out.h5", target=name, source="good", force=False)
        self.bad_input(call(self.ply("back.ply", [(-x, y, -z) for x, y, z in hero])), "back.ply", "faces -z", "--fix")
        turned = [(0.8 * x + 0.6 * z, y, 0.8 * z - 0.6 * x) for x, y, z in hero]
        self.bad_input(call(self.ply("turned.ply", turned)), "not a T-pose", "turned by", "--force")
        self.assertEqual(self.restage("doctor", "turned.ply", "--target").code, 1)
        self.bad_input(self.call("out.h5", target="walk/target.ply", source="good", w=weights("tiny"), force=False), "is not in T-pose", "--force")
        self.bad_input(call(self.ply("mm.ply", [(1000 * x, 1000 * y, 1000 * z) for x, y, z in hero])), "1 mm", "--fix")
        self.done("doctor", "back.ply", "--target", "--fix", "mended.ply")
        self.done(*call("mended.ply"))


class BadRetargeting(Retarget):
    OUTS = ("out.h5", "out.glb", "out.bvh", "frames/")

    def bad(self, *contains, outs=("out.h5",), more=(), **inputs):
        for out in outs:
            self.bad_input(self.call(out, *more, **inputs), *contains)

    def test_targets(self):
        self.bad("hero.ply", "--force", force=False, outs=self.OUTS)
        good = self.bytes("hero.ply")
        bad = lambda name, *words: self.bad(name, *words, target=name)
        bad("none.ply")
        bad(self.write("cut.ply", good[:-20]))
        bad(self.ply("empty.ply", []))
        bad(self.ply("three.ply", points(3, 1)), "3 distinct")
        bad(self.ply("nan.ply", TARGET + [(0, 0, float("nan"))], FACES))
        bad(self.ply("face.ply", TARGET, FACES + [(0, 1, len(TARGET))]), "face")
        bad(self.write("face.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"), "face")
        bad("scans")

    def test_first_frame(self):
        bad = lambda name, *words: self.bad(name, *words, source=name, outs=self.OUTS)
        bad("none")
        os.mkdir(self.path("hollow"))
        bad("hollow")
        bad(self.ply("empty.ply", []))
        bad(self.ply("three.ply", points(3, 1)), "3 distinct")
        bad(self.ply("nan.ply", [(float("nan"), 0, 0)] * 100))
        self.h5("joints.h5", joints=([2, 22, 3], [0.0]))
        bad("joints.h5")
        self.h5("shape.h5", vertices=([2, 100], [0.0]))
        bad("shape.h5")

    def test_several_sequences(self):
        self.h5("two.h5", vertices=([4, 100, 3], numbers(1200, 1), "float32"), sequence_offset=([3], [0, 2, 4], "int64"))
        self.bad("two.h5", "holds 2 sequences", "--sequence", source="two.h5", outs=self.OUTS)
        self.done(*self.call("second.h5", "--sequence", 1, source="two.h5"))
        self.h5("one.h5", vertices=([2, 100, 3], numbers(1200, 1)[600:], "float32"))
        self.done(*self.call("alone.h5", source="one.h5"))
        scores = self.json("eval", "--pred", "second.h5", "--truth", "alone.h5")
        self.assertEqual((scores["sequences"][0]["frames"], scores["mean"]["mpjpe"], scores["mean"]["mpvd"]), (2, 0, 0))
        for source, sequence in (("two.h5", 2), ("two.h5", -1), ("one.h5", 1), ("scans", 1)):
            self.bad_input(self.call("out.h5", "--sequence=%d" % sequence, source=source), "no sequence number")

    def test_weights(self):
        self.bad("none.safetensors", w="none.safetensors")
        for stages in ("skeleton", "motion", "deformation"):
            name = weights("only_" + stages, "stages=[%s]" % stages)
            self.bad("only_" + stages, w=name)
        with open(self.w, "rb") as f:
            whole = f.read()
        self.bad("cut.safetensors", w=self.write("cut.safetensors", whole[:len(whole) // 2]))

    def test_options(self):
        for option, value in (("--fps", "-1"), ("--fps", "nan"), ("--fps", "0.001"), ("--scale", "0"), ("--scale", "-2"),
                              ("--source-up", "w"), ("--format", "stl"), ("--samples", "0")):
            self.bad(option, more=[option, value])
        self.bad("out.fbx", outs=["out.fbx"])
        self.bad("nowhere", outs=["nowhere/" + n for n in ("out.h5", "out.glb", "out.bvh")])
        self.write("own/notes.txt", "not a frame\n")
        self.bad("own", outs=["own/"])
        self.assertEqual(os.listdir(self.path("own")), ["notes.txt"])
        arguments = self.call("out.h5")
        for i in (1, 3, 5, 7):
            if arguments[i] != "--weights":  # the standard ones are used
                self.bad_input(arguments[:i] + arguments[i + 2:], arguments[i])

    def test_full_disk(self):
        before = sorted(os.listdir(self.folder))
        for i in range(40):
            self.ply("scans/f%d.ply" % i, points(100, i))
        for out in ("out.h5", "out.glb", "out.bvh"):
            self.one_line(self.restage(*self.call(out), before=small_disk), 1, out)
            self.assertEqual(sorted(os.listdir(self.folder)), before)
        self.ply("big.ply", points(600, 1))
        before = sorted(os.listdir(self.folder))
        self.one_line(self.restage(*self.call("frames/", target="big.ply"), before=small_disk), 1, "frames")
        self.assertEqual(sorted(os.listdir(self.folder)), before)


class Register(CliTest):
    def setUp(self):
        super().setUp()
        self.done("data", "build", "--bodies", 0, 0, 2, "--motions", 0, 0, 1, "--out", "data.h5", "--quiet")
        self.done("data", "perform", "--bodies", "data.h5", "--body", "builtin_test_0", "--target", "builtin_test_1",
                  "--frames", FRAMES, "--out", "walk", "--quiet")

    def call(self, out, *more, source="walk/source.h5", target="walk/target.ply", rest="walk/rest.h5"):
        return ["retarget", "--system", "register", "--source", source, "--target", target, "--rest", rest, "--out", out, *more]

    def test_a_motion(self):
        found = self.json(*self.call("out.h5"))
        self.assertEqual(found["frames"], FRAMES)
        scores = self.json("eval", "--pred", "out.h5", "--truth", "walk/truth.h5", "--source", "walk/source.h5", "--rest", "walk/rest.h5")
        self.assertLess(scores["mean"]["pa_mpjpe"], 0.8 * scores["references"]["rest_pose"]["pa_mpjpe"])
        self.assertLess(scores["mean"]["mpvd"], 0.3)
        # Every other frame, scored against the same truth; and the same bytes for any number of threads.
        for threads in (1, 2):
            self.done(*self.call(f"two{threads}.h5", "--every", 2, "--threads", threads))
        self.assertEqual(self.bytes("two1.h5"), self.bytes("two2.h5"))
        thin = self.json("eval", "--pred", "two1.h5", "--truth", "walk/truth.h5", "--every", 2)
        self.assertEqual(thin["sequences"][0]["frames"], 3)
        self.assertIsNone(thin["mean"]["acc"])

    def test_bad_input(self):
        bad = lambda *words, **files: self.bad_input(self.call("out.h5", **files), *words)
        bad("none.h5", source="none.h5")
        bad("none.ply", target="none.ply")
        self.bad_input(self.call("out.h5", "--fps", 60), "60 frames a second", "--system register")
        bad("none.h5", rest="none.h5")
        bad("truth.h5:/joints", "one skeleton", rest="walk/truth.h5")
        bad("distinct points", target=self.ply("few.ply", points(10, 1)))
        bad("10 places", source=self.ply("few.ply", points(10, 1)))
        self.bad_input(self.call("out.glb", "--every", 2), ".h5")
        self.bad_input(self.call("out.h5", "--every", 0), "--every")
