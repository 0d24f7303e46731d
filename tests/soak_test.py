# SPDX-License-Identifier: Apache-2.0
"""Runs peeler for a long time: changing scenes in one process, many jobs in one batch, many processes in one folder.

Memory, descriptors, threads and GL objects must not grow, and results must equal the first results. The short run has a
few frames of each; PEELER_TEST_ALL has FRAMES, and runs processes in one folder for PEELER_SOAK_SECONDS (default:
3600). PEELER is the program, PEELER_FAILING_CALLS the library that counts GL objects (support/failing_calls).
PEELER_SANITIZE names the sanitizers of the build, whose own memory grows. Prints a table.
"""

import collections
import gc
import hashlib
import itertools
import json
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import time
import unittest

HERE = pathlib.Path(__file__).resolve().parent
SCENES = HERE.parent / "examples" / "scenes"
ASSETS = pathlib.Path(os.environ.get("PEELER_ASSETS") or HERE.parents[1] / "shared" / "assets")
PEELER = pathlib.Path(os.environ.get("PEELER", HERE.parent / "build/ci/peeler")).resolve()
COUNTER = os.environ.get("PEELER_FAILING_CALLS")
SANITIZED = bool(os.environ.get("PEELER_SANITIZE"))
ALL = "PEELER_TEST_ALL" in os.environ
SECONDS = float(os.environ.get("PEELER_SOAK_SECONDS", 3600)) if ALL else 0
FRAMES, JOBS, PROCESSES, PICTURES = (20_000, 2_000, 8, 40) if ALL else (72, 12, 3, 6)
LARGEST_MODEL = 300_000  # in bytes
MOST_GROWTH = 6 << 20  # the maximum growth of allocator overhead, in bytes
# Over many rounds, the heap fragments further, at a falling rate. Memory lost to fragmentation cannot be returned to
# the system.
MOST_RESIDENT_GROWTH = (32 << 20) if ALL else MOST_GROWTH
MOST_OF_JOB = 8 << 10  # the maximum memory of a batch per job, for its line and result, in bytes
GL_OBJECTS = 31  # the index of this count in the record of failing_calls.h

started = time.monotonic()


def scenes():
    """Returns small scenes of all kinds, including Draco, meshopt, animations and textures."""
    own = sorted(SCENES.glob("*.glb"))
    folder = ASSETS / "gltf-sample-assets"
    models = sorted(
        path for path in folder.rglob("*.gl*")
        if path.suffix in (".glb", ".gltf") and sum(file.stat().st_size for file in path.parent.iterdir()) < LARGEST_MODEL
    )
    if not models:
        print(f"left out: there are no models in {folder}")
    kinds = "BoxTexturedMeshopt", "Draco", "Animated", "Textured"
    few = [next(path for path in models if kind in str(path)) for kind in kinds if models]
    return (own, models) if ALL else (own[:4], few)


