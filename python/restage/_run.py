"""Config and Run: what a training reads, and what it leaves behind."""
import collections.abc
import copy
import json
import os

import numpy as np

from . import _core


def _command(name, *words, **options):
    return json.loads(_core.run(name, *words, **options))


def _words(overrides):
    """The words "key=value" of words and dicts."""
    out = []
    for part in overrides:
        if isinstance(part, collections.abc.Mapping):
            out += [f"{key}={json.dumps(value, default=_plain)}" for key, value in part.items()
                    if not (isinstance(value, collections.abc.Mapping) and not value)]  # an empty section changes nothing
        elif isinstance(part, str) and not part.startswith("-"):
            out.append(part)
        else:
            raise _core.InputError(f"restage: {part!r} is no override; give 'key=value' or a dict")
    return out


def _plain(value):
    """Paths and NumPy's numbers and arrays."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise _core.InputError(f"restage: {value!r} is no value of a configuration; give numbers, text, lists or dicts")


def _path(value):
    try:
        return os.fspath(value)
    except TypeError:
        raise _core.InputError(f"restage: {value!r} is no name of a file; give a str or a path") from None


class Config(collections.abc.Mapping):
    """A training configuration with every key in force, as `restage train CONFIG --print-config` shows it.

    config: a YAML file, or the name of one that comes with the program ("standard/finetune"). overrides: words
    "key=value", or dicts {"motion.optimiser.steps": 100}. Keys are dotted names; values are numbers, text, lists, None.
    It cannot be changed: replaced() gives another. A wrong key or value is an InputError here, not at the training.
    """

    def __init__(self, config, *overrides):
        self._config = _path(config)
        self._overrides = _words(overrides)
        told = _command("train", self._config, *self._overrides, print_config=True)
        self._text, self._keys = told["config"], told["keys"]

    def replaced(self, *overrides, **sections):
        """The same with other values: replaced("seed=2") or replaced({"motion.optimiser.steps": 100})."""
        return Config(self._config, *self._overrides, *overrides, *([sections] if sections else []))

    def words(self):
        """The words of the command line that mean this configuration."""
        return [self._config, *self._overrides]

    def save(self, path):
        """Writes all keys to a YAML file that trains the same."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self._text)

    def __getitem__(self, key):
        return copy.deepcopy(self._keys[key])

    def __iter__(self):
        return iter(self._keys)

    def __len__(self):
        return len(self._keys)

    def __str__(self):
        return self._text

    def __repr__(self):
        return f"Config({', '.join(map(repr, self.words()))})"


class Run(str):
    """A training's folder. It is the path itself, so that everything that takes a path takes a Run."""

    def __new__(cls, path):
        path = _path(path)
        if not os.path.exists(os.path.join(path, "config.yaml")):
            raise _core.InputError(f"restage: {path}: is no folder of a training; give one that 'restage train' made")
        return super().__new__(cls, path)

    @property
    def config(self):
        """The configuration that was trained."""
        return Config(os.path.join(self, "config.yaml"))

    @property
    def weights(self):
        """The file of the trained weights, or None while the training has not ended."""
        path = os.path.join(self, "weights.safetensors")
        return path if os.path.exists(path) else None

    @property
    def stages(self):
        """The stages that have begun, in their order."""
        return list(dict.fromkeys(row["stage"] for row in self._rows()))

    def curves(self, stage):
        """What was logged of a stage: {"step": int64 [n], "loss": float64 [n], ...}; NaN where a row has no such figure.

        May be called while the training goes on. pandas.DataFrame(run.curves("motion")) is a table.
        """
        rows = [row for row in self._rows() if row["stage"] == stage]
        if not rows and stage in self.config["stages"]:  # nothing was logged so far
            return {"step": np.zeros(0, np.int64)}
        if not rows:
            raise _core.InputError(f"restage: {self}: has no figures of the stage {stage!r}; name one of {self.stages}")
        names = dict.fromkeys(name for row in rows for name, value in row.items()
                              if value is None or isinstance(value, (int, float)))
        out = {name: np.array([np.nan if row.get(name) is None else row[name] for row in rows], np.float64) for name in names}
        out["step"] = out["step"].astype(np.int64)
        return out

    def evaluate(self, **options):
        """The trained system on its held-out data: `restage eval run=RUN --json` as a dict."""
        return _command("eval", f"run={self}", **options)

    def _rows(self):
        try:
            with open(os.path.join(self, "metrics.jsonl"), encoding="utf-8") as file:
                lines = file.read().split("\n")[:-1]  # what stands behind the last line end is being written
        except OSError as error:
            raise _core.InputError(f"restage: {self}: is no run: {error.strerror}; give the folder of a training") from None
        return [json.loads(line) for line in lines if line]

    def __repr__(self):
        return f"Run({str(self)!r})"
