#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures everything that the documents tell numbers of, and writes it into tests/benchmarks/RESULTS.md.

    sh tests/run.sh bench                              all of it, and the table of README.md
    sh tests/run.sh bench stages files                 these sections; the others stay as they are
    sh tests/run.sh bench side-by-side -- --quick      with more options of the section's command: printed, not written
    sh tests/run.sh bench --gpu PAGE                   the section of a GPU, from the page of a run there

A section is a command that prints Markdown tables. It is written as soon as it is measured, with the commit and the
machine that it was measured with.
"""
from __future__ import annotations

import argparse
import re
import subprocess
import sys
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Tuple

from machine import ASSETS, ROOT, facts
from side_by_side import say

RESULTS = ROOT / "tests/benchmarks/RESULTS.md"
README = ROOT / "README.md"
ENGINE, GLASSES, PLANT, JELLYFISH = (f"examples/scenes/{name}.glb" for name in ("engine", "glasses", "plant", "jellyfish"))
MODELS = "{assets}/gltf-sample-assets/"
DUCK, HELMET = MODELS + "Duck/glTF-Binary/Duck.glb", MODELS + "DamagedHelmet/glTF-Binary/DamagedHelmet.glb"
CYLINDERS, WALKER = MODELS + "2CylinderEngine/glTF/2CylinderEngine.gltf", MODELS + "CesiumMan/glTF-Binary/CesiumMan.glb"
JOB_SCENES = tuple(f"{MODELS}{name}/glTF-Binary/{name}.glb" for name in (
    "Box", "BoxInterleaved", "BoxVertexColors", "UnlitTest", "BoxTexturedNonPowerOfTwo", "BoxTextured", "AnimatedMorphCube",
    "SimpleInstancing", "RiggedSimple", "VertexColorTest", "InterpolationTest", "OrientationTest", "TextureSettingsTest",
    "MultiUVTest", "NegativeScaleTest", "Duck", "MetalRoughSpheresNoTextures", "CesiumMan", "TransmissionTest",
    "DamagedHelmet"))
ALL_METHODS = "a-buffer,front-to-back,two-pass,back-to-front,dual,dual-max,weighted-average,weighted-sum,unsorted"

HEAD = """# Measurements

