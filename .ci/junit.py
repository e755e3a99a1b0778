#!/usr/bin/env python3
"""What a JUnit file of ctest tells.

    junit.py skipped FILE    the entries that skipped something, as one regular expression for ctest -R
    junit.py slowest FILE    the twenty that took longest, with their share of the time of all"""
import re
import sys
import xml.etree.ElementTree

verb, file = sys.argv[1:]
cases = list(xml.etree.ElementTree.parse(file).iter("testcase"))
if verb == "skipped":
    found = [case.get("name") for case in cases if re.search(r"\bskipped\b", case.findtext("system-out") or "", re.IGNORECASE)]
    if not found:
        sys.exit(f"{file}: no test skipped anything, though no data folder was there")
    print("^(%s)$" % "|".join(map(re.escape, found)))
else:
    times = sorted(((float(case.get("time") or 0), case.get("name")) for case in cases), reverse=True)
    everything = sum(seconds for seconds, _ in times) or 1
    print("slowest of %d tests, %.0f s of processes together:" % (len(times), everything))
    for seconds, name in times[:20]:
        print("%7.1f s  %4.1f %%  %s" % (seconds, 100 * seconds / everything, name))
