#!/usr/bin/env python3
"""Sparse clouds of one side: how wrong the joints are, and how sure the extractor says that it is.

    restage data build configs/data/open_benchmark.yaml out=benchmark data=DATA_FOLDER
    PYTHONPATH=build/release/python python3 experiments/studies/sensors/sparse.py benchmark/test.h5 --out experiments/studies/sensors/sparse.json

Nobody in benchmark/test.h5 was trained on. A scanner stands 6 m away and 1.5 m high, so it sees one side; "rows" are the lines of
a spinning scanner, three times as far apart as the points of a line; "random" are as many points anywhere on the same side;
"whole" are from all sides. The count is the median over a sequence's frames, every fifth of which is looked at. Figures are means
over the sequences, and of the worst one: MPJPE and PA-MPJPE (mm) of the joints of `restage.Extractor` (standard weights, four
views); the median of the confidence (docs/faq.md) and what it estimates, the share of joints nearer than 5 cm to the true ones; the
share of true joints inside the 90 % regions, which 85 to 95 % should be, and by what factor the radii miss 90 %.
"""
import argparse
import json
import pathlib
import tempfile

import numpy as np

import restage
from measure import BODIES, CLIPS, Performance, aligned, sample

COUNTS, DENSE, EVERY = (64, 96, 128, 192, 256, 384, 512, 768, 1024, 2048), 30_000, 5
NEARBY, NINETY = 0.05, 5.3223  # metres; of nn/models/views.h
EYE = np.array([0.0, 1.5, 6.0])
ROWS_APART = 3.0


def seen_of(rng, vertices, faces, middle):
    """Points that the scanner sees, and their directions as (across, up), radians."""
    points, normals, _ = sample(rng, vertices, faces, DENSE)
    rays = points - (EYE + [middle[0], 0, middle[2]])
    facing = np.sum(rays * normals, 1) < 0
    points, rays = points[facing], rays[facing]
    far = np.linalg.norm(rays, axis=1)
    angles = np.stack([np.arctan2(rays[:, 0], -rays[:, 2]), np.arcsin(rays[:, 1] / far)], 1)
    _, cell = np.unique(np.floor(angles / 0.003).astype(np.int64), axis=0, return_inverse=True)  # 18 mm: who stands before whom
    nearest = np.full(cell.max() + 1, np.inf)
    np.minimum.at(nearest, cell, far)
    front = far < nearest[cell] + 0.05
    return points[front], angles[front]


def rows(points, angles, step, start):
    """One point nearest to each place of a lattice of directions."""
    lattice = (angles - angles.min(0)) / [step, ROWS_APART * step] + start
    place = np.round(lattice).astype(np.int64)
    off = np.linalg.norm(lattice - place, axis=1)
    order = np.argsort(off)
    _, first = np.unique(place[order], axis=0, return_index=True)
    chosen = order[first]
    return points[chosen[off[chosen] < 0.35]]


def step_for(points, angles, count):
    """The step of the lattice that gives so many points."""
    low, high = 1e-4, 0.2
    for _ in range(14):
        step = np.sqrt(low * high)
        low, high = (step, high) if len(rows(points, angles, step, 0.0)) > count else (low, step)
    return high


def clouds(p, kind, count, seed=0):
    rng = np.random.default_rng(seed)
    step, out = None, []
    for frame, vertices in list(enumerate(p.vertices))[::EVERY]:
        if kind == "whole":
            out.append(sample(rng, vertices, p.faces, count)[0].astype(np.float32))
            continue
        points, angles = seen_of(rng, vertices, p.faces, p.joints[frame, 0])
        if kind == "random":
            chosen = points[rng.permutation(len(points))[:count]]
        else:
            step = step or step_for(points, angles, count)
            chosen = rows(points, angles, step, rng.random(2))
        out.append((chosen + 0.01 * rng.normal(size=chosen.shape)).astype(np.float32))  # a scanner's noise
    return out


def confidence(radius):
    """Of a frame, from the radii of its 90 % regions."""
    r = NEARBY / (radius / NINETY)
    return float((1 - np.exp(-r) * (1 + r + r * r / 2)).mean())


def judge(p, kind, count, extract):
    seen, truth = clouds(p, kind, count), p.joints[::EVERY]
    kept = [k for k, cloud in enumerate(seen) if len(cloud) >= 64]
    if len(kept) < len(seen) // 2:
        return None
    found = [extract(seen[k]) for k in kept]
    joints, radius = np.stack([f[0] for f in found]), np.stack([f[1] for f in found])
    off = np.linalg.norm(joints - truth[kept], axis=-1)
    return {"points": float(np.median([len(c) for c in seen])), "pa_mpjpe": aligned(joints, truth[kept]), "mpjpe": float(off.mean()),
            "confidence": float(np.median([confidence(r) for r in radius])), "nearby": float((off <= NEARBY).mean()),
            "joints_within_radius": float((off <= radius).mean()),
            "radius_factor": float(np.quantile(off / radius, 0.9))}


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("data", help="benchmark/test.h5")
    words.add_argument("--program", default="build/release/restage")
    words.add_argument("--kinds", nargs="*", default=["rows", "random", "whole"], choices=["rows", "random", "whole"])
    words.add_argument("--counts", nargs="*", type=int, default=COUNTS)
    words.add_argument("--out", required=True, help="a JSON file; other cases that it has stay in it")
    given = words.parse_args()
    out = pathlib.Path(given.out)
    found = json.loads(out.read_text()) if out.exists() else {}
    extract = restage.Extractor(samples=4)
    with tempfile.TemporaryDirectory() as folder:
        performances = {f"{clip} {body}": Performance(given.data, body, clip, given.program, f"{folder}/{clip}-{body}")
                        for clip in CLIPS for body in BODIES}
        for kind in given.kinds:
            for count in given.counts:
                each = {name: judge(p, kind, count, extract) for name, p in performances.items()}
                each = {name: one for name, one in each.items() if one}
                if not each:
                    continue
                mean = {key: float(np.mean([one[key] for one in each.values()])) for key in next(iter(each.values()))}
                found[f"{kind} {count}"] = {"mean": mean, "sequences": each}
                worst = max(each.values(), key=lambda one: one["mpjpe"])
                print(f"| {kind} | {mean['points']:.0f} | {1e3 * mean['mpjpe']:.0f} | {1e3 * mean['pa_mpjpe']:.1f} | "
                      f"{1e3 * worst['mpjpe']:.0f}, {worst['confidence']:.2f} | {mean['confidence']:.2f} | {mean['nearby']:.2f} | "
                      f"{100 * mean['joints_within_radius']:.0f} | {mean['radius_factor']:.2f} |", flush=True)
                out.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
