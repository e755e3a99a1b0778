#!/usr/bin/env python3
"""Times what restage_bench lists, alone or in turns with LibTorch; README.md says how to read it.

A table in Markdown goes to standard output, all figures as JSON to --json FILE, progress to standard error.
Plain Python, no packages.
"""
import argparse
import glob
import json
import math
import os
import pathlib
import statistics
import subprocess
import sys
import time

import report

TUNABLES = ("glibc.malloc.mmap_max=0:glibc.malloc.trim_threshold=100000000000:"
            "glibc.malloc.top_pad=268435456:glibc.malloc.hugetlb=1")
RATIOS = ("skeleton_train", "skeleton_online", "smrm_train_b16", "smrm_train_b64", "smrm_online",
          "deformation_train", "deformation_online", "pointnet_train", "frame_online",
          "npt_lite_train", "npt_paper_train", "lart_lite_train", "lart_paper_train", "corenet_lite_train",
          "corenet_paper_train", "cross_attention_1k", "cross_attention_7k", "cross_attention_13k")
LEAST_ROUNDS, WANTED_ROUNDS, MOST_ROUNDS = 3, 5, 9
# What keeps LibTorch, OpenBLAS, BLIS and oneDNN to a set of vector instructions that is not the processor's best.
LIMITED = {"avx2": {"ATEN_CPU_CAPABILITY": "avx2", "OPENBLAS_CORETYPE": "Haswell", "BLIS_ARCH_TYPE": "3",
                    "ONEDNN_MAX_CPU_ISA": "AVX2"}}
# BLIS takes plain C on a processor that it does not know. It reads numbers, and takes a name for 0.
BLIS_AVX512 = "0"
REQUEST_SECONDS = 0.6  # short repetitions are bundled: the system counts processor time in 10 ms
FOREIGN_LIMIT = 0.05   # cores used by others during a request that counts as undisturbed
TICK = 1 / os.sysconf("SC_CLK_TCK")
TOLERANCE = 1e-3       # relative, between the two implementations' answers
# Of a gradient's norm: where two points differ by rounding alone, a maximum over points takes either, and the norm jumps.
# Changing the clouds by 1e-7 of themselves changes PointNet's by up to 1.4e-3.
NORM_TOLERANCE = 5e-3


def say(text):
    print(text, file=sys.stderr, flush=True)


class Process:
    """A program that answers one line of JSON for each line of text."""

    def __init__(self, command, environment, greeting):
        self.child = subprocess.Popen(command, env=environment, text=True, stdin=subprocess.PIPE,
                                      stdout=subprocess.PIPE)
        self.about = self.answer() if greeting else {}

    def ask(self, request):
        self.child.stdin.write(request + "\n")
        self.child.stdin.flush()
        return self.answer()

    def answer(self):
        line = self.child.stdout.readline()
        if not line:
            sys.exit(f"{self.child.args[0]} ended with exit code {self.child.wait()}; what it said is above")
        return json.loads(line)

    def seconds(self):
        """Processor time used so far, all threads."""
        with open(f"/proc/{self.child.pid}/stat") as f:
            fields = f.read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) * TICK

    def peak_mib(self):
        with open(f"/proc/{self.child.pid}/status") as f:
            return next(int(line.split()[1]) for line in f if line.startswith("VmHWM")) / 1024

    def close(self):
        self.child.stdin.close()
        self.child.wait()


def is_reading(item):
    return item["name"].startswith("reading_")


def cores():
    return len(os.sched_getaffinity(0))


def library_folder(name):
    found = sorted(glob.glob(f"/usr/lib/*/{name}"))
    if not found:
        sys.exit(f"/usr/lib/*/{name} is missing: install Debian's packages (./run bench --against-libtorch does)")
    return found[0]


def processor():
    """What the system says of the first core."""
    with open("/proc/cpuinfo") as f:
        pairs = [line.split(":", 1) for line in f.read().split("\n\n")[0].splitlines()]
    return {name.strip(): value.strip() for name, value in pairs}


