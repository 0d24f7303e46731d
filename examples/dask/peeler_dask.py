# SPDX-License-Identifier: Apache-2.0
"""Renders thousands of scenes into shards, on a Dask cluster where each process holds a `peeler worker`.

    python3 peeler_dask.py ADDRESS SCENES.txt FOLDER [NAME=VALUE ...]

ADDRESS is the scheduler's address, SCENES.txt lists one scene per line, and all machines share FOLDER. The other
arguments are options of `peeler render` (size=256x256 shard-member=npz views=8). If a task fails on one machine,
another machine runs it.
"""

import pathlib
import sys

from distributed import Client, WorkerPlugin, as_completed, get_worker

CLIENT = pathlib.Path(__file__).resolve().parents[1] / "worker" / "worker_client.py"
sys.path.insert(0, str(CLIENT.parent))
from worker_client import JobError, Worker  # noqa: E402

PER_SHARD = 100  # scenes per shard


class Holder(WorkerPlugin):
    """A Dask plugin that keeps a worker, with its scenes, devices and shaders, between tasks."""

    name = "peeler"

    def setup(self, worker):
        self.peeler = Worker("--jobs", str(worker.state.nthreads))

    def teardown(self, worker):
        self.peeler.close()


def render(shard, scenes, folder, options):
    """Returns the result, or the reason why these scenes cannot be rendered. Raises if another machine may succeed."""
    out = pathlib.Path(folder, f"pictures-{shard:06d}.tar")
    try:
        return get_worker().plugins["peeler"].peeler.run("render", *scenes, "-o", out, **options)
    except JobError as error:
        if error.retry:
            raise
        return {"failed": str(error), "first": scenes[0]}


def main(address, listing, folder, *options):
    scenes = pathlib.Path(listing).read_text().split("\n")[:-1]
    options = dict(option.split("=", 1) for option in options)
    client = Client(address)
    client.upload_file(str(CLIENT))
    client.register_worker_plugin(Holder())
    tasks = [
        client.submit(render, number, scenes[first : first + PER_SHARD], folder, options, retries=3)
        for number, first in enumerate(range(0, len(scenes), PER_SHARD))
    ]
    failed = [task.result() for task in as_completed(tasks) if "failed" in task.result()]
    for result in failed:
        print(f"{result['first']}: {result['failed']}", file=sys.stderr)
    print(f"{len(tasks)} shards of {len(scenes)} scenes, {len(failed)} failed")
    return 3 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
