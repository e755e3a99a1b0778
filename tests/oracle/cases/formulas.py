"""Files whose numbers follow from formulas, not from a seed: the networks in full size, and fifty steps of Adam in both precisions."""
import math
import os

import torch
from reference import models as M

from .case import array, hash_fill, write

ADAM = {"default": {}, "beta05": {"betas": (0.5, 0.999)}, "decay": {"weight_decay": 1e-2}}
STEPS, RATE = 50, 1e-2


def hash_init(module):
    """Parameter number i in the order of named_parameters is hash_fill(shape, i, 1/sqrt(fan_in)), in float32. fan_in is the product of all
    axes but the first, or the length of a vector. Scales of norms (vectors named *.weight) get 1 added. Buffers keep their defaults."""
    with torch.no_grad():
        for i, (name, p) in enumerate(module.named_parameters()):
            fan = p[0].numel() if p.dim() > 1 else p.numel()
            p.copy_(hash_fill(tuple(p.shape), i, 1 / math.sqrt(fan)) + (1 if p.dim() == 1 and name.endswith("weight") else 0))
    return module


def outputs(dtype):
    """What every network says to inputs that follow from formulas, too."""
    cloud = hash_fill((1, 1024, 3), 900) * torch.tensor([0.4, 0.9, 0.2]).double()
    joints, trans = hash_fill((1, 4, 22, 3), 901, 0.5), hash_fill((1, 4, 3), 902, 0.1)
    rest, points, axis_angle = hash_fill((1, 22, 3), 903, 0.5), hash_fill((1, 5, 3), 904, 0.5), hash_fill((1, 66), 905, 0.5)

    def said(module, *inputs):
        return hash_init(module).to(dtype).eval()(*[x.to(dtype) for x in inputs])
    out = {"extractor": said(M.PointTransformerExtractor(), cloud), "pointnet": said(M.PointNetExtractor(), cloud)}
    for rot in ("6d", "quat"):
        s = said(M.SMRM(rot), joints, trans, rest)
        out.update({"smrm_%s_joints" % rot: s[2], "smrm_%s_trans" % rot: s[3], "smrm_%s_raw" % rot: s[0]})
    out["w_net"] = said(M.WNet(), M.join_point(rest.flatten(1), points))
    out["o_net"] = said(M.ONet(), M.join_point(axis_angle, points))
    out["third_mlp"] = said(M.RootNet(), rest.flatten(1))
    out["v1_field"] = said(M.V1Field(), (points[0, :, None] - rest).flatten(1))
    out["discriminator"] = said(M.Discriminator(), hash_fill((2, 29, 69), 906), hash_fill((2, 63), 907))
    if dtype == torch.float64:
        out["fps_256"] = M.fps(cloud, 256)
    return out


def full_size(folder):
    tensors = {"hash_probe": array(hash_fill((8,), 5))}
    with torch.no_grad():
        for dtype, tag in ((torch.float64, ".f64"), (torch.float32, ".f32")):
            tensors.update({k + (tag if v.is_floating_point() else ""): array(v) for k, v in outputs(dtype).items()})
    nets = {"extractor": M.PointTransformerExtractor(), "pointnet": M.PointNetExtractor(), "smrm": M.SMRM(), "mlp3": M.WNet(),
            "discriminator": M.Discriminator()}
    order = {"order." + k: " ".join(n for n, _ in m.named_parameters()) for k, m in nets.items()}
    write(os.path.join(folder, "full_size.safetensors"), tensors, {**order, "rule": "hash_init and hash_fill of tests/oracle/cases"})


def adam_f64(folder):
    tensors = {"start": array(hash_fill((7,), 3))}
    for name, options in ADAM.items():
        w = torch.nn.Parameter(hash_fill((7,), 3))
        adam = torch.optim.Adam([w], lr=RATE, **options)
        for i in range(STEPS):
            adam.zero_grad()
            ((w ** 4).sum() + (w * hash_fill((7,), 10 + i)).sum()).backward()
            adam.step()
            tensors["%s.%d" % (name, i)] = array(w)
    write(os.path.join(folder, "adam_f64.safetensors"), tensors, {"lr": RATE, "loss": "sum w^4 + sum w*hash_fill((7,),10+i)"})


def adam_f32(folder):
    """Gradients are given, so that the optimiser alone rounds."""
    tensors = {}
    for name, options in ADAM.items():
        w = torch.nn.Parameter(hash_fill((7,), 3).float())
        adam = torch.optim.Adam([w], lr=RATE, **options)
        for i in range(STEPS):
            w.grad = hash_fill((7,), 10 + i).float()
            adam.step()
            tensors["%s.%d" % (name, i)] = array(w)
        tensors[name + ".m"], tensors[name + ".v"] = array(adam.state[w]["exp_avg"]), array(adam.state[w]["exp_avg_sq"])
    write(os.path.join(folder, "adam_f32.safetensors"), tensors, {"lr": RATE, "gradients": "hash_fill((7,), 10 + i)"})


BUILDERS = (full_size, adam_f64, adam_f32)
