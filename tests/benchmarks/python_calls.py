#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Compares the time of a call from Python with that of the same call of the C++ library.

    python3 tests/benchmarks/python_calls.py BUILD_FOLDER SCENE... [--calls 1000] [--runs 5]

Both capture all layers of 64 x 64 pixels, CALLS times per process, in turn; the fastest run of each counts. The Python
module sends the call to a worker, and maps the worker's output. Prints a row of Markdown per scene.
"""
import argparse
import os
import pathlib
import subprocess
import sys

SIZE = 64
PYTHON = f"""
import sys, time, peeler
scene, calls = peeler.Scene(sys.argv[1]), int(sys.argv[2])
with peeler.Renderer() as renderer:
    def call():
        return len(renderer.layers(scene, size=({SIZE}, {SIZE})).z)
    for i in range(calls // 10):
        call()
    start = time.perf_counter()
    for i in range(calls):
        call()
    print((time.perf_counter() - start) * 1000 / calls)
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--calls", type=int, default=1000)
    parser.add_argument("--runs", type=int, default=5)
    options = parser.parse_args()
    build = options.build.resolve()
    environment = {**os.environ, "PYTHONPATH": str(build / "python"), "PEELER": str(build / "peeler")}

    def milliseconds(*command):
        done = subprocess.run(command, check=True, capture_output=True, text=True, env=environment)
        return float(done.stdout)

    print("| scene | C++, ms a call | Python, ms a call | more, ms (≤ 0.3) |")
    print("| --- | ---: | ---: | ---: |")
    for scene in options.scenes:
        best = [float("inf")] * 2
        for _ in range(options.runs):
            ways = ([build / "tests/library_calls", scene, str(SIZE), str(options.calls)],
                    [sys.executable, "-c", PYTHON, scene, str(options.calls)])
            best = [min(before, milliseconds(*way)) for before, way in zip(best, ways)]
        more = best[1] - best[0]
        bold = "" if more <= 0.3 else "**"
        print(f"| {pathlib.Path(scene).stem} | {best[0]:.2f} | {best[1]:.2f} | {bold}{more:.2f}{bold} |")


if __name__ == "__main__":
    main()
