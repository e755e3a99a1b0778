"""The shared cases of skeletons, bone names and characters: files as users bring them, with the true joints."""
import os

from cases import CASES, CaseTest, WEIGHTS


class SkeletonCases(CaseTest):
    def test_recordings(self):
        for case, *options in (("b02_spine3",), ("b04_mixamorig_no_colon",), ("b06_genea",), ("b07_bandai",), ("b08b_frametime_0", "--fps", 30),
                               ("b09_prefix_two_parts",), ("b09c_long_namespace",), ("b09d_japanese", "--bones", "mmd.yaml"),
                               ("b09d_japanese", "--profile", "mmd.yaml"), ("b09d_japanese",), ("b11_thigh_L",),
                               ("t02_yml", "--profile", "mine.YML"), ("t02_yml", "--bones", "mine.YML")):
            with self.subTest(case=case, options=options):
                self.enter(case)
                self.expect_true(["data", "import", "walk.bvh", *options, "--out", "out.h5"])
        self.bad_input(["data", "import", "walk.bvh", "--out", "x.h5"], "walk.bvh", "'b_0'", "--bones")
        self.enter("b08b_frametime_0")
        self.bad_input(["data", "import", "walk.bvh", "--out", "x.h5"], "walk.bvh:", "--fps")

    def test_characters(self):
        for case, bodies in (("g02_sketchfab", 1), ("g03_blender_001", 1), ("g03b_head_001", 1), ("g04b_no_colon_and_sword", 1), ("g08_cc", 1)):
            with self.subTest(case=case):
                self.enter(case)
                self.expect_true(["data", "import", "hero.glb", "--out", "out.h5"])
                self.assertEqual(self.json("data", "inspect", "out.h5")["counts"]["bodies"], bodies)

    def test_vrm_animation(self):
        self.enter("g07_vrma")
        for name in ("walk.vrma", "walk.glb"):
            with self.subTest(name=name):
                self.expect_true(["data", "import", name, "--out", "out.h5"])
        self.bad_input(["retarget", "--source", "walk.vrma", "--target", "walk.glb", "--out", "x.h5"], "walk.glb", "no mesh")
        self.enter("t01_rig_targets")
        walk = os.path.join(CASES, "g07_vrma", "walk.vrma")
        self.done("retarget", "--source", walk, "--target", "apose_sketchfab.glb", "--out", "out.glb")
        self.assertEqual(self.json("data", "import", "out.glb", "--out", "out.h5")["motions"], 1)

    def test_two_characters(self):
        self.enter("x02_two_characters")
        self.bad_input(["data", "import", "two.glb", "--out", "out.h5"], "two.glb", "2 characters")
        self.write("src/f0.ply", b"")
        self.bad_input(["retarget", "--source", "src", "--target", "two.glb", "--weights", WEIGHTS, "--out", "x.h5"], "two.glb", "2 characters")

    def test_rigged_target(self):
        self.enter("t01_rig_targets")
        call = ["retarget", "--source", "src", "--target", "apose_sketchfab.glb", "--weights", WEIGHTS, "--out", "out.h5"]
        self.done(*call)
        plain = self.bytes("out.h5")
        self.done(*call, "--bones", "names.yaml")
        self.assertEqual(self.bytes("out.h5"), plain)
