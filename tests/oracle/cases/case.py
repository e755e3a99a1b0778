"""One case: seeded inputs and parameters go through a reference network in float64 and in float32, and a file of each keeps them,
the outputs and the gradients (README.md says the names)."""
import hashlib
import json
import math
import os

import compare
import numpy as np
import torch

TYPES = {"float64": "F64", "float32": "F32", "int64": "I64"}
# Float32 has to agree with float64 to this, in the measure of compare.py. The tests allow 1e-4: who misses it is wrong, not unlucky.
SETTLED = 2e-5
MOST_DRAWS = 200


def write(path, tensors, meta):
    """A safetensors file of numpy arrays; the values of meta become text."""
    head, blobs, at = {"__metadata__": {k: str(v) for k, v in meta.items()}}, [], 0
    for name, a in tensors.items():
        a = np.ascontiguousarray(a)
        head[name] = {"dtype": TYPES[str(a.dtype)], "shape": list(a.shape), "data_offsets": [at, at + a.nbytes]}
        blobs.append(a.tobytes())
        at += a.nbytes
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 8)
    with open(path, "wb") as f:
        f.write(len(text).to_bytes(8, "little") + text + b"".join(blobs))


def array(t):
    return t.detach().numpy().copy() if torch.is_tensor(t) else np.asarray(t)


def weigh(y, weights):
    """A scalar that every entry of y changes."""
    return (y * weights.to(y.dtype)).sum()


def hash_fill(shape, tag, scale=1.0):
    """Reproducible values in [-scale, scale) from integer arithmetic alone (all mod 2^32):
    x = k*2654435761 + tag*40503 + 12345;  x ^= x>>16;  x *= 2246822519;  x ^= x>>13;
    x *= 3266489917;  x ^= x>>16;  value = scale * (x / 2^31 - 1), k the row-major index."""
    m = np.uint64(0xFFFFFFFF)
    x = (np.arange(int(np.prod(shape)), dtype=np.uint64) * np.uint64(2654435761) + np.uint64(tag * 40503 + 12345)) & m
    x ^= x >> np.uint64(16)
    x = x * np.uint64(2246822519) & m
    x ^= x >> np.uint64(13)
    x = x * np.uint64(3266489917) & m
    x ^= x >> np.uint64(16)
    return torch.from_numpy((scale * (x.astype(np.float64) / 2.0 ** 31 - 1)).reshape(shape))


class Draw:
    """Seeded numbers for the files of one builder, and where these files go. A builder draws all that it needs from here, so that its
    numbers depend on the seed, on its name and on the number of the draw alone."""

    def __init__(self, out, seed, name, number):
        self.out, self.number, self.files = out, number, []
        key = hashlib.sha256(("%d %s %d" % (seed, name, number)).encode()).digest()
        self.generator = torch.Generator().manual_seed(int.from_bytes(key[:7], "little"))

    def rand(self, *shape, scale=1.0):
        return torch.randn(*shape, generator=self.generator, dtype=torch.float64) * scale

    def init(self, module, gain=1.0):
        """The module in float64, with parameters of the draw: std gain/sqrt(fan_in) for matrices, 1 + 0.1 n for scales of norms."""
        module = module.double()
        with torch.no_grad():
            for name, p in module.named_parameters():
                if p.dim() > 1:
                    p.copy_(self.rand(*p.shape, scale=gain / math.sqrt(p[0].numel())))
                elif name.endswith("weight"):
                    p.copy_(1 + self.rand(*p.shape, scale=0.1))
                else:
                    p.copy_(self.rand(*p.shape, scale=0.1))
            for name, b in module.named_buffers():
                if name.endswith("running_mean"):
                    b.copy_(self.rand(*b.shape, scale=0.1))
                elif name.endswith("running_var"):
                    b.copy_(1 + self.rand(*b.shape, scale=0.1).abs())
        return module

    def case(self, name, modules, inputs, function, meta, train=False):
        """Writes NAME_f64 and NAME_f32. function(modules, inputs) gives the outputs, with a scalar "loss". The float32 file has the
        float64 file's inputs and parameters, rounded."""
        for dtype, tag in ((torch.float64, "f64"), (torch.float32, "f32")):
            state = {k: {n: t.clone() for n, t in m.state_dict().items()} for k, m in modules.items()}
            tensors = run({k: m.to(dtype).train(train) for k, m in modules.items()}, inputs, function, dtype, train)
            path = os.path.join(self.out, "%s_%s.safetensors" % (name, tag))
            write(path, tensors, dict(meta, case=name, dtype=tag, train=train, draw=self.number))
            for k, m in modules.items():
                m.to(torch.float64).load_state_dict(state[k])
        self.files.append(os.path.join(self.out, name))

    def settled(self):
        return all(compare.compare(f + "_f32.safetensors", f + "_f64.safetensors")[0][0][0] < SETTLED for f in self.files)


def run(modules, inputs, function, dtype, train):
    """All tensors of one file."""
    tensors = {}
    named = [(k + "." if len(modules) > 1 else "", m) for k, m in modules.items()]
    for prefix, m in named:
        for n, p in m.named_parameters():
            p.grad = None
            tensors["p." + prefix + n] = array(p)
        for n, b in m.named_buffers():
            if b.is_floating_point():
                tensors["buf." + prefix + n] = array(b)
    leaves = {k: v.to(dtype).clone().requires_grad_(True) if v.is_floating_point() else v for k, v in inputs.items()}
    tensors.update({"in." + k: array(v) for k, v in leaves.items()})
    outputs = function(modules, leaves)
    outputs["loss"].backward()
    for k, v in outputs.items():
        tensors[("out." if v.is_floating_point() else "idx.") + k] = array(v)
    for k, v in leaves.items():
        if v.is_floating_point() and v.grad is not None:
            tensors["g.in." + k] = array(v.grad)
    for prefix, m in named:
        tensors.update({"g." + prefix + n: array(p.grad) for n, p in m.named_parameters() if p.grad is not None})
        if train:
            tensors.update({"out.buf." + prefix + n: array(b) for n, b in m.named_buffers() if b.is_floating_point()})
    return tensors


def build(out, seed, builder, number=None):
    """Calls a builder with one draw after the other until float32 agrees with float64, or once, with the draw of that number."""
    for n in range(MOST_DRAWS) if number is None else [number]:
        draw = Draw(out, seed, builder.__name__, n)
        builder(draw)
        if number is not None or draw.settled():
            return
    raise RuntimeError("%s: float32 agrees with float64 in none of %d draws" % (builder.__name__, MOST_DRAWS))
