#!/usr/bin/env python3
"""Writes docs/results.md from the committed results under experiments.

    python3 docs/make_results.py            writes the page
    python3 docs/make_results.py --check    1 if the page, or a figure of README.md's table or of
                                                `restage weights list`, is not what this writes
    python3 docs/make_results.py --readme   prints a table for README.md

Every figure is computed here; the prose holds none. Files are in metres; the page is in millimetres.
README.md's table is what stands between the lines <!-- results --> and <!-- /results -->.
"""

import json
import math
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE, README, LIST = ROOT / "docs/results.md", ROOT / "README.md", ROOT / "experiments/weights/list.json"

# ---- what is committed ---------------------------------------------------------------------------


class Trial:
    """One result.json, with the scores of its references."""

    def __init__(self, path):
        document = json.loads(path.read_text())
        self.case, self.seed, self.sets = document["case"], document["seed"], document["metrics"]
        for part in self.sets.values():
            for name, scores in part.get("references", {}).items():
                if isinstance(scores, str):  # stored once for many trials
                    scores = json.loads((path.parent / "references" / (scores + ".json")).read_text())
                    part["references"][name] = scores

    def sequences(self, kind, metric, reference=None):
        """Values by the sequence's name. `kind`: a set, or a set and a part of its sequences' names."""
        name, _, part = kind.partition(":")
        scores = self.sets[name]
        if reference:
            scores = scores["references"][reference]
        return {s["name"]: s.get(metric) for s in scores["sequences"] if part in s["name"]}


def trials(folder, pattern="trials/*/result.json"):
    found = [Trial(path) for path in sorted((ROOT / "experiments/studies" / folder).glob(pattern))]
    by_case = {}
    for trial in found:
        by_case.setdefault(trial.case, []).append(trial)
    for group in by_case.values():
        group.sort(key=lambda t: t.seed)
    return by_case


def mean(values):
    values = [v for v in values if v is not None]
    return sum(values) / len(values) if values else None


def deviation(values):
    middle = mean(values)
    return math.sqrt(sum((v - middle) ** 2 for v in values) / (len(values) - 1))


class Row:
    """A system on every set: the mean of its trials' means."""

    def __init__(self, label, found, reference=None):
        self.label, self.trials, self.reference = label, found, reference

    def each(self, kind, metric):
        return [mean(t.sequences(kind, metric, self.reference).values()) for t in self.trials]

    def value(self, kind, metric):
        return mean(self.each(kind, metric))


# ---- how figures are written ---------------------------------------------------------------------

IN_MILLIMETRES = {"mpjpe", "pa_mpjpe", "mpvd", "pa_mpvd", "leaf_pa_mpvd", "acc", "pa_acc"}
IN_PERCENT = {"rotation_over_90", "side_swaps"}
DIGITS = {"medl": 2, "peak_speed": 2, "rotation_over_90": 2}


def number(value, metric, sign=""):
    if value is None:
        return "-"
    scale = 1e3 if metric in IN_MILLIMETRES else 100 if metric in IN_PERCENT else 1
    return f"{value * scale:{sign}.{DIGITS.get(metric, 1)}f}"


def cells(row, kinds, metrics):
    return [" / ".join(number(row.value(kind, m), m) for m in metrics) for kind in kinds]


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


# ---- differences ---------------------------------------------------------------------------------

def student(share, freedom):
    """The t with P(|T| < t) = share (experiments/sweep/statistics.cpp)."""
    def inside(t):
        angle = math.atan(t / math.sqrt(freedom))
        sine, cosine, odd = math.sin(angle), math.cos(angle), freedom % 2
        term = cosine if odd else 1.0
        total = 0.0 if freedom == 1 else term
        for k in range(3 if odd else 2, freedom, 2):
            term *= cosine * cosine * (k - 1) / k
            total += term
        return (angle + sine * total) * 2 / math.pi if odd else sine * total
    low, high = 0.0, 1e6
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (middle, high) if inside(middle) < share else (low, middle)
    return high


def spread(values):
    middle = mean(values)
    return sum((v - middle) ** 2 for v in values) / (len(values) - 1)


def half_width(columns):
    """Of the 95 % interval: the rule of experiments/sweep/statistics.h. columns[trial][sequence]."""
    n, size = len(columns), len(columns[0])
    rows, sequences = [mean(c) for c in columns], [mean(v) for v in zip(*columns)]
    if n == 1:
        return student(0.95, size - 1) * math.sqrt(spread(sequences) / size)
    middle = mean(rows)
    left = sum((columns[k][s] - rows[k] - sequences[s] + middle) ** 2 for k in range(n) for s in range(size))
    left /= (n - 1) * (size - 1)
    parts = ((max(0, size * spread(rows) - left), n - 1), (max(0, n * spread(sequences) - left), size - 1),
             (left, (n - 1) * (size - 1)))
    return math.sqrt(sum(student(0.95, freedom) ** 2 * part for part, freedom in parts) / (n * size))


