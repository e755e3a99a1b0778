#!/usr/bin/env python3
"""Writes the pictures of characters in docs/images: characters_worst.jpg, film_*.webp and textured_scan.jpg.

    python3 docs/make_character_pictures.py PROGRAM DATA_FOLDER CHARACTERS RIGS OUT [--only sheet|films|scan] [--people CLOUDS.h5]

DATA_FOLDER: MakeHuman's body and CMU's motions, as `restage data import` takes it, with cmu_more beside. CHARACTERS: a folder with
check_rig.py, source_dance.glb and targets. RIGS: a folder of strangers' characters. They are not in this repository. Pictures are
drawn by Blender (tests/infer/blender_picture.py), films by `restage view`. CLOUDS.h5: two people who pass each other, of whom
film_people.webp is made (bench/README.md). Needs numpy, h5py, scipy and Pillow.
"""
import argparse
import gzip
import os
import subprocess
import sys
import tempfile

import h5py
import numpy as np
from PIL import Image, ImageDraw, ImageFont, ImageSequence

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
BLENDER = os.path.join(ROOT, "tests", "infer", "blender_picture.py")
# Motion, first and last frame, degrees from the front: what a film shows.
FILMS = {"clap": ("86_09", 533, 593, -50), "hip": ("29_03", 10, 100, 20), "kick": ("135_04", 185, 245, 50), "fall": ("90_16", 85, 165, 60)}
SHEET = ("mixa_t.glb", "mixa_a.glb", "mixa_t.fbx", "q_witch.glb", "q_spacesuit.glb", "q_knight.glb", "robot_expressive.glb")
FONT = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf"


