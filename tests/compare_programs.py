# SPDX-License-Identifier: Apache-2.0
"""Runs the same command lines with two versions of the program and prints every difference.

    python3 -B tests/compare_programs.py BEFORE AFTER [FILTER]
    python3 -B tests/compare_programs.py --list [FILTER]

BEFORE and AFTER are peeler programs, each with its lib/ next to it. compare_programs/command_lines.txt has the command
lines in paragraphs. A paragraph starts in a new folder that contains only links to the scenes; later lines may read the
output of earlier lines. FILTER is a regular expression that selects the paragraphs with a matching line. Paragraphs
that need the asset folder ($PEELER_ASSETS, or ../shared/assets next to the repository) are skipped with a note if it
does not exist.

For each line, the exit code, stdout, stderr and all files that the line wrote, changed or removed must be the same,
byte for byte. Only unrepeatable values are ignored: times, peak resident memory, progress by elapsed time, and the
paths of program and folder. JSON is compared by keys, in any order. UNIFIED lists keys renamed on purpose, ADDED new
keys. Exits with 1 if there is a difference.
"""

import argparse
import collections
import concurrent.futures
import contextlib
import decimal
import functools
import itertools
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

SOURCE = pathlib.Path(__file__).resolve().parents[1]
INPUTS = SOURCE / "tests" / "compare_programs"
ASSETS = pathlib.Path(os.environ.get("PEELER_ASSETS") or SOURCE.parent / "shared" / "assets").resolve()
LINKS = {"scenes": SOURCE / "examples" / "scenes", "inputs": INPUTS, "assets": ASSETS}
LIMIT = 300  # in seconds, enough for a busy machine; a slower command line is stopped

VERB = re.compile(r"\bpeeler ?([a-z]*)")

# JSON keys renamed on purpose: (verb, key before, key after). A key is a path to a value, such as "cells.label", and
# includes everything below it. None means that only one of the programs has the key.
UNIFIED = ()

# JSON keys that are new on purpose: (verb, keys), with keys as in UNIFIED. If BEFORE has a value other than "", AFTER
# must have the same value; otherwise any value is fine.
BEGINNING_AND_END = ("input", "output", "bytes", "outputs", "settingsHash", "renderer", "backend", "peakMemory",
                     "milliseconds")
ADDED = (
    (
        "render",
        ("input", "forecastMemory", "settingsHash", "frames.input", "frames.forecastMemory", "frames.settingsHash"),
    ),
    ("flatten", ("input", "settingsHash")),
    ("merge", ("inputs", "settingsHash")),
    ("convert", ("input", "settingsHash")),
    ("view", ("input", "settingsHash")),
    ("rays", (*BEGINNING_AND_END, "engine", "forecastMemory")),
    ("bake", (*BEGINNING_AND_END, "engine", "forecastMemory")),
    ("extract", (*BEGINNING_AND_END, "forecastMemory")),
    ("sheet", ("input", "settingsHash")),
    ("batch", tuple(f"result.{key}" for key in (*BEGINNING_AND_END, "engine", "forecastMemory"))),
)

# JSON keys whose values differ from run to run, including everything below them.
VOLATILE = {"milliseconds", "forecastMemory", "peakMemory", "seconds"}

# Texts with times or resident memory, which differ from run to run, each with its replacement.
MEASURED = (
    (re.compile(r"\b[\d,]+ ms\b"), "# ms"),
    (re.compile(r'"seconds":[\d.]+'), '"seconds":#'),
    (re.compile(r"\d+M (are needed for the smallest bands.*\n.*give at least) \d+M"), r"#M \1 #M"),
)

# Progress lines that depend on elapsed time: all percentages except the first and the last.
NOW_AND_THEN = re.compile(
    r"^(peeler: [a-z ]+ \d+ %"
    r"|openjd_progress: (?!0\.0$|100\.0$).*"
    r'|\{"stage":.*"progress":(?!0\.0,|1\.0,).*)\n',
    re.MULTILINE,
)


def paragraphs(pattern):
    """Returns [(title, lines)] for the paragraphs with a line that matches the pattern."""
    found = []
    for text in (INPUTS / "command_lines.txt").read_text(encoding="utf-8").split("\n\n")[1:]:
        title, *lines = text.strip().splitlines()
        if any(re.search(pattern, line) for line in lines):
            found.append((title.removeprefix("# "), lines))
    return found


