# SPDX-License-Identifier: Apache-2.0
"""Tests examples/Dockerfile: checks it without a build and, with PEELER_TEST_ALL, runs all of it in fresh roots that
debootstrap makes in memory (which takes minutes)."""

import glob
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import debian
import dockerfile
from peeler_command import EXAMPLES, PEELER, SOURCE, PeelerTest, main, peeler

ALL = bool(os.environ.get("PEELER_TEST_ALL"))
FILE = EXAMPLES / "Dockerfile"
SUITE = "bookworm"  # debian:12, on any machine


def installed_packages():
    """Returns {package: the packages that it depends on} for this machine."""
    done = subprocess.run(
        ["dpkg-query", "-W", "-f", "${Package}\t${Pre-Depends}, ${Depends}\n"],
        text=True,
        capture_output=True,
        check=True,
    )
    rows = (line.split("\t") for line in done.stdout.splitlines())
    name = r"(?:^|[,|]) *([a-z0-9][a-z0-9.+-]*)"
    return {package: re.findall(name, needs) for package, needs in rows}


def with_dependencies(packages, needs):
    found, todo = set(), list(packages)
    while todo:
        package = todo.pop()
        if package in needs and package not in found:
            found.add(package)
            todo += needs[package]
    return found


def libraries(program):
    """Returns the libraries that the dynamic linker loads for the program, except those of sanitizers."""
    done = subprocess.run(["ldd", program], text=True, capture_output=True, check=True)
    files = re.findall(r"=> (/\S+)", done.stdout)
    return {file for file in files if not re.search(r"lib[a-z]+san\.so", file)}


def packages_of(files):
    """Returns {file: its package}, for the files that belong to a package."""
    known_as = {}  # /lib is a link to /usr/lib, and some files are links to one of several alternatives
    for file in files:
        for name in (file, f"/usr{file}", file.removeprefix("/usr"), os.path.realpath(file)):
            known_as[name] = file
    done = subprocess.run(["dpkg", "-S", *known_as], text=True, capture_output=True, check=False)
    rows = (line.split(": ", 1) for line in done.stdout.splitlines())
    return {known_as[name]: package.split(":")[0] for package, name in rows if name in known_as}


def replaceable(held):
    """Returns the packages that this machine has chosen among alternatives, if `held` contains another alternative."""
    packages = set()
    for link in glob.glob("/etc/alternatives/lib*.so*"):
        others = subprocess.run(
            ["update-alternatives", "--list", os.path.basename(link)],
            text=True,
            capture_output=True,
            check=True,
        ).stdout.split()
        if set(packages_of(others).values()) & held:
            packages |= set(packages_of([os.path.realpath(link)]).values())
    return packages


