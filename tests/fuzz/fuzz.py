# SPDX-License-Identifier: Apache-2.0
"""Runs fuzz targets for a given time each, as many at once as there are processors, and prints the results.

    python3 tests/fuzz/fuzz.py BUILD_FOLDER [TARGET|all] [SECONDS]

A target starts with its seeds (write_seeds), with tests/fuzz/corpus/TARGET, and with the inputs that earlier runs
collected in BUILD_FOLDER/corpus/TARGET. Findings are written to BUILD_FOLDER/findings/TARGET, and the output to
BUILD_FOLDER/logs/TARGET.txt. Exits with 1 if there is a finding.
"""

import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parent
SECONDS = 60
# Limits per input, in seconds and megabytes. Exceeding a limit is a finding.
LIMITS = ["-timeout=10", "-rss_limit_mb=2048"]
MOST_BYTES = 16384  # the maximum size of an input
# Libraries allocate tens of megabytes for a small picture. For allocations below this threshold, the sanitizer clears
# its shadow memory by writing zeros; above it, by mapping new pages. With the default threshold, mapping took half of
# the running time of `image` and `round_trip`.
SHADOW = "clear_shadow_mmap_threshold=67108864"
# LeakSanitizer crashes after OpenImageIO's libraries have started threads.
NO_LEAKS = "detect_leaks=0"
LOADS_LIBRARIES = {"image"}
STATISTICS = re.compile(r"stat::(\w+): +(\d+)")
COVERAGE = re.compile(r"cov: (\d+) ft: (\d+)")


def run(build, target, seconds, scratch):
    """Returns (the line about the result, whether there is a finding)."""
    corpus, findings = build / "corpus" / target, build / "findings" / target
    output = build / "logs" / f"{target}.txt"
    for needed in (corpus, findings, output.parent):
        needed.mkdir(parents=True, exist_ok=True)
    begins = [corpus, build / "seeds" / target, SOURCE / "corpus" / target]
    dictionary = SOURCE / f"{target}.dict"
    command = [build / "tests" / f"{target}_fuzz", f"-max_total_time={seconds}", *LIMITS]
    # No value profiles (-use_value_profile): they make libFuzzer spend most of its time on its own statistics. After a
    # quarter of an hour, `grammar` then makes 62 executions per second instead of 1,000.
    command += [f"-max_len={MOST_BYTES}", "-print_final_stats=1"]
    command += [f"-artifact_prefix={findings}/"]
    command += [f"-dict={dictionary}"] if dictionary.exists() else []
    options = [SHADOW, NO_LEAKS] if target in LOADS_LIBRARIES else [SHADOW]
    environment = {**os.environ, "TMPDIR": scratch, "UBSAN_OPTIONS": "print_stacktrace=1",
                   "ASAN_OPTIONS": ":".join(options)}
    before = set(findings.iterdir())
    with open(output, "wb") as log:
        subprocess.run(
            command + [path for path in begins if path.exists()],
            stdout=log, stderr=subprocess.STDOUT, env=environment, check=False, cwd=scratch,
        )
    text = output.read_text(encoding="utf-8", errors="replace")
    told = dict(STATISTICS.findall(text))
    covered = (COVERAGE.findall(text) or [("?", "?")])[-1]
    found = sorted(set(findings.iterdir()) - before)
    ended = "number_of_executed_units" in told  # libFuzzer prints this when it ends, with or without a finding
    line = f"{target}: {int(told.get('number_of_executed_units', 0)):,} executions in {seconds} s, "
    line += f"coverage {covered[0]} edges, {covered[1]} features"
    for path in found:
        line += f"\n  found: {path}"
    if not ended and not found:
        line += f"\n  ended without saying why: {output}"
    return line, bool(found) or not ended


def main(build, wanted="all", seconds=SECONDS):
    build = pathlib.Path(build).resolve()
    known = sorted(path.name.removesuffix("_fuzz.cpp") for path in SOURCE.glob("*_fuzz.cpp"))
    if wanted != "all" and wanted not in known:
        sys.exit(f"there is no fuzz target {wanted}; there are {', '.join(known)}, and all")
    chosen = known if wanted == "all" else [wanted]
    subprocess.run(
        [build / "tests/write_seeds", build / "seeds"],
        check=True, env={**os.environ, "ASAN_OPTIONS": NO_LEAKS},
    )
    # In memory, because targets write files all the time. Removed even if a target fails.
    shared = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    found = False
    with tempfile.TemporaryDirectory(dir=shared) as scratch:
        processors = len(os.sched_getaffinity(0))
        with concurrent.futures.ThreadPoolExecutor(processors) as pool:
            runs = [pool.submit(run, build, target, int(seconds), scratch) for target in chosen]
            for done in concurrent.futures.as_completed(runs):
                line, finds = done.result()
                print(line, flush=True)
                found = found or finds
    return 1 if found else 0


if __name__ == "__main__":
    if not 2 <= len(sys.argv) <= 4:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
