# SPDX-License-Identifier: Apache-2.0
"""Arrays exchanged with the worker in shared memory files: .safetensors (github.com/huggingface/safetensors).

The files are in folders of this process (mode 700): in /dev/shm or, if there is too little room, in the folder for
temporary files.
"""

import atexit
import ctypes
import fcntl
import json
import mmap
import os
import shutil
import tempfile
import threading
import time
import weakref

import numpy as np

from . import _worker
from ._error import Error

TYPES = {
    "BOOL": "?", "U8": "u1", "I8": "i1", "U16": "<u2", "I16": "<i2", "F16": "<f2", "U32": "<u4", "I32": "<i4",
    "F32": "<f4", "U64": "<u8", "I64": "<i8", "F64": "<f8",
}  # fmt: skip
_NAMES = {np.dtype(text): name for name, text in TYPES.items()}

_SHARED = "/dev/shm"
_LEAST_SHARED = 256 << 20  # free bytes

_libc = ctypes.CDLL(None, use_errno=True)
_libc.mmap.restype = ctypes.c_void_p
_libc.mmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int, ctypes.c_int, ctypes.c_int, ctypes.c_long]
_libc.munmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t]
_FAILED = ctypes.c_void_p(-1).value


def parse(data):
    """Returns (arrays, metadata) from a file's bytes. The arrays are views of the bytes."""
    length = int.from_bytes(data[:8].tobytes(), "little")
    header = json.loads(data[8 : 8 + length].tobytes().decode())
    metadata = header.pop("__metadata__", {})
    arrays = {}
    for name, entry in header.items():
        begin, end = entry["data_offsets"]
        dtype, shape = np.dtype(TYPES[entry["dtype"]]), entry["shape"]
        if begin == end:
            arrays[name] = np.empty(shape, dtype)
        else:
            arrays[name] = data[8 + length + begin : 8 + length + end].view(dtype).reshape(shape)
    return arrays, metadata


class _Map:
    """A memory-mapped file. Unlike Python's mmap, keeps no file descriptor open while arrays exist."""

    def __init__(self, file):
        size = os.fstat(file.fileno()).st_size
        protection = mmap.PROT_READ | mmap.PROT_WRITE
        # Private: forked processes do not see each other's changes.
        address = _libc.mmap(None, size, protection, mmap.MAP_PRIVATE, file.fileno(), 0)
        if address == _FAILED:
            raise Error("memory", f"cannot map the arrays: {os.strerror(ctypes.get_errno())}")
        self.__array_interface__ = {"version": 3, "typestr": "|u1", "shape": (size,), "data": (address, False)}
        weakref.finalize(self, _libc.munmap, address, size).atexit = False  # arrays may exist until the end


def mapped(path):
    """Returns the bytes of a shared memory file, which stay valid after the file is removed."""
    with open(path, "rb") as file:
        return np.asarray(_Map(file))


def write(path, arrays, metadata=None):
    """Writes arrays to a file of mode 600."""
    header, at = {}, 0
    if metadata:
        header["__metadata__"] = metadata
    ordered = []
    for name, array in sorted(arrays.items(), key=lambda item: -item[1].dtype.itemsize):
        array = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
        ordered.append(array)
        header[name] = {
            "dtype": _NAMES[array.dtype],
            "shape": list(np.shape(arrays[name])),
            "data_offsets": [at, at + array.nbytes],
        }
        at += array.nbytes
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o600), "wb", buffering=0) as file:
        for part in (len(text).to_bytes(8, "little"), text, *(a.reshape(-1).view(np.uint8) for a in ordered if a.size)):
            part = memoryview(part)
            while part:
                part = part[file.write(part) :]


_PREFIX = "peeler-python-"
_NEW = 60  # seconds

_folders = {}  # folders of this process, by parent folder
_locks = []  # their file descriptors; locked to show other processes that they are in use
_numbers = iter(range(1 << 62))
_lock = threading.Lock()


def _is_roomy():
    try:
        state = os.statvfs(_SHARED)
        return os.access(_SHARED, os.W_OK | os.X_OK) and state.f_bavail * state.f_frsize >= _LEAST_SHARED
    except OSError:
        return False


def _sweep(above):
    """Removes folders of this user whose processes were killed."""
    for entry in os.scandir(above):
        try:
            state = entry.stat(follow_symlinks=False)
            is_old = time.time() - state.st_mtime > _NEW
            if not (entry.name.startswith(_PREFIX) and entry.is_dir(follow_symlinks=False)):
                continue
            if state.st_uid != os.geteuid() or not is_old:
                continue
            folder = os.open(entry.path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
            try:
                fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(entry.path, ignore_errors=True)
            finally:
                os.close(folder)
        except OSError:
            pass  # in use, or already removed


def _make(above):
    _sweep(above)
    folder = tempfile.mkdtemp(prefix=_PREFIX, dir=above)
    lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    _locks.append(lock)
    return folder


def place(name=None, shared=True):
    """Returns a path for a new file. A file with a given name gets its own folder."""
    above = _SHARED if shared and _is_roomy() else tempfile.gettempdir()
    with _lock:
        if above not in _folders:
            _folders[above] = _make(above)
        number = next(_numbers)
    path = os.path.join(_folders[above], str(number))
    if name is None:
        return path + ".safetensors"
    os.mkdir(path, 0o700)
    return os.path.join(path, name)


def remove(path):
    """Removes a file that place() named, and its own folder."""
    try:
        os.unlink(path)
        if os.path.dirname(path) not in _folders.values():
            os.rmdir(os.path.dirname(path))
    except OSError:
        pass


def _clean():
    for folder in _folders.values():
        shutil.rmtree(folder, ignore_errors=True)
    _forget()


def _forget():
    _folders.clear()
    while _locks:
        os.close(_locks.pop())


def _after_fork():
    global _lock
    _lock = threading.Lock()
    _forget()  # they belong to the parent process


atexit.register(_clean)
os.register_at_fork(after_in_child=_after_fork)


def run(verb, arguments, output="--output", **keywords):
    """Runs a verb. Returns its result and the bytes of the arrays that it wrote."""
    for shared in (True, False):
        path = place(shared=shared)
        try:
            result = _worker.run(verb, [*arguments, f"{output}={path}"], **keywords)
            return result, mapped(path)
        except Error as error:
            # Retries in the folder for temporary files, which may have more room than shared memory.
            if error.kind != "output" or not shared or not path.startswith(_SHARED):
                raise
        finally:
            remove(path)
    raise AssertionError
