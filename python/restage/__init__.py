"""Restage: a target performs the motion of a sequence of point clouds.

Metres, y up, right-handed, 30 frames a second, unless an option says otherwise. The same bits as
the program `restage` gives, for any number of threads. docs/python.md has examples.
"""
import json as _json
import os as _os

try:
    from . import _core
except ImportError as _error:
    import glob as _glob
    import sys as _sys
    _built = sorted(_os.path.basename(_f).split(".")[1] for _f in _glob.glob(_os.path.join(_os.path.dirname(__file__), "_core.*.so")))
    _here = f"cpython-{_sys.version_info[0]}{_sys.version_info[1]}"
    if _built and not any(_name.startswith(_here + "-") for _name in _built):
        raise ImportError(f"restage was built for {', '.join(_name.split('-x86')[0] for _name in _built)}, and this is Python "
                          f"{_sys.version_info[0]}.{_sys.version_info[1]}: run that Python, or build restage with this one "
                          f"(-DPython3_EXECUTABLE={_sys.executable})") from _error
    raise
from . import benchmark, data, layers, metrics, ops, torch
from ._arguments import convert_joints, gradcheck, load_model, load_safetensors, save_safetensors, set_threads
from ._core import (Adam, AdamW, Average, Context, Frame, Gradients, Init, InputError, Lion, Model, Muon, NonFiniteError, Op,
                    Parameter, Report, SGD, Schedule, ShapeError, Tape, Tensor, Var, WorkError, models, threads)
from ._files import (Clip, ClosedForm, Mesh, closed_form, load_cloud, load_clouds, load_mesh, load_motion,
                     sweep_results)
from ._grad import no_grad
from ._network import Input, model
from ._retarget import Extractor, Result, System, retarget, skeleton
from ._run import Config, Run, _words
from ._view import View, view

JOINTS = ("pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle", "right_ankle",
          "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head", "left_shoulder",
          "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist")
"""The 22 joints, in the order of every array of joints."""
PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19)
"""The joint above each of them; -1: none."""


def doctor(path, **options):
    """What a file is, what stands out in it and what is wrong with it: `restage doctor PATH --json` as a dict."""
    return command("doctor", _os.fspath(path), **options)


def command(name, *words, **options):
    """Runs any command of the program in this process; returns the document of its --json as a dict.

    restage.command("info", "skeleton/pointnet")["parameters"]; options are the program's, with _ for -.
    """
    text = _core.run(name, *words, **options)
    return _json.loads(text) if text.strip() else {}


__version__ = command("--version")["version"]


def train(config, *overrides, on_step=None, on_validation=None, figures=(), **options):
    """Trains the stages of a configuration, as `restage train CONFIG.yaml key=value ...`; returns its Run, or the forecast of dry_run=True as a dict.

    config: a Config, a YAML file, or "resume=RUN". overrides: words "key=value" or dicts. on_step(stage, done, figures) is called
    after every step; Ctrl-C, or an exception of its own, ends the training after a checkpoint. on_validation(stage, done,
    figures) is called with what a validation measured. A dict that it returns is added to the figures; with False the stage
    ends here. figures: those that it adds and the configuration names in loop.monitor, ["motion.feet_mm"]. options: seed,
    overfit_batches, fast_dev_run, tensorboard, csv, profile, verbose. find_rate="rate.svg" trains nothing and returns suggested rates.
    """
    for name, function in (("on_step", on_step), ("on_validation", on_validation)):
        if function is not None and not callable(function):
            raise InputError(f"restage: {name} is no function; give one of (stage, done, figures)")
    words = config.words() if isinstance(config, Config) else [config]
    told = _json.loads(_core.train(on_step, on_validation, list(figures), options, *words, *_words(overrides)))
    return Run(told["run"]) if told.get("run") else told


__all__ = ["Adam", "AdamW", "Average", "Clip", "ClosedForm", "Config", "Context", "Extractor", "Frame", "Gradients", "Init",
           "Input", "InputError", "JOINTS", "Lion", "Mesh", "Model", "Muon", "NonFiniteError", "Op", "PARENTS", "Parameter",
           "Report", "Result", "Run", "SGD", "Schedule", "ShapeError", "System", "Tape", "Tensor", "Var", "View", "WorkError",
           "benchmark", "closed_form", "command", "convert_joints", "data", "doctor", "gradcheck", "layers", "load_cloud", "load_clouds",
           "load_mesh", "load_model", "load_motion", "load_safetensors",
           "metrics", "model", "models", "no_grad", "ops", "retarget", "save_safetensors", "set_threads", "skeleton",
           "sweep_results", "threads", "train", "view"]
