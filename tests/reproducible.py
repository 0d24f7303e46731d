# SPDX-License-Identifier: Apache-2.0
"""Tests that builds are reproducible: builds the preset `release` twice under different conditions (ROWS), installs and
packs both, and compares every file.

    python3 tests/reproducible.py SOURCE_FOLDER BUILD_FOLDER

If a file differs, prints the place and exits with 1; if diffoscope is installed, prints the difference.
"""

import collections
import hashlib
import os
import pathlib
import shutil
import subprocess
import sys
import time

Circumstances = collections.namedtuple(
    "Circumstances", "folder jobs umask host clock variables reverse"
)
ROWS = (
    Circumstances("a", 2, 0o022, "first", None, {"LC_ALL": "C", "TZ": "UTC", "USER": "root"}, False),
    # Turkish has a dotted and a dotless I, so upper and lower case differ from English.
    Circumstances("another/folder/with/a/longer/name", 1, 0o077, "the-second-machine", "+400d",
                  {"LC_ALL": "tr_TR.UTF-8", "TZ": "Asia/Kathmandu", "USER": "somebody"}, True),
)  # fmt: skip
KEPT = ("PATH", "CC", "CXX")  # environment variables; the others, such as flags and compiler caches, are dropped


def run(command, **options):
    done = subprocess.run(
        list(map(str, command)),
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        check=False,
        errors="replace",
        **options,
    )
    if done.returncode != 0:
        sys.exit(f"{done.stdout[-5000:]}\nexit code {done.returncode}: {command}")
    return done.stdout


def make_locale(folder, name):
    """Builds a locale in that folder, because Debian installs none by default. Returns whether it exists."""
    folder.mkdir()
    language, _, encoding = name.partition(".")
    if shutil.which("localedef"):
        command = ["localedef", "-i", language, "-f", encoding, str(folder / name)]
        subprocess.run(command, capture_output=True, check=False)
    return (folder / name).is_dir()


def copy_sources(source, target, reverse):
    """Copies the tracked files, with new times and, if `reverse`, in reverse order."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=source, capture_output=True, check=True)
    names = sorted(filter(None, listed.stdout.decode().split("\0")), reverse=reverse)
    for name in names:
        copy = target / name
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source / name, copy)
        if reverse:
            os.utime(copy, (10**9, 10**9))


def ways(row, folder, date):
    """Returns the prefix of commands and the environment for these conditions."""
    environment = {name: os.environ[name] for name in KEPT if name in os.environ}
    environment |= row.variables | {"HOME": str(folder / "home"), "CCACHE_DISABLE": "1"}
    environment["SOURCE_DATE_EPOCH"] = date
    if row.variables["LC_ALL"] != "C":
        if make_locale(folder / "locales", row.variables["LC_ALL"]):
            environment["LOCPATH"] = str(folder / "locales")
        else:
            print("left out: a Turkish locale, localedef does not make it (Debian's package locales)")
            environment["LC_ALL"] = "C.UTF-8"
    prefix = []
    if os.geteuid() == 0:
        named = f'hostname {row.host} && exec "$@"'
        prefix += ["unshare", "--uts", "sh", "-c", named, "sh"]
    else:
        print("left out: another host name, which needs root")
    if row.clock and shutil.which("faketime"):
        # File times remain real, because ninja needs them.
        environment["NO_FAKE_STAT"] = "1"
        prefix += ["faketime", "-f", row.clock]
    elif row.clock:
        print("left out: another date, no faketime")
    return prefix, environment


def build(folder, row, date):
    """Returns {name: path} for everything that is installed or packed."""
    (folder / "home").mkdir()
    prefix, environment = ways(row, folder, date)
    binary = folder / "source" / "build" / "release"
    for command in (
        ("cmake", "--preset", "release", "-DPEELER_BUILD_TESTS=OFF"),
        ("cmake", "--build", binary, "-j", row.jobs),
        ("cmake", "--build", binary, "--target", "packages", "-j", row.jobs),
        ("cmake", "--install", binary, "--prefix", folder / "installed"),
    ):
        started = time.monotonic()
        run([*prefix, *command], cwd=folder / "source", env=environment, umask=row.umask)
        print(f"{time.monotonic() - started:6.1f} s  {' '.join(map(str, command))}", flush=True)
    return {
        str(path.relative_to(root)): path
        for root in (folder / "installed", binary / "packages")
        for path in sorted(root.rglob("*"))
        if path.is_symlink() or path.is_file()
    }


def fingerprint(path):
    """Returns the compared properties of a file: its content, and whether it is executable."""
    if path.is_symlink():
        return os.readlink(path)
    return hashlib.sha256(path.read_bytes()).hexdigest(), path.stat().st_mode & 0o111 != 0


def tell_difference(name, a, b):
    if a.is_symlink() or b.is_symlink():
        print(f"{name}: a link to {fingerprint(a)} and to {fingerprint(b)}")
        return
    first, second = a.read_bytes(), b.read_bytes()
    pairs = enumerate(zip(first, second))
    at = next((i for i, (x, y) in pairs if x != y), min(len(first), len(second)))
    print(f"{name}: {len(first)} and {len(second)} bytes, which differ from byte {at} on")
    for data in (first, second):
        print(f"    {data[max(0, at - 32) : at + 96]!r}")
    if shutil.which("diffoscope"):
        command = ["diffoscope", "--max-text-report-size", "20000", str(a), str(b)]
        subprocess.run(command, check=False)


def compare(first, second):
    """Returns the number of files that differ, or that only one build has."""
    differing = sorted(first.keys() ^ second.keys())
    for name in differing:
        print(f"{name}: made once only")
    for name in sorted(first.keys() & second.keys()):
        if fingerprint(first[name]) != fingerprint(second[name]):
            tell_difference(name, first[name], second[name])
            differing.append(name)
    return len(differing)


def main():
    source, folder = (pathlib.Path(path).resolve() for path in sys.argv[1:])
    shutil.rmtree(folder, ignore_errors=True)
    for row in ROWS:  # both at once, because the sources may change during a build
        copy_sources(source, folder / row.folder / "source", row.reverse)
    # The copies are not repositories, so the commit date is read here.
    asked = subprocess.run(["git", "log", "-1", "--format=%ct"], cwd=source, capture_output=True, check=True)
    first, second = (build(folder / row.folder, row, asked.stdout.decode().strip()) for row in ROWS)
    differing = compare(first, second)
    print(f"{len(first)} files, {differing} differ")
    if not differing:
        shutil.rmtree(folder)
    return 1 if differing or not first else 0


if __name__ == "__main__":
    sys.exit(main())
