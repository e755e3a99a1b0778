"""Optimisers, schedules and averages, each against a few lines of NumPy."""
import copy
import math
import pickle

import numpy as np
import pytest
import restage
from restage import ops

rng = np.random.default_rng(5)
KINDS = (restage.Adam, restage.AdamW, restage.SGD, restage.Lion, restage.Muon)


def gradients_of(p, g):
    """Gradients whose gradient of p is g."""
    return ops.sum_all(restage.Tape().leaf(p) * g).backward()


def check(make, rule, steps=6, **more):
    """Six steps in float64, the third without a gradient, as rule(w, g, state, rate) makes them."""
    start = rng.normal(size=(3, 4))
    p = restage.Parameter(start)
    optimiser, w, state = make([p]), start.copy(), {}
    for i in range(steps):
        g = rng.normal(size=(3, 4))
        if i == 2:
            optimiser.step(gradients_of(restage.Parameter(np.ones(2)), np.ones(2)))
            continue
        optimiser.step(gradients_of(p, g), rate=0.01 * (i + 1), **more)
        w = rule(w, g, state, 0.01 * (i + 1))
        assert np.allclose(p.numpy(), w, rtol=1e-12, atol=1e-12), i


def adam_move(g, s):
    s["t"] = s.get("t", 0) + 1
    s["m"] = 0.9 * s.get("m", 0) + 0.1 * g
    s["v"] = 0.999 * s.get("v", 0) + 0.001 * g * g
    return (s["m"] / (1 - 0.9 ** s["t"])) / (np.sqrt(s["v"] / (1 - 0.999 ** s["t"])) + 1e-8)


def test_adam():
    check(restage.Adam, lambda w, g, s, r: w - r * adam_move(g, s))
    check(lambda p: restage.Adam(p, weight_decay=0.1), lambda w, g, s, r: w - r * adam_move(g + 0.1 * w, s))


def test_adamw():
    check(restage.AdamW, lambda w, g, s, r: w * (1 - r * 0.01) - r * adam_move(g, s))
    check(lambda p: restage.AdamW(p, weight_decay=0.3), lambda w, g, s, r: w * (1 - r * 0.3) - r * adam_move(g, s))


def sgd(momentum=0.0, nesterov=False, decay=0.0):
    def rule(w, g, s, r):
        g = g + decay * w
        if not momentum:
            return w - r * g
        s["m"] = momentum * s["m"] + g if "m" in s else g
        return w - r * (g + momentum * s["m"] if nesterov else s["m"])
    return rule


def test_sgd():
    check(restage.SGD, sgd())
    check(lambda p: restage.SGD(p, momentum=0.9, weight_decay=0.1), sgd(0.9, decay=0.1))
    check(lambda p: restage.SGD(p, momentum=0.8, nesterov=True), sgd(0.8, True))
    with pytest.raises(restage.InputError, match="nesterov"):
        restage.SGD([restage.Parameter([1.0])], nesterov=True)


def test_lion():
    def rule(w, g, s, r):
        m = s.get("m", np.zeros_like(g))
        w = w * (1 - r * 0.2) - r * np.sign(0.9 * m + 0.1 * g)
        s["m"] = 0.99 * m + 0.01 * g
        return w
    check(lambda p: restage.Lion(p, weight_decay=0.2), rule)


def test_clipping():
    def clip(g, value=None, norm=None):
        g = g if value is None else np.clip(g, -value, value)
        return g if norm is None else g * min(1, norm / (np.linalg.norm(g) + 1e-6))
    check(restage.SGD, lambda w, g, s, r: w - r * clip(g, value=0.3), clip_value=0.3)
    check(restage.SGD, lambda w, g, s, r: w - r * clip(g, norm=0.5), clip=0.5)
    check(restage.SGD, lambda w, g, s, r: w - r * clip(0.5 * g, 0.2, 0.4), scale=0.5, clip_value=0.2, clip=0.4)
    p = restage.Parameter(np.ones(2))
    for wrong in ({"clip": 0}, {"clip": -1}, {"clip_value": float("nan")}, {"clip_value": 0}):
        with pytest.raises(restage.InputError):
            restage.SGD([p]).step(gradients_of(p, np.ones(2)), **wrong)
    assert p.numpy().tolist() == [1, 1]


