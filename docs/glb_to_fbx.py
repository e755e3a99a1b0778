"""Turns a GLB into FBX with Blender, for programs that read no glTF:

    blender -b --python docs/glb_to_fbx.py -- hero_dancing.glb hero_dancing.fbx

Names, hierarchy, skin, morph targets, pictures (inside the FBX) and all animations go over, at 30 frames a second."""
import os
import sys
import tempfile

import bpy


def convert(glb, fbx):
    import numpy  # Blender's glTF needs it, too
    if "bool" not in vars(numpy):  # Blender 3.4 beside numpy 1.24 or later, as in Debian 12
        numpy.bool = bool
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = 30  # before the import: keys fall on whole frames
    bpy.ops.import_scene.gltf(filepath=glb)
    with tempfile.TemporaryDirectory() as folder:
        for number, image in enumerate(bpy.data.images):  # FBX takes pictures from files
            if image.packed_file is not None:
                kind = "jpg" if image.file_format == "JPEG" else "png"
                image.filepath_raw = os.path.join(folder, "%02d_%s.%s" % (number, bpy.path.clean_name(image.name), kind))
                image.save()
        bpy.ops.export_scene.fbx(filepath=fbx, add_leaf_bones=False, bake_anim_simplify_factor=0, path_mode="COPY",
                                 embed_textures=True)


try:
    convert(*sys.argv[sys.argv.index("--") + 1:])
except Exception as error:  # Blender itself would end with 0
    sys.exit("glb_to_fbx: %s" % error)
