#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Fault injection: support/failing_calls makes the n-th call of a kind fail, in the named command of COMMANDS. After
any failure the command must end by itself, with the right exit code, a message with the reason, no partial file under a
final name, and no hidden file. Prints a table: the kind of call, the number of such calls, the number tried, and the
command's outcomes.

With PEELER_TEST_ALL it tries every call, except allocations: there are tens of thousands, so it tries one per call
path, at most MOST. Otherwise it tries one or two calls in a third of the rows, a different third for each command.
"""

import collections
import errno
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tarfile
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[3]
SCENE = SOURCE / "examples" / "scenes" / "coincident.glb"
PEELER = os.environ["PEELER"]
SHIM = os.environ["PEELER_FAILING_CALLS"]
ALL = bool(os.environ.get("PEELER_TEST_ALL"))
MOST = 300  # the most allocations of one kind to try
TIME_LIMIT = 60  # in seconds; every command takes less than two
# The number of calls to try in the short run (default: 1).
FEW = {"allocation": 2, "c_allocation": 3, "large_allocation": 2, "gl": 2, "thread": 9}
# Kinds to try in every row. These kinds occur in few commands, find the most faults, or have few calls.
ALWAYS = ("allocation", "mmap", "child", "gl", "thread")

GL = ["--backend", "egl", "--threads", "1", "--size", "32x18"]

# PREPARED makes the inputs in IN; OUT is an empty folder. The output of each command is repeatable, except for the
# times in a report.
PREPARED = [
    ["render", SCENE, "-o", "IN/layers.exr", *GL],
    ["render", SCENE, "-o", "IN/tile.1.exr", "--tile", "1/2", *GL],
    ["render", SCENE, "-o", "IN/tile.2.exr", "--tile", "2/2", *GL],
]
JOBS = [
    {"verb": "extract", "args": ["IN/layers.exr", "--npz", "OUT/arrays.npz"]},
    {"verb": "flatten", "args": ["IN/layers.exr", "-o", "OUT/flat.png"]},
]
# A triangle "compressed" with Draco (https://google.github.io/draco/spec/), sequentially: its indices and floats are
# stored uncompressed.
TRIANGLE = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
DRACO = b"DRACO\2\2\1\0\0\0" + b"\1\3\1\0\1\2" + b"\1\1\0\x09\3\0\0\0" + TRIANGLE
COMPRESSED = {
    "asset": {"version": "2.0"},
    "extensionsUsed": ["KHR_draco_mesh_compression"],
    "extensionsRequired": ["KHR_draco_mesh_compression"],
    "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{
        "attributes": {"POSITION": 0},
        "indices": 1,
        "extensions": {
            "KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}},
        },
    }]}],
    "accessors": [
        {"componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
        {"componentType": 5125, "count": 3, "type": "SCALAR"},
    ],
    "bufferViews": [{"buffer": 0, "byteLength": len(DRACO)}],
    "buffers": [{"byteLength": len(DRACO), "uri": "triangle.drc"}],
}
COMMANDS = {
    "frames": ["render", SCENE, "-o", "OUT/frame.%d.exr", "--frames", "1-2", "--report",
               "OUT/report.json", *GL],
    "sample": ["render", SCENE, "-o", "OUT/sample.png", "--as", "lari", *GL],
    "shards": ["render", SCENE, "-o", "OUT/shard-%06d.tar", "--views", "2", "--shard-member",
               "{stem}.npz", *GL],
    "extract": ["extract", "IN/layers.exr", "-o", "OUT/layer.##.png", "--npz", "OUT/arrays.npz",
                "--points", "OUT/points.ply", "--threads", "2"],
    "merge": ["merge", "IN/tile.1.exr", "IN/tile.2.exr", "-o", "OUT/whole.exr", "--threads", "2"],
    "bake": ["bake", SCENE, "-o", "OUT/baked.glb", "--directions", "2", "--resolution", "16",
             "--engine", "cpu", "--threads", "2"],
    "voxels": ["rays", SOURCE / "examples" / "scenes" / "bracket.glb", "-o", "OUT/voxels.npz",
               "--voxels", "8", "--engine", "cpu", "--threads", "2"],
    "batch": ["batch", "IN/jobs.jsonl", "--report", "OUT/report.jsonl", "--quiet"],
    "compressed": ["rays", "IN/compressed.gltf", "-o", "OUT/hits.npz", "--direction", "0,0,1",
                   "--resolution", "8", "--engine", "cpu", "--threads", "2"],
}

# A row of the table: kind of call, mode of failure, errno, permitted exit codes besides 0, and the message (a regular
# expression; "" = the text of strerror()). If 0 is the only permitted code, the command must recover. A command that
# ends with 0 must write the same files as without a failure.
Failure = collections.namedtuple("Failure", "call how error codes message")
MEMORY, OUTPUT, DEVICE, INPUT, INTERNAL = {33}, {4}, {5}, {3}, {1}
FAILURES = [
    # As under a memory limit: all later allocations of at least the same size fail, too. A single failure is not
    # enough, because operator new tries again.
    Failure("allocation", "large", errno.ENOMEM, MEMORY, "memory"),
    Failure("large_allocation", "once", errno.ENOMEM, MEMORY, "memory"),
    Failure("c_allocation", "once", errno.ENOMEM, MEMORY, "memory"),
    Failure("open", "once", errno.EMFILE, INPUT | OUTPUT | INTERNAL, ""),
    Failure("open", "once", errno.EINTR, set(), ""),
    Failure("open", "on", errno.EMFILE, INPUT | OUTPUT | INTERNAL | DEVICE, ""),
    Failure("memory_file", "once", errno.EMFILE, INTERNAL, ""),
    Failure("read", "once", errno.EIO, INPUT | OUTPUT, ""),
    Failure("read", "once", errno.EINTR, set(), ""),
    Failure("read", "short", 0, set(), ""),
    Failure("write", "once", errno.EIO, OUTPUT, ""),
    Failure("write", "once", errno.EINTR, set(), ""),
    Failure("write", "short", 0, set(), ""),
    Failure("room", "once", errno.ENOSPC, OUTPUT, ""),
    Failure("stream", "once", errno.ENOSPC, OUTPUT, ""),
    Failure("fsync", "once", errno.EIO, OUTPUT, ""),
    Failure("close", "once", errno.EDQUOT, OUTPUT, ""),
    Failure("rename", "once", errno.EACCES, OUTPUT, ""),
    Failure("mkdir", "once", errno.EACCES, OUTPUT, ""),
    Failure("change", "on", errno.EROFS, OUTPUT, ""),
    Failure("change", "remove", 0, OUTPUT, ""),
    Failure("change", "move", 0, OUTPUT, ""),
    Failure("duplicate", "once", errno.EMFILE, INPUT | OUTPUT | INTERNAL, ""),
    Failure("lock", "once", errno.ENOLCK, set(), ""),
    Failure("seek", "once", errno.EIO, INPUT, "ends too early"),
    Failure("stat", "once", errno.EIO, INPUT | OUTPUT | INTERNAL, "Input/output error|not installed"),
    Failure("wait", "once", errno.EINTR, set(), ""),
    Failure("mmap", "once", errno.ENOMEM, MEMORY, "memory"),
    Failure("child", "once", errno.EAGAIN, INTERNAL, "start|pipe"),
    Failure("thread", "once", errno.EAGAIN, set(), ""),
    Failure("clock", "once", 0, set(), ""),
    Failure("clock", "on", 0, set(), ""),
    Failure("library", "once", 0, DEVICE | INTERNAL, "cannot open shared object file"),
    Failure("egl", "once", 0, DEVICE, "no usable OpenGL"),
    Failure("gl", "once", 0, MEMORY, "GL driver ran out of memory"),
    Failure("gl_allocation", "once", 0, MEMORY, "GL driver ran out of memory"),
    Failure("gl_mapping", "once", 0, MEMORY, "GL driver ran out of memory"),
    Failure("gl_error", "once", 0, MEMORY | DEVICE, "GL driver ran out of memory|context was lost"),
]

# OpenEXRCore reports lack of memory in zlib in the same way as a chunk that unpacks to more than expected.
AMBIGUOUS = "unable to decompress"

# A failed write to the memory files of a decoder reports lack of memory.
IN_MEMORY = "no memory for a decoder's data"

# A failed open of a written file, which OpenEXR opens to read it back, reports an output error.
READ_BACK = "does not read back"

# The record in failing_calls.h: its layout, and the names of the calls.
CALLS = re.findall(
    r"^ +X\((\w+)\) +/\*",
    (SOURCE / "tests" / "support" / "failing_calls" / "failing_calls.h").read_text(),
    re.MULTILINE,
)
COUNTS, PLACES = 32, 1 << 16
HEAD = struct.Struct(f"{COUNTS + 2}Q")

Run = collections.namedtuple("Run", "code err counts failed places")


class Command:
    def __init__(self, name, folder):
        self.name = name
        self.folder = folder
        self.record = folder / "record"
        self.reference = {}

    def words(self, arguments):
        """Returns the arguments with paths for IN and OUT."""
        places = {"IN": str(self.folder / "in"), "OUT": str(self.folder / "out")}
        return [re.sub(r"^(IN|OUT)\b", lambda m: places[m[0]], str(word)) for word in arguments]

    def prepare(self):
        (self.folder / "in").mkdir()
        for arguments in PREPARED:
            subprocess.run([PEELER, *self.words(arguments), "--quiet"], check=True)
        (self.folder / "in" / "triangle.drc").write_bytes(DRACO)
        (self.folder / "in" / "compressed.gltf").write_text(json.dumps(COMPRESSED))
        lines = [dict(job, args=self.words(job["args"])) for job in JOBS]
        text = "".join(json.dumps(line) + "\n" for line in lines)
        (self.folder / "in" / "jobs.jsonl").write_text(text)

    def run(self, failure=None, number=0, afresh=True):
        """Runs the command, and makes the call of this number fail; 0 = none."""
        for name in ("out", "out.moved", "tmp"):
            if afresh or name == "tmp":
                shutil.rmtree(self.folder / name, ignore_errors=True)
        (self.folder / "out").mkdir(exist_ok=True)
        (self.folder / "tmp").mkdir()
        with open(self.record, "wb") as record:
            record.truncate(HEAD.size + 8 * PLACES)
        environment = dict(
            os.environ, LD_PRELOAD=SHIM, LP_NUM_THREADS="1", TMPDIR=str(self.folder / "tmp"),
            PEELER_FAILING_RECORD=str(self.record), PEELER_FAILING_AT=str(number),
            PEELER_FAILING_FOLDER=str(self.folder / "out"),
        )
        if failure:
            environment.update(
                PEELER_FAILING_CALL=failure.call, PEELER_FAILING_HOW=failure.how,
                PEELER_FAILING_ERROR=str(failure.error),
            )
        try:
            done = subprocess.run(
                [PEELER, *self.words(COMMANDS[self.name])], env=environment, timeout=TIME_LIMIT,
                capture_output=True, text=True, errors="replace", check=False,
            )
            code, err = done.returncode, done.stderr
        except subprocess.TimeoutExpired:
            code, err = "hang", ""
        data = self.record.read_bytes()
        *counts, failed, place_count = HEAD.unpack_from(data)
        places = struct.unpack_from(f"{min(place_count, PLACES)}Q", data, HEAD.size)
        return Run(code, err, dict(zip(CALLS, counts)), failed, places)

    def files(self):
        """Returns {name: bytes} for the files in the output folder."""
        folder = self.folder / "out"
        if not folder.is_dir():
            return {}
        return {
            str(path.relative_to(folder)): path.read_bytes() if path.is_file() else b""
            for path in folder.rglob("*")
        }

    def hidden(self):
        return [n for n in self.files() if n.startswith(".")] + os.listdir(self.folder / "tmp")

    def not_whole(self):
        """Yields the faults of files with final names."""
        files = self.files()
        if "sample.png" in files and set(files) < set(self.reference):
            yield f"of files that belong together there are {sorted(files)}"
        for name, data in files.items():
            wanted = self.reference.get(name)
            if name.startswith(".") or name.split("/")[0].startswith("."):
                continue
            if wanted is None:
                yield f"{name} is not one of its files"
            elif name.endswith((".json", ".jsonl")):
                yield from not_json(name, data)
            elif name.endswith(".tar"):
                yield from not_samples(name, data, wanted)
            elif data != wanted:
                yield f"{name} differs"


def times_in(value):
    """Yields all times in a report, in milliseconds."""
    if isinstance(value, list):
        for entry in value:
            yield from times_in(entry)
    elif isinstance(value, dict):
        for key, entry in value.items():
            is_time = key == "milliseconds"
            if is_time and isinstance(entry, dict):
                yield from entry.values()
            elif is_time:
                yield entry
            else:
                yield from times_in(entry)


def not_json(name, data):
    """Yields the faults of JSON. The last of several JSON lines may be partial, because lines are written while jobs
    end."""
    texts = data.decode().splitlines(keepends=True) if name.endswith(".jsonl") else [data.decode()]
    for text in texts:
        if name.endswith(".jsonl") and not text.endswith("\n"):
            continue
        try:
            times = list(times_in(json.loads(text)))
        except ValueError as error:
            yield f"{name} is no JSON: {error}"
        else:
            if any(time < 0 for time in times):
                yield f"{name} has a time that is negative: {times}"


def members(data, folder):
    path = folder / "checked.tar"
    path.write_bytes(data)
    with tarfile.open(path) as archive:
        return {entry.name: archive.extractfile(entry).read() for entry in archive}


def not_samples(name, data, wanted):
    """Yields the faults of a shard. After an interruption it may have fewer samples, but all of them must be
    complete."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            found = members(data, pathlib.Path(folder))
        except (tarfile.TarError, EOFError) as error:
            yield f"{name} is no archive: {error}"
            return
        expected = members(wanted, pathlib.Path(folder))
    for member, content in found.items():
        if expected.get(member) != content:
            yield f"{member} in {name} differs"
    samples = {member.split(".")[0] for member in found}
    if set(found) != {member for member in expected if member.split(".")[0] in samples}:
        yield f"{name} has a part of a sample"


