# SPDX-License-Identifier: Apache-2.0
"""The rows of the benchmark table: one function per kind measures and yields them."""
from __future__ import annotations

import json
import statistics
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Tuple

import hit_rows
import scenes
import view_rows
from side_by_side import HERE, Bench, Row, Served, exponent, in_turn, run, say

SPHERES = ("spheres", "fine-spheres", "small-spheres", "large-spheres")
REAL = ("gearbox", "lamp")
SIZED = ("fine-spheres", "large-spheres", "gearbox")  # scenes whose file sizes are compared; the others' are similar
HD, UHD = "1920x1080", "3840x2160"
Rows = Iterator[Row]


def capture(bench: Bench) -> Rows:
    every = (*SPHERES, "forest", "city", *REAL)
    for size in bench.at(HD, UHD):
        # Large pictures take four times as long, so measure only half of the scenes in them, unless only large pictures
        # were requested.
        half = size == UHD and len(bench.sizes) > 1
        for name, path in bench.those(*(every[::2] if half else every)):
            say(f"capture: {name} at {size}")
            result = bench.program("benchmark_capture", path, "--size", size, "--runs", bench.runs)
            ours, theirs = (result["milliseconds"][key] for key in ("a-buffer", "embree"))
            fragments, hits = result["fragments"], result["embree"]["hits"]
            yield Row("capture", name, size, "Embree", ours, theirs, 0.5,
                      details={"layers": f"{result['layers']}", "fragments / hits, M": hit_rows.equal(fragments, hits)},
                      ours_alone=[bench.build / "tests" / "benchmark_capture", path, "--size", size, "--runs", 5,
                                  "--what", "a-buffer"])


def camera(bench: Bench, path: Path, size: str) -> Dict[str, Any]:
    """Returns peeler's camera as other programs describe it."""
    return bench.program("benchmark_capture", path, "--size", size, "--runs", 0, "--what", "composite")["camera"]


def f3d_camera(numbers: Dict[str, Any]) -> List[str]:
    place = {"position": "eye", "focal-point": "target", "view-up": "up"}
    return [*(f"--camera-{option}=" + ",".join(map(str, numbers[key])) for option, key in place.items()),
            f"--camera-view-angle={numbers['fov']}"]


def composite(bench: Bench) -> Rows:
    script = HERE / "vtk_peeling.py"
    if not bench.has("Xvfb") or run(["/usr/bin/python3", "-c", "import vtk"], check=False).code != 0:
        bench.skip("composite: python3-vtk9 is not installed")
        return
    chosen = [(size, name, path) for size in bench.at(HD, UHD)
              for name, path in bench.those(*(SPHERES if size == HD else SPHERES[:1]))]
    for size, name, path in chosen:
        say(f"composite: {name} at {size}")
        width, height = size.split("x")
        vtk = Served(["/usr/bin/python3", script, path, width, height, json.dumps(camera(bench, path, size)),
                      bench.pictures / f"{name}-{size}-vtk.png"], bench.display)

        def ours() -> float:
            result = bench.program("benchmark_capture", path, "--size", size, "--runs", 1, "--what", "composite")
            return result["milliseconds"]["composite"][0]

        times = in_turn([ours, vtk], bench.runs)
        vtk.close()
        run([bench.peeler, "render", path, "-o", bench.pictures / f"{name}-{size}-peeler.png", "--size", size])
        yield Row("composite, exact", name, size, "VTK dual peeling", times[0], times[1], 0.1,
                  ours_alone=[bench.build / "tests" / "benchmark_capture", path, "--size", size, "--runs", 5,
                              "--what", "composite"])


def command(bench: Bench) -> Rows:
    if not bench.has("f3d") or not bench.has("Xvfb"):
        return
    for name, path in bench.those(*REAL):
        for size in bench.at(HD):
            say(f"whole command: {name} at {size}")
            plain = path
            if name == "gearbox":  # f3d gets it decoded
                plain = bench.scratch / "gearbox.glb"
                run([bench.build / "tests" / "plain_glb", path, plain])

            same = f3d_camera(camera(bench, path, size))

            def render(samples: int) -> List[Any]:
                return [bench.peeler, "render", path, "-o", bench.pictures / f"{name}-{samples}-peeler.png", "--size", size,
                        "--samples", str(samples)]

            def theirs() -> float:
                return run(["f3d", "-p", "--dry-run", "--quiet", "--output", bench.pictures / f"{name}-f3d.png",
                            "--resolution", size.replace("x", ","), *same, plain], bench.display).milliseconds

            one, four, others = in_turn([lambda: run(render(1)).milliseconds, lambda: run(render(4)).milliseconds, theirs],
                                        bench.runs)
            at_one, at_four = {"gearbox": (0.5, 0.7), "lamp": (0.35, 0.4)}[name]
            yield Row("whole command to PNG", name, size, "f3d -p", one, others, at_one, ours_alone=render(1))
            yield Row("whole command to PNG, 4 samples", name, size, "f3d -p", four, others, at_four,
                      ours_alone=render(4))


