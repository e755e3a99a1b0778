import pathlib

from . import ArrayLike, F32, Mesh, Path

class Sequence:
    name: str
    set: str
    folder: pathlib.Path
    def __init__(self, folder: str | pathlib.Path, set: str) -> None: ...
    @property
    def clouds(self) -> list[F32 | None]: ...
    @property
    def target(self) -> Mesh: ...
    def write(self, answers: str | pathlib.Path, vertices: ArrayLike | None = None, joints: ArrayLike | None = None,
              rotations: ArrayLike | None = None) -> pathlib.Path: ...

def sequences(folder: Path, set: str) -> list[Sequence]: ...
