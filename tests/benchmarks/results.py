#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures all published numbers, and writes them to tests/benchmarks/RESULTS.md.

    sh tests/run.sh bench                              all sections, and the table in README.md
    sh tests/run.sh bench stages files                 only these sections
    sh tests/run.sh bench side-by-side -- --quick      with extra options for the section's command: printed, not written
    sh tests/run.sh bench --gpu PAGE                   the section of a GPU, from the results page of a run on it

A section is a command that prints Markdown tables. It is written as soon as it is measured, with its commit. The machine,
renderer and versions of most sections stand in the head of the page, those of other sections in these.
"""
from __future__ import annotations

import argparse
import re
import subprocess
import sys
import textwrap
from itertools import groupby
from os.path import commonprefix
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Tuple

from machine import ASSETS, ROOT, facts
from side_by_side import say

RESULTS = ROOT / "tests/benchmarks/RESULTS.md"
README = ROOT / "README.md"
ENGINE, GLASSES, PLANT, JELLYFISH = (f"examples/scenes/{name}.glb" for name in ("engine", "glasses", "plant", "jellyfish"))
MODELS = "{assets}/gltf-sample-assets/"
HELMET = MODELS + "DamagedHelmet/glTF-Binary/DamagedHelmet.glb"
CYLINDERS, WALKER = MODELS + "2CylinderEngine/glTF/2CylinderEngine.gltf", MODELS + "CesiumMan/glTF-Binary/CesiumMan.glb"
JOB_SCENES = tuple(f"{MODELS}{name}/glTF-Binary/{name}.glb" for name in (
    "Box", "BoxInterleaved", "BoxVertexColors", "UnlitTest", "BoxTexturedNonPowerOfTwo", "BoxTextured", "AnimatedMorphCube",
    "SimpleInstancing", "RiggedSimple", "VertexColorTest", "InterpolationTest", "OrientationTest", "TextureSettingsTest",
    "MultiUVTest", "NegativeScaleTest", "Duck", "MetalRoughSpheresNoTextures", "CesiumMan", "TransmissionTest",
    "DamagedHelmet"))
RATED = (
    "GearboxAssy/glTF-Draco/GearboxAssy.gltf", "2CylinderEngine/glTF/2CylinderEngine.gltf",
    "MetalRoughSpheresNoTextures/glTF-Binary/MetalRoughSpheresNoTextures.glb", "Duck/glTF-Binary/Duck.glb",
    "StainedGlassLamp/glTF-JPG-PNG/StainedGlassLamp.gltf", "DamagedHelmet/glTF-Binary/DamagedHelmet.glb",
    "CesiumMilkTruck/glTF/CesiumMilkTruck.gltf", "Fox/glTF/Fox.gltf",
    "TransmissionTest/glTF-Binary/TransmissionTest.glb", "NormalTangentTest/glTF-Binary/NormalTangentTest.glb")
ALL_METHODS = "a-buffer,front-to-back,two-pass,back-to-front,dual,dual-max,weighted-average,weighted-sum,weighted-blended,moment-based,unsorted"

HEAD = """# Measurements

`sh tests/run.sh bench` writes this page, `sh tests/run.sh bench SECTION` one section ([commands](results.py)). Unless a
section says otherwise:

