"""Targets that do not stand in T-pose: how far the T-pose, the joints and the skin that retarget finds are from the truth.

  python3 measure.py PROGRAM real.h5 --out any_pose.json
  python3 measure.py PROGRAM real.h5 --clothes DATA_FOLDER --out clothed.json

real.h5: `restage data import DATA_FOLDER --out real.h5`. Test bodies are posed with their true joints and weights (linear blend
skinning): in A-pose, and in 50 frames of test motions. Each is a target without a rig; what is read is the .glb that comes out. With --clothes the people wear the data folder's garments in
turn: a mesh of the garment and of the skin that it leaves bare.
"""
import argparse, glob, gzip, json, os, struct, subprocess, sys, tempfile
import h5py
import numpy as np

PARENTS = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19]


def turn(axis, degrees):
    a = np.radians(degrees)
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]], float)
    return np.eye(3) + np.sin(a) * k + (1 - np.cos(a)) * k @ k


def a_pose(degrees):
    world = np.tile(np.eye(3), (22, 1, 1))
    for left, right in ((16, 17), (18, 19), (20, 21)):
        world[left], world[right] = turn((0, 0, 1), -degrees), turn((0, 0, 1), degrees)
    return world


def rotations(quaternions):
    w, x, y, z = np.moveaxis(quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True), -1, 0)
    return np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
                     2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], -1).reshape(-1, 3, 3)


def posed(vertices, joints, weights, world):
    place = np.zeros((22, 3))
    for j in range(1, 22):
        place[j] = place[PARENTS[j]] + world[PARENTS[j]] @ (joints[j] - joints[PARENTS[j]])
    out = np.zeros_like(vertices)
    for j in range(22):
        out += weights[:, j:j + 1] * ((vertices - joints[j]) @ world[j].T + place[j])
    out[:, 1] -= out[:, 1].min()
    return out


def write_obj(path, vertices, faces):
    with open(path, "w") as f:
        f.writelines("v %.5f %.5f %.5f\n" % tuple(v) for v in vertices)
        f.writelines("f %d %d %d\n" % tuple(t + 1) for t in faces)


