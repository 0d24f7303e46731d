#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Renders examples/scenes/engine.glb in large pictures and under tight budgets; prints the peak resident memory.

    python3 tests/benchmarks/budgets.py PEELER [--quick]

Skips rows whose file does not fit on the disk, with a note. --quick renders a small picture, as a trial.
"""
from __future__ import annotations

import argparse
import json
import shutil
import tempfile
from pathlib import Path
from typing import List, NamedTuple, Tuple

from side_by_side import run

ENGINE = Path(__file__).resolve().parents[2] / "examples" / "scenes" / "engine.glb"


class Picture(NamedTuple):
    what: str
    size: str
    budget: str
    options: Tuple[str, ...] = ()
    disk: float = 0  # approximate size of the file in bytes


AFAR = ("--eye", "0.6,0.5,1.8", "--target", "0,0.1,0")
SAMPLES = ("--samples", "4", "--threads", "1")
PICTURES = (
    Picture("from afar", "40000x20000", "2G", AFAR, 4e9),
    Picture("both faces", "8192x4096", "2G", ("--faces", "both"), 1e9),
    Picture("4 samples, 1 thread", "1600x1200", "400M", SAMPLES),
)
QUICK = (Picture("small", "320x180", "400M"),)


def row(peeler: str, picture: Picture, folder: str) -> List[str]:
    done = run([peeler, "render", ENGINE, "-o", f"{folder}/out.exr", "--size", picture.size, "--memory", picture.budget,
                *picture.options, "--json", "--quiet"])
    told = json.loads(done.out)
    (Path(folder) / "out.exr").unlink()
    return [picture.what, picture.size, picture.budget,
            f"{done.peak_bytes / 2**20:.0f} MiB", f"{told['bytes'] / 1e6:.0f} MB", f"{done.milliseconds / 1000:.1f} s"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("peeler")
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    print("| picture | size | --memory | most resident | file | whole command |")
    print("| --- | --- | ---: | ---: | ---: | ---: |")
    left_out = []
    with tempfile.TemporaryDirectory() as folder:
        for picture in QUICK if options.quick else PICTURES:
            if shutil.disk_usage(folder).free < picture.disk:
                left_out.append(f"{picture.what}, {picture.size}: no {picture.disk / 1e9:.0f} GB free in {folder}")
                continue
            print("| " + " | ".join(row(options.peeler, picture, folder)) + " |", flush=True)
    print("".join(f"\nSkipped: {why}." for why in left_out), end="\n" if left_out else "")


if __name__ == "__main__":
    main()
