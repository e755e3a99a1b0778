"""Tensors, the tape, ops, own ops, gradcheck, models, optimisers."""
import gc
import inspect
import json
import os
import pathlib
import subprocess
import threading

import numpy as np
import pytest
import restage
from restage import ops

from conftest import LITE, STANDARD

rng = np.random.default_rng(2)


def f32(*shape):
    return rng.normal(size=shape).astype(np.float32)


# ---- tensors ----

def test_numpy_in_and_out():
    for dtype in (np.float32, np.float64, np.int32, np.int64):
        a = np.arange(6).reshape(2, 3).astype(dtype)
        t = restage.Tensor(a)
        assert t.shape == (2, 3) and t.dtype == dtype and np.array_equal(t.numpy(), a)
        a[0, 0] = 7
        assert t.numpy()[0, 0] == 0
        assert not np.asarray(t).flags.writeable
    assert restage.Tensor(np.float16([1, 2])).dtype == np.float32
    assert np.array_equal(restage.Tensor(np.arange(12.0).reshape(3, 4).T).numpy(), np.arange(12.0).reshape(3, 4).T)
    assert restage.Tensor(3.0).shape == (1,) and restage.Tensor(np.zeros((0, 3))).shape == (0, 3)
    assert restage.Tensor(np.array([1, 2], ">f8")).numpy().tolist() == [1, 2]


def test_memory_is_shared_and_kept_alive():
    a = f32(1000, 3)
    t = restage.Tensor(a, copy=False)
    a[0, 0] = 42
    assert t.numpy()[0, 0] == 42
    expected = a.copy()
    del a
    gc.collect()
    junk = [np.zeros((1000, 3), np.float32) for _ in range(50)]
    assert np.array_equal(t.numpy(), expected) and junk
    view = restage.Tensor(f32(500, 500)).numpy()
    copy = view.copy()
    gc.collect()
    assert np.array_equal(view, copy)


def test_a_file_in_memory_is_shared(tmp_path):
    a = np.memmap(tmp_path / "points.bin", np.float32, "w+", shape=(100, 3))
    t = restage.Tensor(a, copy=False)
    a[0, 0] = 42
    assert t.numpy()[0, 0] == 42
    with pytest.raises(restage.InputError, match="masked"):
        restage.Tensor(np.ma.masked_array(np.ones(3), [0, 1, 0]))


def test_read_only_memory_is_not_written_to():
    a = np.frombuffer(bytes(24), np.float32)
    t = restage.Tensor(a)
    t.assign(np.ones(6))
    assert not a.any() and t.numpy().all()


@pytest.mark.parametrize("array", [np.frombuffer(bytes(24), np.float32), np.zeros((4, 4), np.float32)[:, ::2], np.zeros(3, ">f4"),
                                   np.zeros(3, np.float16), [1.0, 2.0]], ids=["read only", "strided", "big-endian", "float16", "list"])
def test_memory_that_cannot_be_shared_is_refused(array):
    with pytest.raises(restage.ShapeError, match="cannot be shared"):
        restage.Tensor(array, copy=False)
    assert np.array_equal(restage.Tensor(array).numpy(), np.asarray(array))


def test_assign():
    t = restage.Tensor.zeros((2, 2))
    version = t.version
    t.assign([[1, 2], [3, 4]])
    assert t.numpy().tolist() == [[1, 2], [3, 4]] and t.version > version
    with pytest.raises(restage.ShapeError):
        t.assign([1, 2])


@pytest.mark.parametrize("bad", [None, "x", [[1], [1, 2]], np.zeros(2, complex), np.zeros((1,) * 7), object(), {}],
                         ids=lambda b: type(b).__name__)
def test_no_tensor(bad):
    with pytest.raises(ValueError):
        restage.Tensor(bad)


# ---- the tape ----

