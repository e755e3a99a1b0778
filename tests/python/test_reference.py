"""docs/python_reference.md is what its generator writes, and names all that the package has."""

import restage

from conftest import ROOT, python


def test_the_page_is_up_to_date():
    done = python(ROOT / "docs/make_python_reference.py", "--check", text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr


def test_it_names_everything():
    page = (ROOT / "docs/python_reference.md").read_text()
    for where, module in (("restage", restage), ("restage.data", restage.data), ("restage.torch", restage.torch),
                          ("restage.benchmark", restage.benchmark)):
        for name in module.__all__:
            if not isinstance(getattr(module, name), type(restage)):
                assert "### %s.%s\n" % (where, name) in page or "* `%s: " % name in page, (where, name)
    for name in restage.ops.__all__:
        assert "* `%s(" % name in page, name
    for name in restage.metrics.names:
        assert "| `%s` |" % name in page, name
