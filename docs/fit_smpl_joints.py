#!/usr/bin/env python3
"""Fits the matrices of nn/geometry/joint_tables.cpp: the 22 joints of the MakeHuman definition from those of SMPL, and back.

    restage data import DATA --out people.h5         # MakeHuman bodies and motions
    python3 docs/fit_smpl_joints.py people.h5        # prints the rows of the tables, and what they are worth

No file of SMPL is read. What is known of SMPL's joints is MEAN below: the bones of its mean skeleton, as open simulators print
them. NumPy and h5py are needed.

1. SMPL's mean skeleton is resized and bent into the T-pose of the mean MakeHuman body, until knees, ankles, elbows and wrists
   coincide. The hips take the depth of MakeHuman's, which nothing else fixes.
2. Each joint becomes a mean of the surface about it, so it follows other shapes.
3. The joints are posed with the bones that carry them (CARRIED).
4. A ridge regression over 6,000 pairs of a body and a frame (joints in doubt by 5 mm) gives each joint as a weighted sum of the
   others, with weights of sum 1. Weights below 0.015 are left out, and the rest is fitted again.
"""
import sys

import h5py
import numpy as np

NAMES = ("pelvis left_hip right_hip spine1 left_knee right_knee spine2 left_ankle right_ankle spine3 left_foot right_foot neck "
         "left_collar right_collar head left_shoulder right_shoulder left_elbow right_elbow left_wrist right_wrist").split()
PARENTS = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19]
AT = {name: j for j, name in enumerate(NAMES)}
MIRROR = [AT[n.replace("left", "?").replace("right", "left").replace("?", "right")] for n in NAMES]
# Metres from the parent: left, up, forward. Middle joints lie in the plane of symmetry.
MEAN = {"left_hip": (.0695, -.0914, -.0068), "left_knee": (.0343, -.3752, -.0045), "left_ankle": (-.0136, -.3980, -.0437),
        "left_foot": (.0264, -.0558, .1193), "spine1": (0, .1090, -.0267), "spine2": (0, .1352, .0011), "spine3": (0, .0529, .0254),
        "neck": (0, .2139, -.0429), "head": (0, .0650, .0513), "left_collar": (.0788, .1217, -.0341),
        "left_shoulder": (.0910, .0305, -.0089), "left_elbow": (.2596, -.0128, -.0275), "left_wrist": (.2492, .0090, -.0012)}
# Whose turns carry a joint of SMPL when the MakeHuman skeleton is posed. Joints between two bones go half with each.
CARRIED = {"pelvis": {"pelvis": 1}, "spine1": {"pelvis": .35, "spine1": .65}, "spine2": {"spine3": 1}, "spine3": {"spine3": 1},
           "neck": {"neck": .5, "spine3": .5}, "head": {"head": .5, "neck": .5}, "left_hip": {"pelvis": 1},
           "left_knee": {"left_hip": .5, "left_knee": .5}, "left_ankle": {"left_knee": .5, "left_ankle": .5},
           "left_foot": {"left_ankle": .5, "left_foot": .5}, "left_collar": {"spine3": .5, "left_collar": .5},
           "left_shoulder": {"left_collar": 1}, "left_elbow": {"left_shoulder": .5, "left_elbow": .5},
           "left_wrist": {"left_elbow": .5, "left_wrist": .5}}
NOISE = 0.005  # metres by which the joints that are converted may be off
SMALL = 0.015  # weights below are left out


def mirrored(joints):
    return joints[MIRROR] * [-1, 1, 1]


def mean_skeleton():
    out = np.zeros((22, 3))
    for j, name in enumerate(NAMES[1:], 1):
        side = -1 if name.startswith("right") else 1
        out[j] = out[PARENTS[j]] + np.array(MEAN[name.replace("right", "left")]) * [side, 1, 1]
    return out


