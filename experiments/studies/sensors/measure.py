#!/usr/bin/env python3
"""What a sensor does to a cloud, and what that costs: the same performances, seen dense and whole, then with one effect at a time.

    restage data build configs/data/open_benchmark.yaml out=benchmark data=DATA_FOLDER
    PYTHONPATH=build/release/python python3 experiments/studies/sensors/measure.py benchmark/test.h5 --out experiments/studies/sensors/shipped.json

Nobody in benchmark/test.h5 was trained on. Each body performs for itself, so the truth is the source's own. Figures are means over
the sequences: PA-MPJPE (mm) and rotation error (degrees) of what `restage.System(late=True)` answers, and the share of true joints
inside the 90 % regions of `restage.Extractor`, which 85 to 95 % should be.
"""
import argparse
import json
import pathlib
import subprocess
import tempfile

import h5py
import numpy as np

import restage

BODIES, CLIPS, FRAMES, POINTS = ("b143", "b146", "b152"), ("05_08", "02_05", "06_05"), 90, 20_000


class Performance:
    """Surfaces, joints and rotations of one body's motion."""

    def __init__(self, data, body, clip, program, folder):
        subprocess.run([program, "data", "perform", "--bodies", data, "--body", body, "--motion", clip, "--frames", str(FRAMES),
                        "--out", folder, "--quiet"], check=True, stdout=subprocess.DEVNULL)
        with h5py.File(folder + "/truth.h5") as f:
            self.vertices, self.faces = f["vertices"][:].astype(float), f["faces"][:]
            self.joints, self.rotations = f["joints"][:].astype(float), f["rotations"][:].astype(float)
        with h5py.File(folder + "/rest.h5") as f:
            self.rest = f["vertices"][0].astype(float)
        self.target = folder + "/target.ply"


def sample(rng, vertices, faces, count):
    """Points uniform by area, their normals, and which triangle each lies on."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    which = np.searchsorted(np.cumsum(area), rng.random(count) * area.sum()).clip(0, len(faces) - 1)
    r, s = np.sqrt(rng.random(count)), rng.random(count)
    points = (1 - r)[:, None] * a[which] + (r * (1 - s))[:, None] * b[which] + (r * s)[:, None] * c[which]
    return points, normal[which] / np.maximum(area[which], 1e-12)[:, None], which


def voxels(points, size):
    """The mean of the points of each cell."""
    _, cell = np.unique(np.floor(points / size).astype(np.int64), axis=0, return_inverse=True)
    count = np.bincount(cell)
    return np.stack([np.bincount(cell, points[:, k]) / count for k in range(3)], 1)


def smoothed(vertices, faces, rounds):
    """A surface as a volume of coarse cells gives it back: each vertex goes to the mean of its neighbours, again and again."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    edges = np.concatenate([edges, edges[:, ::-1]])
    count = np.maximum(np.bincount(edges[:, 0], minlength=len(vertices)), 1)
    for _ in range(rounds):
        mean = np.stack([np.bincount(edges[:, 0], vertices[edges[:, 1], k], len(vertices)) for k in range(3)], 1) / count[:, None]
        vertices = 0.5 * (vertices + mean)
    return vertices


def box(rng, middle, size, count):
    """Points on a box."""
    points = rng.random((count, 3)) - 0.5
    axis = rng.integers(0, 3, count)
    points[np.arange(count), axis] = np.sign(points[np.arange(count), axis]) / 2
    return middle + points * size


