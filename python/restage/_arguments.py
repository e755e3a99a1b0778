"""Wrong arguments of classes and functions of C++ in one line, with the argument's name and what to give.

pybind11 lists signatures and repeats all that it was given. What its line of help says of the arguments is enough to tell which one
is at fault.
"""
import difflib
import functools
import inspect
import numbers
import re

from . import _core


class _Argument(_core.InputError, TypeError):
    """An InputError that is caught as a TypeError, too."""


_Argument.__name__ = _Argument.__qualname__ = "InputError"
_Argument.__module__ = "restage"

_KINDS = {
    "float": (lambda v: isinstance(v, numbers.Real) or hasattr(v, "__float__"), "a number"),
    "int": (lambda v: hasattr(v, "__index__"), "a whole number"),
    "bool": (lambda v: isinstance(v, bool) or type(v).__name__ == "bool_", "True or False"),
    "str": (lambda v: isinstance(v, (str, bytes)), "text"),
    "dict": (lambda v: isinstance(v, dict), "a dict"),
}


def _split(text):
    """At the commas that stand in no brackets."""
    parts, depth = [""], 0
    for c in text:
        depth += (c in "([{") - (c in ")]}")
        if c == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += c
    return [part.strip() for part in parts if part.strip()]


def _arguments_of(line):
    """[(name, kind, needed)] of "f(x: float, n: int = 3, **kwargs) -> None"; whether any further names may be given."""
    inside = re.match(r"\w+\((.*)\) -> ", line)
    if inside is None:
        return None, True
    found, open_end = [], False
    for part in _split(inside[1]):
        name, _, rest = part.partition(":")
        if name.startswith("*"):
            open_end = open_end or len(name) > 1
            continue
        kind, equals, _ = rest.partition(" = ")
        found.append((name.strip(), kind.strip(), not equals))
    return found, open_end


def _shown(value):
    if hasattr(value, "shape") and hasattr(value, "dtype"):
        return f"an array {list(value.shape)}"
    text = repr(value).split("\n")[0]
    return text if len(text) <= 60 else text[:57] + "..."


def _wanted(kind):
    """(fits(value), words) of what an argument may be; None where that is not known."""
    optional = re.fullmatch(r"Optional\[(.*)\]", kind)
    if optional:
        inner = _wanted(optional[1])
        return inner and ((lambda v: v is None or inner[0](v)), inner[1] + " or None")
    if kind in _KINDS:
        return _KINDS[kind]
    ours = re.fullmatch(r"restage\._core\.(\w+)", kind)
    if ours:
        return (lambda v: isinstance(v, getattr(_core, ours[1]))), f"a restage.{ours[1]}"
    return None


def _fault(name, line, given, named):
    """The line that says what is wrong with the arguments `given` and `named` of the function with that line of help."""
    known, open_end = _arguments_of(line)
    generic = f"restage: {name}() takes other arguments; help(restage.{name}) lists them"
    if known is None:
        return generic
    known = [one for one in known if one[0] != "self"]
    names = [one[0] for one in known]
    if len(given) > len(known) and not open_end:
        return f"restage: {name}() takes at most {len(known)} arguments and was given {len(given)}; give {', '.join(names) or 'none'}"
    for key in named:
        if key not in names and not open_end:
            near = difflib.get_close_matches(key, names, 1)
            return f"restage: {name}() has no argument {key!r}; " + (f"did you mean {near[0]!r}?" if near else f"give {', '.join(names) or 'none'}")
        if key in names[:len(given)]:
            return f"restage: {name}(): {key} is given twice, by its place and by its name; give it once"
    values = dict(zip(names, given), **named)
    for key, kind, needed in known:
        wanted = _wanted(kind)
        if needed and key not in values:
            return f"restage: {name}(): {key} is missing; give " + (wanted[1] if wanted else f"it (help(restage.{name}) says what it is)")
        if key in values and wanted and not wanted[0](values[key]):
            return f"restage: {name}(): {key} is {_shown(values[key])}; give {wanted[1]}"
    return generic


def plain(function, name, bound=False):
    """The function with plain messages. bound: its first argument is an object, of which nobody speaks."""
    line = (function.__doc__ or "").split("\n")[0]

    @functools.wraps(function)
    def call(*args, **kwargs):
        try:
            return function(*args, **kwargs)
        except TypeError as error:
            if "incompatible" not in str(error):
                raise
            fault = _fault(name, line, args[1:] if bound else args, kwargs)
        raise _Argument(fault)
    return call


def _say_plainly(cls):
    cls.__init__ = plain(cls.__init__, cls.__name__, bound=True)
    for name, method in list(vars(cls).items()):
        if not name.startswith("_") and inspect.isroutine(method) and not isinstance(method, staticmethod):
            setattr(cls, name, plain(method, f"{cls.__name__}.{name}", bound=True))


# What is called some times a step, and no more: an op or a Var takes no detour.
for _class in (_core.Adam, _core.AdamW, _core.SGD, _core.Lion, _core.Muon, _core.Average, _core.Schedule, _core.Context, _core.Init, _core.Op,
               _core.Parameter, _core.Tape, _core.Tensor):
    _say_plainly(_class)
_core.Schedule.__call__ = plain(_core.Schedule.__call__, "Schedule", bound=True)
convert_joints, gradcheck, load_model, load_safetensors, save_safetensors, set_threads = (
    plain(getattr(_core, name), name) for name in
    ("convert_joints", "gradcheck", "load_model", "load_safetensors", "save_safetensors", "set_threads"))
