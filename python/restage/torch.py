"""The data of restage.data for PyTorch, which is imported when a function here is called.

loader = torch.utils.data.DataLoader(restage.torch.pairs("benchmark", batch=16, seed=1), batch_size=None, num_workers=4)

clouds, windows, pairs, transfers and examples take what those of restage.data take, and give an IterableDataset of
batches: dicts of tensors on the CPU, float32 and in metres. A batch is made by the data set, so the loader gets
batch_size=None.

Batch k is a function of the data, the options, the seed and k. Worker w of n draws the batches w, w + n, w + 2 n ...,
and a loader asks its workers in turn: the batches, and their order, are the same for any number of workers. With
several processes of a training, rank=... and world=... share the batches out in the same way. start=k goes on after
batch k - 1. The data are read where they are first drawn: with workers, in each of them.
"""
import functools as _functools
import importlib as _importlib

import numpy as _np

from . import _core
from . import data as _data

__all__ = ["arrays", "clouds", "examples", "pairs", "tensor", "tensors", "transfers", "windows"]


def _torch():
    try:
        _importlib.import_module("torch.utils.data")
        return _importlib.import_module("torch")
    except ImportError as error:
        raise _core.InputError(f"restage: restage.torch needs PyTorch, and it cannot be imported ({error}); install it, or take "
                               "restage.data, which gives NumPy's arrays") from error


def tensor(array):
    """A tensor of PyTorch over the memory of a NumPy array, a Tensor or a Parameter; read-only memory is copied."""
    torch = _torch()
    if not isinstance(array, _np.ndarray):
        if isinstance(array, (_core.Tensor, _core.Parameter)):
            array = _np.array(array.numpy())  # PyTorch cannot be kept from writing to what a tape still needs
        elif hasattr(array, "__dlpack__"):
            return torch.from_dlpack(array)
        else:
            array = _np.asarray(array)
    return torch.from_numpy(array if array.flags.writeable else array.copy())


def tensors(batch):
    """A batch of restage.data with tensors for its arrays."""
    return {key: tensor(value) for key, value in batch.items()}


def arrays(batch):
    """A batch of tensors, on any device, with NumPy arrays for them; a single tensor as one array."""
    if hasattr(batch, "items"):
        return {key: arrays(value) for key, value in batch.items()}
    for method in ("detach", "cpu"):
        batch = getattr(batch, method)()
    return _np.from_dlpack(batch)


def _whole(name, value, least):
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise _core.InputError(f"restage: {name} is {value!r}; give a whole number from {least}")
    return value


@_functools.lru_cache(maxsize=None)
def _steps_class(base, worker_info):
    class Steps(base):
        """Batches of restage.data as an IterableDataset."""

        def __init__(self, kind, words, options, start, steps, rank, world):
            super().__init__()
            self._made = kind, words, options, start, steps, rank, world

        def __reduce__(self):
            return _made_again, self._made

        def __len__(self):
            _, _, _, _, steps, rank, world = self._made
            if steps is None:
                raise TypeError("these batches have no end; say steps=...")
            return max(0, -(-(steps - rank) // world))

        def __iter__(self):
            kind, words, options, start, steps, rank, world = self._made
            info = worker_info()
            worker, workers = (0, 1) if info is None else (info.id, info.num_workers)
            stride, first = world * workers, rank + world * worker
            if stride == 1:
                for batch in getattr(_data, kind)(*words, start=start, steps=steps, **options):
                    yield tensors(batch)
                return
            batches = getattr(_data, kind)(*words, **{**options, "ahead": 0})
            step = first
            while steps is None or step < steps:
                yield tensors(batches.at(start + step))
                step += stride

    return Steps


def _made_again(*made):
    torch = _torch()
    return _steps_class(torch.utils.data.IterableDataset, torch.utils.data.get_worker_info)(*made)


def _dataset(kind, words, start, steps, rank, world, options):
    _whole("start", start, 0)
    if steps is not None:
        _whole("steps", steps, 0)
    if _whole("rank", rank, 0) >= _whole("world", world, 1):
        raise _core.InputError(f"restage: rank is {rank}; give 0 to {world - 1}, as world is {world}")
    return _made_again(kind, words, options, start, steps, rank, world)


def clouds(source, *, start=0, steps=None, rank=0, world=1, **options):
    """Point clouds of posed bodies, and their joints: restage.data.clouds() as an IterableDataset."""
    return _dataset("clouds", (source,), start, steps, rank, world, options)


def windows(source, *, start=0, steps=None, rank=0, world=1, **options):
    """Windows of motion, and another's skeleton: restage.data.windows() as an IterableDataset."""
    return _dataset("windows", (source,), start, steps, rank, world, options)


def pairs(source, *, start=0, steps=None, rank=0, world=1, **options):
    """The same points of a body at rest and posed: restage.data.pairs() as an IterableDataset."""
    return _dataset("pairs", (source,), start, steps, rank, world, options)


def transfers(source, *, start=0, steps=None, rank=0, world=1, **options):
    """A posed source, a target, and the target in the pose: restage.data.transfers() as an IterableDataset."""
    return _dataset("transfers", (source,), start, steps, rank, world, options)


def examples(config, stage, *overrides, start=0, steps=None, rank=0, world=1, **options):
    """What any stage of a configuration sees: restage.data.examples() as an IterableDataset."""
    return _dataset("examples", (config, stage, *overrides), start, steps, rank, world, options)
