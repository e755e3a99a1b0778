"""Turns a GLB into FBX with Blender, for programs that read no glTF:

    blender -b --python docs/glb_to_fbx.py -- hero_dancing.glb hero_dancing.fbx [ANIMATION]

Names, hierarchy, skin, morph targets and pictures (inside the FBX) go over, and one animation, at 30 frames a second: the one of
this name, else the last, which is the one that `restage retarget` added. It is the file's only take, and has the animation's name."""
import json
import os
import struct
import sys
import tempfile

import bpy


def animation_of(glb, wanted):
    """The name of the animation that is to go over; empty: the file has none."""
    with open(glb, "rb") as file:
        start = file.read(20)
        text = file.read(struct.unpack("<I", start[12:16])[0]) if start[:4] == b"glTF" else start + file.read()
    names = [animation.get("name", "") for animation in json.loads(text).get("animations", [])]
    if wanted and wanted not in names:
        raise ValueError("%s has no animation '%s', but %s" % (glb, wanted, ", ".join(names) or "none"))
    name = wanted or (names[-1] if names else "")
    if names and (not name or len(name.encode()) > 63):
        raise ValueError("%s: Blender keeps no name of %d bytes; give its animation one of 1 to 63 with --clip-name" % (glb, len(name.encode())))
    return name


def keep_one(name):
    """Every object and every set of shape keys plays the animation `name` or nothing, and the scene, which FBX makes one take of,
    is called like it and as long. The importer lays each animation on a track of its name."""
    ends = []
    for owner in [*bpy.data.objects, *bpy.data.shape_keys]:
        tracks = owner.animation_data.nla_tracks if owner.animation_data else []
        own = next((track.strips[0].action for track in tracks if track.name == name and track.strips), None)
        owner.animation_data_clear()
        if own:
            owner.animation_data_create().action = own
            ends.append(own.frame_range)
    if not ends:
        raise ValueError("Blender found no key of the animation '%s'" % name)
    scene = bpy.context.scene
    scene.name = name
    scene.frame_start, scene.frame_end = (int(round(value)) for value in (min(e[0] for e in ends), max(e[1] for e in ends)))


def convert(glb, fbx, wanted=""):
    import numpy  # Blender's glTF needs it, too
    if "bool" not in vars(numpy):  # Blender 3.4 beside numpy 1.24 or later, as in Debian 12
        numpy.bool = bool
    name = animation_of(glb, wanted)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = 30  # before the import: keys fall on whole frames
    bpy.ops.import_scene.gltf(filepath=glb)
    if name:
        keep_one(name)
    with tempfile.TemporaryDirectory() as folder:
        for number, image in enumerate(bpy.data.images):  # FBX takes pictures from files
            if image.packed_file is not None:
                kind = "jpg" if image.file_format == "JPEG" else "png"
                image.filepath_raw = os.path.join(folder, "%02d_%s.%s" % (number, bpy.path.clean_name(image.name), kind))
                image.save()
        # Factor 0 would key shapes and objects that stay as they are, too.
        bpy.ops.export_scene.fbx(filepath=fbx, add_leaf_bones=False, bake_anim=bool(name), bake_anim_use_nla_strips=False,
                                 bake_anim_use_all_actions=False, bake_anim_simplify_factor=1e-6, path_mode="COPY", embed_textures=True)


try:
    convert(*sys.argv[sys.argv.index("--") + 1:])
except Exception as error:  # Blender itself would end with 0
    sys.exit("glb_to_fbx: %s" % error)
