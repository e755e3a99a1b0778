"""A page that plays a file or a result, in a notebook's cell."""
import html
import os
import tempfile

import numpy as np

from . import _core
from ._files import Mesh
from ._retarget import Result


class View:
    """A page that plays, without a network. A notebook shows it where a cell ends with it.

    html: the page's text. save(path) writes it for a browser.
    """

    def __init__(self, page, height=480):
        self.html, self.height = page, height

    def save(self, path):
        """Writes the page; its name usually ends in .html."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self.html)

    def _repr_html_(self):
        return (f'<iframe srcdoc="{html.escape(self.html, quote=True)}" width="100%" height="{self.height}" '
                'sandbox="allow-scripts" style="border: 0"></iframe>')

    def __repr__(self):
        return f"View({len(self.html) / 1e6:.1f} MB; save('page.html') writes it)"


def _write_ply(path, vertices, faces):
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
    head += "property float x\nproperty float y\nproperty float z\n"
    if faces is not None:
        head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\n"
    with open(path, "wb") as file:
        file.write((head + "end_header\n").encode())
        file.write(np.ascontiguousarray(vertices, "<f4").tobytes())
        if faces is not None:
            rows = np.empty(len(faces), [("count", "u1"), ("corners", "<i4", 3)])
            rows["count"], rows["corners"] = 3, faces
            file.write(rows.tobytes())


def _frames_of(what):
    """Vertices of each frame, and faces or None, of what is no file."""
    if isinstance(what, Result):
        if what.vertices is None:
            raise _core.InputError("restage: the result has no surface to show; write it to a file and view that")
        return list(what.vertices), what.faces
    if isinstance(what, Mesh):
        return [what.vertices], what.faces if len(what.faces) else None
    what = _core.array_or_same(what, "what")
    if isinstance(what, np.ndarray) and what.ndim == 2:
        what = [what]
    try:
        frames = [np.asarray(frame, np.float32) for frame in what if frame is not None]
    except (TypeError, ValueError):
        frames = []
    if not frames or any(frame.ndim != 2 or frame.shape[1] != 3 or not len(frame) for frame in frames):
        raise _core.InputError("restage: this cannot be shown; give a file, a Result, a Mesh, or clouds [n, 3]")
    return frames, None


def view(what, height=480, **options):
    """A page that shows a file, a Result, a Mesh or clouds, and plays: a View, which a notebook's cell shows.

    what: a file or folder, as `restage view` takes it; what retarget() gave; a Mesh; one cloud [n, 3] or a list of them,
    metres, y up (None: left out). height: of the cell, pixels. options: those of `restage view` for a page, with _ for -:
    title="Walk", clip="Run", every=2, compare="source", truth="truth.h5", sequence=0.
    """
    if isinstance(height, bool) or not isinstance(height, int) or not 50 <= height <= 10000:
        raise _core.InputError(f"restage: height is {height!r}; give pixels, 50 to 10000")
    if "out" in options:
        raise _core.InputError("restage: view() gives a page; write it with view(...).save('page.html'), and pictures with "
                               "restage.command('view', ..., out='picture.png')")
    with tempfile.TemporaryDirectory(prefix="restage-view-") as folder:
        if not isinstance(what, (str, bytes, os.PathLike)):
            frames, faces = _frames_of(what)
            what = os.path.join(folder, "frames")
            os.mkdir(what)
            for k, vertices in enumerate(frames):
                _write_ply(os.path.join(what, f"{k:06d}.ply"), vertices, faces)
            options.setdefault("title", "restage")
        page = os.path.join(folder, "page.html")
        _core.run("view", os.fspath(what), out=page, **options)
        with open(page, encoding="utf-8") as file:
            return View(file.read(), height)
