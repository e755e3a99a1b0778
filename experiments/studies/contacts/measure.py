"""Hands that touch: how far apart wrists are, how much of the hands is inside the body, how near they are to what the source touches.

  python3 measure.py READER SOURCE.glb RESULT.glb... --every 10 --out FILE.json

READER: a folder with check_rig.py, whose class Gltf poses a file's skin. Results are of the same clip, the last of each file. Wrist
distances are in lengths of the arm, where the source's is below 0.5. Inside: share of the hands' vertices for which the winding
number of everything but that forearm and hand is over a half. Near: the least distance from a hand's vertex to a vertex of the body
without arms, in lengths of the arm, where the source's is below 0.04. Calm: mean acceleration of the wrists.
"""
import argparse, json, os, re, sys
import numpy as np

WORDS = {"shoulder": r"upper_?arm|(left|right)arm$", "elbow": r"lower_?arm|forearm", "wrist": r"hand$|hand[._]|hand[lr]$|palm|wrist"}
OTHERS = r"thumb|index|middle|ring|pinky|finger|end$|twist|mesh|ik"


def bones(nodes, side):
    names = [re.sub(r"^.*:", "", node.get("name", "")).lower() for node in nodes]
    long, short = {"L": ("left", "l"), "R": ("right", "r")}[side]
    mine = lambda n: n.startswith(long) or re.search(r"[._]%s($|[._\d])" % short, n) or n.endswith(short) and not re.search(r"^(left|right)", n)
    out = {}
    for joint, words in WORDS.items():
        out[joint] = next(i for i, n in enumerate(names) if re.search(words, n) and not re.search(OTHERS, n) and mine(n) and
                          not (joint == "shoulder" and "fore" in n))
    return out


def winding(points, triangles):
    out = np.zeros(len(points))
    for at in range(0, len(points), 16):
        v = triangles[None] - points[at:at + 16, None, None]
        l = np.linalg.norm(v, axis=-1)
        a, b, c = v[..., 0, :], v[..., 1, :], v[..., 2, :]
        below = l.prod(-1) + (a * b).sum(-1) * l[..., 2] + (b * c).sum(-1) * l[..., 0] + (c * a).sum(-1) * l[..., 1]
        out[at:at + 16] = np.arctan2((a * np.cross(b, c)).sum(-1), below).sum(1) / (2 * np.pi)
    return out


class Film:
    def __init__(self, reader, path):
        self.file = reader.Gltf(path)
        nodes, clip = self.file.js["nodes"], self.file.js["animations"][-1]
        self.tracks, self.times = reader.tracks(self.file, clip)
        self.parts = self.file.skinned()
        self.bones = {s: bones(nodes, s) for s in "LR"}
        below = lambda n: {n}.union(*(below(c) for c in nodes[n].get("children", [])))
        self.hand, self.fore, self.arm = ({s: below(self.bones[s][j]) for s in "LR"} for j in ("wrist", "elbow", "shoulder"))
        strongest, faces, at = [], [], 0
        for vertices, joints, weights, _, nodes_of, triangles in self.parts:
            strongest.append(np.array([nodes_of[j] for j in joints[np.arange(len(vertices)), weights.argmax(1)]]))
            faces.append(np.array(triangles).reshape(-1, 3) + at)
            at += len(vertices)
        self.strongest, self.faces = np.concatenate(strongest), np.concatenate(faces)

    def world(self, frame):
        moved = {}
        for node, paths in self.tracks.items():
            t, r, s = self.file.trs(node)
            key = {path: values[min(frame, len(values) - 1)] for path, (_, values) in paths.items()}
            moved[node] = (key.get("translation", t), key.get("rotation", r), key.get("scale", s))
        return self.file.world(moved)

    def figures(self, frame):
        from scipy.spatial import cKDTree
        world = self.world(frame)
        at = {s: {j: world[n][:3, 3] for j, n in self.bones[s].items()} for s in "LR"}
        arm = np.mean([np.linalg.norm(at[s]["shoulder"] - at[s]["elbow"]) + np.linalg.norm(at[s]["elbow"] - at[s]["wrist"]) for s in "LR"])
        surface = self.file.pose(world, self.parts)
        inside, hands, near = 0, 0, []
        trunk = ~np.isin(self.strongest, list(self.arm["L"] | self.arm["R"]))
        for s in "LR":
            hand = surface[np.isin(self.strongest, list(self.hand[s]))]
            some = hand[::max(1, len(hand) // 100)]
            others = ~np.isin(self.strongest, list(self.fore[s]))[self.faces].any(1)
            inside += (np.abs(winding(some, surface[self.faces[others]])) > 0.5).sum()
            hands += len(some)
            near.append(cKDTree(surface[trunk]).query(hand)[0].min() / arm)
        return np.linalg.norm(at["L"]["wrist"] - at["R"]["wrist"]) / arm, inside / hands, near

    def jolts(self):
        wrists = np.array([[self.world(f)[self.bones[s]["wrist"]][:3, 3] for s in "LR"] for f in range(len(self.times))])
        height = np.ptp(self.file.pose(self.file.world(), self.parts)[:, 1])
        return 1.7e3 / height * np.linalg.norm(np.diff(wrists, 2, axis=0), axis=-1)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("reader")
    parser.add_argument("files", nargs="+")
    parser.add_argument("--every", type=int, default=10)
    parser.add_argument("--out")
    args = parser.parse_args()
    sys.path.insert(0, args.reader)
    import check_rig
    rows, source = [], None
    for path in args.files:
        film = Film(check_rig, path)
        wrists, inside, near = (np.array(x) for x in zip(*(film.figures(f) for f in range(0, len(film.times), args.every))))
        source = source or (wrists, near)
        close, touch = source[0] < 0.5, source[1] < 0.04
        jolts = film.jolts()
        rows.append({"file": os.path.basename(path), "inside_percent": 100 * inside.mean(), "jolts_mm": jolts.mean(), "largest_jolt_mm": jolts.max()})
        if close.any():
            rows[-1].update(wrists_off=np.abs(wrists - source[0])[close].mean(), wrists_most_off=np.abs(wrists - source[0])[close].max())
        if touch.any() and np.isfinite(near).all():  # a file whose trunk hangs on an arm has none
            rows[-1].update(near_arms=near[touch].mean())
        rows[-1] = {k: v if isinstance(v, str) else round(float(v), 3) for k, v in rows[-1].items()}
        print(json.dumps(rows[-1]))
    if args.out:
        json.dump(rows, open(args.out, "w"), indent=1)


if __name__ == "__main__":
    main()
