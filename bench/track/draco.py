"""What Draco makes of the frames that `restage track` wrote, at an error that is asked for.

    /usr/bin/python3 bench/track/draco.py FRAMES/ [--error 1.0] [--fps 30] [--every 10]

FRAMES/ is the folder of PLY files of `restage track --out FRAMES/ --format ply`. Each frame is packed alone, as Draco does, with the
fewest bits of position at which 95 % of the vertices are nearer than --error millimetres. Needs Debian's `draco` and `python3-scipy`."""
import argparse
import os
import subprocess
import tempfile

import numpy
from scipy.spatial import cKDTree


def read_ply(path):
    """Vertices of a binary PLY file, x y z in front as float32."""
    with open(path, "rb") as f:
        head, _, body = f.read().partition(b"end_header\n")
    count, size, inside = 0, 0, False
    sizes = {"char": 1, "uchar": 1, "short": 2, "ushort": 2, "int": 4, "uint": 4, "float": 4, "float32": 4, "double": 8}
    for line in head.decode().splitlines():
        words = line.split()
        if words[0] == "element":
            inside = words[1] == "vertex"
            count = int(words[2]) if inside else count
        elif words[0] == "property" and inside:
            size += sizes[words[1]]
    rows = numpy.frombuffer(body[:count * size], dtype=numpy.uint8).reshape(count, size)
    return rows[:, :12].copy().view("<f4").astype(float)


def packed(frame, bits, folder):
    """Bytes of the packed frame, and the distance of each vertex from the nearest unpacked one."""
    small, back = os.path.join(folder, "a.drc"), os.path.join(folder, "a.ply")
    for command in (["draco_encoder", "-i", frame, "-o", small, "-qp", str(bits), "-cl", "10"], ["draco_decoder", "-i", small, "-o", back]):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    true, got = read_ply(frame), read_ply(back)
    # Draco orders vertices anew.
    return os.path.getsize(small), cKDTree(got).query(true)[0]


def main():
    asked = argparse.ArgumentParser()
    asked.add_argument("frames")
    asked.add_argument("--error", type=float, default=1.0)
    asked.add_argument("--fps", type=float, default=30)
    asked.add_argument("--every", type=int, default=10)
    asked = asked.parse_args()
    names = sorted(n for n in os.listdir(asked.frames) if n.endswith(".ply"))[::asked.every]
    with tempfile.TemporaryDirectory() as folder:
        for bits in range(7, 17):
            some = [packed(os.path.join(asked.frames, n), bits, folder) for n in names]
            p95 = 1e3 * numpy.percentile(numpy.concatenate([d for _, d in some]), 95)
            mean = sum(size for size, _ in some) / len(some)
            print("%2d bits: 95 %% nearer than %.3f mm, %.0f bytes a frame, %.0f kB/s" % (bits, p95, mean, mean * asked.fps / 1e3))
            if p95 <= asked.error:
                return


if __name__ == "__main__":
    main()
