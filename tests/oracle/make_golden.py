#!/usr/bin/python3
"""Writes the golden files of tests/golden/oracle with PyTorch, or compares them with what PyTorch says here.

    python3 tests/oracle/make_golden.py                          writes tests/golden/oracle
    python3 tests/oracle/make_golden.py --seed 5 --out FOLDER    other numbers, elsewhere
    python3 tests/oracle/make_golden.py --check                  exit code 1 where a committed file is not what PyTorch says

Debian's python3-torch; half a minute. README.md says what is in a file."""
import argparse
import os
import sys
import tempfile

sys.dont_write_bytecode = True

try:
    import compare
    import numpy as np
    import torch
    from cases import case, formulas, method, systems
except ModuleNotFoundError as missing:
    print("skipped: no %s here; Debian has python3-torch, which brings numpy" % missing.name)
    sys.exit(0 if "--check" in sys.argv else 2)

HERE = os.path.dirname(os.path.abspath(__file__))
GOLDEN = os.path.join(HERE, "..", "golden", "oracle")
SEED = 12  # of the committed files


def make(folder, seed, draws):
    """draws: numbers of the draws by builder; a builder that is not among them looks for one that settles."""
    torch.set_num_threads(1)
    os.makedirs(folder, exist_ok=True)
    for builder in method.BUILDERS + systems.BUILDERS:
        case.build(folder, seed, builder, draws.get(builder.__name__))
    for builder in formulas.BUILDERS:
        builder(folder)


def committed_draws():
    """The draw that a file says it is from. Which one settles first can depend on the processor's rounding."""
    draws = {}
    for builder in method.BUILDERS + systems.BUILDERS:
        name = builder.__name__ + ("" if os.path.exists(os.path.join(GOLDEN, builder.__name__ + "_f64.safetensors")) else "_train")
        draws[builder.__name__] = int(compare.read(os.path.join(GOLDEN, name + "_f64.safetensors"))[1]["draw"])
    return draws


def off(want, got, single):
    """How far two arrays are apart, relative to the largest number."""
    if want.shape != got.shape or want.dtype != got.dtype:
        return np.inf
    if want.dtype.kind == "i":
        return 0.0 if np.array_equal(want, got) else np.inf
    return float(np.abs(want.astype("f8") - got).max() / max(np.abs(want).max(), 1e-300)) / (1e-5 if single else 1e-12)


def faults_of(name, committed, remade):
    """Lines about one file. Inputs and parameters are numbers of a seed: they agree to rounding. The rest has the measure of compare.py."""
    want, meta = compare.read(committed)
    got, remade_meta = compare.read(remade)
    if set(want) != set(got) or meta != remade_meta:
        return ["%s: other tensors or other metadata" % name]
    single = meta.get("dtype") == "f32"
    plain = [k for k in want if "case" not in meta or k.startswith(("in.", "p.", "buf."))]
    found = ["%s: %s" % (name, k) for k in plain if off(want[k], got[k], single or want[k].dtype == np.float32) > 1]
    if "case" in meta:
        rows, missing, allowed = compare.compare(committed, remade)
        found += ["%s: %s, %.1e" % (name, k, e) for e, k in rows if e > allowed] + ["%s: %s is missing" % (name, k) for k in missing]
    return found


def check(seed):
    with tempfile.TemporaryDirectory() as folder:
        make(folder, seed, committed_draws())
        names = [{n for n in os.listdir(f) if n.endswith(".safetensors")} for f in (GOLDEN, folder)]
        faults = ["%s: only in one of both folders" % n for n in sorted(names[0] ^ names[1])]
        for name in sorted(names[0] & names[1]):
            faults += faults_of(name, os.path.join(GOLDEN, name), os.path.join(folder, name))
        print("\n".join(faults[:20] + ["%d files, %d faults" % (len(names[0] | names[1]), len(faults))]))
        return bool(faults)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--out", default=GOLDEN)
    options.add_argument("--seed", type=int, default=SEED)
    options.add_argument("--check", action="store_true")
    a = options.parse_args()
    if a.check:
        return check(a.seed)
    make(a.out, a.seed, {})
    return 0


if __name__ == "__main__":
    sys.exit(main())