def problems_of(command, failure, run):
    """Yields the faults in the outcome of a run."""
    yield from command.not_whole()
    if failure.call == "c_allocation" and AMBIGUOUS in run.err:
        failure = failure._replace(codes=INPUT, message=AMBIGUOUS)
    if failure.call in ("write", "room", "change") and IN_MEMORY in run.err:
        failure = failure._replace(codes=MEMORY)
    if failure.call == "open" and READ_BACK in run.err:
        failure = failure._replace(codes=OUTPUT)
    if run.code not in failure.codes | {0}:
        yield f"exit code {run.code}"
    if run.failed == 0 and run.code != 0:
        yield "it fails where nothing was made to"
    gone = failure.how in ("remove", "move")
    there = {name for name in command.files() if not name.startswith(".")}
    if run.code == 0 and not gone and there != set(command.reference):
        yield f"exit code 0 with {sorted(there)}"
    if run.code != 0:
        if "peeler: error: " not in run.err:
            yield "no message"
        message = failure.message or (os.strerror(failure.error) if failure.error else "")
        if not re.search(message, run.err):
            yield f"a message without '{message}'"
    if command.hidden() and failure.error != errno.EROFS:
        yield f"hidden files are left: {command.hidden()}"
    # On a read-only file system, hidden files cannot be removed; the next run must remove them.
    if command.hidden() and failure.error == errno.EROFS:
        again = command.run(afresh=False)
        if again.code != 0 or command.hidden() or any(command.not_whole()):
            yield f"run again, it ends with {again.code} and {sorted(command.files())}"


