"""Networks that are written in Python: the decorator, their members, the files that define them."""
import hashlib
import importlib.util
import inspect
import os
import sys

from . import _core

ROLES = ("skeleton", "motion", "deformation.weights", "transfer")


class Input:
    """What a network is shown, by name (x.joints); None where it is not known. Input(joints=..., rest=...) makes one."""

    def __init__(self, **values):
        self.__dict__.update(values)

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return None

    def __repr__(self):
        return f"Input({', '.join(k for k, v in vars(self).items() if v is not None)})"


def _parts(owner):
    """(name, member) of an object's own parts: those that visit() names, or its attributes."""
    if hasattr(owner, "visit"):
        named = []
        owner.visit(lambda name, member: named.append((name, member)))
        return named
    return [(name, value) for name, value in vars(owner).items()]


def _is_layer(value):
    """An object of a class of Python that may hold parameters."""
    return hasattr(value, "__dict__") and not isinstance(value, (type, Input)) and not _no_layer(value)


def _no_layer(value):
    return inspect.isroutine(value) or inspect.ismodule(value)


def _walk(value, path, seen, found, layer=("", "")):
    """Adds (path, object, layer) for all that is below a value: members, and layers that hold members. layer: path and class of the
    layer that holds it."""
    if isinstance(value, (_core.Parameter, _core.Tensor, _core.Model)):
        if id(value) not in seen:
            seen.add(id(value))
            found.append((path, value, layer))
        return
    if isinstance(value, (list, tuple)):
        below = [(str(k), item) for k, item in enumerate(value)]
    elif isinstance(value, dict):
        below = [(str(key), item) for key, item in value.items()]
    elif _is_layer(value) and id(value) not in seen:
        seen.add(id(value))
        found.append((path, value, layer))
        below, layer = _parts(value), (path, type(value).__name__)
    else:
        return
    for name, item in below:
        _walk(item, f"{path}.{name}" if path else name, seen, found, layer)


def members(owner):
    """[(name, Parameter, Tensor or Model, path of its layer, class of its layer)] of a network, by the names of attributes; a shared one
    has its first name."""
    found = []
    _walk(owner, "", set(), found)
    return [(name, value, *layer) for name, value, layer in found if isinstance(value, (_core.Parameter, _core.Tensor, _core.Model))]


def _begin(owner, init):
    """Layers draw their first numbers from the keys of their places."""
    found = []
    _walk(owner, "", set(), found)
    for path, value, _ in found:
        begin = getattr(value, "begin", None)
        if begin is None or isinstance(value, _core.Model):
            continue
        here = init
        for name in filter(None, path.split(".")):
            here = here.sub(name)
        begin(here)


def _sizes(cls):
    """(name, help, default) of the arguments of __init__ that are sizes."""
    out = []
    for name, one in list(inspect.signature(cls.__init__).parameters.items())[1:]:
        if name == "rng":
            continue
        if one.kind in (one.VAR_POSITIONAL, one.VAR_KEYWORD):
            if cls.__init__ is object.__init__:
                continue
            raise _core.InputError(f"restage: {cls.__name__}: __init__ takes *{name}; name each size, with a default")
        if type(one.default) not in (bool, int, float, str):
            raise _core.InputError(f"restage: {cls.__name__}: the size {name!r} has no default that is a number, a truth value "
                                   "or text; give it one")
        out.append((name, f"of {cls.__name__}", one.default))
    return out


def _code(cls):
    """A checksum of the source that defines a class."""
    try:
        with open(inspect.getsourcefile(cls), "rb") as file:
            text = file.read()
    except (OSError, TypeError):
        try:
            text = inspect.getsource(cls).encode()
        except (OSError, TypeError):
            text = cls.__qualname__.encode()
    return hashlib.sha256(text).hexdigest()


def _module_of(cls):
    """What a weights file says of where a class is: its module; the name of its file where no import finds that one."""
    module = sys.modules.get(cls.__module__)
    file = getattr(module, "__file__", None)
    if file and (cls.__module__ == "__main__" or cls.__module__ in _by_file):
        return os.path.basename(file).encode("utf-8", "replace").decode()
    return cls.__module__