Written by `sh tests/run.sh bench`, never by hand: every number here was printed by the command above it. Each section
says at which commit and on which machine; `sh tests/run.sh bench SECTION` measures one again.
"""


class Section(NamedTuple):
    title: str
    text: str
    commands: Tuple[Tuple[str, ...], ...]  # scripts of this folder, or programs of the build folder


SECTIONS: Dict[str, Section] = {
    "side-by-side": Section(
        "Side by side",
        "peeler beside what people use, in turn; ratios are ours to theirs, of medians. What each row is: "
        "[tests/README.md](../README.md#measured-side-by-side).",
        (("table.py", "--build", "{build}", "--rows", "capture,composite,command,writers,flatten,stages,start,layers,memory"),)),
    "hits": Section(
        "Hits",
        "What the CPU finds of rays without GL, and what is made of that, beside Embree in turn; ratios are ours to theirs, of "
        "medians. What each row is: [tests/README.md](../README.md#measured-side-by-side).",
        (("table.py", "--build", "{build}", "--rows", "bundle,bundles,maps,hits,baking,growth"),)),
    "many-views": Section(
        "Many views",
        "Many views by one process; views of every sample model of 500 triangles or more as a data set has them, beside the "
        "depths of their layers by Embree; masks of all objects, beside a render of each. Ratios are ours to theirs, of "
        "medians. What each row is: [tests/README.md](../README.md#measured-side-by-side).",
        (("table.py", "--build", "{build}", "--rows", "views,datasets,masks", "--scenes", "gearbox"),)),
    "against-three": Section(
        "Against three.js",
        "Composites of peeler beside three.js in headless Chromium: the same camera, 16 places a pixel, one environment "
        "picture, linear light, black behind. PSNR (linear, 1 the brightest) and FLIP (mean, of sRGB) of what a screen shows, "
        "where either picture shows anything; luminance is ours to theirs. The first rows are spheres and squares that are "
        "made here, in a furnace all of white. What differs, and why: "
        "[light and materials](../../examples/guide/light.md#beside-threejs).",
        (("against_three.py", "--build", "{build}"),)),
    "shading-spheres": Section(
        "Shading spheres",
        "Spheres of one material each, of roughness 0.2 and more, lit by an environment with a gradient, coloured sides and a "
        "small bright box, beside the integral of the lobes of glTF's specification over it. The relative error is the root "
        "mean square difference over the integral's root mean square; a step is from a pixel to the next; the furnace is "
        "light of 1 from everywhere, and its column how far white spheres are from 1 there at most. What is integrated, and "
        "how: [referee.py](referee.py).",
        (("referee.py", "{build}/peeler"),)),
    "stages": Section(
        "Stages",
        "Layered files by every exact method: milliseconds of each stage, of the run with the smallest total.",
        (("stage_times.py", "{build}/peeler", ENGINE, GLASSES, HELMET, CYLINDERS, "--runs", "2"),)),
    "composites": Section(
        "Composites",
        "The same of composites, by every method.",
        (("stage_times.py", "{build}/peeler", ENGINE, "--runs", "2", "--methods", ALL_METHODS,
          "--", "--as", "composite", "--surfaces", "visible"),)),
    "files": Section(
        "Files",
        "Size, and milliseconds to encode and write, in every form, layout and compression.",
        (("file_sizes.py", "{build}/peeler", GLASSES, ENGINE, PLANT, "--runs", "2"),)),
    "views": Section(
        "Views",
        "PSNR of `peeler view` against a direct render from the same camera, so many degrees beside the file's, in linear "
        "light; inf is identical. The layers were captured 1.5 times as wide, so that both see the same.",
        (("views_from_layers.py", "{build}/peeler", ENGINE, PLANT, JELLYFISH, GLASSES),)),
    "baking": Section(
        "Baking",
        "Ambient occlusion at vertices by peeler and by Embree along the same directions: processor seconds (of peeler with "
        "placing the scene, of Embree with building its hierarchy), and the root mean square error against rays of Embree of "
        "each vertex's own. `raised` is how much that reference itself changes if its rays start 1e-4 of the size higher.",
        (("{build}/tests/bake_ao", CYLINDERS, HELMET, DUCK),)),
    "frames": Section(
        "Frames",
        "What a frame takes in one process for all, beside a process for each. The files are the same.",
        (("frames_in_one_process.py", "{build}/peeler", JELLYFISH, ENGINE, "--", "--size", "640x360"),
         ("frames_in_one_process.py", "{build}/peeler", JELLYFISH, WALKER, "--frames", "10", "--runs", "2",
          "--", "--size", "1920x1080"))),
    "jobs": Section(
        "Jobs",
        "Jobs a minute of one `peeler worker`, beside a process for each job; 20 sample models in turn. The files are the same.",
        (("jobs_in_one_worker.py", "{build}/peeler", *JOB_SCENES,
          "--", "--size", "640x360"),)),
    "python-calls": Section(
        "Calls from Python",
        "What a call from Python takes, beside the same call of the C++ library: all layers of 64 x 64 pixels.",
        (("python_calls.py", "{build}", "examples/scenes/panes.glb", "examples/scenes/coincident.glb"),)),
    "budgets": Section(
        "Budgets",
        "The most that was resident in large pictures, and under budgets of memory.",
        (("budgets.py", "{build}/peeler"),)),
    "meshes": Section(
        "Meshes",
        "Processor seconds of `peeler info` for ten million triangles (OBJ: two million) on one core, without what a file of "
        "two triangles takes.",
        (("mesh_reading.py", "{build}/peeler"),)),
    "gpu": Section(
        "On a GPU",
        "What [a run on a GPU](../README.md#on-a-gpu) said, with what was packed at this commit: the tests of GL, every method "
        "against the A-buffer, every fragment against Mesa's rasteriser by class, and what was measured. Times are in "
        "milliseconds.",
        ()),
}


class Number(NamedTuple):
    """A row of the README's table and its place in the results."""

    what: str
    section: str
    cells: Dict[str, str]  # the cells of its row
    rival: str  # if the rival's column does not name it
    ours: str = "ours"
    theirs: str = "theirs"


