#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures peeler side by side with Embree, VTK, f3d, OpenEXR and OpenImageIO; prints Markdown tables.

    python3 tests/benchmarks/table.py [--rows capture,writers] [--scenes spheres,lamp] [--sizes 1920x1080]
                                      [--runs 3] [--quick] [--shrink 1]

Ours and theirs run in turn; ratios are of the medians, no run is left out, and bold ones miss their target.
What is missing is skipped with a note. The rows stand in a JSON file, too, every run's number
with them (--json), and the pictures that were made in a folder beside it.
"""
from __future__ import annotations

import argparse
import json
import statistics
import sys
import tempfile
from pathlib import Path
from typing import Dict, List, Tuple

import scenes
import table_rows
from machine import ASSETS, ROOT, facts
from perf_profile import profile
from reasons import REASONS
from side_by_side import Bench, Display, Row, say

OWN_TABLE = 3  # the fewest rows of one comparison that get a table of their own


def number(value: float, unit: str) -> str:
    return f"{value:.2f}" if unit == "" or value < 10 else f"{value:,.0f}" if value >= 100 else f"{value:.1f}"


def medians(row: Row) -> List[str]:
    return [number(statistics.median(values), row.unit) for values in (row.ours, row.theirs)]


def target(row: Row) -> str:
    return "" if row.target is None else f"≤ {row.target:g}"


def ratio(row: Row) -> str:
    return f"**{row.ratio:.2f}**" if row.met is False else f"{row.ratio:.2f}"


def joined(*cells: str) -> str:
    return "| " + " | ".join(cells) + " |"


def line(row: Row) -> str:
    ours, theirs = (f"{median} {row.unit}".rstrip() for median in medians(row))
    return joined(row.what, row.scene, row.size, ours, f"{theirs} ({row.rival})", ratio(row), target(row), row.note)


def own_table(rows: List[Row]) -> List[str]:
    """Returns a table of rows with the same work, rival and unit. Its heading gives the target, and the size if all
    rows share it."""
    first = rows[0]
    unit = f", {first.unit}" if first.unit else ""
    same_size, notes = all(row.size == first.size for row in rows), any(row.note for row in rows)
    lines = [joined(*([f"{first.what}; {first.size}"] if same_size else [first.what, "size"]), f"ours{unit}",
                    f"{first.rival}{unit}", f"ratio {target(first)}".rstrip(), *([""] if notes else [])),
             joined(*(["---"] if same_size else ["---", "---"]), "---:", "---:", "---:", *(["---"] if notes else []))]
    for row in rows:
        other = f" ({target(row)})" if target(row) != target(first) else ""
        lines.append(joined(row.scene, *([] if same_size else [row.size]), *medians(row), ratio(row) + other,
                            *([row.note] if notes else [])))
    return lines


def tables(rows: List[Row]) -> str:
    """Returns one table for each comparison of at least OWN_TABLE rows, and one for all other rows."""
    groups: Dict[Tuple[str, str, str], List[Row]] = {}
    for row in rows:
        groups.setdefault((row.what, row.rival, row.unit), []).append(row)
    large = [group for group in groups.values() if len(group) >= OWN_TABLE]
    found = [own_table(group) for group in large]
    rest = [row for group in groups.values() if len(group) < OWN_TABLE for row in group]
    if rest:
        found.append([joined("what", "scene", "size", "ours", "theirs", "ratio", "target", ""),
                      "| --- | --- | --- | ---: | ---: | ---: | ---: | --- |", *map(line, rest)])
    return "\n\n".join("\n".join(lines) for lines in found)


def models(bench: Bench, wanted: List[str]) -> None:
    for name in table_rows.MODELS:
        path = ASSETS / table_rows.MODELS[name]
        if name in wanted and path.is_file():
            bench.scenes[name] = path
        elif name in wanted:
            bench.skip(f"{name}: no {path} (set PEELER_ASSETS)")


def parsed() -> argparse.Namespace:
    names = [*table_rows.GENERATED, *table_rows.MODELS]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])

    def listed(allowed: List[str]):
        def parse(text: str) -> List[str]:
            unknown = sorted(set(text.split(",")) - set(allowed))
            if unknown:
                raise argparse.ArgumentTypeError(f"{', '.join(unknown)}; there are {', '.join(allowed)}")
            return text.split(",")
        return parse

    parser.add_argument("--build", type=Path, default=ROOT / "build" / "ci", help="the build folder (default: build/ci)")
    parser.add_argument("--rows", type=listed(list(table_rows.KINDS)), default=list(table_rows.KINDS),
                        help=f"kinds of rows: {', '.join(table_rows.KINDS)}")
    parser.add_argument("--scenes", type=listed(names), default=names, help=f"which: {', '.join(names)}")
    parser.add_argument("--sizes", type=listed([table_rows.HD, table_rows.UHD]),
                        default=[table_rows.HD, table_rows.UHD], help="1920x1080, 3840x2160 or both")
    parser.add_argument("--runs", type=int, default=3, help="of each, in turn (default: 3)")
    parser.add_argument("--quick", action="store_true", help="one run, 1920x1080 alone: a look, no measurement")
    parser.add_argument("--shrink", type=int, default=1, help="divides the sides of the pictures, and the directions, of "
                        f"{', '.join(table_rows.hit_rows.KINDS)}: to see that they run (default: 1)")
    parser.add_argument("--json", type=Path, help="the file of rows (default: benchmarks.json in the build folder)")
    options = parser.parse_args()
    if options.quick:
        options.runs, options.sizes = 1, [table_rows.HD]
    return options


def measured(bench: Bench, kinds: List[str]) -> List[Row]:
    rows: List[Row] = []
    perf = bench.has("perf")
    for kind in kinds:
        try:
            for row in table_rows.KINDS[kind](bench):
                if row.met is False and row.ours_alone and perf:
                    row.profile = profile(row.ours_alone)
                rows.append(row)
                say(line(row))
        except (RuntimeError, OSError) as error:
            bench.skip(f"the rest of {kind}: {error}")
    return rows


def reasons(rows: List[Row]) -> str:
    """Returns the text below the table about rows that miss their targets."""
    whats: Dict[str, List[str]] = {}
    for what in dict.fromkeys(row.what for row in rows if row.met is False):
        whats.setdefault(REASONS.get(what, "not examined"), []).append(what)
    lines = [f"- {'; '.join(missed)}: {reason}" for reason, missed in whats.items()]
    return "\n".join(["", "Why rows miss their targets:", "", *lines]) if lines else ""


def main() -> int:
    options = parsed()
    target = options.json or options.build / "benchmarks.json"
    pictures = target.with_suffix("")
    pictures.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=options.build) as folder:
        bench = Bench(options.build, Path(folder), pictures, {}, options.sizes, options.runs,
                      options.shrink)
        models(bench, options.scenes)
        for name in table_rows.GENERATED:
            if name in options.scenes:
                bench.scenes[name] = scenes.write(bench.scratch, name)
        known = {**facts(bench.peeler), "runs": str(bench.runs)}
        needs_display = bench.has("Xvfb") and {"composite", "command"} & set(options.rows)
        display = Display() if needs_display else None
        bench.display = display.name if display else ""
        try:
            rows = measured(bench, options.rows)
        finally:
            if display:
                display.close()
    print(tables(rows), reasons(rows), sep="\n", flush=True)
    print("".join(f"\nSkipped: {why}." for why in bench.skipped), end="\n" if bench.skipped else "")
    target.write_text(json.dumps({**known, "rows": [row.record() for row in rows], "skipped": bench.skipped},
                                 indent=1) + "\n")
    say(f"{target}; pictures in {pictures}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