def test_gradients_and_operators():
    tape = restage.Tape()
    a, b = tape.leaf(f32(2, 3)), tape.leaf(f32(3))
    assert np.allclose((1 / a).numpy(), 1 / a.numpy()) and np.allclose((3 - b).numpy(), 3 - b.numpy())
    y = ops.sum_all(2 * a * b + a / 4 - b + 1 - (-a))
    grads = tape.backward(y)
    assert np.allclose(grads[a].numpy(), 2 * b.numpy() + 1.25)
    assert np.allclose(grads[b].numpy(), 2 * a.numpy().sum(0) - 2)
    assert grads.norm() > 0 and grads.finite() and len(grads) == 2


def test_a_tape_lives_as_long_as_its_values():
    x = restage.Tape().leaf(np.ones(3))
    y = ops.sum_all(x * x)
    gc.collect()
    assert y.backward()[x].numpy().tolist() == [2, 2, 2]


def test_wrong_use():
    tape = restage.Tape()
    x = tape.leaf(np.ones(3))
    y = ops.sum_all(x)
    for wrong in (lambda: x.backward(), lambda: restage.Tape().backward(y), lambda: ops.add(x, restage.Tape().leaf(np.ones(3))),
                  lambda: tape.leaf(np.ones(3, int)), lambda: ops.sum_all(np.ones(3)).backward(), lambda: tape.leaf(None)):
        with pytest.raises((restage.InputError, restage.WorkError)):
            wrong()
    y = ops.sum_all(x)
    y.backward()
    for stale in (lambda: y.backward(), lambda: x + 1):
        with pytest.raises(restage.WorkError):
            stale()
    x = tape.leaf(np.ones(3))
    y = ops.sum_all(ops.square(x))
    x.value.assign([1, 2, 3])
    with pytest.raises(restage.WorkError, match="changed"):
        y.backward()


def test_a_gradient_is_written_to_alone():
    tape = restage.Tape()
    a, b = tape.leaf(np.ones(4, np.float32)), tape.leaf(np.ones(4, np.float32))
    gradients = ops.sum_all(a + b).backward()
    for leaf in (a, b):
        gradients[leaf].assign(gradients[leaf].numpy() * 0.1)
    assert np.allclose(gradients[a].numpy(), 0.1) and np.allclose(gradients[b].numpy(), 0.1)
    assert gradients.norm() == pytest.approx(0.1 * 8 ** 0.5, rel=1e-6)


def test_gradients_are_of_one_tape():
    one, other = restage.Tape(), restage.Tape()
    inner = [ops.square(tape.leaf(f32(n))).keep_gradient() for tape, n in ((one, 3), (other, 7))]
    gradients = ops.sum_all(inner[0]).backward()
    assert gradients[inner[0]].shape == (3,) and gradients[inner[1]] is None
    with pytest.raises(restage.ShapeError, match="detach"):
        other.leaf(inner[1])


def test_numbers_beside_values():
    x = restage.Tape().leaf(f32(1000))
    assert np.array_equal((x / 3).numpy(), x.numpy() / np.float32(3))
    tiny = restage.Tape().leaf(np.array([1e-30], np.float32))
    assert (tiny / 1e-40).item() == pytest.approx(1e10, rel=1e-4)
    for two in (2, 2.0, np.int64(2), np.float32(2), np.float64(2)):
        assert np.array_equal((x * two).numpy(), (two * x).numpy())
        assert np.array_equal((x * two).numpy(), x.numpy() * 2)
    shape = (np.int64(10), np.prod((10, 10)))
    assert ops.reshape(x, shape).shape == ops.reshape(x, np.array([10, 100])).shape == (10, 100)


def test_numbers_that_ops_refuse():
    x = f32(1, 4, 4)
    for call in (lambda: ops.dropout(x, -1), lambda: ops.bce_with_logits(x, 2), lambda: ops.bce_with_logits(x, np.nan),
                 lambda: ops.smooth_length(x, -1), lambda: ops.layer_norm(x, f32(4), f32(4), eps=-1),
                 lambda: ops.unfold(x, 1 << 62, 1, 0, 1), lambda: ops.unfold(x, 1, 1 << 62, 0, 4),
                 lambda: ops.reshape(x, (True, 16)), lambda: ops.reshape(x, (2.0, 8))):
        with pytest.raises(restage.ShapeError):
            call()