def difference(row, other, kind, metric):
    """Mean of row - other over pairs of trial and sequence, its 95 % interval, in how many sequences row is less."""
    columns = []
    for a, b in zip(row.trials, other.trials):
        assert a.seed == b.seed
        mine, theirs = a.sequences(kind, metric, row.reference), b.sequences(kind, metric, other.reference)
        columns.append([mine[name] - theirs[name] for name in sorted(mine)])
    per_sequence = [mean(values) for values in zip(*columns)]
    middle, half = mean(per_sequence), half_width(columns)
    return middle, middle - half, middle + half, sum(v < 0 for v in per_sequence), len(per_sequence)


def said(row, other, kind, metric):
    """The difference, bold if its interval does not contain zero, and in how many sequences row is less."""
    middle, low, high, fewer, size = difference(row, other, kind, metric)
    clear = "**" if high < 0 or low > 0 else ""
    middle, low, high = (number(v, metric, "+") for v in (middle, low, high))
    return [f"{clear}{middle}{clear} [{low}, {high}]", f"{fewer}/{size}"]


# ---- the rows ------------------------------------------------------------------------------------

ours, seeds = trials("standard"), trials("standard_seeds")
benchmark, kinds = trials("benchmark"), trials("kinds_of_cloud")

standard = Row("**standard**", ours["at once"])
late = Row("**standard, two frames late**", ours["two frames late"])
no_motion = Row("no motion network", trials("shipped")["no motion network"])
lite = Row("lite (earlier program)", benchmark["Restage lite"])
register = Row("register, then repose", benchmark["register then repose"])
closed_form, unchanged = (Row(name.replace("_", " "), standard.trials, name) for name in ("closed_form", "source_unchanged"))
earlier = Row("the weights before", seeds["standard"])

SETS = {"test": "more motions", "naked": "naked", "clothed": "clothed", "scans:-rig": "eight cameras",
        "scans:-depth": "one camera"}
TOLD = {standard: "clouds", late: "clouds", no_motion: "clouds", lite: "clouds",
        register: "clouds, target's true joints", closed_form: "true joints of both",
        unchanged: "true joints of the source"}
KINDS = {"naked": "whole", "clothed": "whole, clothed, hair", "scans:six_cameras": "six cameras",
         "scans:one_camera": "one camera"}


def count(row, kind):
    return len(row.trials[0].sequences(kind, "pa_mpjpe"))


GLANCE = {"naked": "naked, whole", "clothed": "clothed, whole", "test": "more motions, whole",
          "scans:-rig": "eight depth cameras", "scans:-depth": "one depth camera"}


def glance_rows():
    """README.md shows some of these columns."""
    def both(kind, metric):
        return [number(row.value(kind, metric), metric) for row in (standard, unchanged)]
    return [[f"{words} ({count(standard, k)})", *both(k, "pa_mpjpe"), number(standard.value(k, "pa_mpvd"), "pa_mpvd"), *both(k, "mpjpe")]
            for k, words in GLANCE.items()]


def seeds_differ():
    """How far three trainings of the weights before differed."""
    return ", ".join(number(deviation(earlier.each(kind, "pa_mpjpe")), "pa_mpjpe") for kind in GLANCE)


def glance():
    head = ["clouds (sequences)", "joints", "source unchanged", "surface", "joints, not aligned",
            "source unchanged, not aligned"]
    return table(head, glance_rows())


def readme_table():
    return table(["clouds (sequences)", "joints", "source unchanged, joints", "surface"], [row[:4] for row in glance_rows()])


def by_set(metrics, rows, told=False):
    head = ["", *(["is told"] if told else []), *(f"{SETS[k]} ({count(standard, k)})" for k in SETS)]
    return table(head, [[row.label, *([TOLD[row]] if told else []), *cells(row, SETS, metrics)] for row in rows])


def real():
    rows = [[SETS[kind], *said(standard, unchanged, kind, "pa_mpjpe"), *said(standard, no_motion, kind, "pa_mpjpe"),
             said(standard, no_motion, kind, "acc")[0]] for kind in SETS]
    head = ["", "PA-MPJPE, standard - source unchanged", "less in", "PA-MPJPE, with - without motion network", "less in",
            "Acc, with - without motion network"]
    return table(head, rows)


