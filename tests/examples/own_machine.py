# SPDX-License-Identifier: Apache-2.0
"""Runs a test on a virtual machine: with processes, network, host name and mounts of its own.

The test's daemons see no other processes, and none of their processes or files outlive the test: when the first process
of a PID namespace ends, for any reason, the kernel ends all the others, and a tmpfs disappears with the last process of
its mount namespace (namespaces(7), pid_namespaces(7)). Needs root on Linux.
"""

import ctypes
import fcntl
import os
import signal
import socket
import struct
import sys

# Constants from linux/sched.h, linux/mount.h, linux/prctl.h, linux/sockios.h and linux/if.h.
CLONE_NEWNS, CLONE_NEWUTS, CLONE_NEWIPC = 0x00020000, 0x04000000, 0x08000000
CLONE_NEWPID, CLONE_NEWNET = 0x20000000, 0x40000000
MS_BIND, MS_REC, MS_PRIVATE = 0x1000, 0x4000, 0x40000
PR_SET_PDEATHSIG = 1
SIOCSIFADDR, SIOCGIFFLAGS, SIOCSIFFLAGS, IFF_UP = 0x8916, 0x8913, 0x8914, 1

# A folder that exists on every Linux. The test mounts its own tmpfs there.
SCRATCH = "/dev/shm"

# An additional address. Slurm calls getaddrinfo() with AI_ADDRCONFIG, which finds no address on a machine that has only
# 127.0.0.1.
ADDRESS = "10.0.0.1"

libc = ctypes.CDLL(None, use_errno=True)


def check(result):
    if result != 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


def bring_up_loopback():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        flags = struct.pack("16sh14x", b"lo", 0)
        flags = struct.unpack("16sh14x", fcntl.ioctl(any_socket, SIOCGIFFLAGS, flags))[1]
        fcntl.ioctl(any_socket, SIOCSIFFLAGS, struct.pack("16sh14x", b"lo", flags | IFF_UP))
        address = struct.pack("HH4s8x", socket.AF_INET, 0, socket.inet_aton(ADDRESS))
        fcntl.ioctl(any_socket, SIOCSIFADDR, struct.pack("16s16s", b"lo:0", address))


def mount(source, target, kind, flags=0, data=""):
    check(libc.mount(source.encode(), target.encode(), kind.encode(), flags, data.encode()))


def impediment():
    """Returns the reason why run() would fail here; nothing if it would succeed."""
    if os.geteuid() != 0:
        return "namespaces need root"
    child = os.fork()
    if child == 0:
        code = 1
        try:
            code = run("test", lambda: 0)
        except OSError as error:
            print(error)
        finally:
            sys.stdout.flush()
            os._exit(code)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return "this machine does not let root make namespaces" if code else None


def run(host_name, body, network=True):
    """Returns the result of body() (an exit code), run on the machine `host_name`; without `network`, that machine
    shares this machine's network. SIGTERM to this process ends everything at once, with 143. May be called only once
    per process, which cannot start other processes afterwards. Raises OSError if namespaces are not permitted."""
    check(
        libc.unshare(
            CLONE_NEWNS
            | CLONE_NEWUTS
            | CLONE_NEWIPC
            | CLONE_NEWPID
            | (CLONE_NEWNET if network else 0)
        )
    )
    first = os.fork()
    if first == 0:
        code = 1
        try:
            libc.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
            mount("none", "/", "none", MS_REC | MS_PRIVATE)
            mount("proc", "/proc", "proc")
            mount("none", SCRATCH, "tmpfs")
            socket.sethostname(host_name)
            if network:
                bring_up_loopback()
            code = body()
        except BaseException:  # in any case, this process must not continue as a second test
            sys.excepthook(*sys.exc_info())
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)

    def end(number, _):
        os.kill(first, signal.SIGKILL)
        os.waitpid(first, 0)
        os._exit(128 + number)

    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, end)
    return os.waitstatus_to_exitcode(os.waitpid(first, 0)[1])
