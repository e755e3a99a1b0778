"""Arrays of other libraries, in and out: DLPack, __array__, the buffer protocol; pickle and copy."""
import array
import copy
import ctypes
import gc
import multiprocessing
import pickle
import shutil

import numpy as np
import pytest
import restage
from restage import ops

from conftest import LITE

rng = np.random.default_rng(5)
pythonapi = ctypes.pythonapi
pythonapi.PyCapsule_New.restype = ctypes.py_object
pythonapi.PyCapsule_New.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]


class Part(ctypes.Structure):
    _fields_ = [("data", ctypes.c_void_p), ("device", ctypes.c_int32), ("device_id", ctypes.c_int32), ("ndim", ctypes.c_int32),
                ("code", ctypes.c_uint8), ("bits", ctypes.c_uint8), ("lanes", ctypes.c_uint16),
                ("shape", ctypes.POINTER(ctypes.c_int64)), ("strides", ctypes.POINTER(ctypes.c_int64)), ("offset", ctypes.c_uint64)]


DELETER = ctypes.CFUNCTYPE(None, ctypes.c_void_p)


class Old(ctypes.Structure):
    _fields_ = [("tensor", Part), ("owner", ctypes.c_void_p), ("deleter", DELETER)]


class New(ctypes.Structure):
    _fields_ = [("major", ctypes.c_uint32), ("minor", ctypes.c_uint32), ("owner", ctypes.c_void_p), ("deleter", DELETER),
                ("flags", ctypes.c_uint64), ("tensor", Part)]


