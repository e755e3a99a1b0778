"""Every notebook of docs/notebooks runs, cell by cell, and what is stored in it is what it prints and draws now, but for numbers."""
import json
import sys

import pytest

from conftest import ROOT

sys.path.insert(0, str(ROOT / "docs"))
import make_notebooks  # noqa: E402

NOTEBOOKS = sorted((ROOT / "docs/notebooks").glob("*.ipynb"))


def test_there_are_three():
    assert len(NOTEBOOKS) == 3


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_it_runs_and_says_what_is_stored(path, tmp_path, monkeypatch):
    pytest.importorskip("h5py")
    monkeypatch.chdir(tmp_path)
    page = json.loads(path.read_text())
    outputs = make_notebooks.run(page, path.name)
    assert make_notebooks.faults(page, path.name, outputs) == []
    assert any(cell["outputs"] for cell in page["cells"] if cell["cell_type"] == "code")


def test_other_kinds_are_noticed():
    line = {"output_type": "stream", "name": "stdout", "text": ["loss 0.5, then 0.25\n"]}
    picture = {"output_type": "display_data", "metadata": {}, "data": {"image/png": "", "text/plain": ["picture"]}}

    def found(stored, now):
        cell = {"cell_type": "code", "source": ["f()"], "outputs": stored}
        return make_notebooks.faults({"cells": [cell]}, "page", [now])
    other = dict(line, text=["loss 1e-3, then 7\n"])
    assert found([line, picture], [other, picture]) == []
    assert "code cell 1" in found([line], [dict(line, text=["loss 0.5\n"])])[0]
    assert found([line, picture], [line]) and found([], [line]) and found([picture, line], [line, picture])


def test_they_run_without_a_notebook(tmp_path, monkeypatch):
    """The words of a notebook are a script, too: a picture is named where nothing shows it."""
    monkeypatch.chdir(tmp_path)
    page = {"cells": [{"cell_type": "code", "source": json.loads(NOTEBOOKS[1].read_text())["cells"][1]["source"] + ["\nshow('a.png')"]}]}
    assert NOTEBOOKS[1].stem == "retarget_a_scan"
    make_notebooks.run(page, "page", stand_in=False)
