# SPDX-License-Identifier: Apache-2.0
"""Tests the cleanup of own_machine: no process or file of a test remains, however the test ends."""

import os
import pathlib
import signal
import subprocess
import sys
import time

import own_machine
from peeler_command import PeelerTest, main, skip

# A test that starts an orphaned daemon, and writes a file to the virtual machine's memory.
TEST = """
import os, subprocess, time, own_machine
def body():
    subprocess.Popen(["setsid", "sleep", "{seconds}"])
    open(own_machine.SCRATCH + "/{seconds}", "w").close()
    processes = [entry for entry in os.listdir("/proc") if entry.isdigit()]
    print("ready", os.uname().nodename, len(processes), flush=True)
    {end}
print(own_machine.run("elsewhere", body), flush=True)
"""


def running(word):
    """Returns whether a running process has this argument."""
    for entry in os.listdir("/proc"):
        try:
            if word.encode() in pathlib.Path("/proc", entry, "cmdline").read_bytes().split(b"\0"):
                return True
        except OSError:
            pass
    return False


class OwnMachine(PeelerTest):
    def start(self, seconds, end):
        child = subprocess.Popen(
            [sys.executable, "-c", TEST.format(seconds=seconds, end=end)],
            stdout=subprocess.PIPE,
            text=True,
            cwd=pathlib.Path(__file__).parent,
        )
        self.addCleanup(child.stdout.close)
        self.addCleanup(child.kill)
        ready = child.stdout.readline().split()
        self.assertEqual(ready[:2], ["ready", "elsewhere"])
        self.assertLessEqual(int(ready[2]), 3, "it sees no processes but its own")
        return child

    def assert_runs(self, seconds):
        end = time.monotonic() + 300  # the process may not have executed the program yet
        while not running(str(seconds)):  # once suffices: execve() empties the list of arguments for a moment
            self.assertLess(time.monotonic(), end)
            time.sleep(0.02)

    def assert_gone(self, seconds):
        end = time.monotonic() + 300  # the kernel needs a moment, longer on a busy machine
        while running(str(seconds)) and time.monotonic() < end:
            time.sleep(0.02)
        self.assertFalse(running(str(seconds)))
        self.assertFalse(os.path.exists(f"{own_machine.SCRATCH}/{seconds}"))
        self.assertNotEqual(os.uname().nodename, "elsewhere")

    def test_it_ends(self):
        child = self.start(31415, "return 3")
        self.assertEqual(child.stdout.read(), "3\n")
        child.wait()
        self.assert_gone(31415)

    def test_it_is_ended(self):
        for number, seconds in ((signal.SIGTERM, 31416), (signal.SIGKILL, 31417)):
            child = self.start(seconds, "time.sleep(60)")
            self.assert_runs(seconds)
            child.send_signal(number)
            code = child.wait()
            self.assertEqual(code, 128 + number if number == signal.SIGTERM else -number)
            self.assert_gone(seconds)


if __name__ == "__main__":
    reason = own_machine.impediment()
    if reason:
        skip(reason)
    sys.exit(main())