def memory_of(pid):
    """Returns the resident memory of a process in bytes."""
    return int(pathlib.Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGESIZE")


def children_of(pid):
    pid = os.getpid() if pid == "self" else pid
    return pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()


State = collections.namedtuple("State", "memory descriptors threads objects")


def state_of(pid, record=None):
    objects = struct.unpack_from("q", record.read_bytes(), 8 * GL_OBJECTS)[0] if record else 0
    entries = [len(os.listdir(f"/proc/{pid}/{folder}")) for folder in ("fd", "task")]
    return State(memory_of(pid), *entries, objects)


def settled_state_of(pid):
    """Returns the state of a process, without resources that it holds only briefly at the start of a job."""
    states = []
    for _ in range(10):
        states.append(state_of(pid))
        time.sleep(0.002)
    return min(states, key=lambda state: state.descriptors)


def content_of(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


# ---- a worker that renders changing scenes for the Python module


def views():
    """Returns [(a name, the scene's file, the keywords for a picture of it)], always in the same order."""
    own, models = scenes()
    ways = (
        {"method": "dual", "channels": ["normal", "id"]},
        {"method": "a-buffer", "channels": ["position", "distance"]},
        {"method": "front-to-back", "samples": 2},
    )
    chosen = [(path, ways[i % len(ways)]) for i, path in enumerate([*own, *models])]
    return [(f"{path} {way['method']}", path, way) for path, way in chosen]


def picture_of(peeler, renderer, path, way):
    """Returns a hash of all layers of a picture."""
    image = renderer.layers(peeler.Scene(path), size=(40, 30), eye=(3, 2, 4), **way)
    result = hashlib.sha256()
    for array in (image.z, image.rgba, image.splits):
        result.update(array.tobytes())
    return result.hexdigest()


def render_for_long(record, frames):
    """Prints JSON lines. For each round of the views: (frame, State of the process that runs the jobs, State of this
    process). At the end: the views whose results have changed."""
    sys.path.insert(0, str(PEELER.parent / "python"))
    import peeler  # pylint: disable=import-outside-toplevel,import-error

    chosen, first = views(), {}
    with peeler.Renderer() as renderer:
        for number, (name, path, way) in zip(range(frames), itertools.cycle(chosen)):
            result = picture_of(peeler, renderer, path, way)
            if first.setdefault(name, result) != result:
                print(json.dumps({"another result": name, "frame": number}), flush=True)
            if (number + 1) % len(chosen) == 0:
                gc.collect()
                worker = children_of("self")[0]
                told = {"frame": number + 1, "state": state_of(children_of(worker)[0], pathlib.Path(record)),
                        "client": state_of("self")}
                print(json.dumps(told), flush=True)


# ---- the tests


class Soak(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_process(self):
        if not (PEELER.parent / "python").is_dir() or not COUNTER:
            print("skipped: there is no Python module, or no library that counts objects of GL")
            return
        record = self.folder / "record"
        with open(record, "wb") as file:
            file.truncate(1 << 20)
        environment = {**os.environ, "LD_PRELOAD": COUNTER, "PEELER_FAILING_RECORD": str(record), "LP_NUM_THREADS": "0"}
        # A driver may compile shaders or cache data in any round, so one jump in memory need not be a leak. The second,
        # longer run decides.
        for frames in (FRAMES, 4 * FRAMES):
            grown = self.render(environment, record, frames)
            if max(grown.values()) < MOST_RESIDENT_GROWTH:
                return
            print(f"grown by {grown} bytes in {frames:,} frames; once more, with more of them", flush=True)
        self.fail(f"memory grows: {grown}")

    def render(self, environment, record, frames):
        """Renders scenes in one process, and returns {process: growth in bytes between the second and the last
        third}."""
        begun = time.monotonic()
        done = subprocess.run([sys.executable, "-B", __file__, "render", record, str(frames)], env=environment,
                              stdout=subprocess.PIPE, text=True, check=False)
        self.assertEqual(done.returncode, 0)
        told = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
        self.assertEqual([line for line in told if "another result" in line], [])
        states = [State(*line["state"]) for line in told if "state" in line]
        clients = [State(*line["client"]) for line in told if "state" in line]
        # Drivers and allocators keep memory from the first rounds. Memory that a thread is about to free counts in some
        # rounds but not in others, especially on a busy machine; leaked memory counts in all later rounds.
        third = len(states) // 3
        self.assertGreater(third, 1)
        thirds = (slice(third, -third), slice(-third, None))
        grown = {}
        for name, found in (("worker", states), ("client", clients)):
            before, after = (min(s.memory for s in found[part]) for part in thirds)
            grown[name] = after - before
            print(f"{name}: {told[-1]['frame']:,} frames of {frames // len(found)} views, "
                  f"{time.monotonic() - begun:.0f} s: {before >> 20} MiB resident, grown by {(after - before) >> 10:+} KiB; "
                  f"{found[-1].descriptors} descriptors, {found[-1].threads} threads, {found[-1].objects} objects of GL",
                  flush=True)
            self.assertEqual({state[1:] for state in found[third:]}, {found[-1][1:]})
        return grown

    def test_batch(self):
        own, models = scenes()
        chosen = list(itertools.islice(itertools.cycle([*own, *models]), JOBS))
        outputs = [self.folder / f"{i}.{('exr', 'png', 'npz')[i % 3]}" for i in range(JOBS)]
        jobs = self.folder / "jobs.jsonl"
        with open(jobs, "w", encoding="utf-8") as file:
            for path, output in zip(chosen, outputs):
                line = {"verb": "render", "args": [str(path), "-o", str(output)], "options": {"size": "24x16"}}
                file.write(json.dumps(line) + "\n")
        command = [PEELER, "batch", jobs, "--jobs", "2", "--report", self.folder / "report.jsonl", "--quiet"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as batch:
            states, begun = [], time.monotonic()
            for number, line in enumerate(batch.stdout):
                self.assertEqual(json.loads(line)["exitCode"], 0, line)
                if number + 2 < JOBS:  # both processes are still running
                    states.append(settled_state_of(batch.pid))
        self.assertEqual(batch.returncode, 0)
        for i, output in enumerate(outputs):
            again = [j for j in range(i % (3 * len({*chosen})), i, 3 * len({*chosen}))][:1]
            if again and output.suffix != ".exr":  # EXR headers contain the render time
                self.assertEqual(content_of(output), content_of(outputs[again[0]]), output)
        kept = (states[-1].memory - states[0].memory) / len(states)
        print(f"{JOBS:,} jobs of one batch, {time.monotonic() - begun:.0f} s: {states[0].memory >> 20} MiB, "
              f"grown by {kept:,.0f} bytes a job; at most {max(s.descriptors for s in states)} descriptors", flush=True)
        if SANITIZED:
            print("left out: the memory of a batch, which is the sanitizer's")
        else:
            self.assertLess(kept, MOST_OF_JOB + MOST_GROWTH / JOBS)
        # A leak of descriptors would show in every later round.
        first, last = states[: JOBS // 3], states[-(JOBS // 3) :]
        self.assertLessEqual(min(s.descriptors for s in last), max(s.descriptors for s in first))

    def test_shared_folder(self):
        scene = SCENES / "coincident.glb"
        command = [PEELER, "render", scene, "--views", str(PICTURES), "--size", "32x24", "--quiet", "-o"]
        expected = self.folder / "expected"
        subprocess.run([*command, expected / "@@@@.png"], check=True)
        pictures = {path.name: content_of(path) for path in expected.iterdir()}
        self.assertEqual(len(pictures), PICTURES)
        rounds = 0
        while rounds == 0 or time.monotonic() - started < SECONDS:
            folder = self.folder / f"round {rounds}"
            running = [subprocess.Popen([*command, folder / "@@@@.png", "--skip-existing"]) for _ in range(PROCESSES)]
            self.assertEqual([process.wait() for process in running], [0] * PROCESSES)
            # There must be no hidden files either.
            self.assertEqual({path.name: content_of(path) for path in folder.iterdir()}, pictures)
            for path in folder.iterdir():
                path.unlink()
            folder.rmdir()
            rounds += 1
        print(f"{PROCESSES} processes on one folder, {rounds:,} times {PICTURES} pictures: all the same", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["render"]:
        render_for_long(sys.argv[2], int(sys.argv[3]))
    else:
        unittest.main()