class Programs:
    """Starts either side in any of its settings."""

    def __init__(self, ours, libtorch, inputs, instructions=None):
        self.ours, self.libtorch, self.inputs = ours, libtorch, inputs
        self.environment = {k: v for k, v in os.environ.items() if not k.startswith(
            ("OMP_", "GOMP_", "OPENBLAS_", "BLIS_", "GLIBC_", "LD_", "ATEN_", "DNNL_", "ONEDNN_"))}
        self.limited = LIMITED[instructions] if instructions else {}
        self.words = ["--instructions", instructions] if instructions else []

    def list(self):
        out = subprocess.run([self.ours, "list", self.inputs], check=True, capture_output=True, text=True)
        return json.loads(out.stdout)

    def settings(self):
        """LibTorch's: (installed or tuned, threads)."""
        if not self.libtorch:
            return []
        return [(kind, n) for kind in ("installed", "tuned") for n in sorted({1, cores()})]

    def start(self, side):
        """`side`: a variant of ours, or one of settings()."""
        if isinstance(side, str):
            return Process([self.ours, "serve", *self.words, self.inputs], self.environment, greeting=False)
        kind, threads = side
        e = {**self.environment, **self.limited}
        for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "BLIS_NUM_THREADS"):
            e[name] = str(threads)
        blas = "openblas-pthread" if kind == "installed" else "blis-openmp"
        e["LD_LIBRARY_PATH"] = library_folder(blas)
        if kind == "tuned":
            # LAPACK's plain library beside it: OpenBLAS' own would bring its threads along.
            e["LD_LIBRARY_PATH"] += ":" + library_folder("lapack")
            e["GLIBC_TUNABLES"] = TUNABLES
            if "avx512f" in processor().get("flags", "").split():
                e.setdefault("BLIS_ARCH_TYPE", BLIS_AVX512)
        return Process([self.libtorch, self.inputs, str(threads), blas], e, greeting=True)


def busy_seconds():
    """Processor time that all cores have spent so far, for anybody."""
    with open("/proc/stat") as f:
        user, nice, system, _, _, irq, softirq, steal = map(int, f.readline().split()[1:9])
    return (user + nice + system + irq + softirq + steal) * TICK


class Quiet:
    """Asks, and asks again where others used the processor meanwhile: idle processes of ours count as
    others too, since they should be asleep. Gives up on a machine that is never quiet."""

    def __init__(self, patience):
        self.patience = self.limit = patience
        self.disturbed = self.requests = 0
        self.worst = 0.0

    def ask(self, process, request):
        """The answer of the least disturbed attempt, the cores that others used and the seconds of processor time that
        the process itself took."""
        best = None
        while True:
            time.sleep(0.05)  # for the last process's threads to fall asleep
            begin, own, ours, busy = time.monotonic(), process.seconds(), time.process_time(), busy_seconds()
            answer = process.ask(request)
            wall = time.monotonic() - begin
            own = process.seconds() - own
            used = busy_seconds() - busy - own - (time.process_time() - ours)
            foreign = max(0.0, used - 2 * TICK) / wall
            if best is None or foreign < best[1]:
                best = (answer, foreign, own)
            if foreign <= FOREIGN_LIMIT:
                self.patience = min(self.limit, self.patience + 1)
                break
            self.patience -= 1
            if self.patience < 0:
                break
        self.requests += 1
        self.disturbed += best[1] > FOREIGN_LIMIT
        self.worst = max(self.worst, best[1])
        return best


class Side:
    """One process that does one item."""

    def __init__(self, programs, item, side):
        self.item, self.side = item, side
        self.ours = isinstance(side, str)
        self.process = programs.start(side)
        self.request = f"run {item['name']} {side if self.ours else 'initial'}"
        self.times, self.processor, self.foreign, self.extra = [], [], [], {}
        begin = time.monotonic()
        self.process.ask(f"{self.request} 0")  # builds the item and warms up
        self.seconds = time.monotonic() - begin
        if self.seconds < 2 * REQUEST_SECONDS or is_reading(item):  # most of it was opening the data
            begin = time.monotonic()
            self.process.ask(f"{self.request} 1")
            self.seconds = time.monotonic() - begin  # of one repetition, with what is not timed in it
        self.repeats = 1

    def measure(self, quiet):
        answer, foreign, own = quiet.ask(self.process, f"{self.request} {self.repeats}")
        self.times.append(statistics.median(answer.pop("ms")) / self.item["examples"])
        self.processor.append(1e3 * own / self.repeats / self.item["examples"])
        self.foreign.append(foreign)
        self.extra.update(answer)

    def result(self):
        t = self.times
        return {"ms": statistics.median(t), "min": min(t), "max": max(t), "rounds": len(t), "all": t,
                "processor": self.processor,
                "peak_mib": self.process.peak_mib(), "foreign_cores": max(self.foreign), **self.extra}


