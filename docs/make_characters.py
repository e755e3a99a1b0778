#!/usr/bin/env python3
"""Writes dressed people of MakeHuman's (CC0) as rigged GLB files: the characters of pictures, and of docs/sample.

    python3 docs/make_characters.py PROGRAM DATA_FOLDER OUT [NAME ...]

DATA_FOLDER: MakeHuman's bodies and garments, as `restage data fetch` gets them. OUT gets NAME.glb of each character of CHARACTERS, or
of those that are named. The skin below a garment is left out, as the garment's own list (delete_verts) says: else it would show through
the cloth at knees and elbows. MakeHuman's own pictures of skin and cloth are not used; every part has one colour. Needs numpy, h5py and scipy.
"""
import argparse
import importlib.util
import os
import subprocess
import sys
import tempfile

import h5py
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))

# Name: a body of bodies.csv, a garment, colours of skin, hair and of the garment's parts from the largest to the smallest.
CHARACTERS = {
    "tall": ("b149", "female_casualsuit02", "#8d5a3b", "#1d1714", ["#c8553d", "#2f4858", "#e9c46a"]),
    "stout": ("b157", "male_casualsuit02", "#e0b090", "#6b4a2f", ["#3f6f8f", "#4a4038"]),
    "short": ("b147", "female_sportsuit01", "#c98f68", "#2a1c15", ["#5b3a8c", "#2c2c34"]),
    "strong": ("b152", "male_worksuit01", "#d8a585", "#3a2a1e", ["#2e4a7d", "#d9d4c7", "#9aa0a6"]),
    "slim": ("b140", "male_casualsuit04", "#b97f5b", "#14110f", ["#3b3f46", "#2a9d6f"]),
    "lean": ("b145", "female_casualsuit01", "#e6bda2", "#8a4b2a", ["#e07a5f", "#3d405b"]),
}
BONES = ("Hips", "LeftUpLeg", "RightUpLeg", "Spine", "LeftLeg", "RightLeg", "Spine1", "LeftFoot", "RightFoot", "Spine2", "LeftToeBase", "RightToeBase",
         "Neck", "LeftShoulder", "RightShoulder", "Head", "LeftArm", "RightArm", "LeftForeArm", "RightForeArm", "LeftHand", "RightHand")
HEAD = BONES.index("Head")
HAIR = 0.009  # metres that hair stands off the skin


def module(*place):
    """A script of this repository."""
    spec = importlib.util.spec_from_file_location(place[-1][:-3], os.path.join(ROOT, *place))
    out = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(out)
    return out


def linear(colour):
    """#rrggbb as glTF wants it."""
    parts = np.array([int(colour[k:k + 2], 16) for k in (1, 3, 5)]) / 255
    return np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4).tolist()


def normals_of(vertices, faces):
    out = np.zeros_like(vertices)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    for k in range(3):
        np.add.at(out, faces[:, k], np.cross(b - a, c - a))
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)


