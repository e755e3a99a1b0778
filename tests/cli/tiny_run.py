"""Trainings that take a moment, and the weights that they leave."""
import atexit
import os
import shutil
import subprocess
import tempfile

from support import PROGRAM

CONFIG = """name: tiny
seed: 3
data:
  bodies: {train: 2, validation: 2, test: 1}
  motions: {train: 4, validation: 2, test: 1}
skeleton:
  model: skeleton/patch_transformer
  sizes: {points: 64, width: 16, layers: 1, centres: 16, neighbours: 4}
  optimiser: {steps: 10, batch: 4, schedule: {rate: 2e-3}}
  validation_clouds: 4
motion:
  sizes: {hidden: 16}
  optimiser: {steps: 10, batch: 4}
  windows: {frames: 10, self_share: 0.25}
  validation_windows: 2
  validation_frames: 10
deformation:
  optimiser: {steps: 10, batch: 2}
  pairs: {points: 32}
  validation_pairs: 2
loop: {log_every: 2, validate_every: 5, checkpoint_every: 4}
"""

# An extractor that has seen T-poses only and takes everything for one.
TPOSES = ["skeleton.optimiser.steps=150", "skeleton.optimiser.schedule.rate=0.01", "skeleton.clouds.tpose_share=1",
          "skeleton.clouds.tpose_heading=0", "skeleton.clouds.heading=false", "skeleton.clouds.mirror=false"]

_folder = tempfile.mkdtemp(prefix="restage-weights-")
atexit.register(shutil.rmtree, _folder, ignore_errors=True)


def weights(name, *overrides):
    """The weights of a tiny training, made once for all tests."""
    path = os.path.join(_folder, name + ".safetensors")
    if not os.path.exists(path):
        config = os.path.join(_folder, "tiny.yaml")
        with open(config, "w") as f:
            f.write(CONFIG)
        made = subprocess.run([PROGRAM, "train", config, *overrides, "--quiet"], cwd=_folder, capture_output=True, text=True, timeout=120)
        if made.returncode != 0:
            raise RuntimeError(made.stderr)
        shutil.move(os.path.join(_folder, made.stdout.strip(), "weights.safetensors"), path)
    return path
