# SPDX-License-Identifier: Apache-2.0
"""A client of `peeler worker` that needs only Python's standard library.

    with Worker() as worker:
        result = worker.run("render", "scene.glb", "-o", "out.exr", size="640x360")
        print(result["layers"], "layers")

Protocol: cmd/README.md, "The worker". One Worker may be used from several threads.
"""

import itertools
import json
import queue
import socket
import subprocess
import sys
import threading


class JobError(Exception):
    """A job that failed. `kind` is "usage", "input", "output", "device", "incomplete", "memory", "internal",
    "cancelled" or "crash"; `retry` says whether it may succeed later or on another machine."""

    def __init__(self, line):
        error = line.get("error", {})
        self.kind, self.what = error.get("kind", "internal"), error.get("what", "")
        self.where, self.hint = error.get("where", ""), error.get("hint", "")
        self.retry, self.line = line.get("retry", False), line
        place = f": {self.where}" if self.where else ""
        super().__init__(f"{self.what}{place}" + (f" ({self.hint})" if self.hint else ""))


class Worker:
    def __init__(self, *arguments, program="peeler", listens=None):
        """Starts `peeler worker ARGUMENTS`, or connects to a worker that listens on the socket `listens`."""
        self._process = self._socket = None
        if listens is not None:
            self._socket = socket.socket(socket.AF_UNIX)
            self._socket.connect(str(listens))
            self._in, self._out = self._socket.makefile("rb"), self._socket.makefile("wb")
        else:
            # In its own session, the worker does not get Ctrl-C. The client gets it, and decides which jobs to cancel.
            self._process = subprocess.Popen(
                [program, "worker", *arguments],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                start_new_session=True,
            )
            self._in, self._out = self._process.stdout, self._process.stdin
        hello = json.loads(self._in.readline() or b"{}")
        if hello.get("worker") != 1:
            raise RuntimeError(f"no worker of protocol 1 answers, but {hello}")
        self.version, self.jobs = hello["version"], hello["jobs"]
        self._ids, self._lock, self._answers, self._gone = itertools.count(), threading.Lock(), {}, False
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def start(self, verb, *args, wants_progress=False, **options):
        """Submits a job, and returns its id. Keywords are options, with _ in place of -."""
        with self._lock:
            if self._gone:
                raise ConnectionError("the worker has ended")
            number = next(self._ids)
            self._answers[number] = queue.SimpleQueue()
            self._send(
                {
                    "id": number,
                    "verb": verb,
                    "args": [str(arg) for arg in args],
                    "options": {name.rstrip("_").replace("_", "-"): o for name, o in options.items()},
                    "progress": wants_progress,
                }
            )
        return number

    def wait(self, number, progress=None):
        """Waits for a job, and returns its result line. Ctrl-C, or an exception from `progress`, cancels the job."""
        try:
            while True:
                line = self._answers[number].get()
                if line is None:
                    raise ConnectionError("the worker has ended")
                if "progress" not in line:
                    break
                if progress:
                    progress(line["progress"])
        except BaseException:
            self.cancel(number)
            raise
        finally:
            self._answers.pop(number, None)
        for warning in line.get("warnings", ()):
            print("warning:", warning, file=sys.stderr)
        return line

    def run(self, verb, *args, progress=None, **options):
        """Runs a job, and returns its result. Raises JobError."""
        line = self.wait(self.start(verb, *args, wants_progress=bool(progress), **options), progress)
        if "error" in line:
            raise JobError(line)
        return line.get("result")

    def cancel(self, number):
        with self._lock:
            if not self._gone:
                self._send({"cancel": number})

    def close(self):
        """Ends the worker, or disconnects from a worker on a socket."""
        try:
            if self._socket:
                self._socket.shutdown(socket.SHUT_RDWR)
            self._out.close()
        except OSError:  # the worker has already ended
            pass
        if self._process:
            self._process.wait()
        self._reader.join()
        self._in.close()
        if self._socket:
            self._socket.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _send(self, line):
        try:
            self._out.write(json.dumps(line).encode() + b"\n")
            self._out.flush()
        except (OSError, ValueError):  # the thread that reads notices that the worker is gone
            pass

    def _read(self):
        try:
            for text in self._in:
                line = json.loads(text)
                answers = self._answers.get(line["id"])
                if answers:
                    answers.put(line)
        except (OSError, ValueError):
            pass
        with self._lock:
            self._gone = True
            for answers in list(self._answers.values()):
                answers.put(None)
