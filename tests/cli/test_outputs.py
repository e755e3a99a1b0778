"""What every command owes to files: what it reads stays, what it writes appears whole or not at all."""
import json
import os
import shutil
import signal
import socket
import stat
import subprocess
import time

from support import PROGRAM, CliTest, points
from test_arrays import clip, cloud, npy, npz, smplh
from test_data import toy_bvh
from test_weights import OFFSETS, tensors
from tiny_run import weights


class InputsStay(CliTest):
    """An output that is one of the inputs, or lies over one, is refused."""

    def stays(self, name, *arguments):
        before = self.bytes(name)
        self.bad_input(arguments, "inputs", "write to another")
        self.assertEqual(self.bytes(name), before)

    def test_import(self):
        self.write("walk.bvh", toy_bvh())
        os.symlink("walk.bvh", self.path("link.h5"))
        os.link(self.path("walk.bvh"), self.path("twin.h5"))
        for out in ("walk.bvh", "../%s/walk.bvh" % os.path.basename(self.folder), "link.h5", "twin.h5"):
            self.stays("walk.bvh", "data", "import", "walk.bvh", "--out", out)
        for name in ("many/1.bvh", "many/2.bvh"):
            self.write(name, toy_bvh())
        self.stays("many/2.bvh", "data", "import", "many", "--out", "many/2.bvh")
        for i in (1, 2):
            self.ply("scans/take/%d.ply" % i, points(80, i))
        self.stays("scans/take/2.ply", "data", "import", "scans", "--out", "scans/take/2.ply")
        self.write("models/SMPLH_MALE.npz", smplh())
        self.write("amass/ann/a_poses.npz", clip())
        self.write("people.npz", npz(betas=npy((2,), [1.0, -1.0])))
        amass = ("data", "import", "amass", "--body-model", "models", "--out")
        self.stays("amass/ann/a_poses.npz", *amass, "amass/ann/a_poses.npz")
        self.stays("models/SMPLH_MALE.npz", *amass, "models/SMPLH_MALE.npz")
        self.stays("people.npz", "data", "import", "models/SMPLH_MALE.npz", "--betas", "people.npz", "--out", "people.npz")
        self.done("data", "import", "many", "--out", "many/all.h5")
        self.done("data", "import", "many", "--out", "many/all.h5")  # an earlier result is no input

    def test_data(self):
        for name in ("a", "b"):
            self.write(name + ".bvh", toy_bvh())
            self.done("data", "import", name + ".bvh", "--out", name + ".h5")
        self.stays("a.h5", "data", "merge", "a.h5", "b.h5", "--out", "a.h5")
        self.done("data", "build", "--bodies", 0, 0, 1, "--motions", 0, 0, 1, "--quiet", "--out", "data.png")
        self.stays("data.png", "data", "sheet", "data.png", "--out", "data.png")
        self.stays("data.png", "data", "inspect", "data.png", "--plot", "data.png")
        self.write("walk/truth.h5", self.bytes("data.png"))
        self.stays("walk/truth.h5", "data", "perform", "--bodies", "walk/truth.h5", "--out", "walk")

    def test_retarget_and_its_kin(self):
        w = shutil.copy(weights("tiny"), self.path("w.h5"))
        for i in range(3):
            self.ply("frames/frame_%06d.ply" % i, points(90, i))
        self.ply("hero.ply", points(90, 7))
        retarget = ("retarget", "--force", "--weights", "w.h5", "--source")
        self.stays("frames/frame_000000.ply", *retarget, "frames", "--target", "hero.ply", "--out", "frames/")
        self.stays("frames/frame_000000.ply", *retarget, "hero.ply", "--target", "frames/frame_000000.ply", "--out", "frames")
        self.stays("w.h5", *retarget, "frames", "--target", "hero.ply", "--out", "w.h5")
        self.stays("frames/frame_000001.ply", "skeleton", "--weights", w, "--source", "frames", "--out", "frames/frame_000001.ply")
        self.h5("rest.h5", joints=([1, 22, 3], [0.0]))
        self.stays("rest.h5", "retarget", "--system", "register", "--source", "frames", "--target", "hero.ply", "--rest", "rest.h5", "--out", "rest.h5")
        self.done("doctor", "frames", "--fix", "scans.h5", "--up", "y", "--scale", "0.3")
        shutil.copy(self.path("scans.h5"), self.path("scans.png"))
        self.stays("scans.png", "render", "scans.png", "--out", "scans.png")
        self.stays("scans.h5", *retarget, "scans.h5", "--target", "hero.ply", "--out", "scans.h5")

    def test_doctor(self):
        self.ply("ball.ply", points(200, 1))
        known = ("--up", "y", "--scale", "0.3")
        self.stays("ball.ply", "doctor", "ball.ply", "--fix", "ball.ply", *known)
        self.ply("ball.png", points(200, 1))
        self.stays("ball.png", "doctor", "ball.png", "--picture", "ball.png", *known)
        for i in range(3):
            self.ply("frames/frame_%06d.ply" % i, points(90, i))
        self.stays("frames/frame_000000.ply", "doctor", "frames", "--fix", "frames/", *known)

    def test_weights(self):
        self.write("o.safetensors", tensors(OFFSETS))
        model = ("--model", "deformation/offsets", "--out")
        self.stays("o.safetensors", "weights", "import", "--source", "o.safetensors", *model, "o.safetensors")
        self.done("weights", "import", "--source", "o.safetensors", *model, "w.safetensors")
        self.stays("w.safetensors", "weights", "export", "--source", "w.safetensors", *model, "w.safetensors")


