#!/usr/bin/env python3
"""Enforces the include directions of docs/design/architecture.md.

Reads every #include of the sources below the repository root (or the folder given), prints one
line per broken rule and exits with 1 if there is any. Plain Python, no packages.
"""
import pathlib
import re
import sys

SOURCES = {".h", ".hpp", ".cpp", ".cu", ".inc"}
TOP = ("autograd", "nn", "datasets", "train", "infer", "experiments", "python")

BASE, TENSOR = "autograd/base", "autograd/tensor"
ENGINE = [BASE, TENSOR, "autograd/kernels", "autograd/tape", "autograd/ops"]
NN = ["nn", "nn/config", "nn/geometry", "nn/layers", "nn/losses", "nn/metrics", "nn/models", "nn/weights"]
PRODUCT = ENGINE + NN + ["datasets/*", "train/*", "infer/*"]

# What a folder may include besides itself. A name covers that folder only, "name/*" all below it.
MAY_USE = {
    BASE: [],
    TENSOR: [BASE],
    "autograd/kernels": [BASE, TENSOR],
    "autograd/cpu": [BASE, TENSOR, "autograd/kernels"],
    "autograd/cuda": [BASE, TENSOR, "autograd/kernels"],
    "autograd/tape": [BASE, TENSOR, "autograd/kernels"],
    "autograd/ops": [BASE, TENSOR, "autograd/kernels", "autograd/tape"],
    "autograd/gradcheck": ENGINE,
    "nn/config": [BASE],
    "nn": ENGINE,
    "nn/geometry": [BASE],
    "nn/metrics": [BASE, "nn/geometry"],
    "nn/layers": ENGINE + ["nn"],
    "nn/models": ENGINE + ["nn", "nn/config", "nn/geometry", "nn/layers"],
    "nn/losses": ENGINE + ["nn", "nn/geometry", "nn/layers", "nn/models"],
    "nn/weights": [BASE, TENSOR, "nn", "nn/config", "nn/geometry", "nn/models"],
    "datasets/*": ENGINE + NN + ["datasets/*"],
    "infer/*": ENGINE + NN + ["infer/*"],
    "train/artifacts": ENGINE + NN + ["train", "datasets/*"],
    "train/stages": ENGINE + NN + ["train", "train/artifacts", "datasets/*"],
    "train/training": ENGINE + NN + ["train", "train/artifacts", "train/stages", "datasets/*"],
    "train/*": ENGINE + NN + ["train", "train/optim", "train/mpi"],
    "experiments/cli": PRODUCT + ["autograd/gradcheck", "experiments/*"],
    "experiments/reproduce": PRODUCT + ["experiments", "experiments/evaluation", "experiments/pictures", "experiments/search", "experiments/sweep"],
    "experiments/sweep": PRODUCT + ["experiments", "experiments/evaluation", "experiments/observers", "experiments/report", "experiments/search"],
    "experiments/report": PRODUCT + ["experiments", "experiments/evaluation", "experiments/pictures", "experiments/search", "experiments/sweep"],
    "experiments/*": PRODUCT + ["experiments"],
    "python": PRODUCT + ["autograd/gradcheck", "experiments", "experiments/adapt", "experiments/cli",
                         "experiments/evaluation", "experiments/pictures"],
}

# Single files that may reach further: memory and conversions come from the backend.
ALSO = {"autograd/tensor/tensor.cpp": ["autograd/kernels/scratch.h", "autograd/kernels/elementwise.h"],
        "nn/weights/state.cpp": ["autograd/kernels/elementwise.h"],
        "experiments/main.cpp": ["experiments/cli/program.h"]}

