#!/usr/bin/env python3
"""End-to-end tests of the program (plain Python, nothing else needed).

    python3 tests/cli/run_cli_tests.py BUILD_DIR [unittest arguments, e.g. -v -k eval]

Tests live in test_*.py beside this file; what they share is in support.py."""
import os
import sys
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))

if __name__ == "__main__":
    if len(sys.argv) < 2 or not os.path.isdir(sys.argv[1]):
        sys.exit(__doc__)
    build = os.path.abspath(sys.argv[1])
    sys.dont_write_bytecode = True
    sys.path.insert(0, HERE)
    os.environ["RESTAGE_PROGRAM"] = os.path.join(build, "restage")
    os.environ["RESTAGE_MAKE_H5"] = os.path.join(build, "tests", "make_h5")
    unittest.main(module=None, argv=[sys.argv[0], "discover", "-s", HERE] + sys.argv[2:])