def kinds_table():
    metrics = ("pa_mpjpe", "mpjpe", "pa_mpvd", "acc")
    rows = [Row("**as `retarget` does**: two frames late, bones and limbs held", kinds["as retarget does"]),
            *(Row(case, kinds[case]) for case in ("at once, bones held", "at once, bones not held", "no motion network"))]
    head = ["", *(f"{KINDS[k]} ({count(rows[0], k)})" for k in KINDS)]
    return table(head, [[r.label, *cells(r, KINDS, metrics)] for r in rows])


def rotations():
    late, at_once = kinds["as retarget does"], kinds["at once, bones held"]
    rows = [Row("as `retarget` does", late), Row("at once", at_once), Row("closed form of true joints", late, "closed_form")]
    words = []
    for kind in KINDS:
        found = {m: late[0].sequences(kind, m, None) for m in ("rotation_deg", "rotation_over_90", "side_swaps")}
        assert not any(found["side_swaps"].values()), "the page says that no sides are exchanged"
        worst = {m: max(found[m], key=found[m].get) for m in ("rotation_deg", "rotation_over_90")}
        words.append(" / ".join(number(found[m][worst[m]], m) for m in worst))
    head = ["", *KINDS.values()]
    return table(head, [*([r.label, *cells(r, KINDS, ("rotation_deg", "rotation_over_90"))] for r in rows),
                        ["worst sequence of `retarget`", *words]])


def same_for_all():
    """References see true joints, not clouds."""
    said = []
    for words, reference in {"closed form": "closed_form", "source unchanged": "source_unchanged"}.items():
        figures = set(cells(Row("", kinds["as retarget does"], reference), KINDS, ("pa_mpjpe", "mpjpe", "acc")))
        assert len(figures) == 1, figures
        said.append(f"{words} {figures.pop()}")
    return "; ".join(said)


def late_differences():
    rows = [[SETS[k], *said(late, standard, k, "pa_mpjpe"), *said(late, standard, k, "acc")] for k in SETS]
    return table(["two frames late - at once", "PA-MPJPE", "less in", "Acc", "less in"], rows)


def sure():
    parts = {"test": "more motions", "naked": "naked", "clothed": "clothed", "scans": "scans (8 sequences)"}
    first = standard.trials[0].sets
    curves = {words: first[name]["risk_coverage"] for name, words in parts.items()}
    shares = [f"{100 * point['coverage']:.0f} %" for point in curves["naked"]]
    rows = [[words, *(number(point["pa_mpjpe"], "pa_mpjpe") for point in curve)] for words, curve in curves.items()]
    return table(["surest frames", *shares], rows)


# ---- the page ------------------------------------------------------------------------------------

TEMPLATE = """# Results

<!-- Written by docs/make_results.py from the JSON files under experiments. Edit the script, not this page. -->

Errors on people and motions that no training saw: names in [metrics](metrics.md), sets and rows in
[benchmark](benchmark.md). Lengths are in mm, Acc in mm per frame², foot slide in mm per frame. Less is better. In
brackets: sequences.

## At a glance

Standard weights, one training. Joints: PA-MPJPE and MPJPE (not aligned). Surface:
PA-MPVD. "Source unchanged" hands on the source's true skeleton.

{glance}

* How far seeds differ is known of [the weights before](../experiments/studies/standard_seeds/sweep.yaml): the joints of
  three trainings have a sample deviation of {seeds_differ} in these rows.
  The trainings share two of the networks' parts, so the true spread is larger.
* **The tables are of sweeps, which do not [hold bones](real_scans.md#one-person-is-one-skeleton) and do not [keep the
  names of limbs](real_scans.md#limbs-that-cross-keep-their-names).** `retarget` does both. The
  effect of held bones is [below](#four-kinds-of-cloud-pa-mpjpe--mpjpe--pa-mpvd--acc).

## The benchmark's sets

Lite is the mean of {lite_count} seeds, all others are one training. "Is told": what the system knows of source and target.

**Joints: PA-MPJPE / MPJPE**

{joint_table}

**Surface: PA-MPVD / MPVD / MEDL**

{surface_table}

**Calm: Acc / foot slide**

{calm_table}

* A rule makes the truth. The closed form follows nearly the same rule with true joints: its joints are near the best.
* Alignment removes place, turn and size, so "source unchanged" looks good in PA-MPJPE. MPJPE shows the difference.
* "Lite" is of an earlier program.

## Is a difference real?

Differences, before rounding, are paired over sequences, with [95 % intervals](metrics.md#when-is-a-difference-real), which err
more often where sequences are few. Bold: the interval does not contain zero. A negative difference is better.
"Less in": of the sequences.

In [a training of a quarter of the steps](reproduction/ours.md) the motion network's gain in PA-MPJPE cannot be told.

{real}

## Four kinds of cloud: PA-MPJPE / MPJPE / PA-MPVD / Acc

Four people, who are in no other data of ours, do five motions, each seen in four ways
(`configs/data/kinds_of_cloud.yaml`). One seed. Clouds of cameras are easier here than in the
benchmark.

{kinds_table}

The references see true joints, the same in all columns. PA-MPJPE / MPJPE / Acc:
{same_for_all}.

**Rotations of the joints: mean error in degrees / share of more than 90 degrees in %.** In none of these
sequences do legs or arms change sides.

{rotations}

## Two frames late

The weights hold two motion networks over one extractor and one skinning. "Standard" answers each frame at once:
`stream` and, by default, Python's `System` use it. The other answers two frames (67 ms) later, and its filters know
those frames: `retarget` uses it, unless `--online` is given. With 95 % intervals:

{late_differences}

Five frames are [no better than two](decisions.md#motion).

## Sure frames are better

PA-MPJPE of the frames that the extractor is surest of (standard). Here all frames
count alike, in the tables above all sequences, so 100 % differs a little.

{sure}

`restage sweep table experiments/studies/standard` shows intervals. `sweep.yaml` there says how to run the sweep.
"""