def finish_round(sides):
    """After the first round only those of LibTorch's settings stay that could be the best of their kind."""
    kept = [s for s in sides if s.ours]
    for kind in ("installed", "tuned"):
        those = [s for s in sides if not s.ours and s.side[0] == kind]
        kept += [s for s in those if s.times[-1] <= 1.35 * min(x.times[-1] for x in those)]
    return kept


def measure_item(programs, item, quiet, seconds, quick):
    """Rounds in which every side has its turn, until the time is over."""
    begin = time.monotonic()
    all_sides = [Side(programs, item, s) for s in item["variants"] + programs.settings()
                 if isinstance(s, str) or item["compared"]]
    sides = all_sides
    for side in sides:
        side.repeats = 1 if quick else min(200, max(1, math.ceil(REQUEST_SECONDS / side.seconds)))
    for number in range(1 if quick else MOST_ROUNDS):
        used = time.monotonic() - begin
        if number >= WANTED_ROUNDS and used > seconds or number >= LEAST_ROUNDS and used > 1.5 * seconds:
            break
        for side in sides[number % len(sides):] + sides[:number % len(sides)]:
            side.measure(quiet)
        if number == 0:
            sides = finish_round(sides)
    result = {"ours": {}, "libtorch": {}}
    for s in all_sides:
        if s.ours:
            result["ours"][s.side] = s.result()
        else:
            result["libtorch"][f"{s.side[0]}, {s.side[1]}T"] = s.result()
        s.process.close()
    return result


def ratios(result):
    """By variant: {"installed": ..., "tuned": ..., "best": ...}, medians over the rounds of LibTorch's time
    divided by ours in the same round, the least of them over the settings that were in all rounds."""
    out = {}
    for variant, ours in result["ours"].items():
        by_kind = {}
        for setting, theirs in result["libtorch"].items():
            if len(theirs["all"]) < len(ours["all"]):
                continue
            pairs = [b / a for a, b in zip(ours["all"], theirs["all"])]
            kind = setting.split(",")[0]
            by_kind[kind] = min(by_kind.get(kind, math.inf), statistics.median(pairs))
        if by_kind:
            out[variant] = {**by_kind, "best": min(by_kind.values())}
    return out


def reading(result):
    """The loader beside the training that it feeds: examples a second of both; how many times as fast the loader
    gives them as the rest of the step takes them, by the clock and by processor time, which others disturb less;
    and its share of the step. Medians over the rounds."""
    ours = result["ours"]
    out = {f"{k}_per_s": 1e3 / statistics.median(r["all"]) for k, r in ours.items()}
    for name, key in (("ratio", "all"), ("processor_ratio", "processor")):
        out[name] = statistics.median([(t - r) / max(r, 1e-9)
                                       for t, r in zip(ours["training"][key], ours["loader"][key])])
    pairs = zip(ours["training"]["all"], ours["loader"]["all"])
    return {**out, "share": statistics.median([r / t for t, r in pairs])}


def memory_of_epoch(programs, item, quick):
    """What the loader's process holds after 5,000 examples and after the 65,000 of an epoch, MiB."""
    process = programs.start("loader")
    few, many = (500, 6500) if quick else (5000, 65000)
    answer = process.ask(f"memory {item['name']} loader {few} {many}")
    process.close()
    return {"examples": [few, many], **answer}


def least(item, kind):
    """Of initial and trained weights; other variants stand beside them."""
    found = [r[kind] for variant, r in item.get("ratios", {}).items() if variant != "dense"]
    return min(found) if found else None


def limits(item, count):
    """How far each of an item's answers may be apart. Those of a training step are its loss and its gradient's norm."""
    return [TOLERANCE, NORM_TOLERANCE] if item["name"].endswith("_train") and count == 2 else [TOLERANCE] * count


def agreement(programs, items):
    """The largest relative difference between both programs' answers for the same weights and inputs, by item.
    Ends the program if it is too large."""
    ours, theirs = programs.start("initial"), programs.start(("tuned", cores()))
    out = {}
    for item in items:
        for variant in item["variants"]:
            request = f"check {item['name']} {variant}"
            a, b = ours.ask(request)["values"], theirs.ask(request)["values"]
            apart = [abs(x - y) / max(abs(x), abs(y), 1e-2) for x, y in zip(a, b)]
            worst = max(apart)
            if len(a) != len(b) or any(d > limit for d, limit in zip(apart, limits(item, len(a)))):
                sys.exit(f"{request}: LibTorch answers {b}, we {a}: they do not do the same work")
            out[item["name"]] = max(worst, out.get(item["name"], 0))
    ours.close()
    theirs.close()
    return out


