# SPDX-License-Identifier: Apache-2.0
"""The worker of this process: `peeler worker`, started on first use.

The worker runs in a session of its own, so Ctrl-C reaches only this process, which cancels the job. A forked process
starts its own worker. The worker ends with this process, or when the last Renderer is closed.
"""

import atexit
import contextvars
import itertools
import json
import os
import queue
import shutil
import signal
import socket
import subprocess
import sys
import threading
import warnings

from . import _options
from ._error import Error

_PACKAGE = os.path.dirname(os.path.abspath(__file__))
_PROTOCOL = 1
_AT_A_TIME = 2  # concurrent jobs; each may use all processors
_PATIENCE = 0.2  # seconds to wait until a cancelled job ends


def _program():
    """Returns $PEELER, the program that was built or installed with this package, or the one in the path."""
    named = os.environ.get("PEELER")
    if named:
        return named
    # In a wheel; in build/python/peeler; in PREFIX/lib/python3/dist-packages/peeler.
    for place in ("program/bin/peeler", "../../peeler", "../../../../bin/peeler"):
        program = os.path.normpath(os.path.join(_PACKAGE, place))
        if os.path.isfile(program) and os.access(program, os.X_OK):
            return program
    found = shutil.which("peeler")
    if not found:
        raise Error("usage", "cannot find the program peeler", "", "install it, or set $PEELER to its path")
    return found


class _Closed(Exception):
    """Raised if this process has closed the worker between two jobs. The job can run again."""


class _Worker:
    def __init__(self):
        program = _program()
        self.folder = _current_folder()
        self._socket, other = socket.socketpair()
        self._socket.settimeout(None)  # overrides the default timeout of this process
        try:
            self._process = subprocess.Popen(
                [program, "worker", f"--jobs={_AT_A_TIME}"], stdin=other, stdout=other, start_new_session=True
            )
        except OSError as error:
            self._socket.close()
            raise Error("usage", f"cannot start the program peeler: {error.strerror}", program,
                        "install it, or set $PEELER to its path") from None
        finally:
            other.close()
        self._ids, self._sending, self._answers = itertools.count(), threading.Lock(), {}
        self._lines = self._received()
        self.gone = self._closed = False
        try:
            hello = json.loads(next(self._lines, b"{}"))
            if hello.get("worker") != _PROTOCOL:
                raise Error("usage", "the program peeler and this module have different versions", program,
                            "install the same version of both, or set $PEELER to the program of this version")
            self._reader = threading.Thread(target=self._read, name="peeler", daemon=True)
            self._reader.start()
        except BaseException:
            self.gone = True
            self.close()
            raise

    def run(self, verb, arguments, progress):
        """Runs a job. Returns its result line. Ctrl-C or an exception in `progress` cancels the job."""
        answers, number, token = queue.SimpleQueue(), next(self._ids), _cancelling.get()
        self._answers[number] = answers
        job = {"id": number, "verb": verb, "args": arguments, "progress": progress is not None}
        done = False
        try:
            if token:
                token.begin(self, number)
            self._send(job)
            if self.gone:  # the reader may have ended before the answer was registered
                answers.put(None)
            while True:
                line = answers.get()
                if line is None:
                    done = True
                    raise self._ending()
                if "exitCode" in line:
                    done = True
                    return line
                if progress:
                    progress(line["progress"])
        finally:
            try:
                if not done:
                    self.cancel(number)
                    self._await_end(answers)
            finally:
                self._answers.pop(number, None)

    def _await_end(self, answers):
        """Waits until a cancelled job has removed its files."""
        try:
            while "exitCode" not in (answers.get(timeout=_PATIENCE) or {"exitCode": 0}):
                pass
        except queue.Empty:
            pass

    def cancel(self, number):
        self._send({"cancel": number})

    def _send(self, message):
        data, sent = json.dumps(message).encode() + b"\n", 0
        with self._sending:
            try:
                while sent < len(data):
                    sent += self._socket.send(data[sent:], socket.MSG_NOSIGNAL)
            except OSError:
                pass  # the reader will notice that the worker is gone
            except BaseException:
                if sent:  # the next line would begin with half a line
                    self._process.kill()
                raise

    def _received(self):
        """Yields the lines that the worker sends."""
        text = bytearray()
        while True:
            part = self._socket.recv(1 << 16)
            if not part:
                return
            text += part
            if b"\n" in part:
                *lines, rest = bytes(text).split(b"\n")
                text = bytearray(rest)
                yield from lines

    def _read(self):
        try:
            for text in self._lines:
                line = json.loads(text)
                answers = self._answers.get(line["id"])
                if answers:
                    answers.put(line)
        except (OSError, ValueError):
            pass
        self.gone = True
        for answers in list(self._answers.values()):
            answers.put(None)

    def _ending(self):
        """Returns an Error that says why the worker has ended."""
        if self._closed:
            return _Closed()
        try:
            code = self._process.wait(timeout=2)
        except subprocess.TimeoutExpired:
            code = None
        self.close()
        if code is None or code >= 0:
            what = "the worker no longer answers" if code is None else f"the worker ended with exit code {code}"
            return Error("internal", what, "", "the next call starts a new one")
        name = signal.strsignal(-code) if hasattr(signal, "strsignal") else ""
        return Error("internal", f"the worker was ended by signal {-code} ({name})", "",
                     "the system may have run out of memory; the next call starts a new one")

    def close(self):
        self.gone = self._closed = True
        try:
            self._socket.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
        if self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(timeout=2)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        reader = getattr(self, "_reader", None)
        if reader and reader is not threading.current_thread():
            reader.join(timeout=2)
        self._socket.close()

    def forget(self):
        """Leaves the worker to the parent of this forked process."""
        self._process.returncode = 0
        os.close(self._socket.detach())


