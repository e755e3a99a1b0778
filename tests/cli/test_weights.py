"""restage info and restage weights."""
import json
import os
import random
import struct

from support import ROOT, CliTest, points, small_disk

COUNTS = {"skeleton/point_transformer": 9585730, "skeleton/pointnet": 1620811, "smrm/rot6d": 5793927, "smrm/quaternion": 5771355,
          "smrm/discriminator": 280285, "deformation/weights": 89366, "deformation/offsets": 84483, "deformation/root": 83715,
          "deformation/v1_field": 88598}
OFFSETS = {"fc1.weight": [256, 69], "fc1.bias": [256], "fc2.weight": [256, 256], "fc2.bias": [256], "fc3.weight": [3, 256], "fc3.bias": [3]}


def tensors(shapes, seed=0, prefix=""):
    """A safetensors file of float32 numbers."""
    r, head, data = random.Random(seed), {}, b""
    for name, shape in shapes.items():
        count = 1
        for n in shape:
            count *= n
        blob = struct.pack("<%df" % count, *(r.uniform(-1, 1) for _ in range(count)))
        head[prefix + name] = {"dtype": "F32", "shape": shape, "data_offsets": [len(data), len(data) + len(blob)]}
        data += blob
    text = json.dumps(head).encode()
    return struct.pack("<Q", len(text)) + text + data


class Info(CliTest):
    def test_counts_add_up(self):
        for model, count in COUNTS.items():
            found = self.json("info", model)
            self.assertEqual((found["model"], found["parameters"]), (model, count))
            self.assertEqual(sum(m["parameters"] for m in found["modules"]), count)
            self.assertTrue(all(m["parameters"] > 0 and set(m) == {"name", "kind", "output", "parameters"} for m in found["modules"]))
            self.assertIn(str(count), self.done("info", model))

    def test_a_recurrent_layer_gives_its_state(self):
        for model, layer, width in (("transfer/tst", "lstm", 256), ("smrm/rot6d", "enc", 512)):
            found = {m["name"]: m["output"] for m in self.json("info", model)["modules"]}
            self.assertEqual(found[layer], "[..., %d]" % width)

    def test_unknown_model(self):
        self.bad_input(["info", "smrm/rot6"], "smrm/rot6d")
        self.bad_input(["info", "nope"], "restage info --help")


