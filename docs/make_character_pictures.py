#!/usr/bin/env python3
"""Writes the pictures of characters in docs/images: moving.webp (README.md), view_dance.webp, film_*.webp, characters_worst.jpg,
character_blender.jpg, textured_scan.jpg and real_capture.webp.

    python3 docs/make_character_pictures.py PROGRAM DATA_FOLDER RIGS OUT [--only readme|dance|films|sheet|blender|scan]
      [--check FOLDER] [--people CLOUDS.h5] [--real SCAN.ply]

DATA_FOLDER: MakeHuman's bodies and CMU's motions, as `restage data import` takes them, with cmu_more beside. Its dressed people are
those of docs/make_characters.py. RIGS: a folder of strangers' characters, which are not in this repository. The sheet needs FOLDER with
check_rig.py, which is not here either. Still pictures are drawn by Blender (tests/infer/blender_picture.py), films by `restage view`.
CLOUDS.h5: two people who pass each other, of whom film_people.webp is made (bench/README.md). SCAN.ply: points in metres, y up, of which
real_capture.webp is made. Needs numpy, h5py, scipy and Pillow.
"""
import argparse
import gzip
import os
import subprocess
import sys
import tempfile

import h5py
import make_characters
import make_sample
import numpy as np
from PIL import Image, ImageDraw, ImageFont, ImageSequence

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
BLENDER = os.path.join(ROOT, "tests", "infer", "blender_picture.py")
# Motion, first and last frame, degrees from the front: what a film shows.
FILMS = {"dance": ("05_03", 0, 60, -150), "clap": ("86_09", 533, 593, -50), "hip": ("29_03", 10, 100, 20), "kick": ("135_04", 185, 245, 50), "fall": ("90_16", 85, 165, 60)}
SHEET = ("tall", "stout", "lean", "q_witch.glb", "q_spacesuit.glb", "q_knight.glb", "robot_expressive.glb")
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
        self.program, self.data, self.rigs, self.out = (os.path.abspath(p) for p in (options.program, options.data, options.rigs, options.out))
        self.folder, self.people_of_data = folder, make_characters.People(self.program, self.data, folder)

    def at(self, *names):
        return os.path.join(self.folder, *names)

    def given(self, name):
        """A stranger's character, or one of make_characters'."""
        if name not in make_characters.CHARACTERS:
            return os.path.join(self.rigs, name)
        if not os.path.exists(self.at(name + ".glb")):
            make_characters.write(self.at(name + ".glb"), *make_characters.character(self.people_of_data, *make_characters.CHARACTERS[name]))
        return self.at(name + ".glb")

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

    def films(self):
        for film in ("clap", "hip", "kick", "fall"):
            self.film(film)

    def film(self, film):
        azimuth = FILMS[film][3]
        self.performer(film)
        panels = [("source", self.at("source.glb"))]
        for title, target in (("stout", self.given("stout")), ("child, 1.0 m", self.child()), ("witch", self.given("q_witch.glb")), ("space suit", self.given("q_spacesuit.glb")),
                              ("robot", self.given("robot_expressive.glb"))):
            panels.append((title, self.at("panel%d.glb" % len(panels))))
            self.retarget(self.at("source.glb"), target, panels[-1][1], "--clip", film, *([] if target.endswith(".obj") else ["--clip-name", "film"]))
        self.write_film(film, panels, "160x240", azimuth)

    def performer(self, film, name="short"):
        """A character who performs a motion: source.glb."""
        self.retarget(self.motion(film), self.given(name), self.at("source.glb"), "--clip-name", film, "--contacts", "off")
        return self.at("source.glb")

    def dance(self):
        self.performer("dance", "lean")
        run(self.program, "view", self.at("source.glb"), "--fps", 15, "--size", "240x320", "--azimuth", FILMS["dance"][3], "--out", os.path.join(self.out, "view_dance.webp"), "--quiet")

    def beside(self, out, clouds, fps, target, *more):
        """An animation: clouds on the left, a character on the right."""
        self.retarget(clouds, self.given(target), self.at("character.glb"), "--fps", fps, "--clip-name", out.split(".")[0])
        run(self.program, "view", self.at("character.glb"), "--compare", clouds, "--source-fps", fps, *more, "--out", os.path.join(self.out, out), "--quiet")

    def readme(self):
        """Clouds of a dancing person, of another build than the character that dances beside."""
        clouds, random = self.at("clouds"), np.random.default_rng(0)
        self.retarget(self.motion("dance"), self.given("tall"), self.at("frames"), "--format", "ply", "--contacts", "off")
        os.makedirs(clouds, exist_ok=True)
        for name in sorted(os.listdir(self.at("frames"))):
            make_sample.write_cloud(os.path.join(clouds, name), make_sample.scan(*make_sample.read_ply(self.at("frames", name)), random))
        self.beside("moving.webp", clouds, 30, "strong", "--fps", 15, "--size", "560x360", "--azimuth", FILMS["dance"][3])

    def real(self, path):
        """A scan, turned 30 times by twelve degrees."""
        points = read_points(path)
        os.makedirs(self.at("turned"))
        for k in range(30):
            turn = study("any_pose").turn((0, 1, 0), 12 * k)
            make_sample.write_cloud(self.at("turned", "%02d.ply" % k), points @ turn.T)
        self.beside("real_capture.webp", self.at("turned"), 10, "slim", "--fps", 10, "--size", "600x400")

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
        import check_rig  # of --check
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
        source, rows = self.performer("dance"), []
        for name in SHEET:
            out = self.at("worst_" + name.replace(".", "_") + ".glb")
            self.retarget(source, self.given(name), out, "--clip-name", "film")
            rows.append((name, [p for f in self.worst(out) for p in (self.draw(source, "dance", f), self.draw(out, "film", f))]))
        picture = Image.new("RGB", (8 * 200 + 20, (len(rows) + 1) // 2 * 275), "white")
        for k, (name, parts) in enumerate(rows):
            left, top = k % 2 * 820, k // 2 * 275
            write_words(picture, (left + 6, top + 4), "%s: mesh most stretched; hands deepest (source, result)" % name)
            for i, part in enumerate(parts):
                picture.paste(part, (left + 200 * i, top + 25))
        picture.save(os.path.join(self.out, "characters_worst.jpg"), quality=80)

    def blender(self):
        """A dance from clouds onto two characters: a line for each."""
        lines = []
        for name in ("stout", "lean"):
            out = self.at("blender_%s.glb" % name)
            self.retarget(self.performer("dance"), self.given(name), out, "--from-surface", "--clip-name", "film")
            lines.append([self.draw(out, "film", f, "300x300") for f in (8, 22, 38, 54)])
        picture = Image.new("RGB", (1200, 600), "white")
        for k, part in enumerate(lines[0] + lines[1]):
            picture.paste(part, (k % 4 * 300, k // 4 * 300))
        picture.save(os.path.join(self.out, "character_blender.jpg"), quality=85)

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
        self.retarget(self.performer("dance"), self.at("scan.obj"), self.at("scan.glb"))
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


def read_points(path):
    """Places of a binary PLY file of x, y and z alone."""
    head, body = open(path, "rb").read().split(b"end_header\n", 1)
    count = next(int(line.split()[2]) for line in head.decode().splitlines() if line.startswith("element vertex"))
    return np.frombuffer(body, "<f4", count * 3).reshape(-1, 3).astype(float)


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
    for name in ("program", "data", "rigs", "out"):
        parser.add_argument(name)
    parser.add_argument("--only", choices=("readme", "dance", "films", "sheet", "blender", "scan"))
    parser.add_argument("--check", help="folder of check_rig.py, which the sheet needs")
    parser.add_argument("--people", help="clouds of two people: only their film is made")
    parser.add_argument("--real", help="a scan: only its picture is made")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        studio = Studio(options, folder)
        if options.people:
            return studio.people(os.path.abspath(options.people))
        if options.real:
            return studio.real(os.path.abspath(options.real))
        if options.check:
            sys.path.insert(0, os.path.abspath(options.check))
        for part in (options.only,) if options.only else ("readme", "dance", "films", "sheet", "blender", "scan"):
            getattr(studio, part)()


if __name__ == "__main__":
    main()
