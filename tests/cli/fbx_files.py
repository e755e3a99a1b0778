"""FBX files as text, made from nothing, and what they mean by FBX's own formula: what the tests compare with."""
import math

TICKS = 46186158000  # a second in FBX's units of time


# ---- 4 x 4 matrices as lists of rows ----

def product(*all_of_them):
    out = [[float(i == k) for k in range(4)] for i in range(4)]
    for m in all_of_them:
        out = [[sum(out[i][j] * m[j][k] for j in range(4)) for k in range(4)] for i in range(4)]
    return out


def moved(v):
    return [[1, 0, 0, v[0]], [0, 1, 0, v[1]], [0, 0, 1, v[2]], [0, 0, 0, 1]]


def scaled(v):
    return [[v[0], 0, 0, 0], [0, v[1], 0, 0], [0, 0, v[2], 0], [0, 0, 0, 1]]


def turned(degrees):
    """Euler angles in FBX's usual order: about x first, z last."""
    out = product()
    for axis, angle in enumerate(degrees):
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        a, b = (axis + 1) % 3, (axis + 2) % 3
        m = product()
        m[a][a], m[a][b], m[b][a], m[b][b] = c, -s, s, c
        out = product(m, out)
    return out


def transposed(m):
    return [[m[k][i] for k in range(4)] for i in range(4)]


def inverse(m):
    """Of a turn, a uniform scale and a move."""
    size = sum(m[i][0] ** 2 for i in range(3))
    turn = [[m[k][i] / size for k in range(3)] for i in range(3)]
    move = [-sum(turn[i][k] * m[k][3] for k in range(3)) for i in range(3)]
    return [turn[i] + [move[i]] for i in range(3)] + [[0, 0, 0, 1]]


def place(m):
    return [m[i][3] for i in range(3)]


class Bone:
    """A node with everything that FBX knows: offsets, pivots, rotations before and after."""

    def __init__(self, name, parent, kind="LimbNode", **values):
        self.name, self.parent, self.kind = name, parent, kind
        self.values = values  # translation, rotation, scaling, pre, post, pivot, offset; geometric_*

    def local(self, rotation=None):
        v = self.values
        pivot = v.get("pivot", (0, 0, 0))
        return product(moved(v.get("translation", (0, 0, 0))), moved(v.get("offset", (0, 0, 0))), moved(pivot), turned(v.get("pre", (0, 0, 0))),
                       turned(rotation or v.get("rotation", (0, 0, 0))), transposed(turned(v.get("post", (0, 0, 0)))),
                       moved([-x for x in pivot]), scaled(v.get("scaling", (1, 1, 1))))

    def geometry(self):
        v = self.values
        return product(moved(v.get("geometric_translation", (0, 0, 0))), turned(v.get("geometric_rotation", (0, 0, 0))),
                       scaled(v.get("geometric_scaling", (1, 1, 1))))

    def world(self, rotations=None):
        own = self.local((rotations or {}).get(self.name))
        return product(self.parent.world(rotations), own) if self.parent else own


PROPERTIES = {"translation": "Lcl Translation", "rotation": "Lcl Rotation", "scaling": "Lcl Scaling", "pre": "PreRotation", "post": "PostRotation",
              "pivot": "RotationPivot", "offset": "RotationOffset", "geometric_translation": "GeometricTranslation",
              "geometric_rotation": "GeometricRotation", "geometric_scaling": "GeometricScaling"}


def numbers(values):
    return ",".join("%d" % v if isinstance(v, int) else "%.9g" % v for v in values)