_worker = None
_lock = threading.Lock()
_users = 0  # Renderers that are open


def _current_folder():
    try:
        return os.getcwd()
    except OSError:
        return None


def _get():
    global _worker
    with _lock:
        if not _worker or _worker.gone:
            if _worker:
                _worker.close()
            _worker = None
            _worker = _Worker()
        return _worker


def close():
    """Ends the worker; the next call starts another one."""
    global _worker
    with _lock:
        worker, _worker = _worker, None
    if worker:
        worker.close()


def open_user():
    """Counts a Renderer of this process."""
    global _users
    with _lock:
        _users += 1


def close_user(process):
    global _users
    if process != os.getpid():
        return
    with _lock:
        _users -= 1
        idle = _users == 0 and _worker and not _worker._answers
    if idle:
        close()


def _after_fork():
    global _worker, _lock, _users
    _lock, _users = threading.Lock(), 0
    worker, _worker = _worker, None
    if worker:
        worker.forget()


atexit.register(close)
os.register_at_fork(after_in_child=_after_fork)


def place(path):
    """Returns a file's name for the worker, which was perhaps started in another folder."""
    folder = _current_folder()
    if os.path.isabs(path) or folder is None or _get().folder == folder:
        return path
    return os.path.join(folder, path)


def file_argument(path):
    """Returns a file as an argument that is not taken for an option."""
    path = place(_options.path_of(path))
    return "./" + path if path.startswith("-") else path


class _Cancelling:
    """Cancels the job of a call from another thread."""

    def __init__(self):
        self.cancelled, self._job = False, None

    def begin(self, worker, number):
        self._job = (worker, number)
        if self.cancelled:
            raise Error("internal", "the job was cancelled")

    def cancel(self):
        self.cancelled = True
        if self._job:
            self._job[0].cancel(self._job[1])


_cancelling = contextvars.ContextVar("peeler", default=None)


async def aio(call, *arguments, **keywords):
    """Awaits a call of this module without blocking the event loop: await peeler.aio(r.layers, scene, size=(64, 36)).

    The call, and a `progress` callback, run in a thread of the loop's executor. Cancelling the task cancels the job.
    """
    import asyncio

    token = _Cancelling()
    context = contextvars.copy_context()
    context.run(_cancelling.set, token)
    future = asyncio.get_running_loop().run_in_executor(None, lambda: context.run(call, *arguments, **keywords))
    try:
        return await asyncio.shield(future)
    except asyncio.CancelledError:
        future.add_done_callback(lambda done: done.cancelled() or done.exception())
        future.cancel()
        token.cancel()
        raise


def warn(sentences):
    """Issues each sentence as a warning at the line that called this module."""
    if not sentences:
        return
    level, frame = 1, sys._getframe()
    while frame and os.path.dirname(os.path.abspath(frame.f_code.co_filename)) == _PACKAGE:
        level, frame = level + 1, frame.f_back
    for sentence in sentences:
        warnings.warn(sentence, UserWarning, stacklevel=level)


def error_of(line, names=()):
    """Returns the error of a result line."""
    error = line["error"]
    kind = error.get("kind", "internal")
    texts = [_options.in_keywords(error.get(key, ""), names) for key in ("what", "where", "hint")]
    return Error("internal" if kind in ("crash", "cancelled") else kind, *texts)


def run(verb, arguments, progress=None, known_warnings=(), names=()):
    """Runs a verb. Returns its result. Raises Error if there is no result.

    known_warnings: warnings that are not issued again; names: see in_keywords()
    """
    if progress is not None and not callable(progress):
        raise TypeError("progress must be callable; it is called with the share of the work that is done")
    if "threads" in _options.table(verb) and not any(a.startswith("--threads=") for a in arguments):
        arguments = [*arguments, "--threads=0"]  # all processors, not the share of one job
    try:
        line = _get().run(verb, arguments, progress)
    except _Closed:
        line = _get().run(verb, arguments, progress)
    if "error" in line and "result" not in line:
        raise error_of(line, names)
    sentences = [_options.in_keywords(sentence, names) for sentence in line.get("warnings", ())]
    warn([sentence for sentence in sentences if sentence not in known_warnings])
    return line.get("result")