def study(name):
    """A script of experiments/studies, as a module."""
    import importlib.util
    spec = importlib.util.spec_from_file_location(name, os.path.join(ROOT, "experiments", "studies", name, "measure.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run(*words):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError("%s: %s" % (" ".join(map(str, words)), (done.stderr or done.stdout).strip()))


def write_words(picture, at, text, size=15):
    font = ImageFont.truetype(FONT, size) if os.path.exists(FONT) else None
    ImageDraw.Draw(picture).text(at, text, (60, 66, 80), font=font)


class Studio:
    def __init__(self, options, folder):
        self.program, self.data, self.characters, self.rigs, self.out = (os.path.abspath(p) for p in (
            options.program, options.data, options.characters, options.rigs, options.out))
        self.folder = folder

    def at(self, *names):
        return os.path.join(self.folder, *names)

    def given(self, name):
        return next(p for p in (os.path.join(f, name) for f in (self.characters, self.rigs)) if os.path.exists(p))

    def retarget(self, source, target, out, *more):
        run(self.program, "retarget", "--source", source, "--target", target, "--out", out, "--quiet", *more)

    # ---- films ----

    def motion(self, film):
        """Some frames of a motion, as a file of its own."""
        clip, first, last, _ = FILMS[film]
        for name, source in (("cmu.h5", self.data), ("more.h5", os.path.join(self.data, "cmu_more", "clips30_more.h5"))):
            if not os.path.exists(self.at(name)):
                run(self.program, "data", "import", source, "--out", self.at(name))
            with h5py.File(self.at(name)) as file:
                if clip not in file["motions"]:
                    continue
                with h5py.File(self.at(film + ".h5"), "w") as out:
                    for key, value in file.attrs.items():
                        out.attrs[key] = value
                    file.copy(file["motions"][clip], out.require_group("motions"), name=clip)
                    for part in ("rotations", "hips"):
                        short = out["motions"][clip][part][first:last]
                        del out["motions"][clip][part]
                        out["motions"][clip][part] = short
            return self.at(film + ".h5")
        raise RuntimeError("no motion %s" % clip)

    def child(self):
        """A child of 1.0 m of MakeHuman's, without bones."""
        if not os.path.exists(self.at("child.obj")):
            os.makedirs(self.at("people"))
            people, adults, children = study("proportions").import_people(self.program, self.data, self.at("people"), 3)
            with h5py.File(people) as file:
                body = file["bodies"][children[1]]
                vertices = body["vertices"][()].astype(float)
                study("any_pose").write_obj(self.at("child.obj"), vertices / np.ptp(vertices[:, 1]), file["topologies"]["0"][()])
        return self.at("child.obj")

    def film(self, film):
        azimuth = FILMS[film][3]
        self.retarget(self.motion(film), self.given("source_dance.glb"), self.at("source.glb"), "--clip-name", film, "--contacts", "off")
        panels = [("source", self.at("source.glb"))]
        for title, target in (("child, 1.0 m", self.child()), ("witch", self.given("q_witch.glb")), ("space suit", self.given("q_spacesuit.glb")),
                              ("robot", self.given("robot_expressive.glb"))):
            panels.append((title, self.at("panel%d.glb" % len(panels))))
            self.retarget(self.at("source.glb"), target, panels[-1][1], "--clip", film, *([] if target.endswith(".obj") else ["--clip-name", "film"]))
        self.write_film(film, panels, "190x240", azimuth)

    def people(self, clouds):
        """Two people who pass each other: the clouds, and a character for each person."""
        panels = [("the clouds", clouds)]
        for person, target in enumerate(("q_witch.glb", "q_spacesuit.glb")):
            panels.append(("person %d" % person, self.at("person%d.glb" % person)))
            self.retarget(clouds, self.given(target), panels[-1][1], "--person", person)
        self.write_film("people", panels, "320x240", 0)

    def write_film(self, film, panels, size, azimuth):
        frames, width = [], int(size.split("x")[0])
        for title, path in panels:
            run(self.program, "view", path, "--fps", 15, "--size", size, "--azimuth", azimuth, "--out", self.at("panel.webp"), "--quiet")
            frames.append([f.convert("RGB").copy() for f in ImageSequence.Iterator(Image.open(self.at("panel.webp")))])
        wide = []
        for moment in zip(*frames):
            picture = Image.new("RGB", (width * len(panels), 240), "white")
            for k, part in enumerate(moment):
                picture.paste(part, (width * k, 0))
                write_words(picture, (width * k + 8, 4), panels[k][0], 13)
            wide.append(picture)
        wide[0].save(os.path.join(self.out, "film_%s.webp" % film), save_all=True, append_images=wide[1:], duration=1000 // 15, loop=0, quality=55, method=4)

    # ---- the worst moments ----

    def worst(self, path):
        """The frame in which an edge of the mesh is stretched most, and the one in which most of the hands is inside the body."""
        sys.path.insert(0, self.characters)
        import check_rig
        film = study("contacts").Film(check_rig, path)
        edges = np.unique(np.sort(np.concatenate([film.faces[:, [0, 1]], film.faces[:, [1, 2]], film.faces[:, [2, 0]]]), 1), axis=0)
        lengths = lambda world: np.linalg.norm(np.subtract(*film.file.pose(world, film.parts)[edges.T]), axis=1)
        rest, frames = lengths(film.file.world()), range(0, len(film.times), 3)
        stretch = [(lengths(film.world(f)) - rest).max() for f in frames]
        inside = [film.figures(f)[1] for f in frames]
        height = np.ptp(film.file.pose(film.file.world(), film.parts)[:, 1])
        print("%s: longest stretch %.1f %% of the height in frame %d; %.1f %% of the hands inside in frame %d" % (
            os.path.basename(path), 100 * max(stretch) / height, frames[int(np.argmax(stretch))], 100 * max(inside), frames[int(np.argmax(inside))]))
        return frames[int(np.argmax(stretch))], frames[int(np.argmax(inside))]

    def draw(self, path, clip, frame, size="200x250"):
        out = self.at("%s_%s_%d.png" % (os.path.basename(path), clip, frame))
        if not os.path.exists(out):
            run("blender", "-b", "--python", BLENDER, "--", path, out, frame, "--azimuth", -40, "--size", size, "--samples", 24,
                *(["--clip", clip] if clip else []))
        return Image.open(out).convert("RGB")

    def sheet(self):
        source, rows = self.given("source_dance.glb"), []
        for name in SHEET:
            out = self.at(name.replace(".", "_") + ".glb")
            self.retarget(source, self.given(name), out, "--clip-name", "film")
            rows.append((name, [p for f in self.worst(out) for p in (self.draw(source, "dance", f), self.draw(out, "film", f))]))
        picture = Image.new("RGB", (8 * 200 + 20, (len(rows) + 1) // 2 * 275), "white")
        for k, (name, parts) in enumerate(rows):
            left, top = k % 2 * 820, k // 2 * 275
            write_words(picture, (left + 6, top + 4), "%s: mesh most stretched; hands deepest (source, result)" % name)
            for i, part in enumerate(parts):
                picture.paste(part, (left + 200 * i, top + 25))
        picture.save(os.path.join(self.out, "characters_worst.jpg"), quality=80)

    # ---- a textured scan ----

    def scan(self):
        """A dressed MakeHuman person in A-pose, as a scanner would write him: OBJ, MTL and a picture."""
        vertices, joints, faces, corners, places = self.textured()
        pose = study("any_pose")
        with h5py.File(self.at("cmu.h5")) as file:
            weights = file["bodies"]["b144"]["weights"][()].astype(float)
        posed = pose.posed(vertices, joints, weights, pose.a_pose(45))
        paint(vertices, joints, faces, corners, places).save(self.at("scan.png"))
        with open(self.at("scan.mtl"), "w") as f:
            f.write("newmtl person\nKd 1 1 1\nmap_Kd scan.png\n")
        with open(self.at("scan.obj"), "w") as f:
            f.write("mtllib scan.mtl\nusemtl person\n")
            f.writelines("v %.5f %.5f %.5f\n" % tuple(v) for v in posed)
            f.writelines("vt %.5f %.5f\n" % tuple(t) for t in places)
            f.writelines("f %s\n" % " ".join("%d/%d" % (v + 1, t + 1) for v, t in zip(*both)) for both in zip(faces, corners))
        self.retarget(self.given("source_dance.glb"), self.at("scan.obj"), self.at("scan.glb"))
        pictures = [("the scan: OBJ, PNG", self.at("scan.obj"), "none", 0), ("result at rest: GLB", self.at("scan.glb"), "rest", 0)]
        pictures += [("frame %d" % f, self.at("scan.glb"), "", f) for f in (6, 22, 38)]
        sheet = Image.new("RGB", (300 * len(pictures), 400), "white")
        for k, (title, path, clip, frame) in enumerate(pictures):
            sheet.paste(self.draw(path, clip, frame, "300x400"), (300 * k, 0))
            write_words(sheet, (300 * k + 8, 6), title)
        sheet.save(os.path.join(self.out, "textured_scan.jpg"), quality=85)

    def textured(self):
        """Vertices, joints, faces, and of each face's corners their places in the picture."""
        if not os.path.exists(self.at("cmu.h5")):
            run(self.program, "data", "import", self.data, "--out", self.at("cmu.h5"))
        with h5py.File(self.at("cmu.h5")) as file:
            vertices, joints = (file["bodies"]["b144"][k][()].astype(float) for k in ("vertices", "joints"))
        lines = gzip.open(os.path.join(self.data, "body", "base.obj.gz"), "rt").read().splitlines()
        places = np.array([line.split()[1:3] for line in lines if line.startswith("vt ")], float)
        faces, corners = [], []
        for line in lines:
            if line.startswith("f "):
                both = np.array([word.split("/")[:2] for word in line.split()[1:]], int) - 1
                if both[:, 0].max() < len(vertices):  # skin, not clothes' helpers
                    faces.append(both[:, 0])
                    corners.append(both[:, 1])
        return vertices, joints, faces, corners, places


def colour(point, joints):
    """What a person wears, by place in the T-pose: hair, skin, a striped shirt, trousers, shoes."""
    x, y, z = point
    head, hips, ankle, elbow = joints[15], joints[0][1], joints[7][1], abs(joints[18][0])
    if y > joints[12][1] + 0.02:
        if y > head[1] + 0.13 or z < head[2] - 0.005 and y > head[1] - 0.03:
            return 74, 48, 32
        eye = min(np.hypot(x - s * 0.032, (y - head[1] - 0.05) * 1.6) for s in (-1, 1))
        return (30, 30, 40) if eye < 0.011 and z > head[2] + 0.06 else (214, 160, 128)
    if abs(x) > elbow - 0.08 and y > hips:
        return 214, 160, 128
    if y > hips + 0.03:
        return (225, 225, 225) if int(np.floor((y - hips) / 0.035)) % 2 else (176, 40, 48)
    if y > ankle + 0.03:
        return (40, 60, 110) if abs(y - hips - 0.015) > 0.02 else (50, 36, 26)
    return 40, 36, 34


def paint(vertices, joints, faces, corners, places, size=1024):
    """The picture: each face's part of it is filled with the colours of its points."""
    picture = np.full((size, size, 3), 128, np.uint8)
    for face, corner in zip(faces, corners):
        for k in range(1, len(face) - 1):
            a, b, c = (places[corner[i]] * [size, -size] + [0, size] for i in (0, k, k + 1))
            p, q, r = (vertices[face[i]] for i in (0, k, k + 1))
            low, high = (np.clip(f([a, b, c], 0), 0, size - 1).astype(int) for f in (np.min, np.max))
            area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            if abs(area) < 1e-9:
                continue
            for y in range(low[1], high[1] + 1):
                for x in range(low[0], high[0] + 1):
                    u = ((x + .5 - a[0]) * (c[1] - a[1]) - (y + .5 - a[1]) * (c[0] - a[0])) / area
                    v = ((b[0] - a[0]) * (y + .5 - a[1]) - (b[1] - a[1]) * (x + .5 - a[0])) / area
                    if u > -0.4 and v > -0.4 and u + v < 1.4:  # a little over the edge, so that no seam shows
                        picture[y, x] = colour(p + u * (q - p) + v * (r - p), joints)
    return Image.fromarray(picture)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("program", "data", "characters", "rigs", "out"):
        parser.add_argument(name)
    parser.add_argument("--only", choices=("sheet", "films", "scan"))
    parser.add_argument("--people", help="clouds of two people: only their film is made")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        studio = Studio(options, folder)
        if options.people:
            return studio.people(os.path.abspath(options.people))
        if options.only in (None, "scan"):
            studio.scan()
        if options.only in (None, "films"):
            for film in FILMS:
                studio.film(film)
        if options.only in (None, "sheet"):
            studio.sheet()


if __name__ == "__main__":
    main()
