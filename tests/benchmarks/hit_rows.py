# SPDX-License-Identifier: Apache-2.0
"""The benchmark table's rows about hits on the CPU without GL. All times are processor time."""
from __future__ import annotations

import math
import statistics
from typing import Any, Callable, Dict, Iterator, List, Tuple

import scenes
from side_by_side import Bench, Row, exponent, say

# For each scene: the rays of a bundle (width, height), and the target. Scenes with more hits to sort have lower
# targets.
SOUPS: Dict[str, Tuple[int, int, float]] = {
    "soup-192k": (1920, 1080, 0.35), "soup-1728k": (1920, 1080, 0.35), "soup-1280k": (1920, 1080, 0.35),
    "soup-640k": (1920, 1080, 0.5), "cube-192k": (512, 512, 0.35), "cube-160k": (1024, 1024, 0.35)}
MODELS: Dict[str, Tuple[int, int, float]] = {"gearbox": (1920, 1080, 0.35), "lamp": (1920, 1080, 0.35)}
EMBREE = "Embree: hierarchy, all hits, sort"
MOST_ERROR = 0.002  # largest permitted excess of occlusion's error over that of Embree
Rows = Iterator[Row]


def engine(bench: Bench, path: Any, width: int, height: int, *more: Any) -> Dict[str, Any]:
    return bench.program("benchmark_hit_engine", path, "--size", f"{width}x{height}", *more)


def alone(bench: Bench, path: Any, width: int, height: int, what: str, *more: Any) -> List[Any]:
    return [bench.build / "tests" / "benchmark_hit_engine", path, "--size", f"{width}x{height}", "--runs", 5, "--what", what,
            *more]


def equal(ours: int, theirs: int) -> str:
    """Returns two numbers in millions, or one if they look the same."""
    return " / ".join(dict.fromkeys(f"{number / 1e6:.2f}" for number in (ours, theirs)))


def bundle(bench: Bench) -> Rows:
    known = {**SOUPS, **MODELS}
    for _ in bench.at("1920x1080"):
        for name, path in bench.those(*known):
            width, height = bench.shrunk(*known[name][:2])
            say(f"hits of a bundle: {name}")
            result = engine(bench, path, width, height, "--runs", bench.runs)
            yield Row("all hits of a bundle, sorted, processor time", name, f"{width}x{height}", EMBREE,
                      *(result["processor"][key] for key in ("hits", "embree")), known[name][2],
                      details={"hits, M": equal(result["hits"], result["embree"]["hits"])},
                      ours_alone=alone(bench, path, width, height, "hits"))


def bundles(bench: Bench) -> Rows:
    for _ in bench.at("1920x1080"):
        for name, side in (("soup-192k", 512), ("soup-192k", 1024), ("gearbox", 1024)):
            for _, path in bench.those(name):
                width, = bench.shrunk(side)
                say(f"hits of 64 bundles: {name}, resolution {width}")
                many = ("--bundles", 64)
                result = engine(bench, path, width, 1, "--runs", bench.runs, *many)
                yield Row("all hits of 64 bundles, sorted, processor time", name, f"resolution {width}", EMBREE,
                          *(result["processor"][key] for key in ("hits", "embree")), 0.7,
                          details={"hits, M": equal(result["hits"], result["embree"]["hits"])},
                          ours_alone=alone(bench, path, width, 1, "hits", *many))


def lenses(bench: Bench) -> Rows:
    kinds = (("equirectangular", 2048, 1024), ("fisheye", 1024, 1024), ("lidar", 31250, 64))
    for _ in bench.at("1920x1080"):
        for name, path in bench.those("soup-192k", "gearbox", "helmet"):
            for lens, *size in kinds:
                width, height = bench.shrunk(*size)
                say(f"hits through a lens: {name}, {lens}")
                more = ("--lens", lens)
                result = engine(bench, path, width, height, "--runs", bench.runs, *more)
                ours = statistics.median(result["processor"]["hits"]) / 1000
                rates = (f"{result[what] / ours / 1e6:.1f}" for what in ("rays", "hits"))
                yield Row("all hits of a lens or list, sorted, processor time", f"{name}, {lens}", f"{width}x{height}", EMBREE,
                          *(result["processor"][key] for key in ("hits", "embree")), 1.0,
                          details={"hits, M": equal(result["hits"], result["embree"]["hits"]),
                                   "M rays, M hits a second": ", ".join(rates)},
                          ours_alone=alone(bench, path, width, height, "hits", *more))