class Program:
    """One of the two programs, with its working folders."""

    def __init__(self, path, root):
        self.path = pathlib.Path(path).resolve(strict=True)
        self.root = root
        self.folder = root
        self.seen = {}
        (root / "bin").mkdir(parents=True)
        (root / "bin" / "peeler").symlink_to(self.path)

    def begin(self, number):
        """Changes to a new folder."""
        self.folder = self.root / f"{number:02d}"
        self.folder.mkdir()
        self.seen = {}
        for name, target in LINKS.items():
            if target.is_dir():
                (self.folder / name).symlink_to(target)

    def run(self, line):
        """Runs a command line. Returns {name: value} with the exit code (None after LIMIT), the output streams, and
        every file that changed."""
        environment = {
            "PATH": f"{self.root}/bin:{os.environ['PATH']}",
            "HOME": os.environ.get("HOME", "/"),
            "LC_ALL": "C.UTF-8",
            "LP_NUM_THREADS": "0",  # without Mesa's own threads, because the other program needs the other processors
        }
        with subprocess.Popen(
            ["sh", "-c", line], cwd=self.folder, env=environment, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
        ) as process:
            try:
                out, err = process.communicate(timeout=LIMIT)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)  # also kills the children of sh
                return {"exit code": None}
        outcome = {"stdout": out, "stderr": err, **self.changed()}
        outcome = {what: self.comparable(content) for what, content in outcome.items()}
        return {"exit code": process.returncode, **outcome}

    def changed(self):
        """Returns {name: content} of new and changed files; the content of removed files is None."""
        now = {}
        for folder, _, names in os.walk(self.folder):
            for path in (pathlib.Path(folder, name) for name in names):
                status = path.lstat()
                now[path.relative_to(self.folder)] = (status.st_ino, status.st_mtime_ns, status.st_size)
        names = sorted(name for name in self.seen | now if self.seen.get(name) != now.get(name))
        self.seen = now
        return {str(name): (self.folder / name).read_bytes() if name in now else None for name in names}

    def comparable(self, content):
        """Returns JSON as values by key, other text without its volatile parts, and anything else unchanged."""
        try:
            text = content.decode()
        except (AttributeError, UnicodeDecodeError):
            return content
        for path, name in ((self.folder, "FOLDER"), (self.root / "bin", "BIN"), (self.path, "BIN/peeler")):
            text = text.replace(str(path), name)
        text = NOW_AND_THEN.sub("", text)
        values = json_values(text)
        if values is not None:
            return values
        for pattern, instead in MEASURED:
            text = pattern.sub(instead, text)
        return text


def json_values(text):
    """Returns {key: [(indices in the lists on the path, value), ...]} for JSON or JSON lines; None for other text."""
    # Decimal keeps the digits as written.
    parse = functools.partial(json.loads, parse_float=decimal.Decimal, parse_int=decimal.Decimal)
    if not text.startswith(("{", "[")):
        return None
    try:
        found = parse(text)
    except ValueError:
        try:
            found = [parse(line) for line in text.splitlines()]
        except ValueError:
            return None
    values = collections.defaultdict(list)

    def take(value, key, place):
        if isinstance(value, dict) and value:
            for name, below in value.items():
                take(below, f"{key}.{name}" if key else name, place)
        elif isinstance(value, list) and value:
            for index, below in enumerate(value):
                take(below, key, (*place, index))
        else:
            values[key].append((place, "#" if VOLATILE & set(key.split(".")) else value))

    take(found, "", ())
    return dict(values)


def unify(verb, before, after):
    """Returns both values, with keys renamed as in AFTER, and without the keys that UNIFIED allows in only one of
    them."""
    for of, old, new in UNIFIED:
        if of != verb:
            continue
        for key in [key for key in before if old and f"{key}.".startswith(f"{old}.")]:
            values = before.pop(key)
            if new:
                before[new + key.removeprefix(old)] = values
        if not old:
            after = {key: values for key, values in after.items() if not f"{key}.".startswith(f"{new}.")}
    return before, after


def without_added(verb, before, after):
    """Returns both values, without the new values that ADDED allows."""
    added = tuple(f"{key}." for of, keys in ADDED if of == verb for key in keys)
    before, after = dict(before), dict(after)
    for key in [key for key in after if f"{key}.".startswith(added)]:
        places = {place for place, value in before.get(key, ()) if value != ""}
        for values in (before, after):
            kept = [(place, value) for place, value in values.pop(key, ()) if place in places]
            if kept:
                values[key] = kept
    return before, after


