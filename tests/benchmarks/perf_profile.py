# SPDX-License-Identifier: Apache-2.0
"""A command's processor time by threads and libraries (Linux perf, cpu-clock)."""
from __future__ import annotations

import re
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any, Sequence

from side_by_side import run

# Parts of perf's names of libraries, with the names to print.
LIBRARIES = (("[JIT]", "compiled shaders"), ("[kernel", "kernel"), ("[vdso]", "kernel"), ("swrast_dri", "Mesa"),
             ("ld-linux", "dynamic linker"), ("libc.so", "libc"), ("libm.so", "libm"))
LEAST = 3.0  # smallest share to mention, in per cent


def library(name: str) -> str:
    return next((word for start, word in LIBRARIES if name.startswith(start)), re.sub(r"[-.].*", "", name))


def profile(command: Sequence[Any]) -> str:
    """Returns the shares of all samples, the largest first, or "" if perf cannot be used."""
    with tempfile.TemporaryDirectory() as folder:
        samples = Path(folder) / "perf.data"
        try:
            run(["perf", "record", "-q", "-e", "cpu-clock", "-F", 499, "-o", samples, "--", *command])
            report = run(["perf", "report", "-i", samples, "--sort", "comm,dso", "--stdio", "-q"]).out
        except (OSError, RuntimeError):
            return ""
    shares: Counter[str] = Counter()
    for percent, thread, name in re.findall(r"^\s*([\d.]+)%\s+(\S+)\s+(.*?)\s*$", report, re.M):
        where = " (rasterising threads)" if thread.startswith("llvmpipe") else ""
        shares[library(name) + where] += float(percent)
    return ", ".join(f"{share:.0f} % {what}" for what, share in shares.most_common() if share >= LEAST)
