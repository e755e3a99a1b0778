"""Children and stylised bodies beside adults, as targets and as sources: errors in mm and in shares of the body's height.

  python3 measure.py PROGRAM DATA_FOLDER --out proportions.json

DATA_FOLDER: with body/ and cmu/, as `restage data import` takes it. Adults are test people of its bodies.csv. Children are the same
rows with an age of about 9 to 14 years and less height, brought to 0.8 to 1.2 m. Stylised bodies are the adults in T-pose with a
larger head and limbs that are shortened along their bones, brought to the same heights. No training saw any of them.

As targets: a mesh in T-pose without a rig. `tpose`: joints found against true ones, aligned by place alone. `clip`: a skeleton's
motion retargeted onto it against the true one, PA-MPJPE. As sources: clouds of the body in that motion. `found`: joints found
against true ones, PA-MPJPE. `chain`: the motion of these clouds on an adult whom the program sees too, PA-MPJPE.
"""
import argparse, csv, json, os, subprocess, sys, tempfile
import h5py
import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "any_pose"))
from measure import PARENTS, aligned, read_glb  # noqa: E402: of a target in any pose

MOTIONS = ("02_01", "05_03", "06_08", "02_04")
HEIGHTS = np.linspace(0.8, 1.2, 8)  # metres
#                 head, limbs along their bones, hands and feet
STYLES = {"stylised": (1.4, 0.8, 0.9), "chibi": (2.0, 0.6, 0.8)}
FIGURES = ("tpose", "clip", "found", "chain")


def import_people(program, data, folder, count):
    """Adults of the test split and children of the same rows, as bodies and motions of one file."""
    rows = list(csv.DictReader(open(os.path.join(data, "body", "bodies.csv"))))
    adults = [row for row in rows if row["split"] == "test"][:count]
    children = []
    for k, row in enumerate(adults):
        years = np.linspace(0.14, 0.25, count)[k]  # MakeHuman's slider: 0.1875 is 12 years, 0 no longer a child's
        children.append({**row, "id": "child" + row["id"], "age": "%.3f" % years, "height": "%.3f" % (0.3 * float(row["height"]))})
    os.makedirs(os.path.join(folder, "data", "body"))
    os.symlink(os.path.join(data, "cmu"), os.path.join(folder, "data", "cmu"))
    for name in os.listdir(os.path.join(data, "body")):
        if name != "bodies.csv":
            os.symlink(os.path.join(data, "body", name), os.path.join(folder, "data", "body", name))
    with open(os.path.join(folder, "data", "body", "bodies.csv"), "w", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]))
        table.writeheader()
        table.writerows(adults + children)
    people = os.path.join(folder, "people.h5")
    run(program, "data", "import", os.path.join(folder, "data"), "--out", people)
    return people, [row["id"] for row in adults], [row["id"] for row in children]


def run(program, *words):
    done = subprocess.run([program, *words, "--quiet"], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip())


def stylise(vertices, joints, weights, head, limbs, ends):
    """Each joint's part is scaled about the joint: arms and legs along their bone, hands, feet and head as a whole."""
    scale = np.tile(np.eye(3), (22, 1, 1))
    scale[15] *= head
    for j, child in ((1, 4), (2, 5), (4, 7), (5, 8), (16, 18), (17, 19), (18, 20), (19, 21)):
        along = (joints[child] - joints[j]) / np.linalg.norm(joints[child] - joints[j])
        scale[j] += (limbs - 1) * np.outer(along, along)
    for j in (7, 8, 10, 11, 20, 21):
        scale[j] *= ends
    place = joints.copy()
    for j in range(1, 22):
        place[j] = place[PARENTS[j]] + scale[PARENTS[j]] @ (joints[j] - joints[PARENTS[j]])
    out = sum(weights[:, j:j + 1] * ((vertices - joints[j]) @ scale[j].T + place[j]) for j in range(22))
    return out, place


def add_bodies(people, adults, children):
    """Brings the children to their heights and adds the stylised bodies. Returns the names of each group, and heights."""
    groups = {"adults": adults, "children": children}
    with h5py.File(people, "r+") as file:
        bodies = file["bodies"]
        heights = {name: float(np.ptp(bodies[name]["vertices"][:, 1])) for name in adults}

        def put(name, vertices, joints, height):
            size = height / np.ptp(vertices[:, 1])
            low = np.array([0, vertices[:, 1].min(), 0])
            bodies[name]["vertices"][...], bodies[name]["joints"][...] = size * (vertices - low), size * (joints - low)
            heights[name] = float(height)
        for name, height in zip(children, HEIGHTS):
            put(name, bodies[name]["vertices"][()].astype(float), bodies[name]["joints"][()].astype(float), height)
        for style, sizes in STYLES.items():
            groups[style] = [style + "_" + name for name in adults]
            for source, name, height in zip(adults, groups[style], HEIGHTS):
                file.copy(bodies[source], bodies, name)
                put(name, *stylise(*(bodies[source][k][()].astype(float) for k in ("vertices", "joints", "weights")), *sizes), height)
    return groups, heights


