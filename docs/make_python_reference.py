#!/usr/bin/env python3
"""Writes docs/python_reference.md from the type stubs (python/restage/*.pyi) and the docstrings of the package.

    PYTHONPATH=build/release/python /usr/bin/python3 docs/make_python_reference.py            writes the page
    PYTHONPATH=build/release/python /usr/bin/python3 docs/make_python_reference.py --check    1 if it is not what this writes

Signatures are those of the stubs, words those that help() shows.
"""

import ast
import html
import inspect
import re
import sys
from pathlib import Path

import restage
import restage.torch

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs/python_reference.md"
STUBS = ROOT / "python/restage"

HEAD = """# Python reference

<!-- Written by docs/make_python_reference.py from python/restage/*.pyi and docstrings. Change those, not this page. -->

`help(restage.retarget)` shows the same. [python.md](python.md) has examples. Lengths are in metres, y is up, and motions
have 30 frames a second, unless an entry says otherwise. F: frames; V: vertices; n: examples of a batch, or points of a cloud.

**Errors.** Wrong input is an `InputError` (a `ValueError`), a wrong shape a `ShapeError` (an `InputError`), failed work a
`WorkError` (a `RuntimeError`), numbers that are not finite a `NonFiniteError` (a `WorkError`), Ctrl-C a `KeyboardInterrupt`.

"""
MODULES = (("restage", restage, "__init__"), ("restage.data", restage.data, "data"), ("restage.benchmark", restage.benchmark, "benchmark"), ("restage.torch", restage.torch, "torch"),
           ("restage.metrics", restage.metrics, "metrics"), ("restage.ops", restage.ops, "ops"))
# What **options stand for: a heading of docs/commands.md.
OPTIONS = {"RetargetOptions": "retarget", "SystemOptions": "retarget", "DoctorOptions": "doctor", "TrainOptions": "train"}


def words_of(value):
    """The docstring without the signature that pybind11 puts before it."""
    text = inspect.cleandoc(getattr(value, "__doc__", None) or "")
    name = getattr(value, "__name__", "")
    return re.sub(r"\A%s\(.*\)( -> .*)?\n*" % re.escape(name), "", text) if name else text


def markdown(text):
    """A docstring as paragraphs; nothing in it is markup but code in backquotes."""
    parts = re.split(r"(`[^`\n]*`)", text)
    return "".join(part if part.startswith("`") else html.escape(part, quote=False).replace("*", "\\*") for part in parts)


def signature(node):
    decorators = "".join("@%s\n" % ast.unparse(d) for d in node.decorator_list if ast.unparse(d) == "staticmethod")
    first = ast.unparse(ast.FunctionDef(node.name, node.args, [ast.Expr(ast.Constant(...))], [], node.returns, lineno=0))
    return decorators + re.sub(r":\s*\.\.\.\Z", "", first)[len("def "):]


def wrapped(text, width=110):
    """A signature on several lines, broken between arguments."""
    if len(text) <= width:
        return text
    indent, lines, depth, line = text.index("(") + 1, [], 0, ""
    for piece in re.findall(r"[^,\[\]()]+|.", text):
        depth += piece in "[(" and 1 or 0
        depth -= piece in "])" and 1 or 0
        line += piece
        if piece == "," and depth == 1 and len(line) > width - 25:
            lines.append(line)
            line = " " * (indent - 1)
    return "\n".join([*lines, line])


def code(*lines):
    return "```python\n%s\n```\n" % "\n".join(lines)


def options_note(node):
    kind = node.args.kwarg and node.args.kwarg.annotation
    name = re.sub(r"\AUnpack\[(.*)\]\Z", r"\1", ast.unparse(kind)) if kind else ""
    return "" if name not in OPTIONS else "\nOptions: those of [restage %s](commands.md#restage-%s), with `_` for `-`.\n" % (
        OPTIONS[name], OPTIONS[name])


def function(where, node, value):
    text = markdown(words_of(value))
    return "### %s.%s\n\n%s%s%s" % (where, node.name, code(wrapped(signature(node))), "\n%s\n" % text if text else "", options_note(node))


def field_words(owner):
    """What stands behind '#:' beside the fields of a class."""
    try:
        source = inspect.getsource(owner)
    except (OSError, TypeError):  # a class of C++
        return {}
    return dict(re.findall(r"^    (\w+): .*#: (.*)$", source, re.M))