def test_gradcheck_within_gradcheck():
    def f(x):
        restage.gradcheck(ops.square, np.ones(2))
        return ops.square(x)
    assert "calls gradcheck" in repr(restage.gradcheck(f, np.ones(2)))
    assert restage.gradcheck(ops.square, np.ones(2))


def test_names_of_tensors(tmp_path):
    for names in ({"__metadata__": f32(2), "w": f32(2)}, {1: f32(2), "1": f32(2)}):
        with pytest.raises(restage.InputError, match="name|rename"):
            restage.save_safetensors(tmp_path / "x.safetensors", names)
        assert not (tmp_path / "x.safetensors").exists()


def test_a_network_goes_back_into_its_weights(tmp_path):
    """Nothing of what the weights said of it is lost."""
    for weights, role in ((LITE, "motion"), (STANDARD, "motion.late"), (STANDARD, "skeleton")):
        net = restage.load_model(weights, role)
        restage.save_safetensors(tmp_path / "net.safetensors", net.state_dict())
        restage.command("weights", "import", model=net.name, role=role, out=tmp_path / "new.safetensors",
                        **{"from": tmp_path / "net.safetensors", "with": weights})
        (a, said), (b, again) = (restage.load_safetensors(p) for p in (weights, tmp_path / "new.safetensors"))
        settings = [{name: (model["model"], model["settings"]) for name, model in json.loads(m["restage"])["models"].items()} for m in (said, again)]
        assert settings[0] == settings[1] and set(a) == set(b)
        assert all(np.array_equal(a[name].numpy(), b[name].numpy()) for name in a)


def test_two_threads():
    def work(seed, out):
        for _ in range(20):
            tape = restage.Tape()
            x = tape.leaf(np.full((50, 50), seed, np.float32))
            out.append(ops.sum_all(ops.matmul(x, x)).backward()[x].numpy()[0, 0])
    outs = [[], [], []]
    workers = [threading.Thread(target=work, args=(k + 1, out)) for k, out in enumerate(outs)]
    for w in workers:
        w.start()
    for w in workers:
        w.join()
    assert [set(out) for out in outs] == [{100.0}, {200.0}, {300.0}]


# ---- ops ----

def arguments_of(function):
    return [line for line in inspect.getdoc(function).splitlines()][0]


def test_every_op_says_what_it_takes():
    assert len(ops.__all__) >= 60
    for name in ops.__all__:
        assert len(inspect.getdoc(getattr(ops, name)).splitlines()) >= 3, name


def test_ops_refuse_what_does_not_fit():
    """No argument, however wrong, crashes an op."""
    values = [None, 3, -1, 2.5, "x", [], np.zeros(0, np.float32), f32(1), f32(2, 3), f32(2, 3, 3), f32(2, 5, 3), f32(1, 2, 3, 4),
              np.arange(6, dtype=np.int32).reshape(2, 3), np.full((2, 4), 10 ** 6, np.int32), f32(2, 0, 3), np.zeros((3, 3)),
              (2, 3), (-5, 3), 10 ** 30, np.full((2, 5, 3), np.nan, np.float32), f32(2, 22, 3), [-7] * 22]
    for name in ops.__all__:
        op = getattr(ops, name)
        for count in range(1, 13):
            for _ in range(25):
                given = [values[i] for i in rng.integers(0, len(values), count)]
                try:
                    op(*given)
                except (restage.InputError, restage.WorkError, TypeError, MemoryError):
                    pass
                except Exception as error:
                    raise AssertionError((name, given)) from error