def machine():
    info = processor()
    flags = info.get("flags", "").split()
    with open("/proc/meminfo") as f:
        memory = int(f.readline().split()[1]) / 1024 ** 2
    caches = {}
    for folder in sorted(pathlib.Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")):
        level, kind, size = ((folder / name).read_text().strip() for name in ("level", "type", "size"))
        if kind != "Instruction":
            caches[f"L{level}"] = size
    return {"processor": info.get("model name", os.uname().machine), "cores": cores(),
            "instructions": [f for f in ("avx2", "fma", "avx512f", "avx512_bf16", "amx_bf16") if f in flags],
            "caches": caches, "memory_gib": round(memory, 1), "system": " ".join(os.uname()[:3:2])}


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--program", required=True, help="restage_bench")
    p.add_argument("--inputs", required=True, help="the folder that 'restage_bench inputs' made")
    p.add_argument("--libtorch", help="libtorch_bench (none: no comparison)")
    p.add_argument("--json", help="file for all figures")
    p.add_argument("--instructions", choices=sorted(LIMITED), help="both sides use these vector instructions at most")
    p.add_argument("--items", help="only these, separated by commas")
    p.add_argument("--minutes", type=float, default=12, help="about how long to measure (default 12)")
    p.add_argument("--quick", action="store_true", help="every item once: to try the program, not a result")
    p.add_argument("--answers", action="store_true", help="only whether both give the same answers: nothing is timed")
    a = p.parse_args()
    if a.answers and not a.libtorch:
        p.error("--answers compares with LibTorch's program: give --libtorch")
    return a


def main():
    a = arguments()
    programs = Programs(a.program, a.libtorch, a.inputs, a.instructions)
    items = programs.list()
    if a.items:
        unknown = set(a.items.split(",")) - {i["name"] for i in items}
        if unknown:
            sys.exit(f"there is no item {', '.join(sorted(unknown))}; there are " +
                     ", ".join(i["name"] for i in items))
        items = [i for i in items if i["name"] in a.items.split(",")]
    elif a.libtorch:  # has no part in reading
        items = [i for i in items if not is_reading(i)]
    for item in items:
        item["compared"] = bool(a.libtorch) and not item["name"].endswith("_lite") and not is_reading(item)
    compared = [i for i in items if i["compared"]]
    out = {"ratios": {}, "ratios_installed": {}, "reading": {}, "memory": {}, "quick": a.quick, "machine": machine(),
           "limited_to": a.instructions}
    if a.libtorch:
        say("do both give the same answers?")
        out["agreement"] = agreement(programs, compared)
    if a.answers:
        print(report.agreement(out["agreement"]))
        return
    quiet = Quiet(patience=0 if a.quick else 20)
    # A step of the large extractor or of LART takes longer than those of all others together.
    long = ("skeleton_train", "reading_skeleton_paper", "lart_paper_train")
    weight = {i["name"]: 5 if i["name"] in long else 1 for i in items}
    end = time.monotonic() + 60 * a.minutes
    for item in items:
        seconds = max(0.0, end - time.monotonic()) * weight[item["name"]] / sum(weight.values())
        del weight[item["name"]]
        say(f"{item['name']}: {item['what']}")
        item.update(measure_item(programs, item, quiet, seconds, a.quick))
        item["ratios"] = ratios(item)
        if is_reading(item):
            out["reading"][item["name"]] = {**reading(item), "memory": memory_of_epoch(programs, item, a.quick)}
    out["items"] = items
    out["disturbed"] = {"requests": quiet.requests, "above_limit": quiet.disturbed, "limit_cores": FOREIGN_LIMIT,
                        "worst_cores": quiet.worst}
    if a.libtorch:
        for item in items:
            if item["name"] in RATIOS:
                out["ratios"][item["name"]] = least(item, "best")
                out["ratios_installed"][item["name"]] = least(item, "installed")
    for item in items:
        if item["name"] == "smrm_online":
            continue  # the buffer that flushes the caches would be most of it; smrm_online_warm has none
        peaks = {"ours": max(r["peak_mib"] for r in item["ours"].values())}
        for setting, r in item["libtorch"].items():
            kind = "libtorch_" + setting.split(",")[0]
            peaks[kind] = min(peaks.get(kind, math.inf), r["peak_mib"])
        out["memory"][item["name"]] = peaks
    if a.json:
        with open(a.json + ".part", "w") as f:
            json.dump(out, f, indent=1)
        os.replace(a.json + ".part", a.json)
    print(report.markdown(out))


if __name__ == "__main__":
    main()
