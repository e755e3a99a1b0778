"""What the tests of the Python module share: the program beside it, and a person who walks.

RESTAGE_PROGRAM is the program; PYTHONPATH has the folder of the module. ctest sets both.
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("RESTAGE_PROGRAM", str(ROOT / "build/release/restage"))
# A sanitizer for processes that import the module (tests/CMakeLists.txt). Programs have their own.
SANITIZER = os.environ.pop("LD_PRELOAD", None)
LITE, STANDARD = (str(ROOT / "experiments/weights" / f"{name}.safetensors") for name in ("lite", "standard"))


def python(*words, env=None, **options):
    """A process of Python that imports the module; what it says is kept. Options are those of subprocess.run."""
    env = dict(os.environ if env is None else env)
    if SANITIZER:
        env["LD_PRELOAD"] = SANITIZER
    return subprocess.run([sys.executable, *map(str, words)], env=env, capture_output=True, **options)


class Program:
    """The program, run in a folder."""

    def __init__(self, folder):
        self.folder = folder

    def __call__(self, *words):
        return subprocess.run([PROGRAM, *map(str, words)], cwd=self.folder, capture_output=True, text=True, timeout=300)

    def done(self, *words):
        result = self(*words)
        assert result.returncode == 0, result.stderr
        return result.stdout

    def json(self, *words):
        return json.loads(self.done(*words, "--json"))


@pytest.fixture
def sanitized_children(monkeypatch):
    """Processes that multiprocessing starts import the module, too."""
    if SANITIZER:
        monkeypatch.setenv("LD_PRELOAD", SANITIZER)


@pytest.fixture(scope="session", autouse=True)
def cache():
    """Checksums that the program keeps stay out of the user's folder."""
    folder = tempfile.mkdtemp(prefix="restage-cache-")
    os.environ["XDG_CACHE_HOME"] = folder
    yield folder
    shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(scope="session")
def walk(cache, tmp_path_factory):
    """A folder with target.ply, a body in T-pose, and scans of another one that walks (walk/)."""
    folder = tmp_path_factory.mktemp("walk")
    program = Program(folder)
    program.done("data", "build", "--bodies", 1, 0, 1, "--motions", 1, 0, 0, "--quiet", "--out", "data.h5")
    program.done("data", "perform", "--bodies", "data.h5", "--frames", 8, "--quiet", "--out", "walk")
    return folder / "walk"


@pytest.fixture(scope="session")
def program(cache, tmp_path_factory):
    return Program(tmp_path_factory.mktemp("program"))