def read_glb(path):
    data = open(path, "rb").read()
    length, = struct.unpack_from("<I", data, 12)
    doc, start = json.loads(data[20:20 + length]), 28 + length

    def array(index):
        a = doc["accessors"][index]
        view = doc["bufferViews"][a["bufferView"]]
        kind = {5121: np.uint8, 5126: np.float32, 5125: np.uint32}[a["componentType"]]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[a["type"]]
        return np.frombuffer(data, kind, a["count"] * width, start + view.get("byteOffset", 0) + a.get("byteOffset", 0)).reshape(a["count"], width)
    attributes = doc["meshes"][0]["primitives"][0]["attributes"]
    vertices, ids, shares = (array(attributes[k]) for k in ("POSITION", "JOINTS_0", "WEIGHTS_0"))
    weights = np.zeros((len(vertices), 22))
    for k in range(4):
        np.add.at(weights, (np.arange(len(vertices)), ids[:, k]), shares[:, k])
    binds = array(doc["skins"][0]["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
    return vertices.astype(float), -binds[:22, :3, 3], weights


def aligned(a, b):
    """a onto b, similarity."""
    ca, cb = a.mean(0), b.mean(0)
    u, s, vt = np.linalg.svd((a - ca).T @ (b - cb))
    d = np.sign(np.linalg.det(u @ vt))
    u[:, 2] *= d
    s[2] *= d
    return (a - ca) @ (u @ vt) * s.sum() / ((a - ca) ** 2).sum() + cb


def covered(path):
    """The vertices of the skin that a garment hides, by its .mhclo file: numbers, and ranges with a minus between."""
    text = gzip.open(path, "rt").read()
    words, out = text[text.index("delete_verts") + len("delete_verts"):].split() if "delete_verts" in text else [], []
    for k, word in enumerate(words):
        if word == "-":
            out += range(out[-1], int(words[k + 1]))
        elif word.isdigit():
            out.append(int(word))
        else:
            break
    return np.array(out, int)


class Wardrobe:
    """Test people, naked or in the garments of a data folder in turn."""

    def __init__(self, program, file, folder, clothes):
        self.file, self.garments = file, []
        for path in sorted(glob.glob(os.path.join(clothes, "body", "clothes", "*.mhclo.gz"))) if clothes else []:
            name = os.path.basename(path)[:-len(".mhclo.gz")]
            out = os.path.join(folder, name + ".h5")
            subprocess.run([program, "data", "import", clothes, "--garment", name, "--out", out, "--quiet"], check=True, stdout=subprocess.DEVNULL)
            self.garments.append((name, h5py.File(out), covered(path)))

    @staticmethod
    def surface(file, name):
        body = file["bodies"][name]
        topology = body.attrs["topology"]
        return [np.asarray(body[k], float) for k in ("vertices", "joints", "weights")] + [file["topologies"][topology.decode() if isinstance(topology, bytes) else topology][()]]

    def person(self, name, number):
        """Vertices, joints, weights, faces; what is worn."""
        vertices, joints, weights, faces = self.surface(self.file, name)
        if not self.garments:
            return vertices, joints, weights, faces, ""
        garment, file, hidden = self.garments[number % len(self.garments)]
        bare = np.ones(len(vertices), bool)
        bare[hidden[hidden < len(vertices)]] = False
        faces = faces[bare[faces].all(1)]
        used, faces = np.unique(faces, return_inverse=True)
        over, _, shares, sewn = self.surface(file, name + "_" + garment)
        return (np.concatenate([vertices[used], over]), joints, np.concatenate([weights[used], shares]),
                np.concatenate([faces.reshape(-1, 3), sewn + len(used)]), garment)


def measure(program, folder, vertices, faces, joints, weights, world, motion):
    target, out = os.path.join(folder, "target.obj"), os.path.join(folder, "out.glb")
    write_obj(target, posed(vertices, joints, weights, world), faces)
    done = subprocess.run([program, "retarget", "--source", motion, "--target", target, "--out", out, "--quiet"], capture_output=True, text=True)
    if done.returncode != 0:
        return {"refused": done.stderr.strip().replace(folder + "/", "")}
    v, j, w = read_glb(out)
    shift = v.mean(0) - vertices.mean(0)
    return {"joints_mm": 1e3 * float(np.linalg.norm(aligned(j, joints) - joints, axis=1).mean()),
            "vertices_mm": 1e3 * float(np.linalg.norm(aligned(v, vertices) - vertices, axis=1).mean()),
            "vertices_unaligned_mm": 1e3 * float(np.linalg.norm(v - shift - vertices, axis=1).mean()),
            "skin_l1": float(np.abs(w - weights).sum(1).mean())}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("data")
    parser.add_argument("--clothes", default="")
    parser.add_argument("--out", required=True)
    parser.add_argument("--bodies", type=int, default=20)
    parser.add_argument("--poses", type=int, default=50)
    args = parser.parse_args()
    file = h5py.File(args.data)
    of_test = lambda kind: [name for name, item in file[kind].items() if item.attrs["split"] in (b"test", "test")]
    bodies, motions = of_test("bodies")[:args.bodies], of_test("motions")
    rng = np.random.default_rng(1)
    poses = {}
    for k in range(args.poses):
        turns = file["motions"][motions[k % len(motions)]]["rotations"]
        frame = int(rng.integers(len(turns)))
        poses["%s frame %d" % (motions[k % len(motions)], frame)] = rotations(turns[frame])
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        motion = os.path.join(folder, "motion.h5")  # of which two frames are enough
        with h5py.File(motion, "w") as out:
            for key, value in file.attrs.items():
                out.attrs[key] = value
            file.copy(file["motions"][motions[0]], out.require_group("motions"), name=motions[0])
            item = out["motions"][motions[0]]
            for name in ("rotations", "hips"):
                short = item[name][:2]
                del item[name]
                item[name] = short
        wardrobe = Wardrobe(args.program, file, folder, args.clothes)
        for b, name in enumerate(bodies):
            *truth, faces, worn = wardrobe.person(name, b)
            jobs = {"T-pose": a_pose(0), "A-pose, arms 35 degrees down": a_pose(35), "A-pose, arms 55 degrees down": a_pose(55)}
            own = list(poses)[b * args.poses // len(bodies):(b + 1) * args.poses // len(bodies)]
            jobs.update({pose: poses[pose] for pose in own})
            for pose, world in jobs.items():
                row = measure(args.program, folder, truth[0], faces, truth[1], truth[2], world, motion)
                rows.append({"body": name, **({"garment": worn} if worn else {}), "pose": pose, **row})
                print(rows[-1], file=sys.stderr)
    kinds = {"T-pose": lambda p: p == "T-pose", "A-pose": lambda p: p.startswith("A-pose"), "any pose": lambda p: "frame" in p}
    table = {}
    for kind, belongs in kinds.items():
        some = [r for r in rows if belongs(r["pose"])]
        taken = [r for r in some if "refused" not in r]
        table[kind] = {"targets": len(some), "refused": len(some) - len(taken)}
        for figure in ("joints_mm", "vertices_mm", "vertices_unaligned_mm", "skin_l1"):
            values = [r[figure] for r in taken]
            if values:
                table[kind][figure] = {"median": round(float(np.median(values)), 3), "p90": round(float(np.percentile(values, 90)), 3), "most": round(max(values), 3)}
    json.dump({"table": table, "rows": rows}, open(args.out, "w"), indent=1)
    print(json.dumps(table, indent=1))


if __name__ == "__main__":
    main()