HD = "1920x1080"
NUMBERS = (
    Number("every fragment of 30 glass spheres, shaded; Embree: all hits, not shaded", "side-by-side",
           {"what": "capture", "scene": "spheres", "size": HD}, ""),
    Number("every fragment of the sample model GearboxAssy; likewise", "side-by-side",
           {"what": "capture", "scene": "gearbox", "size": HD}, ""),
    Number("exact composite of 30 glass spheres", "side-by-side",
           {"what": "composite, exact", "scene": "spheres", "size": HD}, ""),
    Number("exact composite of 100 larger spheres", "side-by-side",
           {"what": "composite, exact", "scene": "large-spheres", "size": HD}, ""),
    Number("GearboxAssy to a PNG, the whole command", "side-by-side",
           {"what": "whole command to PNG", "scene": "gearbox", "size": HD}, ""),
    Number("writing the layers of 30 spheres", "side-by-side",
           {"what": "writing the layered file", "scene": "spheres", "size": HD, "theirs": "same windows"}, ""),
    Number("flattening a deep file of 100 spheres", "side-by-side",
           {"what": "flatten of a deep file", "scene": "large-spheres", "size": HD}, ""),
    Number("4.7 million hits of parallel rays, sorted, by the CPU; processor time", "hits",
           {"what": "all hits of a bundle, sorted, processor time", "scene": "soup-192k"}, ""),
    Number("occlusion at the vertices of 2CylinderEngine, 1,024 directions; processor time", "hits",
           {"what": "ambient occlusion at vertices, processor time", "scene": "2CylinderEngine"}, ""),
)
BEGIN = "<!-- numbers: `sh tests/run.sh bench` writes them from tests/benchmarks/RESULTS.md -->"
END = "<!-- end of numbers -->"


def command_text(command: Tuple[str, ...], build: str, assets: str) -> List[str]:
    words = [word.format(build=build, assets=assets) for word in command]
    return ["python3", f"tests/benchmarks/{words[0]}", *words[1:]] if words[0].endswith(".py") else words


