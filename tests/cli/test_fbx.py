"""FBX as target and as source (datasets/readers/fbx/fbx.h): files made here as text by FBX's own formula, real ones where they are at hand,
and the way to FBX through Blender."""
import base64
import json
import math
import os
import random
import shutil
import struct
import subprocess
import unittest

from fbx_files import Bone, Scene, inverse, moved, place, product, turned
from support import CliTest, PROGRAM, ROOT, CACHE
from test_characters import CHARACTERS, lacking, python_with_numpy
from test_data import JOINTS as NAMES, PARENTS
from test_gltf import HEADS

SCRIPT = os.path.join(ROOT, "docs", "glb_to_fbx.py")
METRES = [[.01, 0, 0, 0], [0, 0, .01, 0], [0, -.01, 0, 0], [0, 0, 0, 1]]  # from centimetres, z up, facing -y


def refuses_fbx():
    """Why FBX cannot be tried; empty: it can."""
    name = os.path.join(CACHE, "probe.fbx")
    with open(name, "w") as file:
        file.write("; FBX 7.4.0 project file\n")
    done = subprocess.run([PROGRAM, "doctor", name], capture_output=True, text=True)
    return "this program was built without Assimp" if "without Assimp" in done.stderr else ""


class Glb:
    """What these tests ask of a document: nodes, and where they are at a key of an animation."""

    def __init__(self, content):
        size = struct.unpack("<I", content[12:16])[0]
        self.json, self.binary = json.loads(content[20:20 + size]), content[20 + size + 8:]
        self.number = {node["name"]: n for n, node in enumerate(self.json["nodes"])}

    def floats(self, accessor):
        a = self.json["accessors"][accessor]
        view = self.json["bufferViews"][a["bufferView"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}[a["type"]]
        at = view.get("byteOffset", 0) + a.get("byteOffset", 0)
        flat = struct.unpack("<%d%s" % (a["count"] * width, "H" if a["componentType"] == 5123 else "f"),
                             self.binary[at:at + a["count"] * width * (2 if a["componentType"] == 5123 else 4)])
        return [flat[i:i + width] for i in range(0, len(flat), width)]

    def local(self, node):
        x, y, z, w = node.get("rotation", (0, 0, 0, 1))
        turn = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), 0],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), 0],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), 0], [0, 0, 0, 1]]
        s = node.get("scale", (1, 1, 1))
        return product(moved(node.get("translation", (0, 0, 0))), turn, [[s[0], 0, 0, 0], [0, s[1], 0, 0], [0, 0, s[2], 0], [0, 0, 0, 1]])

    def worlds(self, animation=None, key=0):
        """By the names of nodes; of an animation whose keys are at the same times for all nodes."""
        nodes = [dict(node) for node in self.json["nodes"]]
        for channel in (animation or {}).get("channels", []):
            sampler = animation["samplers"][channel["sampler"]]
            values = self.floats(sampler["output"])
            nodes[channel["target"]["node"]][channel["target"]["path"]] = values[min(key, len(values) - 1)]
        out = {}

        def visit(number, above):
            out[nodes[number]["name"]] = world = product(above, self.local(nodes[number]))
            for child in nodes[number].get("children", []):
                visit(child, world)
        for root in self.json["scenes"][0]["nodes"]:
            visit(root, product())
        return out

    def vertices(self, node):
        """Where the skin puts the vertices of a node's mesh, at rest."""
        node, worlds = self.json["nodes"][self.number[node]], self.worlds()
        skin = self.json["skins"][node["skin"]]
        inverse_bind = [[list(m[i::4]) for i in range(4)] for m in self.floats(skin["inverseBindMatrices"])]
        bones = [product(worlds[self.json["nodes"][joint]["name"]], m) for joint, m in zip(skin["joints"], inverse_bind)]
        out = []
        for primitive in self.json["meshes"][node["mesh"]]["primitives"]:
            a = primitive["attributes"]
            sets = [k for k in range(4) if "JOINTS_%d" % k in a]
            joints = [sum((list(one[v]) for one in [self.floats(a["JOINTS_%d" % k]) for k in sets]), []) for v in range(len(self.floats(a["POSITION"])))]
            weights = [sum((list(one[v]) for one in [self.floats(a["WEIGHTS_%d" % k]) for k in sets]), []) for v in range(len(joints))]
            for p, js, ws in zip(self.floats(a["POSITION"]), joints, weights):
                at = [product(bones[j], moved(p)) for j in js]
                out.append([sum(w * m[i][3] for w, m in zip(ws, at)) for i in range(3)])
        return out


