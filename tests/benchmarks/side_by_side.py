# SPDX-License-Identifier: Apache-2.0
"""Shared parts of the benchmark table's rows: alternating runs, whole processes, a display."""
from __future__ import annotations

import json
import math
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

HERE = Path(__file__).resolve().parent


@dataclass
class Row:
    """One comparison: the numbers of all runs. The table compares their medians."""

    what: str
    scene: str
    size: str
    rival: str
    ours: List[float]
    theirs: List[float]
    target: Optional[float]  # largest ratio of ours to theirs; None: there is no target
    unit: str = "ms"
    note: str = ""
    mine: str = "ours"  # the heading of our numbers
    details: Dict[str, str] = field(default_factory=dict)  # further cells by their headings
    ours_alone: Sequence[Any] = ()  # the command for our part alone, to be profiled if the target is missed
    profile: str = ""
    fails: str = ""  # another failed condition, because of which the row misses its target

    @property
    def ratio(self) -> float:
        return statistics.median(self.ours) / statistics.median(self.theirs)

    @property
    def met(self) -> Optional[bool]:
        return None if self.target is None else self.ratio <= self.target and not self.fails

    def record(self) -> Dict[str, Any]:
        told = {key: value for key, value in self.__dict__.items() if key != "ours_alone"}
        return {**told, "ratio": self.ratio, "met": self.met}


@dataclass
class Process:
    """The outcome of a process that has ended."""

    milliseconds: float
    cpu_seconds: float
    peak_bytes: int
    code: int
    out: str
    err: str


def say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def run(command: Sequence[Any], display: Optional[str] = None, check: bool = True) -> Process:
    """Runs a command to its end, without a display unless one is given."""
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    if display:
        environment["DISPLAY"] = display
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        start = time.perf_counter()
        child = subprocess.Popen([str(word) for word in command], stdin=subprocess.DEVNULL, stdout=out,
                                 stderr=err, env=environment)
        _, status, usage = os.wait4(child.pid, 0)
        taken = 1000 * (time.perf_counter() - start)
        child.returncode = os.waitstatus_to_exitcode(status)
        texts = []
        for stream in (out, err):
            stream.seek(0)
            texts.append(stream.read().decode(errors="replace"))
    if check and child.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))}: exit code {child.returncode}\n{texts[1]}")
    return Process(taken, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024, child.returncode, *texts)


class Served:
    """A program that does its work once per line of input, and answers with the milliseconds."""

    def __init__(self, command: Sequence[Any], display: str):
        self.child = subprocess.Popen([str(word) for word in command], stdin=subprocess.PIPE,
                                      stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
                                      env={**os.environ, "DISPLAY": display})
        self.greeting = json.loads(self._line())

    def _line(self) -> str:
        line = self.child.stdout.readline()
        if not line:
            raise RuntimeError(f"{self.child.args[1]} ended early")
        return line

    def __call__(self) -> float:
        self.child.stdin.write("\n")
        self.child.stdin.flush()
        return float(self._line())

    def close(self) -> None:
        self.child.stdin.close()
        self.child.wait()


class Display:
    """An X server without a screen, for programs that need one."""

    def __init__(self) -> None:
        reading, writing = os.pipe()
        self.server = subprocess.Popen(["Xvfb", "-displayfd", str(writing), "-nolisten", "tcp", "-screen", "0",
                                        "1920x1080x24"], pass_fds=[writing], stderr=subprocess.DEVNULL)
        os.close(writing)
        with os.fdopen(reading) as number:
            self.name = ":" + number.readline().strip()

    def close(self) -> None:
        self.server.terminate()
        self.server.wait()


def exponent(points: List[Tuple[float, float]]) -> float:
    """Returns the slope of the least-squares line through log(y) as a function of log(x)."""
    logs = [(math.log(x), math.log(y)) for x, y in points]
    mean_x, mean_y = (statistics.fmean(column) for column in zip(*logs))
    return sum((x - mean_x) * (y - mean_y) for x, y in logs) / sum((x - mean_x) ** 2 for x, _ in logs)


def in_turn(contenders: Sequence[Callable[[], float]], runs: int) -> List[List[float]]:
    """Returns the numbers of each contender. The contenders take turns in `runs` rounds."""
    numbers: List[List[float]] = [[] for _ in contenders]
    for _ in range(runs):
        for list_, contender in zip(numbers, contenders):
            list_.append(contender())
    return numbers


@dataclass
class Bench:
    """Where the benchmark finds its programs and scenes, and how large it is."""

    build: Path
    scratch: Path
    pictures: Path
    scenes: Dict[str, Path]
    sizes: List[str]
    runs: int
    shrink: int = 1  # divides the sides of some rows' pictures
    display: str = ""
    skipped: List[str] = field(default_factory=list)

    @property
    def peeler(self) -> Path:
        return self.build / "peeler"

    def program(self, name: str, *arguments: Any) -> Dict[str, Any]:
        """Returns the JSON printed by a program of tests/benchmarks."""
        return json.loads(run([self.build / "tests" / name, *arguments]).out)

    def those(self, *names: str) -> List[Tuple[str, Path]]:
        """Returns the named scenes that exist and were requested."""
        return [(name, self.scenes[name]) for name in names if name in self.scenes]

    def at(self, *sizes: str) -> List[str]:
        return [size for size in sizes if size in self.sizes]

    def shrunk(self, *lengths: int, least: int = 4) -> List[int]:
        return [max(least, length // self.shrink) for length in lengths]

    def has(self, program: str) -> bool:
        found = shutil.which(program) is not None
        if not found:
            self.skip(f"{program} is not installed")
        return found

    def skip(self, why: str) -> None:
        say(f"skipped: {why}")
        self.skipped.append(why)