"""


class Section(NamedTuple):
    title: str
    text: str
    commands: Tuple[Tuple[str, ...], ...]  # scripts of this folder, or programs of the build folder


SECTIONS: Dict[str, Section] = {
    "side-by-side": Section(
        "Side by side",
        "peeler and other programs do [the same work](../README.md#measured-side-by-side) in turn. Ratios here and in the next two "
        "sections are ours to theirs, of medians; bold ones miss their target.",
        (("table.py", "--build", "{build}", "--rows", "capture,composite,writers,flatten,stages,start,layers,memory"),)),
    "pictures": Section(
        "Pictures",
        "The whole command from a scene to a PNG, beside f3d, in turn.",
        (("table.py", "--build", "{build}", "--rows", "command", "--runs", "5"),)),
    "hits": Section(
        "Hits",
        "peeler on the CPU, without GL, and Embree find [the same hits](../README.md#measured-side-by-side) in turn.",
        (("table.py", "--build", "{build}", "--rows", "bundle,bundles,maps,hits,baking,growth"),)),
    "lenses": Section(
        "Lenses and lists",
        "peeler and Embree find [the same hits](../README.md#measured-side-by-side) of a lens's pixels, or of a list of LiDAR rays, "
        "in turn. Embree has single precision and may miss hits at edges.",
        (("table.py", "--build", "{build}", "--rows", "lenses,lens-views"),)),
    "many-views": Section(
        "Many views",
        "[Data sets](../README.md#measured-side-by-side) of all sample models of 500 triangles or more; pixels are alike where "
        "Embree finds as many layers.",
        (("table.py", "--build", "{build}", "--rows", "views,datasets,masks", "--scenes", "gearbox"),)),
    "against-three": Section(
        "Against three.js",
        "Composites of the same camera, 16 samples per pixel and environment, in linear light: PSNR (peak 1), mean FLIP (sRGB) and "
        "luminance (ours to theirs) of covered pixels; a furnace is all white ([reasons](../../examples/guide/light.md"
        "#beside-threejs)).",
        (("against_three.py", "--build", "{build}"),)),
    "shading-spheres": Section(
        "Shading spheres",
        "Spheres beside the [integral](referee.py) of glTF's lobes over an environment. Relative error: root mean square "
        "difference over the integral's root mean square; furnace: deviation of white spheres from 1 in light of 1.",
        (("referee.py", "{build}/peeler"),)),
    "stages": Section(
        "Stages",
        "`peeler render` writes layered files of 1920x1080 by every exact method; the fastest run.",
        (("stage_times.py", "{build}/peeler", ENGINE, HELMET, "--runs", "2"),
         ("stage_times.py", "{build}/peeler", ENGINE, HELMET, "--runs", "2", "--methods", "a-buffer", "--", "--samples", "4"))),
    "composites": Section(
        "Composites",
        "`peeler render` writes composites of 1920x1080 by every method; the fastest run.",
        (("stage_times.py", "{build}/peeler", ENGINE, "--runs", "2", "--methods", ALL_METHODS,
          "--", "--as", "composite", "--surfaces", "visible"),)),
    "files": Section(
        "Files",
        "`peeler render` encodes and writes 1920x1080 in every form, layout and compression.",
        (("file_sizes.py", "{build}/peeler", GLASSES, "--runs", "2"),)),
    "deep-error": Section(
        "Thin deep files",
        "`peeler convert --deep-error E`, of files with 4 samples a pixel, 1280x720, beside the plain file. Milliseconds are those of "
        "thinning, encoding and writing; the fastest run.",
        (("deep_thinning.py", "{build}/peeler", "spheres", "large-spheres", "forest", ENGINE, GLASSES),)),
    "shading-rates": Section(
        "Shading rates",
        "Four samples shaded once per sample and once per pixel (`--shade-per`), 1920x1080: PSNR of PNGs, in encoded values, "
        "against 64 samples, and processor time of the whole command, of medians.",
        (("shading_rates.py", "{build}/peeler", *(f"{MODELS}{path}" for path in RATED)),)),
    "splats": Section(
        "Gaussian splats",
        "`peeler render` of clouds of splats, 1920x1080, beside f3d 3 of Debian 13, which draws round splats only; medians, the "
        "fastest rates. The share of kept samples is that of `--deep-error 1/256`.",
        (("splat_clouds.py", "{build}/peeler"),)),
    "views": Section(
        "Views",
        "PSNR, in linear light, of `peeler view` (1280x720) against a render from a camera that angle beside the file's; inf: "
        "identical. Layers are captured 1.5 times as wide; times are of the last angle.",
        (("views_from_layers.py", "{build}/peeler", ENGINE, PLANT, JELLYFISH, GLASSES),)),
    "baking": Section(
        "Baking",
        "Ambient occlusion at vertices, in seconds with placing the scene or building Embree's hierarchy. RMSE is against Embree's "
        "rays in directions of each vertex's own.",
        (("{build}/tests/bake_ao", CYLINDERS, HELMET),)),
    "frames": Section(
        "Frames",
        "One process for all frames, beside a process for each; the files are the same.",
        (("frames_in_one_process.py", "{build}/peeler", JELLYFISH, ENGINE, "--", "--size", "640x360"),
         ("frames_in_one_process.py", "{build}/peeler", JELLYFISH, WALKER, "--frames", "10", "--runs", "2",
          "--", "--size", "1920x1080"))),
    "jobs": Section(
        "Jobs",
        "One `peeler worker`, beside a process for each job: 1,000 jobs, of 20 sample models in turn, 640x360; the files are the "
        "same.",
        (("jobs_in_one_worker.py", "{build}/peeler", *JOB_SCENES,
          "--", "--size", "640x360"),)),
    "python-calls": Section(
        "Calls from Python",
        "The same call from Python and of the C++ library: all layers of 64 x 64 pixels.",
        (("python_calls.py", "{build}", "examples/scenes/panes.glb", "examples/scenes/coincident.glb"),)),
    "budgets": Section(
        "Budgets",
        "Peak resident memory of `peeler render engine.glb` under `--memory`.",
        (("budgets.py", "{build}/peeler"),)),
    "meshes": Section(
        "Meshes",
        "Processor seconds of `peeler info` on one core, less those for two triangles.",
        (("mesh_reading.py", "{build}/peeler"),)),
    "gpu": Section(
        "On a GPU",
        "[A run](../README.md#on-a-gpu) of GL tests, methods, fragments beside Mesa's rasteriser by class, and times in ms.",
        ()),
}


class Number(NamedTuple):
    """A row of the README's table, and the origin of its numbers in the results."""

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
    Number("writing the layers of 30 spheres", "side-by-side",
           {"what": "writing the layered file", "scene": "spheres", "size": HD, "theirs": "same windows"}, ""),
    Number("flattening a deep file of 100 spheres", "side-by-side",
           {"what": "flatten of a deep file", "scene": "large-spheres", "size": HD}, ""),
    Number("GearboxAssy to a PNG, the whole command", "pictures",
           {"what": "whole command to PNG", "scene": "gearbox", "size": HD}, ""),
    Number("4.7 million sorted hits of parallel rays, on the CPU; processor time", "hits",
           {"what": "all hits of a bundle, sorted, processor time", "scene": "soup-192k"}, ""),
    Number("occlusion at the vertices of 2CylinderEngine, 1,024 directions; processor time", "hits",
           {"what": "ambient occlusion at vertices, processor time", "scene": "2CylinderEngine"}, ""),
)
BEGIN = "<!-- numbers: `sh tests/run.sh bench` writes them from tests/benchmarks/RESULTS.md -->"
END = "<!-- end of numbers -->"


