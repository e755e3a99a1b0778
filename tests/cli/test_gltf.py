"""Rigged glTF characters: as bodies and motions, as targets, as sources."""
import json
import os
import struct
import sys

from support import CliTest, points
from test_data import JOINTS as NAMES, PARENTS
from tiny_run import TPOSES, weights

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "docs"))
from anny_to_glb import write_glb  # noqa: E402: what the documentation tells users to run

# An A-pose with z up, as Anny's: x, depth towards -y, height.
HEADS = [(0, 0, .95), (.09, 0, .88), (-.09, 0, .88), (0, 0, 1.06), (.1, 0, .48), (-.1, 0, .48), (0, 0, 1.2), (.1, 0, .08),
         (-.1, 0, .08), (0, 0, 1.27), (.1, -.1, .02), (-.1, -.1, .02), (0, 0, 1.47), (.07, 0, 1.39), (-.07, 0, 1.39),
         (0, 0, 1.56), (.18, 0, 1.41), (-.18, 0, 1.41), (.38, 0, 1.21), (-.38, 0, 1.21), (.58, 0, 1.01), (-.58, 0, 1.01)]


def character(path, names=NAMES):
    """Every bone carries three points about its head; 16 of 66 triangles cross from bone to bone."""
    vertices, faces, w, index = [], [], [], []
    for bone, (x, y, z) in enumerate(HEADS):
        first = len(vertices)
        vertices += [(x + .03, y, z), (x, y + .03, z), (x, y, z + .03)]
        faces += [(first, first + 1, first + 2), (first, first + 1, max(first - 3, 0)), (first, first + 2, max(first - 2, 0))]
        w += [[.75, .25, 0, 0, 0]] * 3
        index += [[bone, max(PARENTS[bone], 0), 0, 0, 0]] * 3
    write_glb(path, vertices, faces, names, PARENTS, HEADS, w, index)
    return len(vertices), faces