def difference(verb, before, after):
    """Returns a short description of the difference between two values; nothing if they are equal."""
    if isinstance(before, dict) and isinstance(after, dict):
        before, after = without_added(verb, *unify(verb, before, after))
        keys = [key for key in before | after if before.get(key) != after.get(key)]
        if not keys:
            return ""
        more = f" (and {', '.join(keys[1:])})" if len(keys) > 1 else ""
        return f"{keys[0]}: {words(before.get(keys[0]))}, now {words(after.get(keys[0]))}{more}"
    if before == after:
        return ""
    if isinstance(before, str) and isinstance(after, str):
        lines = itertools.zip_longest(before.splitlines(True), after.splitlines(True))
        number, (old, new) = next(item for item in enumerate(lines, 1) if item[1][0] != item[1][1])
        return f"line {number}: {words(old)}, now {words(new)}"
    if isinstance(before, bytes) and isinstance(after, bytes):
        pairs = enumerate(itertools.zip_longest(before, after))
        place = next(place for place, (old, new) in pairs if old != new)
        return f"differs from byte {place:,} on, {len(before):,} bytes, now {len(after):,}"
    return f"{words(before)}, now {words(after)}"


def words(value):
    """Returns a value as a text that fits on a line."""
    if value is None or isinstance(value, dict):
        return "nothing" if value is None else "JSON"
    text = ", ".join(str(one) for _, one in value) if isinstance(value, list) else repr(value)
    return text if len(text) <= 120 else f"{text[:117]}..."


def differences(line, programs, pool):
    """Returns the differences for a command line, and the exit code of the first program."""
    before, after = pool.map(lambda program: program.run(line), programs)
    verb = VERB.search(line)
    found = []
    for what in before | after:
        if what not in before or what not in after:
            found.append(f"{what}: only {'before' if what in before else 'now'}")
        elif text := difference(verb and verb[1], before[what], after[what]):
            found.append(f"{what}: {text}")
    return found, before["exit code"]


def compare(chosen, programs):
    """Prints the progress and the differences. Returns whether there are any."""
    ends, different, skipped = collections.Counter(), 0, 0
    with concurrent.futures.ThreadPoolExecutor(len(programs)) as pool:
        for number, (title, lines) in enumerate(chosen):
            if any(" assets/" in line for line in lines) and not ASSETS.is_dir():
                print(f"skipped: {title}, {len(lines)} command lines: there is no folder {ASSETS}")
                skipped += len(lines)
                continue
            start = time.monotonic()
            for program in programs:
                program.begin(number)
            for line in lines:
                found, end = differences(line, programs, pool)
                if end is None:
                    found.append(f"it has not ended within {LIMIT} s")
                elif end != 0 and not VERB.search(line):
                    found.append(f"what others need has failed with {end}")
                for text in found:
                    print(f"DIFFERS: {line}: {text}", flush=True)
                different += bool(found)
                if VERB.search(line):
                    ends[end] += 1
            print(f"{title}: {len(lines)} lines, {time.monotonic() - start:.0f} s", flush=True)

    print("exit codes:", ", ".join(f"{end}: {ends[end]} times" for end in sorted(ends, key=str)))
    for verb, old, new in UNIFIED:
        print(f"unified: peeler {verb}: {old or 'nothing'} is now {new or 'left out'}")
    for verb, keys in ADDED:
        print(f"added: peeler {verb}: {', '.join(keys)}")
    told = f", {skipped} skipped" if skipped else ""
    print(f"{ends.total()} command lines{told}, {different} differ")
    return different > 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", nargs="*", metavar="BEFORE AFTER [FILTER]")
    parser.add_argument("--list", action="store_true", help="print the command lines")
    parser.add_argument("--keep", metavar="FOLDER", type=pathlib.Path, help="where the files go, and stay")
    options = parser.parse_args()
    positional = 0 if options.list else 2
    if not positional <= len(options.programs) <= positional + 1:
        parser.error("two programs are needed, and no more than a filter beside them")
    chosen = paragraphs(options.programs[positional] if len(options.programs) > positional else "")
    if options.list:
        for title, lines in chosen:
            print(f"# {title}", *lines, "", sep="\n")
        return 0

    scratch = contextlib.nullcontext(options.keep) if options.keep else tempfile.TemporaryDirectory()
    with scratch as folder:
        root = pathlib.Path(folder).resolve()
        names = zip(("before", "after"), options.programs)
        return compare(chosen, [Program(path, root / name) for name, path in names])


if __name__ == "__main__":
    sys.exit(main())
