"""Opens GLB files in Blender and looks whether its bones are where they must be:
blender -b --python blender_open.py -- FOLDER, which holds X.glb with X.glb.json ({"seconds": t, "bones": {name: [x, y, z]}}, metres, y up).
Exit code 0: all are within a millimetre."""
import glob
import json
import os
import sys

import bpy
import numpy

if not hasattr(numpy, "bool"):
    numpy.bool = bool  # Blender 3.4's importer wants what Debian's NumPy no longer has


def check(path):
    with open(path + ".json") as file:
        wanted = json.load(file)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=path)
    armature, = [thing for thing in bpy.data.objects if thing.type == "ARMATURE"]
    scene = bpy.context.scene
    frame = wanted["seconds"] * scene.render.fps / scene.render.fps_base
    scene.frame_set(int(frame), subframe=frame - int(frame))
    worst = 0
    for name, (x, y, z) in wanted["bones"].items():
        head = armature.matrix_world @ armature.pose.bones[name].head
        worst = max(worst, numpy.linalg.norm(numpy.array(head) - (x, -z, y)))  # Blender has z up
    print("%s in Blender %s: %d bones, at most %.3f mm off" % (os.path.basename(path), bpy.app.version_string, len(armature.data.bones), 1e3 * worst))
    return worst < 1e-3


files = [name[:-5] for name in sorted(glob.glob(os.path.join(sys.argv[sys.argv.index("--") + 1], "*.glb.json")))]
try:
    fine = [check(path) for path in files]
except Exception as error:  # Blender would print it and exit with 0
    print(error)
    fine = [False]
sys.exit(0 if fine and all(fine) else 1)
