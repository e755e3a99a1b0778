"""Var as NumPy's users type it, Gradients that add up, no_grad."""
import threading

import numpy as np
import pytest
import restage
from restage import ops

rng = np.random.default_rng(5)


def normal(*shape):
    return rng.normal(size=shape)


def leaf(array):
    return restage.Tape().leaf(array)


def same(f, *arrays, numpy=None, exact=False, **options):
    """f gives Vars what it gives (or `numpy` gives) arrays, and its gradient is right."""
    expected = (numpy or f)(*arrays)
    found = f(*[leaf(a) if k == 0 else restage.Tensor(a) for k, a in enumerate(arrays)])
    assert isinstance(found, restage.Var) and found.on_tape
    assert found.shape == np.shape(expected), (found.shape, np.shape(expected))
    assert (np.array_equal if exact else np.allclose)(found.numpy(), expected)
    assert (report := restage.gradcheck(f, *arrays, **options)), report


# ---- indexing ----

CUBE = normal(4, 5, 3)
INDICES = [
    np.s_[1], np.s_[-1], np.s_[1:3], np.s_[:, 2], np.s_[..., 0], np.s_[:, 1:4, -1], np.s_[None], np.s_[:, None, 1], np.s_[1, 2, 0],
    np.s_[::2], np.s_[::-1], np.s_[3:0:-2], np.s_[:, ::3], np.s_[..., ::-1], np.s_[1, ..., 0], np.s_[1:2, ..., None], np.s_[-3:], np.s_[:],
    np.s_[...], np.s_[()], np.s_[[0, 2, 2]], np.s_[np.array([3, -1])], np.s_[np.array([[0, 1], [2, 2]])], np.s_[:, [1, 1, 4]],
    np.s_[..., [2, 0]], np.s_[[1, 0], 2], np.s_[2, [1, 0]], np.s_[1:, [0, 3], ::2], np.s_[np.int64(2)], np.s_[np.array([1], np.uint8)],
    np.s_[(np.array([0, 1]), slice(1, 3), None)],
]


@pytest.mark.parametrize("index", INDICES, ids=[str(k) for k in range(len(INDICES))])
def test_an_index_is_numpys(index):
    same(lambda v: v[index], CUBE, exact=True)


@pytest.mark.parametrize("index", [np.s_[2:2], np.s_[:, 4:1], np.s_[[]], np.s_[:, np.zeros(0, int)]], ids=range(4))
def test_parts_without_elements(index):
    v = leaf(CUBE)[index]
    assert v.shape == CUBE[index].shape and v.numpy().size == 0


def test_an_index_of_everything_is_the_same_leaf():
    x = leaf(CUBE)
    gradients = x[...].sum().backward()
    assert np.array_equal(gradients[x].numpy(), np.ones(CUBE.shape))
    assert np.array_equal(gradients[x[...]].numpy(), np.ones(CUBE.shape))


def test_wrong_indices_say_what_to_write():
    v = leaf(CUBE)
    for index in (4, -5, np.s_[:, 5], np.s_[0, 0, 0, 0], [4], [-5], np.s_[..., ...], 2 ** 70):
        with pytest.raises(IndexError):
            v[index]
    for index, why in ((CUBE > 0, "flatnonzero"), (True, "flatnonzero"), (v > 0, "flatnonzero"), (np.s_[[0], [1]], "index twice"),
                       (np.s_[0, :, [1, 0]], "index twice"), (np.s_[[1, 0], :, 0], "index twice"), (1.0, "integers"),
                       ([0.5], "integers"), (np.s_[None, None, None, None], "six dimensions")):
        with pytest.raises(restage.InputError, match=why):
            v[index]
    for index in ("a", object()):
        with pytest.raises((restage.InputError, TypeError)):
            v[index]
    with pytest.raises(TypeError, match="mask"):
        v[0] = 1
    with pytest.raises(ValueError):
        v[::0]


def test_rows_can_be_gone_through():
    v = leaf(CUBE)
    assert len(v) == 4 and [row.shape for row in v] == [(5, 3)] * 4
    a, b, c = v[0, 0]
    assert (a * b * c).item() == pytest.approx(CUBE[0, 0].prod())
    for bad in (lambda: len(v[0, 0, 0]), lambda: list(v[0, 0, 0])):
        with pytest.raises(TypeError):
            bad()


