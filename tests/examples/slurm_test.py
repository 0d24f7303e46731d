# SPDX-License-Identifier: Apache-2.0
"""Tests the scripts of examples/slurm on a real cluster.

With PEELER_TEST_ALL, there are 50 frames instead of 20, and one job reaches its time limit."""

import os
import pathlib
import re
import shutil
import signal
import sys
import tarfile
import time
import unittest

import own_machine
import slurm_cluster
from peeler_command import (
    EXAMPLES,
    PEELER,
    PeelerTest,
    animated_scene,
    fingerprints,
    main,
    peeler,
    skip,
)

SLURM = EXAMPLES / "slurm"
SIZE = ("--size", "320x240")
ALL = bool(os.environ.get("PEELER_TEST_ALL"))
TASKS, FRAMES = (10, 50) if ALL else (4, 20)
SHARE = FRAMES // TASKS


def running_peelers():
    """Returns {process id: its task number; 0 outside an array} for the running peelers."""
    found = {}
    for entry in os.listdir("/proc"):
        try:
            words = pathlib.Path("/proc", entry, "cmdline").read_bytes().split(b"\0")
            variables = pathlib.Path("/proc", entry, "environ").read_bytes()
        except OSError:  # not a process, or already gone
            continue
        if words[0] == PEELER.encode():
            task = re.search(rb"\0SLURM_ARRAY_TASK_ID=(\d+)\0", variables)
            found[int(entry)] = int(task[1]) if task else 0
    return found


def sent(process, number):
    """Sends a signal. Returns False if the process has ended in the meantime."""
    try:
        os.kill(process, number)
    except ProcessLookupError:
        return False
    return True