def measured(section: Section, build: Path, more: List[str]) -> str:
    """Returns the output of all commands of a section, as one table if their tables have the same heading."""
    lines: List[str] = []
    for command in section.commands:
        words = [word.format(build=build, assets=ASSETS) for word in command]
        if words[0].endswith(".py"):
            words[:1] = [sys.executable, "-B", f"tests/benchmarks/{words[0]}"]
        say(" ".join([*words, *more]))
        done = subprocess.run([*words, *more], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
        shown = done.stdout.strip().splitlines()
        lines += shown[2:] if lines[:2] == shown[:2] else ["", *shown] if lines else shown
    return "\n".join(lines) + "\n"


def written(name: str, known: Dict[str, str], tables: str) -> str:
    """Returns the text of a section in the file."""
    section = SECTIONS[name]
    told = "".join(f"- {key}: {value}\n" for key, value in known.items())
    text = textwrap.fill(section.text, 120, break_long_words=False, break_on_hyphens=False)
    return f"## {section.title}\n\n{text}\n\n{told}\n{tables}"


def gpu_facts(page: str) -> Dict[str, str]:
    return {"commit": re.search(r"packed at commit (.+)", page)[1], "machine": re.search(r"devices, machine: (.+)", page)[1],
            "renderer": re.search(r"devices, device: (.+)", page)[1]}


def gpu_tables(page: str) -> str:
    """Returns the page of a GPU run without the date, the tests that passed, what failures print, lists of equal length
    in the sorting benchmark, and repetitions. The table of its parts becomes a list."""
    page = re.sub(r"\S*/(tests/\w+/\S+)", r"\1", page)  # drops the path of the build folder
    shown = [re.split(r";only |; tests/|: Failure;", line)[0].replace("## ", "**", 1) + ("**" if line.startswith("## ") else "")
             for line in page.splitlines()[4:]
             if not re.match(r"- (devices|tests, shard \d+: \d|methods, (?!bracket)|references, .* differ by|tests, .* not packed|"
                             r"benchmark, .*, alike)", line)]
    return condensed(parts(shown))


def parts(lines: List[str]) -> List[str]:
    """Returns the lines with the table of the parts, in which most numbers are 0, as a list."""
    listed = [f"- {row['part']}: " + ", ".join(f"{row[verdict]} {verdict}" for verdict in ("passed", "failed", "skipped")
                                                if row[verdict] != "0")
              for row in rows("\n".join(lines)) if "part" in row]
    return ["**parts**", "", *listed, *(line for line in lines if not line.startswith("|"))]


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


def shared(names: List[str]) -> Tuple[str, str]:
    """Returns the words at the start of all names, and the remarks at the end of all of them: ("to ", ", ms") for "to 2, ms"
    and "to 4, ms"."""
    start, end = commonprefix(names), commonprefix([name[::-1] for name in names])[::-1]
    start, end = start[:start.rfind(" ") + 1], end[end.find(", "):] if ", " in end else ""
    return (start, end) if all(len(name) > len(start + end) for name in names) else ("", "")


MANY = 8  # the fewest rows of a table in which similar rows become one


def ranges(rows: List[Tuple[str, List[str]]]) -> List[Tuple[str, List[str]]]:
    """Returns the rows of a table. In a table of MANY rows or more, all rows that are 0 wherever most rows are 0 become
    the last row, which has the least and the greatest value of each column."""
    columns = list(zip(*(cells for _, cells in rows)))
    rare = [k for k, cells in enumerate(columns) if 2 * cells.count("0") > len(rows)]
    common = [(name, cells) for name, cells in rows if all(cells[k] == "0" for k in rare)]
    if len(rows) < MANY or not rare or len(common) < 2:
        return rows
    ends = [(min(cells, key=float), max(cells, key=float)) for cells in zip(*(cells for _, cells in common))]
    return [*(row for row in rows if row not in common),
            (", ".join(name for name, _ in common), [low if low == high else f"{low} to {high}" for low, high in ends])]


def condensed(lines: List[str]) -> str:
    """Returns the page with runs of lines that have the same counts as a table, and runs of lines with the same text as
    one line."""
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
            start, end = shared(names)
            heading = f"{part}: {start}…{end}" if start or end else part
            shown += [*([""] if shown[-1] else []), f"| {heading} | {' | '.join(columns)} |", "| --- |" + " ---: |" * len(columns)]
            listed = [(name[len(start):len(name) - len(end)], list(counts(line.split(": ", 1)[1]).values())) for name, line in told]
            shown += [f"| {name} | {' | '.join(cells)} |" for name, cells in ranges(listed)]
            shown.append("")
        else:
            start = commonprefix(names)
            shown.append(f"- {part}, {start}{{{', '.join(name[len(start):] for name in names)}}}: {columns[1]}")
    return re.sub(r"\n{3,}", "\n\n", "\n".join(shown)).rstrip() + "\n"


AS_IN = "as in "  # precedes the title of an earlier section with the same fact
FACTS = re.compile(r"(?:^- (?:commit|machine|renderer|versions): .*\n)+", re.M)


def facts_of(text: str) -> Dict[str, str]:
    """Returns the facts of a section, or those of the page."""
    found = FACTS.search(text)
    return dict(line[2:].split(": ", 1) for line in found[0].splitlines()) if found else {}


def with_facts(text: str, known: Dict[str, str]) -> str:
    return FACTS.sub(lambda _: "".join(f"- {key}: {value}\n" for key, value in known.items()), text, count=1)


def split(text: str) -> Dict[str, str]:
    """Returns the file's sections by name, in the order of SECTIONS, each with all its facts."""
    names = {section.title: name for name, section in SECTIONS.items()}
    head, *parts = re.split(r"^## ", text, flags=re.M)
    found = {names.get(part.splitlines()[0]): f"## {part.strip()}\n" for part in parts}
    known = {part.splitlines()[0]: facts_of(part) for part in parts}
    common = facts_of(head)

    def meant(key: str, value: str) -> str:
        return known[value[len(AS_IN):]][key] if value.startswith(AS_IN) else value

    sections = {name: found[name] for name in SECTIONS if name in found}
    for name, text in sections.items():
        told = facts_of(text)
        told = {"commit": told["commit"], **common, **told} if SECTIONS[name].commands else told
        sections[name] = with_facts(text, {key: meant(key, value) for key, value in told.items()})
    return sections


def joined(sections: Dict[str, str]) -> str:
    """Returns the file. The facts of most sections are in its head; other facts are in the first section that has them."""
    told = [facts_of(text) for name, text in sections.items() if SECTIONS[name].commands]
    common = {}
    for key in ("machine", "renderer", "versions"):
        values = [known[key] for known in told if key in known]
        if values:
            common[key] = max(values, key=values.count)
    shown, first = HEAD + "".join(f"- {key}: {value}\n" for key, value in common.items()), {}
    for name in SECTIONS:
        if name not in sections:
            continue
        facts = {key: value for key, value in facts_of(sections[name]).items() if common.get(key) != value}
        shown += "\n" + with_facts(sections[name], {key: first.get((key, value), value) for key, value in facts.items()})
        for key, value in facts.items():
            if key != "commit":
                first.setdefault((key, value), AS_IN + SECTIONS[name].title)
    return shown


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
    """Yields the comparisons of table.py's tables as {"what", "scene", "size", "ours", "theirs"}."""
    for row in rows(text):
        columns = list(reversed(row))  # the columns in their original order
        ours = next((name for name in columns if name.startswith("ours, ")), None)
        if columns[0] != "what" and not ours:
            continue
        what, _, shared_size = columns[0].partition("; ")
        scene, _, own_size = row["scene" if columns[0] == "what" else columns[0]].partition(", ")
        place = {"scene": scene, "size": own_size or shared_size}
        if not ours:
            yield {"what": row["what"], **place, "ours": row["ours"], "theirs": row["theirs"]}
            continue
        unit = ours.rsplit(", ", 1)[1]
        for rival, ratio in zip(columns, columns[1:]):
            if ratio.startswith("ratio") and rival != ours and row[rival]:
                yield {"what": what, **place, "ours": f"{row[ours]} {unit}",
                       "theirs": f"{row[rival]} {unit} ({rival.rsplit(', ', 1)[0]})"}


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
    """Returns the machine, renderer and commit of the numbers. If they differ, returns a line for the rows of each
    section."""
    origins = {}
    for name, numbers in groupby(enumerate(NUMBERS, 1), lambda numbered: numbered[1].section):
        told = dict(re.findall(r"^- (commit|machine|renderer): (.*)$", sections[name], re.M))
        rows = [row for row, number in enumerate(NUMBERS, 1) if number.section == name]
        group = f"Row {rows[0]}" if len(rows) == 1 else f"Rows {rows[0]} {'and' if len(rows) == 2 else 'to'} {rows[-1]}"
        origins[group] = f"{told['machine']}; {told['renderer']}; commit {told['commit'][:10]}."
    if len(set(origins.values())) == 1:
        return next(iter(origins.values()))
    return "\n".join(f"{group}: {origin}" for group, origin in origins.items())


def with_numbers(readme: str, results: str) -> str:
    """Returns the README with an updated table."""
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
            # Write neither file, because a row of the README would be missing.
            print(text)
            say(f"{name} is not written: {missing}")
            return 1
        RESULTS.write_text(results, encoding="utf-8")
        README.write_text(readme, encoding="utf-8")
        say(f"{name} is in {RESULTS}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