# ---- arithmetic ----

@pytest.mark.parametrize("a, b", [((4, 3), (3,)), ((4, 1), (1, 3)), ((3,), (2, 1, 3)), ((1, 1), (2, 3)), ((2, 3), (1,)), ((2, 3), ())], ids=str)
def test_broadcasting(a, b):
    x, y = normal(*a), 1.5 + np.abs(normal(*b))
    for f in (lambda p, q: p + q, lambda p, q: p - q, lambda p, q: p * q, lambda p, q: p / q):
        same(f, x, y)
        same(lambda q, p: f(p, q), y, x)
    same(lambda p, q: p ** q, np.abs(x) + 0.5, y)


def test_shapes_that_cannot_be_broadcast():
    for f in (lambda p, q: p + q, lambda p, q: p > q, lambda p, q: p @ q, lambda p, q: p ** q):
        with pytest.raises(restage.ShapeError):
            f(leaf(normal(2, 3)), normal(4, 5))


@pytest.mark.parametrize("power", [3, 2, 1, 0.5, -1, np.float64(1.5)])
def test_powers(power):
    same(lambda v: v ** power, np.abs(normal(3, 2)) + 0.3)


def test_other_powers():
    same(lambda v: v ** 3, normal(4) - 2)
    same(lambda v: 2 ** v, normal(3))
    same(lambda v: v ** 0, np.array([0.0, 1, -2]), zero_gradient=True)
    x = np.array([0.0, -1, 2])
    for power, slope in ((0, [0, 0, 0]), (1, [1, 1, 1]), (2, [0, -2, 4]), (3, [0, 3, 12])):
        y = leaf(x)
        assert np.array_equal((y ** power).sum().backward()[y].numpy(), slope), power
    same(lambda v: abs(v) + (+v), normal(5))


@pytest.mark.parametrize("a, b", [((2, 3), (3, 4)), ((3,), (3, 4)), ((2, 3), (3,)), ((3,), (3,)), ((5, 2, 3), (3, 4)), ((2, 3), (5, 3, 4)),
                                  ((5, 2, 3), (5, 3, 4)), ((1, 2, 3), (5, 3, 4)), ((2, 1, 2, 3), (3, 3, 2)), ((2, 5, 1, 3), (3,)),
                                  ((3,), (2, 3, 4)), ((6, 1, 2, 3), (6, 2, 3, 2))], ids=str)
def test_products(a, b):
    same(lambda p, q: p @ q, normal(*a), normal(*b))
    same(lambda q, p: p @ q, normal(*b), normal(*a))


def test_an_array_on_the_left():
    a, x = normal(2, 3), normal(3, 2)
    v = leaf(x)
    for found, expected in ((a @ v, a @ x), (a.T + v, a.T + x), (a.T ** 2 * v, a.T ** 2 * x), (np.float64(2) * v, 2 * x),
                            (np.float64(2) ** v, 2 ** x), (a.T > v, a.T > x), (np.sum(v), x.sum()), (np.mean(v, axis=0), x.mean(0)),
                            (np.reshape(v, (2, 3)), x.reshape(2, 3)), (np.transpose(v), x.T)):
        assert isinstance(found, restage.Var) and np.allclose(found.numpy(), expected)


# ---- comparisons ----

def test_comparisons_are_masks():
    a, b = np.round(normal(4, 3)), np.round(normal(3))
    for name in ("__lt__", "__le__", "__gt__", "__ge__", "__eq__", "__ne__"):
        for other in (b, 0, np.float64(1), restage.Tensor(b), list(b), leaf(b)):
            for dtype in (np.float64, np.float32):
                if dtype == np.float32 and not isinstance(other, (int, float, list)):
                    continue
                plain = getattr(a.astype(dtype), name)(np.asarray(other))
                mask = getattr(leaf(a.astype(dtype)), name)(other)
                assert not mask.on_tape and mask.dtype == np.dtype(dtype).name and np.array_equal(mask.numpy(), plain), (name, other)
    nan = leaf(np.array([np.nan, 1.0]))
    assert (nan == nan).numpy().tolist() == [0, 1] and (nan != nan).numpy().tolist() == [1, 0]
    with pytest.raises(restage.ShapeError, match="float32"):
        leaf(np.ones(2)) > np.ones(2, np.float32)


