#!/usr/bin/env python3
"""Runs the fuzz targets of the readers and of what comes after them, and prints what came of it.

    tests/fuzz/run_fuzz.py                      5 seconds each, build/fuzz/restage_fuzz
    tests/fuzz/run_fuzz.py --inputs 200000      so many inputs each
    tests/fuzz/run_fuzz.py --targets ply,bvh --seconds 60 --seed 1

Inputs that taught something new stay in the corpus folder and are where the next run begins. Ends
with 1 if there was a finding; what caused it is kept and named. Plain Python, no packages.
"""
import argparse
import concurrent.futures
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=pathlib.Path, default=HERE.parent.parent / "build/fuzz/restage_fuzz")
    parser.add_argument("--targets", help="some of them, with commas between; else all")
    parser.add_argument("--seconds", type=int, default=5, help="for each target")
    parser.add_argument("--changed", nargs="*", default=[], metavar="FILE",
                        help="targets whose name is in the name of one of these files get four times the seconds")
    parser.add_argument("--inputs", type=int, help="for each target, instead of seconds")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="else another one each time")
    parser.add_argument("--jobs", type=int, default=2, help="targets at a time")
    parser.add_argument("--corpus", type=pathlib.Path, help="else fuzz_corpus beside the program")
    parser.add_argument("--findings", type=pathlib.Path, help="else fuzz_findings beside the program")
    options = parser.parse_args()
    options.program = options.program.resolve()
    options.corpus = options.corpus or options.program.parent / "fuzz_corpus"
    options.findings = options.findings or options.program.parent / "fuzz_findings"
    return options


def environment(scratch):
    return dict(os.environ, TMPDIR=scratch,
                ASAN_OPTIONS="detect_stack_use_after_return=1:strict_string_checks=1:quarantine_size_mb=16",
                UBSAN_OPTIONS="print_stacktrace=1:halt_on_error=1")


def seconds(options, name):
    stems = " ".join(pathlib.PurePath(file).stem for file in options.changed)
    return options.seconds * (4 if name in stems or name.split("_")[0] in re.split(r"[ _]", stems) else 1)


def fuzz(options, name, longest, allocation, words=None):
    """One run; a row of the table."""
    corpus, findings = options.corpus / name, options.findings / name
    for folder in (corpus, findings):
        folder.mkdir(parents=True, exist_ok=True)
    before = set(findings.iterdir())
    # Readers that want a file get one in memory.
    memory = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    scratch = tempfile.mkdtemp(prefix="restage-fuzz-", dir=memory)
    program = [str(options.program), f"--target={name}"]
    try:
        subprocess.run(program + [f"--seeds={corpus}"], check=True, env=environment(scratch))
        limit = f"-runs={options.inputs}" if options.inputs else f"-max_total_time={seconds(options, name)}"
        command = program + [limit, f"-max_len={longest}", f"-malloc_limit_mb={allocation}", "-rss_limit_mb=1536",
                             "-timeout=30", f"-seed={options.seed}", f"-artifact_prefix={findings}/", "-print_final_stats=1",
                             "-verbosity=1", "-use_value_profile=1"]
        command += [f"-dict={HERE}/dictionaries/{words}.dict"] if words else []  # words that chance finds slowly
        start = time.monotonic()
        done = subprocess.run(command + [str(corpus)], env=environment(scratch), stdin=subprocess.DEVNULL,
                              stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace")
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    log = findings.parent / f"{name}.log"
    log.write_text(done.stderr)
    kept = sorted(set(findings.iterdir()) - before)
    if done.returncode == 0:  # those of children, which are there to fall over (datasets/hdf5/probe.h)
        for path in kept:
            path.unlink()
        kept = []

    def last(pattern):
        found = re.findall(pattern, done.stderr)
        return int(found[-1]) if found else 0

    return {"target": name, "inputs": last(r"number_of_executed_units:\s+(\d+)") or last(r"^#(\d+)"),
            "seconds": time.monotonic() - start, "edges": last(r"cov: (\d+)"),
            "memory": last(r"peak_rss_mb:\s+(\d+)"), "failed": done.returncode != 0, "kept": kept, "log": log}


def main():
    options = arguments()
    listed = subprocess.run([str(options.program), "--list"], check=True, stdout=subprocess.PIPE, text=True).stdout
    targets = [line.split() for line in listed.splitlines()]
    if options.targets:
        wanted = options.targets.split(",")
        unknown = set(wanted) - {t[0] for t in targets}
        if unknown:
            sys.exit(f"run_fuzz: no target {sorted(unknown)[0]}; there are " + ", ".join(t[0] for t in targets))
        targets = [t for t in targets if t[0] in wanted]
    print(f"seed {options.seed}\n| target | inputs | seconds | edges covered | peak memory, MB | findings |\n"
          "|---|---|---|---|---|---|", flush=True)
    rows = []
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        jobs = [pool.submit(fuzz, options, *target) for target in targets]
        for job in jobs:
            row = job.result()
            rows.append(row)
            print(f"| {row['target']} | {row['inputs']:,} | {row['seconds']:.0f} | {row['edges']} | {row['memory']} "
                  f"| {int(row['failed'])} |", flush=True)
    print(f"| all | {sum(r['inputs'] for r in rows):,} | {sum(r['seconds'] for r in rows):.0f} | | "
          f"| {sum(r['failed'] for r in rows)} |")
    for row in rows:
        if row["failed"]:
            print(f"\n{row['target']}: {row['log']}")
            for line in row["log"].read_text(errors="replace").splitlines():
                if re.search(r"ERROR|runtime error|exception than|not one short|SUMMARY|malloc\(|#[0-9]+ .*restage::", line):
                    print("  " + line[:200])
            for path in row["kept"]:
                print(f"  again: {options.program} --target={row['target']} {path}")
    return any(row["failed"] for row in rows)


if __name__ == "__main__":
    sys.exit(main())
