# SPDX-License-Identifier: Apache-2.0
"""Tests the Debian packages (cmd/packages). Checks the contents of this build's packages. With PEELER_TEST_ALL, builds
all packages, checks them by lintian, and uses them in fresh roots (packed.py)."""

import fnmatch
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import debian
import guide_test
from documents_test import dead_links
from packed import ALL, BUILD, MADE, MORE, NOBODY, RENDER, SCENE, PackedTest, run
from peeler_command import EXAMPLES, SOURCE, PeelerTest, main, peeler

TOOLS = ("cpack", "dpkg-deb", "dpkg-shlibdeps", "file")
README = (SOURCE / "README.md").read_text(encoding="utf-8")
# lintian objects to a maintainer without an address.
OF_THE_MAINTAINER = "malformed-contact,bogus-mail-host-in-debian-changelog"


def packages_in(folder):
    """Returns {package name: its file}."""
    return {file.name.partition("_")[0]: file for file in sorted(pathlib.Path(folder).glob("*.deb"))}


@unittest.skipUnless(all(map(shutil.which, TOOLS)), f"needs {', '.join(TOOLS)}")
class Parts(PeelerTest):
    """Tests the packages of this build, packed with fast compression."""

    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        cls.scratch = pathlib.Path(scratch.name)
        run(
            *("cpack", "-G", "DEB", "--config", BUILD / "CPackConfig.cmake", "-B", cls.scratch),
            *("-D", "CPACK_DEBIAN_COMPRESSION_TYPE=zstd"),
        )
        cls.packages = packages_in(cls.scratch)
        cls.files = {}
        for name, file in cls.packages.items():
            run("dpkg-deb", "-x", file, cls.scratch / name)
            here = cls.scratch / name
            cls.files[name] = {
                str(path.relative_to(here))
                for path in here.rglob("*")
                if path.is_symlink() or not path.is_dir()
            }

    def field(self, name, field):
        return run("dpkg-deb", "-f", self.packages[name], field).strip()

    def test_packages(self):
        names = {"peeler", "peeler-doc", "libpeeler0", "libpeeler-dev"}
        if (BUILD / "python/peeler").is_dir():
            names.add("python3-peeler")
        self.assertEqual(set(self.packages), names)

    def test_no_file_is_in_two(self):
        everything = [file for files in self.files.values() for file in files]
        self.assertEqual(sorted(set(everything)), sorted(everything))

    def test_documents(self):
        for name, files in self.files.items():
            folder = f"usr/share/doc/{name}"
            self.assertIn(f"{folder}/copyright", files)
            self.assertIn(f"{folder}/changelog.Debian.gz", files)
            self.assertEqual({file for file in files if not file.startswith("usr/")}, set())

    def test_command(self):
        files = self.files["peeler"]
        verbs = re.findall(r"^  ([a-z]+) +[A-Z]", peeler("--help").stdout, re.M)
        pages = {f"usr/share/man/man1/peeler-{verb}.1.gz" for verb in verbs if verb != "help"}
        self.assertGreater(len(pages), 10)
        self.assertEqual(pages - files, set())
        for page in (self.scratch / "peeler/usr/share/man/man1").iterdir():
            # Without name and time in the gzip header (RFC 1952), the same page gives the same file.
            head = page.read_bytes()[:8]
            self.assertEqual((head[3], head[4:8]), (0, bytes(4)), page)
        for file in (
            *("usr/bin/peeler", "usr/share/bash-completion/completions/peeler"),
            *("usr/share/zsh/vendor-completions/_peeler", "usr/share/fish/vendor_completions.d/peeler.fish"),
        ):
            self.assertIn(file, files)
        version = self.field("peeler", "Version")
        self.assertIn(f"libpeeler0 (= {version})", self.field("peeler", "Depends"))
        # The library's package has the modules that the program loads.
        together = self.scratch / "together"
        for name in ("peeler", "libpeeler0"):
            shutil.copytree(self.scratch / name, together, symlinks=True, dirs_exist_ok=True)
        for module in (BUILD / "lib" / "peeler").iterdir():
            self.assertTrue((together / "usr/lib/peeler" / module.name).exists(), module.name)

    def test_guide_and_examples(self):
        """The package has the examples byte by byte, uncompressed, and documents whose links work."""
        self.assertEqual(self.field("peeler-doc", "Architecture"), "all")
        folder = self.scratch / "peeler-doc" / "usr/share/doc/peeler"
        listed = [
            path for path in EXAMPLES.rglob("*") if path.is_file() and "__pycache__" not in path.parts
        ]
        self.assertGreater(len(listed), 90)
        for path in listed:
            packed = folder / path.relative_to(SOURCE)
            self.assertEqual(packed.read_bytes(), path.read_bytes(), packed)
        dead = [
            f"{path.relative_to(folder)}: {what}"
            for path in folder.rglob("*.md")
            for what in dead_links(path.read_text(encoding="utf-8"), path)
            # Sources are only in the repository.
            if what.endswith((".md", ".png")) or what.startswith("no heading")
        ]
        self.assertEqual(dead, [])

    def test_what_is_loaded_when_needed_is_recommended(self):
        required, recommended = (self.field("libpeeler0", name) for name in ("Depends", "Recommends"))
        for library in ("libopenimageio", "libopenvdb", "lib3mf"):
            self.assertNotIn(library, required)
            self.assertIn(library, recommended)
        for library in ("libopenexr", "libtinygltf", "libc6"):
            self.assertIn(library, required)

    def test_the_readme_names_the_packages(self):
        (block,) = (block for block in guide_test.blocks(README) if "pip install" in block.text)
        named = re.findall(r"(?<![\w/])(?:\./)?(\w[\w.-]*\*[\w.*-]*)", block.text)
        name = re.search(r'^set\(name "(.*)"\)', (BUILD / "packing/portable_settings.cmake").read_text(), re.M)
        others = [f"{name[1]}.tar.xz", f"{name[1].partition('-linux')[0]}-py3-none-manylinux.whl"]
        made = [*(file.name for file in self.packages.values()), *others]
        self.assertGreater(len(named), 4)
        for pattern in named:
            self.assertTrue(fnmatch.filter(made, pattern), pattern)

    def test_python(self):
        """One package serves all architectures and runs the program."""
        if "python3-peeler" not in self.packages:
            return
        version = self.field("peeler", "Version")
        self.assertEqual(self.field("python3-peeler", "Architecture"), "all")
        self.assertIn(f"peeler (= {version})", self.field("python3-peeler", "Depends"))
        folder = "usr/lib/python3/dist-packages/peeler"
        for file in ("__init__.py", "__init__.pyi", "py.typed", "verbs.json"):
            self.assertIn(f"{folder}/{file}", self.files["python3-peeler"])

    def test_no_file_names_the_folder_that_it_was_built_in(self):
        rooms = [f"{SOURCE}/{room}/".encode() for room in ("build", "cmd", "core", "formats", "shaders")]
        rooms.append(f"{BUILD}/".encode())
        telling = [
            f"{name}: {file}"
            for name, files in self.files.items()
            for file in files
            if (self.scratch / name / file).is_file()
            and any(room in (self.scratch / name / file).read_bytes() for room in rooms)
        ]
        self.assertEqual(telling, [])

    def test_libraries(self):
        (library,) = (file for file in self.files["libpeeler0"] if file.endswith("libpeeler.so.0"))
        self.assertIn(library.removesuffix(".0"), self.files["libpeeler-dev"])
        self.assertRegex(
            run("dpkg-deb", "-I", self.packages["libpeeler0"], "shlibs"), r"^libpeeler 0 libpeeler0 \(>="
        )
        # The prefix in the installed file is the file's own.
        (config,) = (self.scratch / "libpeeler-dev").rglob("peeler.pc")
        prefix = re.search(r"^prefix=\$\{pcfiledir\}/(.*)$", config.read_text(), re.M)[1]
        usr = self.scratch / "libpeeler-dev" / "usr"
        self.assertTrue((config.parent / prefix).samefile(usr))


