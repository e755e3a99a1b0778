"""Networks that are written in Python, in the program python3 -m restage: its configurations, runs, sweeps and messages."""
import json
import pathlib
import subprocess
import sys

import pytest
import restage

from conftest import LITE, PROGRAM, python
from restage.__main__ import NETWORKS as NETWORKS_READ
from test_network import NETWORKS, configuration, program


def test_the_program_trains_and_says_how(tmp_path):
    (tmp_path / "mine.py").write_text(NETWORKS.read_text().replace('"tiny/', '"file/'))
    path = configuration(tmp_path, "motion", "file/turns", more="python: [mine.py]\n")
    result = subprocess.run([PROGRAM, "train", path], capture_output=True, text=True)
    assert result.returncode == 2 and "say 'python3 -m restage' in the place of 'restage'" in result.stderr
    result = program("train", path, "--json", cwd="/")
    assert result.returncode == 0, result.stderr
    run = json.loads(result.stdout)["run"]
    assert f"python: [{tmp_path}/mine.py]" in (pathlib.Path(run) / "config.yaml").read_text()
    result = program("eval", f"run={run}", "--json", cwd="/")
    assert result.returncode == 0 and json.loads(result.stdout), result.stderr
    result = program("train", f"resume={run}", "--json", cwd="/")
    assert result.returncode == 0, result.stderr


def test_the_program_tells_errors_of_networks_in_one_line(tmp_path):
    (tmp_path / "mine.py").write_text(NETWORKS.read_text().replace('"tiny/', '"file/').replace(
        "h, state = self.gru", "1 / (0 if ctx.training else 1); h, state = self.gru"))
    path = configuration(tmp_path, "motion", "file/turns", more="python: [mine.py]\n")
    result = program("train", path)
    last = result.stderr.strip().split("\n")[-1]
    assert result.returncode == 1 and "Traceback" in result.stderr
    assert last.startswith("restage: file/turns: forward() failed: ZeroDivisionError") and "mine.py, line" in last
    (tmp_path / "mine.py").write_text("import no_such_module\n")
    result = program("train", path)
    assert result.returncode == 1 and "no_such_module" in result.stderr.strip().split("\n")[-1]
    (tmp_path / "mine.py").unlink()
    result = program("train", path)
    assert result.returncode == 2 and result.stderr.count("\n") == 1
    assert "mine.py: does not exist; give its new place by --python" in result.stderr
    result = program("train", "--python", "no.py")
    assert result.returncode == 2 and "no.py: does not exist" in result.stderr
    result = program("train", "--python", tmp_path)
    assert result.returncode == 2 and "is no file of Python" in result.stderr
    assert "--python FILE.py" in program("--help").stdout.strip().split("\n")[-1]


def test_help_of_commands_that_read_networks_names_the_option():
    tree = json.loads(subprocess.run([PROGRAM, "completion", "json"], capture_output=True, text=True).stdout)
    names = [one["name"] for one in tree["commands"]] + ["%s %s" % (one["name"], part["name"]) for one in tree["commands"] for part in one["commands"]]
    assert set(NETWORKS_READ) <= set(names)
    with_weights = [one["name"] for one in tree["commands"] if any(option["name"] == "--weights" for option in one["options"])]
    assert len(with_weights) > 4 and set(with_weights) <= set(NETWORKS_READ)
    for words in (["retarget", "--help"], ["weights", "export", "-h"], ["sweep", "run", "--help"]):
        assert "--python FILE.py" in program(*words).stdout.strip().split("\n")[-1], words
    for words in (["doctor", "--help"], ["data", "build", "--help"], ["retarget"]):
        assert "--python FILE.py" not in program(*words).stdout, words