def joints_of(path):
    with h5py.File(path) as file:
        return file["joints"][()].astype(float)


def pa(found, true):
    return 1e3 * float(np.mean([np.linalg.norm(aligned(a, b) - b, axis=1).mean() for a, b in zip(found, true)]))


def measure(program, folder, people, name, motion, partner, height):
    at = lambda *parts: os.path.join(folder, *parts)
    perform = lambda body, answer, out: run(program, "data", "perform", "--bodies", people, "--body", body, "--answer", answer, "--motion", motion, "--out", at(out))
    perform(partner, name, "to")
    perform(name, partner, "from")
    row, words = {}, {}
    try:
        for kind in ("h5", "glb"):
            run(program, "retarget", "--source", people, "--clip", motion, "--target", at("to", "target.ply"), "--out", at("out." + kind), "--floor", "off", "--contacts", "off")
        _, found, _ = read_glb(at("out.glb"))
        true = joints_of(at("to", "rest.h5"))[0]
        row["tpose"] = 1e3 * float(np.linalg.norm(found - found.mean(0) - true + true.mean(0), axis=1).mean())
        row["clip"] = pa(joints_of(at("out.h5")), joints_of(at("to", "truth.h5")))
    except RuntimeError as refusal:
        words["target_refused"] = str(refusal).replace(folder + "/", "")
    try:
        run(program, "skeleton", at("from", "source.h5"), "--samples", "4", "--out", at("found.h5"))
        row["found"] = pa(joints_of(at("found.h5")), joints_of(at("from", "source.h5")))
        run(program, "retarget", "--source", at("from", "source.h5"), "--target", at("from", "target.ply"), "--out", at("chain.h5"))
        row["chain"] = pa(joints_of(at("chain.h5")), joints_of(at("from", "truth.h5")))
    except RuntimeError as refusal:
        words["source_refused"] = str(refusal).replace(folder + "/", "")
    # The answer of `chain` has the partner's size.
    shares = {figure + "_permille": row[figure] / (height[partner] if figure == "chain" else height[name]) for figure in row}
    figures = {**{figure + "_mm": value for figure, value in row.items()}, **shares}
    return {**{name: round(value, 3) for name, value in figures.items()}, **words}


def table_of(rows, groups):
    table = {}
    for group in groups:
        some = [r for r in rows if r["group"] == group]
        table[group] = {"runs": len(some), "heights": [min(r["height"] for r in some), max(r["height"] for r in some)],
                        "refused": [sum(k in r for r in some) for k in ("target_refused", "source_refused")]}
        for figure in FIGURES:
            for unit in ("mm", "permille"):
                values = [r[figure + "_" + unit] for r in some if figure + "_" + unit in r]
                table[group][figure + "_" + unit] = round(float(np.mean(values)), 2) if values else None
    return table


def markdown(table):
    print("| bodies (runs) | height, m | refused as target, as source | " + " | ".join(FIGURES) + " |")
    print("|---" * (3 + len(FIGURES)) + "|")
    for group, row in table.items():
        cells = []
        for figure in FIGURES:
            mm, share = row[figure + "_mm"], row[figure + "_permille"]
            more = 100 * (share / table["adults"][figure + "_permille"] - 1) if mm is not None else 0
            cells.append("-" if mm is None else "%.1f / %.1f (%+.0f %%)" % (mm, share, more))
        print("| %s (%d) | %.2f to %.2f | %d, %d | %s |" % (group, row["runs"], *row["heights"], *row["refused"], " | ".join(cells)))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("data")
    parser.add_argument("--out", required=True)
    parser.add_argument("--bodies", type=int, default=8)
    args = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        people, adults, children = import_people(args.program, os.path.abspath(args.data), folder, args.bodies)
        groups, height = add_bodies(people, adults, children)
        for group, names in groups.items():
            for k, name in enumerate(names):
                motion, partner = MOTIONS[k % len(MOTIONS)], adults[(k + 1) % len(adults)]
                rows.append({"group": group, "body": name, "height": round(height[name], 3), "motion": motion,
                             **measure(args.program, folder, people, name, motion, partner, height)})
                print(rows[-1], file=sys.stderr)
    table = table_of(rows, groups)
    json.dump({"table": table, "rows": rows}, open(args.out, "w"), indent=1)
    markdown(table)


if __name__ == "__main__":
    main()
