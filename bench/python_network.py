#!/usr/bin/env python3
"""What a network costs that is written in Python: smrm/rot6d beside the same network, line by line, in Python.

    PYTHONPATH=build/release/python /usr/bin/python3 bench/python_network.py [--hidden 256] [--steps 40] [--rounds 6]

Both are trained in turns on one thread, with the same data and the same bits. Prints milliseconds a step of the
processor's time, which other programs change little: the median of all steps, and the least.
"""
import argparse
import pathlib
import statistics
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "tests/python"))
import restage  # noqa: E402
import own_networks  # noqa: E402, F401

CONFIG = """run_root: {folder}
data: {{bodies: {{train: 4, validation: 2, test: 2}}, motions: {{train: 8, validation: 2, test: 2}}}}
stages: [motion]
motion:
  optimiser: {{steps: {steps}, batch: 16, clip: 1.0}}
  windows: {{frames: 30, self_share: 0.7, noise: 0.01}}
  validation_windows: 1
  validation_frames: 8
loop: {{validate_every: 100000, checkpoint_every: 100000}}
"""


def step_times(config, *words):
    """Milliseconds of each step but the first few."""
    seen = []
    restage.train(config, *words, on_step=lambda *of: seen.append(time.process_time()))
    return [1e3 * (b - a) for a, b in zip(seen[4:], seen[5:])]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    for name, default in (("--hidden", 256), ("--steps", 40), ("--rounds", 6)):
        parser.add_argument(name, type=int, default=default)
    a = parser.parse_args()
    restage.set_threads(1)
    kinds = {"C++": ("motion.model=smrm/rot6d", f"motion.sizes={{hidden: {a.hidden}, standardise: true, rest_pose_start: true, "
                     "dropout: 0.1, layers: 2}"),
             "Python": ("motion.model=tiny/smrm", f"motion.sizes={{hidden: {a.hidden}, dropout: 0.1}}")}
    times = {kind: [] for kind in kinds}
    with tempfile.TemporaryDirectory() as folder:
        config = pathlib.Path(folder, "c.yaml")
        config.write_text(CONFIG.format(folder=folder, steps=a.steps))
        for _ in range(a.rounds):
            for kind, words in kinds.items():
                times[kind] += step_times(config, *words)
    for kind, each in times.items():
        print(f"{kind:7} median {statistics.median(each):8.2f} ms, least {min(each):8.2f} ms, {len(each)} steps")


if __name__ == "__main__":
    main()
