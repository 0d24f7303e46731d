# SPDX-License-Identifier: Apache-2.0
"""The benchmark table's rows about many views of a scene, data sets of many models, and masks of objects."""
from __future__ import annotations

import csv
import glob
import json
import shutil
import statistics
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List

from machine import ASSETS
from side_by_side import Bench, Row, in_turn, run, say

HD = "1920x1080"  # these rows have sizes of their own, but run only if this size is requested
LEAST_TRIANGLES = 500
START_UP = ("load", "context", "upload")
Rows = Iterator[Row]


def stages(result: Dict[str, Any], *names: str) -> float:
    """Returns the milliseconds of these stages or, without names, of all stages."""
    times = result["milliseconds"]
    return sum(value for stage, value in times.items() if stage != "total" and (not names or stage in names))


def emptied(folder: Path) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    return folder


def views(bench: Bench) -> Rows:
    """Times one process for many views, and compares it with the sum of its stages and with one process per view."""
    for _ in bench.at(HD):
        for name, path in bench.those("gearbox"):
            count, (side,) = max(4, 100 // bench.shrink), bench.shrunk(512)
            say(f"{count} views: {name}")
            folder = bench.scratch / "views"
            all_of_them = [bench.peeler, "render", path, "-o", folder / "@@@.exr", "--views", count, "--size",
                           f"{side}x{side}", "--json", "--quiet"]
            own = [[*all_of_them, "--chunk", f"{i}/{count}"] for i in range(1, count + 1, max(1, count // 10))]
            told: List[Dict[str, Any]] = []
            parts: List[float] = []

            def together() -> float:
                emptied(folder)
                done = run(all_of_them)
                told[:] = json.loads(done.out)["views"]
                parts.append(sum(map(stages, told)) / count)
                return done.milliseconds / count

            times = in_turn([together, lambda: statistics.fmean(run(one).milliseconds for one in own)], bench.runs)
            shutil.rmtree(folder)
            first, rest = stages(told[0], *START_UP), sum(stages(view, *START_UP) for view in told[1:])
            size = f"{side}x{side}, {count} views"
            yield Row("a view of many, layered file", name, size, "sum of its stages", times[0], parts, 1.15,
                      note=f"load, context and upload: {first:.0f} ms first, {rest:.0f} ms for all others together",
                      ours_alone=all_of_them)
            yield Row("a view of many, layered file", name, size, "a process for each", *times, None,
                      note=f"of {len(own)} of the views")


def lens_views(bench: Bench) -> Rows:
    """Times many views through a fisheye, beside the views of a pinhole: hits, layers and pictures."""
    for _ in bench.at(HD):
        for name, path in bench.those("gearbox"):
            count, (side,) = max(4, 100 // bench.shrink), bench.shrunk(512)
            say(f"{count} views through a fisheye: {name}")
            folder = bench.scratch / "lens_views"
            for verb, end, what in (("rays", "npz", "hits"), ("render", "exr", "layers"), ("render", "png", "pictures")):
                def timed(*more: Any) -> float:
                    done = run([bench.peeler, verb, path, "-o", emptied(folder) / f"@@@.{end}", "--views", count,
                                "--size", f"{side}x{side}", "--quiet", *more])
                    return done.milliseconds / count

                ours, theirs = in_turn([lambda: timed("--lens", "fisheye", "--fov", 60), lambda: timed("--fov", 60)],
                                       bench.runs)
                shutil.rmtree(folder)
                yield Row("a view of many through a fisheye, whole command", f"{name}, {what}", f"{side}x{side}, {count} views",
                          "a pinhole", ours, theirs, None, mine="fisheye",
                          details={"views a minute": f"{60_000 / statistics.median(ours):,.0f}"})


def models() -> Dict[str, Path]:
    """Returns the models that are large enough, by name; of each model, the form with the fewest extensions."""
    found: Dict[str, Path] = {}
    if not (ASSETS / "MODELS.tsv").is_file():
        return found
    with open(ASSETS / "MODELS.tsv", encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file, delimiter="\t", quoting=csv.QUOTE_NONE)
                if row["path"].startswith("gltf-sample-assets/")
                and int(row["triangles_in_default_scene"]) >= LEAST_TRIANGLES]
    for row in sorted(rows, key=lambda row: (len(row["extensionsRequired"]), row["path"])):
        found.setdefault(row["path"].split("/")[1], ASSETS / row["path"])
    return dict(sorted(found.items()))


class DataSet:
    """Views of a model as in a data set, and depths only, by peeler and by Embree."""

    def __init__(self, bench: Bench, path: Path, count: int, side: int):
        self.ours, self.alone, self.theirs = (emptied(bench.scratch / name) for name in ("ours", "alone", "theirs"))
        cameras = bench.scratch / "transforms.json"
        self.render = [bench.peeler, "render", path, "-o", self.ours / "@@@@.png", "--as", "lari", "--faces", "both", "--views",
                       count, "--size", f"{side}x{side}", "--cameras-out", cameras, "--json", "--quiet"]
        self.trace = [bench.peeler, "rays", path, "-o", self.alone / "@@@@.npz", "--engine", "cpu", "--faces", "both",
                      "--cameras", cameras, "--columns", "t_hit", "--dense", 15, "--dense-type", "half", "--fill=-1", "--quiet"]
        self.embree = [bench.build / "tests" / "benchmark_embree_views", path, cameras, self.theirs]

    def alike(self) -> float:
        """Returns the share of covered pixels where peeler and Embree find equally many layers, up to 15."""
        import numpy as np

        alike = covered = 0
        for path in self.theirs.iterdir():
            ours, theirs = ((depths >= 0).sum(axis=-1) for depths in (
                np.load(self.ours / f"{path.stem}_ldi.npz")["ldi"], np.load(path)))
            alike += int(((ours == theirs) & (ours > 0)).sum())
            covered += int(((ours > 0) | (theirs > 0)).sum())
        return alike / covered


def datasets(bench: Bench) -> Rows:
    """Times 12 views of every model: the depths of all layers, with and without pictures, and Embree's depths."""
    if run(["/usr/bin/python3", "-c", "import numpy"], check=False).code != 0:
        bench.skip("data sets: python3-numpy is not installed")
        return
    if not models():
        bench.skip(f"data sets: no {ASSETS / 'MODELS.tsv'} (set PEELER_ASSETS)")
    kinds = ("depths and pictures", "depths alone, CPU")
    count, (side,) = 12, bench.shrunk(512)
    size, rival = f"{side}x{side}, {count} views", "Embree, depths"
    medians: List[List[float]] = []
    for name, path in models().items() if bench.at(HD) else ():
        say(f"data set: {name}")
        made = DataSet(bench, path, count, side)
        try:
            times = in_turn([lambda command=command: run(command).milliseconds
                             for command in (made.render, made.trace, made.embree)], bench.runs)
        except RuntimeError as error:
            bench.skip(f"{name}: {str(error).splitlines()[-1]}")
            continue
        medians.append([statistics.median(numbers) for numbers in times])
        for mine, ours in zip(kinds, times):
            yield Row("data set", name, size, rival, ours, times[2], None,
                      mine=mine, details={"alike": f"{made.alike():.3%}"} if ours is times[0] else {})
    sums = [sum(numbers) for numbers in zip(*medians)]
    minute = 60_000 * len(medians)
    rates = [f"{minute / taken:.1f}" for taken in sums]
    for mine, ours in zip(kinds, sums):
        yield Row("data set", f"all {len(medians)} models", size, rival, [ours], [sums[2]], None,
                  mine=mine, details={"alike": f"objects a minute: {rates[0]}, {rates[1]}, Embree {rates[2]}"})


def masks(bench: Bench) -> Rows:
    """Times the masks of all objects of a scene, and a render of each object alone."""
    for _ in bench.at(HD):
        for name, path in bench.those("gearbox"):
            side, = bench.shrunk(512)
            cameras, folder = bench.scratch / "camera.json", bench.scratch / "masks"
            picture = ("--size", f"{side}x{side}", "--json", "--quiet")
            run([bench.peeler, "render", path, "-o", bench.scratch / "whole.exr", "--views", 1, "--cameras-out", cameras,
                 *picture])
            seen = [bench.peeler, "masks", path, "-o", folder, "--cameras", cameras, *picture[2:]]
            captured: Dict[str, List[float]] = {"masks": [], "renders": []}

            def together() -> float:
                shutil.rmtree(folder, ignore_errors=True)
                done = run(seen)
                captured["masks"].append(stages(json.loads(done.out)["views"][0], "count", "capture", "sort"))
                return done.milliseconds

            together()
            captured["masks"].clear()
            objects = json.loads((folder / "objects.json").read_text(encoding="utf-8"))["objects"]
            say(f"masks of {len(objects)} objects: {name}")

            def one_by_one() -> float:
                done = [run([bench.peeler, "render", path, "-o", bench.scratch / "alone.exr", "--cameras", cameras,
                             "--include", glob.escape(one["name"]), *picture[2:]]) for one in objects]
                captured["renders"].append(sum(
                    stages(json.loads(each.out)["views"][0], "count", "capture", "sort") for each in done))
                return sum(each.milliseconds for each in done)

            times = in_turn([together, one_by_one], bench.runs)
            ours, theirs = map(statistics.median, captured.values())
            yield Row("masks of all objects", name, f"{side}x{side}", f"{len(objects)} renders, an object each", *times, None,
                      note=f"count, capture and sort: {ours:.0f} ms; of the renders {theirs:.0f} ms")


KINDS: Dict[str, Callable[[Bench], Rows]] = {"views": views, "lens-views": lens_views, "datasets": datasets, "masks": masks}
