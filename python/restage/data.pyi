from typing import Any, Iterator, Mapping

import numpy.typing as npt

from . import Config, Path

Batch = dict[str, npt.NDArray[Any]]

class Batches(Iterator[Batch]):
    def __iter__(self) -> Batches: ...
    def __next__(self) -> Batch: ...
    def at(self, step: int) -> Batch: ...
    def close(self) -> None: ...
    @property
    def step(self) -> int: ...
    @property
    def ready(self) -> int: ...

def clouds(source: Path | Config, *, batch: int | None = None, seed: int | None = None, split: str = "train", start: int = 0,
           steps: int | None = None, ahead: int = 2, data: Mapping[str, Any] | None = None, points: int | None = None,
           rotations: bool | None = None, skin_weights: bool | None = None, noise: float = ..., heading: bool = ...,
           mirror: bool = ..., tpose_share: float = ..., scale_jitter: float = ..., dressed: float = ..., one_camera: float = ...,
           camera_ring: float = ..., remembered: float = ..., **options: Any) -> Batches: ...
def windows(source: Path | Config, *, batch: int | None = None, seed: int | None = None, split: str = "train", start: int = 0,
            steps: int | None = None, ahead: int = 2, data: Mapping[str, Any] | None = None, truth: bool | None = None,
            frames: int = ..., self_share: float = ..., noise: float = ..., noise_correlation: float = ...,
            noisy_translation: bool = ..., heading: bool = ..., mirror: bool = ..., per_motion: bool = ..., translation: str = ...,
            remove_heading: bool = ..., steady_heading: bool = ...) -> Batches: ...
def pairs(source: Path | Config, *, batch: int | None = None, seed: int | None = None, split: str = "train", start: int = 0,
          steps: int | None = None, ahead: int = 2, data: Mapping[str, Any] | None = None, skin_weights: bool | None = None,
          points: int = ..., joint_noise: float = ..., dressed: float = ..., heading: bool = ..., mirror: bool = ...,
          frame_step: int = ...) -> Batches: ...
def transfers(source: Path | Config, *, batch: int | None = None, seed: int | None = None, split: str = "train", start: int = 0,
              steps: int | None = None, ahead: int = 2, data: Mapping[str, Any] | None = None, frames: int | None = None,
              points: int = ..., vertices: int = ..., identity: str = ..., heading: float = ..., shuffle: bool = ...,
              frame_step: int = ...) -> Batches: ...
def examples(config: Path | Config, stage: str, *overrides: str | dict[str, Any], split: str = "train", start: int = 0,
             steps: int | None = None, ahead: int = 2) -> Batches: ...