def test_info_has_a_row_for_each_layer():
    rows = json.loads(program("info", "tiny/points", "--python", NETWORKS, "--json").stdout)
    assert [(m["name"], m["kind"], m["output"], m["parameters"]) for m in rows["modules"]] == [
        ("each.0", "Linear", "[..., 16]", 64), ("each.1", "Linear", "[..., 16]", 272), ("head.joints", "Linear", "[..., 66]", 1122)]
    assert rows["parameters"] == 64 + 272 + 1122
    text = program("info", "tiny/turns", "--python", NETWORKS).stdout
    assert [line.split()[1:4:2] for line in text.split("\n")[4:8]] == [["gru", "GRU"], ["turn", "Linear"], ["path", "Linear"], ["all", "Turns"]]


def test_weights_show_has_a_row_for_each_network(tmp_path):
    (tmp_path / "mine.py").write_text(NETWORKS.read_text().replace('"tiny/', '"file/'))
    path = configuration(tmp_path, "motion", "file/turns", more="python: [mine.py]\n")
    run = json.loads(program("train", path, "--json").stdout)["run"]
    shown = subprocess.run([PROGRAM, "weights", "show", run], capture_output=True, text=True).stdout
    row, = [line for line in shown.split("\n") if "file/turns |" in line]
    assert [cell.strip() for cell in row.strip("|").split("|")] == ["smrm", "file/turns", "7251", "mine.py"]


@pytest.mark.parametrize("old, new, says", [
    ("def forward(self, ctx, x):\n        n, t = x.joints", "def forward(self, x):\n        n, t = x.joints",
     "takes 2 positional arguments but 3 were given"),
    ("self.path(ctx, h) + x.trans", "self.path(ctx, h) + x.joints", "mine.py, line "),
])
def test_the_program_tells_where_a_call_failed(tmp_path, old, new, says):
    text = NETWORKS.read_text()
    assert old in text
    (tmp_path / "mine.py").write_text(text.replace('"tiny/', '"file/').replace(old, new))
    result = program("train", configuration(tmp_path, "motion", "file/turns", more="python: [mine.py]\n"))
    last = result.stderr.strip().split("\n")[-1]
    assert result.returncode == 1 and last.startswith("restage: file/turns: forward() failed: ") and says in last


def test_a_figure_that_is_nan_is_told_once(tmp_path):
    (tmp_path / "mine.py").write_text(NETWORKS.read_text().replace('"tiny/', '"file/') + """

@restage.model("file/unknown", role="motion")
class Unknown(Turns):
    figures = ("feet",)

    def validate(self, measured):
        return {"feet": float("nan")}
""")
    result = program("train", configuration(tmp_path, "motion", "file/unknown", more="python: [mine.py]\n"))
    assert result.returncode == 0 and result.stderr.count("file/unknown: validate() gave nan for 'feet'") == 1, result.stderr


def test_a_changed_source_does_not_go_on(tmp_path):
    mine = tmp_path / "mine.py"
    mine.write_text(NETWORKS.read_text().replace('"tiny/', '"file/'))
    result = program("train", configuration(tmp_path, "motion", "file/turns", more="python: [mine.py]\n"), "--json")
    assert result.returncode == 0, result.stderr
    run = pathlib.Path(json.loads(result.stdout)["run"])
    mine.write_text(mine.read_text() + "# changed\n")
    result = program("train", f"resume={run}")
    assert result.returncode == 2 and result.stderr.count("\n") == 1
    assert "the source of the network 'file/turns' has changed since the run began; put it back" in result.stderr
    provenance = json.loads((run / "provenance.json").read_text())
    del provenance["networks"]
    (run / "provenance.json").write_text(json.dumps(provenance))
    result = program("train", f"resume={run}")
    assert result.returncode == 0, result.stderr