def page():
    with_surface = [standard, late, no_motion, register]
    moving = [standard, late, no_motion, closed_form, unchanged]
    return TEMPLATE.format(
        lite_count=len(lite.trials), glance=glance(), seeds_differ=seeds_differ(),
        joint_table=by_set(("pa_mpjpe", "mpjpe"), list(TOLD), True),
        surface_table=by_set(("pa_mpvd", "mpvd", "medl"), with_surface),
        calm_table=by_set(("acc", "foot_slide_mm"), moving), real=real(),
        late_differences=late_differences(), kinds_table=kinds_table(), rotations=rotations(),
        same_for_all=same_for_all(), sure=sure())


def check_page(wanted):
    have = PAGE.read_text().splitlines() if PAGE.exists() else []
    want = wanted.splitlines()
    for i in range(max(len(have), len(want))):
        a, b = (lines[i] if i < len(lines) else "(no line)" for lines in (have, want))
        if a != b:
            return [f"docs/results.md:{i + 1}: is not what docs/make_results.py writes\n  is:     {a}\n  should: {b}"]
    return []


def check_readme(wanted):
    """Figures in README's table, but for the first column. A row of a name that the page has shows its figures."""
    text = README.read_text()
    block = re.search(r"^<!-- results -->$(.*?)^<!-- /results -->$", text, re.S | re.M)
    if not block:
        print("README.md: no table between <!-- results --> and <!-- /results -->; not checked")
        return []
    figures = lambda words: re.findall(r"(?<![\w.])\d+(?:\.\d+)?(?![\w.]*\d)", words)
    rows = {row[0]: set(figures(" ".join(row[1:]))) for row in glance_rows()}
    everything, out = set(figures(wanted)), []
    first = text[:block.start(1)].count("\n") + 1
    for i, line in enumerate(block.group(1).splitlines()):
        if not line.lstrip().startswith("|"):
            continue
        label, *cells_of_row = [cell.strip() for cell in line.strip().strip("|").split("|")]
        for figure in figures(" ".join(cells_of_row)):
            if figure not in rows.get(label, everything):
                out.append(f"README.md:{first + i}: {figure} is not what docs/results.md says of '{label}'")
    return out


def check_list():
    """Figures of `restage weights list`."""
    out = []
    for row in json.loads(LIST.read_text())["captures"]:
        if "set" not in row:
            continue
        for key, metric in (("joints_mm", "pa_mpjpe"), ("surface_mm", "pa_mpvd")):
            figure = number(standard.value(row["set"], metric), metric)
            if f"{row[key]:.1f}" != figure:
                out.append(f"experiments/weights/list.json: {row[key]} is not what docs/results.md says of '{row['capture']}': {figure}")
    return out


def main(arguments):
    if arguments not in ([], ["--check"], ["--readme"]):
        print(__doc__.strip(), file=sys.stderr)
        return 2
    if arguments == ["--readme"]:
        print("<!-- results -->\n" + readme_table() + "\n<!-- /results -->")
        return 0
    wanted = page()
    if not arguments:
        PAGE.write_text(wanted)
        return 0
    faults = check_page(wanted) + check_readme(wanted) + check_list()
    print("\n".join(faults) if faults else "docs/results.md: is what docs/make_results.py writes")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
