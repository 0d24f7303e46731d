#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the arrays of a .npz again with numpy.savez, and prints the time as a line of JSON.

    savez.py IN.npz OUT.npz

Loads the arrays first. `processor` is the time of all threads, including kernel time; both numbers are in milliseconds.
numpy does not wait for the disk.
"""
import json
import resource
import sys
import time

import numpy


def processor():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return 1000 * (usage.ru_utime + usage.ru_stime)


with numpy.load(sys.argv[1]) as file:
    arrays = dict(file)
started, before = time.perf_counter(), processor()
numpy.savez(sys.argv[2], **arrays)
print(json.dumps({"processor": processor() - before, "milliseconds": 1000 * (time.perf_counter() - started)}))