def maps(bench: Bench) -> Rows:
    rows = (("thickness", "hits", 1920, 1080), ("parity", "hits", 1920, 1080), ("voxels", "axes", 512, 1))
    for _ in bench.at("1920x1080"):
        for name, path in bench.those("soup-192k", "gearbox"):
            for what, parts, *size in rows:
                width, height = bench.shrunk(*size)
                say(f"{what}: {name}")
                result = engine(bench, path, width, height, "--runs", bench.runs, "--what", f"{what},{parts}")
                shown = f"{width} cells" if what == "voxels" else f"{width}x{height}"
                yield Row("maps and voxels with their hits, processor time", f"{what} of {name}", shown, "the hits alone",
                          *(result["processor"][key] for key in (what, parts)), 1.3,
                          details={"hits, M": f"{result[parts] / 1e6:.2f}"},
                          ours_alone=alone(bench, path, width, height, what))


def growth(bench: Bench) -> Rows:
    """Times 1 to 64 million hits: first from a growing number of rays, then from a growing number of spheres."""
    def rays(millions: int) -> Tuple[str, int, int]:
        width = 1920 * math.sqrt(millions / 4.7)  # 1920 rays per row give 4.7 million hits
        return ("soup-192k", *bench.shrunk(round(width), round(width * 9 / 16)))

    def depth(count: int) -> Tuple[str, int, int]:
        return (f"soup-of-{count}", *bench.shrunk(1920, 1080))

    kinds = (("rays", [rays(2 ** i) for i in range(7)]), ("spheres", [depth(count) for count in scenes.SOUPS]))
    for _ in bench.at("1920x1080"):
        for kind, points in kinds:
            if not bench.those("soup-192k"):
                continue
            times: List[Tuple[float, float]] = []
            resident: List[Tuple[float, float]] = []
            for name, width, height in points:
                path = bench.scenes.get(name) or scenes.write(bench.scratch, name)
                say(f"growth: {name}, {width}x{height}")
                result = engine(bench, path, width, height, "--runs", bench.runs, "--what", "hits")
                times.append((result["hits"], statistics.median(result["processor"]["hits"])))
                kept = [engine(bench, path, width, height, "--runs", 0, "--what", "kept")["resident"]
                        for _ in range(bench.runs)]
                resident.append((result["hits"], statistics.median(kept)))
            hits = f"{times[0][0] / 1e6:.1f} to {times[-1][0] / 1e6:.1f} M hits"
            for what, measured, unit, least in (("processor time", times, "ms", 1.0),
                                                ("memory of kept hits", resident, "MB", 1e6)):
                ends = " to ".join(f"{measured[i][1] / least:,.0f}" for i in (0, -1))
                yield Row("exponent over hits", f"{what}, more {kind}", hits, "", [exponent(measured)], [1.0], 1.05, "",
                          mine="exponent", details={"": f"{ends} {unit}"},
                          ours_alone=alone(bench, path, width, height, "hits") if what == "processor time" else ())


def baking(bench: Bench) -> Rows:
    """Bakes the vertices of models, and the texels of one texture."""
    directions, fewer, reference = bench.shrunk(1024, 256, 4096)
    texels, = bench.shrunk(2048)
    kinds = (("vertices", "2CylinderEngine", directions, 0, 1.0), ("texels", "helmet", fewer, texels, 0.4))
    for _ in bench.at("1920x1080"):
        for what, name, count, side, target in kinds:
            for _, path in bench.those(name):
                say(f"occlusion at {what}: {name}")
                done = bench.program("bake_ao", path, "--directions", count, "--reference", reference, "--runs", bench.runs,
                                     "--json", *(("--texels", side) if side else ()))[0]
                errors = {key: done["errors"][key] for key in ("peeler", "embree")}
                note = (f"{done['receivers'] / 1e6:.2f} M {what}; error {errors['peeler']:.4f}, Embree's "
                        f"{errors['embree']:.4f}")
                fails = ""
                if errors["peeler"] > errors["embree"] + MOST_ERROR:
                    fails = f"the error is more than {MOST_ERROR} above Embree's"
                target_of = ("--target", "texture", "--size", side) if side else ("--target", "vertices")
                baked = bench.scratch / ("baked.exr" if side else "baked.glb")
                ours, theirs = ([1000 * taken for taken in done["seconds"][key]] for key in ("peeler", "embree"))
                yield Row(f"ambient occlusion at {what}, processor time", name,
                          f"{count:,} directions" + (f", {side}x{side}" if side else ""), "Embree: hierarchy, rays", ours,
                          theirs, target, note=note + (f": not met, {fails}" if fails else ""), fails=fails,
                          ours_alone=[bench.peeler, "bake", path, "-o", baked, "--engine", "cpu", "--directions", count,
                                      "--quiet", *target_of])


KINDS: Dict[str, Callable[[Bench], Rows]] = {
    "bundle": bundle, "bundles": bundles, "lenses": lenses, "maps": maps, "growth": growth, "baking": baking}
