"""restage.view in a notebook's cell, and answers to the benchmark's sequences."""
import html
import re
import shutil

import numpy as np
import pytest
import restage

from conftest import LITE


def page_in(shown):
    """The page inside the cell."""
    found = re.fullmatch(r'<iframe srcdoc="([^"]*)" .*></iframe>', shown, re.S)
    assert found, shown[:200]
    return html.unescape(found[1])


def test_a_file_a_result_and_clouds(walk, tmp_path):
    of_file = restage.view(walk / "source.h5", height=300, title="Walk & talk")
    assert page_in(of_file._repr_html_()) == of_file.html and 'height="300"' in of_file._repr_html_()
    assert "Walk &amp; talk" in of_file.html and "<script" in of_file.html and "src=\"http" not in of_file.html
    of_file.save(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text() == of_file.html
    result = restage.retarget(walk / "source.h5", walk / "target.ply", LITE)
    few, many = restage.view(result), restage.view(restage.load_mesh(walk / "target.ply"))
    assert len(few.html) > len(many.html) > 10_000  # eight frames and one
    clouds = restage.load_clouds(walk / "source.h5")
    assert len(restage.view(clouds).html) > len(restage.view(clouds[0]).html)
    assert len(restage.view([clouds[0], None]).html) == len(restage.view([clouds[0]]).html)
    assert "save('page.html')" in repr(few)


def test_what_cannot_be_shown(walk):
    for bad in (3, None, [], np.ones((4, 2)), "none.glb", [np.zeros((0, 3))]):
        with pytest.raises(restage.InputError):
            restage.view(bad)
    for options, why in (({"out": "x.png"}, "save"), ({"height": 3}, "height"), ({"zoom": 2}, "zoom"), ({"nonsense": 1}, "nonsense")):
        with pytest.raises(restage.InputError, match=why):
            restage.view(walk / "source.h5", **options)


def test_answers(walk, tmp_path):
    pytest.importorskip("h5py")
    shutil.copytree(walk, tmp_path / "made/test/walk")
    (sequence,) = restage.benchmark.sequences(tmp_path / "made", "test")
    assert (sequence.name, sequence.set, repr(sequence)) == ("walk", "test", "Sequence(test/walk)")
    assert len(sequence.clouds) == 8 and sequence.clouds[0].shape[1] == 3
    still = np.repeat(sequence.target.vertices[None], 8, 0)
    path = sequence.write(tmp_path / "answers", vertices=still)
    assert path == tmp_path / "answers/test/walk.h5" and [p.name for p in path.parent.iterdir()] == ["walk.h5"]
    judged = restage.command("eval", pred=path, truth=walk / "truth.h5")
    assert judged["mean"]["mpvd"] > 0.01 and judged["mean"]["mpjpe"] is None
    for wrong, why in (({}, "no answer"), ({"vertices": still[1:]}, "shape"), ({"joints": np.full((8, 22, 3), np.nan)}, "finite")):
        with pytest.raises(restage.InputError, match=why):
            sequence.write(tmp_path / "other", **wrong)
    assert not (tmp_path / "other").exists()
    for folder, name in ((tmp_path / "made", "naked"), (tmp_path / "none", "test")):
        with pytest.raises(restage.InputError, match="holds no sequences"):
            restage.benchmark.sequences(folder, name)
