#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures peeler side by side with Embree, VTK, f3d, OpenEXR and OpenImageIO; prints Markdown tables.

    python3 tests/benchmarks/table.py [--rows capture,writers] [--scenes spheres,lamp] [--sizes 1920x1080]
                                      [--runs 3] [--quick] [--shrink 1]

Our program and the others run in turn. Ratios are of medians over all runs; bold ratios miss their target. Missing
programs and scenes are skipped with a note. The numbers of every run are also written to a JSON file (--json), and the
rendered pictures to a folder next to it.
"""
from __future__ import annotations

import argparse
import json
import statistics
import sys
import tempfile
from pathlib import Path
from typing import Any, Dict, Iterable, List, Tuple

import scenes
import table_rows
from machine import ASSETS, ROOT, facts
from perf_profile import profile
from reasons import REASONS
from side_by_side import Bench, Display, Row, say

OWN_TABLE = 3  # the fewest lines that get a table of their own


def number(value: float, unit: str) -> str:
    return f"{value:.2f}" if unit == "" or value < 10 else f"{value:,.0f}" if value >= 100 else f"{value:.1f}"


def medians(row: Row) -> List[str]:
    return [number(statistics.median(values), row.unit) for values in (row.ours, row.theirs)]


def target(row: Row) -> str:
    return "" if row.target is None else f"≤ {row.target:g}"


def ratio(row: Row, shown: str = "") -> str:
    """Returns the ratio, in bold if it misses its target, which follows unless it is already shown."""
    text = f"**{row.ratio:.2f}**" if row.met is False else f"{row.ratio:.2f}"
    return text if target(row) == shown else f"{text} ({target(row) or 'no target'})"


def joined(*cells: str) -> str:
    return "| " + " | ".join(cells) + " |"


def line(row: Row, noted: bool = True) -> str:
    ours, theirs = (f"{median} {row.unit}".rstrip() for median in medians(row))
    notes = [row.note, *(f"{heading}: {cell}" for heading, cell in row.details.items())]
    return joined(row.what, f"{row.scene}, {row.size}", ours, f"{theirs} ({row.rival})", ratio(row),
                  *["; ".join(filter(None, notes))] * noted)


def most(values: Iterable[Any]) -> Any:
    """Returns the most frequent value; if several are, the first of them."""
    listed = list(values)
    return max(listed, key=listed.count)


def own_table(rows: List[Row]) -> List[str]:
    """Returns a table of rows with the same work and unit, with a line per scene and size. The heading gives the most
    frequent size and targets. Columns that several comparisons share appear once. Without targets, there are no ratios.
    Rows without a rival are exponents."""
    unit, size = f", {rows[0].unit}" if rows[0].unit else "", most(row.size for row in rows)
    places: Dict[Tuple[str, str], List[Row]] = {}
    headings: Dict[Any, str] = {}  # headings of the columns, by what the columns show
    targets: Dict[Tuple[str, str], str] = {}
    for row in rows:
        places.setdefault((row.scene, row.size), []).append(row)
        pair = (row.mine, row.rival)
        targets[pair] = most(target(other) for other in rows if (other.mine, other.rival) == pair)
        if row.rival:
            headings.update({name: f"{name}{unit}" for name in pair})
        if not row.rival or any(target(other) for other in rows):
            headings[pair] = f"{'ratio' if row.rival else row.mine} {targets[pair]}".rstrip()
    headings.update({("detail", name): name for row in rows for name in row.details})
    notes = any(row.note for row in rows)
    lines = [joined(f"{rows[0].what}; {size}", *headings.values(), *[""] * notes),
             joined("---", *["---:"] * len(headings), *["---"] * notes)]
    for (scene, own_size), place in places.items():
        cells: Dict[Any, str] = {}
        for row in place:
            pair = (row.mine, row.rival)
            cells.update({**dict(zip(pair, medians(row))), pair: ratio(row, targets[pair]),
                          **{("detail", name): cell for name, cell in row.details.items()}})
        lines.append(joined(scene if own_size == size else f"{scene}, {own_size}",
                            *(cells.get(column, "") for column in headings),
                            *["; ".join(row.note for row in place if row.note)] * notes))
    return lines


def tables(rows: List[Row]) -> str:
    """Returns a table for each kind of work that has at least OWN_TABLE lines, and one table for all other rows."""
    groups: Dict[Tuple[str, str], List[Row]] = {}
    for row in rows:
        groups.setdefault((row.what, row.unit), []).append(row)
    large = [len({(row.scene, row.size) for row in group}) >= OWN_TABLE for group in groups.values()]
    found = [own_table(group) for group, own in zip(groups.values(), large) if own]
    rest = [row for group, own in zip(groups.values(), large) if not own for row in group]
    if rest:
        noted = any(row.note or row.details for row in rest)
        found.append([joined("what", "scene", "ours", "theirs", "ratio", *[""] * noted),
                      joined("---", "---", "---:", "---:", "---:", *["---"] * noted), *(line(row, noted) for row in rest)])
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
    """Returns the text below the tables: why rows miss their targets, as far as that is known."""
    missed = dict.fromkeys(row.what for row in rows if row.met is False)
    lines = [f"- {what}: {REASONS[what]}" for what in missed if what in REASONS]
    return "\n".join(["", "Missed targets:", "", *lines]) if lines else ""


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
    print("\n".join(filter(None, [tables(rows), reasons(rows)])), flush=True)
    print("".join(f"\nSkipped: {why}." for why in bench.skipped), end="\n" if bench.skipped else "")
    target.write_text(json.dumps({**known, "rows": [row.record() for row in rows], "skipped": bench.skipped},
                                 indent=1) + "\n")
    say(f"{target}; pictures in {pictures}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
