"""Every op of the engine; names and shapes as in C++ (autograd/ops).

Each takes Vars (of Tape.leaf()), Tensors or arrays, all of one type, and returns a Var; it is recorded if an input is on
a tape. Plain numbers and lists take the type of the first Var. Shapes that do not fit are a ShapeError.
"""
from . import _core

__all__ = [_name for _name in dir(_core.ops) if not _name.startswith("_")]
globals().update({_name: getattr(_core.ops, _name) for _name in __all__})