def skirt(rng, points, joints, length, flare):
    """Points under a skirt make way for points of it. `length` in shins and thighs: 1 ends at the knees; `flare`: what each adds to its radius, metres."""
    legs = joints[[[1, 4, 7], [2, 5, 8]]]  # left and right: hip, knee, ankle

    def at(s):
        """The middles of both legs."""
        k = np.minimum(s.astype(int), 1)
        return [leg[k] + (s - k)[:, None] * (leg[k + 1] - leg[k]) for leg in legs]

    knots = np.linspace(0, length, 21)
    left, right = at(knots)
    middle = (left + right) / 2
    down = middle[-1] - middle[0]
    down /= np.linalg.norm(down)
    along = np.maximum.accumulate((middle - middle[0]) @ down)
    s = np.interp((points - middle[0]) @ down, along, knots, left=-1, right=length + 1)
    a, b = at(np.clip(s, 0, length))
    t = np.clip(np.sum((points - a) * (b - a), 1) / np.maximum(np.sum((b - a) ** 2, 1), 1e-9), 0, 1)
    hidden = (s >= 0) & (s < length) & (np.linalg.norm(points - a - t[:, None] * (b - a), axis=1) < 0.14 + flare * s)
    count = max(hidden.sum(), 1500)
    s = length * rng.random(count)
    a, b = at(s)
    side = b - a - ((b - a) @ down)[:, None] * down
    wide = np.linalg.norm(side, axis=1)
    side /= np.maximum(wide, 1e-6)[:, None]
    along = (b - a) / np.maximum(wide, 1e-6)[:, None]  # a straight ends at the other leg, however high that is
    front, radius = np.cross(down, side), 0.14 + flare * s
    turn = rng.random(count) * (2 * wide + 2 * np.pi * radius)  # along the seam: a straight, a half circle, a straight, a half circle
    ring = a + along * np.clip(turn, 0, wide)[:, None] + front * radius[:, None]
    angle = np.clip((turn - wide) / radius, 0, np.pi)
    around = np.where((turn < wide + np.pi * radius)[:, None], b + radius[:, None] * (np.sin(angle)[:, None] * side + np.cos(angle)[:, None] * front),
                      a + along * np.clip(2 * wide + np.pi * radius - turn, 0, wide)[:, None] - front * radius[:, None])
    angle = np.clip((turn - 2 * wide - np.pi * radius) / radius, 0, np.pi)
    last = a - radius[:, None] * (np.sin(angle)[:, None] * side + np.cos(angle)[:, None] * front)
    cloth = np.where((turn < wide)[:, None], ring, np.where((turn < 2 * wide + np.pi * radius)[:, None], around, last))
    return np.concatenate([points[~hidden], cloth])


def flying(rng, points, normals, share):
    """Between the person's outline, as a camera at +z sees it, and what is behind: pixels that saw a bit of both."""
    edge = np.flatnonzero(np.abs(normals[:, 2]) < 0.25)
    chosen = rng.choice(edge, int(share * len(points)))
    between = points[chosen].copy()
    between[:, 2] -= 0.4 * rng.random(len(chosen))
    return np.concatenate([points, between])


def from_above(points, normals, cell=0.02, behind=0.05):
    """What a camera at the ceiling sees: the highest points of each cell of its picture."""
    _, of = np.unique(np.floor(points[:, [0, 2]] / cell).astype(np.int64), axis=0, return_inverse=True)
    top = np.full(of.max() + 1, -np.inf)
    np.maximum.at(top, of, points[:, 1])
    return points[(points[:, 1] > top[of] - behind) & (normals[:, 1] > 0.1)]


def third_missing(rng, points):
    """The cloud without the third of it that lies farthest in some direction."""
    along = points @ rng.normal(size=3)
    return points[along < np.quantile(along, 2 / 3)]


def clouds(p, effect, seed=0):
    """The clouds of a performance, and the factor by which the person was scaled."""
    rng = np.random.default_rng(seed)
    scale = {"a child of 1.1 m": 1.1, "2.1 m": 2.1}.get(effect)
    factor = scale / np.ptp(p.rest[:, 1]) if scale else 1.0
    head = p.rest[:, 1] > p.rest[:, 1].max() - 0.10
    soles = p.rest[:, 1] < p.rest[:, 1].min() + 0.06
    missing = np.random.default_rng(seed).integers(1 << 30)  # the same side in all frames
    out = []
    for frame, vertices in enumerate(p.vertices):
        surface = smoothed(vertices, p.faces, 20) if effect == "smoothed surface (TSDF)" else vertices * factor
        points, normals, which = sample(rng, surface, p.faces, POINTS)
        if effect.startswith("noise of "):
            points = points + float(effect.split()[2]) / 1e3 * rng.normal(size=points.shape)
        elif effect.endswith(" points"):
            points = points[: int(effect.split()[0])]  # they are in random order
        elif effect == "upper half alone":
            points = points[points[:, 1] > p.joints[frame, 0, 1]]
        elif effect == "from the ceiling":
            points = from_above(points, normals)
        elif effect == "a third missing":
            points = third_missing(np.random.default_rng(missing), points)
        elif effect == "voxels of 8 mm":
            points = voxels(points, 0.008)
        elif effect == "voxels of 20 mm":
            points = voxels(points, 0.02)
        elif effect == "flying pixels, 5 %":
            points = flying(rng, points, normals, 0.05)
        elif effect == "without soles":
            points = points[~soles[p.faces[which]].all(1)]
        elif effect == "without hair (10 cm)":
            points = points[~head[p.faces[which]].all(1)]
        elif effect == "a stick in the hand":
            hand, elbow = p.joints[frame, 21], p.joints[frame, 19]
            along = np.cross(hand - elbow, [0.0, 0, 1])
            along /= max(np.linalg.norm(along), 1e-9)
            t = rng.random(800) - 0.3
            points = np.concatenate([points, hand + t[:, None] * along + 0.012 * rng.normal(size=(800, 3))])
        elif effect == "a box beside the foot":
            place = np.array([p.joints[frame, 10, 0] + 0.3, vertices[:, 1].min() + 0.15, p.joints[frame, 10, 2]])
            points = np.concatenate([points, box(rng, place, 0.3, 1500)])
        elif effect == "a skirt to the knees":
            points = skirt(rng, points, p.joints[frame], 1.0, 0.10)
        elif effect == "a long coat":
            points = skirt(rng, points, p.joints[frame], 1.7, 0.05)
        out.append(points.astype(np.float32))
    return out, factor