def test_a_file_that_has_moved_is_given_again(tmp_path):
    mine = tmp_path / "mine.py"
    mine.write_text(NETWORKS.read_text().replace('"tiny/', '"file/'))
    more = f"python: [mine.py]\nskeleton: {{from: {LITE}}}\ndeformation: {{from: {LITE}}}\n"
    result = program("train", configuration(tmp_path, "motion", "file/turns", more=more),
                     "stages=[skeleton,motion,deformation]", "--json")
    assert result.returncode == 0, result.stderr
    run = json.loads(result.stdout)["run"]
    result = subprocess.run([PROGRAM, "weights", "export", "--source", run, "--model", "motion", "--out", tmp_path / "m"],
                            capture_output=True, text=True)
    assert result.returncode == 2 and "the file 'mine.py' defines; import that file first" in result.stderr
    (tmp_path / "new").mkdir()
    new = mine.rename(tmp_path / "new/other.py")
    for words in (("train", f"resume={run}"), ("eval", f"run={run}")):
        result = program(*words)
        assert result.returncode == 2 and "does not exist; give its new place by --python" in result.stderr
        result = program(*words, "--python", new)
        assert result.returncode == 0, result.stderr
    # A file that is still there gives way, too.
    mine.write_text(new.read_text() + "# older\n")
    result = program("train", f"resume={run}", "--python", new)
    assert result.returncode == 0, result.stderr
    mine.unlink()
    result = program("train", f"resume={run}", f"python=[{new}]")
    assert result.returncode == 0 and f"python: [{new}]" in pathlib.Path(run, "config.yaml").read_text(), result.stderr
    new.write_text(new.read_text().replace('"file/turns"', '"file/others"'))
    result = program("train", f"resume={run}", "--python", new)
    assert result.returncode == 2 and "file/turns" in result.stderr and result.stderr.count("\n") == 1


def test_a_script_is_named_by_its_file(tmp_path):
    (tmp_path / "script.py").write_text(NETWORKS.read_text() + "\nrestage.train(__import__('sys').argv[1])\n")
    config = configuration(tmp_path, "motion", "tiny/turns")
    python(tmp_path / "script.py", config, check=True)
    run = next(tmp_path.glob("t-*"))
    result = program("weights", "export", "--source", run, "--model", "motion", "--out", tmp_path / "m")
    assert result.returncode == 2 and "the file 'script.py' defines" in result.stderr


def test_a_sweep_runs_trials_with_it(tmp_path):
    (tmp_path / "mine.py").write_text(NETWORKS.read_text().replace('"tiny/', '"file/'))
    configuration(tmp_path, "motion", "smrm/rot6d", more=f"skeleton: {{from: {LITE}}}\ndeformation: {{from: {LITE}}}\n")
    (tmp_path / "sweep.yaml").write_text(
        "base: smrm_rot6d.yaml\npython: [mine.py]\nset: {stages: [skeleton, motion, deformation], motion.model: file/judged}\n"
        "grid: {motion.sizes.hidden: [8, 12]}\nearly_stop: {metric: motion.calls, after: 1}\n")
    words = ("sweep", "run", "sweep.yaml", "--out", "out", "store=store", "--jobs", 1)
    result = subprocess.run([PROGRAM, *map(str, words)], cwd=tmp_path, capture_output=True, text=True)
    assert result.returncode == 2 and "python3 -m restage" in result.stderr and result.stderr.count("\n") == 1
    result = program(*words, cwd=tmp_path)
    log = "".join(path.read_text() for path in tmp_path.glob("out/trials/*/log.txt"))
    assert result.returncode == 0, result.stderr + log
    assert sorted(restage.sweep_results(tmp_path / "out")["motion.sizes.hidden"]) == [8, 12]
    export = ("sweep", "export", "out", "--engine", "parallel", "--out", "list.txt")
    result = program(*export, cwd=tmp_path)
    assert result.returncode == 2 and "written in Python" in result.stderr and not (tmp_path / "list.txt").exists()
    assert program(*export, "--program", sys.executable, cwd=tmp_path).returncode == 0
    artifacts = len(list((tmp_path / "store").glob("motion-*")))
    # Another source is another question.
    (tmp_path / "mine.py").write_text((tmp_path / "mine.py").read_text() + "\n# changed\n")
    plan = program("sweep", "plan", "sweep.yaml", "--out", "other", "store=store", cwd=tmp_path)
    assert plan.returncode == 0 and artifacts == 2
    assert not {p.name for p in (tmp_path / "out/trials").iterdir()} & {p.name for p in (tmp_path / "other/trials").iterdir()}
