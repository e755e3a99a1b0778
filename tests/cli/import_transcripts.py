#!/usr/bin/env python3
"""Writes docs/notes/import_transcripts.md: every importer's command and what it prints.

    python3 tests/cli/import_transcripts.py BUILD_DIR DATA_FOLDER > docs/notes/import_transcripts.md

Commands run as they stand there, in a folder in which `data` is the data folder (docs/formats.md) and
`samples` what BUILD_DIR/tests/make_samples wrote. test_import.py runs those of the samples."""
import os
import shlex
import subprocess
import sys
import tempfile

# Title, what the file is, command. A command that ends in "# exit 2" is refused.
CASES = [
    ("Bodies and motions of a data folder", "All of MakeHuman's bodies and CMU's clips at once",
     "restage data import data --out real.h5"),
    ("BVH: CMU, Daz release", "",
     "restage data import data/cmu/bvh/02_01.bvh.xz --out walk.h5"),
    ("BVH: CMU's own skeleton", "",
     "restage data import data/cmu/bvh_original_skeleton/01_01.bvh.xz --out climb.h5"),
    ("BVH: MakeHuman", "", "restage data import data/foreign/makehuman_walk1.bvh.xz --out walk.h5"),
    ("BVH: MakeHuman, default rig", "One frame, which is no motion but a pose",
     "restage data import data/foreign/makehuman_benchmark.bvh.xz --out pose.h5"),
    ("BVH: PyMO, another Mixamo-like skeleton", "Apparently in inches; nothing in the file says so",
     "restage data import data/foreign/pymo_walk_meredith.bvh.xz --out walk.h5"),
    ("BVH: nobody", "A test chain of four joints",
     "restage data import data/foreign/fairmotion_sinusoidal.bvh.xz --out chain.h5  # exit 2"),
    ("BVH: a folder", "With one file whose root is broken (07_12)",
     "restage data import data/cmu/bvh --subject cmu --license 'free, see mocap.cs.cmu.edu' --out cmu.h5"),
    ("ASF/AMC", "The skeleton is found beside the recording",
     "restage data import data/cmu/asfamc/02_01.amc.xz --subject 02 --out walk.h5"),
    ("BVH: Mixamo", "Made by the tests: a toy that walks",
     "restage data import samples/mixamo.bvh --out walk.h5"),
    ("BVH: LAFAN1", "Made by the tests: the same toy, all bones along +x at zero rotations",
     "restage data import samples/lafan1.bvh --out walk.h5"),
    ("BVH: 100STYLE", "Made by the tests", "restage data import samples/100style.bvh --out walk.h5"),
    ("BVH: SOMA", "Made by the tests", "restage data import samples/soma.bvh --out walk.h5"),
    ("AMASS", "Made by the tests: a clip in SMPL-H's layout, one in SMPL-X's, a shape without motion",
     "restage data import samples/AMASS --body-model samples/models --license AMASS --verbose --out amass.h5"),
    ("SMPL bodies", "Made by the tests: SMPL-X, the mean person and one of AMASS's shapes",
     "restage data import samples/models/SMPLX_NEUTRAL.npz --betas zeros samples/AMASS/ben/shape.npz --verbose --out bodies.h5"),
    ("glTF: Mixamo", "Made by the tests, as Blender exports it: z up and centimetres below an armature",
     "restage data import samples/mixamo.glb --license CC0-1.0 --out hero.h5"),
    ("glTF: Unreal", "Made by the tests: A-pose, twist bones, centimetres",
     "restage data import samples/unreal.glb --out hero.h5"),
    ("glTF: VRM", "Made by the tests: bones by VRM's list, facing backwards",
     "restage data import samples/hero.vrm --out hero.h5"),
    ("Scans: folders of PLY, as 4D-DRESS", "Made by the tests",
     "restage data import samples/4D-DRESS --out scans.h5"),
    ("Scans: folders of NPZ, as CAPE", "Made by the tests",
     "restage data import samples/CAPE --fps 60 --out scans.h5"),
    ("Scans: arrays", "Made by the tests",
     "restage data import samples/walk.npy --fps 25 --out scans.h5"),
]

HEAD = """# What the importers say

Every importer's command and what it prints, of real files where they may be passed on ([formats.md](../formats.md) says where
they come from), else of small ones in the style of a data set that the tests write themselves (`make_samples`). Made by

```
python3 tests/cli/import_transcripts.py BUILD_DIR DATA_FOLDER > docs/notes/import_transcripts.md
```
"""


def prepare(folder, make_samples, data=None):
    """What the commands need, in `folder`."""
    subprocess.run([make_samples, os.path.join(folder, "samples")], check=True)
    if data:
        os.symlink(os.path.abspath(data), os.path.join(folder, "data"))


def run(program, folder, command):
    """(exit code, what a terminal would show)."""
    words = shlex.split(command, comments=True)
    done = subprocess.run([program, *words[1:]], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return done.returncode, done.stdout


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    build = os.path.abspath(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        prepare(folder, os.path.join(build, "tests", "make_samples"), sys.argv[2])
        page = HEAD
        for title, what, command in CASES:
            code, text = run(os.path.join(build, "restage"), folder, command)
            if code != (2 if command.endswith("# exit 2") else 0):
                sys.exit(f"{command}: exit code {code}\n{text}")
            page += f"\n## {title}\n\n{what or 'A real file'}.\n\n```\n$ {command}\n{text.rstrip()}\n```\n"
        print(page, end="")


if __name__ == "__main__":
    main()
