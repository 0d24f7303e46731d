#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Renders seeded clouds of Gaussian splats to PNG and to deep files, and prints rates, times and sizes as a Markdown table.

    python3 tests/benchmarks/splat_clouds.py PEELER [--splats 150000 1000000 3000000] [--size 1920x1080] [--runs 3]

Fragments a second are those of the stages that count and capture, for the deep file. The time of f3d 3 is measured if
`f3d --version` is at least 3, or if $PEELER_F3D_ROOT is the root folder of a Debian 13 with f3d and xvfb. With VTK 9.3,
f3d draws round splats only."""
import argparse
import json
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

RECORD = [("mean", "<f4", 3), ("scale", "<f4", 3), ("color", "u1", 4), ("turn", "u1", 4)]  # of a .splat file
F3D_TRIES = 20  # with Mesa's rasteriser, f3d 3.1 often crashes
DEEP = ("--as", "deep", "--deep-error", "1/256")


def write_cloud(path: pathlib.Path, count: int) -> None:
    """Writes splats in a bumpy shell. Their number at a pixel hardly depends on `count`."""
    random = np.random.default_rng(3)
    normal = random.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    x, y, _ = normal.T
    radius = 1 + 0.2 * np.sin(5 * x) * np.cos(4 * y) + random.uniform(-0.05, 0.05, count)
    splats = np.empty(count, RECORD)
    splats["mean"] = normal * radius[:, None]
    splats["scale"] = np.exp(random.normal(0, 0.6, (count, 3))) * 3 / np.sqrt(count)
    splats["color"][:, :3] = 127.5 + 127.5 * normal
    splats["color"][:, 3] = random.integers(20, 255, count)
    splats["turn"] = random.integers(0, 256, (count, 4))
    splats.tofile(path)


def render(peeler: str, scene: pathlib.Path, out: pathlib.Path, *words: str) -> dict:
    command = [peeler, "render", scene, "-o", out, "--json", "--quiet", *words]
    start = time.perf_counter()
    result = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    return {**result, "seconds": time.perf_counter() - start}


def rate(result: dict) -> float:
    """Returns millions of fragments a second."""
    times = result["milliseconds"]
    return result["fragmentsCounted"] / (times["count"] + times["splats"]) / 1000


class F3d:
    """f3d 3, if there is one."""

    def __init__(self) -> None:
        self.root = os.environ.get("PEELER_F3D_ROOT", "")
        self.before = ["chroot", self.root] if self.root else []
        self.there = False
        if self.root or shutil.which("f3d"):
            told = subprocess.run([*self.before, "f3d", "--version"], capture_output=True, text=True, check=True)
            self.there = int(told.stdout.split()[1].split(".")[0]) >= 3
        if not self.there:
            print("f3d 3 is not measured: set PEELER_F3D_ROOT", file=sys.stderr)

    def seconds(self, scene: pathlib.Path, size: str) -> float:
        with tempfile.TemporaryDirectory(dir=f"{self.root}/tmp") as folder:
            shutil.copy(scene, folder)
            inside = pathlib.Path("/", pathlib.Path(folder).relative_to(self.root or "/"))
            command = [*self.before, "xvfb-run", "-a", "-s", f"-screen 0 {size}x24", "f3d", inside / scene.name, f"--output={inside}/f3d.png",
                       f"--resolution={size.replace('x', ',')}", "--point-sprites", "--point-sprites-type=gaussian",
                       "--scalar-coloring"]
            for _ in range(F3D_TRIES):
                start = time.perf_counter()
                if subprocess.run(command, check=False, capture_output=True).returncode == 0:
                    return time.perf_counter() - start
            raise SystemExit(f"f3d failed {F3D_TRIES} times: {' '.join(map(str, command))}")


def row(options: argparse.Namespace, f3d: F3d, folder: pathlib.Path, count: int) -> str:
    scene = folder / "cloud.splat"
    write_cloud(scene, count)
    fixed = ("--size", options.size)
    png, deep, by_ray, other = [], [], [], []
    for _ in range(options.runs):
        png.append(render(options.peeler, scene, folder / "a.png", *fixed))
        if f3d.there:
            other.append(f3d.seconds(scene, options.size))
        deep.append(render(options.peeler, scene, folder / "a.exr", *fixed, *DEEP))
        by_ray.append(render(options.peeler, scene, folder / "b.exr", *fixed, *DEEP, "--splat-order", "ray"))

    def median(results: list, what: str) -> float:
        return statistics.median(result[what] for result in results)

    cells = [f"{count:,}", f"{deep[0]['fragmentsCounted'] / 1e6:.0f}",
             *(f"{max(map(rate, results)):.0f}" for results in (deep, by_ray)),
             f"{median(png, 'seconds'):.2f}", f"{statistics.median(other):.2f}" if other else "",
             f"{median(deep, 'seconds'):.2f}", f"{deep[0]['bytes'] / 1e6:.0f}",
             f"{deep[0]['fragmentsStored'] / deep[0]['fragmentsCounted']:.3f}",
             *(f"{median(results, 'peakMemory') / 1e6:.0f}" for results in (png, deep))]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("peeler")
    parser.add_argument("--splats", type=int, nargs="+", default=(150_000, 1_000_000, 3_000_000))
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--runs", type=int, default=3)
    options = parser.parse_args()
    print("| splats | fragments, millions | captured by centres, millions/s | along rays | PNG, s | f3d 3, s | deep 1/256, s | MB "
          "| samples kept | memory of PNG, MB | of deep |")
    print("| ---: |" + " ---: |" * 10)
    f3d = F3d()
    with tempfile.TemporaryDirectory() as folder:
        for count in options.splats:
            print(row(options, f3d, pathlib.Path(folder), count), flush=True)


if __name__ == "__main__":
    main()