class Slurm(PeelerTest):
    @classmethod
    def setUpClass(cls):
        cls.scratch = pathlib.Path(own_machine.SCRATCH)
        (cls.scratch / "slurm").mkdir()
        started = time.monotonic()
        cls.cluster = slurm_cluster.Cluster(str(cls.scratch / "slurm"))
        print(f"a cluster of one node after {time.monotonic() - started:.1f} s", flush=True)
        cls.addClassCleanup(cls.cluster.stop)
        cls.scene = animated_scene()
        if not ALL:
            return
        # Slurm checks time limits only every 30 seconds, so this job runs during the other tests. sleep stands in for a
        # slow peeler.
        cls.late_log = cls.scratch / "late.log"
        cls.late = cls.sbatch(
            "300", PEELER="sleep", SBATCH_TIMELIMIT="1", SBATCH_OUTPUT=str(cls.late_log)
        )

    def setUp(self):
        self.folder = self.scratch / self.id().rsplit(".", 1)[-1]
        self.folder.mkdir()

    @classmethod
    def sbatch(cls, *arguments, **environment):
        """Submits one job of peeler.sbatch, and returns its number."""
        command = ("sbatch", "--parsable", str(SLURM / "peeler.sbatch"), *map(str, arguments))
        settings = {"PEELER": PEELER, "SBATCH_OUTPUT": str(cls.scratch / "log.%j"), **environment}
        return cls.cluster.ask(*command, environment=settings).strip()

    def submit(self, script, *arguments, **environment):
        """Submits the jobs of a script; returns the number of the last one."""
        command = ("sh", str(SLURM / script), *map(str, arguments))
        settings = {"PEELER": PEELER, "SBATCH_OUTPUT": str(self.folder / "log.%a"), **environment}
        return self.cluster.ask(*command, environment=settings, cwd=self.folder).strip()

    def log(self):
        return "".join(file.read_text() for file in sorted(self.folder.glob("log.*")))

    def assert_completed(self, tasks):
        for task in tasks:
            self.assertEqual(task["JobState"], "COMPLETED", f"{task}\n{self.log()}")

    def frames(self, name):
        (self.folder / name).mkdir()
        out = self.folder / name / "walk.####.exr"
        return self.submit(
            "frames.sh", TASKS, 2, self.scene, "-o", out, "--frames", f"0-{FRAMES - 1}", *SIZE
        )

    def disturb(self, folder, job):
        """Kills one task (SIGKILL), and stops another as its time limit would (SIGTERM to the script), each after some
        but not all of its frames. Returns {task: its finished frames and their times}, and the maximum number of tasks
        running at once."""
        signals, done, most = [signal.SIGKILL, signal.SIGTERM], {}, 0
        end = time.monotonic() + slurm_cluster.ENDLESS
        while signals and len(list(folder.glob("walk.*"))) < FRAMES and time.monotonic() < end:
            peelers = running_peelers()
            most = max(most, len(peelers))
            for process, task in peelers.items():
                if task in done or not signals or not 0 < len(self.finished(folder, task)) < SHARE:
                    continue
                if not sent(process, signal.SIGSTOP):  # otherwise the process would end first
                    continue
                if len(self.finished(folder, task)) < SHARE:
                    done[task] = self.finished(folder, task)
                    print(
                        f"task {task}: {signals[0].name} after {len(done[task])} of {SHARE} frames"
                    )
                    if signals.pop(0) == signal.SIGKILL:
                        sent(process, signal.SIGKILL)
                        continue
                    self.cluster.ask("scancel", "--batch", "--signal=TERM", f"{job}_{task}")
                sent(process, signal.SIGCONT)
        self.assertEqual(len(done), 2, "no task was caught between its frames")
        return done, most

    def finished(self, folder, task):
        share = range((task - 1) * SHARE, task * SHARE)
        files = (folder / f"walk.{frame:04d}.exr" for frame in share)
        return {file: file.stat().st_mtime_ns for file in files if file.exists()}

    def test_frames(self):
        whole = self.folder / "whole"
        whole.mkdir()
        started = time.monotonic()
        self.render(self.scene, "-o", whole / "walk.####.exr", "--frames", f"0-{FRAMES - 1}", *SIZE)
        one_process = time.monotonic() - started

        started = time.monotonic()
        self.assert_completed(self.cluster.wait_for(self.frames("calm")))
        calm = time.monotonic() - started

        started = time.monotonic()
        job = self.frames("disturbed")
        victims, most = self.disturb(self.folder / "disturbed", job)
        tasks = self.cluster.wait_for(job)
        disturbed = time.monotonic() - started
        self.assert_completed(tasks)
        for task in tasks:
            number = int(task["ArrayTaskId"])
            self.assertEqual(int(task["Restarts"]), 1 if number in victims else 0, task)
        for written in victims.values():  # finished frames are not rendered again
            self.assertEqual({file: file.stat().st_mtime_ns for file in written}, written)
        self.assertLessEqual(most, 2)
        self.assertIn("stopped by signal 9; queued again", self.log())
        self.assertIn("stopped by signal 15; queued again", self.log())

        self.verify(self.folder / "disturbed", FRAMES)
        self.assert_nothing_else(self.folder / "disturbed", FRAMES)
        expected = fingerprints(whole)
        self.assertEqual(len(expected), FRAMES)
        self.assertEqual(fingerprints(self.folder / "calm"), expected)
        self.assertEqual(fingerprints(self.folder / "disturbed"), expected)
        print(
            f"{FRAMES} frames of {self.scene.name}: {one_process:.1f} s by one process, "
            f"{calm:.1f} s in {TASKS} tasks, {disturbed:.1f} s with two of them disturbed",
            flush=True,
        )

    def test_tiles(self):
        options = (EXAMPLES / "scenes" / "coincident.glb", "--size", "400x301")
        names = ("layers.exr", "picture.png")
        jobs = [self.submit("tiles.sh", 3, self.folder / name, *options) for name in names]
        whole = self.folder / "whole.exr"
        self.render(*options, "-o", whole)
        for name, job in zip(names, jobs):
            self.assert_completed(self.cluster.wait_for(job))
            self.verify(self.folder / f"{name}.tiles", 3)
        self.assertEqual((self.folder / "layers.exr").read_bytes(), whole.read_bytes())
        flat = self.folder / "flat.png"
        self.assertEqual(peeler("flatten", whole, "-o", flat).returncode, 0)
        same = peeler("compare", flat, self.folder / "picture.png")
        self.assertEqual(same.returncode, 0, same.stdout)

    def test_shards(self):
        scenes = self.folder / "scenes"
        scenes.mkdir()
        for name in ("coincident", "bracket", "panes"):
            shutil.copy(EXAMPLES / "scenes" / f"{name}.glb", scenes)
        (scenes / "broken.glb").write_bytes(b"glTF")  # a broken scene, which is skipped
        options = ("--views", 4, "--shard-member", "png", "--shard-count", 3, "--size", "64x48")
        runs = []
        for _ in range(2):  # the second run has nothing to do
            job = self.submit(
                *("shards.sh", 2, 2, scenes, "-o", self.folder / "out" / "{chunk}-%02d.tar"),
                *options,
            )
            tasks = {int(task["ArrayTaskId"]): task for task in self.cluster.wait_for(job)}
            # The first task has the scenes bracket and broken.
            self.assertEqual(tasks[1]["ExitCode"], "3:0", self.log())
            self.assertEqual(tasks[2]["ExitCode"], "0:0", self.log())
            written = {}
            for file in (self.folder / "out").iterdir():
                with tarfile.open(file) as tar:
                    written[file.name] = file.stat().st_ino, tar.getnames()
            runs.append(written)
        self.assertEqual(runs[1], runs[0])
        keys = {
            name: sorted({member.partition(".")[0] for member in names})
            for name, (_, names) in runs[0].items()
        }
        self.assertEqual(
            keys,
            {
                "1-00.tar": ["bracket_0000", "bracket_0001", "bracket_0002"],
                "1-01.tar": ["bracket_0003"],
                "2-00.tar": ["coincident_0000", "coincident_0001", "coincident_0002"],
                "2-01.tar": ["coincident_0003", "panes_0000", "panes_0001"],
                "2-02.tar": ["panes_0002", "panes_0003"],
            },
        )

    def test_tiles_that_fail_are_not_merged(self):
        job = self.submit("tiles.sh", 2, self.folder / "out.exr", self.folder / "missing.glb")
        self.assertEqual(self.cluster.wait_for(job)[0]["JobState"], "CANCELLED", self.log())
        self.assertFalse((self.folder / "out.exr").exists())

    def test_failures(self):
        render = ("render", EXAMPLES / "scenes" / "glasses.glb", "-o", self.folder / "out.exr")
        logs = {name: self.folder / f"{name}.log" for name in ("memory", "gpu")}
        jobs = {
            "memory": self.sbatch(
                *(*render, "--size", "8000x8000", "--memory", "64M"),
                SBATCH_OUTPUT=str(logs["memory"]),
            ),
            "gpu": self.sbatch(
                *(*render, "--size", "8x8", "--require-gpu"),
                SBATCH_OUTPUT=str(logs["gpu"]),
                PEELER_RESTARTS="1",
            ),
        }
        ends = {}
        for name, job in jobs.items():
            task = self.cluster.wait_for(job)[0]
            ends[name] = task["ExitCode"], task["Restarts"]
        # A retry would have the same memory, so it would fail, too.
        self.assertEqual(ends["memory"], ("33:0", "0"), logs["memory"].read_text())
        self.assertIn("give it more memory", logs["memory"].read_text())
        # Another machine may have a GPU, or this machine may get one. So the job is requeued, but not forever.
        if ends["gpu"] == ("0:0", "0"):
            self.skipTest("this machine has a GPU: no exit code 5")
        self.assertEqual(ends["gpu"], ("5:0", "1"), logs["gpu"].read_text())
        self.assertIn("not again after 1 restarts", logs["gpu"].read_text())

    def test_a_cancelled_job_stays_cancelled(self):
        out = self.folder / "out.exr"
        scene = EXAMPLES / "scenes" / "glasses.glb"
        job = self.sbatch("render", scene, "-o", out, "--size", "8000x6000")
        self.cluster.wait_until(running_peelers)
        self.cluster.ask("scancel", job)
        self.assertEqual(self.cluster.wait_for(job)[0]["JobState"], "CANCELLED")
        self.cluster.wait_until(lambda: not running_peelers())
        self.assertEqual(list(self.folder.glob("*.exr*")), [])
        self.assertEqual(self.cluster.tasks(job)[0]["Restarts"], "0")

    @unittest.skipUnless(ALL, "takes a minute; with PEELER_TEST_ALL")
    def test_warned_before_its_time_is_up(self):  # must run last
        text = ""

        def told_what():
            nonlocal text
            text = self.late_log.read_text() if self.late_log.exists() else ""
            return "queued again" in text or "TIME LIMIT" in text

        self.cluster.wait_until(told_what)
        told = f"{text}\n{self.cluster.tasks(self.late)}\n{self.cluster.state()}"
        self.assertIn("stopped by signal 15; queued again", text, told)
        self.assertNotIn("TIME LIMIT", text, told)
        self.cluster.ask("scancel", self.late)


if __name__ == "__main__":
    if slurm_cluster.missing_programs():
        missing = ", ".join(slurm_cluster.missing_programs())
        skip(f"no {missing} (examples/install_dependencies.sh test)")
    reason = own_machine.impediment()
    if reason:
        skip(reason)
    sys.exit(own_machine.run("farm", main))