def test_a_mask_chooses():
    a, b = normal(6), normal(6)
    same(lambda p, q: (p > 0) * p + (1 - (p > 0)) * q, a, b, numpy=lambda p, q: np.where(p > 0, p, q))


def test_equality_leaves_identity_alone():
    v, w = leaf(np.ones(2)), leaf(np.ones(2))
    assert {v: 1, w: 2}[w] == 2 and v in [w, v][1:]
    assert not v == None and v != None and not v == "a"  # noqa: E711
    with pytest.raises(TypeError):
        v < None


def test_truth_and_numbers():
    assert leaf([2.0]) and not leaf([0.0]) and float(leaf([2.5])) == 2.5 and (leaf([2.0]) > 1)
    with pytest.raises(restage.InputError, match="any"):
        bool(leaf(np.ones(2)) == 1)
    with pytest.raises(TypeError):
        float(leaf(np.ones(2)))


# ---- methods ----

@pytest.mark.parametrize("axis", [None, 0, 1, -1, (0, 2), (0, 1, 2), (-1, 0), ()], ids=str)
@pytest.mark.parametrize("keepdims", [False, True])
def test_sums(axis, keepdims):
    same(lambda v: v.sum(axis, keepdims=keepdims), CUBE)
    same(lambda v: v.mean(axis, keepdims=keepdims), CUBE)
    if axis != ():
        same(lambda v: v.max(axis, keepdims=keepdims), CUBE)
        same(lambda v: v.min(axis, keepdims=keepdims), CUBE)


def test_sums_of_few_axes():
    for a in (np.array([1.0, 2, 4]), np.array([3.0])):
        for f in (lambda v: v.sum(), lambda v: v.mean(), lambda v: v.max(), lambda v: v[0].sum(), lambda v: v[0].max()):
            same(f, a)
    v = leaf(CUBE)
    for bad in (3, -4, (0, 0), 1.5, "a", True):
        with pytest.raises((restage.InputError, TypeError)):
            v.sum(bad)
    with pytest.raises(TypeError):
        v.sum(dtype=np.float32)


def test_layout():
    for f in (lambda v: v.reshape(5, 12), lambda v: v.reshape((-1, 3)), lambda v: v.reshape(-1), lambda v: v.reshape([60]), lambda v: v.T,
              lambda v: v.transpose(), lambda v: v.transpose(1, 0, 2), lambda v: v.transpose((2, 0, 1)), lambda v: v.transpose(0, -1, 1),
              lambda v: v.swapaxes(0, -1), lambda v: v.swapaxes(1, 1), lambda v: v[0, 0].T):
        same(f, CUBE, exact=True)
    v = leaf(CUBE)
    assert (v.ndim, v.size) == (3, 60)
    for bad in (lambda: v.reshape(7, 9), lambda: v.reshape("a"), lambda: v.reshape(60, order="F"), lambda: v.transpose(0, 1),
                lambda: v.transpose(0, 0, 1), lambda: v.swapaxes(0, 3), lambda: v.transpose(0, 1, 2 ** 31 - 1)):
        with pytest.raises(restage.InputError):
            bad()


def test_in_place_operators_bind_a_new_value():
    x = leaf(np.ones(3))
    y = x
    y += 1
    y *= x
    assert x.numpy().tolist() == [1, 1, 1] and y.numpy().tolist() == [2, 2, 2]
    assert y.sum().backward()[x].numpy().tolist() == [3, 3, 3]


# ---- gradients ----

