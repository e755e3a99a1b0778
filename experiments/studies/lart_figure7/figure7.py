#!/usr/bin/env python3
"""Figure 7 of Chen et al. 2023: LART on noisy clouds, and on every fourth cloud of a sequence, between which it decodes
mixed codes. Draws a sheet for each, and says how far the results are from the true vertices, beside the answer to the
clouds as they are and beside the straight way from one answer to the next.

    PYTHONPATH=build/release/python python3 experiments/studies/lart_figure7/figure7.py WEIGHTS OUT [--sequence NAME] [--benchmark FOLDER]
"""
import argparse
import json
import os

import h5py
import numpy as np
import restage

NOISE, STEP = 0.02, 4  # metres; one cloud in four is shown


def distance(found, true):
    """Mean distance of vertices in millimetres, frame by frame: both around the middle of their box."""
    def centred(v):
        return v - (v.max(1, keepdims=True) + v.min(1, keepdims=True)) / 2
    return 1000 * np.linalg.norm(centred(found) - centred(true), axis=2).mean(1)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("weights")
    parser.add_argument("out")
    parser.add_argument("--sequence", default="naked/walking-male-female")
    parser.add_argument("--benchmark", default="benchmark")
    args = parser.parse_args()
    folder = os.path.join(args.benchmark, args.sequence)
    clouds = restage.load_clouds(os.path.join(folder, "source.h5"))
    with h5py.File(os.path.join(folder, "truth.h5")) as f:
        true = f["vertices"][:]
    last = (len(clouds) - 1) // STEP * STEP + 1  # a gap has two ends
    clouds, true = clouds[:last], true[:last]
    rng = np.random.default_rng(0)
    seen = {"plain": clouds,
            "noise": [c + rng.normal(0, NOISE, c.shape).astype(np.float32) for c in clouds],
            "between": [c if i % STEP == 0 else None for i, c in enumerate(clouds)]}
    os.makedirs(args.out, exist_ok=True)
    moved = {}
    for name, given in seen.items():
        frames = os.path.join(args.out, name)
        restage.retarget(given, os.path.join(folder, "target.ply"), weights=args.weights, out=frames + "/", system="transfer", force=True)
        moved[name] = np.array([restage.load_cloud(os.path.join(frames, f)) for f in sorted(os.listdir(frames)) if f.endswith(".ply")])
        restage.command("view", frames, out=frames + ".png", columns=9)
    gap = np.arange(last) % STEP != 0
    share = (np.arange(last) % STEP / STEP)[:, None, None]
    first = np.arange(last) // STEP * STEP
    straight = (1 - share) * moved["plain"][first] + share * moved["plain"][np.minimum(first + STEP, last - 1)]
    figures = {"frames": int(last), "as it is": distance(moved["plain"], true).mean(),
               "2 cm of noise": distance(moved["noise"], true).mean(),
               "frames in gaps, shown": distance(moved["plain"], true)[gap].mean(),
               "frames in gaps, codes mixed": distance(moved["between"], true)[gap].mean(),
               "frames in gaps, straight": distance(straight, true)[gap].mean()}
    with open(os.path.join(args.out, "figure7.json"), "w") as f:
        json.dump({k: round(float(v), 1) for k, v in figures.items()}, f, indent=1)
        f.write("\n")
    print(json.dumps({k: round(float(v), 1) for k, v in figures.items()}))


if __name__ == "__main__":
    main()
