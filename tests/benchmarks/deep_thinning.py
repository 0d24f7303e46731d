#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes deep files plain, merged and thinned, and prints samples, sizes and times as a Markdown table.

    python3 tests/benchmarks/deep_thinning.py PEELER SCENE... [--size 1280x720] [--runs 3]

A SCENE is a file, or a name of tests/benchmarks/scenes.py. It is rendered with 4 samples a pixel; `peeler convert` then
writes each row. The time is that of thinning, encoding and writing in the fastest run."""
import argparse
import json
import pathlib
import subprocess
import tempfile

import scenes

FORMS = (  # labels of rows, and options of convert
    ("plain, ZIPS", ()),
    ("`--deep-merge exact`", ("--deep-merge", "exact")),
    ("`--deep-error 1/4096`", ("--deep-error", "1/4096")),
    ("`--deep-error 1/1024`", ("--deep-error", "1/1024")),
    ("`--deep-error 1/256`", ("--deep-error", "1/256")),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("peeler")
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--runs", type=int, default=3)
    options = parser.parse_args()
    print("| scene | file | samples | per covered pixel | MB | ms |")
    print("| --- | --- | ---: | ---: | ---: | ---: |")
    with tempfile.TemporaryDirectory() as folder:
        for name in options.scenes:
            scene = pathlib.Path(name)
            if not scene.suffix:
                scene = scenes.write(pathlib.Path(folder), name)
            deep, out = f"{folder}/deep.exr", f"{folder}/out.exr"
            subprocess.run([options.peeler, "render", scene, "-o", deep, "--as", "deep", "--size", options.size,
                            "--samples", "4", "--quiet"], check=True)
            info = json.loads(subprocess.run([options.peeler, "info", deep, "--json"], check=True, capture_output=True).stdout)
            covered = info["layers"][0]["pixels"]
            for label, form in FORMS:
                results = []
                for _ in range(options.runs):
                    command = [options.peeler, "convert", deep, "-o", out, "--as", "deep", "--json", "--quiet", *form]
                    result = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
                    times = result["milliseconds"]
                    results.append((times.get("thin", 0) + times["encode"] + times["write"], result))
                milliseconds, result = min(results, key=lambda each: each[0])
                stored = result["fragmentsStored"]
                print(f"| {scene.stem} | {label} | {stored:,} | {stored / covered:.2f} | {result['bytes'] / 1e6:.1f} | "
                      f"{milliseconds:.0f} |", flush=True)


if __name__ == "__main__":
    main()
