#!/usr/bin/env python3
"""Writes docs/sample: ten scans of a person who throws, and a rigged character.

    python3 docs/make_sample.py PROGRAM DATA_FOLDER [OUT]

DATA_FOLDER: MakeHuman's bodies and garments (CC0), as `restage data fetch` gets them. The scans are simulated: the character PERFORMER of
docs/make_characters.py performs a built-in motion; every frame is so many points of that surface, with noise. OUT: docs/sample.
Needs numpy, h5py and scipy.
"""
import os
import subprocess
import sys
import tempfile

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import make_characters

ROOT = make_characters.ROOT
PERFORMER, HERO, MOTION = "tall", "strong", "builtin_test_2_throw"
FIRST, STEP, SCANS, POINTS, NOISE = 12, 5, 10, 3000, 0.002  # frames of 30 a second; metres


def run(*words):
    subprocess.run([str(w) for w in words], check=True, stdout=subprocess.DEVNULL)


def read_ply(path):
    """Vertices and triangles of a PLY file of `restage retarget`."""
    data = open(path, "rb").read()
    head, body = data.split(b"end_header\n", 1)
    counts = [int(line.split()[2]) for line in head.decode().splitlines() if line.startswith("element")]
    vertices = np.frombuffer(body, "<f4", counts[0] * 3).reshape(-1, 3)
    faces = np.frombuffer(body, [("n", "u1"), ("i", "<i4", 3)], counts[1], counts[0] * 12)
    assert (faces["n"] == 3).all(), path
    return vertices.astype(float), faces["i"]


def scan(vertices, faces, random):
    """Points spread evenly over a surface."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    chosen = random.choice(len(faces), POINTS, p=area / area.sum())
    u, v = random.random((2, POINTS, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    points = a[chosen] + u * (b - a)[chosen] + v * (c - a)[chosen]
    return points + random.normal(0, NOISE, points.shape)


def write_cloud(path, points):
    head = "ply\nformat binary_little_endian 1.0\ncomment CC0 1.0\nelement vertex %d\n" % len(points)
    with open(path, "wb") as f:
        f.write((head + "".join("property float %s\n" % axis for axis in "xyz") + "end_header\n").encode())
        f.write(points.astype("<f4").tobytes())


def main():
    if len(sys.argv) not in (3, 4) or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    program, data = os.path.abspath(sys.argv[1]), sys.argv[2]
    out = sys.argv[3] if len(sys.argv) == 4 else os.path.join(ROOT, "docs", "sample")
    os.makedirs(os.path.join(out, "scans"), exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        people = make_characters.People(program, data, folder)
        for name, path in ((PERFORMER, os.path.join(folder, "performer.glb")), (HERO, os.path.join(out, "hero.glb"))):
            make_characters.write(path, *make_characters.character(people, *make_characters.CHARACTERS[name]))
        motions, frames = os.path.join(folder, "motions.h5"), os.path.join(folder, "frames")
        run(program, "data", "build", "--bodies", 0, 0, 1, "--motions", 0, 0, 3, "--out", motions)
        run(program, "retarget", "--source", motions, "--clip", MOTION, "--target", os.path.join(folder, "performer.glb"), "--format", "ply", "--out", frames)
        random = np.random.default_rng(0)
        for k in range(SCANS):
            mesh = os.path.join(frames, sorted(os.listdir(frames))[FIRST + STEP * k])
            write_cloud(os.path.join(out, "scans", "%02d.ply" % k), scan(*read_ply(mesh), random))


if __name__ == "__main__":
    main()