class Gltf(CliTest):
    def setUp(self):
        super().setUp()
        self.vertices, self.faces = character(self.path("hero.glb"))

    def change(self, name, change):
        """A copy of hero.glb with another structure."""
        data = self.bytes("hero.glb")
        size = struct.unpack("<I", data[12:16])[0]
        root = json.loads(data[20:20 + size])
        change(root)
        text = json.dumps(root).encode()
        text += b" " * (-len(text) % 4)
        rest = data[20 + size:]
        return self.write(name, struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON") + text + rest)

    def test_import_says_what_it_found(self):
        found = self.json("data", "import", "hero.glb", "--out", "hero.h5", "--license", "CC0-1.0")
        self.assertEqual((found["bodies"], found["motions"], found["skipped"]), (1, 0, []))
        facts = found["reports"][0]["facts"]
        self.assertIn("z (from", facts["up"])
        self.assertIn("left upper arm 45.0 degrees", facts["rest pose"])
        self.assertIn("left_knee = 'left_knee'", facts["joints"])
        self.assertEqual(self.json("data", "verify", "hero.h5")["problems"], [])
        counts = self.json("data", "inspect", "hero.h5")["counts"]
        self.assertEqual(counts["bodies"], 1)
        text = self.done("data", "import", "hero.glb", "--out", "hero.h5")
        self.assertIn("  rest pose     turned onto the T-pose", text)

    def test_a_folder_may_mix_files(self):
        os.makedirs(self.path("in"))
        os.rename(self.path("hero.glb"), self.path("in/hero.glb"))
        self.write("in/bad.glb", b"glTF")
        found = self.json("data", "import", "in", "--out", "all.h5")
        self.assertEqual((found["bodies"], len(found["skipped"])), (1, 1))

    def test_what_cannot_be_read(self):
        draco = self.change("draco.glb", lambda r: r.update(extensionsRequired=["KHR_draco_mesh_compression"]))
        self.bad_input(["data", "import", draco, "--out", "x.h5"], "Draco", 'npx @gltf-transform/cli copy "draco.glb"')
        names = self.change("names.glb", lambda r: r["nodes"][4].update(name="bone"))
        self.bad_input(["data", "import", names, "--out", "x.h5"], "left_knee")
        outside = self.change("outside.glb", lambda r: r["buffers"][0].update(uri="../secret.bin"))
        self.bad_input(["data", "import", outside, "--out", "x.h5"], "outside of its folder")
        self.bad_input(["data", "import", "hero.glb", "--out", "x.h5", "--clip", "walk"], "no animation")
        self.bad_input(["data", "import", "hero.glb", "--out", "x.h5", "--fps", "24"], "--fps")
        self.bad_input(["data", "import", "hero.glb", "--out", "x.h5", "--rest-frame", "0"], "--rest-frame")

    def test_no_skin_is_no_character(self):
        loose = self.change("loose.glb", lambda r: [node.pop("skin", None) for node in r["nodes"]])
        self.bad_input(["data", "import", loose, "--out", "x.h5"], "loose.glb", "no skin")
        bare = self.change("bare.glb", lambda r: (r.pop("skins"), [node.pop("skin", None) for node in r["nodes"]]))
        self.bad_input(["data", "import", bare, "--out", "x.h5"], "bare.glb", "no skin")

    def test_a_profile_names_bones(self):
        names = ["bone %d" % j for j in range(22)]
        character(self.path("own.glb"), names)
        self.bad_input(["data", "import", "own.glb", "--out", "x.h5"], "own.glb", "--bones")
        self.write("own.yaml", "title: Own\njoints:\n" + "".join("  %s: %s\n" % pair for pair in zip(NAMES, names)))
        facts = self.json("data", "import", "own.glb", "--bones", "own.yaml", "--out", "x.h5")["reports"][0]["facts"]
        self.assertEqual(facts["names"], "Own (profile own)")
        self.bad_input(["data", "import", "hero.glb", "--bones", "mixamo", "--out", "x.h5"], "hero.glb", "profile mixamo")
        self.bad_input(["data", "import", "hero.glb", "--facing", "z", "--out", "x.h5"], "--facing")

    def test_bones_of_a_target_are_named(self):
        names = ["bone %d" % j for j in range(22)]
        character(self.path("own.glb"), names)
        self.ply("scans/f0.ply", points(120, 1))
        call = ["retarget", "--weights", weights("tposes", *TPOSES), "--source", "scans", "--target", "own.glb", "--out", "out.h5"]
        self.bad_input(call, "own.glb", "not recognised", "none of its", "--bones")
        self.write("own.YML", "title: Own\njoints:\n" + "".join("  %s: %s\n" % pair for pair in zip(NAMES, names)))
        found = self.restage(*call, "--bones", "own.YML", "--force")
        self.assertEqual(found.code, 0, found.err)
        self.assertIn("A-pose turned into T-pose", found.err)  # brought into the T-pose by its rig
        self.bad_input(call + ["--bones", "none.yaml"], "none.yaml")
        doctor = ["doctor", "own.glb", "--as-target", "--json"]
        self.assertIn("not recognised", self.restage(*doctor).out)
        named = json.loads(self.restage(*doctor, "--bones", "own.YML").out)
        self.assertNotIn("not recognised", str(named))
        self.assertEqual([f["evidence"] for f in named["findings"] if f["topic"] == "up"], ["the rig's joints"])
        self.bad_input(["doctor", "own.glb", "--bones", "none.yaml"], "none.yaml")
        self.bad_input(["doctor", self.ply("plain.ply", points(80, 1)), "--bones", "own.YML"], "plain.ply", "no bones", "leave --bones out")
        self.ply("plain.ply", points(90, 7))
        self.bad_input([word.replace("own.glb", "plain.ply") for word in call] + ["--bones", "own.YML"], "plain.ply", "leave --bones out")

    def scaled(self, name, *scale):
        """A copy of hero.glb below a node of this scale."""
        def change(root):
            above = next(i for i, node in enumerate(root["nodes"]) if node.get("name") == NAMES[0])
            root["nodes"].append({"name": "scaled", "scale": scale, "children": [above]})
            roots = root["scenes"][0]["nodes"]
            roots[roots.index(above)] = len(root["nodes"]) - 1
        return self.change(name, change)

    def test_mirrored_by_a_scale(self):
        self.scaled("mirror.glb", -1, 1, 1)
        self.bad_input(["data", "import", "mirror.glb", "--out", "x.h5"], "mirror.glb", "left and right are exchanged")
        self.assertEqual(self.json("data", "import", "mirror.glb", "--force", "--out", "x.h5")["bodies"], 1)

    def test_inches(self):
        facts = self.json("data", "import", self.scaled("inches.glb", 39.37, 39.37, 39.37), "--out", "x.h5")["reports"][0]["facts"]
        self.assertIn("0.0254 m (inches by the leg", facts["units"])

    def test_target_and_source(self):
        w = weights("tposes", *TPOSES)
        for i in range(5):
            self.ply("scans/f%d.ply" % i, points(120, i))
        call = ["retarget", "--weights", w, "--force"]
        result = self.restage(*call, "--source", "scans", "--target", "hero.glb", "--out", "first.glb")
        self.assertEqual(result.code, 0, result.err)
        self.assertIn("hero.glb: ", result.err)
        self.assertIn("A-pose turned into T-pose", result.err)
        # What we wrote comes back in: as a source, frame by frame, and as a target.
        self.ply("plain.ply", points(90, 7))
        self.done(*call, "--source", "first.glb", "--target", "plain.ply", "--out", "second.h5")
        self.assertEqual(self.json("data", "inspect", "second.h5")["counts"]["frames"], 5)
        self.done(*call, "--source", "scans", "--target", "first.glb", "--out", "third.h5")
        self.assertEqual(self.json("data", "inspect", "third.h5")["counts"]["vertices"], self.vertices)
        found = self.json("data", "import", "first.glb", "--out", "first.h5")
        self.assertEqual((found["bodies"], found["motions"], found["frames"]), (1, 1, 5))
        self.bad_input(call + ["--source", "first.glb", "--clip", "jump", "--target", "plain.ply", "--out", "x.h5"],
                       "jump", "'scans'")
        self.bad_input(call + ["--source", "scans", "--clip", "jump", "--target", "plain.ply", "--out", "x.h5"], "--clip")
        self.bad_input(call + ["--source", "first.glb", "--fps", "60", "--target", "plain.ply", "--out", "x.h5"], "leave --fps out")

    def test_a_rig_decides_for_doctor_and_retarget(self):
        # 22 specks that look like nobody: the rig says who stands there, and that in T-pose.
        result = self.restage("doctor", "hero.glb", "--as-target", "--json")
        found = json.loads(result.out)
        said = {f["topic"]: (f["weight"], f["evidence"]) for f in found["findings"]}
        self.assertEqual(said["up"], ("fact", "the rig's joints"))
        self.assertEqual(said["facing"], ("fact", "the rig's joints"))
        self.assertEqual(said["pose"][0], "fact")
        self.assertEqual(found["transform"]["rotation"], [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
        # The same of names that nobody knows: never turned over.
        names = ["bone %d" % j for j in range(22)]
        character(self.path("own.glb"), names)
        found = json.loads(self.restage("doctor", "own.glb", "--as-target", "--json").out)
        self.assertEqual([f["weight"] != "wrong" and f["what"].startswith("+y is up") for f in found["findings"] if f["topic"] == "up"], [True])
        # retarget asks the same: no weights here, so that nothing but the target is judged.
        w = weights("tposes", *TPOSES)
        self.done("data", "build", "--bodies", 1, 0, 1, "--motions", 1, 0, 0, "--quiet", "--out", "data.h5")
        self.done("data", "perform", "--bodies", "data.h5", "--frames", 12, "--quiet", "--out", "walk")
        call = ["retarget", "--weights", w, "--source", "walk/source.h5", "--out", "x.h5", "--target"]
        doctor = self.restage("doctor", "hero.glb", "--as-target").code
        self.assertEqual(self.restage(*call, "hero.glb").code, 0 if doctor == 0 else 2)

    def test_mirrored_rigs_are_named(self):
        other = {"left": "right", "right": "left"}
        character(self.path("mirror.glb"), ["_".join(other.get(word, word) for word in name.split("_")) for name in NAMES])
        hands = lambda name: [f["weight"] for f in json.loads(self.restage("doctor", name, "--json").out)["findings"] if f["topic"] == "handedness"]
        self.assertEqual((hands("hero.glb"), hands("mirror.glb")), (["fact"], ["wrong"]))
        self.ply("scans/f0.ply", points(120, 1))
        self.bad_input(["retarget", "--weights", weights("tposes", *TPOSES), "--source", "scans", "--target", "mirror.glb", "--out", "x.h5"],
                       "mirror.glb", "mirror image", "--force")
