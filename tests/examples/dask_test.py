# SPDX-License-Identifier: Apache-2.0
"""Tests examples/dask on a virtual machine, with a real scheduler and two workers, one of which is killed."""

import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tarfile
import time

import own_machine
from peeler_command import EXAMPLES, PEELER, PeelerTest, main, peeler, skip

SCENES = sorted((EXAMPLES / "scenes").glob("*.glb"))
OPTIONS = ("size=48x32", "shard-member=png")
SCHEDULER = "tcp://127.0.0.1:8786"


class Dask(PeelerTest):
    def setUp(self):
        self.folder = pathlib.Path(own_machine.SCRATCH) / self.id().rsplit(".", 1)[-1]
        self.folder.mkdir()
        programs = self.folder / "programs"
        programs.mkdir()
        (programs / "peeler").symlink_to(shutil.which(PEELER))
        self.environment = {
            **os.environ,
            "PATH": f"{programs}:{os.environ['PATH']}",
            "PYTHONUNBUFFERED": "1",
            "LP_NUM_THREADS": "0",
        }
        # Two scenes per shard, so that both workers get shards.
        self.script = self.folder / "dask" / "peeler_dask.py"
        shutil.copytree(EXAMPLES / "dask", self.script.parent)
        shutil.copytree(EXAMPLES / "worker", self.folder / "worker")
        text = self.script.read_text(encoding="utf-8")
        self.script.write_text(text.replace("PER_SHARD = 100 ", "PER_SHARD = 2 "), encoding="utf-8")

    def start(self, *command):
        with open(self.folder / "log", "a", encoding="utf-8") as log:
            process = subprocess.Popen(
                list(map(str, command)),
                env=self.environment,
                cwd=self.folder,
                stdout=subprocess.DEVNULL,
                stderr=log,
                start_new_session=True,
            )
        self.addCleanup(process.wait)
        self.addCleanup(lambda: process.poll() is None and os.killpg(process.pid, signal.SIGKILL))
        return process

    def test_shards_are_written_though_a_node_is_killed(self):
        self.start("/usr/bin/dask-scheduler", "--host", "127.0.0.1", "--no-dashboard")
        nodes = [
            self.start("/usr/bin/dask-worker", SCHEDULER, "--nthreads", "1", "--no-nanny", "--no-dashboard",
                       "--local-directory", self.folder / f"node{i}")
            for i in range(2)
        ]
        listing, out = self.folder / "scenes.txt", self.folder / "shards"
        out.mkdir()
        scenes = [*SCENES * 2, self.folder / "missing.glb"]
        listing.write_text("".join(f"{scene}\n" for scene in scenes), encoding="utf-8")
        run = subprocess.Popen(
            ["/usr/bin/python3", self.script, SCHEDULER, listing, out, *OPTIONS],
            env=self.environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )
        deadline = time.monotonic() + 300
        while not list(out.glob("*.tar")) and run.poll() is None and time.monotonic() < deadline:
            time.sleep(0.02)
        os.killpg(nodes[0].pid, signal.SIGKILL)
        printed, errors = run.communicate(timeout=600)
        log = (self.folder / "log").read_text(encoding="utf-8")
        self.assertEqual(run.returncode, 3, printed + errors + log)
        shards = (len(scenes) + 1) // 2
        self.assertIn(f"{shards} shards of {len(scenes)} scenes, 1 failed", printed)
        self.assertIn("missing.glb", errors)
        written = sorted(out.glob("pictures-*.tar"))
        # The shard of the missing scene does not exist if it has no other scene.
        self.assertGreaterEqual(len(written), shards - 1)
        self.assertEqual(sorted(path.suffix for path in out.iterdir()), [".tar"] * len(written))
        first = self.folder / "first.tar"
        options = [word for option in OPTIONS for word in (f"--{option.split('=')[0]}", option.split("=")[1])]
        done = peeler("render", *scenes[:2], "-o", first, *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        with tarfile.open(written[0]) as ours, tarfile.open(first) as theirs:
            self.assertEqual(ours.getnames(), theirs.getnames())
            for name in ours.getnames():
                if name.endswith(".png"):
                    self.assertEqual(ours.extractfile(name).read(), theirs.extractfile(name).read())


if __name__ == "__main__":
    if not os.path.exists("/usr/bin/dask-worker"):
        skip("Dask is not installed (python3-distributed)")
    if why := own_machine.impediment():
        skip(why)
    sys.exit(own_machine.run("farm", main))
