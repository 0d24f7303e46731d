#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures the processor time of `peeler info` for a surface of many triangles as STL, PLY and OBJ, on one core.

    python3 -B tests/benchmarks/mesh_reading.py PEELER [--triangles 10000000] [--runs 3]

The files are made in a scratch folder and read once in advance, so that they are in memory. The fastest run counts,
minus the time for a file of two triangles. The OBJ file, which is text, has a fifth of the triangles.
"""
from __future__ import annotations

import argparse
import math
import os
import struct
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Callable, Dict

import numpy


def surface(triangles: int):
    """Returns a hilly square as vertices (n, 3) of float32 and triangles (m, 3) of uint32, two per grid cell."""
    side = max(1, math.isqrt(triangles // 2))
    x, y = numpy.meshgrid(*2 * [numpy.arange(side + 1, dtype=numpy.float32)], indexing="ij")
    vertices = numpy.stack([x, y, 20 * numpy.sin(x / 100) * numpy.cos(y / 77)], -1).reshape(-1, 3)
    a = (numpy.arange(side)[:, None] * (side + 1) + numpy.arange(side)).ravel()
    corners = numpy.stack([a, a + side + 1, a + side + 2, a, a + side + 2, a + 1], -1)
    return vertices.astype(numpy.float32), corners.reshape(-1, 3).astype(numpy.uint32)


def write_stl(path: Path, vertices, triangles) -> None:
    rows = numpy.zeros(len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    rows["corners"] = vertices[triangles]
    path.write_bytes(bytes(80) + struct.pack("<I", len(triangles)) + rows.tobytes())


def write_ply(path: Path, vertices, triangles) -> None:
    rows = numpy.zeros(len(triangles), [("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, triangles
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    path.write_bytes(head.encode() + vertices.tobytes() + rows.tobytes())


def write_obj(path: Path, vertices, triangles) -> None:
    with open(path, "w", encoding="ascii") as file:
        numpy.savetxt(file, vertices, "v %.9g %.9g %.9g")
        numpy.savetxt(file, triangles + 1, "f %d %d %d")


WRITERS: Dict[str, Callable] = {"stl": write_stl, "ply": write_ply, "obj": write_obj}


def seconds(peeler: str, path: Path, runs: int) -> float:
    taken = []
    for _ in range(runs + 1):
        child = subprocess.Popen([peeler, "info", path, "--json"], stdout=subprocess.DEVNULL)
        _, status, used = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode != 0:
            raise RuntimeError(f"peeler info {path}: exit code {child.returncode}")
        taken.append(used.ru_utime + used.ru_stime)
    return min(taken[1:])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("peeler")
    parser.add_argument("--triangles", type=int, default=10_000_000)
    parser.add_argument("--runs", type=int, default=3)
    options = parser.parse_args()
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    print("| format | triangles | size | seconds | MB a second |\n| --- | ---: | ---: | ---: | ---: |")
    with tempfile.TemporaryDirectory(prefix="meshes") as folder:
        for ending, write in WRITERS.items():
            small, large = Path(folder, f"small.{ending}"), Path(folder, f"large.{ending}")
            write(small, *surface(2))
            whole = surface(options.triangles // (5 if ending == "obj" else 1))
            write(large, *whole)
            size = large.stat().st_size
            took = seconds(options.peeler, large, options.runs) - seconds(options.peeler, small, options.runs)
            large.unlink()
            print(f"| {ending} | {len(whole[1]):,} | {size / 1e6:,.0f} MB | {took:.2f} | {size / 1e6 / took:,.0f} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
