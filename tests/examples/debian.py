# SPDX-License-Identifier: Apache-2.0
"""Fresh Debian root folders, made by debootstrap from this machine's package sources."""

import os
import pathlib
import shutil
import subprocess
import sys
import time
import urllib.request

import own_machine
from peeler_command import SOURCE, PeelerTest, skip

PATH = os.environ["PATH"] + ":/usr/sbin:/sbin"


def sources():
    """Returns [(address, suite)] for the package sources of this Debian; a suite looks like "bookworm-security"."""
    form = "$(REPO_URI) $(RELEASE) $(COMPONENT) $(ORIGIN)"
    done = subprocess.run(
        ["apt-get", "indextargets", "--format", form, "Created-By: Packages"],
        text=True,
        capture_output=True,
        check=False,
    )
    rows = [line.split() for line in done.stdout.splitlines()]
    return [(row[0], row[1]) for row in rows if len(row) == 4 and row[2:] == ["main", "Debian"]]


def suite():
    """Returns the name of this machine's Debian release; "" on other systems."""
    names = [name for _, name in sources() if "-" not in name]
    return names[0] if names else ""


def sources_of(name):
    """Returns the same sources for another release."""
    return [(address, known.replace(suite(), name, 1)) for address, known in sources()]


def mirror_of(name):
    return next((address for address, known in sources_of(name) if known == name), None)


def impediment(name, memory):
    """Returns the reason why a root of that release, with `memory` bytes, cannot be made here; nothing if it can."""
    if not shutil.which("debootstrap", path=PATH):
        return "no debootstrap (examples/install_dependencies.sh test)"
    mirror = mirror_of(name)
    if not mirror:
        return "this machine does not install from Debian"
    try:
        urllib.request.urlopen(f"{mirror}dists/{name}/InRelease", timeout=60).close()
    except (OSError, ValueError) as error:
        return f"the mirror {mirror} cannot be reached: {error}"
    with open("/proc/meminfo", encoding="ascii") as lines:
        available = next(int(line.split()[1]) * 1024 for line in lines if "MemAvailable" in line)
    if available < memory:
        return f"too little memory, {available / 1e9:.1f} of {memory / 1e9:.0f} GB"
    return None


def make_root(name, folder):
    """Makes a root folder, and returns the address of the mirror used. Raises RuntimeError."""
    mirror = mirror_of(name)
    scripts = pathlib.Path("/usr/share/debootstrap/scripts")
    # A release that is newer than debootstrap is made like all newer ones.
    script = [] if (scripts / name).exists() else [scripts / "sid"]
    done = subprocess.run(
        ["debootstrap", "--variant=minbase", name, folder, mirror, *script],
        text=True,
        check=False,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env={**os.environ, "PATH": PATH},
    )
    if done.returncode != 0:
        raise RuntimeError(f"debootstrap: {done.stdout[-2000:]}")
    pathlib.Path(folder, "etc/apt/sources.list").write_text(
        "".join(f"deb {address} {known} main\n" for address, known in sources_of(name)),
        encoding="ascii",
    )
    # A mirror's copy of a release that still changes may be older than a week.
    pathlib.Path(folder, "etc/apt/apt.conf.d/valid").write_text(
        'Acquire::Check-Valid-Until "false";\n', encoding="ascii"
    )
    return mirror


def unpack_root(name, folder, architecture, packages):
    """Makes a root folder for another architecture, with these packages and all that they depend on. None of its
    programs has run, so nothing is configured. Raises RuntimeError."""
    done = subprocess.run(
        ["debootstrap", "--foreign", f"--arch={architecture}", "--variant=minbase", f"--include={','.join(packages)}",
         name, folder, mirror_of(name)],
        text=True,
        check=False,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env={**os.environ, "PATH": PATH},
    )  # fmt: skip
    if done.returncode != 0:
        raise RuntimeError(f"debootstrap: {done.stdout[-2000:]}")
    # The first stage of debootstrap only downloads packages that are not essential.
    for package in pathlib.Path(folder, "var/cache/apt/archives").glob("*.deb"):
        packed = subprocess.run(["dpkg-deb", "--fsys-tarfile", package], stdout=subprocess.PIPE, check=True)
        subprocess.run(["tar", "-C", folder, "-x", "--keep-directory-symlink"], input=packed.stdout, check=True)
        package.unlink()
    proc = pathlib.Path(folder, "proc")
    if proc.is_symlink():
        proc.unlink()
        proc.mkdir()


def copy_sources(root):
    """Copies the tracked files to the folder /peeler of a root."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=SOURCE, capture_output=True, check=True)
    for name in filter(None, listed.stdout.decode().split("\0")):
        target = pathlib.Path(root, "peeler", name)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(SOURCE / name, target)


class RootsTest(PeelerTest):
    """A test case with NEEDED bytes of memory in the folder `scratch`, for roots."""

    NEEDED = 8e9

    @classmethod
    def setUpClass(cls):
        cls.started = time.monotonic()
        cls.scratch = own_machine.SCRATCH
        own_machine.mount("none", cls.scratch, "tmpfs", data=f"size={int(cls.NEEDED)}")

    @classmethod
    def say(cls, what):
        print(f"{time.monotonic() - cls.started:6.1f} s  {what}", flush=True)


def in_own_machine(host_name, body, suite_name, memory):
    """Runs `body` on a virtual machine and exits with its result, if roots of this many bytes of memory can be made;
    otherwise prints why it is skipped."""
    reason = impediment(suite_name, memory) or own_machine.impediment()
    if reason:
        skip(reason)
    sys.exit(own_machine.run(host_name, body, network=False))
