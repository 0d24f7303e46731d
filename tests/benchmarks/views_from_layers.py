#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures views from layers against direct renders from the same cameras; prints a Markdown table.

    python3 tests/benchmarks/views_from_layers.py PEELER SCENE... [--size 1280x720] [--angles 5,10,20]
                                                  [-- OPTIONS OF RENDER]

The layers are captured 1.5 times as wide as the picture (and as dense), since a direct render shows
what comes in from the sides and layers cannot show what they have not seen. PSNR of what `peeler
compare` reads from 8-bit PNGs over mid grey, in linear light, for a peak of 1: of one layer, and of all.
At 0 degrees the layers are those of the picture itself, against `peeler flatten`. Milliseconds, at the
last angle: of `view` with all layers, reading and writing included, and of `render`.
"""
import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile

MARGIN = 1.5
BACKGROUND = ["--background", "0.18,0.18,0.18"]
AS_LAYERS = ["--samples", "1", "--environment", "none"]  # a picture has more by default


class Peeler:
    def __init__(self, program: str, folder: str):
        self.program, self.folder = program, pathlib.Path(folder)

    def __call__(self, verb: str, *arguments, check: bool = True) -> dict:
        command = [self.program, verb, *map(str, arguments), "--json"]
        done = subprocess.run(command, check=check, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        return json.loads(done.stdout)

    def file(self, name: str) -> pathlib.Path:
        return self.folder / name

    def psnr(self, a: str, b: str) -> float:
        result = self("compare", self.file(a), self.file(b), check=False)
        return float(result["composite"]["psnr"])

    def camera(self, name: str, margin: float = 1) -> list:
        """Returns render's options for the camera of a picture, with the field of view widened by the factor
        `margin`."""
        attributes = self("info", self.file(name))["attributes"]
        camera = json.loads(attributes["peeler:cameraJson"])
        rows = camera["cameraToWorld"]
        if camera["projection"] != "perspective":
            size = ["--ortho-height", repr(2 * margin * camera["halfHeight"])]
        else:
            size = ["--fov", repr(math.degrees(2 * math.atan(margin * camera["halfHeight"])))]

        def vector(values):
            return ",".join(map(repr, values))

        eye = [row[3] for row in rows[:3]]
        return ["--eye", vector(eye), "--target", vector(e - row[2] for e, row in zip(eye, rows)),
                "--up", vector(row[1] for row in rows[:3]), *size]


def measure(peeler: Peeler, scene: str, size: str, angles: list, more: list) -> None:
    def view(layers: str, name: str, n: str, *arguments) -> dict:
        return peeler("view", peeler.file(layers), "-o", peeler.file(name), "--layers", n, *arguments)

    def compare() -> str:
        return " / ".join(f"{peeler.psnr(picture, 'direct.png'):.1f}" for picture in ("one.png", "all.png"))

    rendered = peeler("render", scene, "-o", peeler.file("own.exr"), "--size", size, *more)
    peeler("flatten", peeler.file("own.exr"), "-o", peeler.file("direct.png"), *BACKGROUND)
    view("own.exr", "one.png", "1", *BACKGROUND)
    shown = view("own.exr", "all.png", "all", *BACKGROUND)
    cells = [pathlib.Path(scene).stem, compare()]

    width, height = (round(MARGIN * int(side)) for side in size.split("x"))
    peeler("render", scene, "-o", peeler.file("wide.exr"), "--size", f"{width}x{height}",
           *peeler.camera("own.exr", MARGIN), *more)
    own = peeler.camera("own.exr")[-2:]
    for angle in angles:
        picture = ["--orbit", f"{angle},0", "--size", size, *own]
        view("wide.exr", "camera.exr", "1", *picture)
        rendered = peeler("render", scene, "-o", peeler.file("direct.png"), "--size", size, *BACKGROUND, *AS_LAYERS,
                          *peeler.camera("camera.exr"), *more)
        view("wide.exr", "one.png", "1", *picture, *BACKGROUND)
        shown = view("wide.exr", "all.png", "all", *picture, *BACKGROUND)
        cells.append(compare())
    cells.append(" / ".join(f"{result['milliseconds']['total']:.0f}" for result in (shown, rendered)))
    print("| " + " | ".join(cells) + " |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("peeler")
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--angles", default="5,10,20")
    arguments, more = sys.argv[1:], []
    if "--" in arguments:
        at = arguments.index("--")
        arguments, more = arguments[:at], arguments[at + 1:]
    options = parser.parse_args(arguments)

    angles = options.angles.split(",")
    print("| one layer / all, dB | 0° | " + " | ".join(f"{angle}°" for angle in angles) + " | view / render, ms |")
    print("| --- |" + " ---: |" * (len(angles) + 2))
    for scene in options.scenes:
        with tempfile.TemporaryDirectory() as folder:
            measure(Peeler(options.peeler, folder), scene, options.size, angles, more)


if __name__ == "__main__":
    main()
