#!/usr/bin/env python3
"""Turns a PyTorch checkpoint (a pickle) into a safetensors file that restage can import.

    python3 docs/convert_pytorch.py model.pth model.safetensors [--key state_dict]
    restage weights import --source model.safetensors --model skeleton/point_transformer \
        [--map names.yaml] --out weights.safetensors

restage itself never reads weights from pickles, which may hide code. This script
uses torch's restricted loader (weights_only), which allows tensors alone. Needs torch and numpy.
Half precision becomes float32; names are kept; `restage weights show` lists them.
"""
import argparse
import json

import torch

NAMES = {torch.float32: "F32", torch.float64: "F64", torch.int32: "I32", torch.int64: "I64"}


def find_state(obj, key):
    """The state dict inside a checkpoint: under `key`, or where training scripts usually put it."""
    for k in [key] if key else ["state_dict", "model_state_dict", "model"]:
        if isinstance(obj, dict) and isinstance(obj.get(k), dict):
            return obj[k]
    if key:
        raise SystemExit("the checkpoint has no dictionary '%s'" % key)
    return obj


def write(path, state):
    head, blobs, at = {}, [], 0
    for name, t in sorted(state.items()):
        t = t.detach().cpu().contiguous()
        if t.dtype in (torch.float16, torch.bfloat16):
            t = t.float()
        if t.dtype not in NAMES:
            raise SystemExit("tensor '%s' has the dtype %s, which restage cannot use" % (name, t.dtype))
        data = t.numpy().tobytes()
        head[name] = {"dtype": NAMES[t.dtype], "shape": list(t.shape), "data_offsets": [at, at + len(data)]}
        blobs.append(data)
        at += len(data)
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 8)
    with open(path, "wb") as f:
        f.write(len(text).to_bytes(8, "little") + text + b"".join(blobs))


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("checkpoint")
    p.add_argument("out")
    p.add_argument("--key", help="name of the state dict inside the checkpoint")
    a = p.parse_args()
    obj = torch.load(a.checkpoint, map_location="cpu", weights_only=True)
    state = {k: v for k, v in find_state(obj, a.key).items() if torch.is_tensor(v)}
    if not state:
        raise SystemExit("no tensors found; name their dictionary with --key")
    write(a.out, state)
    print("wrote %s: %d tensors" % (a.out, len(state)))


if __name__ == "__main__":
    main()