# Third-party (and a few system) headers and the only places that may know them.
ONLY_IN = {
    "tbb/": ["autograd/base/parallel.cpp"],
    "spdlog/": ["autograd/base/log.cpp"],
    "sanitizer/": ["autograd/cpu/pool.cpp"],
    "hdf5.h": ["datasets/hdf5/"],
    "yaml-cpp/": ["nn/config/config_yaml.cpp", "nn/weights/", "datasets/importers/rigs/profiles.cpp"],
    "CLI/": ["experiments/cli/command_options.cpp", "experiments/cli/program.cpp"],
    "nanoflann.hpp": ["nn/metrics/", "datasets/doctor/", "infer/registration/"],
    "nlohmann/": ["nn/weights/", "datasets/readers/", "datasets/importers/joints/joint_json.cpp", "datasets/benchmark/manifest.cpp", "datasets/characters/",
                  "datasets/doctor/mended_file.cpp",
                  "datasets/importers/bodies/makehuman_pack.cpp", "datasets/fetch/fetch_cmu.cpp", "train/", "infer/",
                  "experiments/"],
    "mpi.h": ["train/mpi/"],
    "assimp/": ["datasets/readers/fbx/assimp/"],
    "openssl/": ["datasets/readers/sha256.cpp"],
    "stb/": ["infer/render/", "datasets/readers/depth/grey_png.cpp"],
    "webp/": ["infer/render/texture.cpp", "infer/render/webp.cpp"],
    "gif_lib.h": ["infer/render/gif.cpp"],
    "lzma.h": ["datasets/readers/"],
    "zip.h": ["datasets/readers/arrays/zip.cpp"],
    "zlib.h": ["datasets/readers/", "datasets/fetch/"],
    "curl/": ["datasets/fetch/download.cpp"],
    "lo/": ["infer/live/vmc.cpp"],
    "libwebsockets.h": ["infer/live/server.cpp"],
    "hwy/": ["autograd/cpu/"],
    "cublas_v2.h": ["autograd/cuda/"],
    "cuda_runtime.h": ["autograd/cuda/"],
    "cooperative_groups.h": ["autograd/cuda/device_code.h"],
    "cub/": ["autograd/cuda/sort.cu"],
    "Eigen/": ["autograd/cpu/", "autograd/kernels/rotation_rows.h", "autograd/kernels/swing_rows.h",
              "nn/", "datasets/", "train/", "infer/", "experiments/", "python/"],
    "tiny_gltf.h": ["datasets/readers/"],
    "pybind11/": ["python/"],
    "random": [],  # random numbers come from autograd/base/rng.h
    "iostream": ["experiments/"],  # nothing below prints
    "thread": ["autograd/base/", "experiments/", "train/lease.cpp", "train/artifacts/made_once.cpp",  # waiting
               "train/mpi/",  # rows on their way
               "infer/live/",  # clouds that arrive, a page that is served
               "train/run_provenance.cpp",  # counting cores
               "python/feed.h"],  # batches that are drawn ahead
    "future": ["train/ahead.h"],  # the next examples, while a GPU computes
}

# Third parties whose headers a user of the installed library need not have: in no header of it.
NOT_IN_HEADERS = ("nlohmann/", "CLI/")

INCLUDE = re.compile(r'^\s*#\s*include\s*(?:"([^"]+)"|<([^>]+)>)', re.M)


def folder_of(path):
    """The layer of a file: its top folder, or top/sub if it lies deeper."""
    parts = path.split("/")
    return "/".join(parts[:2]) if len(parts) > 2 else parts[0]


def covers(pattern, folder):
    if pattern.endswith("/*"):
        top = pattern[:-2]
        return folder == top or folder.startswith(top + "/")
    return folder == pattern


def allowed_folders(folder):
    if folder in MAY_USE:
        return MAY_USE[folder]
    return next((uses for key, uses in MAY_USE.items() if covers(key, folder)), None)


def check_own(file, target):
    """A quoted include: written from the root, along an arrow."""
    if target.split("/")[0] not in TOP:
        return "includes are written from the repository root"
    here, there = folder_of(file), folder_of(target)
    uses = allowed_folders(here)
    if uses is None:
        return f"{here} is no layer of the architecture: give it a row in cmake/check_layers.py"
    if here == there or target in ALSO.get(file, []) or any(covers(u, there) for u in uses):
        return None
    return f"{here} may not use {there}"


def check_foreign(file, header):
    installed = file.endswith(".h") and not file.endswith("detail.h") and not file.startswith(("experiments/", "python/"))
    if installed and header.startswith(NOT_IN_HEADERS):
        return "not in a header of the library, whose users need not have it"
    for prefix, places in ONLY_IN.items():
        if header == prefix or (prefix.endswith("/") and header.startswith(prefix)):
            if any(file.startswith(place) for place in places):
                return None
            return "only in " + ", ".join(places) if places else "not in the library"
    if "/" in header and not header.startswith("sys/"):
        return "an unknown library: name its one place in cmake/check_layers.py"
    return None


def violations(root):
    for top in TOP:
        for path in sorted((root / top).rglob("*")):
            if path.suffix not in SOURCES or not path.is_file():
                continue
            file = path.relative_to(root).as_posix()
            text = path.read_text(encoding="utf-8", errors="replace")
            for match in INCLUDE.finditer(text):
                own, foreign = match.groups()
                wrong = check_own(file, own) if own else check_foreign(file, foreign)
                if wrong:
                    line = text.count("\n", 0, match.start(1 if own else 2)) + 1
                    yield f"{file}:{line}: {own or foreign}: {wrong}"


def main():
    root = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).parents[1]
    found = list(violations(root))
    for line in found:
        print(line)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