def member(node, owner):
    """A line of a class's list."""
    if isinstance(node, ast.AnnAssign):
        text = field_words(owner).get(node.target.id)
        return "* `%s: %s`%s" % (node.target.id, ast.unparse(node.annotation), ": " + markdown(text) if text else "")
    value = inspect.getattr_static(owner, node.name, None)
    value = getattr(owner, node.name, value)
    text = markdown(" ".join(words_of(value).split()))
    is_property = any(ast.unparse(d) == "property" for d in node.decorator_list)
    shown = "%s: %s" % (node.name, ast.unparse(node.returns)) if is_property else signature(node).replace("@staticmethod\n", "")
    if not is_property:
        shown = re.sub(r"\((self|cls)(, )?", "(", shown, count=1)
    return "* `%s`%s" % (shown, ": " + text if text and not node.name.startswith("__") else "")


def class_(where, node, value):
    bases = ", ".join(ast.unparse(base) for base in node.bases)
    text = markdown(words_of(value))
    members = [member(part, value) for part in node.body if isinstance(part, (ast.FunctionDef, ast.AnnAssign))
               and not (isinstance(part, ast.FunctionDef) and part.name in ("__exit__", "__enter__", "__dlpack_device__"))]
    return "### %s.%s\n\n%s%s%s" % (where, node.name, code("class %s%s" % (node.name, "(%s)" % bases if bases else "")),
                                    "\n%s\n" % text if text else "", "\n%s\n" % "\n".join(members) if members else "")


def metrics_table(nodes, module):
    lines = ["Each takes `(pred, truth, joints=None)` and returns a float or None.", "", "|function|of|unit|what it is|", "|---|---|---|---|"]
    for node in nodes:
        text = words_of(getattr(module, node.name)).split("\n")[0]
        lines.append("| `%s` | %s | %s | %s |" % (node.name, module.kinds[node.name], module.units[node.name],
                                                 markdown(text).replace("|", "\\|")))
    return "\n".join(lines) + "\n"


def ops_list(nodes, module):
    """Ops are many and short: a line for each."""
    lines = []
    for node in nodes:
        text = markdown(" ".join(words_of(getattr(module, node.name)).split()))
        lines.append("* `%s`%s" % (signature(node), ": " + text if text else ""))
    return "\n".join(lines) + "\n"


def value_line(node, module):
    return "* `%s: %s`" % (node.target.id, ast.unparse(node.annotation))


def section(where, module, stub):
    tree = ast.parse((STUBS / (stub + ".pyi")).read_text())
    public = [n for n in tree.body if isinstance(n, (ast.FunctionDef, ast.ClassDef)) and hasattr(module, n.name)
              and not n.name.startswith("_")]
    values = [n for n in tree.body if isinstance(n, ast.AnnAssign)]
    out = "## %s\n\n%s\n" % (where, markdown(words_of(module)) if stub != "__init__" else "The package itself.")
    if values:
        out += "\n" + "\n".join(value_line(n, module) for n in values) + "\n"
    if stub == "metrics":
        table = [n for n in public if n.name in module.names]
        return out + "\n" + metrics_table(table, module) + "\n" + "\n".join(
            function(where, n, getattr(module, n.name)) for n in public if n not in table)
    if stub == "ops":
        return out + "\n" + ops_list(public, module)
    for node in public:
        made = function if isinstance(node, ast.FunctionDef) else class_
        out += "\n" + made(where, node, getattr(module, node.name))
    return out


def page():
    return HEAD + "\n".join(section(*module) for module in MODULES)


def main(arguments):
    if arguments not in ([], ["--check"]):
        print(__doc__.strip(), file=sys.stderr)
        return 2
    wanted = page()
    if not arguments:
        PAGE.write_text(wanted)
        return 0
    have, want = (PAGE.read_text() if PAGE.exists() else "").splitlines(), wanted.splitlines()
    for i in range(max(len(have), len(want))):
        a, b = (lines[i] if i < len(lines) else "(no line)" for lines in (have, want))
        if a != b:
            print("docs/python_reference.md:%d: is not what docs/make_python_reference.py writes\n  is:     %s\n  should: %s" % (i + 1, a, b))
            return 1
    print("docs/python_reference.md: is what docs/make_python_reference.py writes")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