class Parts(PeelerTest):
    """Checks the instructions against this repository and the files built here."""

    @classmethod
    def setUpClass(cls):
        cls.stages = dict(dockerfile.plans(FILE))  # also proves that all instructions are known
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        cls.scratch = pathlib.Path(scratch.name)
        cls.program = shutil.which(PEELER)
        cls.build = str(pathlib.Path(cls.program).resolve().parent)

    def texts(self, stage, instruction):
        return [text for _, name, text in self.stages[stage] if name == instruction]

    def shell(self, text):
        done = subprocess.run(
            ["sh", "-c", text],
            cwd=self.scratch / "source",
            text=True,
            check=False,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        self.assertEqual(done.returncode, 0, f"{text}\n{done.stdout[-3000:]}")
        return done.stdout

    def test_stages(self):
        self.assertEqual(list(self.stages), ["build", "1"])
        self.assertEqual(self.texts("1", "ENTRYPOINT"), ['["peeler"]'])
        self.assertEqual(self.texts("1", "WORKDIR"), ["/work"])

    def test_what_is_copied_is_enough_to_build(self):
        """Runs the Dockerfile's own commands in other folders, except for the compilation."""
        source, made = self.scratch / "source", self.scratch / "made"
        for text in self.texts("build", "COPY"):
            stage, names, target = dockerfile.copied(text)
            self.assertIsNone(stage)
            for name in names:
                to = os.path.normpath(source / target)
                self.assertTrue(dockerfile.copy(str(SOURCE / name), to, target), text)
        configure, build, install = (
            text for text in self.texts("build", "RUN") if text.startswith("cmake ")
        )
        self.shell(configure.replace("/build", str(made)))
        self.assertEqual(build, "cmake --build /build")
        self.assertRegex((made / "build.ninja").read_text(encoding="utf-8"), "(?m)^build peeler: ")
        for file in source.rglob("*"):
            if file.suffix not in (".cpp", ".h"):
                continue
            for name in re.findall(r'(?m)^#include "(.+)"', file.read_text(encoding="utf-8")):
                self.assertTrue((source / name).exists(), f"{file} needs {name}")

        # Install this build's program, and all files that the other stage copies.
        prefix = str(self.scratch / "usr" / "local")
        shutil.copy(self.program, made / "peeler")
        shutil.copytree(f"{self.build}/lib/peeler", made / "lib" / "peeler", dirs_exist_ok=True)
        self.shell(install.replace("/build", str(made)).replace("/usr/local", prefix))
        taken = set()
        for text in self.texts("1", "COPY"):
            stage, names, _ = dockerfile.copied(text)
            if stage == "build":
                taken |= {self.scratch / name.lstrip("/") for name in names}
            else:
                for name in names:
                    self.assertTrue((SOURCE / name).exists(), text)
        self.assertEqual([path for path in taken if not path.exists()], [])
        files = [file for file in pathlib.Path(prefix).rglob("*") if file.is_file()]
        for file in files:
            self.assertTrue(taken & {file, *file.parents}, f"{file} is left behind")
        self.assertRegex(self.shell(f"{prefix}/bin/peeler --version"), "^peeler ")

    def test_packages(self):
        script = (EXAMPLES / "install_dependencies.sh").read_text(encoding="utf-8")
        sets = {
            name: set(packages.split())
            for name, packages in re.findall(r'^(\w+)="([^"]*)"', script, re.M)
        }
        commands = {stage: " && ".join(self.texts(stage, "RUN")) for stage in self.stages}
        self.assertIn("install_dependencies.sh build ", commands["build"])
        self.assertRegex(commands["1"], r"install_dependencies\.sh +&& ", "no set: what runs")
        named = re.search(r"apt-get install -y -qq --no-install-recommends ([^&]*)", commands["1"])
        named = set(named[1].split())
        if debian.suite() != SUITE:
            self.skipTest("this machine is no Debian 12, whose libraries have other names")
        needs = installed_packages()
        self.assertEqual(named - needs.keys(), set(), "not installed with the set `build`")
        programs = (self.program, *pathlib.Path(self.build, "lib", "peeler").iterdir())
        loaded = set().union(*map(libraries, programs))
        used = packages_of(loaded)
        self.assertEqual(loaded - used.keys(), set(), "of no package")
        held = with_dependencies(named | sets["run"], needs)
        elsewhere = set(used.values()) - held
        self.assertEqual(elsewhere - replaceable(held), set(), "not installed in the image")
        self.assertEqual(named - set(used.values()), set(), "named for nothing")


@unittest.skipUnless(ALL, "carried out only with PEELER_TEST_ALL: debootstrap, compile, render")
class Dockerfile(debian.RootsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.base = f"{cls.scratch}/base"
        mirror = debian.make_root(SUITE, cls.base)
        cls.say(f"a root of {mirror}")

    def announce(self, _, command):
        self.say(f"runs {' '.join(command.split())[:80]}")

    def test_build_and_render(self):
        builder = dockerfile.Builder(self.base, str(SOURCE), self.scratch, self.announce)
        image = builder.build(FILE)
        self.say(f"built; {shutil.disk_usage(self.scratch).used / 1e9:.1f} GB")

        # Run the program as in the example at the top of the Dockerfile, and as with `docker run --user`.
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

        outside = f"{self.scratch}/outside.exr"
        self.render(f"{image.root}/work/scene.glb", "-o", outside, *osmesa)
        done = peeler("compare", f"{image.root}/work/osmesa.exr", outside)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.say("renders the same layers inside and outside")


if __name__ == "__main__":
    if not ALL:
        sys.exit(main())
    debian.in_own_machine("container", main, SUITE, Dockerfile.NEEDED)