@unittest.skipIf(refuses_fbx(), refuses_fbx())
class Fbx(CliTest):
    def near(self, a, b, most=1e-4):
        self.assertLess(math.dist(a, b), most, "%s, not %s" % (a, b))

    def person(self, name, clip=None, picture=None):
        """22 bones of a person in an A-pose (z up, centimetres) with axes of their own, as Maya and 3ds Max write them."""
        scene, rng = Scene(up=2, front=(1, -1)), random.Random(5)
        armature = Bone("Armature", None, "Null", rotation=(0, 0, 20))
        scene.bone(armature)
        self.bones = []
        for j, title in enumerate(NAMES):
            angles = {kind: [rng.uniform(-60, 60) for _ in range(3)] for kind in ("pre", "rotation", "post")}
            if j % 3 != 0:
                del angles["post"]
            bone = Bone(title, self.bones[PARENTS[j]] if j else armature, **angles, **({"pivot": (1, 2, 3), "offset": (0, 1, 0)} if j % 4 == 3 else {}))
            bone.values["translation"] = (0, 0, 0)
            wanted = place(product(inverse(bone.parent.world()), turned((0, 0, 20)), moved([100 * x for x in HEADS[j]])))
            bone.values["translation"] = [a - b for a, b in zip(wanted, place(bone.local()))]
            self.bones.append(bone)
            scene.bone(bone)
        body = Bone("Body", None, "Mesh", geometric_translation=(0, 0, 50), rotation=(0, 0, 20))
        vertices, polygons, weights = [], [], [(bone, {}) for bone in self.bones]
        for j, (x, y, z) in enumerate(HEADS):
            first = len(vertices)
            vertices += [(100 * x + a, 100 * y + b, 100 * z - 50 + c) for a, b, c in ((3, 0, 0), (0, 3, 0), (0, 0, 3), (3, 3, 3))]
            polygons += [(first, first + 1, first + 3), (first, first + 1, first + 3, first + 2), (first, first + 2, max(first - 3, 0))]
            for v in range(first, first + 4):
                weights[j][1][v] = .75
                if PARENTS[j] >= 0:
                    weights[PARENTS[j]][1][v] = .25
        for bone, share in zip(self.bones[:6], (.3, .2, .2, .1, .1, .1)):  # six bones move one vertex
            bone_weights = next(w for owner, w in weights if owner is bone)
            bone_weights[0] = share
        scene.mesh(body, vertices, polygons, weights, [("smile", {1: (0, 0, 1)}), ("frown", {2: (1, 0, 0)})])
        self.body, self.points = body, vertices
        if clip:
            scene.clip(*clip)
        if picture:
            scene.picture("Body", *picture)
        return self.write(name, scene.text().encode())

    def test_the_document_is_the_scene(self):
        self.person("hero.fbx")
        self.done("retarget", "--source", self.person("walk.fbx", self.walk()), "--target", "hero.fbx", "--out", "hero.glb", "--clip-name", "Walk")
        glb = Glb(self.bytes("hero.glb"))
        worlds = glb.worlds()
        for bone in self.bones:
            self.near(place(worlds[bone.name]), place(product(METRES, bone.world())))
        mesh = glb.json["meshes"][0]
        self.assertEqual((len(glb.json["meshes"]), mesh["extras"]["targetNames"]), (1, ["smile", "frown"]))
        self.assertIn("JOINTS_1", mesh["primitives"][0]["attributes"])
        wanted = [place(product(METRES, self.body.world(), self.body.geometry(), moved(p))) for p in self.points]
        found = glb.vertices("Body")
        for p in wanted:
            self.assertLess(min(math.dist(p, q) for q in found), 1e-4)
        for q in found:
            self.assertLess(min(math.dist(p, q) for p in wanted), 1e-4)
        self.assertEqual([a["name"] for a in glb.json["animations"]], ["Walk"])
        self.done("retarget", "--source", "walk.fbx", "--target", "hero.fbx", "--out", "again.glb", "--clip-name", "Walk")
        self.assertEqual(self.bytes("again.glb"), self.bytes("hero.glb"))

    def walk(self, pivots=False):
        """Bones turn, but for the first, and for those that this would move (their pivots lie elsewhere); 31 keys in one second."""
        rng, keys = random.Random(9), {}
        self.person("any.fbx")
        for bone in self.bones[1:]:
            if "pivot" in bone.values and not pivots:
                continue
            speed = [rng.uniform(-25, 25) for _ in range(3)]
            keys[bone.name] = [[a + s * math.sin(k / 10) for a, s in zip(bone.values["rotation"], speed)] for k in range(31)]
        return ("Take 001", keys, 1)

    def test_a_motion_goes_over_exactly(self):
        for pivots in (False, True):
            clip = self.walk(pivots)
            self.person("walk.fbx", clip)
            self.done("retarget", "--source", "walk.fbx", "--target", "walk.fbx", "--out", "out.glb", "--clip-name", "Again")
            glb = Glb(self.bytes("out.glb"))
            self.assertEqual([a["name"] for a in glb.json["animations"]], ["Take 001", "Again"])
            for key in (0, 7, 30):
                angles = {name: all_of_it[key] for name, all_of_it in clip[1].items()}
                first, again = glb.worlds(glb.json["animations"][0], key), glb.worlds(glb.json["animations"][1], key)
                for bone in self.bones:
                    true = place(product(METRES, bone.world(angles)))
                    self.near(place(first[bone.name]), true)  # the file's own clip
                    if not pivots:
                        self.near(place(again[bone.name]), true, 2e-3)

    def test_names_in_another_encoding(self):
        for name in ("hero.fbx", "walk.fbx"):
            self.person(name, self.walk())
            with open(self.path(name), "rb") as f:
                text = f.read()
            self.write(name, text.replace(b"left_foot", "\u5de6\u8db3\u5148".encode("cp932")))
        self.done("retarget", "--source", "walk.fbx", "--target", "hero.fbx", "--out", "out.glb")
        self.assertIn("______", [node.get("name") for node in Glb(self.bytes("out.glb")).json["nodes"]])

    def test_all_commands_read_it(self):
        self.person("hero.fbx", self.walk())
        self.assertEqual(self.json("data", "import", "hero.fbx", "--out", "hero.h5")["bodies"], 1)
        self.done("doctor", "hero.fbx", "--as-target")
        self.done("data", "inspect", "hero.fbx")
        self.done("retarget", "--source", "hero.fbx", "--target", "hero.fbx", "--out", "hero.bvh")

    def test_what_cannot_be_read(self):
        self.person("walk.fbx", self.walk())
        text = self.bytes(self.person("hero.fbx"))
        call = ["retarget", "--source", "walk.fbx", "--out", "x.glb", "--target"]
        for name, content in (("text.fbx", b"hello"), ("nothing.fbx", b""), ("short.fbx", text[:2000]), ("deep.fbx", b"; FBX\n" + b"A: {\n" * 1000000),
                              ("binary.fbx", b"Kaydara FBX Binary  \0\x1a\0" + b"\xff" * 99), ("axes.fbx", text.replace(b'"Integer", "",2', b'"Integer", "",7')),
                              ("number.fbx", text.replace(b"Transform: *16 {\n\t\t\ta: ", b"Transform: *16 {\n\t\t\ta: 1e99"))):
            self.write(name, content)
            self.bad_input(call + [name], name)
        rng = random.Random(3)
        for i in range(12):
            content = bytearray(text)
            for _ in range(20):
                content[rng.randrange(len(content))] = rng.randrange(256)
            self.write("bad.fbx", bytes(content))
            result = self.restage(*call, "bad.fbx")
            if result.code != 0:
                self.one_line(result, 2, "bad.fbx")
        os.rename(self.path("hero.fbx"), self.path("hero.glb"))
        self.bad_input(["doctor", "hero.glb"], "hero.glb", "FBX", ".fbx")

    def test_pictures(self):
        png = b"\x89PNG\r\n\x1a\n" + bytes(range(57))
        self.person("walk.fbx", self.walk())
        text = base64.b64encode(png).decode().rstrip("=")
        # In the file, also where the padding is wrong, as programs write it; beside the file, where a path of another computer is named.
        os.makedirs(self.path("textures"))
        self.write("textures/beside.png", png)
        for name, picture in (("in", ("in.png", text + "=" * (-len(text) % 4))), ("odd", ("odd.png", text + "=====")), ("beside", ("beside.png",))):
            self.person(name + ".fbx", picture=picture)
            self.done("retarget", "--source", "walk.fbx", "--target", name + ".fbx", "--out", name + ".glb")
            glb = Glb(self.bytes(name + ".glb"))
            view = glb.json["bufferViews"][glb.json["images"][0]["bufferView"]]
            self.assertEqual(glb.binary[view["byteOffset"]:view["byteOffset"] + view["byteLength"]], png, name)
            self.assertEqual(glb.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"], {"index": 0})
        for picture, word in ((("nowhere.png",), "nowhere.png"), (("bad.png", "!" + text), "base64"), (("bad.tga", base64.b64encode(bytes(99)).decode()), "PNG")):
            self.person("hero.fbx", picture=picture)
            remarks = self.json("data", "import", "hero.fbx", "--out", "x.h5")["reports"][0]["remarks"]
            self.assertTrue(any("left out" in r and word in r for r in remarks), remarks)

    def test_a_part_that_is_left_out_is_named(self):
        self.person("hero.fbx")
        text = self.bytes("hero.fbx").replace(b"Normals: ", b"Xormals: ")
        found = self.json("data", "import", self.write("less.fbx", text), "--out", "x.h5")
        self.assertTrue(any("left out" in r and "Normals" in r for r in found["reports"][0]["remarks"]), found)

    def test_fbx_is_written_by_blender(self):
        self.person("hero.fbx", self.walk())
        call = ["retarget", "--source", "hero.fbx", "--target", "hero.fbx", "--out"]
        self.bad_input(call + ["out.fbx"], "out.fbx", "blender -b --python docs/glb_to_fbx.py -- out.glb out.fbx")
        if not shutil.which("blender"):
            self.skipTest("no Blender")
        self.done(*call, "out.glb", "--clip-name", "Dance")
        self.smile("out.glb")
        # Blender takes the first Python of the path for its own.
        folder = os.path.dirname(shutil.which("blender"))
        how = {"capture_output": True, "text": True, "timeout": 300, "env": dict(os.environ, PATH=folder + ":/usr/bin:/bin")}
        command = ["blender", "-b", "--python", SCRIPT, "--", self.path("out.glb"), self.path("out.fbx")]
        done = subprocess.run(command, **how)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.bad_input(["retarget", "--source", "out.fbx", "--clip", "?", "--target", "hero.fbx", "--out", "x.glb"], "name one of 'Dance'\n")  # no other take
        self.done("retarget", "--source", "out.fbx", "--clip", "Dance", "--target", "out.fbx", "--out", "back.glb", "--clip-name", "Back")
        glb, back = Glb(self.bytes("out.glb")), Glb(self.bytes("back.glb"))
        for key in (0, 15, 30):
            a, b = glb.worlds(glb.json["animations"][-1], key), back.worlds(back.json["animations"][-1], key)
            for bone in self.bones:
                self.near(place(a[bone.name]), place(b[bone.name]), 2e-3)
        self.assertNotEqual(subprocess.run(command[:-2] + ["/nothing.glb", self.path("no.fbx")], **how).returncode, 0)

    def smile(self, name):
        """The first animation moves the mesh's shapes too, as one that was there before may."""
        glb = Glb(self.bytes(name))
        document, first = glb.json, glb.json["animations"][0]
        weights = struct.pack("<4f", 0, 1, 1, 0)
        document["bufferViews"].append({"buffer": 0, "byteOffset": len(glb.binary), "byteLength": len(weights)})
        document["buffers"][0]["byteLength"] = len(glb.binary) + len(weights)
        document["bufferViews"].append({"buffer": 0, "byteOffset": len(glb.binary) + len(weights), "byteLength": 8})
        document["buffers"][0]["byteLength"] += 8
        document["accessors"] += [{"bufferView": len(document["bufferViews"]) - 2, "componentType": 5126, "count": 4, "type": "SCALAR"},
                                  {"bufferView": len(document["bufferViews"]) - 1, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]}]
        first["samplers"].append({"input": len(document["accessors"]) - 1, "output": len(document["accessors"]) - 2})
        first["channels"].append({"sampler": len(first["samplers"]) - 1, "target": {"node": glb.number["Body"], "path": "weights"}})
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        binary = glb.binary + weights + struct.pack("<2f", 0, 1)
        self.write(name, struct.pack("<4s4I", b"glTF", 2, 28 + len(text) + len(binary), len(text), 0x4E4F534A) + text +
                   struct.pack("<2I", len(binary), 0x4E4942) + binary)


