# SPDX-License-Identifier: Apache-2.0
"""Tests the archive and the wheel (cmd/packages) with PEELER_TEST_ALL: what their files need, and how they work in
minimal roots of several Debian releases (packed.py), and in a root that has no C library at all."""

import collections
import json
import os
import pathlib
import re
import shutil
import sys

import debian
from packed import ALL, BUILD, MADE, MORE, NOBODY, RENDER, SCENE, PackedTest, run
from peeler_command import SOURCE, main, peeler

sys.path.insert(0, str(SOURCE / "tests"))
import threemf_package

# C libraries: 2.31, 2.36, 2.41 and newer; Pythons: 3.9, 3.11, 3.13 and newer.
RELEASES = ("bullseye", "bookworm", "trixie", "forky")
LARGEST = 60_000_000  # the maximum size of the archive, in bytes
# Commands without GL, each with the files that it makes.
EXACT = (
    (("rays", SCENE, "-o", "hits.npz", "--axes", "--resolution", "32", "--quiet"), "hits.npz"),
    (("rays", "part.3mf", "-o", "part.npz", "--axes", "--resolution", "32", "--quiet"), "part.npz"),
    (("bake", SCENE, "-o", "baked.glb", "--quiet"), "baked.glb"),
    (("extract", "layers.exr", "--points", "points.ply", "--quiet"), "points.ply"),
    (("flatten", "layers.exr", "-o", "composite.png", "--quiet"), "composite.png"),
    *zip(MORE, MADE[1:]),
)
# The tests of the Python module that need no further packages.
PYTHON_TESTS = ("verbs", "pictures", "rays", "views", "errors", "host")
# Libraries that GL drivers bring (libraries.cmake).
MACHINES = re.compile(r"lib(GL|EGL|OSMesa|gbm|drm|glapi|X|xcb|wayland|va|vdpau|OpenCL)")

Needs = collections.namedtuple("Needs", "libraries versions interpreter")


def needs_of(file):
    """Returns what an ELF file asks of the dynamic linker; `versions`: {library: its symbol versions}."""
    text = run("objdump", "-p", file)
    versions = {}
    for library, block in re.findall(r"required from (\S+):\n((?:    .*\n)+)", text):
        versions[library] = set(re.findall(r"(\S+)$", block, re.M))
    return Needs(set(re.findall(r"NEEDED +(\S+)", text)), versions, "INTERP" in text)


def defined_versions(file):
    """Returns the symbol versions that a library defines."""
    text = run("objdump", "-p", file).partition("Version definitions:\n")[2].partition("\n\n")[0]
    return set(re.findall(r"^\d+ 0x\S+ 0x\S+ (\S+)", text, re.M))


