"""Layers for networks of your own. Names of parameters are PyTorch's.

A layer is an attribute of the network. Its first numbers follow from the seed and from its place in the network, so they
are the same on every machine. Call it with the ctx of the network: self.first(ctx, x).
"""
import numpy as _np

from . import ops as _ops
from ._core import Init as _Init
from ._core import Parameter as _Parameter

_made = 0


def _alone():
    """The numbers of a layer that is in no network: others for each layer of a process."""
    global _made
    _made += 1
    return _Init(0).sub(f"layer {_made}")


def _empty(*shape):
    return _Parameter(_np.zeros(shape, _np.float32))


class Linear:
    """y = x W^T + b over the last axis: x [..., inputs] -> [..., outputs].

    small: begins near zero, so that a network begins with what it adds to.
    """

    def __init__(self, inputs, outputs, bias=True, small=False):
        self.weight = _empty(outputs, inputs)
        self.bias = _empty(outputs) if bias else None
        self._small = small
        self.begin(_alone())

    def begin(self, init):
        outputs, inputs = self.weight.shape
        weight = init.weight((outputs, inputs), inputs, outputs).numpy()
        self.weight.value.assign((weight.astype(_np.float64) * 0.01).astype(_np.float32) if self._small else weight)
        if self.bias is not None and not self._small:
            self.bias.value.assign(init.bias(inputs, outputs))

    def __call__(self, ctx, x, activation="none"):
        bias = None if self.bias is None else ctx.leaf(self.bias)
        return _ops.linear(x, ctx.leaf(self.weight), bias, activation)


class Conv1d:
    """A convolution over the frames of x [n, t, inputs] -> [n, t, outputs] with zeros around ("same")."""

    def __init__(self, inputs, outputs, size):
        self.weight = _empty(outputs, inputs, size)
        self.bias = _empty(outputs)
        self.begin(_alone())

    def begin(self, init):
        outputs, inputs, size = self.weight.shape
        self.weight.value.assign(init.weight((outputs, inputs, size), inputs * size, outputs * size))
        self.bias.value.assign(init.bias(inputs * size, outputs))

    def __call__(self, ctx, x):
        before = (self.weight.shape[2] - 1) // 2
        return _ops.conv1d(x, ctx.leaf(self.weight), ctx.leaf(self.bias), 1, before, x.shape[1])


class LayerNorm:
    """Each row of x [..., width] normalised, times weight, plus bias."""

    def __init__(self, width):
        self.weight = _Parameter(_np.ones(width, _np.float32))
        self.bias = _empty(width)

    def __call__(self, ctx, x):
        return _ops.layer_norm(x, ctx.leaf(self.weight), ctx.leaf(self.bias))


class GRU:
    """Gated recurrent layers: x [n, t, inputs] -> (y [n, t, hidden], the state after the last frame).

    state: what an earlier call gave, for the frames that follow; None: zeros. dropout: between the layers.
    """

    def __init__(self, inputs, hidden, layers=1, dropout=0.0):
        self._hidden, self._layers, self._dropout = hidden, layers, dropout
        for k in range(layers):
            setattr(self, f"weight_ih_l{k}", _empty(3 * hidden, hidden if k else inputs))
            setattr(self, f"weight_hh_l{k}", _empty(3 * hidden, hidden))
            setattr(self, f"bias_ih_l{k}", _empty(3 * hidden))
            setattr(self, f"bias_hh_l{k}", _empty(3 * hidden))
        self.begin(_alone())

    def begin(self, init):
        for name, parameter in vars(self).items():
            if isinstance(parameter, _Parameter):
                parameter.value.assign(init.uniform(parameter.shape, self._hidden ** -0.5, name))

    def __call__(self, ctx, x, state=None):
        n, hidden = x.shape[0], self._hidden
        y, last = _ops.permute(x, (1, 0, 2)), []
        for k in range(self._layers):
            if state is None:
                first = _np.zeros((n, hidden), _np.float32)
            else:
                first = _ops.reshape(_ops.slice(state, 0, k, k + 1), (n, hidden))
            if k:
                y = ctx.dropout(y, self._dropout)
            y = _ops.gru(y, first, *(ctx.leaf(getattr(self, f"{name}_l{k}"))
                                     for name in ("weight_ih", "weight_hh", "bias_ih", "bias_hh")))
            last.append(_ops.slice(y, 0, y.shape[0] - 1, y.shape[0]))
        return _ops.permute(y, (1, 0, 2)), _ops.concat(last, 0)


__all__ = ["Conv1d", "GRU", "LayerNorm", "Linear"]