def writers(bench: Bench) -> Rows:
    chosen = [(size, name, path) for size in bench.at(HD) for name, path in bench.those(*SPHERES, "gearbox")]
    for size, name, path in chosen:
        say(f"writers: {name} at {size}")
        result = bench.program("benchmark_writers", path, "--size", size, "--runs", bench.runs, "--folder",
                               bench.scratch)

        def row(kind: str, what: str, rival: str, key: str, target: float) -> Row:
            times = result[kind]["milliseconds"]
            return Row(what, name, size, rival, times["peeler"], times[key], target,
                       ours_alone=[bench.build / "tests" / "benchmark_writers", path, "--size", size, "--runs", 5,
                                   "--folder", bench.scratch, "--what", f"{kind},ours"])

        def file(kind: str, rival: str, key: str) -> Row:
            sizes = {key: value / 1e6 for key, value in result[kind]["bytes"].items()}
            return Row("size of the file", name, size, rival, [sizes["peeler"]], [sizes[key]], 1.0, "MB", mine=kind)

        yield row("layered", "writing the layered file", "OpenEXR, full windows", "full", 0.2)
        yield row("layered", "writing the layered file", "OpenEXR, same windows", "cropped", 0.6)
        yield row("deep", "writing the deep file", "OpenEXR, ZIPS", "openexr", 0.6)
        if name in SIZED:
            yield file("layered", "OpenEXR, same windows", "cropped")
            yield file("deep", "OpenEXR, ZIPS", "openexr")


def hits(bench: Bench) -> Rows:
    if run(["/usr/bin/python3", "-c", "import numpy"], check=False).code != 0:
        bench.skip("hits: python3-numpy is not installed")
        return
    bundles = "1700x4"  # 11 million hits
    for _ in bench.at(HD):
        for name, path in bench.those("gearbox"):
            say(f"hits into .npz: {name}")
            ours: List[float] = []
            capture: List[float] = []
            savez: List[float] = []
            traced: Dict[str, Any] = {}
            copy = bench.scratch / "savez.npz"
            arguments = (path, "--size", bundles, "--runs", 1, "--folder", bench.scratch)
            for _ in range(bench.runs):
                traced = bench.program("benchmark_hits", *arguments)
                for numbers, key in ((ours, "npz"), (capture, "capture")):
                    numbers += traced["processor"][key]
                written = run(["/usr/bin/python3", HERE / "savez.py", bench.scratch / "hits.npz", copy])
                savez.append(json.loads(written.out)["processor"])
                copy.unlink()  # so that numpy creates the file, as peeler does
            (bench.scratch / "hits.npz").unlink()
            yield Row("hits into .npz, processor time", name, "4 bundles", "capture + numpy.savez of the same arrays",
                      ours, [sum(pair) for pair in zip(capture, savez)], 1.0,
                      note=f"{traced['hits'] / 1e6:.2f} M hits; numpy.savez {statistics.median(savez):.0f} ms; capture "
                      f"{statistics.median(capture):.0f} ms",
                      ours_alone=[bench.build / "tests" / "benchmark_hits", *arguments[:-3], 3, "--what", "npz",
                                  "--folder", bench.scratch])


def flatten(bench: Bench) -> Rows:
    if not bench.has("oiiotool"):
        return
    for size in bench.at(HD):
        for name, path in bench.those("spheres", "large-spheres", "gearbox"):
            say(f"flatten: {name} at {size}")
            deep, flat = bench.scratch / "deep.exr", bench.scratch / "flat.exr"
            run([bench.peeler, "render", path, "-o", deep, "--as", "deep", "--size", size])
            times = in_turn([
                lambda: run([bench.peeler, "flatten", deep, "-o", flat]).milliseconds,
                lambda: run(["oiiotool", deep, "--flatten", "-d", "half", "-d", "Z=float", "--compression", "zip",
                             "-o", flat]).milliseconds], bench.runs)
            deep.unlink()
            yield Row("flatten of a deep file", name, size, "oiiotool --flatten", *times, 0.2)