def test_ops_are_right():
    x, w, b = f32(4, 5), f32(2, 5), f32(2)
    assert np.allclose(ops.linear(x, w, b, "relu").numpy(), np.maximum(x @ w.T + b, 0), atol=1e-6)
    assert np.allclose(ops.linear(x, w).numpy(), x @ w.T, atol=1e-6)
    assert np.allclose(ops.softmax(x).numpy().sum(1), 1, atol=1e-6)
    assert np.array_equal(ops.concat([x] * 20, 0).numpy(), np.concatenate([x] * 20))
    assert np.array_equal(ops.permute(x, (1, 0)).numpy(), x.T) and ops.reshape(x, -1).shape == (20,)
    assert np.array_equal(ops.slice(x, 1, 1, 3).numpy(), x[:, 1:3])
    assert [p.numpy().tolist() for p in ops.split(x, 1, [2, 3])] == [x[:, :2].tolist(), x[:, 2:].tolist()]
    q, k, v = f32(1, 3, 4), f32(1, 6, 4), f32(1, 6, 2)
    e = np.exp(q @ k.transpose(0, 2, 1))
    assert np.allclose(ops.cross_attention(q, k, v).numpy(), e / e.sum(-1, keepdims=True) @ v, atol=1e-5)
    points = f32(1, 9, 3)
    near = ops.knn(points, points, 3).numpy()
    assert near.dtype == np.int32 and (near[0, :, 0] == np.arange(9)).all()
    assert ops.gather(points, near).shape == (1, 9, 3, 3)
    assert ops.gru(f32(3, 2, 4), f32(2, 5), f32(15, 4), f32(15, 5), f32(15), f32(15)).shape == (3, 2, 5)
    r = ops.axis_angle_to_matrix(0.1 * f32(1, 22, 3))
    posed = ops.forward_kinematics(r, f32(1, 22, 3), f32(1, 3))
    assert ops.joints_of(posed).shape == (1, 22, 3) and ops.rotations_of(posed).shape == (1, 22, 3, 3)
    assert np.allclose(ops.quaternion_to_matrix(ops.matrix_to_quaternion(r)).numpy(), r.numpy(), atol=1e-5)
    assert np.array_equal(ops.dropout(x, 0.5, seed=1).numpy(), ops.dropout(x, 0.5, seed=1).numpy())


# ---- own ops ----

def sigmoid(x):
    return 1 / (1 + np.exp(-x))


def test_an_own_op():
    swish = restage.Op("swish", lambda x: x * sigmoid(x),
                       lambda gy, y, x: gy * (sigmoid(x) + y * (1 - sigmoid(x))))
    report = restage.gradcheck(swish, rng.normal(size=(3, 4)), name="swish")
    assert report and report.compared == 12, report
    dot = restage.Op("dot", lambda a, b: a * b, lambda gy, y, a, b: (gy * b, gy * a), "a[n], b[n]")
    assert restage.gradcheck(lambda a, b: dot(a, b) + swish(a), rng.normal(size=5), rng.normal(size=5))
    wrong = restage.Op("wrong", lambda x: x * x, lambda gy, y, x: gy * x)
    report = restage.gradcheck(wrong, rng.normal(size=3) + 3)
    assert not report and "finite differences say" in report.failures[0]
    tape = restage.Tape()
    x = tape.leaf(f32(3))
    assert np.allclose(ops.sum_all(swish(x)).backward()[x].numpy(), sigmoid(x.numpy()) * (1 + x.numpy() * (1 - sigmoid(x.numpy()))), atol=1e-6)


def test_state_of_another_library():
    """What PyTorch gives: tensors that become arrays, under names of its own."""

    class Tensor:
        def __init__(self, values):
            self.values = values

        def __array__(self, dtype=None):
            return self.values if dtype is None else self.values.astype(dtype)

    state = restage.model("deformation/weights", seed=1).state_dict()
    theirs = {"module." + name: Tensor(value.numpy() + 1) for name, value in state.items()}
    ours = restage.model("deformation/weights", seed=2)
    with pytest.raises(restage.InputError, match="unexpected"):
        ours.load_state_dict(theirs)
    ours.load_state_dict({name.removeprefix("module."): value for name, value in theirs.items()})
    for name, value in ours.state_dict().items():
        assert np.array_equal(value.numpy(), state[name].numpy() + 1), name


