"""PyTorch's Adam in float32, fifty steps by gradients that follow from a formula: writes oracle/adam_f32.safetensors.

    python3 tests/golden/make_adam_f32.py        # Debian's python3-torch
"""
import array
import json
import os

import torch

SETTINGS = {"default": {}, "beta05": {"betas": (0.5, 0.999)}, "decay": {"weight_decay": 1e-2}}


def hash_fill(count, tag):
    """Values in [-1, 1): hash_fill() of tests/oracle/full_size_test.cpp."""
    out = []
    for k in range(count):
        x = (k * 2654435761 + tag * 40503 + 12345) % 2**32
        x = (x ^ x >> 16) * 2246822519 % 2**32
        x = (x ^ x >> 13) * 3266489917 % 2**32
        out.append((x ^ x >> 16) / 2**31 - 1)
    return torch.tensor(out, dtype=torch.float64).float()


tensors = {}
for name, options in SETTINGS.items():
    w = torch.nn.Parameter(hash_fill(7, 3))
    adam = torch.optim.Adam([w], lr=1e-2, **options)
    for i in range(50):
        w.grad = hash_fill(7, 10 + i)
        adam.step()
        tensors["%s.%d" % (name, i)] = w.tolist()
    state = adam.state[w]
    tensors[name + ".m"], tensors[name + ".v"] = state["exp_avg"].tolist(), state["exp_avg_sq"].tolist()

head = {"__metadata__": {"torch": torch.__version__, "lr": "0.01", "gradients": "hash_fill(7, 10 + i)"}}
data = b""
for name, values in tensors.items():
    head[name] = {"dtype": "F32", "shape": [7], "data_offsets": [len(data), len(data) + 28]}
    data += array.array("f", values).tobytes()
text = json.dumps(head).encode()
text += b" " * (-len(text) % 8)
with open(os.path.join(os.path.dirname(__file__), "oracle", "adam_f32.safetensors"), "wb") as f:
    f.write(len(text).to_bytes(8, "little") + text + data)