def stages(bench: Bench) -> Rows:
    for size in bench.at(HD):
        for name, path in bench.those("spheres", "large-spheres", "city", *REAL):
            say(f"stages: {name} at {size}")
            wall: List[float] = []
            parts: List[float] = []
            render = [bench.peeler, "render", path, "-o", bench.scratch / "out.exr", "--size", size, "--json", "--quiet"]
            for _ in range(bench.runs):
                done = run(render)
                times: Dict[str, float] = json.loads(done.out)["milliseconds"]
                wall.append(done.milliseconds)
                parts.append(sum(value for stage, value in times.items() if stage != "total"))
            yield Row("whole command, layered file", name, size, "sum of its stages", wall, parts, 1.05,
                      ours_alone=render)


def start(bench: Bench) -> Rows:
    scene = scenes.write(bench.scratch, "triangle")
    render = [bench.peeler, "render", scene, "-o", bench.scratch / "out.exr", "--size", "16x16", "--json", "--quiet"]
    until_drawn: List[float] = []

    def ours() -> float:
        done = run(render)
        times = json.loads(done.out)["milliseconds"]
        before = run([bench.peeler, "--version"]).milliseconds
        until_drawn.append(before + sum(times.get(stage, 0) for stage in ("load", "context", "upload", "count")))
        return done.milliseconds

    say("start-up")
    bare = bench.build / "tests" / "bare_context"
    times = in_turn([ours, lambda: run([bare]).milliseconds], max(bench.runs, 7))
    yield Row("start-up (`--version`, load, context, upload, count)", "triangle", "16x16", "bare context, one program",
              until_drawn, times[1], 1.5)
    yield Row("whole command, one triangle", "triangle", "16x16", "bare context, one program", *times, None)


def layers(bench: Bench) -> Rows:
    """Times captures of N layers. The work of the other programs grows with N², so they get smaller pictures, fewer
    layers and a single run."""
    kinds = (("a-buffer", "1280x720", scenes.LAYERS, bench.runs, 1.1), ("dual", "640x360", scenes.LAYERS[:6], 1, None),
             ("front-to-back", "640x360", scenes.LAYERS[:6], 1, None))
    for method, size, counts, runs, target in kinds:
        points: List[Tuple[float, float]] = []
        for count in counts:
            say(f"layers: {count} by {method}")
            result = bench.program("benchmark_capture", scenes.write(bench.scratch, f"quads-{count}"), "--size", size,
                                   "--runs", runs, "--what", method)
            points.append((result["fragments"], statistics.median(result["milliseconds"][method])))
        for first in (1, 8):
            chosen = [point for count, point in zip(counts, points) if count >= first]
            yield Row("exponent of time over fragments of N quads", f"{method}, N up to {counts[-1]}", size, "",
                      [exponent(chosen)], [1.0], target, "", mine=f"N from {first}",
                      details={"ms": f"{points[0][1]:.0f} to {points[-1][1]:.0f}"})


def memory(bench: Bench) -> Rows:
    for name, path in bench.those("large-spheres"):
        for size in bench.at(UHD):
            for budget, limit in (("", 1500.0), ("512M", 536.870912), ("1G", 1073.741824)):
                say(f"memory: {name} at {size}, {budget or 'default'}")
                done = run([bench.peeler, "render", path, "-o", bench.scratch / "out.exr", "--size", size,
                            *(("--memory", budget) if budget else ())], check=False)
                note = f"refused: {done.err.strip().splitlines()[-1]}" if done.code != 0 else ""
                yield Row("peak memory", name, size, f"--memory {budget}" if budget else "no --memory",
                          [done.peak_bytes / 1e6], [limit], 1.0, "MB", note)


KINDS: Dict[str, Callable[[Bench], Rows]] = {
    "capture": capture, "composite": composite, "command": command, "writers": writers, "hits": hits, "flatten": flatten,
    "stages": stages, "start": start, "layers": layers, "memory": memory, **hit_rows.KINDS,
    **view_rows.KINDS}
GENERATED: Tuple[str, ...] = (*SPHERES, "forest", "city", *hit_rows.SOUPS)
MODELS: Dict[str, Path] = {
    "gearbox": Path("gltf-sample-assets/GearboxAssy/glTF-Draco/GearboxAssy.gltf"),
    "lamp": Path("gltf-sample-assets/StainedGlassLamp/glTF-JPG-PNG/StainedGlassLamp.gltf"),
    "2CylinderEngine": Path("gltf-sample-assets/2CylinderEngine/glTF/2CylinderEngine.gltf"),
    "helmet": Path("gltf-sample-assets/DamagedHelmet/glTF-Binary/DamagedHelmet.glb")}
