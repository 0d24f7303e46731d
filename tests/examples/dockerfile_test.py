# SPDX-License-Identifier: Apache-2.0
"""examples/Dockerfile, carried out in fresh roots that debootstrap makes, in memory.

Compiling takes many minutes, so that by default the program is the one that is tested here, and the
rest is done. PEELER_TEST_DOCKERFILE=full leaves nothing out."""

import os
import pathlib
import shutil
import subprocess
import sys
import time
import urllib.request

import dockerfile
import own_machine
from peeler_command import EXAMPLES, PEELER, SOURCE, PeelerTest, main, peeler, skip

FULL = os.environ.get("PEELER_TEST_DOCKERFILE") == "full"
NEEDED = 8e9 if FULL else 5e9  # bytes of memory
SUITE = "bookworm"  # debian:12


def mirrors():
    """[(address, suite)] of Debian 12 that this machine installs from."""
    done = subprocess.run(
        [
            "apt-get",
            "indextargets",
            "--format",
            "$(REPO_URI) $(RELEASE) $(COMPONENT) $(ORIGIN)",
            "Created-By: Packages",
        ],
        text=True,
        capture_output=True,
        check=False,
    )
    rows = [line.split() for line in done.stdout.splitlines()]
    return [
        (row[0], row[1])
        for row in rows
        if len(row) == 4 and row[1].split("-")[0] == SUITE and row[2:] == ["main", "Debian"]
    ]


def impediment():
    """Why it cannot be done here; nothing if it can."""
    if not shutil.which("debootstrap", path=os.environ["PATH"] + ":/usr/sbin"):
        return "no debootstrap (examples/install_dependencies.sh test)"
    base = [address for address, suite in mirrors() if suite == SUITE]
    if not base:
        return "this machine does not install from Debian 12"
    try:
        urllib.request.urlopen(f"{base[0]}dists/{SUITE}/InRelease", timeout=20).close()
    except (OSError, ValueError) as error:
        return f"the mirror {base[0]} cannot be reached: {error}"
    with open("/proc/meminfo", encoding="ascii") as lines:
        available = next(int(line.split()[1]) * 1024 for line in lines if "MemAvailable" in line)
    if available < NEEDED:
        return f"too little memory, {available / 1e9:.1f} of {NEEDED / 1e9:.0f} GB"
    return own_machine.impediment()


class Dockerfile(PeelerTest):
    @classmethod
    def setUpClass(cls):
        cls.started = time.monotonic()
        cls.scratch = own_machine.SCRATCH
        own_machine.mount("none", cls.scratch, "tmpfs", data=f"size={int(NEEDED)}")
        cls.base = f"{cls.scratch}/base"
        sources = mirrors()
        mirror = next(address for address, suite in sources if suite == SUITE)
        done = subprocess.run(
            ["debootstrap", "--variant=minbase", SUITE, cls.base, mirror],
            text=True,
            check=False,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env={**os.environ, "PATH": os.environ["PATH"] + ":/usr/sbin:/sbin"},
        )
        if done.returncode != 0:
            raise RuntimeError(f"debootstrap: {done.stdout[-2000:]}")
        pathlib.Path(cls.base, "etc/apt/sources.list").write_text(
            "".join(f"deb {address} {suite} main\n" for address, suite in sources), encoding="ascii"
        )
        cls.say(f"a root of {mirror}")

    @classmethod
    def say(cls, what):
        print(f"{time.monotonic() - cls.started:6.1f} s  {what}", flush=True)

    def instead(self, stage, command):
        """What takes minutes, and what needs its result."""
        if FULL or not command.startswith(("cmake --build", "cmake --install")):
            self.say(f"runs {' '.join(command.split())[:80]}")
            return False
        if command.startswith("cmake --install"):
            shutil.copy(PEELER, f"{stage.root}/usr/local/bin/peeler")
            modules = pathlib.Path(PEELER).parent / "lib" / "peeler"
            shutil.copytree(modules, f"{stage.root}/usr/local/lib/peeler")
        self.say(f"does NOT run {command[:80]}")
        return True

    def test_build_and_render(self):
        builder = dockerfile.Builder(self.base, str(SOURCE), self.scratch, self.instead)
        image = builder.build(EXAMPLES / "Dockerfile")
        self.say(f"built; {shutil.disk_usage(self.scratch).used / 1e9:.1f} GB")

        # As `docker run --user` and the example at the top of the file do it.
        shutil.copy(EXAMPLES / "scenes" / "coincident.glb", f"{image.root}/work/scene.glb")
        os.chown(f"{image.root}/work", 65534, 65534)
        osmesa = ("--size", "320x180", "--backend", "osmesa")
        for arguments in (
            ("--version",),
            ("devices",),
            ("render", "scene.glb", "-o", "layers.exr"),
            ("render", "scene.glb", "-o", "osmesa.exr", *osmesa),
            ("render", "scene.glb", "-o", "picture.png"),
            ("verify", "layers.exr"),
        ):
            done = image.run([*builder.entrypoint, *arguments], user="65534:65534")
            self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("layers.exr: good, 6 layers", done.stdout)
        if not FULL:
            print("PEELER_TEST_DOCKERFILE=full compiles it as well")

        # The same picture as outside.
        outside = f"{self.scratch}/outside.exr"
        self.render(f"{image.root}/work/scene.glb", "-o", outside, *osmesa)
        done = peeler("compare", f"{image.root}/work/osmesa.exr", outside)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.say("renders the same layers inside and outside")


if __name__ == "__main__":
    reason = impediment()
    if reason:
        skip(reason)
    sys.exit(own_machine.run("container", main, network=False))