@pytest.mark.parametrize("kind", KINDS)
def test_states_are_carried_and_nothing_is_copied(kind):
    p, q = (restage.Parameter(np.full((32, 32), 0.5, np.float32)) for _ in range(2))
    options = {"momentum": 0.9} if kind is restage.SGD else {}
    one, other = kind({"w": p}, rate=0.01, **options), kind({"w": q}, rate=0.01, **options)
    g = rng.normal(size=(3, 32, 32)).astype(np.float32)
    one.step(gradients_of(p, g[0]))
    other.step(gradients_of(q, g[0]))
    other.load_state_dict(one.state_dict())
    for x in g[1:]:
        one.step(gradients_of(p, x))
        other.step(gradients_of(q, x))
    assert np.array_equal(p.numpy(), q.numpy())
    assert one.rate == 0.01
    for do in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match="state_dict"):
            do(one)
    for wrong in (-1, float("nan"), float("inf")):
        with pytest.raises(restage.InputError, match="rate"):
            kind([p], rate=wrong)
        with pytest.raises(restage.InputError, match="weight_decay"):
            kind([p], weight_decay=wrong)
    with pytest.raises(restage.InputError):
        other.load_state_dict({"w.nothing": np.ones(3)})


def test_schedules():
    flat = restage.Schedule(10, rate=0.5, warmup=4)
    assert [flat(i) for i in range(6)] == [0.125, 0.25, 0.375, 0.5, 0.5, 0.5]
    cosine = restage.Schedule(steps=11, kind="cosine", rate=2.0, final_fraction=0.1)
    assert np.allclose([cosine(i) for i in range(11)], [2 * (0.1 + 0.9 * (1 + math.cos(math.pi * i / 10)) / 2) for i in range(11)])
    steps = restage.Schedule(10, "milestones", 1.0, milestones=[2, 5], factor=0.5)
    assert [steps(i) for i in (0, 1, 2, 4, 5, 9)] == [1, 1, 0.5, 0.5, 0.25, 0.25]
    for wrong in ({"kind": "wavy"}, {"warmup": -1}, {"milestones": [3, 2], "kind": "milestones"}, {"nothing": 1}, {"rate": -1}, {"rate": float("nan")}):
        with pytest.raises(restage.InputError):
            restage.Schedule(10, **wrong)
    for wrong in (0, -3):
        with pytest.raises(restage.InputError):
            restage.Schedule(wrong)
    with pytest.raises(restage.InputError, match="-1"):
        flat(-1)


def test_averages():
    p, q = restage.Parameter(np.zeros(3)), restage.Parameter(np.zeros(3))
    ema, swa = restage.Average([p], decay=0.5), restage.Average({"q": q})
    sgd_p, sgd_q = restage.SGD([p], rate=1.0), restage.SGD([q], rate=1.0)
    mean, seen = np.zeros(3), []
    for step in range(1, 6):
        g = rng.normal(size=3)
        sgd_p.step(gradients_of(p, g))
        sgd_q.step(gradients_of(q, g))
        ema.update()
        swa.update()
        keep = min(0.5, (1 + step) / (10 + step))
        mean = keep * mean + (1 - keep) * p.numpy()
        seen.append(q.numpy().copy())
    last = p.numpy().copy()
    with ema:
        assert np.allclose(p.numpy(), mean)
        with pytest.raises(restage.WorkError):
            ema.update()
    assert np.array_equal(p.numpy(), last) and ema.updates == 5
    swa.swap()
    assert np.allclose(q.numpy(), np.mean(seen, axis=0))
    swa.swap()
    assert np.array_equal(q.numpy(), seen[-1])
    for wrong in (0, 1, -0.5, 2, float("nan")):
        with pytest.raises(restage.InputError, match="decay"):
            restage.Average([p], decay=wrong)
    for do in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match="Average"):
            do(ema)
