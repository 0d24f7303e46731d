# SPDX-License-Identifier: Apache-2.0
"""Prints a summary of a test run: skipped tests and parts with reasons, the time of each stage, the slowest tests, and
the number of passed tests.

    python3 tests/summary.py RESULTS_FOLDER [STAGE=SECONDS ...]

The folder holds the XML files of GoogleTest, one per process (shard), and ctest.xml from ctest itself. Exits with 1 if
a test failed, or a process ended without writing its results.
"""

import collections
import pathlib
import sys
import xml.etree.ElementTree

SLOWEST = 10


def read(folder):
    """Returns [(name, seconds, state, why)]. The state is passed, failed or skipped. For a passed test, `why` lists the
    parts that it skipped."""
    tests = []
    for case in xml.etree.ElementTree.parse(folder / "ctest.xml").getroot().iter("testcase"):
        name, seconds = case.get("name"), float(case.get("time") or 0)
        state = {"run": "passed", "notrun": "skipped", "disabled": "skipped"}.get(
            case.get("status"), "failed"
        )
        results = folder / f"{name}.xml"
        if not results.exists():
            output = (case.findtext("system-out") or "").strip().splitlines()
            word = "left out: " if state == "passed" else "skipped: "
            why = [line.removeprefix(word) for line in output if line.startswith(word)]
            if state != "passed":
                why = why or reason(output)
            tests.append((name, seconds, state, "; ".join(why)))
            continue
        # A crashed process has written none of its results, or only some.
        found = list(shard(results, name.rpartition(".")[0]))
        if state == "failed" and not any(test[2] == "failed" for test in found):
            found.append((name, seconds, "failed", "ended badly"))
        tests += found
    return tests


def reason(output):
    """Returns the assertion message in a failed script's output or, if there is none, the last line."""
    asserted = [i for i, line in enumerate(output) if line.startswith("AssertionError")]
    return output[asserted[0] : asserted[0] + 4] if asserted else output[-1:]


def shard(results, program):
    for case in xml.etree.ElementTree.parse(results).getroot().iter("testcase"):
        if case.get("status") == "notrun":
            continue
        skipped, failure = case.find("skipped"), case.find("failure")
        state = "failed" if failure is not None else "skipped" if skipped is not None else "passed"
        why = (skipped.get("message") or "").splitlines()[-1:] if skipped is not None else []
        yield (
            f"{program}: {case.get('classname')}.{case.get('name')}",
            float(case.get("time")),
            state,
            " ".join(why),
        )


def main():
    folder = pathlib.Path(sys.argv[1])
    tests = read(folder)
    count = collections.Counter(state for _, _, state, _ in tests)

    for name, _, state, why in tests:
        if state != "passed" or why:
            print(f"{'left out' if state == 'passed' else state}: {name}{': ' if why else ''}{why}")
    print("\n  minutes  stage")
    stages = [argument.partition("=") for argument in sys.argv[2:]]
    for name, _, seconds in [*stages, ("in all", "=", sum(int(s[2]) for s in stages))]:
        print(f"{int(seconds) // 60:6d}:{int(seconds) % 60:02d}  {name}")
    print("\n  seconds  slowest tests")
    for name, seconds, _, _ in sorted(tests, key=lambda test: -test[1])[:SLOWEST]:
        print(f"{seconds:9.1f}  {name}")
    print(f"\n{count['passed']} passed, {count['failed']} failed, {count['skipped']} skipped")
    return 1 if count["failed"] else 0


if __name__ == "__main__":
    sys.exit(main())
