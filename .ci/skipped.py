#!/usr/bin/env python3
"""The ctest entries that skipped something, as one regular expression for ctest -R.

    python3 .ci/skipped.py JUNIT_FILE_OF_CTEST"""
import re
import sys
import xml.etree.ElementTree

found = [case.get("name") for case in xml.etree.ElementTree.parse(sys.argv[1]).iter("testcase")
         if re.search(r"\bskipped\b", case.findtext("system-out") or "", re.IGNORECASE)]
if not found:
    sys.exit(f"{sys.argv[1]}: no test skipped anything, though no data folder was there")
print("^(%s)$" % "|".join(map(re.escape, found)))