class Archive(PackedTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        (cls.archive,) = cls.made.glob("*.tar.xz")
        (cls.wheel,) = cls.made.glob("*.whl")
        cls.name = cls.archive.name.removesuffix(".tar.xz")
        run("tar", "-C", cls.scratch, "-xf", cls.archive)
        cls.unpacked = pathlib.Path(cls.scratch, cls.name)
        triangle = threemf_package.model(threemf_package.OBJECT)
        (cls.expected / "part.3mf").write_bytes(threemf_package.package(triangle))
        for arguments, _ in EXACT:
            run(BUILD / "peeler", *arguments, cwd=cls.expected)

    def put(self, root, *names):
        """Copies files that this build has made to /work."""
        for name in names:
            shutil.copy(self.expected / name, f"{root.root}/work")

    def test_symbol_versions(self):
        """No file needs a library or a symbol version that neither the archive nor a GL driver brings."""
        files = [path for path in self.unpacked.rglob("*") if path.is_file() and path.read_bytes()[:4] == b"\x7fELF"]
        here = {path.name: path for path in files}
        newest = {}
        for file in files:
            needs = needs_of(file)
            missing = {name for name in needs.libraries if name not in here and not MACHINES.match(name)}
            self.assertEqual(missing, set(), file)
            for library, versions in needs.versions.items():
                if library in here:
                    self.assertEqual(versions - defined_versions(here[library]), set(), f"{file} of {library}")
            found = [tuple(map(int, v[6:].split("."))) for v in set().union(*needs.versions.values()) if
                     re.fullmatch(r"GLIBC_[0-9.]+", v)]
            newest[file] = max(found, default=None)
        for file, version in sorted(newest.items()):
            text = "none" if version is None else "glibc " + ".".join(map(str, version))
            print(f"  {str(file.relative_to(self.unpacked)):44} {text}")
        # These start without a C library.
        for name in ("bin/peeler", "lib/peeler/peeler_3mf"):
            needs = needs_of(self.unpacked / name)
            self.assertEqual((needs.libraries, needs.interpreter), (set(), False), name)
        (linker,) = (self.unpacked / "lib/glibc").glob("ld-linux*")
        self.assertEqual(needs_of(linker).libraries, set())

    def test_size_and_licences(self):
        self.assertLessEqual(self.archive.stat().st_size, LARGEST)
        self.assertGreater(len(list((self.unpacked / "share/doc/peeler/licences").iterdir())), 30)

    def test_no_c_library(self):
        """A root that contains nothing else."""
        root = pathlib.Path(self.scratch, "bare")
        for name in ("proc", "dev", "tmp", "work"):
            (root / name).mkdir(parents=True)
        run("mount", "--rbind", "/proc", root / "proc")
        run("mount", "--rbind", "/dev", root / "dev")
        self.addCleanup(lambda: [run("umount", "-l", root / name) for name in ("proc", "dev")])
        shutil.copytree(self.unpacked, root / "peeler", symlinks=True)
        for name in (SCENE, "part.3mf", "layers.exr"):
            shutil.copy(self.expected / name, root / "work")
        for arguments, made in EXACT:
            placed = [f"/work/{word}" if (self.expected / word).is_file() else word for word in arguments]
            run("chroot", root, "/peeler/bin/peeler", *placed)
            self.assertEqual((root / "work" / made).read_bytes() == (self.expected / made).read_bytes(), True, made)

    def test_releases(self):
        for suite in RELEASES:
            with self.subTest(suite):
                self.use(suite)
                self.doCleanups()
                shutil.rmtree(f"{self.scratch}/{suite}")

    def use(self, suite):
        root = self.root(suite, f"{suite}-archive", "xz-utils")
        shutil.copy(self.archive, f"{root.root}/work")
        self.run_in(root, "tar", "-C", "/work", "-xf", f"/work/{self.archive.name}", user=NOBODY)
        program = f"/work/{self.name}/bin/peeler"
        # Without GL, everything that needs none works.
        self.put(root, "part.3mf", "layers.exr")
        self.run_as_user(root, program, *(arguments for arguments, _ in EXACT))
        self.assert_same_files(root, *(made for _, made in EXACT))
        done = root.run([program, "render", f"/work/{SCENE}", "-o", "/work/no.exr"], user=NOBODY)
        self.assertEqual(done.returncode, 5, done.stdout)
        for package in ("libegl1", "mesa-libEGL"):
            self.assertIn(package, done.stdout)
        self.say(f"{suite}: {len(EXACT)} files without GL, the same bytes")

        self.install(root, "libegl1", "libgl1-mesa-dri", "procps")
        os.remove(f"{root.root}/work/layers.exr")
        self.run_as_user(root, program, RENDER, (*RENDER[:2], "-o", "picture.png", "--quiet"),
                         ("verify", "layers.exr"), *MORE)
        if suite == debian.suite():
            self.assert_same_files(root, *MADE)
        compared = peeler("compare", f"{root.root}/work/layers.exr", self.expected / "layers.exr", "--json")
        self.say(f"{suite}: pictures identical to this machine's: {json.loads(compared.stdout)['identical']}")
        self.wheel_works(root, suite)

    def wheel_works(self, root, suite):
        self.install(root, "python3-venv", "python3-numpy")
        shutil.copy(self.wheel, f"{root.root}/work")
        self.run_in(root, "python3", "-m", "venv", "--system-site-packages", "/work/venv", user=NOBODY)
        pip = ("/work/venv/bin/python", "-m", "pip", "install", "-q", "--no-index")
        self.run_in(root, *pip, f"/work/{self.wheel.name}", user=NOBODY)
        version = self.run_in(root, "/work/venv/bin/peeler", "--version", user=NOBODY).strip()
        for folder in ("examples", "tests/python", "cmd"):
            shutil.copytree(SOURCE / folder, f"{root.root}/source/{folder}", dirs_exist_ok=True)
        (program,) = pathlib.Path(root.root, "work/venv").glob("lib/python3*/site-packages/peeler/program/bin/peeler")
        root.variables |= {"PEELER": "/" + str(program.relative_to(root.root)), "HOME": "/tmp"}
        for name in PYTHON_TESTS:
            test = f"/source/tests/python/{name}_test.py"
            said = self.run_in(root, "/work/venv/bin/python", "-B", test, user=NOBODY)
            self.say(f"{suite}: {version}, {name}_test.py: {said.strip().splitlines()[-1]}")


if __name__ == "__main__":
    if not ALL:
        sys.exit(main())
    debian.in_own_machine("archive", main, debian.suite(), Archive.NEEDED)
