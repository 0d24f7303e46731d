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
import textwrap
from os.path import commonprefix
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

`sh tests/run.sh bench` writes this page; the command above each table printed it, at the given commit and on the given
machine. `sh tests/run.sh bench SECTION` measures one section again.
"""


class Section(NamedTuple):
    title: str
    text: str
    commands: Tuple[Tuple[str, ...], ...]  # scripts of this folder, or programs of the build folder


SECTIONS: Dict[str, Section] = {
    "side-by-side": Section(
        "Side by side",
        "peeler and other programs do [the same work](../README.md#measured-side-by-side) in turn. Ratios are ours to theirs, of "
        "medians; those in bold miss their target.",
        (("table.py", "--build", "{build}", "--rows", "capture,composite,command,writers,flatten,stages,start,layers,memory"),)),
    "hits": Section(
        "Hits",
        "peeler on the CPU, without GL, and Embree find [the same hits](../README.md#measured-side-by-side) in turn; maps, voxels "
        "and occlusion are made from them. Ratios are of medians, bold if they miss the target; pairs with a slash are ours "
        "/ Embree's.",
        (("table.py", "--build", "{build}", "--rows", "bundle,bundles,maps,hits,baking,growth"),)),
    "many-views": Section(
        "Many views",
        "One process [renders many views](../README.md#measured-side-by-side) of a scene; data sets of every sample model of 500 "
        "triangles or more, beside depths alone by Embree; masks of all objects, beside a render of each. Ratios are of "
        "medians; pixels agree where Embree finds as many layers.",
        (("table.py", "--build", "{build}", "--rows", "views,datasets,masks", "--scenes", "gearbox"),)),
    "against-three": Section(
        "Against three.js",
        "peeler and three.js in headless Chromium composite the same camera, samples (16 per pixel) and environment, in linear "
        "light over black. PSNR (linear, peak 1), mean FLIP (sRGB) and luminance (ours to theirs) cover the pixels where either "
        "picture shows anything. The first rows are spheres and squares made here; a furnace is all white. "
        "[Differences](../../examples/guide/light.md#beside-threejs).",
        (("against_three.py", "--build", "{build}"),)),
    "shading-spheres": Section(
        "Shading spheres",
        "Spheres of one material each, lit by an environment with a gradient, coloured sides and a small bright box, beside the "
        "[integral](referee.py) of glTF's lobes over it. Relative error: root mean square difference over the integral's root "
        "mean square; step: between neighbouring pixels; furnace: largest deviation of white spheres from 1 in light of 1.",
        (("referee.py", "{build}/peeler"),)),
    "stages": Section(
        "Stages",
        "`peeler render` writes layered files by every exact method: milliseconds per stage, of the fastest run.",
        (("stage_times.py", "{build}/peeler", ENGINE, GLASSES, HELMET, CYLINDERS, "--runs", "2"),)),
    "composites": Section(
        "Composites",
        "`peeler render` writes composites by every method: milliseconds per stage, of the fastest run.",
        (("stage_times.py", "{build}/peeler", ENGINE, "--runs", "2", "--methods", ALL_METHODS,
          "--", "--as", "composite", "--surfaces", "visible"),)),
    "files": Section(
        "Files",
        "`peeler render` writes every form, layout and compression: file size, and milliseconds to encode and write.",
        (("file_sizes.py", "{build}/peeler", GLASSES, ENGINE, PLANT, "--runs", "2"),)),
    "views": Section(
        "Views",
        "PSNR, in linear light, of `peeler view` against a direct render from a camera the given angle beside the file's; inf: "
        "identical. The layers are captured 1.5 times as wide, so that both see the same.",
        (("views_from_layers.py", "{build}/peeler", ENGINE, PLANT, JELLYFISH, GLASSES),)),
    "baking": Section(
        "Baking",
        "Ambient occlusion at vertices by peeler (seconds with placing the scene) and Embree (with building its hierarchy), along "
        "the same directions. RMSE is against Embree's rays in directions of each vertex's own; `raised` is the change of that "
        "reference if its rays start 1e-4 of the scene's diagonal higher.",
        (("{build}/tests/bake_ao", CYLINDERS, HELMET, DUCK),)),
    "frames": Section(
        "Frames",
        "One process for all frames, beside a process for each; the files are the same.",
        (("frames_in_one_process.py", "{build}/peeler", JELLYFISH, ENGINE, "--", "--size", "640x360"),
         ("frames_in_one_process.py", "{build}/peeler", JELLYFISH, WALKER, "--frames", "10", "--runs", "2",
          "--", "--size", "1920x1080"))),
    "jobs": Section(
        "Jobs",
        "One `peeler worker`, beside a process for each job, renders 20 sample models in turn; the files are the same.",
        (("jobs_in_one_worker.py", "{build}/peeler", *JOB_SCENES,
          "--", "--size", "640x360"),)),
    "python-calls": Section(
        "Calls from Python",
        "The same call from Python and of the C++ library: all layers of 64 x 64 pixels.",
        (("python_calls.py", "{build}", "examples/scenes/panes.glb", "examples/scenes/coincident.glb"),)),
    "budgets": Section(
        "Budgets",
        "Peak resident memory of `peeler render` in large pictures and under `--memory`.",
        (("budgets.py", "{build}/peeler"),)),
    "meshes": Section(
        "Meshes",
        "Processor seconds of `peeler info` on one core for ten million triangles (OBJ: two million), less those for two "
        "triangles.",
        (("mesh_reading.py", "{build}/peeler"),)),
    "gpu": Section(
        "On a GPU",
        "[A run on a GPU](../README.md#on-a-gpu) with the pack of this commit: GL tests, methods, fragments beside Mesa's "
        "rasteriser by class, and times in milliseconds.",
        ()),
}


class Number(NamedTuple):
    """A row of the README's table, and where its numbers are in the results."""

    what: str
    section: str
    cells: Dict[str, str]  # cells by which its row is found
    rival: str  # name of the rival, if no column gives it
    ours: str = "ours"
    theirs: str = "theirs"