def _register(cls, name, role):
    if not isinstance(cls, type) or not callable(getattr(cls, "forward", None)):
        raise _core.InputError(f"restage: {name}: is for a class with a method forward(self, ctx, x); give one")
    if role not in ROLES:
        raise _core.InputError(f"restage: {name}: no network of the role {role!r} can be written in Python; give one of "
                               f"{', '.join(ROLES)}")
    if not isinstance(name, str) or not name or any(c.isspace() or c in "'\",[]{}#:" for c in name):
        raise _core.InputError(f"restage: {name!r} is no name of a network; give one such as mine/net")
    wants_rng = "rng" in inspect.signature(cls.__init__).parameters
    figures = getattr(cls, "figures", ())
    figures = [figures] if isinstance(figures, str) else list(figures)
    if figures and not callable(getattr(cls, "validate", None)):
        raise _core.InputError(f"restage: {name}: names the figure {figures[0]!r} and has no method validate(self, measured); "
                               "write one that gives it, or leave 'figures' out")

    def build(sizes, init):
        net = cls(**sizes, rng=init.rng()) if wants_rng else cls(**sizes)
        _begin(net, init)
        return net, members(net)

    says = (inspect.getdoc(cls) or "").strip().split("\n")[0] if cls.__doc__ else ""
    if _reading and name in _chosen:
        return cls
    if _choosing:
        _chosen.add(name)
    _core.register_network(name, role, says or f"{cls.__name__} of {cls.__module__}", cls.__name__, _sizes(cls),
                           _module_of(cls), _code(cls), figures, build)
    return cls


def model(name, sizes=None, seed=0, *, role=None):
    """A network by the name that `restage info` uses, with fresh weights; sizes change its own.

    With a role it is a decorator, which makes a class of yours a network of restage:

        @restage.model("mine/net", role="motion")
        class Net: ...

    The roles are skeleton, motion, deformation.weights and transfer. docs/python.md says what each takes and gives.
    """
    if role is None:
        return _core.model(name, {} if sizes is None else sizes, seed)
    return lambda cls: _register(cls, name, role)


_files = {}
_by_file = set()  # modules that were imported by their files
_given = []  # files of --python
_chosen = set()  # networks of these files: those of a configuration's files do not take their places
_choosing = _reading = False


def start_with_python():
    """Processes that this one starts import networks, too; the last ones win there."""
    if sys.executable:
        files = [path for path in _files if path not in _given] + _given
        _core.set_program_to_start([sys.executable, "-m", "restage", *(f"--python={path}" for path in files)])


def give_file(path):
    """Imports a file of --python."""
    global _choosing
    if not os.path.exists(path):
        raise _core.InputError(f"restage: {path}: does not exist; give --python a file that defines networks")
    _given.append(os.path.realpath(path))
    _choosing = True
    try:
        import_file(path)
    finally:
        _choosing = False


def read_file(path):
    """Imports a file that a configuration names. Where it is no more, files of --python take its place."""
    global _reading
    if not os.path.exists(path):
        if _given:
            return
        raise _core.InputError(f"restage: {path}: does not exist; give its new place by --python")
    before, _reading = _reading, True
    try:
        import_file(path)
    finally:
        _reading = before


def import_file(path):
    """Imports a file of networks, unless it was imported before; returns its module."""
    path = os.path.realpath(os.fspath(path))
    if path in _files:
        return _files[path]
    for known in list(sys.modules.values()):
        if getattr(known, "__file__", None) and os.path.realpath(known.__file__) == path:
            return known
    if not os.path.isfile(path):
        raise _core.InputError(f"restage: {path}: is no file of Python; give one that defines networks")
    stem = os.path.splitext(os.path.basename(path))[0]
    name = stem if stem.isidentifier() and importlib.util.find_spec(stem) is None else (
        "own_" + hashlib.sha256(path.encode()).hexdigest()[:8])
    folder = os.path.dirname(path)
    if folder not in sys.path:
        sys.path.append(folder)
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None:
        raise _core.InputError(f"restage: {path}: is no file of Python; give one whose name ends in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    _by_file.add(name)
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    _files[path] = module
    start_with_python()
    return module


_core.set_network_importer(read_file)
