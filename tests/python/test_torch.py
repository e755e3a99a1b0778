"""restage.torch, with a stand-in for PyTorch that has the same names: PyTorch itself is no part of what is built here."""
import itertools
import os
import pickle
import sys
import types

import numpy as np
import pytest
import restage
from restage import data


class Tensor:
    """What restage.torch uses of torch.Tensor."""

    def __init__(self, memory, on_tape=False):
        self.memory, self.on_tape = memory, on_tape

    def detach(self):
        return Tensor(self.memory)

    def cpu(self):
        return self

    def __dlpack__(self, stream=None):
        if self.on_tape:
            raise RuntimeError("Can't export tensors that require gradient, use tensor.detach()")
        return self.memory.__dlpack__()

    def __dlpack_device__(self):
        return self.memory.__dlpack_device__()


class IterableDataset:
    """torch.utils.data.IterableDataset takes no arguments and has no length."""

    def __iter__(self):
        raise NotImplementedError


@pytest.fixture
def torch(monkeypatch):
    """The stand-in, imported as PyTorch would be. worker: of which get_worker_info() tells."""
    def from_numpy(array):
        assert isinstance(array, np.ndarray) and array.flags.writeable, "PyTorch warns of memory that is read-only"
        return Tensor(array)

    package, utils, datasets = (types.ModuleType(name) for name in ("torch", "torch.utils", "torch.utils.data"))
    package.from_numpy, package.from_dlpack, package.utils, utils.data = from_numpy, lambda x: Tensor(np.from_dlpack(x)), utils, datasets
    datasets.IterableDataset, datasets.worker = IterableDataset, None
    datasets.get_worker_info = lambda: datasets.worker
    for module in (package, utils, datasets):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    return package


@pytest.fixture(scope="module")
def corpus(program):
    program.done("data", "build", "--bodies", 2, 1, 1, "--motions", 3, 1, 1, "--quiet", "--out", "torch.h5")
    return str(program.folder / "torch.h5")


def load(torch, dataset, workers):
    """As a DataLoader with batch_size=None: a copy of the data set in each worker, which are asked in turn."""
    parts = []
    for k in range(workers):
        copy, info = pickle.loads(pickle.dumps(dataset)), types.SimpleNamespace(id=k, num_workers=workers)

        def drawn(copy=copy, info=info):
            torch.utils.data.worker = info
            items = iter(copy)
            while True:
                torch.utils.data.worker = info
                try:
                    item = next(items)
                except StopIteration:
                    return
                yield item
        parts.append(drawn())
    for items in itertools.zip_longest(*parts):
        yield from (item for item in items if item is not None)
    torch.utils.data.worker = None


def same(a, b):
    return list(a) == list(b) and all(np.array_equal(a[key].memory if isinstance(a[key], Tensor) else a[key],
                                                     b[key].memory if isinstance(b[key], Tensor) else b[key]) for key in a)


@pytest.mark.parametrize("kind", ["clouds", "windows", "pairs", "transfers"])
def test_batches_are_those_of_restage_data(kind, torch, corpus):
    options = {"batch": 2, "seed": 3, **({"points": 64} if kind != "windows" else {"frames": 8})}
    if kind == "transfers":
        options["vertices"] = 300
    wanted = list(getattr(data, kind)(corpus, steps=3, **options))
    found = getattr(restage.torch, kind)(corpus, steps=3, **options)
    assert isinstance(found, torch.utils.data.IterableDataset) and len(found) == 3
    batches = list(found)
    assert len(batches) == 3 and all(map(same, batches, wanted))
    assert all(isinstance(value, Tensor) for value in batches[0].values())
    assert all(map(same, list(found), wanted)), "it can be gone through again"