EFFECTS = ["dense and whole", "noise of 10 mm", "voxels of 8 mm", "voxels of 20 mm", "smoothed surface (TSDF)", "flying pixels, 5 %",
           "without soles", "without hair (10 cm)", "a stick in the hand", "a box beside the foot", "a skirt to the knees",
           "a long coat", "a child of 1.1 m", "2.1 m", "256 points", "128 points", "64 points", "noise of 40 mm", "upper half alone",
           "from the ceiling", "a third missing"]
UPPER = [3, 6, 9, *range(12, 22)]  # the joints above the pelvis


def aligned(found, truth):
    """Mean distance after the best turn, shift and scale of each frame, as restage.metrics.pa_mpjpe, of any number of joints."""
    out = []
    for x, y in zip(found, truth):
        x, y = x - x.mean(0), y - y.mean(0)
        u, s, v = np.linalg.svd(x.T @ y)
        sign = np.array([1, 1, np.sign(np.linalg.det(u @ v))])
        out.append(np.linalg.norm((s * sign).sum() / max((x * x).sum(), 1e-12) * x @ (u * sign @ v) - y, axis=1).mean())
    return float(np.mean(out))


def judge(p, effect, weights):
    seen, factor = clouds(p, effect)
    words = [] if weights is None else [weights]
    # Seen from above, feet and shoulders lie apart, as two people would: that has to be said.
    system = restage.System(p.target, *words, late=True, force=effect == "from the ceiling")
    frames = [f for cloud in seen for f in system.push_all(cloud)] + system.finish()
    joints, turns = np.stack([f.joints for f in frames]), np.stack([f.rotations for f in frames])
    extract = restage.Extractor(*words)
    judged = UPPER if effect == "upper half alone" else list(range(22))
    inside = []
    for cloud, truth in list(zip(seen, p.joints))[::6]:
        found, radius = extract(cloud)
        inside.append((np.linalg.norm(found - truth * factor, axis=1) <= radius)[judged])
    return {"pa_mpjpe": aligned(joints[:, judged], p.joints[:, judged]), "rotation_deg": restage.metrics.rotation_deg(turns, p.rotations),
            "rotation_over_90": restage.metrics.rotation_over_90(turns, p.rotations), "joints_within_radius": float(np.mean(inside))}


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("data", help="benchmark/test.h5")
    words.add_argument("--weights", help="default: the standard weights")
    words.add_argument("--program", default="build/release/restage")
    words.add_argument("--effects", nargs="*", default=EFFECTS, choices=EFFECTS, metavar="EFFECT", help="only these")
    words.add_argument("--out", required=True, help="a JSON file; other effects that it has stay in it")
    given = words.parse_args()
    out = pathlib.Path(given.out)
    found = json.loads(out.read_text()) if out.exists() else {}
    with tempfile.TemporaryDirectory() as folder:
        performances = {f"{clip} {body}": Performance(given.data, body, clip, given.program, f"{folder}/{clip}-{body}")
                        for clip in CLIPS for body in BODIES}
        for effect in given.effects:
            each = {name: judge(p, effect, given.weights) for name, p in performances.items()}
            mean = {key: float(np.mean([one[key] for one in each.values()])) for key in next(iter(each.values()))}
            found[effect] = {"mean": mean, "sequences": each}
            print(f"| {effect} | {1e3 * mean['pa_mpjpe']:.1f} | {mean['rotation_deg']:.1f} | "
                  f"{100 * mean['rotation_over_90']:.2f} | {100 * mean['joints_within_radius']:.0f} |", flush=True)
            out.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
