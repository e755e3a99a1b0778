#!/usr/bin/env python3
"""A long run of `restage stream`: clouds at a steady rate to its socket, the VMC bundles received, its memory watched.

    bench/stream_soak.py --program build/release/restage --target hero.vrm --clouds scans/ [--weights W]
        [--seconds 600] [--fps 30] [--points 3000] [--trouble] [-- more options of restage stream]

--clouds: a folder of binary PLY files of one point count each (such as `restage retarget --out frames/` writes), played
forwards and backwards without end. --trouble: once a minute the sender stalls for five seconds, sends garbage, or vanishes in
the middle of a frame, in turns. Prints a row of docs/stream.md's table; exit code 1 where memory grows by more than 5 %
after the first tenth, or frames are missing though nothing was wrong. Plain Python, nothing else needed."""
import argparse
import glob
import json
import os
import random
import signal
import socket
import struct
import subprocess
import sys
import threading
import time


def ply_points(path, count):
    with open(path, "rb") as f:
        head, _, body = f.read().partition(b"end_header\n")
    vertices = int(head.split(b"element vertex ")[1].split()[0])
    if b"binary_little_endian" not in head or len(body) < 12 * vertices:
        sys.exit(path + ": is no binary PLY of float x y z")
    pick = random.Random(path).sample(range(vertices), min(count, vertices))
    return b"".join(body[12 * i:12 * i + 12] for i in pick)


def clouds_of(folder, count):
    files = sorted(glob.glob(os.path.join(folder, "*.ply")))
    if not files:
        sys.exit(folder + ": holds no PLY files")
    clouds = [ply_points(path, count) for path in files]
    return clouds + clouds[-2:0:-1]


def free_port(kind):
    with socket.socket(socket.AF_INET, kind) as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def resident(pid):
    """MiB."""
    with open("/proc/%d/status" % pid) as f:
        return next(int(line.split()[1]) / 1024 for line in f if line.startswith("VmRSS"))


class Receiver(threading.Thread):
    """Where the hips were in each bundle."""

    def __init__(self, port):
        super().__init__(daemon=True)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        self.socket.bind(("127.0.0.1", port))
        self.got = []

    def run(self):
        while True:
            data = self.socket.recv(65536)
            at = data.index(b"Hips\0\0\0\0") + 8
            self.got.append(struct.unpack_from(">3f", data, at))


class Sender:
    def __init__(self, port, clouds):
        self.port, self.clouds, self.socket, self.numbers = port, clouds, None, []

    def connect(self):
        if self.socket is not None:
            self.socket.close()
        self.socket = socket.create_connection(("127.0.0.1", self.port))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def frame(self, k, seconds):
        cloud = self.clouds[k % len(self.clouds)]
        return struct.pack("<Id", len(cloud) // 12, seconds) + cloud

    def send(self, k, seconds):
        self.socket.sendall(self.frame(k, seconds))
        self.numbers.append(k)

    def trouble(self, kind, k, seconds):
        if kind == 0:
            time.sleep(5)
        elif kind == 1:
            self.socket.sendall(b"\xff" * 1000)
            time.sleep(0.5)
        else:
            self.socket.sendall(self.frame(k, seconds)[:1000])
        self.connect()


def drift(hips, numbers, length):
    """How far the hips are from where they were when the same cloud was answered early in the run (in the second of `length`
    clouds), mean over the last round, millimetres. None: there are no three rounds."""
    if numbers[-1] < 3 * length:
        return None
    early = {n % length: p for n, p in zip(numbers, hips) if length <= n < 2 * length}
    late = {n % length: p for n, p in zip(numbers[-length:], hips[-length:])}
    far = [sum((a - b) ** 2 for a, b in zip(p, early[n])) ** 0.5 for n, p in late.items() if n in early]
    return 1e3 * sum(far) / len(far)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("--target", required=True)
    parser.add_argument("--clouds", required=True)
    parser.add_argument("--weights")
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--fps", type=float, default=30)
    parser.add_argument("--points", type=int, default=3000)
    parser.add_argument("--trouble", action="store_true")
    parser.add_argument("more", nargs="*")
    a = parser.parse_args()
    clouds = clouds_of(a.clouds, a.points)
    port, vmc = free_port(socket.SOCK_STREAM), free_port(socket.SOCK_DGRAM)
    receiver, sender = Receiver(vmc), Sender(port, clouds)
    receiver.start()
    command = [a.program, "stream", "--target", a.target, "--source", "tcp://127.0.0.1:%d" % port, "--vmc", "127.0.0.1:%d" % vmc, "--json"]
    command += (["--weights", a.weights] if a.weights else []) + a.more
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    said = []
    while not (said and said[-1].startswith("clouds come from")):
        said.append(process.stderr.readline())
        if not said[-1]:
            sys.exit("the program has ended: " + "".join(said))
    threading.Thread(target=lambda: said.extend(process.stderr), daemon=True).start()
    sender.connect()
    start, memory, troubles, k = time.monotonic(), [], 0, 0
    while (now := time.monotonic() - start) < a.seconds:
        if a.trouble and now > 60 * (troubles + 1):
            sender.trouble(troubles % 3, k, now)
            troubles += 1
        if now > len(memory):
            memory.append(resident(process.pid))
        wait = k / a.fps - now
        if wait > 0:
            time.sleep(wait)
        k = max(k, int((time.monotonic() - start) * a.fps))  # what a stall has cost is not made up for
        sender.send(k, k / a.fps)
        k += 1
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    out = process.stdout.read()
    process.wait()
    report = json.loads(out)
    settled = memory[len(memory) // 10:]
    growth = 100 * (settled[-1] / settled[0] - 1)
    latency = report["latency_ms"]
    whole = not troubles and report["frames_out"] == len(sender.numbers)  # else rounds cannot be told apart
    moved = drift(receiver.got, sender.numbers, len(clouds)) if whole else None
    print("| %s | %s | %d | %g s at %g fps%s | %d | %d | %d | %.1f | %.1f | %.1f | %.1f to %.1f MiB | %s |" % (
        os.path.basename(a.target), os.path.basename(a.weights or "standard"), len(clouds[0]) // 12, a.seconds, a.fps,
        ", %d troubles" % troubles if troubles else "", report["frames_in"], report["frames_out"], report["dropped"], latency["p50"],
        latency["p99"], latency["max"], settled[0], settled[-1], "%.1f mm" % moved if moved is not None else "-"))
    print(json.dumps({**report, "sent": len(sender.numbers), "received": len(receiver.got), "memory_growth_percent": growth,
                      "memory_most_mib": max(memory)}))
    if troubles:
        print("".join(said), file=sys.stderr)
    lost = len(sender.numbers) - report["frames_in"] if not troubles else 0
    if growth > 5 or lost or len(receiver.got) != report["frames_out"] or process.returncode != 130:
        sys.exit("memory grew by %.1f %%, %d frames lost, %d bundles of %d received, exit code %d" % (
            growth, lost, len(receiver.got), report["frames_out"], process.returncode))


if __name__ == "__main__":
    main()