def about(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    i, k = [(1, 2), (2, 0), (0, 1)][axis]
    out = np.eye(3)
    out[i, i] = out[k, k] = c
    out[i, k], out[k, i] = -s, s
    return out


def bent(numbers):
    """SMPL's mean skeleton, as large as a MakeHuman body and bent into its T-pose."""
    size, up, forward, leg, hip, knee, arm, arm_forward, elbow, elbow_forward, lean = numbers
    out = mean_skeleton() @ about(0, lean).T
    for side, sign in (("left_", 1), ("right_", -1)):
        def turn(at, rotation, *names):
            rows = [AT[side + n] for n in names]
            out[rows] = (out[rows] - out[AT[side + at]]) @ rotation.T + out[AT[side + at]]
        turn("hip", about(2, sign * leg) @ about(0, hip), "knee", "ankle", "foot")
        turn("knee", about(0, knee), "ankle", "foot")
        turn("shoulder", about(2, sign * arm) @ about(1, sign * arm_forward), "elbow", "wrist")
        turn("elbow", about(2, sign * elbow) @ about(1, sign * elbow_forward), "wrist")
    return size * out + [0, up, forward]


def fitted(ours):
    """SMPL's joints of the mean MakeHuman body: knees, ankles, elbows and wrists are the same places, and so are the hips' depth,
    nearly the neck and, less surely, head and shoulders."""
    trust = {"knee": 1, "ankle": 1, "elbow": 1, "wrist": 1, "shoulder": .3}
    pairs = [(AT[s + n], w) for s in ("left_", "right_") for n, w in trust.items()] + [(AT["neck"], .5), (AT["head"], .2)]

    def misses(numbers):
        joints = bent(numbers)
        return np.concatenate([[(joints[1] - ours[1])[2]]] + [w * (joints[j] - ours[j]) for j, w in pairs] + [.02 * numbers[3:]])

    numbers = np.array([1, .93] + 9 * [0.])
    for _ in range(60):
        e = misses(numbers)
        slope = np.array([(misses(numbers + 1e-6 * step) - e) / 1e-6 for step in np.eye(11)]).T
        numbers = numbers - np.linalg.solve(slope.T @ slope + 1e-9 * np.eye(11), slope.T @ e)
    out = bent(numbers)
    for side in ("left_", "right_"):  # a foot points where ours does
        ankle, foot = AT[side + "ankle"], AT[side + "foot"]
        ahead = (ours[foot] - ours[ankle]) * [1, 0, 1]
        left, up, forward = MEAN["left_foot"]
        out[foot] = out[ankle] + numbers[0] * (np.hypot(left, forward) * ahead / np.linalg.norm(ahead) + [0, up, 0])
    return (out + mirrored(out)) / 2


def surface_weights(vertices, point, reach=.05):
    """A point as the mean of the surface around it, with the smallest weights: so that it follows other shapes."""
    distance = np.linalg.norm(vertices - point, axis=1)
    near = np.argsort(distance)[:800]
    r = np.exp(-(distance[near] - distance[near].min()) / reach)
    rows = np.vstack([np.ones(len(near)), (vertices[near] - point).T])
    return near, r * (rows.T @ np.linalg.solve((rows * r) @ rows.T, [1, 0, 0, 0]))


def matrices(q):
    w, x, y, z = np.moveaxis(q, -1, 0)
    return np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z), 1 - 2 * (x * x + z * z),
                     2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1).reshape(q.shape[:-1] + (3, 3))


