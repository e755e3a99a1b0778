"""restage track: one mesh over all scans of somebody."""
import json
import os
import struct
import unittest

from support import CliTest

FRAMES = 12


def parts(data):
    """The document and the binary chunk of a GLB file."""
    magic, version, length = struct.unpack("<4sII", data[:12])
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size = struct.unpack("<I", data[12:16])[0]
    return json.loads(data[20:20 + size]), data[28 + size:]


class Track(CliTest):
    def setUp(self):
        super().setUp()
        self.vertices_of_template = len(self.person(FRAMES))

    def call(self, out, *more, source="walk/source.h5", template="walk/target.ply"):
        return ["track", "--source", source, "--template", template, "--out", out, *more]

    def test_the_file_has_rig_surface_and_errors(self):
        found = self.json(*self.call("actor.glb", "--error", 0.3))
        self.assertEqual((found["frames"], found["source_frames"], len(found["frame_distances_mm"])), (FRAMES, FRAMES, FRAMES))
        # Points have 5 mm of noise: half of them are farther than 3.4 mm from the true surface, too.
        self.assertLess(found["distance_mm"]["median"], 5)
        self.assertLess(found["distance_mm"]["p95"], 16)
        self.assertEqual(found["poor_frames"], [])
        self.assertEqual(found["bytes"], os.path.getsize(self.path("actor.glb")))
        self.assertAlmostEqual(found["kilobytes_per_second"], found["bytes"] * 30 / FRAMES / 1000)
        self.assertLessEqual(found["surface_error_mm"]["p95"], 0.3)
        targets = found["morph_targets"]
        self.assertGreater(targets, 0)
        root, binary = parts(self.bytes("actor.glb"))
        primitive = root["meshes"][0]["primitives"][0]
        self.assertEqual(len(primitive["targets"]), targets)
        self.assertEqual(root["extensionsRequired"], ["KHR_mesh_quantization"])
        for target in primitive["targets"]:
            accessor = root["accessors"][target["POSITION"]]
            self.assertEqual((accessor["count"], accessor["componentType"], accessor["normalized"]), (self.vertices_of_template, 5120, True))
            view = root["bufferViews"][accessor["bufferView"]]
            rows = list(struct.iter_unpack("<3bx", binary[view["byteOffset"]:view["byteOffset"] + view["byteLength"]]))
            self.assertEqual([min(r[axis] for r in rows) for axis in range(3)], accessor["min"])
            self.assertEqual([max(r[axis] for r in rows) for axis in range(3)], accessor["max"])
        animation = root["animations"][0]
        channel = [c for c in animation["channels"] if c["target"]["path"] == "weights"]
        self.assertEqual(len(channel), 1)
        self.assertEqual(root["nodes"][channel[0]["target"]["node"]]["mesh"], 0)
        self.assertEqual(root["accessors"][animation["samplers"][channel[0]["sampler"]]["output"]]["count"], FRAMES * targets)
        self.assertEqual(len(animation["extras"]["distance_mm"]), FRAMES)
        self.assertEqual(len(animation["extras"]["confidence"]), FRAMES)
        self.done("view", "actor.glb", "--out", "a.png")
        again = self.json(*self.call("again.glb", "--error", 0.3))
        self.assertEqual(again["surface_error_mm"], found["surface_error_mm"])
        self.assertEqual(self.bytes("again.glb"), self.bytes("actor.glb"))

    def test_fewer_targets_where_more_error_is_allowed(self):
        fine = self.json(*self.call("fine.glb", "--error", 0.2))
        coarse = self.json(*self.call("coarse.glb", "--error", 2))
        self.assertGreater(fine["morph_targets"], coarse["morph_targets"])
        self.assertGreater(fine["bytes"], coarse["bytes"])

    def test_numbers_and_frames(self):
        found = self.json(*self.call("out.h5"))
        self.assertNotIn("morph_targets", found)
        self.assertEqual(self.json("data", "inspect", "out.h5")["counts"]["frames"], FRAMES)
        self.done("data", "verify", "out.h5")
        self.done(*self.call("frames/"))
        names = sorted(os.listdir(self.path("frames")))
        self.assertEqual(len(names), FRAMES)
        self.assertEqual(len(self.vertices("frames/" + names[-1])), self.vertices_of_template)

    def test_a_frame_that_cannot_be_used_has_no_distance(self):
        self.done("doctor", "walk/source.h5", "--fix", "good/")
        names = sorted(os.listdir(self.path("good")))
        self.write("good/" + names[5], b"ply\nnothing")
        found = self.json(*self.call("out.glb", source="good/"))
        self.assertEqual(([m["frame"] for m in found["missing"]], found["filled"]), ([5], [5]))
        self.assertEqual([f for f, d in enumerate(found["frame_distances_mm"]) if d is None], [5])
        root, _ = parts(self.bytes("out.glb"))
        self.assertIsNone(root["animations"][0]["extras"]["distance_mm"][5])

    def test_what_cannot_be_done_is_said(self):
        self.ply("points.ply", self.vertices("walk/target.ply"))
        self.bad_input(self.call("a.glb", template="points.ply"), "points.ply", "has no faces")
        self.bad_input(self.call("a.glb", "--fps", 60), "source.h5", "60 frames a second")
        self.bad_input(self.call("a.glb", "--error", 0), "--error")
        self.bad_input(self.call("a.bvh"), "a.bvh", "end it in .glb")
        self.bad_input(self.call("a.glb", template="walk/rest.h5"), "rest.h5")


if __name__ == "__main__":
    unittest.main()