class Scene:
    """Axes and unit as the file has them; add() what it holds; text()."""

    def __init__(self, up=1, front=(2, 1), unit=1.0):
        self.settings = [("UpAxis", up), ("UpAxisSign", 1), ("FrontAxis", front[0]), ("FrontAxisSign", front[1]), ("CoordAxis", 0), ("CoordAxisSign", 1)]
        self.unit, self.objects, self.links, self.ids = unit, [], [], {}

    def add(self, kind, title, subkind, body=()):
        number = 1000 + len(self.objects)
        self.objects.append('\t%s: %d, "%s", "%s" {\n%s\t}\n' % (kind, number, title, subkind, "".join("\t\t%s\n" % line for line in body)))
        return number

    @staticmethod
    def array(name, values):
        return "%s: *%d {\n\t\t\ta: %s\n\t\t}" % (name, len(values), numbers(values))

    def link(self, child, parent, what=None):
        self.links.append('\tC: "%s",%d,%d%s\n' % ("OP" if what else "OO", child, parent, ', "%s"' % what if what else ""))

    def bone(self, bone):
        lines = ["Version: 232", "Properties70:  {", '\tP: "RotationActive", "bool", "", "",1']
        for name, value in bone.values.items():
            lines.append('\tP: "%s", "Vector3D", "Vector", "",%s' % (PROPERTIES[name], numbers(map(float, value))))
        self.ids[bone.name] = number = self.add("Model", "Model::" + bone.name, bone.kind, lines + ["}"])
        self.link(number, self.ids[bone.parent.name] if bone.parent else 0)
        return number

    def mesh(self, bone, vertices, polygons, weights=None, shapes=()):
        """`weights`: pairs (bone, {vertex: weight}); `shapes`: pairs (name, {vertex: shift})."""
        self.bone(bone)
        corners = [i for polygon in polygons for i in list(polygon[:-1]) + [-polygon[-1] - 1]]
        geometry = self.add("Geometry", "Geometry::" + bone.name, "Mesh",
                            [self.array("Vertices", [float(x) for v in vertices for x in v]), self.array("PolygonVertexIndex", corners), "GeometryVersion: 124",
                             'LayerElementMaterial: 0 {\n\t\t\tMappingInformationType: "AllSame"\n\t\t\tReferenceInformationType: "IndexToDirect"\n'
                             "\t\t\tMaterials: *1 {\n\t\t\ta: 0\n\t\t}\n\t\t}",
                             'Layer: 0 {\n\t\t\tLayerElement:  {\n\t\t\t\tType: "LayerElementMaterial"\n\t\t\t\tTypedIndex: 0\n\t\t\t}\n\t\t}'])
        self.link(geometry, self.ids[bone.name])
        if weights:
            skin = self.add("Deformer", "Deformer::", "Skin", ["Version: 101"])
            self.link(skin, geometry)
            for owner, of_vertex in weights:
                link = owner.world()
                cluster = self.add("Deformer", "SubDeformer::", "Cluster",
                                   ["Version: 100", self.array("Indexes", list(of_vertex)), self.array("Weights", [float(x) for x in of_vertex.values()]),
                                    self.array("Transform", self.columns(product(inverse(link), bone.world()))), self.array("TransformLink", self.columns(link))])
                self.link(cluster, skin)
                self.link(self.ids[owner.name], cluster)
        blend = self.add("Deformer", "Deformer::", "BlendShape", ["Version: 100"]) if shapes else None
        if blend:
            self.link(blend, geometry)
        for name, shifts in shapes:
            channel = self.add("Deformer", "SubDeformer::" + name, "BlendShapeChannel", ["Version: 100", "DeformPercent: 0", self.array("FullWeights", [100.0])])
            shape = self.add("Geometry", "Geometry::" + name, "Shape",
                             ["Version: 100", self.array("Indexes", list(shifts)), self.array("Vertices", [float(x) for v in shifts.values() for x in v]),
                              self.array("Normals", [0.0] * 3 * len(shifts))])
            self.link(channel, blend)
            self.link(shape, channel)
        return geometry

    def picture(self, bone, name, text=None):
        """A material of the mesh `bone` whose colour is a picture: a file of this name, or `text` in quotes."""
        material = self.add("Material", "Material::Cloth", "", ["Version: 102", 'ShadingModel: "phong"'])
        texture = self.add("Texture", "Texture::" + name, "", ['FileName: "C:\\else\\%s"' % name, 'RelativeFilename: "..\\%s"' % name])
        video = self.add("Video", "Video::" + name, "Clip", ['Type: "Clip"', 'FileName: "%s"' % name, 'RelativeFilename: "%s"' % name] + (
            ['Content: "%s"' % text] if text else []))
        self.link(material, self.ids[bone])
        self.link(texture, material, "DiffuseColor")
        self.link(video, texture)

    @staticmethod
    def columns(m):
        return [float(m[i][k]) for k in range(4) for i in range(4)]

    def clip(self, name, keys, seconds):
        """`keys`: {name of a bone: [Euler angles a key]}, evenly over `seconds`."""
        stack = self.add("AnimationStack", "AnimStack::" + name, "", ["Properties70:  {", '\tP: "LocalStop", "KTime", "Time", "",%d' % (seconds * TICKS), "}"])
        layer = self.add("AnimationLayer", "AnimLayer::BaseLayer", "")
        self.link(layer, stack)
        for bone, angles in keys.items():
            node = self.add("AnimationCurveNode", "AnimCurveNode::R", "", ["Properties70:  {"] + [
                '\tP: "d|%s", "Number", "", "A",%.9g' % (axis, value) for axis, value in zip("XYZ", angles[0])] + ["}"])
            self.link(node, layer)
            self.link(node, self.ids[bone], "Lcl Rotation")
            times = [int(round(seconds * TICKS * k / (len(angles) - 1))) for k in range(len(angles))]
            for axis, letter in enumerate("XYZ"):
                curve = self.add("AnimationCurve", "AnimCurve::", "",
                                 ["Default: 0", "KeyVer: 4008", self.array("KeyTime", times), self.array("KeyValueFloat", [float(a[axis]) for a in angles]),
                                  self.array("KeyAttrFlags", [24836]), self.array("KeyAttrDataFloat", [0.0] * 4), self.array("KeyAttrRefCount", [len(times)])])
                self.link(curve, node, "d|" + letter)

    def text(self):
        settings = "".join('\t\tP: "%s", "int", "Integer", "",%d\n' % pair for pair in self.settings)
        return ('; FBX 7.4.0 project file\nFBXHeaderExtension:  {\n\tFBXHeaderVersion: 1003\n\tFBXVersion: 7400\n\tCreator: "a test"\n}\n'
                "GlobalSettings:  {\n\tVersion: 1000\n\tProperties70:  {\n" + settings +
                '\t\tP: "UnitScaleFactor", "double", "Number", "",%g\n\t\tP: "TimeMode", "enum", "", "",6\n\t}\n}\n' % self.unit +
                "Objects:  {\n" + "".join(self.objects) + "}\nConnections:  {\n" + "".join(self.links) + "}\n")
