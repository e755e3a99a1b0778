"""Compares a program's answer with a case.

    build/release/oracle_runner CASE.safetensors ANSWER.safetensors
    python3 tests/oracle/compare.py CASE.safetensors ANSWER.safetensors [--tol 1e-8]

CASE is a file that make_golden.py wrote. ANSWER holds the program's `out.*`, `idx.*` and `g.*` tensors under the same names. A tensor agrees if
max|a - b| <= tol * max(max|b|, 1e-3 * s), s being the largest magnitude among all `out.*` (or all `g.*`)
of the case. In f32 cases a tensor with max|b| < 1e-5 * s is zero by construction (a bias before a batch
norm, say) and holds rounding noise: it agrees if max|a| <= 1e-5 * s. Default tol: 1e-8 for f64 cases,
1e-4 for f32. Exit status 0 if all agree, 1 if not, 2 if a tensor is missing."""
import json
import sys
import numpy as np

KIND = {"F64": "<f8", "F32": "<f4", "I64": "<i8", "I32": "<i4"}


def read(path):
    b = open(path, "rb").read()
    n = int.from_bytes(b[:8], "little")
    head = json.loads(b[8:8 + n])
    meta = head.pop("__metadata__", {})
    out = {}
    for k, v in head.items():
        lo, hi = v["data_offsets"]
        out[k] = np.frombuffer(b[8 + n + lo:8 + n + hi], KIND[v["dtype"]]).reshape(v["shape"])
    return out, meta


def compare(case, answer, tol=None):
    want, meta = read(case)
    got, _ = read(answer)
    tol = tol or (1e-8 if meta.get("dtype") == "f64" else 1e-4)
    rows, missing = [], []
    top = {p: max([np.abs(v).max() for k, v in want.items() if k.startswith(p) and v.size] + [0]) for p in ("out.", "g.")}
    for k, b in want.items():
        if not k.startswith(("out.", "g.", "idx.")) or k.startswith("out.probe"):
            continue
        if k in ("g.in.target", "g.in.self_mask"):
            continue                                   # no program but PyTorch needs them
        if k not in got:
            missing.append(k)
            continue
        a = got[k]
        if a.size != b.size:
            rows.append((np.inf, k))
        elif k.startswith("idx."):
            rows.append((0.0 if (a.reshape(b.shape) == b).all() else np.inf, k))
        else:
            s = top[k[:k.index(".") + 1]]
            if meta.get("dtype") == "f32" and b.size and np.abs(b).max() < 1e-5 * s:
                rows.append((0.0 if np.abs(a).max() <= 1e-5 * s else np.inf, k))
                continue
            scale = max(np.abs(b).max() if b.size else 0, 1e-3 * s, 1e-300)
            d = np.abs(a.reshape(b.shape).astype("f8") - b).max() if b.size else 0.0
            rows.append((float(d / scale) if np.isfinite(d) else np.inf, k))
    return sorted(rows, reverse=True), missing, tol


if __name__ == "__main__":
    tol = float(sys.argv[sys.argv.index("--tol") + 1]) if "--tol" in sys.argv else None
    rows, missing, tol = compare(sys.argv[1], sys.argv[2], tol)
    bad = [r for r in rows if r[0] > tol]
    for e, k in bad[:10]:
        print("%-50s %.3e" % (k, e))
    for k in missing[:10]:
        print("%-50s missing" % k)
    print("%d tensors, %d differ by more than %g, %d missing, worst %.3e" %
          (len(rows), len(bad), tol, len(missing), rows[0][0] if rows else float("nan")))
    sys.exit(2 if missing or not rows else 1 if bad else 0)