@unittest.skipIf(refuses_fbx() or lacking(), refuses_fbx() or lacking())
class RealFbx(CliTest):
    def test_the_same_person_as_glb(self):
        for kind in ("glb", "fbx"):
            self.done("retarget", "--source", os.path.join(CHARACTERS, "source_dance.glb"), "--target",
                      os.path.join(CHARACTERS, "mixa_t." + kind), "--out", kind + ".glb")
        for call in (["--truth", os.path.join(CHARACTERS, "truth_t.npz"), "--frames", "60", "--pa", ".02", "--mpjpe", ".03"],
                     ["--same", self.path("glb.glb")]):
            done = subprocess.run([python_with_numpy(), os.path.join(CHARACTERS, "check_rig.py"), os.path.join(CHARACTERS, "mixa_t.glb"),
                                   self.path("fbx.glb"), *call], capture_output=True, text=True)
            # Its vertices are in another order and its nodes are the FBX's, which the checker counts as lost.
            joints = [line for line in done.stdout.splitlines() if any(words in line for words in (
                "joints after", "joints as", "same motion", "main bones", "finger bones", "bones keep", "heading"))]
            self.assertGreaterEqual(len(joints), 3, done.stdout)
            self.assertTrue(all(line.startswith("PASS") for line in joints), done.stdout + done.stderr)