class Places(CliTest):
    def setUp(self):
        super().setUp()
        self.write("walk.bvh", toy_bvh())

    def call(self, out):
        return ["data", "import", "walk.bvh", "--out", out]

    def test_what_a_link_leads_to_is_written(self):
        self.done(*self.call("plain.h5"))
        os.mkdir(self.path("far"))
        os.symlink("far/real.h5", self.path("link.h5"))
        os.symlink("link.h5", self.path("second.h5"))
        for out in ("link.h5", "second.h5"):  # the first time the link leads nowhere
            self.done(*self.call(out))
            self.assertTrue(os.path.islink(self.path(out)))
            self.assertEqual(self.bytes("far/real.h5"), self.bytes("plain.h5"))
            self.write("far/real.h5", "old")
        self.assertEqual(os.listdir(self.path("far")), ["real.h5"])
        os.symlink("round.h5", self.path("round.h5"))
        self.bad_input(self.call("round.h5"), "round.h5")

    def test_pipes_and_sockets_are_left_alone(self):
        os.mkfifo(self.path("pipe"))
        with socket.socket(socket.AF_UNIX) as s:
            s.bind(self.path("socket"))
            for name, kind in (("pipe", stat.S_ISFIFO), ("socket", stat.S_ISSOCK)):
                self.bad_input(self.call(name), name, "device, pipe or socket")
                self.assertTrue(kind(os.lstat(self.path(name)).st_mode))

    def test_long_names(self):
        self.done(*self.call("x" * 252 + ".h5"))
        self.bad_input(self.call("x" * 300 + ".h5"), "too long", "shorten")
        self.bad_input(["retarget", "--force", "--weights", weights("tiny"), "--source", self.ply("a.ply", points(90, 1)), "--target", "a.ply",
                        "--out", "y" * 300 + "/"], "too long", "shorten")
        self.bad_input(["data", "verify", "z" * 300], "too long", "shorten")
        self.person()
        self.bad_input(["doctor", "walk", "--fix", "z" * 300 + "/"], "too long", "shorten")

    def test_a_link_to_itself_as_input_is_refused(self):
        os.symlink("loop", self.path("loop"))
        self.bad_input(["data", "verify", "loop"], "loop", "links")
        self.bad_input(["doctor", "loop"], "loop", "links")

    def test_names_that_are_no_text(self):
        odd = os.fsdecode(b"odd\xff.ply")
        self.ply(odd, self.person())
        self.done("doctor", odd, "--fix", "mended.ply")
        self.assertEqual(json.loads(self.bytes("mended.ply.transform.json"))["from"], "odd\ufffd.ply")
        self.bad_input(["info", odd], "odd\ufffd.ply")

    def test_a_pipe_as_input_is_refused(self):
        """Nobody writes into it: to open it would be to wait for ever."""
        for name in ("a.bvh", "a.amc", "a.glb", "a.ply", "a.obj", "a.npz", "a.npy", "a.h5", "a.yaml", "a.safetensors"):
            os.mkfifo(self.path(name))
            self.bad_input(["doctor", name], name)
            if name.split(".")[1] not in ("h5", "yaml", "safetensors"):
                self.bad_input(["data", "import", name, "--out", "x.h5"], name)
        self.bad_input(["eval", "--pred", "a.h5", "--truth", "a.h5"], "a.h5")
        self.bad_input(["data", "import", "walk.bvh", "--bones", "a.yaml", "--out", "x.h5"], "a.yaml")
        self.bad_input(["skeleton", "--weights", "a.safetensors", "--source", "a.ply"], "a.safetensors")


class Interrupted(CliTest):
    """Whatever a signal stops leaves nothing behind."""

    def stop(self, *arguments):
        for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            before = sorted(os.listdir(self.folder))
            with subprocess.Popen([PROGRAM, *arguments], cwd=self.folder, stderr=subprocess.PIPE, stdout=subprocess.PIPE) as running:
                while running.poll() is None and not any(".part" in name for name in os.listdir(self.folder)):
                    time.sleep(0.002)
                running.send_signal(number)
                self.assertEqual((running.wait(60), running.stderr.read()), (code, b""))
            self.assertEqual(sorted(os.listdir(self.folder)), before)

    def test_import(self):
        self.write("long.bvh", toy_bvh(30000))
        self.stop("data", "import", "long.bvh", "--out", "x.h5")

    def test_a_folder_of_frames(self):
        self.write("walk.npy", cloud(4000))
        self.stop("doctor", "walk.npy", "--fix", "out/", "--up", "y", "--scale", "0.3")
