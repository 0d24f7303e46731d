#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares PNGs of four samples, shaded once per sample and once per pixel, with PNGs of 64 samples: PSNR and processor
time, as a Markdown table.

    python3 tests/benchmarks/shading_rates.py PEELER [SCENE ...] [--size 1920x1080] [--runs 3]
"""
import argparse
import pathlib
import re
import resource
import statistics
import subprocess
import tempfile
from typing import List


def render(peeler: str, scene: pathlib.Path, out: pathlib.Path, *words: str) -> float:
    """Returns the processor time in milliseconds, start and end of the process included."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([peeler, "render", scene, "-o", out, "--quiet", *words], check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return 1000 * (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def psnr(wanted: pathlib.Path, found: pathlib.Path) -> float:
    """Returns the PSNR in dB, of the encoded values with a peak of 1."""
    told = subprocess.run(["oiiotool", "--diff", wanted, found], check=False, capture_output=True, text=True).stdout
    value = re.search(r"Peak SNR = (\S+)", told)
    assert value, told
    return float(value[1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("peeler")
    parser.add_argument("scenes", nargs="*", type=pathlib.Path)
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--runs", type=int, default=3)
    options = parser.parse_args()

    print("| scene | PSNR per sample, dB | per pixel, dB | processor time per sample, ms | per pixel, ms | ratio |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    with tempfile.TemporaryDirectory() as folder:
        wanted, found = pathlib.Path(folder, "64.png"), pathlib.Path(folder, "4.png")
        for scene in options.scenes:
            render(options.peeler, scene, wanted, "--size", options.size, "--samples", "64")
            quality: List[float] = []
            times: List[List[float]] = [[], []]
            for run in range(options.runs):
                for rate, name in enumerate(("sample", "pixel")):
                    times[rate].append(render(options.peeler, scene, found, "--size", options.size, "--shade-per", name))
                    if run == 0:
                        quality.append(psnr(wanted, found))
            sample, pixel = map(statistics.median, times)
            print(f"| {scene.stem} | {quality[0]:.1f} | {quality[1]:.1f} | {sample:,.0f} | {pixel:,.0f} | {pixel / sample:.2f} |",
                  flush=True)


if __name__ == "__main__":
    main()