class Lender:
    """As PyTorch's tensors: nothing but DLPack. `given_back` counts what was returned."""

    def __init__(self, values, device=(1, 0), versioned=True, flags=0, code=None, bits=None, major=1):
        self.values, self.device, self.versioned, self.flags, self.major = values, device, versioned, flags, major
        self.code = {"i": 0, "u": 1, "f": 2, "c": 5, "b": 6}[values.dtype.kind] if code is None else code
        self.bits, self.given_back, self.asked = bits or 8 * values.itemsize, 0, 0

    def __dlpack_device__(self):
        return self.device

    def __dlpack__(self, **words):
        if words and not self.versioned:
            raise TypeError("unexpected keyword argument")
        self.asked += 1
        v, n = self.values, self.values.ndim
        self.kept = ((ctypes.c_int64 * n)(*v.shape), (ctypes.c_int64 * n)(*(s // v.itemsize for s in v.strides)), DELETER(self.back))
        part = Part(v.ctypes.data, *self.device, n, self.code, self.bits, 1, *self.kept[:2], 0)
        self.managed = New(self.major, 0, None, self.kept[2], self.flags, part) if self.versioned else Old(part, None, self.kept[2])
        self.name = ctypes.c_char_p(b"dltensor_versioned" if self.versioned else b"dltensor")
        return pythonapi.PyCapsule_New(ctypes.addressof(self.managed), self.name, None)

    def back(self, _):
        self.given_back += 1


class Array:
    """As h5py's data sets and others: nothing but __array__."""

    def __init__(self, values):
        self.values = values

    def __array__(self, dtype=None, copy=None):
        return self.values if dtype is None else self.values.astype(dtype)


def forms_of(values):
    """The same numbers, by each way in which somebody may offer them."""
    return {"dlpack": Lender(values), "old dlpack": Lender(values, versioned=False), "array": Array(values),
            "buffer": memoryview(np.ascontiguousarray(values)), "tensor": restage.Tensor(values)}


@pytest.mark.parametrize("versioned", [True, False])
def test_a_tensor_of_dlpack(versioned):
    for dtype in ("f4", "f8", "i4", "i8", "u1", "?", "f2"):
        values = rng.normal(size=(4, 3)).astype(dtype)
        assert np.array_equal(restage.Tensor(Lender(values, versioned=versioned)).numpy(), values.astype(restage.Tensor(values).dtype))
    lender = Lender(np.arange(12, dtype=np.float32).reshape(3, 4).T, versioned=versioned)  # strides
    assert np.array_equal(restage.Tensor(lender).numpy(), lender.values)
    gc.collect()
    assert lender.given_back == lender.asked == 1
    for empty in (np.zeros((0, 3), np.float32), np.array(3, np.float32)):
        assert restage.Tensor(Lender(empty, versioned=versioned)).size == empty.size


@pytest.mark.parametrize("versioned", [True, False])
def test_memory_of_dlpack_is_shared(versioned):
    lender = Lender(rng.normal(size=(100, 3)).astype(np.float32), versioned=versioned)
    t = restage.Tensor(lender, copy=False)
    lender.values[0, 0] = 42
    assert t.numpy()[0, 0] == 42 and lender.given_back == 0
    t.assign(np.ones((100, 3)))
    assert (lender.values == 1).all()
    view = t.numpy()
    del t
    gc.collect()
    assert lender.given_back == 0 and (view == 1).all()
    del view
    gc.collect()
    assert lender.given_back == 1


def test_read_only_memory_of_dlpack_is_not_shared():
    lender = Lender(np.ones(3, np.float32), flags=1)
    with pytest.raises(restage.ShapeError, match="cannot be shared"):
        restage.Tensor(lender, copy=False)
    assert restage.Tensor(lender).numpy().tolist() == [1, 1, 1]
    gc.collect()
    assert lender.given_back == lender.asked


def test_memory_of_buffers_is_shared():
    numbers = array.array("f", [1, 2, 3])
    t = restage.Tensor(numbers, copy=False)
    numbers[0] = 9
    assert t.numpy().tolist() == [9, 2, 3]
    with pytest.raises(restage.ShapeError, match="cannot be shared"):
        restage.Tensor(Array(np.ones(3, np.float32)), copy=False)


def test_clouds_and_joints_of_others(walk):
    clouds = restage.load_clouds(walk / "source.h5")[:3]
    expected = restage.retarget(clouds, walk / "target.ply", LITE)
    joints = restage.skeleton(clouds[0], LITE)
    system = restage.System(walk / "target.ply", LITE)
    pushed = system.push(clouds[0])
    for name, cloud in forms_of(clouds[0]).items():
        assert np.array_equal(restage.skeleton(cloud, LITE), joints), name
        system.restart()
        assert np.array_equal(system.push(cloud).vertices, pushed.vertices), name
    several = [forms_of(c) for c in clouds]
    for name in several[0]:
        assert np.array_equal(restage.retarget([s[name] for s in several], walk / "target.ply", LITE).vertices, expected.vertices), name
    block = np.stack([c[:200] for c in clouds])
    whole = restage.skeleton(block, LITE)
    expected = restage.retarget(block, walk / "target.ply", LITE)
    for name, frames in forms_of(block).items():
        assert np.array_equal(restage.skeleton(frames, LITE), whole), name
        assert np.array_equal(restage.retarget(frames, walk / "target.ply", LITE).vertices, expected.vertices), name
    smpl = restage.convert_joints(whole, "makehuman", "smpl")
    closed = restage.closed_form(whole, joints)
    for name, given in forms_of(whole).items():
        assert np.array_equal(restage.convert_joints(given, "makehuman", "smpl"), smpl), name
        assert restage.metrics.mpjpe(given, whole) == 0
        assert np.array_equal(restage.closed_form(given, joints).joints, closed.joints), name


def test_values_of_ops():
    values = rng.normal(size=(2, 3))
    for name, given in forms_of(values).items():
        tape = restage.Tape()
        x = tape.leaf(given)
        assert np.array_equal(ops.sum_all(x * given).backward()[x].numpy(), values), name
        assert np.array_equal(restage.Parameter(given).numpy(), values), name
    single = restage.Tape().leaf(values.astype(np.float32))
    for name, given in forms_of(values).items():  # numbers with a type of their own take no other
        with pytest.raises(restage.InputError):
            ops.mul(single, given)


@pytest.mark.parametrize("use", [lambda x: restage.Tensor(x), lambda x: restage.skeleton(x, LITE), lambda x: restage.metrics.mpjpe(x, x)])
def test_memory_of_a_gpu_is_refused(use):
    values = np.zeros((22, 3), np.float32)
    for device, name in (((2, 1), "CUDA, number 1"), ((14, 0), "kind 14")):
        lender = Lender(values, device)
        with pytest.raises(restage.InputError, match=f"another device .*{name}.*; copy it to the CPU first, as x.cpu"):
            use(lender)
        assert lender.asked == 0
    assert restage.Tensor(Lender(values, (3, 0))).shape == (22, 3)  # memory of the CPU that a GPU sees, too


def test_what_nobody_can_read():
    class WithGradient(Lender):
        def __dlpack__(self, **words):
            raise BufferError("Can't export tensors that require gradient, use tensor.detach()\nmore")

    for bad, why in ((WithGradient(np.ones(3)), r"tensor: is no array: Can't export .* use tensor.detach\(\); give an array of numbers$"),
                     (Lender(np.ones(3, np.int16), code=4), "no numbers of this kind .DLPack's type 4 of 16 bits"),
                     (Lender(np.ones(3), major=2), "too new"), (Lender(np.ones(3, complex)), "complex"), ([[1], [1, 2]], "no array")):
        with pytest.raises(restage.InputError, match=why):
            restage.Tensor(bad)
        gc.collect()
        assert getattr(bad, "given_back", 0) == getattr(bad, "asked", 0)

    class Stops(Lender):
        def __dlpack__(self, **words):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        restage.Tensor(Stops(np.ones(3)))


@pytest.mark.skipif(not hasattr(np, "from_dlpack"), reason="this NumPy has no from_dlpack")
def test_tensors_go_out():
    for dtype in (np.float32, np.float64, np.int32, np.int64):
        t = restage.Tensor(np.arange(6).reshape(2, 3).astype(dtype))
        there = np.from_dlpack(t)
        assert there.dtype == dtype and np.array_equal(there, t.numpy())
        assert there.__array_interface__["data"][0] == t.numpy().__array_interface__["data"][0]
    p = restage.Parameter(rng.normal(size=(300, 300)))
    there, expected = np.from_dlpack(p.value), p.numpy().copy()
    assert np.shares_memory(there, p.numpy()) and np.shares_memory(np.from_dlpack(p), np.asarray(p))
    del p
    gc.collect()
    junk = [np.zeros((300, 300)) for _ in range(20)]
    assert np.array_equal(there, expected) and junk
    assert np.from_dlpack(restage.Tensor(np.zeros((0, 3)))).shape == (0, 3)


def test_the_protocol():
    t = restage.Tensor(np.ones(3, np.float32))
    assert t.__dlpack_device__() == (1, 0)
    for words, name in (({}, '"dltensor"'), ({"max_version": (0, 8)}, '"dltensor"'), ({"max_version": (1, 0)}, '"dltensor_versioned"'),
                        ({"max_version": (2, 5), "stream": None, "dl_device": (1, 0), "copy": True}, '"dltensor_versioned"')):
        assert name in repr(t.__dlpack__(**words))  # and nobody takes it: it is freed

    class Through:
        def __init__(self, **words):
            self.words = words

        def __dlpack_device__(self):
            return t.__dlpack_device__()

        def __dlpack__(self, **words):
            return t.__dlpack__(**{**words, **self.words})

    with pytest.raises(restage.ShapeError, match="cannot be shared"):  # it says that it is only to be read
        restage.Tensor(Through(), copy=False)
    restage.Tensor(Through(copy=True), copy=False).assign([4, 4, 4])
    assert t.numpy().tolist() == [1, 1, 1]
    with pytest.raises(BufferError):
        t.__dlpack__(dl_device=(2, 0))


def test_an_array_times_a_parameter_loses_no_gradient():
    p = restage.Parameter(np.ones(3))
    assert np.array_equal(np.asarray(p, np.float32), np.ones(3))
    with pytest.raises(TypeError):
        np.ones(3) * p
    with pytest.raises(restage.ShapeError, match="Tape.leaf"):
        ops.mul(np.ones(3), p)


# ---- pickle and copy ----

def copies_of(x):
    return [pickle.loads(pickle.dumps(x, protocol)) for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1)] + [copy.copy(x), copy.deepcopy(x)]


def test_copies_of_tensors():
    for values in (np.array([np.nan, -0.0, np.inf, 1e-45], np.float32), rng.normal(size=(2, 1, 3)), np.arange(4, dtype=np.int32),
                   np.array([2**62]), np.zeros((0, 3), np.float32)):
        t = restage.Tensor(values)
        for other in copies_of(t):
            assert type(other) is restage.Tensor and other.dtype == values.dtype and other.shape == values.shape
            assert other.numpy().tobytes() == values.tobytes() and not np.shares_memory(other.numpy(), t.numpy())
    p = restage.Parameter(rng.normal(size=(3, 4)), dtype="float32")
    for other in copies_of(p):
        assert type(other) is restage.Parameter and other.numpy().tobytes() == p.numpy().tobytes()
        other.value.assign(np.zeros((3, 4)))
        tape = restage.Tape()
        x = tape.leaf(p)
        gradients = ops.sum_all(x + tape.leaf(other)).backward()
        assert p.numpy().any() and len(gradients) == 2  # a parameter of its own
    twice = copy.deepcopy([p, p])
    assert twice[0] is twice[1]
    state = list(restage.Tensor(np.ones(3, np.float32)).__getstate__())
    for bad in (state[:2], [state[0], (4,), state[2]], ["float16", *state[1:]]):
        with pytest.raises(ValueError):
            restage.Tensor.__new__(restage.Tensor).__setstate__(tuple(bad))


def test_copies_of_models():
    net = restage.model("deformation/weights", {"width": 8}, seed=3)
    inputs = rng.normal(size=(1, 22, 3)).astype(np.float32), rng.normal(size=(1, 9, 3)).astype(np.float32)
    expected = net(*inputs).numpy().tobytes()
    for made in (net, restage.load_model(LITE, "motion")):
        for other in copies_of(made):
            assert other.name == made.name and other.count() == made.count()
            for name, value in made.state_dict().items():
                assert other.state_dict()[name].numpy().tobytes() == value.numpy().tobytes(), name
    other = copy.deepcopy(net)
    assert other(*inputs).numpy().tobytes() == expected
    for p in other.parameters():
        p.value.assign(np.zeros(p.shape))
    assert net(*inputs).numpy().tobytes() == expected


def joints_in_another_process(extractor, cloud):
    return extractor(cloud)[0]


def test_copies_of_extractors(walk, tmp_path, monkeypatch, sanitized_children):
    cloud = restage.load_clouds(walk / "source.h5")[0]
    shutil.copy(LITE, tmp_path / "mine.safetensors")
    monkeypatch.chdir(tmp_path)
    extractor = restage.Extractor("mine.safetensors", samples=2, seed=7)
    expected = extractor(cloud)[0]
    carried = pickle.dumps(extractor)
    for other in copies_of(extractor):
        assert type(other) is restage.Extractor and np.array_equal(other(cloud)[0], expected)
    monkeypatch.chdir("/")
    assert np.array_equal(pickle.loads(carried)(cloud)[0], expected)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert np.array_equal(pool.apply(joints_in_another_process, (extractor, cloud)), expected)
    changed, _ = restage.load_safetensors(LITE)
    name = next(n for n in changed if n.startswith("skeleton."))
    changed[name].assign(changed[name].numpy() + 1)
    restage.save_safetensors(tmp_path / "mine.safetensors", changed, _)
    with pytest.raises(restage.InputError, match="mine.safetensors: are other weights|mine.safetensors.*other weights"):
        pickle.loads(carried)
    (tmp_path / "mine.safetensors").unlink()
    with pytest.raises(restage.InputError, match="mine.safetensors"):
        pickle.loads(carried)


def test_what_cannot_be_copied(walk):
    p, tape = restage.Parameter(np.ones(3)), restage.Tape()
    x = tape.leaf(p)
    gradients = ops.sum_all(x * 2).backward()
    for whole, why in ((tape, "a Tape cannot"), (tape.leaf(p), "a Var cannot.*value"), (gradients, "Gradients cannot"),
                       (restage.Adam([p]), "state_dict"), (restage.Muon([p]), "state_dict"),
                       (restage.System(walk / "target.ply", LITE), "restage.System.target, weights")):
        for do in (copy.copy, copy.deepcopy, pickle.dumps):
            with pytest.raises(TypeError, match=why):
                do(whole)
