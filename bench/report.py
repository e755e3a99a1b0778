"""The figures of measure.py as Markdown."""


def number(x):
    """Three digits, or whole milliseconds."""
    return f"{x:.0f}" if x >= 100 else f"{x:.3g}"


def spread(r):
    return f"{number(r['ms'])} ({number(r['min'])}-{number(r['max'])})"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def agreement(found):
    """The largest relative difference of the answers, by item."""
    return table(["answers compared", "largest relative difference"], [[name, f"{worst:.1e}"] for name, worst in found.items()])


def sgemm_rate(items):
    """The best rate of any wide product in this run, GFLOP/s, and whose it was."""
    rates = [(i["gflop"] / r["ms"] * 1e3, who) for i in items if i["name"].startswith("sgemm")
             for who, group in (("ours", i["ours"]), ("LibTorch's BLAS", i["libtorch"])) for r in group.values()]
    return max(rates, default=(None, ""))


def head(out):
    m = out["machine"]
    caches = ", ".join(f"{k} {v}" for k, v in m["caches"].items())
    d = out["disturbed"]
    lines = [f"{m['processor']}, {m['cores']} cores ({', '.join(m['instructions'])}; {caches}), "
             f"{m['memory_gib']} GiB, {m['system']}. Times are milliseconds per example: median (least-most) "
             "of the rounds."]
    if d["above_limit"]:
        lines.append(f"**Disturbed:** in {d['above_limit']} of {d['requests']} requests others used more than "
                     f"{d['limit_cores']} cores (up to {d['worst_cores']:.2f}), also when repeated.")
    else:
        lines.append(f"Undisturbed: in all {d['requests']} requests others used at most {d['limit_cores']} cores.")
    if out["limited_to"]:
        lines.insert(0, f"**Both sides use {out['limited_to']} at most**, not all that the processor has.")
    if out["quick"]:
        lines.insert(0, "**Not a result: made with --quick.**")
    return "\n\n".join(lines)


def active_units(item, r):
    """Both shares, and how much of the plain algorithm's work was done."""
    if "active" not in r:
        return ["", ""]
    shares = ", ".join(f"{r[k]:.3f}" for k in ("active", "active_scores") if r.get(k) is not None)
    return [shares, f"{100 * r['done_gflop'] / item['examples'] / item['gflop']:.0f} %" if item["gflop"] else ""]


def reading(out):
    found = [(i, out["reading"][i["name"]]) for i in out["items"] if i["name"] in out["reading"]]
    if not found:
        return ""
    rows = []
    for i, r in found:
        heap = r["memory"]["heap"]
        rows.append([i["name"], i["per"], number(r["training_per_s"]), number(r["loader_per_s"]),
                     number(r["loader_1fps_per_s"]) if "loader_1fps_per_s" in r else "", f"**{r['ratio']:.1f}**",
                     f"{r['processor_ratio']:.1f}",
                     f"{100 * r['share']:.1f} %", f"{heap[0]:.1f} -> {heap[1]:.1f}"])
    few, many = found[0][1]["memory"]["examples"]
    text = ("## Reading\n\nExamples a second: of whole training steps, of the loader alone, of the loader from one "
            "frame a second of motion. Ratio: how many times as fast the loader gives examples as the rest of the step "
            "takes them, by the clock and by processor time; heap: MiB in use after "
            f"{few:,} examples and after {many:,}.\n\n")
    return text + table(["item", "example", "training", "loader", "1 frame/s", "ratio", "processor", "of the step", "heap"], rows)


def ours(out):
    rate, whose = sgemm_rate(out["items"])
    with_active = any("active" in r for i in out["items"] for r in i["ours"].values())
    rows = []
    for i in out["items"]:
        if i["name"] in out["reading"]:
            continue
        for variant, r in i["ours"].items():
            speed = i["gflop"] / r["ms"] * 1e3
            row = [i["name"], i["what"], variant, i["per"], spread(r), number(1e3 / r["ms"]),
                   number(speed) if i["gflop"] else "", f"{100 * speed / rate:.0f} %" if rate and i["gflop"] else "",
                   number(r["peak_mib"])]
            if with_active:
                row[8:8] = active_units(i, r)
            rows.append(row)
    if not rows:
        return ""
    columns = ["item", "what", "weights", "example", "ms", "a second", "GFLOP/s", "of sgemm", "peak MiB"]
    if with_active:
        columns[8:8] = ["active units", "work done"]
    text = ("## Restage\n\nGFLOP/s count the plain algorithm's operations, also where fewer are done"
            + (f"; sgemm is the fastest product of this run, {number(rate)} GFLOP/s ({whose})" if rate else "")
            + "." + (" Active units: the share, behind the attention's first and second ReLU, that needs a product; "
                     "work done: operations left of the plain algorithm's." if with_active else "") + "\n\n")
    return text + table(columns, rows)


def against_libtorch(out):
    settings = next((list(i["libtorch"]) for i in out["items"] if i["libtorch"]), [])
    if not settings:
        return ""
    rows = []
    for i in out["items"]:
        if not i["libtorch"]:
            continue
        theirs = [spread(i["libtorch"][s]) for s in settings]
        for variant, r in i["ours"].items():
            ratio = i["ratios"][variant]
            rows.append([i["name"], variant, spread(r), *theirs, f"{ratio['best']:.2f}",
                         f"{ratio['installed']:.2f}", str(r["rounds"])])
            theirs = [""] * len(settings)  # LibTorch's time does not depend on the weights
    text = ("## Against LibTorch\n\nBoth gave the same answers for the same weights before (largest relative "
            f"difference {max(out['agreement'].values()):.1e}). Ratio: LibTorch's best setting over ours, median of "
            "the rounds' pairs; settings that are far from the best of their kind have one round.\n\n")
    return text + table(["item", "weights", "ours", *settings, "ratio", "to installed", "rounds"], rows)


def memory(out):
    kinds = sorted({k for m in out["memory"].values() for k in m if k != "ours"})
    if not kinds:
        return ""
    rows = [[name, number(m["ours"]), *(number(m[k]) if k in m else "" for k in kinds)]
            for name, m in out["memory"].items()]
    return ("## Peak memory, MiB\n\nResident, of a process that does nothing else.\n\n"
            + table(["item", "ours", *(k.replace("_", ", ") for k in kinds)], rows))


def markdown(out):
    return "\n\n".join(p for p in (head(out), ours(out), reading(out), against_libtorch(out), memory(out)) if p)