def numbers_of(failure, counted, places):
    """Returns the numbers of the calls that are to fail, in separate runs."""
    count = counted[failure.call]
    if failure.call in ("allocation", "c_allocation"):
        numbers, most = sorted(places), MOST
    elif failure.call == "room":
        # The disk is full one byte before the end of a write, at the end, or one byte after the end.
        ends = {0, *places}
        numbers = sorted(n for end in ends for n in (end, end + 1, end + 2) if 0 < n <= count)
        most = len(numbers)
    else:
        numbers, most = range(1, count + 1), count
    if not ALL:
        most = FEW.get(failure.call, 1)
    if len(numbers) <= most:
        return list(numbers)
    return [numbers[(2 * i + 1) * len(numbers) // (2 * most)] for i in range(most)]


def tried(command, failure, counted):
    """Returns a row of the table, and the faults found."""
    places = counted.places
    if failure.call in ("allocation", "c_allocation", "room"):
        places = command.run(failure).places
    numbers = numbers_of(failure, counted.counts, places)
    outcomes, problems = collections.Counter(), []
    for number in numbers:
        run = command.run(failure, number)
        outcomes[run.code] += 1
        for problem in problems_of(command, failure, run):
            what = f"{failure.call} {number}, {failure.how} {failure.error}"
            problems.append(f"{what}: {problem}\n{run.err}")
    name = errno.errorcode.get(failure.error, "")
    ends = ", ".join(f"{outcomes[code]} × {code}" for code in sorted(outcomes, key=str))
    row = (failure.call, failure.how, name, counted.counts[failure.call], len(numbers), ends)
    return row, problems


def main():
    with tempfile.TemporaryDirectory() as folder:
        command = Command(sys.argv[1], pathlib.Path(folder))
        command.prepare()
        counted = command.run()
        assert counted.code == 0, counted.err
        command.reference = command.files()
        assert command.reference and not command.hidden(), command.hidden()
        problems = []
        print(f"{'call':16} {'how':7} {'error':7} {'calls':>6} {'tried':>5}  exit codes")
        third = list(COMMANDS).index(command.name) % 3
        for number, failure in enumerate(FAILURES):
            skipped = not ALL and number % 3 != third and failure.call not in ALWAYS
            if skipped or counted.counts[failure.call] == 0:
                continue
            row, more = tried(command, failure, counted)
            print("{:16} {:7} {:7} {:6} {:5}  {}".format(*row), flush=True)
            problems += more
    for problem in problems:
        print(f"\n{problem}")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
