# SPDX-License-Identifier: Apache-2.0
"""Tests examples/library from a user's view: with an installed library, another compiler, and without our source
tree."""

import os
import pathlib
import re
import shutil
import subprocess
import tempfile

from peeler_command import EXAMPLES, PEELER, PeelerTest, main, peeler, skip

BUILD = pathlib.Path(os.environ.get("PEELER_BUILD", pathlib.Path(PEELER).parent))
SCENE = EXAMPLES / "scenes" / "engine.glb"
PUBLIC = EXAMPLES.parent / "cmd" / "library" / "include"
# Leaks in drivers are not leaks of the client or the library.
os.environ["LSAN_OPTIONS"] = f"suppressions={EXAMPLES.parent}/tests/sanitizers/leaks.txt:print_suppressions=0"


def run(*arguments, **options):
    return subprocess.run(
        [*map(str, arguments)], text=True, capture_output=True, check=False, **options
    )


class Library(PeelerTest):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.home = pathlib.Path(cls.folder.name)
        cls.prefix = cls.home / "prefix"
        for component in ("library", "development"):
            done = run("cmake", "--install", BUILD, "--prefix", cls.prefix, "--component", component)
            if done.returncode != 0:
                raise AssertionError(done.stdout + done.stderr)
        cls.libraries = next(cls.prefix.rglob("libpeeler.so")).parent
        shutil.copytree(EXAMPLES / "library", cls.home / "example")
        cls.built = cls.home / "built"
        # The sanitizers in the client also check the headers' inline code and the data that the client receives.
        cls.configured = run(
            "cmake", "-S", cls.home / "example", "-B", cls.built,
            f"-DCMAKE_PREFIX_PATH={cls.prefix}", "-DCMAKE_BUILD_TYPE=Debug",
            "-DCMAKE_CXX_FLAGS=-fsanitize=address,undefined -fno-sanitize-recover=all -Wall -Wextra -Werror",
        )
        cls.compiled = run("cmake", "--build", cls.built, "--parallel", "2")

    def test_it_configures_and_builds(self):
        self.assertEqual(self.configured.returncode, 0, self.configured.stdout + self.configured.stderr)
        self.assertEqual(self.compiled.returncode, 0, self.compiled.stdout + self.compiled.stderr)

    def test_its_layers_are_the_commands(self):
        counts, layers, ours = (self.home / name for name in ("counts.pgm", "layers.exr", "ours.exr"))
        done = run(self.built / "layers", SCENE, counts, layers)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.render(SCENE, "--size", "320x180", "-o", ours)
        compared = peeler("compare", layers, ours)
        self.assertEqual(compared.returncode, 0, compared.stdout + compared.stderr)
        fragments = int(re.search(r"(\d+) fragments", done.stdout)[1])
        self.assertIn(f"{fragments:,}", peeler("info", ours).stdout)
        picture = counts.read_bytes()
        self.assertEqual(picture[:15], b"P5 320 180 255\n")
        self.assertEqual(len(picture), 15 + 320 * 180)

    def test_a_context_of_its_own_is_borrowed(self):
        done = run(self.built / "adopt", SCENE)
        if done.returncode == 5:
            self.skipTest(f"EGL: {done.stderr}")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        drawn = run(self.built / "layers", SCENE)
        fragments = re.compile(r"\d+ fragments")
        self.assertEqual(fragments.findall(done.stdout), fragments.findall(drawn.stdout))

    def test_layers_are_drawn_from_gpu_buffers(self):
        whole, peeled, ours = (self.home / name for name in ("whole.exr", "peeled.png", "ours.exr"))
        scene = EXAMPLES / "scenes" / "panes.glb"
        done = run(self.built / "gpu_layers", scene, peeled, "2", "4")
        if done.returncode == 5:
            self.skipTest(f"EGL: {done.stderr}")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        layers, bands, off = re.match(r"(\d+) layers in (\d+) bands; all .* by (\S+)\n", done.stdout).groups()
        self.assertEqual(layers, "11")
        self.assertGreater(int(bands), 1)
        self.assertLess(float(off), 1e-6)
        self.assertEqual(peeled.read_bytes()[1:4], b"PNG")
        # The library's picture of all layers equals the command's composite.
        done = run(self.built / "gpu_layers", scene, whole)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.render(scene, "--size", "640x360", "-o", ours)
        compared = peeler("compare", whole, ours, "--composites", "--max-color", "0.001")
        self.assertEqual(compared.returncode, 0, compared.stdout + compared.stderr)

    def test_a_scene_of_arrays_has_its_layers(self):
        done = run(self.built / "arrays")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        # The scene has three squares of 16 x 16 pixels, at distances 2, 3 and 4 from the eye.
        self.assertEqual(done.stdout, "768 fragments, of the pixel in the middle at 2 3 4\n")

    def test_errors_come_as_errors(self):
        done = run(self.built / "layers", self.home / "no.glb")
        self.assertEqual(done.returncode, 3)
        self.assertIn("no.glb", done.stderr)

    def test_pkg_config_tells_the_same(self):
        told = run(
            "pkg-config", "--cflags", "--libs", "peeler",
            env={**os.environ, "PKG_CONFIG_PATH": str(self.libraries / "pkgconfig")},
        )
        self.assertEqual(told.returncode, 0, told.stderr)
        flags = [
            flag[:2] + os.path.normpath(flag[2:]) if flag[:2] in ("-I", "-L") else flag
            for flag in told.stdout.split()
        ]
        self.assertEqual(flags, [f"-I{self.prefix}/include", f"-L{self.libraries}", "-lpeeler"])

    def test_each_header_compiles_by_itself(self):
        for header in sorted((self.prefix / "include").rglob("*.h")):
            name = header.relative_to(self.prefix / "include")
            done = run(
                os.environ.get("CXX", "c++"), "-std=c++20", "-Wall", "-Wextra", "-Werror", "-fsyntax-only",
                f"-I{self.prefix}/include", "-x", "c++", "-", input=f"#include <{name}>\n",
            )
            self.assertEqual(done.returncode, 0, f"{name}\n{done.stderr}")

    def test_only_what_is_public_is_installed(self):
        def texts(folder):
            return {path.relative_to(folder): path.read_text() for path in folder.rglob("*") if path.is_file()}

        self.assertIn(pathlib.Path("peeler/renderer.h"), texts(PUBLIC))
        self.assertEqual(texts(self.prefix / "include"), texts(PUBLIC))
        symbols = run("nm", "-DC", "--defined-only", self.libraries / "libpeeler.so").stdout
        ours = re.findall(r" [A-Z] (?:vtable for |typeinfo (?:name )?for |VTT for )?(peeler::\S+)", symbols)
        self.assertGreater(len(ours), 20)
        hidden = [name for name in ours if not name.startswith("peeler::v0::")]
        self.assertEqual(hidden, [])

    def test_it_links_statically(self):
        client = self.home / "static"
        client.mkdir()
        shutil.copy(EXAMPLES / "library" / "layers.cpp", client)
        (client / "CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.22)\nproject(client LANGUAGES CXX)\n"
            "find_package(peeler REQUIRED COMPONENTS static)\n"
            "add_executable(layers layers.cpp)\n"
            "target_link_libraries(layers PRIVATE peeler::static)\n"
        )
        done = run("cmake", "-S", client, "-B", client / "built", f"-DCMAKE_PREFIX_PATH={self.prefix}")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        done = run("cmake", "--build", client / "built")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        done = run(client / "built" / "layers", SCENE)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        needed = run("readelf", "-d", client / "built" / "layers").stdout
        self.assertNotIn("libpeeler.so", needed)


if __name__ == "__main__":
    if not shutil.which("cmake"):
        skip("there is no cmake")
    raise SystemExit(main())