def test_gradients_add_up():
    a, b = restage.Parameter(normal(2, 3)), restage.Parameter(normal(3))

    def gradients(factor, *which):
        tape = restage.Tape()
        return (factor * sum((tape.leaf(p) ** 2).sum() for p in which)).backward()

    both, one = gradients(1, a, b), gradients(3, a)
    total = both + one
    assert np.allclose(total[a].numpy(), 8 * a.numpy()) and np.allclose(total[b].numpy(), 2 * b.numpy())
    assert np.allclose((one + both)[b].numpy(), 2 * b.numpy()) and one[b] is None and b not in one and b in total
    assert list(total) == [a, b] and list(one) == [a] and [p for p, g in total.items()] == [a, b]
    assert all(np.array_equal(g.numpy(), total[p].numpy()) for p, g in total.items())
    for half in (0.5 * total, total * 0.5, total / 2, np.float64(0.5) * total):
        assert isinstance(half, restage.Gradients) and np.allclose(half[a].numpy(), 4 * a.numpy())
        assert half.norm() == pytest.approx(total.norm() / 2)
    assert np.array_equal(sum([both, one])[a].numpy(), total[a].numpy())
    assert total.norm() == pytest.approx(np.linalg.norm([*8 * a.numpy().ravel(), *2 * b.numpy()]))
    assert np.allclose(both[a].numpy(), 2 * a.numpy()), "a sum must leave its parts as they are"
    for bad in (lambda: both + 1, lambda: both * both, lambda: both * "a", lambda: 1 + both):
        with pytest.raises(TypeError):
            bad()
    for bad in (lambda: both * float("nan"), lambda: both / 0):
        with pytest.raises(restage.InputError):
            bad()


def test_gradients_of_arrays_and_models():
    tape = restage.Tape()
    x = tape.leaf(np.ones(3))
    g = (x * 2).sum().backward()
    assert list(g) == [] and len(g) == 1 and (g + g)[x].numpy().tolist() == [4, 4, 4]
    net = restage.model("deformation/weights", seed=1)
    given = normal(1, 22, 3).astype(np.float32), normal(1, 50, 3).astype(np.float32)
    tape = restage.Tape()
    g = ops.mean_all(ops.square(net(*given, tape=tape))).backward()
    assert set(g) <= set(net.parameters()) and len(list(g)) == len(g) > 0
    again = ops.mean_all(ops.square(net(*given, tape=tape))).backward()
    assert len(list(again)) == len(again) == len(g)


def test_accumulated_halves_are_the_whole():
    w = restage.Parameter(normal(4))
    data = normal(8, 4)

    def gradients(rows):
        return ((rows @ restage.Tape().leaf(w)) ** 2).mean().backward()

    halves = 0.5 * sum(gradients(half) for half in (data[:4], data[4:]))
    assert np.allclose(halves[w].numpy(), gradients(data)[w].numpy())
    restage.Adam([w]).step(halves)


def test_a_tape_is_true():
    assert restage.Tape() and len(restage.Tape()) == 0


# ---- no_grad ----

def test_no_grad():
    tape = restage.Tape()
    x = tape.leaf(np.ones(3))
    before = len(tape)
    net = restage.model("deformation/weights", seed=1)
    given = normal(1, 22, 3).astype(np.float32), normal(1, 50, 3).astype(np.float32)
    cube = restage.Op("cube", lambda a: a ** 3, lambda gy, y, a: 3 * a ** 2 * gy)
    with restage.no_grad():
        for y in (x * 2, 1 - x, x @ x, x[0], x.sum(), ops.exp(x), ops.concat([x, x], 0), ops.split(x, 0, [1, 2])[0], cube(x), abs(x), x.T, x[...],
                  x ** 2, +x, net(*given, tape=tape)):
            assert not y.on_tape
        assert len(tape) == before
        with pytest.raises(restage.InputError, match="no tape"):
            (x * 2).sum().backward()
        with restage.no_grad():
            pass
        assert not (x * 2).on_tape
        seen = []
        other = threading.Thread(target=lambda: seen.append((x * 2).on_tape))
        other.start(), other.join()
        assert seen == [True], "no_grad is of one thread"
    y = x * 2
    assert y.on_tape and y.sum().backward()[x].numpy().tolist() == [2, 2, 2]
    with pytest.raises(ZeroDivisionError):
        with restage.no_grad():
            1 / 0
    assert (leaf(np.ones(2)) * 2).on_tape


def test_no_grad_decorates():
    @restage.no_grad()
    def f(v, deep=2):
        return f(v, deep - 1) if deep else v * 2

    x = leaf(np.ones(2))
    assert not f(x).on_tape and (x * 2).on_tape
