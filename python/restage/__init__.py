"""Restage: a target performs the motion of a sequence of point clouds.

Metres, y up, right-handed, 30 frames a second, unless an option says otherwise. The same bits as
the program `restage` gives, for any number of threads. docs/python.md has examples.
"""
import json as _json
import os as _os

from . import _core, metrics, ops
from ._core import (Adam, Frame, Gradients, InputError, Model, Muon, NonFiniteError, Op, Parameter, Report, ShapeError, Tape,
                    Tensor, Var, WorkError, convert_joints, gradcheck, load_model, load_safetensors, model, models,
                    save_safetensors, set_threads, threads)
from ._files import (Clip, ClosedForm, Mesh, closed_form, load_cloud, load_clouds, load_mesh, load_motion,
                     sweep_results)
from ._retarget import Extractor, Result, System, retarget, skeleton
from ._run import Config, Run, _words

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


def train(config, *overrides, on_step=None, **options):
    """Trains the stages of a configuration, as `restage train CONFIG.yaml key=value ...`; returns its Run, or the forecast of dry_run=True as a dict.

    config: a Config, a YAML file, or "resume=RUN". overrides: words "key=value" or dicts. on_step(stage, done, figures) is called
    after every step; Ctrl-C, or an exception of its own, ends the training after a checkpoint. options: seed,
    overfit_batches, fast_dev_run, tensorboard, csv, verbose.
    """
    if on_step is not None and not callable(on_step):
        raise InputError("restage: on_step is no function; give one of (stage, done, figures)")
    words = config.words() if isinstance(config, Config) else [config]
    told = _json.loads(_core.train(on_step, options, *words, *_words(overrides)))
    return Run(told["run"]) if told.get("run") else told


__all__ = ["Adam", "Clip", "ClosedForm", "Config", "Extractor", "Frame", "Gradients", "InputError", "JOINTS", "Mesh",
           "Model", "Muon", "NonFiniteError", "Op", "PARENTS", "Parameter", "Report", "Result", "Run", "ShapeError",
           "System", "Tape", "Tensor", "Var", "WorkError", "closed_form", "command", "convert_joints", "doctor",
           "gradcheck", "load_cloud", "load_clouds", "load_mesh", "load_model", "load_motion", "load_safetensors",
           "metrics", "model", "models", "ops", "retarget", "save_safetensors", "set_threads", "skeleton",
           "sweep_results", "threads", "train"]