HD = "1920x1080"
NUMBERS = (
    Number("every fragment of 30 glass spheres, shaded; Embree: all hits, not shaded", "side-by-side",
           {"what": "capture", "scene": "spheres", "size": HD}, ""),
    Number("the same for the sample model GearboxAssy", "side-by-side",
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
    """Returns the output of all commands of a section, each below its command line."""
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
    """Returns a section as it is written to the file."""
    section = SECTIONS[name]
    told = "".join(f"- {key}: {value}\n" for key, value in known.items())
    text = textwrap.fill(section.text, 120, break_long_words=False, break_on_hyphens=False)
    return f"## {section.title}\n\n{text}\n\n{told}\n{tables}"


def gpu_facts(page: str) -> Dict[str, str]:
    return {"commit": re.search(r"packed at commit (.+)", page)[1], "machine": re.search(r"devices, machine: (.+)", page)[1],
            "renderer": re.search(r"devices, device: (.+)", page)[1]}


def gpu_tables(page: str) -> str:
    """Returns the page of a GPU run without the date, the tests that passed, and repetitions."""
    page = re.sub(r"\S*/(tests/\w+/\S+)", r"\1", page)  # drops the path of the build folder
    shown = [re.split(r";only |; tests/", line)[0].replace("## ", "**", 1) + ("**" if line.startswith("## ") else "")
             for line in page.splitlines()[4:]
             if not re.match(r"- (devices|tests, shard \d+: \d|methods, (?!bracket)|references, .* differ by|tests, .* not packed)", line)]
    return condensed(shown)


BULLET = re.compile(r"- (\w+), (.*?): (.*)")


def counts(text: str) -> Dict[str, str]:
    """Returns {"the same": "11", "other depth": "1923"} for "11 the same, 1923 other depth", and {} for other texts."""
    found: Dict[str, str] = {}
    for part in text.split(","):
        words = part.split()
        numbers = [word for word in words if re.fullmatch(r"[\d.]+", word)]
        if len(numbers) != 1 or len(words) < 2:
            return {}
        found[" ".join(word for word in words if word not in numbers)] = numbers[0]
    return found if len(found) > 1 else {}


def condensed(lines: List[str]) -> str:
    """Returns the page with neighbouring lines of the same counts as a table and lines of the same text as one line."""
    found: Dict[Tuple[str, ...], List[Tuple[str, str]]] = {}  # {part and columns, or text: names and lines}, in order
    for i, line in enumerate(lines):
        bullet = BULLET.fullmatch(line)
        if not bullet:
            found[(str(i),)] = [("", line)]
            continue
        part, name, text = bullet.groups()
        text = re.sub(r";\s+", "; ", re.split(r", where;|, peeler: ", text)[0])
        columns = counts(text)
        found.setdefault((part, *columns) if columns else (part, "", text), []).append((name, f"- {part}, {name}: {text}"))
    shown: List[str] = []
    for (part, *columns), told in found.items():
        names = [name for name, _ in told]
        if len(told) == 1:
            shown += [line for _, line in told]
        elif columns[0]:
            shown += [*([""] if shown[-1] else []), f"| {part} | {' | '.join(columns)} |", "| --- |" + " ---: |" * len(columns)]
            shown += [f"| {name} | {' | '.join(counts(line.split(': ', 1)[1]).values())} |" for name, line in told]
            shown.append("")
        else:
            start = commonprefix(names)
            shown.append(f"- {part}, {start}{{{', '.join(name[len(start):] for name in names)}}}: {columns[1]}")
    return re.sub(r"\n{3,}", "\n\n", "\n".join(shown)).rstrip() + "\n"


def split(text: str) -> Dict[str, str]:
    """Returns the file's sections by name, in the order of SECTIONS."""
    names = {section.title: name for name, section in SECTIONS.items()}
    found = {names.get(part.splitlines()[0]): f"## {part.strip()}\n" for part in re.split(r"^## ", text, flags=re.M)[1:]}
    return {name: found[name] for name in SECTIONS if name in found}


def joined(sections: Dict[str, str]) -> str:
    return HEAD + "".join("\n" + sections[name] for name in SECTIONS if name in sections)


def rows(text: str) -> Iterator[Dict[str, str]]:
    """Yields the rows of all tables in a text as {column: cell}. If two columns have the same name, the first
    counts."""
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


def comparisons(text: str) -> Iterator[Dict[str, str]]:
    """Yields the rows of table.py's tables in the form of its last table."""
    for row in rows(text):
        columns = list(reversed(row))  # the columns in their original order
        if columns[0] == "what":
            yield row
            continue
        ours = next((name for name in columns if name.startswith("ours, ")), None)
        if ours:
            what, _, size = columns[0].partition("; ")
            rival, unit = columns[columns.index(ours) + 1].rsplit(", ", 1)
            yield {"what": what, "scene": row[columns[0]], "size": size or row["size"], "ours": f"{row[ours]} {unit}",
                   "theirs": f"{row[f'{rival}, {unit}']} {unit} ({rival})"}


def number_row(number: Number, sections: Dict[str, str]) -> str:
    for row in comparisons(sections.get(number.section, "")):
        if not all(row.get(key) == cell or (key == number.theirs and cell in row.get(key, ""))
                   for key, cell in number.cells.items()):
            continue
        ours, theirs = row[number.ours], row[number.theirs]
        rival = f" ({number.rival})" if number.rival else ""
        return f"| {number.what} | {ours} | {theirs}{rival} | {amount(ours) / amount(theirs):.2f} |"
    raise LookupError(f"no row of {number.section} is that of {number.what}")


def numbers_of(results: str) -> str:
    """Returns the table of the README."""
    sections = split(results)
    lines = ["| at 1920 × 1080 | peeler | other program | ratio |", "| --- | ---: | ---: | ---: |",
             *(number_row(number, sections) for number in NUMBERS)]
    return "\n".join([*lines, "", f"*{origin_of(sections)}*"])


def origin_of(sections: Dict[str, str]) -> str:
    """Returns where the numbers come from; a line per section if there are several machines or commits."""
    origins = {}
    for name in dict.fromkeys(number.section for number in NUMBERS):
        told = dict(re.findall(r"^- (commit|machine|renderer): (.*)$", sections[name], re.M))
        origins[SECTIONS[name].title] = f"{told['machine']}; {told['renderer']}; commit {told['commit'][:10]}."
    if len(set(origins.values())) == 1:
        return next(iter(origins.values()))
    return "\n".join(f"{title}: {origin}" for title, origin in origins.items())


def with_numbers(readme: str, results: str) -> str:
    """Returns the README with the table brought up to date."""
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
            # If the README would lack a row, the measurements are printed and both files stay as they are.
            print(text)
            say(f"{name} is not written: {missing}")
            return 1
        RESULTS.write_text(results, encoding="utf-8")
        README.write_text(readme, encoding="utf-8")
        say(f"{name} is in {RESULTS}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
