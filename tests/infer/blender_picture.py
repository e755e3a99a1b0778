"""A character as Blender shows it (docs/images/character_blender.jpg is made of such pictures):
blender -b --python blender_picture.py -- FILE.glb OUT.png FRAME [BONE DISTANCE] [--azimuth DEGREES]

The camera looks at the whole character, or from DISTANCE metres at the head of the bone whose name ends in BONE. Cycles draws, which needs
no display."""
import argparse
import math
import sys

import bpy
import numpy
from mathutils import Vector

if not hasattr(numpy, "bool"):
    numpy.bool = bool  # Blender 3.4's importer wants what Debian's NumPy no longer has


def corners(scene):
    """Least and greatest coordinates of all meshes as they are posed."""
    graph = bpy.context.evaluated_depsgraph_get()
    points = []
    for thing in scene.objects:
        if thing.type == "MESH" and any(m.type == "ARMATURE" for m in thing.modifiers):
            posed = thing.evaluated_get(graph)
            points += [posed.matrix_world @ v.co for v in posed.to_mesh().vertices]
            posed.to_mesh_clear()
    return [Vector(choose(p[k] for p in points) for k in range(3)) for choose in (min, max)]


def light(scene):
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"].inputs
    background[0].default_value, background[1].default_value = (0.9, 0.9, 0.95, 1), 0.7
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 2.5, (0.7, 0.2, 0.5)
    scene.collection.objects.link(sun)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("file")
    parser.add_argument("out")
    parser.add_argument("frame", type=int)
    parser.add_argument("bone", nargs="?")
    parser.add_argument("distance", type=float, nargs="?", default=0.8)
    parser.add_argument("--azimuth", type=float, default=-40)
    o = parser.parse_args(sys.argv[sys.argv.index("--") + 1:])
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=o.file)
    scene = bpy.context.scene
    scene.frame_set(o.frame)
    light(scene)
    low, high = corners(scene)
    at, distance = (low + high) / 2, 2.1 * (high.z - low.z)
    if o.bone:
        armature, = [thing for thing in scene.objects if thing.type == "ARMATURE"]
        bone = [b for b in armature.pose.bones if b.name.endswith(o.bone)][0]
        at, distance = armature.matrix_world @ bone.head, o.distance
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    turn = math.radians(o.azimuth)
    camera.location = at + distance * Vector((math.sin(turn), -math.cos(turn), 0.15))
    camera.rotation_euler = (at - camera.location).to_track_quat("-Z", "Y").to_euler()
    scene.render.engine, scene.cycles.samples = "CYCLES", 32
    scene.cycles.use_denoising = False
    scene.render.resolution_x, scene.render.resolution_y = 480, 640
    scene.render.filepath = o.out
    bpy.ops.render.render(write_still=True)


main()
