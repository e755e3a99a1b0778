"""The surface of a GLB file in a frame of its newest animation, by the format's rules: morph targets, then the skin."""
import json
import struct

KINDS = {5120: ("b", 127), 5121: ("B", 255), 5122: ("h", 32767), 5123: ("H", 65535), 5125: ("I", 1), 5126: ("f", 1)}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Glb:
    def __init__(self, data):
        magic, version, length = struct.unpack("<4sII", data[:12])
        assert (magic, version, length) == (b"glTF", 2, len(data))
        size = struct.unpack("<I", data[12:16])[0]
        self.root, self.binary = json.loads(data[20:20 + size]), data[28 + size:]

    def rows(self, number):
        """Of an accessor, as tuples of floats."""
        accessor = self.root["accessors"][number]
        kind, largest = KINDS[accessor["componentType"]]
        width = WIDTHS[accessor["type"]]
        if "bufferView" not in accessor:
            return [(0.0,) * width] * accessor["count"]
        view = self.root["bufferViews"][accessor["bufferView"]]
        step = view.get("byteStride", struct.calcsize(kind) * width)
        at = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        factor = 1 / largest if accessor.get("normalized") else 1
        return [tuple(x * factor for x in struct.unpack_from("<%d%s" % (width, kind), self.binary, at + i * step))
                for i in range(accessor["count"])]

    def animated(self, frame, clip=-1):
        """{node: {path: value}} of a frame."""
        out = {}
        animation = self.root["animations"][clip]
        for channel in animation["channels"]:
            sampler = animation["samplers"][channel["sampler"]]
            values = self.rows(sampler["output"])
            target = channel["target"]
            if target["path"] == "weights":
                count = len(values) // len(self.rows(sampler["input"]))
                value = [w for (w,) in values[frame * count:(frame + 1) * count]]
            else:
                value = values[frame]
            out.setdefault(target["node"], {})[target["path"]] = value
        return out

    def world(self, moved):
        """4 x 4 matrices of all nodes."""
        parents = {c: n for n, node in enumerate(self.root["nodes"]) for c in node.get("children", [])}
        out = {}

        def of(n):
            if n not in out:
                node = dict(self.root["nodes"][n], **moved.get(n, {}))
                local = columns(node["matrix"]) if "matrix" in node else placed(node)
                out[n] = times(of(parents[n]), local) if n in parents else local
            return out[n]
        return [of(n) for n in range(len(self.root["nodes"]))]

    def surface(self, frame, pick):
        """[(vertex of the primitive, place)] of all skinned meshes, vertices that `pick` names alone."""
        moved = self.animated(frame)
        world = self.world(moved)
        out = []
        for n, node in enumerate(self.root["nodes"]):
            if "skin" not in node:
                continue
            skin, mesh = self.root["skins"][node["skin"]], self.root["meshes"][node["mesh"]]
            inverse = [columns(m) for m in self.rows(skin["inverseBindMatrices"])]
            bones = [times(world[j], m) for j, m in zip(skin["joints"], inverse)]
            weights = moved.get(n, {}).get("weights", node.get("weights", mesh.get("weights", [])))
            for primitive in mesh["primitives"]:
                attributes = primitive["attributes"]
                places = self.rows(attributes["POSITION"])
                targets = [self.rows(t["POSITION"]) for t in primitive.get("targets", [])]
                assert not targets or len(targets) == len(weights)
                joints, shares = self.rows(attributes["JOINTS_0"]), self.rows(attributes["WEIGHTS_0"])
                for v in pick:
                    p = [x + sum(w * t[v][k] for w, t in zip(weights, targets)) for k, x in enumerate(places[v])] + [1]
                    at = [0.0] * 3
                    for joint, share in zip(joints[v], shares[v]):
                        if share:
                            m = bones[int(joint)]
                            for k in range(3):
                                at[k] += share * sum(m[k][c] * p[c] for c in range(4))
                    out.append((v, at))
        return out


def columns(numbers):
    return [[numbers[4 * c + r] for c in range(4)] for r in range(4)]


def times(a, b):
    return [[sum(a[r][k] * b[k][c] for k in range(4)) for c in range(4)] for r in range(4)]


def placed(node):
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    norm = (x * x + y * y + z * z + w * w) ** 0.5
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    turn = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    scale, move = node.get("scale", (1, 1, 1)), node.get("translation", (0, 0, 0))
    return [[turn[r][c] * scale[c] for c in range(3)] + [move[r]] for r in range(3)] + [[0, 0, 0, 1]]
