"""Every example of docs/python.md runs, in the order of the page."""
import re
import shutil

from conftest import LITE, ROOT


def test_examples(walk, tmp_path, monkeypatch):
    shutil.copy(walk / "source.h5", tmp_path / "walk.h5")
    shutil.copy(walk / "target.ply", tmp_path / "hero.ply")
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs/python.md").read_text()
    names = {"weights": LITE}
    examples = re.findall(r"^```python\n(.*?)^```$", page, re.M | re.S)
    assert len(examples) >= 8
    for example in examples:
        exec(compile(example, "docs/python.md", "exec"), names)
    assert (tmp_path / "hero_walking.glb").exists() and names["loss"].item() < 2
    assert (tmp_path / "whole.safetensors").exists() and len(names["run"].curves("motion")["step"])
    own = next(example for example in examples if "role=\"motion\"" in example)
    assert own.count("\n") < 60
    assert names["distance"].item() < 0.4  # metres, of the network on the data of the program


def test_readmes_sample(tmp_path, monkeypatch):
    """The lines of README.md on docs/sample, as they stand there."""
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    monkeypatch.chdir(tmp_path)
    lines, = re.findall(r"^```python\n(.*?)^```$", (ROOT / "README.md").read_text(), re.M | re.S)
    exec(compile(lines, "README.md", "exec"), {})
    assert (tmp_path / "hero_moving.glb").stat().st_size > (ROOT / "docs/sample/hero.glb").stat().st_size
    assert b"<html" in (tmp_path / "moving.html").read_bytes()