def pieces(faces, count):
    """The faces of each connected piece of a mesh, the largest first."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    _, label = connected_components(coo_matrix((np.ones(len(edges)), edges.T), shape=(count, count)), directed=False)
    of_face = label[faces[:, 0]]
    return [faces[of_face == piece] for piece in sorted(np.unique(of_face), key=lambda piece: -(of_face == piece).sum())]


def has_hair(vertices, joints):
    """Which vertices of the skin lie on the scalp: above forehead and ears, and behind them down to the neck."""
    head, top = joints[HEAD], vertices[:, 1].max()
    side, up, front = np.moveaxis((vertices - head * [0, 1, 1]) / (top - head[1]), 1, 0)
    ear = (np.abs(side) > 0.33) & (up < 0.42) & (np.abs(front) < 0.25)
    return (np.abs(side) < 1) & ~ear & (up > np.select([front < -0.25, front < 0.05], [-0.1, 0.1], 0.4 + 0.7 * front))


class People:
    """The bodies of a data folder, naked and in its garments."""

    def __init__(self, program, data, folder):
        self.program, self.data, self.folder = program, data, folder
        self.poses = module("experiments", "studies", "any_pose", "measure.py")

    def file(self, garment):
        path = os.path.join(self.folder, (garment or "naked") + ".h5")
        if not os.path.exists(path):
            subprocess.run([self.program, "data", "import", self.data, *(["--garment", garment] if garment else []), "--out", path, "--quiet"],
                           check=True, stdout=subprocess.DEVNULL)
        return h5py.File(path)

    def surface(self, body, garment=""):
        """Vertices, joints, weights, faces: of the skin, or of a garment on it."""
        with self.file(garment) as file:
            return self.poses.Wardrobe.surface(file, body + ("_" + garment if garment else ""))

    def bare(self, body, garment):
        """The skin without the faces that touch what the garment hides."""
        vertices, joints, weights, faces = self.surface(body)
        hidden = self.poses.covered(os.path.join(self.data, "body", "clothes", garment + ".mhclo.gz"))
        seen = np.ones(len(vertices), bool)
        seen[hidden[hidden < len(vertices)]] = False
        return vertices, joints, weights, faces[seen[faces].all(1)]


def character(people, body, garment, skin, hair, cloth):
    """Vertices, normals, weights, parts as write_glb() takes them, joints."""
    vertices, joints, weights, faces = people.bare(body, garment)
    whole = normals_of(vertices, people.surface(body)[3])
    scalp = has_hair(vertices, joints)
    haired = scalp[faces].all(1)
    edge = np.unique(faces[~haired])  # where hair ends it lies on the skin
    thick = np.full((len(vertices), 1), HAIR)
    thick[edge] = 0.001
    raised = vertices + thick * whole
    worn, _, shares, sewn = people.surface(body, garment)
    parts = [("skin", linear(skin), faces), ("hair", linear(hair), faces[haired] + len(vertices))]
    for k, piece in enumerate(pieces(sewn, len(worn))):
        parts.append(("cloth %d" % (k + 1), linear(cloth[min(k, len(cloth) - 1)]), piece + 2 * len(vertices)))
    vertices, weights = np.concatenate([vertices, raised, worn]), np.concatenate([weights, weights, shares])
    normals = np.concatenate([whole, whole, normals_of(worn, sewn)])
    used = np.unique(np.concatenate([part[2].ravel() for part in parts]))
    place = np.full(len(vertices), -1)
    place[used] = np.arange(len(used))
    return vertices[used], normals[used], weights[used], [(name, colour, place[some]) for name, colour, some in parts], joints


def write(path, vertices, normals, weights, parts, joints):
    poses = module("experiments", "studies", "any_pose", "measure.py")
    first = np.argsort(-weights, axis=1, kind="stable")[:, :4]
    shares = np.take_along_axis(weights, first, 1)
    shares /= shares.sum(1, keepdims=True)
    module("docs", "anny_to_glb.py").write_glb(
        path, vertices.tolist(), None, list(BONES), poses.PARENTS, joints.tolist(), shares.tolist(), first.tolist(), normals.tolist(),
        [(name, colour, some.tolist()) for name, colour, some in parts])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("program", "data", "out"):
        parser.add_argument(name)
    parser.add_argument("names", nargs="*", metavar="NAME", help="of %s; default: all" % ", ".join(CHARACTERS))
    options = parser.parse_args()
    unknown = [name for name in options.names if name not in CHARACTERS]
    if unknown:
        sys.exit("there is no character '%s'; there are %s" % (unknown[0], ", ".join(CHARACTERS)))
    os.makedirs(options.out, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        people = People(os.path.abspath(options.program), options.data, folder)
        for name in options.names or CHARACTERS:
            write(os.path.join(options.out, name + ".glb"), *character(people, *CHARACTERS[name]))
            print(os.path.join(options.out, name + ".glb"))


if __name__ == "__main__":
    main()