class People:
    def __init__(self, path):
        file = h5py.File(path)
        count = max(len(b["vertices"]) for b in file["bodies"].values())
        self.bodies = [b for b in file["bodies"].values() if len(b["vertices"]) == count]
        self.motions = list(file["motions"].values())
        self.vertices = [b["vertices"][:].astype(float) for b in self.bodies]
        self.ours = [b["joints"][:].astype(float) for b in self.bodies]
        mean = np.mean(self.vertices, 0)
        self.mean_joints = np.mean(self.ours, 0)
        self.target = fitted(self.mean_joints)
        rings = [surface_weights(mean, p) for p in self.target]
        self.theirs = [np.array([w @ v[near] for near, w in rings]) for v in self.vertices]
        self.carried = np.zeros((22, 22))
        for name, by in CARRIED.items():
            for other, share in by.items():
                self.carried[AT[name], AT[other]] = share
                self.carried[MIRROR[AT[name]], MIRROR[AT[other]]] = share

    def poses(self, split, count, rng):
        """Joints of both definitions, of a split's bodies in poses of its motions."""
        of = lambda group: [i for i, g in enumerate(group) if g.attrs["split"].decode() == split]
        bodies, motions, pairs = of(self.bodies), of(self.motions), ([], [])
        for _ in range(count):
            turns = self.motions[rng.choice(motions)]["rotations"]
            r = matrices(turns[rng.integers(len(turns))].astype(float))
            b = rng.choice(bodies)
            rest, posed = self.ours[b], np.zeros((22, 3))
            for j in range(1, 22):
                posed[j] = posed[PARENTS[j]] + r[PARENTS[j]] @ (rest[j] - rest[PARENTS[j]])
            other = np.einsum("jk,jkx->jx", self.carried, posed[None] + np.einsum("kab,jkb->jka", r, self.theirs[b][:, None] - rest[None]))
            for into, joints in zip(pairs, (posed, other)):
                into.append(joints - posed[0])
        return [np.array(p) for p in pairs]


def row(x, y, columns):
    """Weights of these columns, of sum 1, of the joints x whose mean is nearest to y."""
    a = x[:, columns].transpose(0, 2, 1).reshape(-1, len(columns))
    n = len(columns)
    system = np.block([[a.T @ a / len(x) + 3 * NOISE ** 2 * np.eye(n), np.ones((n, 1))], [np.ones((1, n)), np.zeros((1, 1))]])
    return np.linalg.solve(system, np.append(a.T @ y.reshape(-1) / len(x), 1))[:n]


def regression(x, y):
    """[22, 22], equal on both sides of the body."""
    out = np.zeros((22, 22))
    for j, name in enumerate(NAMES):
        if name.startswith("right"):
            continue
        columns = list(range(22))
        both = (np.concatenate([x, mirrored_all(x)]), np.concatenate([y[:, j], mirrored_all(y)[:, j]]))
        while True:
            w = row(both[0], both[1], columns)
            keep = [c for c, value in zip(columns, w) if abs(value) >= SMALL]
            if len(keep) == len(columns):
                break
            columns = keep
        w = np.round(w, 3)
        own = [k for k, c in enumerate(columns) if MIRROR[j] != j or MIRROR[c] == c]  # so that middle joints stay in the middle
        w[max(own, key=lambda k: abs(w[k]))] += 1 - w.sum()
        out[j, columns] = w
        out[MIRROR[j], [MIRROR[c] for c in columns]] = w
    return out


def mirrored_all(joints):
    return joints[:, MIRROR] * [-1, 1, 1]


def main():
    people, rng = People(sys.argv[1]), np.random.default_rng(1)
    train, test = people.poses("train", 6000, rng), people.poses("test", 2000, rng)
    for title, a, b in (("makehuman to smpl", 0, 1), ("smpl to makehuman", 1, 0)):
        m = regression(train[a], train[b])
        before = 1000 * np.linalg.norm(test[a] - test[b], axis=2).mean(0)
        after = 1000 * np.linalg.norm(np.einsum("jk,nkx->njx", m, test[a]) - test[b], axis=2).mean(0)
        print("// " + title)
        for j, name in enumerate(NAMES):
            if not name.startswith("right"):
                print("    {%s},  // %s" % (", ".join("%g" % round(w, 3) for w in m[j]), name))
        print("\n| joint | T-pose, mm (left, up, forward) | before, mm | converted, mm | noise |\n|---|---|---:|---:|---:|")
        for j, name in enumerate(NAMES):
            if not name.startswith("right"):
                d = 1000 * (people.target - people.mean_joints)[j]
                print("| %s | %.0f, %.0f, %.0f | %.0f | %.1f | %.2f |" % (name, *d, before[j], after[j], np.linalg.norm(m[j])))
        print("mean %.1f %.1f\n" % (before.mean(), after.mean()))


if __name__ == "__main__":
    main()