def test_any_number_of_workers_gives_the_same_batches_in_order(torch, corpus):
    dataset = restage.torch.clouds(corpus, batch=1, points=32, seed=5, start=2, steps=7)
    wanted = list(data.clouds(corpus, batch=1, points=32, seed=5, start=2, steps=7))
    for workers in (1, 2, 3, 9):
        found = list(load(torch, dataset, workers))
        assert len(found) == 7 and all(map(same, found, wanted)), workers
    parts = [restage.torch.clouds(corpus, batch=1, points=32, seed=5, start=2, steps=7, rank=rank, world=2) for rank in (0, 1)]
    assert [len(part) for part in parts] == [4, 3]
    for workers in (1, 2):
        found = [list(load(torch, part, workers)) for part in parts]
        assert all(map(same, found[0], wanted[0::2])) and all(map(same, found[1], wanted[1::2])), workers


def test_without_an_end(torch, corpus):
    dataset = restage.torch.clouds(corpus, batch=1, points=32)
    assert len(list(itertools.islice(load(torch, dataset, 2), 5))) == 5
    with pytest.raises(TypeError, match="steps="):
        len(dataset)


def test_a_worker_that_is_a_fork(torch, corpus):
    """PyTorch's workers are forks on Linux: the data are first read there."""
    dataset = restage.torch.clouds(corpus, batch=1, points=32, seed=5, steps=2)
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        torch.utils.data.worker = types.SimpleNamespace(id=1, num_workers=2)
        os.write(write, next(iter(dataset))["points"].memory.tobytes())
        os._exit(0)
    os.close(write)
    with os.fdopen(read, "rb") as pipe:
        drawn = pipe.read()
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert drawn == data.clouds(corpus, batch=1, points=32, seed=5).at(1)["points"].tobytes()


def test_examples_of_a_stage(torch, corpus):
    config = restage.Config("lite/all", {"data.source": corpus, "skeleton.optimiser.batch": 2})
    assert same(next(iter(restage.torch.examples(config, "skeleton", steps=1))), next(data.examples(config, "skeleton", steps=1)))


def test_memory_goes_both_ways(torch, corpus):
    array = np.arange(6, dtype=np.float32).reshape(2, 3)
    tensor = restage.torch.tensor(array)
    assert np.shares_memory(tensor.memory, array)
    assert np.shares_memory(restage.torch.arrays(Tensor(array, on_tape=True)), array)
    back = restage.torch.arrays(restage.torch.tensors({"a": array}))
    assert np.shares_memory(back["a"], array)
    array.flags.writeable = False
    assert not np.shares_memory(restage.torch.tensor(array).memory, array)
    own = restage.Tensor(array)
    assert np.array_equal(restage.torch.tensor(own).memory, array)
    restage.torch.tensor(own).memory[:] = 7
    assert np.array_equal(own.numpy(), array), "what a tape may need cannot be written to"
    assert np.array_equal(restage.torch.tensor([[1.0, 2.0]]).memory, [[1, 2]])
    assert np.array_equal(restage.ops.square(restage.torch.tensor(np.ones((1, 2), np.float32))).numpy(), [[1, 1]])


def test_without_pytorch(monkeypatch, corpus):
    monkeypatch.setitem(sys.modules, "torch", None)
    monkeypatch.delitem(sys.modules, "torch.utils.data", raising=False)
    for call in (lambda: restage.torch.clouds(corpus), lambda: restage.torch.tensor(np.ones(2)), lambda: restage.torch.tensors({"a": np.ones(2)})):
        with pytest.raises(restage.InputError, match="needs PyTorch.*restage.data"):
            call()


def test_wrong_wishes(torch, corpus):
    for bad, why in (({"rank": 1}, "rank"), ({"world": 0}, "world"), ({"start": -1}, "start"), ({"steps": 1.5}, "steps"), ({"rank": True}, "rank")):
        with pytest.raises(restage.InputError, match=why):
            restage.torch.clouds(corpus, **bad)
    with pytest.raises(restage.InputError, match="nois"):
        next(iter(restage.torch.clouds(corpus, nois=1)))