class Weights(CliTest):
    def test_what_is_shipped_fits_this_program(self):
        self.ply("a.ply", points(300, 1))
        for name in ("lite", "standard"):
            shipped = os.path.join(ROOT, "experiments", "weights", name + ".safetensors")
            found = self.json("skeleton", "--weights", shipped, "--source", "a.ply")["frames"]
            self.assertEqual(len(found[0]["joints"]), 22, name)

    def test_list_names_all_shipped_weights(self):
        folder = os.path.join(ROOT, "experiments", "weights")
        listed = self.json("weights", "list")
        names = {row["name"] for row in listed["weights"]}
        self.assertEqual(names, {f[:-len(".safetensors")] for f in os.listdir(folder) if f.endswith(".safetensors")})
        for row in listed["weights"]:
            self.assertEqual(row["bytes"], os.path.getsize(row["file"]))
            self.assertEqual(row["joints"], "makehuman")
        for row in listed["captures"]:
            self.assertIn(row["weights"].split(",")[0].split()[0], names | {"none"})
        text = self.done("weights", "list")
        for word in ("one depth camera", "43.5", "standard", "makehuman", "8.4"):
            self.assertIn(word, text)

    def test_show_takes_names_and_says_which_file(self):
        for name in ("lite", "standard"):
            shown = self.json("weights", "show", name)
            self.assertEqual(os.path.basename(shown["file"]), name + ".safetensors")
            self.assertTrue(shown["tensors"])
        self.bad_input(["weights", "show", "nonsense"], "nonsense", "no weights of this name")

    def test_out_and_in_again(self):
        self.write("o.safetensors", tensors(OFFSETS))
        self.done("weights", "import", "--source", "o.safetensors", "--model", "deformation/offsets", "--out", "w.safetensors")
        shown = self.json("weights", "show", "w.safetensors")
        self.assertEqual(shown["metadata"]["restage"]["models"]["deformation.offsets"]["model"], "deformation/offsets")
        self.assertEqual({t["name"]: t["shape"] for t in shown["tensors"]}, {"deformation.offsets." + k: v for k, v in OFFSETS.items()})
        self.done("weights", "export", "--source", "w.safetensors", "--model", "deformation/offsets", "--out", "back.safetensors")
        self.done("weights", "import", "--source", "back.safetensors", "--model", "deformation/offsets", "--out", "again.safetensors")
        self.assertEqual(self.bytes("w.safetensors"), self.bytes("again.safetensors"))
        self.assertIn("fc2.weight", self.done("weights", "show", "back.safetensors"))

    def test_name_map_and_second_model(self):
        self.write("o.safetensors", tensors(OFFSETS))
        self.write("foreign.safetensors", tensors(dict(OFFSETS, step=[1]), 1, "net/"))
        self.write("names.yaml", "net/step: ~\n'net/*': '*'\n")
        self.done("weights", "import", "--source", "o.safetensors", "--model", "deformation/offsets", "--out", "w.safetensors")
        wide = dict(OFFSETS, **{"fc3.weight": [22, 256], "fc3.bias": [22]})
        self.write("w_net.safetensors", tensors(wide, 2))
        self.done("weights", "import", "--source", "w_net.safetensors", "--model", "deformation/weights", "--with", "w.safetensors", "--out", "w.safetensors")
        self.done("weights", "import", "--source", "foreign.safetensors", "--map", "names.yaml", "--model", "deformation/offsets",
                  "--with", "w.safetensors", "--out", "w.safetensors")
        self.assertEqual(len(self.json("weights", "show", "w.safetensors")["tensors"]), 12)

    def test_everything_that_does_not_fit_is_listed(self):
        shapes = dict(OFFSETS, **{"fc1.weight": [256, 68], "else": [2]})
        del shapes["fc2.bias"], shapes["fc3.bias"]
        self.write("o.safetensors", tensors(shapes))
        arguments = ["weights", "import", "--source", "o.safetensors", "--model", "deformation/offsets", "--out", "w.safetensors"]
        result = self.restage(*arguments)
        self.one_line(result, 2, "o.safetensors", "2 missing", "1 unexpected", "1 unfit")
        for name in ("fc2.bias", "fc3.bias", "else", "fc1.weight: [256, 68] instead of [256, 69]"):
            self.assertIn(name, result.out)
        listed = json.loads(self.restage(*arguments, "--json").out)
        self.assertEqual(listed["missing"], ["fc2.bias", "fc3.bias"])
        self.assertFalse(os.path.exists(self.path("w.safetensors")))

    def test_between_two_files(self):
        def values(name):
            blob = self.bytes(name)
            size = struct.unpack("<Q", blob[:8])[0]
            head = json.loads(blob[8:8 + size])
            return {key: struct.unpack("<%df" % ((b - a) // 4), blob[8 + size + a:8 + size + b])
                    for key, (a, b) in ((k, v["data_offsets"]) for k, v in head.items() if k != "__metadata__")}

        shapes = {"a": [2, 3], "b": [4]}
        self.write("x.safetensors", tensors(shapes, 1))
        self.write("y.safetensors", tensors(shapes, 2))
        call = ["weights", "average", "--source", "x.safetensors", "--other", "y.safetensors"]
        x, y = values("x.safetensors"), values("y.safetensors")
        for share in (0, 0.75, 1):
            self.done(*call, "--share", str(share), "--out", "m.safetensors")
            m = values("m.safetensors")
            self.assertEqual(set(m), set(x))
            for key in x:
                for a, b, c in zip(x[key], y[key], m[key]):
                    self.assertAlmostEqual((1 - share) * a + share * b, c, 6)
        self.assertEqual(m, y)
        self.done(*call, "--out", "m.safetensors")
        self.assertAlmostEqual(values("m.safetensors")["b"][0], (x["b"][0] + y["b"][0]) / 2, 6)
        for other in ({"a": [2, 3]}, {"a": [3, 2], "b": [4]}, {**shapes, "c": [1]}):
            self.write("z.safetensors", tensors(other))
            self.bad_input(["weights", "average", "--source", "x.safetensors", "--other", "z.safetensors", "--out", "n.safetensors"],
                           "z.safetensors", "same models and sizes")
        self.bad_input([*call, "--share", "1.5", "--out", "n.safetensors"], "--share 1.5", "0 to 1")
        self.bad_input([*call, "--out", "x.safetensors"], "x.safetensors")
        self.assertFalse(os.path.exists(self.path("n.safetensors")))

    def test_bad_input(self):
        good = self.write("o.safetensors", tensors(OFFSETS))
        cut = self.write("cut.safetensors", tensors(OFFSETS)[:5000])
        into = ["--model", "deformation/offsets", "--out", "w.safetensors"]
        self.bad_input(["weights", "show", "none.safetensors"], "none.safetensors")
        self.bad_input(["weights", "show", cut], cut)
        self.bad_input(["weights", "import", "--source", cut, *into], cut)
        self.bad_input(["weights", "import", "--source", good, "--model", "deformation/offset", "--out", "w.safetensors"], "deformation/offsets")
        self.bad_input(["weights", "import", "--source", good, "--map", self.write("m.yaml", "[1]"), *into], "m.yaml")
        self.bad_input(["weights", "import", "--source", good, "--size", "widht=3", *into], "did you mean 'width'")
        for value in (-5, 0):
            self.bad_input(["weights", "import", "--source", good, "--size=width=%d" % value, *into], "width", "from 1 to")
        self.bad_input(["weights", "export", "--source", good, "--model", "smrm", "--out", "s.safetensors"], good)
        self.bad_input(["weights", "import", "--source", good, "--model", "deformation/offsets", "--out", "nowhere/w.safetensors"], "nowhere")

    def test_full_disk(self):
        self.write("o.safetensors", tensors(OFFSETS))
        result = self.restage("weights", "import", "--source", "o.safetensors", "--model", "deformation/offsets", "--out", "w.safetensors", before=small_disk)
        self.one_line(result, 1, "w.safetensors")
