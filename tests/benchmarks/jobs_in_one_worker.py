#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Compares the jobs per minute of one `peeler worker` with those of one process per job.

    python3 tests/benchmarks/jobs_in_one_worker.py build/release/peeler SCENE... \
        [--jobs 1000] [-- options of peeler render]

The jobs cycle through the scenes; they run one at a time, and two at a time. Compares the files. Prints a row of
Markdown for each way.
"""
import argparse
import hashlib
import pathlib
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "examples" / "worker"))
from worker_client import Worker  # noqa: E402


def main():
    own, more = sys.argv[1:], []
    if "--" in own:
        at = own.index("--")
        own, more = own[:at], own[at + 1:]
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("peeler")
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--jobs", type=int, default=1000)
    options = parser.parse_args(own)
    scenes = [options.scenes[i % len(options.scenes)] for i in range(options.jobs)]
    scratch = tempfile.TemporaryDirectory()
    folder = pathlib.Path(scratch.name)
    digests = {}

    def check(output):
        digest = hashlib.sha256(output.read_bytes()).hexdigest()
        if digests.setdefault(output.stem.rpartition("-")[2], digest) != digest:
            sys.exit(f"{output.name}: the files differ")

    def seconds(job, at_a_time):
        start = time.monotonic()
        with ThreadPoolExecutor(at_a_time) as pool:
            for output in pool.map(job, range(options.jobs)):
                check(output)
        return time.monotonic() - start

    def name(way, i):
        return folder / f"{way}-{i % len(options.scenes)}.exr"

    def run(i):
        output = name(f"process{i % 2}", i)
        subprocess.run([options.peeler, "render", scenes[i], "-o", output, "-q", *more], check=True)
        return output

    words = [word.lstrip("-") for word in more]
    settings = dict(zip(words[::2], words[1::2]))
    print("| jobs at a time | one worker, jobs a minute | a process each, jobs a minute | ratio |")
    print("| ---: | ---: | ---: | ---: |")
    for at_a_time in (1, 2):
        with Worker("--jobs", str(at_a_time), program=options.peeler) as worker:

            def send(i):
                output = name(f"worker{i % 2}", i)
                worker.run("render", scenes[i], "-o", output, **settings)
                return output

            one = seconds(send, at_a_time)
        each = seconds(run, at_a_time)
        rates = [60 * options.jobs / passed for passed in (one, each)]
        print(f"| {at_a_time} | {rates[0]:.0f} | {rates[1]:.0f} | {rates[0] / rates[1]:.1f} |")


if __name__ == "__main__":
    main()
