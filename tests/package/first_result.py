"""first_result.py SAMPLE: what is typed first in Python: README's lines on the scans and the character of SAMPLE (docs/sample), and
one cloud handed over as an array."""
import pathlib
import sys
import tempfile

import numpy
import restage

sample = pathlib.Path(sys.argv[1])
with tempfile.TemporaryDirectory() as folder:
    moving = f"{folder}/hero_moving.glb"
    restage.retarget(sample / "scans", sample / "hero.glb", fps=6, out=moving)
    restage.view(moving).save(f"{folder}/moving.html")
    assert pathlib.Path(folder, "moving.html").stat().st_size > 100_000
system = restage.System(sample / "hero.glb")
cloud = numpy.random.default_rng(0).normal(size=(900, 3)) * [0.2, 0.5, 0.1] + [0, 1, 0]
print(restage.__version__, restage.__file__, system.push(cloud).vertices.shape)
