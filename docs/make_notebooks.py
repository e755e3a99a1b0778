#!/usr/bin/env python3
"""Runs the notebooks of docs/notebooks and stores what their cells print and draw, so that a reader sees it before running anything.

    PYTHONPATH=build/release/python python3 docs/make_notebooks.py            writes the notebooks
    PYTHONPATH=build/release/python python3 docs/make_notebooks.py --check    1 if what is stored is of another kind than what comes out

Needs numpy, h5py, matplotlib and Pillow (Debian: python3-numpy, python3-h5py, python3-matplotlib, python3-pil), and no Jupyter: a
stand-in takes what a cell shows. Stored pictures have 100 kB at most. Of the same kind are lines that differ in numbers only, and pictures in the same places. tests/python/test_notebooks.py checks, too.
"""
import ast
import base64
import contextlib
import importlib.util
import io
import json
import os
import pathlib
import re
import sys
import tempfile
import types

NOTEBOOKS = pathlib.Path(__file__).resolve().parent / "notebooks"
LARGEST = 100_000  # bytes of a picture


class Shown:
    """The outputs of one cell, in the order in which they came."""

    def __init__(self):
        self.outputs, self.text = [], io.StringIO()

    def end_text(self):
        text = self.text.getvalue()
        if text:
            self.outputs.append({"output_type": "stream", "name": "stdout", "text": text.splitlines(True)})
        self.text.seek(0)
        self.text.truncate()

    def picture(self, data):
        self.outputs.append({"output_type": "display_data", "metadata": {},
                             "data": {"image/png": base64.b64encode(data).decode(), "text/plain": ["a picture"]}})

    def clear(self):
        self.outputs.clear()
        self.text.seek(0)
        self.text.truncate()


class Image:
    """IPython.display.Image of a file."""

    def __init__(self, filename):
        self.data = pathlib.Path(filename).read_bytes()


def display_into(shown):
    """The module IPython.display, as far as the notebooks use it."""
    def display(what):
        now = shown()
        now.end_text()
        if isinstance(what, Image):
            now.picture(what.data)
        else:  # a figure of matplotlib
            data = io.BytesIO()
            what.savefig(data, format="png", dpi=70, metadata={"Software": None})
            now.picture(data.getvalue())
    module = types.ModuleType("IPython.display")
    module.display, module.Image, module.clear_output = display, Image, lambda wait=False: shown().clear()
    package = types.ModuleType("IPython")
    package.get_ipython = lambda: None  # matplotlib asks
    return {"IPython": package, "IPython.display": module}


def run(page, name, stand_in=True):
    """The outputs of each code cell, run one after the other in the working directory. stand_in: with what a notebook has beside Python."""
    found, names, now = [], {}, [None]
    before = {key: sys.modules.get(key) for key in ("IPython", "IPython.display")}
    if stand_in:
        sys.modules.update(display_into(lambda: now[0]))
        if importlib.util.find_spec("matplotlib"):
            import matplotlib
            matplotlib.use("Agg")
    try:
        for number, cell in enumerate(page["cells"]):
            if cell["cell_type"] != "code":
                continue
            now[0] = Shown()
            code = ast.parse("".join(cell["source"]), "%s, cell %d" % (name, number))
            with contextlib.redirect_stdout(now[0].text if stand_in else sys.stdout):
                exec(compile(code, "%s, cell %d" % (name, number), "exec"), names)
            now[0].end_text()
            found.append(now[0].outputs)
    finally:
        for key, module in before.items():
            if module is None:
                sys.modules.pop(key, None)
            else:
                sys.modules[key] = module
    return found


def kinds(outputs, pictures=True):
    """What has to stay the same: lines without their numbers, and which pictures there are."""
    said = []
    for one in outputs:
        if one["output_type"] == "stream":
            said.append(re.sub(r"-?\d+(\.\d+)?(e[-+]?\d+)?", "#", "".join(one["text"])))
        elif pictures:
            said.append("picture" if any(kind.startswith("image/") for kind in one["data"]) else "")
    return said


def faults(page, name, outputs):
    """Lines: cells whose stored outputs are of another kind than what came out."""
    found = []
    cells = [cell for cell in page["cells"] if cell["cell_type"] == "code"]
    for number, (cell, now) in enumerate(zip(cells, outputs), 1):
        pictures = "plt" not in "".join(cell["source"]) or importlib.util.find_spec("matplotlib") is not None
        stored = kinds(cell["outputs"], pictures)
        if stored != kinds(now, pictures):
            found.append("%s, code cell %d: stored is %r, and %r comes out; run docs/make_notebooks.py" % (name, number, stored, kinds(now, pictures)))
        for output in cell["outputs"]:
            for kind, data in output.get("data", {}).items():
                if kind.startswith("image/") and len(base64.b64decode(data)) > LARGEST:
                    found.append("%s, code cell %d: a picture is larger than %d bytes" % (name, number, LARGEST))
    return found


def small(output):
    """The output, with a picture that is too large as a smaller one in JPEG."""
    data = base64.b64decode(output.get("data", {}).get("image/png", ""))
    if len(data) <= LARGEST:
        return output
    import PIL.Image
    picture = PIL.Image.open(io.BytesIO(data)).convert("RGB")
    for share in (1, 0.75, 0.5, 0.35, 0.25):
        out = io.BytesIO()
        picture.resize([max(1, round(share * n)) for n in picture.size], PIL.Image.LANCZOS).save(out, "JPEG", quality=85)
        if len(out.getvalue()) <= LARGEST:
            break
    return dict(output, data={"image/jpeg": base64.b64encode(out.getvalue()).decode(), "text/plain": ["a picture"]})


def write(path, page, outputs):
    cells = [cell for cell in page["cells"] if cell["cell_type"] == "code"]
    for number, (cell, now) in enumerate(zip(cells, outputs), 1):
        cell["outputs"], cell["execution_count"] = [small(one) for one in now], number
    path.write_text(json.dumps(page, indent=1, ensure_ascii=False) + "\n")


def main():
    found, here = [], os.getcwd()
    os.environ.setdefault("XDG_CACHE_HOME", tempfile.mkdtemp())
    for path in sorted(NOTEBOOKS.glob("*.ipynb")):
        page = json.loads(path.read_text())
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            outputs = run(page, path.name)
            os.chdir(here)
        if "--check" in sys.argv[1:]:
            found += faults(page, path.name, outputs)
        else:
            write(path, page, outputs)
            print("%s: %d outputs, %d kB" % (path.name, sum(map(len, outputs)), path.stat().st_size // 1000))
    print("\n".join(found), end="\n" * bool(found))
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