def test_own_ops_that_fail():
    def angry(*_):
        raise KeyError("mine")

    tape = restage.Tape()
    x = tape.leaf(f32(3))
    with pytest.raises(KeyError, match="mine"):
        restage.Op("a", angry, angry)(x)
    y = ops.sum_all(restage.Op("b", lambda v: v, angry)(x))
    with pytest.raises(KeyError, match="mine"):
        y.backward()
    for answer in (lambda *_: None, lambda *_: (1, 2), lambda *_: "x", lambda *_: np.zeros(7), lambda *_: np.zeros(3, complex)):
        x = tape.leaf(f32(3))
        y = ops.sum_all(restage.Op("c", lambda v: v, answer)(x))
        try:
            assert np.array_equal(y.backward()[x].numpy(), np.zeros(3))
        except (restage.InputError, restage.WorkError):
            pass
    for forward in (lambda v: None, lambda v: "x", lambda v: np.zeros(3, int), lambda: 0):
        with pytest.raises((restage.InputError, TypeError)):
            restage.Op("d", forward, angry)(f32(3))
    with pytest.raises(restage.InputError):
        restage.Op("e", 1, 2)
    with pytest.raises(KeyError):
        restage.gradcheck(angry, f32(3))

    def stopped(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        restage.gradcheck(restage.Op("f", lambda v: v, stopped), f32(3))


def test_gradcheck_of_ops():
    assert restage.gradcheck(lambda x, w: ops.linear(x, w, activation="relu"), rng.normal(size=(3, 4)), rng.normal(size=(2, 4)))
    before = restage.threads()
    assert restage.gradcheck(lambda x: ops.tanh(2 * x + 1), rng.normal(size=4)) and restage.threads() == before
    assert "gave no Var" in restage.gradcheck(lambda x: 3, f32(2)).failures[0]
    kept = []
    restage.gradcheck(lambda x: kept.append(x) or x * 2, f32(2))
    for dead in kept:
        with pytest.raises((restage.InputError, restage.WorkError)) if dead.on_tape else pytest.raises(ZeroDivisionError):
            dead + 1
            1 / 0


# ---- models and training ----

def small_start():
    start = np.random.default_rng(5)
    x = start.normal(size=(256, 8)).astype(np.float32)
    numbers = {"x": x, "target": np.sin(x.sum(1, keepdims=True)).astype(np.float32)}
    for k, (rows, columns) in enumerate([(32, 8), (32, 32), (1, 32)]):
        numbers["w%d" % k] = start.normal(size=(rows, columns), scale=columns ** -0.5).astype(np.float32)
        numbers["b%d" % k] = np.zeros(rows, np.float32)
    return numbers


def train_mlp(steps=60, threads=0, optimiser=None):
    restage.set_threads(threads)
    start = small_start()
    layers = [(restage.Parameter(start["w%d" % k]), restage.Parameter(start["b%d" % k])) for k in range(3)]
    adam = (optimiser or restage.Adam)([p for layer in layers for p in layer], rate=1e-2)
    losses = []
    for _ in range(steps):
        tape = restage.Tape()
        h = start["x"]
        for k, (w, b) in enumerate(layers):
            h = ops.linear(h, tape.leaf(w), tape.leaf(b), "relu" if k < 2 else "none")
        loss = ops.mse(h, start["target"])
        adam.step(loss.backward())
        losses.append(loss.item())
    restage.set_threads(0)
    return losses, [p.numpy().copy() for layer in layers for p in layer]


def test_the_same_model_in_cpp_gives_the_same_bits(tmp_path):
    """tests/python/small_model.cpp is train_mlp() in C++."""
    restage.save_safetensors(tmp_path / "start.safetensors", small_start())
    program = os.environ.get("RESTAGE_SMALL_MODEL") or str(pathlib.Path(restage.__file__).resolve().parents[2] / "tests/small_model")
    told = subprocess.run([program, tmp_path / "start.safetensors"], capture_output=True, text=True, check=True).stdout
    assert [float(line) for line in told.split()] == train_mlp()[0]


def test_muon():
    losses, weights = train_mlp(optimiser=restage.Muon)
    again, same = train_mlp(threads=1, optimiser=restage.Muon)
    assert losses[-1] < 0.2 * losses[0] and losses != train_mlp()[0]
    assert losses == again and all(np.array_equal(a, b) for a, b in zip(weights, same))
    p = restage.Parameter(np.ones((32, 32), np.float32))
    muon, tape = restage.Muon([p], rate=0.1), restage.Tape()
    muon.step(ops.sum_all(ops.square(tape.leaf(p))).backward())
    state = muon.state_dict()
    assert any(name.startswith("muon.") for name in state)
    other = restage.Muon([p])
    other.load_state_dict(state)
    assert all(np.array_equal(state[k].numpy(), v.numpy()) for k, v in other.state_dict().items())
    for options in ({"momentum": 1}, {"step": 0}, {"rate": -1}, {"rate": float("inf")}, {"step": float("inf")}):
        with pytest.raises(restage.InputError):
            restage.Muon([p], **options)
    with pytest.raises(restage.InputError, match="same Parameter"):
        restage.Muon([p, p])
    q = restage.Parameter(np.ones((32, 32)))  # float64 beside float32
    both, tape = restage.Muon([p, q], rate=0.1), restage.Tape()
    before = both.state_dict()
    grads = (ops.sum_all(ops.square(tape.leaf(p)))).backward()
    for rate in (float("nan"), -1.0):
        with pytest.raises(restage.InputError, match="rate"):
            both.step(grads, rate=rate)
    both.step(grads)
    both.step(ops.sum_all(ops.square(restage.Tape().leaf(q))).backward())
    assert (q.numpy() < 1).all()
    after = both.state_dict()
    for wrong in ({k: v for k, v in before.items() if k != next(reversed(before))}, {**before, "more": before[next(iter(before))]},
                  {k: np.full(v.shape, np.nan, v.dtype) for k, v in before.items()},
                  {k: v.numpy().astype(np.int32) for k, v in before.items()}):
        with pytest.raises(restage.InputError):
            both.load_state_dict(wrong)
        assert all(np.array_equal(after[k].numpy(), v.numpy()) for k, v in both.state_dict().items())


def test_gradients_of_values_between():
    tape = restage.Tape()
    x = tape.leaf(np.array([1.0, 2.0, 3.0]))
    y = ops.square(x).keep_gradient()
    z = ops.exp(x)
    grads = ops.sum_all(y * z).backward()
    assert np.array_equal(grads[y].numpy(), z.numpy()) and grads[z] is None
    assert np.allclose(grads[x].numpy(), z.numpy() * (2 * x.numpy() + y.numpy()))
    assert len(grads) == 1
    with pytest.raises(restage.InputError):
        x.detach().keep_gradient()
    with pytest.raises((restage.InputError, restage.WorkError)):
        y.keep_gradient()  # its tape was consumed


def test_a_small_model_learns():
    losses, weights = train_mlp()
    assert losses[-1] < 0.2 * losses[0]
    for threads in (0, 1, 3):
        again, same = train_mlp(threads=threads)
        assert again == losses and all(np.array_equal(a, b) for a, b in zip(weights, same))


def test_models_by_name(tmp_path):
    net = restage.model("transfer/npt_pool", seed=1)
    assert net.count() == sum(p.size for p in net.parameters()) > 0 and "transfer/npt_pool" in restage.models()
    assert set(net.named_parameters()) <= set(net.state_dict())
    other = restage.model("transfer/npt_pool", seed=2)
    restage.save_safetensors(tmp_path / "w.safetensors", net.state_dict(), {"made": "here"})
    state, metadata = restage.load_safetensors(tmp_path / "w.safetensors")
    assert metadata == {"made": "here"}
    other.load_state_dict(state)
    pose, identity = f32(1, 1, 40, 3), f32(1, 30, 3)
    assert np.array_equal(net(pose, identity).numpy(), other(pose, identity).numpy())
    state.pop(next(iter(state)))
    with pytest.raises(restage.InputError, match="missing"):
        other.load_state_dict(state)
    tape = restage.Tape()
    y = net(pose, identity, tape=tape, training=True, seed=3)
    assert y.shape == (1, 1, 30, 3)
    grads = ops.mean_all(ops.square(y)).backward()
    p = net.parameters()[0]
    before = p.numpy().copy()
    adam = restage.Adam(net)
    adam.step(grads)
    assert not np.array_equal(before, p.numpy())
    saved = adam.state_dict()
    restage.Adam(net).load_state_dict(saved)
    del net
    gc.collect()
    assert np.isfinite(p.numpy()).all()


def test_models_refuse():
    for bad in ("no/model", "", 3, None):
        with pytest.raises((restage.InputError, TypeError)):
            restage.model(bad)
    with pytest.raises(restage.InputError):
        restage.model("skeleton/pointnet", sizes={"nonsense": 1})
    for name in restage.models():
        net = restage.model(name)
        for given in ((), (f32(1),), (f32(2, 3), f32(2, 3)), (f32(1, 0, 3), f32(1, 5, 3)), (f32(1, 1, 4, 3), f32(2, 5, 3)), (None,),
                      (f32(1, 2, 22, 3), f32(1, 2, 3), f32(2, 22, 3)), (np.zeros((1, 1, 4, 3)), np.zeros((1, 4, 3), int))):
            try:
                net(*given)
            except (restage.InputError, restage.WorkError):
                pass


def test_sizes_and_files_that_cannot_be(tmp_path):
    for sizes in ({"width": 10 ** 9}, {"dropout": 2}, {"width": "many"}, {"width": -1}):
        with pytest.raises(restage.InputError):
            restage.model("deformation/weights", sizes=sizes)
    (tmp_path / "bad.safetensors").write_bytes(b"\xff" * 100)
    for path in (tmp_path / "bad.safetensors", tmp_path / "none", tmp_path, 3):
        with pytest.raises(restage.InputError):
            restage.load_safetensors(path)
        with pytest.raises(restage.InputError):
            restage.load_model(path, "skeleton")
    with pytest.raises((restage.InputError, restage.WorkError)):
        restage.save_safetensors(tmp_path / "no/such/folder", {"a": [1.0]})
    with pytest.raises(restage.InputError):
        restage.save_safetensors(tmp_path / "x", {"a": "text"})


def test_adam_refuses():
    p = restage.Parameter(np.ones(3))
    for wrong in ([1], 3, {"a": 2}, None):
        with pytest.raises(restage.InputError):
            restage.Adam(wrong)
    for options in ({"rate": -1}, {"beta1": 1}, {"eps": 0}, {"rate": float("nan")}):
        with pytest.raises(restage.InputError):
            restage.Adam([p], **options)
    adam = restage.Adam([p], rate=0.5)
    tape = restage.Tape()
    adam.step(ops.sum_all(tape.leaf(np.ones(2))).backward())
    assert p.numpy().tolist() == [1, 1, 1]
    adam.step(ops.sum_all(ops.square(tape.leaf(p))).backward())
    assert np.allclose(p.numpy(), 0.5)
    with pytest.raises(restage.InputError):
        adam.load_state_dict({"nonsense": np.ones(3)})
    for kind in (restage.Var, restage.Gradients, restage.Frame, restage.Model):
        with pytest.raises(TypeError):
            kind()


def test_stubs_name_everything():
    import ast
    import pathlib
    for module, stub in ((restage, "__init__"), (ops, "ops"), (restage.metrics, "metrics"), (restage.data, "data"),
                         (restage.layers, "layers"), (restage.torch, "torch"), (restage.benchmark, "benchmark")):
        tree = ast.parse((pathlib.Path(restage.__file__).parent / f"{stub}.pyi").read_text())
        named = {n.name for n in tree.body if hasattr(n, "name")} | {a.asname for n in tree.body if isinstance(n, ast.ImportFrom) for a in n.names}
        named |= {n.target.id for n in tree.body if isinstance(n, ast.AnnAssign)}
        assert set(module.__all__) <= named, set(module.__all__) - named


def test_config(tmp_path):
    config = restage.Config("demo", "seed=3", {"motion.optimiser.steps": 7, "stages": ["skeleton"], "data.source": "d.h5"})
    assert (config["seed"], config["motion.optimiser.steps"], config["stages"], config["data.source"]) == (3, 7, ["skeleton"], "d.h5")
    assert config["skeleton.from"] is None and len(config) == len(list(config)) > 100
    other = config.replaced("seed=4", name="mine")
    assert (other["seed"], other["name"], other["motion.optimiser.steps"], config["seed"]) == (4, "mine", 7, 3)
    other.save(tmp_path / "c.yaml")
    assert dict(restage.Config(tmp_path / "c.yaml")) == dict(other)
    odd = restage.Config("demo", {"data.source": "a #b: [x].h5", "name": "null", "seed": np.int64(5)})
    assert (odd["data.source"], odd["name"], odd["seed"]) == ("a #b: [x].h5", "null", 5)
    for bad in ("seed=x", "--fast-dev-run", {"motion.optimizer.steps": 1}, {"seed": b"3"}, {"seed": object()}):
        with pytest.raises(restage.InputError):
            restage.Config("demo", bad)
    for nothing in (None, {}, 3):
        with pytest.raises(restage.InputError, match="no name of a file"):
            restage.Config(nothing)
        with pytest.raises(restage.InputError, match="no name of a file"):
            restage.Run(nothing)
    config["stages"].append("motion")
    assert config["stages"] == ["skeleton"], "a Config can be changed"
    assert dict(config.replaced({"motion": {}})) == dict(config)
    assert config.replaced({"stages": np.array(["skeleton", "motion"])})["stages"] == ["skeleton", "motion"]


def test_train(tmp_path):
    config = tmp_path / "c.yaml"
    config.write_text("stages: [deformation]\nrun_root: %s\nname: t\ndata: {bodies: {train: 1, validation: 1, test: 1}, motions: {train: 1, "
                      "validation: 1, test: 1}}\ndeformation: {optimiser: {steps: 4, batch: 2}}\n" % tmp_path)
    seen = []
    run = restage.train(config, on_step=lambda stage, done, figures: seen.append((stage, done)))
    assert seen == [("deformation", k) for k in (1, 2, 3, 4)]
    assert (tmp_path / run / "weights.safetensors").exists()

    assert isinstance(run, restage.Run) and run.stages == ["deformation"] and run.weights.endswith("weights.safetensors")
    curves = run.curves("deformation")
    assert curves["step"].dtype == np.int64 and np.isfinite(curves["loss"]).any()
    assert run.config["deformation.optimiser.steps"] == 4
    with pytest.raises(restage.InputError, match="motion"):
        run.curves("motion")
    with pytest.raises(restage.InputError, match="no folder of a training"):
        restage.Run(tmp_path / "none")
    with pytest.raises(restage.InputError, match="on_step"):
        restage.train("demo", on_step=3)

    (tmp_path / run / "metrics.jsonl").write_text("")  # as before the first row
    assert list(run.curves("deformation")) == ["step"] and len(run.curves("deformation")["step"]) == 0

    def nested(stage, done, figures):
        restage.train(config)

    with pytest.raises(restage.InputError, match="another training is going on"):
        restage.train(config, on_step=nested)

    class Enough(Exception):
        pass

    for last in (2, 4):  # of four

        def stop(stage, done, figures):
            if done == last:
                raise Enough

        with pytest.raises(Enough):
            restage.train(config, on_step=stop)
    with pytest.raises(restage.InputError):
        restage.train(tmp_path / "no.yaml")


@pytest.mark.parametrize("transposed", [False, True])
def test_a_product_with_one_column_has_the_bits_of_a_wider_one(transposed):
    random = np.random.default_rng(5)
    for rows, depth, batch in ((1, 7, ()), (70, 300, ()), (33, 520, (3,))):
        shape = (depth, rows) if transposed else (rows, depth)
        a, b = (random.standard_normal((*batch, *s)).astype(np.float32) for s in (shape, (depth, 9)))
        wide = restage.ops.matmul(a, b, transposed).numpy()
        for k in (0, 8):
            assert np.array_equal(restage.ops.matmul(a, np.ascontiguousarray(b[..., k:k + 1]), transposed).numpy(), wide[..., k:k + 1])
