"""A character as Blender shows it (docs/images/character_blender.jpg and docs/make_character_pictures.py are made of such pictures):
blender -b --python blender_picture.py -- FILE OUT.png FRAME [BONE DISTANCE] [--azimuth DEGREES] [--clip NAME] [--size WxH] [--samples N]

FILE is a GLB, of which the first animation is shown, the one that is named, or with `--clip rest` none; or an OBJ.

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
        if thing.type == "MESH" and thing.visible_get():  # the shapes of bones are hidden
            posed = thing.evaluated_get(graph)
            points += [posed.matrix_world @ v.co for v in posed.to_mesh().vertices]
            posed.to_mesh_clear()
    return [Vector(choose(p[k] for p in points) for k in range(3)) for choose in (min, max)]


def play(clip):
    """Everything plays this animation, or rests. The importer lays each animation on a track of its name."""
    for thing in [*bpy.data.objects, *bpy.data.shape_keys]:
        if thing.animation_data:
            own = [track.strips[0].action for track in thing.animation_data.nla_tracks if track.name == clip and track.strips]
            thing.animation_data_clear()
            if own:
                thing.animation_data_create().action = own[0]
        if clip == "rest" and getattr(thing, "type", "") == "ARMATURE":
            thing.data.pose_position = "REST"


def light(scene):
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"].inputs
    background[0].default_value, background[1].default_value = (0.95, 0.96, 0.98, 1), 0.9
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 2, (0.7, 0.2, 0.5)
    scene.collection.objects.link(sun)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("file")
    parser.add_argument("out")
    parser.add_argument("frame", type=int)
    parser.add_argument("bone", nargs="?")
    parser.add_argument("distance", type=float, nargs="?", default=0.8)
    parser.add_argument("--azimuth", type=float, default=-40)
    parser.add_argument("--clip")
    parser.add_argument("--size", default="480x640")
    parser.add_argument("--samples", type=int, default=32)
    o = parser.parse_args(sys.argv[sys.argv.index("--") + 1:])
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = 30  # before the import: frames are the file's
    if o.file.endswith(".obj"):
        bpy.ops.wm.obj_import(filepath=o.file)
    else:
        bpy.ops.import_scene.gltf(filepath=o.file)
    if o.clip:
        play(o.clip)
    scene = bpy.context.scene
    scene.frame_set(o.frame)
    light(scene)
    low, high = corners(scene)
    width, height = map(int, o.size.split("x"))
    wide = math.hypot(high.x - low.x, high.y - low.y) * max(1, height / width)
    at, distance = (low + high) / 2, 1.5 * max(high.z - low.z, 1.0 * wide)  # 1.4 fills Blender's usual view
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
    scene.render.engine, scene.cycles.samples = "CYCLES", o.samples
    scene.cycles.use_denoising = False
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.view_settings.view_transform = "Standard"
    scene.render.filepath = o.out
    bpy.ops.render.render(write_still=True)


main()