def measured(section: Section, build: Path, more: List[str]) -> str:
    """Returns the output of the section's commands, each below its command line."""
    texts = []
    for command in section.commands:
        words = command_text(command, str(build), str(ASSETS))
        words[:1] = [sys.executable, "-B"] if words[0] == "python3" else words[:1]
        say(" ".join([*words, *more]))
        done = subprocess.run([*words, *more], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
        shown = " ".join([*command_text(command, "build/ci", "$PEELER_ASSETS"), *more])
        texts.append(f"`{shown}`\n\n{done.stdout.strip()}\n")
    return "\n".join(texts)


def written(name: str, known: Dict[str, str], tables: str) -> str:
    """Returns a section in the file's format."""
    section = SECTIONS[name]
    told = "".join(f"- {key}: {value}\n" for key, value in known.items())
    return f"## {section.title}\n\n{section.text}\n\n{told}\n{tables}"


def gpu_facts(page: str) -> Dict[str, str]:
    return {"commit": re.search(r"packed at commit (.+)", page)[1], "machine": re.search(r"devices, machine: (.+)", page)[1],
            "renderer": re.search(r"devices, device: (.+)", page)[1]}


def gpu_tables(page: str) -> str:
    """Returns the page of a GPU run without its date, passed tests and repetitions."""
    page = re.sub(r"\S*/(tests/\w+/\S+)", r"\1", page)  # any build folder
    shown = [re.split(r";only |; tests/", line)[0].replace("## ", "**", 1) + ("**" if line.startswith("## ") else "")
             for line in page.splitlines()[4:]
             if not re.match(r"- (devices|tests, shard \d+: \d|methods, (?!bracket)|references, .* differ by|tests, .* not packed)", line)]
    return "\n".join(shown) + "\n"


def split(text: str) -> Dict[str, str]:
    """Returns the sections of the file by name, in the order of the table."""
    names = {section.title: name for name, section in SECTIONS.items()}
    found = {names.get(part.splitlines()[0]): f"## {part.strip()}\n" for part in re.split(r"^## ", text, flags=re.M)[1:]}
    return {name: found[name] for name in SECTIONS if name in found}


def joined(sections: Dict[str, str]) -> str:
    return HEAD + "".join("\n" + sections[name] for name in SECTIONS if name in sections)


def rows(text: str) -> Iterator[Dict[str, str]]:
    """Yields the rows of all tables of a text, as cells by the columns' names (the first of two columns with one
    name)."""
    columns: List[str] = []
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")] if line.startswith("|") else []
        if not cells:
            columns = []
        elif not columns:
            columns = cells
        elif not set(line) <= set("|-: "):
            yield dict(reversed(list(zip(columns, cells))))


def amount(text: str) -> float:
    return float(text.split()[0].replace(",", ""))


def number_row(number: Number, sections: Dict[str, str]) -> str:
    for row in rows(sections.get(number.section, "")):
        if not all(row.get(key) == cell or (key == number.theirs and cell in row.get(key, ""))
                   for key, cell in number.cells.items()):
            continue
        ours, theirs = row[number.ours], row[number.theirs]
        rival = f" ({number.rival})" if number.rival else ""
        return f"| {number.what} | {ours} | {theirs}{rival} | {amount(ours) / amount(theirs):.2f} |"
    raise LookupError(f"no row of {number.section} is that of {number.what}")


def numbers_of(results: str) -> str:
    """Returns the README's table."""
    sections = split(results)
    lines = ["| at 1920 × 1080 | peeler | beside it | ratio |", "| --- | ---: | ---: | ---: |",
             *(number_row(number, sections) for number in NUMBERS)]
    return "\n".join([*lines, "", f"*{origin_of(sections)}*"])


def origin_of(sections: Dict[str, str]) -> str:
    """Returns the origin of the numbers; one per section if they come from several machines or commits."""
    origins = {}
    for name in dict.fromkeys(number.section for number in NUMBERS):
        told = dict(re.findall(r"^- (commit|machine|renderer): (.*)$", sections[name], re.M))
        origins[SECTIONS[name].title] = f"{told['machine']}; {told['renderer']}; commit {told['commit'][:10]}."
    if len(set(origins.values())) == 1:
        return next(iter(origins.values()))
    return "\n".join(f"{title}: {origin}" for title, origin in origins.items())


def with_numbers(readme: str, results: str) -> str:
    """Returns the README with its updated table."""
    begin, end = readme.index(BEGIN) + len(BEGIN), readme.index(END)
    return f"{readme[:begin]}\n\n{numbers_of(results)}\n\n{readme[end:]}"


def main() -> int:
    arguments, more = sys.argv[1:], []
    if "--" in arguments:
        at = arguments.index("--")
        arguments, more = arguments[:at], arguments[at + 1:]
    measurable = [name for name in SECTIONS if SECTIONS[name].commands]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=Path, default=ROOT / "build" / "ci", help=argparse.SUPPRESS)
    parser.add_argument("--gpu", type=Path, metavar="PAGE", help="the page that tests/gpu/run.sh has written")
    parser.add_argument("sections", nargs="*", metavar="SECTION", help=f"of {', '.join(measurable)} (default: all)")
    options = parser.parse_args(arguments)
    unknown = sorted(set(options.sections) - set(measurable))
    if unknown:
        parser.error(f"no section is called {', '.join(unknown)}; there are {', '.join(measurable)}")
    build = options.build.resolve()
    known = facts(build / "peeler")
    names = options.sections or measurable
    if options.gpu:
        page, names = options.gpu.read_text(encoding="utf-8"), ["gpu"]
    for name in names:
        text = (written(name, gpu_facts(page), gpu_tables(page)) if options.gpu
                else written(name, known, measured(SECTIONS[name], build, more)))
        if more:
            print(text)
            continue
        sections = split(RESULTS.read_text(encoding="utf-8")) if RESULTS.is_file() else {}
        results = joined({**sections, name: text})
        try:
            readme = with_numbers(README.read_text(encoding="utf-8"), results)
        except LookupError as missing:
            # The README would miss a row: prints the measurements and leaves both files as they are.
            print(text)
            say(f"{name} is not written: {missing}")
            return 1
        RESULTS.write_text(results, encoding="utf-8")
        README.write_text(readme, encoding="utf-8")
        say(f"{name} is in {RESULTS}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
