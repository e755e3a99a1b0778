#!/usr/bin/env python3
"""What a push() from Python costs beyond the frame that C++ computes, arrays of the result included.

usage: PYTHONPATH=build/release/python python3 bench/python_push.py SOURCE TARGET [WEIGHTS]
"""
import statistics
import sys
import time

import restage


def measure(source, target, weights=None, rounds=10):
    system = restage.System(target, weights)
    clouds = [c for c in restage.load_clouds(source) if c is not None]
    whole, outside, seen = [], [], 0
    for _ in range(rounds):
        system.restart()
        for cloud in clouds:
            start = time.perf_counter()
            frame = system.push(cloud)
            seen += frame.vertices.nbytes + frame.joints.nbytes + frame.rotations.nbytes
            spent = time.perf_counter() - start
            whole.append(spent)
            outside.append(spent - system.times["frame"])
    return statistics.median(whole), statistics.median(outside), len(clouds[0]), seen


if __name__ == "__main__":
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    whole, outside, points, _ = measure(*sys.argv[1:])
    print(f"{points} points: push {1e3 * whole:.2f} ms (median), of which {1e3 * outside:.3f} ms are Python's "
          f"({100 * outside / whole:.2f} %)")