STAND_INS = """
cmake_minimum_required(VERSION 3.22)
set(library_folders {folder})
set(compiler c++)
set(nm nm)
set(objdump objdump)
include({script})
make_stand_ins("^libpeelerunused" "^nothing$" {folder}/here {folder}/here/libuser.so)
"""


class StandIns(PeelerTest):
    """Tests cmd/packages/stand_ins.cmake, which makes stand-ins with the symbols of a missing library."""

    def test_loads_and_ends_when_called(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        folder = pathlib.Path(scratch.name)
        (folder / "here").mkdir()
        unused, user = folder / "libpeelerunused.so.1", folder / "here" / "libuser.so"
        (folder / "unused.map").write_text("UNUSED_1 { global: *; };\n")
        (folder / "unused.cpp").write_text(
            'extern "C" { int number[3] = {1, 2, 3}; int called() { return 1; } int nothing() { return 1; }\n'
            "int never() { return 1; } }\n"
        )
        (folder / "user.cpp").write_text(
            'extern "C" { extern int number[3]; int called(); int nothing(); int* numbers() { return number; }\n'
            "int calls() { return called(); } int calls_nothing() { nothing(); return 7; } }\n"
        )
        shared = ("c++", "-shared", "-fPIC", "-o")
        script = f"-Wl,--version-script={folder}/unused.map"
        run(*shared, unused, f"-Wl,-soname,{unused.name}", script, folder / "unused.cpp")
        run(*shared, user, "-Wl,-z,now", folder / "user.cpp", unused)
        text = STAND_INS.format(script=SOURCE / "cmd/packages/stand_ins.cmake", folder=folder)
        (folder / "make.cmake").write_text(text)
        run("cmake", "-P", folder / "make.cmake")
        self.assertEqual(sorted(os.listdir(folder / "here")), [unused.name, "libuser.so"])
        unused.unlink()

        def call(function):
            code = f"import ctypes; print(ctypes.CDLL({str(user)!r}).{function}())"
            return subprocess.run(
                ["/usr/bin/python3", "-c", code],
                env={**os.environ, "LD_LIBRARY_PATH": str(folder / "here")},
                text=True,
                capture_output=True,
                check=False,
            )

        done = call("calls_nothing")
        self.assertEqual((done.stdout, done.stderr), ("7\n", ""))
        done = call("calls")
        self.assertEqual(done.returncode, -6, done.stderr)
        self.assertIn(f"{unused.name} is not in this archive", done.stderr)
        self.assertNotIn("never", run("nm", "-D", folder / "here" / unused.name))


class Roots(PackedTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.packages = packages_in(cls.made)

    def root(self, name, *packages):
        """Returns a fresh root with these packages installed, and all of ours in /packages."""
        root = super().root(debian.suite(), name, *packages)
        shutil.copytree(self.made, f"{root.root}/packages", ignore=lambda _, names: {
            file for file in names if not file.endswith(".deb")
        })
        return root

    def files(self, *names):
        """Returns the paths of our packages in a root."""
        return [f"/packages/{self.packages[name].name}" for name in names]

    def renders_the_same(self, root):
        """Renders as a user who may write only to /work, and expects the same files."""
        self.run_as_user(root, "peeler", RENDER, *MORE)
        self.assert_same_files(root, *MADE)

    def test_lintian(self):
        if not shutil.which("lintian"):
            self.skipTest("no lintian")
        done = subprocess.run(
            ["lintian", "--fail-on", "error", "--suppress-tags", OF_THE_MAINTAINER, *map(str, self.packages.values())],
            text=True,
            check=False,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        print(done.stdout)
        self.assertEqual(done.returncode, 0)

    def test_packages(self):
        root = self.root("packages", "libegl1", "libgl1-mesa-dri")
        self.install(root, *self.files(*self.packages))
        self.assertEqual(run("chroot", root.root, "sh", "-c", "command -v c++ cc || true"), "")
        self.follows_the_readme(root)
        self.install(root, *self.recommended(root))
        self.renders_the_same(root)
        if "python3-peeler" in self.packages:
            code = "import peeler; print(peeler.Scene('/work/coincident.glb'), peeler.__version__)"
            self.say(self.run_in(root, "python3", "-c", code).strip())
        brought = {
            line
            for name in self.packages
            for line in self.run_in(root, "dpkg", "-L", name).splitlines()
            if not os.path.isdir(root.root + line)
        }
        self.assertGreater(len(brought), 40)
        self.run_in(root, "apt-get", "purge", "-y", "-qq", "--auto-remove", *self.packages)
        left = [file for file in brought if os.path.lexists(root.root + file)]
        self.assertEqual(left, [])
        found = self.run_in(root, "find", "/usr", "/etc", "/var", "/opt", "/root", "-name", "*peeler*")
        self.assertEqual(found, "")

    def follows_the_readme(self, root):
        """Runs the README's commands without the recommended libraries, in a folder with the installed examples."""
        root.folder = "/work"
        self.run_in(root, "cp", "-r", "/usr/share/doc/peeler/examples", ".", user=NOBODY)
        commands = [block.text for block in guide_test.blocks(README) if block.language == guide_test.RUN]
        self.assertGreater(len(commands), 1)
        for block in commands:
            self.run_in(root, "sh", "-eu", "-c", block, user=NOBODY)
        root.folder = "/"

    def recommended(self, root):
        """Returns the packages that must be installed, according to the errors of commands that need them."""
        root.folder, packages = "/work", []
        self.run_in(root, "peeler", *RENDER, user=NOBODY)
        for arguments, made in zip(MORE, MADE[1:]):
            done = root.run(("peeler", *arguments), user=NOBODY)
            self.assertEqual(done.returncode, 1, done.stdout)
            packages.append(re.search(r"hint: install \w+ \(Debian: (\S+)\)", done.stdout)[1])
            self.assertFalse(os.path.exists(f"{root.root}/work/{made}"))
        root.folder = "/"
        return packages

    def test_rpm(self):
        found = list(self.made.glob("*.rpm"))
        if not found:
            self.skipTest("no rpmbuild when the packages were made")
        root = self.root("rpm", "libegl1", "libgl1-mesa-dri")
        needed = run("rpm", "-qp", "--requires", found[0]).splitlines()
        self.assertEqual([line for line in needed if not line.startswith("rpmlib(")], [])
        run("rpm", "-i", "--root", root.root, "--nosignature", found[0])
        self.renders_the_same(root)
        self.assertTrue(os.path.exists(f"{root.root}/usr/share/man/man1/peeler-render.1"))
        run("rpm", "-e", "--root", root.root, "peeler")
        self.assertEqual(self.run_in(root, "find", "/usr", "/opt", "-name", "*peeler*"), "")

    def test_library(self):
        tools = ("g++", "cmake", "make", "pkg-config", "libegl-dev", "libegl1", "libgl1-mesa-dri")
        root = self.root("library", *tools)
        self.install(root, *self.files("libpeeler0", "libpeeler-dev"))
        shutil.copytree(EXAMPLES / "library", f"{root.root}/library")
        self.run_in(root, "cmake", "-S", "/library", "-B", "/work/build")
        self.run_in(root, "cmake", "--build", "/work/build")
        arguments = (f"/work/{SCENE}", "/work/counts.pgm", "/work/library.exr")
        printed = self.run_in(root, "/work/build/layers", *arguments, user=NOBODY)
        info = run(BUILD / "peeler", "info", "layers.exr", "--json", cwd=self.expected)
        fragments = re.search(r'"fragmentsStored": (\d+)', info)[1]
        self.assertIn(f" {fragments} fragments of ", printed)
        made = pathlib.Path(root.root, "work", "library.exr")
        compared = run(BUILD / "peeler", "compare", made, self.expected / "layers.exr", "--json")
        self.assertTrue(json.loads(compared)["identical"], compared)
        self.run_in(root, "sh", "-c", "g++ -std=c++20 -o /work/linked /library/layers.cpp "
                    "$(pkg-config --cflags --libs peeler)")
        self.run_in(root, "/work/linked", f"/work/{SCENE}", user=NOBODY)


if __name__ == "__main__":
    if not ALL:
        sys.exit(main())
    debian.in_own_machine("packages", main, debian.suite(), Roots.NEEDED)
