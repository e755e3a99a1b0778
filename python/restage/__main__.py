"""python3 -m restage COMMAND ...: the program, with networks that are written in Python.

--python FILE.py imports a file of networks first; it may stand anywhere and be given several times.
"""
import sys

from . import _core, _network

# Commands that read networks, by their weights or by their names.
NETWORKS = ("train", "sweep plan", "sweep run", "sweep ask", "sweep export", "trial", "replay", "retarget", "track", "stream", "skeleton",
            "adapt", "assess", "eval", "info", "weights import", "weights export")
HELP = "  --python FILE.py  (python3 -m restage) import a file of networks first; may be given several times"


def _files_of(words):
    """The words without --python, and the files that it names."""
    rest, files = [], []
    words = iter(words)
    for word in words:
        if word == "--python":
            file = next(words, "")
            if not file:
                raise _core.InputError("restage: --python names no file; give one that defines networks")
            files.append(file)
        elif word.startswith("--python="):
            files.append(word.partition("=")[2])
        else:
            rest.append(word)
    return rest, files


def _asks_for_help(words):
    """Whether the page that is printed is that of the program or of a command that reads networks."""
    asked = [word for word in words if word in ("-h", "--help")]
    names = [word for word in words if not word.startswith("-")]
    return words == [] or (asked and (not names or names[0] in NETWORKS or " ".join(names[:2]) in NETWORKS))


def main():
    _core.be_the_program()
    try:
        words, files = _files_of(sys.argv[1:])
        for file in files:
            _network.give_file(file)
    except _core.InputError as error:
        print(error, file=sys.stderr)
        return 2
    _network.start_with_python()
    code = _core.main(words)
    if code == 0 and _asks_for_help(words):
        print("\nNetworks of Python:\n" + HELP, flush=True)
    return code


if __name__ == "__main__":
    sys.exit(main())
