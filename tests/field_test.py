# SPDX-License-Identifier: Apache-2.0
"""Tests that small files from other programs ($PEELER_FIELD, or ../shared/field by default) are drawn correctly.

Skipped, with the reason, if the folder does not exist. PEELER is the program.
"""

import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import numpy
import OpenImageIO

PEELER = os.environ["PEELER"]
REPOSITORY = pathlib.Path(__file__).resolve().parents[1]
FIELD = pathlib.Path(os.environ.get("PEELER_FIELD", REPOSITORY.parent / "shared/field"))
ELSEWHERE = {  # {folder: the test that covers it, or the reason why none does}
    "18-python-fork-hang": "a process that forks is not tested yet",
    "19-python-arrays": "tests/python/errors_test.py",
    "21-no-threads-hang": "tests/cmd/machine/resources_process_test.cpp",
}
RED, GREEN, BLUE, YELLOW = (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0)
FROM_THE_FRONT = ("--eye", "0.5,0.5,3", "--target", "0.5,0.5,0", "--size", "64x64", "--shading", "unlit")


class Field(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.out = pathlib.Path(scratch.name)

    def folder(self, start):
        """Returns a copy of the folder whose name has this prefix, for programs that write next to their input."""
        (found,) = FIELD.glob(f"{start}-*")
        copy = self.out / found.name
        shutil.copytree(found, copy)
        return copy

    def peeler(self, *arguments, code=0):
        done = subprocess.run([PEELER, *map(str, arguments)], capture_output=True, text=True, cwd=self.out, timeout=120)
        self.assertEqual(done.returncode, code, f"{arguments}\n{done.stdout}{done.stderr}")
        return done.stdout + done.stderr

    def pixels(self, path):
        """Returns (width, height, display width, display height, a function from x, y to a list of channels)."""
        image = OpenImageIO.ImageBuf(str(path))
        spec = image.spec()
        return spec.width, spec.height, spec.full_width, spec.full_height, lambda x, y: list(image.getpixel(x, y))

    def corners(self, scene, *more):
        """Returns the colours in the middle of each quadrant: upper left, upper right, lower left, lower right."""
        out = self.out / "corners.exr"
        said = self.peeler("render", scene, "-o", out, "--as", "composite", *FROM_THE_FRONT, *more)
        at = self.pixels(out)[4]
        # With any lens, the unit square takes about a third of the picture's height.
        return [tuple(round(c) for c in at(x, y)[:3]) for y in (28, 36) for x in (28, 36)], said

    def assertTextured(self, scene, warned=""):
        found, said = self.corners(scene)
        self.assertEqual(found, [RED, GREEN, BLUE, YELLOW])
        self.assertIn(warned, said)
        if not warned:
            self.assertNotIn("warning", said)
        return said

    def test_01_colors_above_one(self):
        color = self.folder("01") / "color.glb"
        self.peeler("render", color, "-o", "c.exr", "--as", "composite", "--size", "32x32", "--shading", "unlit")
        _, _, width, height, at = self.pixels(self.out / "c.exr")
        self.assertLessEqual(max(max(at(x, y)[:3]) for x in range(width) for y in range(height)), 1)

    def test_02_dwa(self):
        dwa = self.folder("02") / "dwaa.exr"
        self.peeler("flatten", dwa, "-o", "a.exr")
        self.peeler("verify", dwa)
        ours, theirs = self.pixels(self.out / "a.exr")[4], self.pixels(dwa)[4]
        self.assertEqual([ours(x, 5)[:4] for x in range(32)], [theirs(x, 5) for x in range(32)])

    def test_03_windows(self):
        folder = self.folder("03")
        for verb in (("flatten",), ("sheet",)):
            self.peeler(*verb, folder / "inside.exr", "-o", "a.png")
        self.peeler("flatten", folder / "inside.exr", "-o", "a.png")
        self.assertEqual(self.pixels(self.out / "a.png")[:2], (8, 6))
        self.peeler("compare", folder / "w1.exr", folder / "w1.exr")
        self.assertNotIn("crops", self.peeler("compare", folder / "w1.exr", folder / "w2.exr", code=1))

    def test_04_pixel_aspect(self):
        folder = self.folder("04")
        for verb, name in (("flatten", "aspect"), ("flatten", "flat"), ("convert", "aspect")):
            self.peeler(verb, folder / f"{name}.exr", "-o", "a.exr")
            spec = OpenImageIO.ImageBuf(str(self.out / "a.exr")).spec()
            self.assertEqual(spec.get_float_attribute("PixelAspectRatio"), 2, verb)

    def test_05_names_of_alpha(self):
        folder = self.folder("05")
        self.peeler("convert", folder / "ar.exr", "-o", "x.exr")
        self.peeler("verify", "x.exr")
        self.peeler("flatten", folder / "ar.exr", "-o", "a.exr")
        image = OpenImageIO.ImageBuf(str(self.out / "a.exr"))
        names = list(image.spec().channelnames)
        pixel = image.getpixel(4, 3)
        for name, value in (("R", 0.2), ("G", 0.7), ("B", 0)):
            self.assertAlmostEqual(pixel[names.index(name)], value, delta=1e-3)
        self.peeler("flatten", folder / "beauty.exr", "-o", "b.exr")
        self.assertGreater(max(self.pixels(self.out / "b.exr")[4](4, 3)[:3]), 0)

    def test_06_comments(self):
        self.assertIn("2 triangles", self.peeler("info", self.folder("06") / "v.obj"))

    def test_07_transparent(self):
        found, said = self.corners(self.folder("07") / "house.obj")
        self.assertEqual(found, [RED] * 4)
        self.assertIn("warning", said)

    def test_08_names_of_windows(self):
        folder = self.folder("08")
        self.assertTextured(folder / "quoted.obj")
        self.assertTextured(folder / "absolute.obj", "C:")

    def test_09_several_textures(self):
        found, said = self.corners(self.folder("09") / "two.ply")
        self.assertNotIn("warning", said)
        self.assertEqual((found[0], found[3]), (BLUE, YELLOW))

    def test_10_integer_colors(self):
        integers = self.folder("10") / "int.ply"
        bytes_of_it = integers.with_name("uchar.ply")
        for name in ("red", "green", "blue"):
            text = (bytes_of_it if bytes_of_it.exists() else integers).read_text()
            bytes_of_it.write_text(text.replace(f"int {name}", f"uchar {name}"))
        pictures = []
        for scene in (integers, bytes_of_it):
            said = self.peeler("render", scene, "-o", f"{scene.stem}.png", *FROM_THE_FRONT)
            self.assertNotIn("warning", said)
            at = self.pixels(self.out / f"{scene.stem}.png")[4]
            pictures.append([at(x, y) for y in range(64) for x in range(64)])
        self.assertEqual(*pictures)

    def test_11_text_stl(self):
        folder = self.folder("11")
        for name in ("dup", "noend"):
            self.assertIn("2 triangles", self.peeler("info", folder / f"{name}.stl"))

    def test_12_truncated_jpeg(self):
        cut = self.folder("12") / "cut.glb"
        self.assertIn("/images/0", self.peeler("render", cut, "-o", "a.png", "--size", "16x16"))
        self.peeler("render", cut, "-o", "b.png", "--size", "16x16", "--strict", code=3)
        self.assertFalse((self.out / "b.png").exists())

    def test_13_integer_colors_not_normalized(self):
        said = self.peeler("render", self.folder("13") / "c.glb", "-o", "a.png", "--size", "16x16")
        self.assertIn("MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_INVALID_FORMAT", said)

    def test_14_backslashes(self):
        said = self.peeler("render", self.folder("14") / "backslash.gltf", "-o", "a.png", "--size", "16x16")
        self.assertNotIn("left out", said)
        self.assertIn("warning", said)

    def test_15_morphed_colors(self):
        self.peeler("render", self.folder("15") / "color.glb", "-o", "a.exr", "--as", "composite", "--size", "16x16",
                    "--shading", "unlit")
        self.assertEqual(tuple(round(c) for c in self.pixels(self.out / "a.exr")[4](8, 8)[:3]), GREEN)

    def test_16_line_feed_in_a_name(self):
        scene = self.folder("16") / "any.glb"
        name = self.out / "a\nerror: boom.glb"
        scene.rename(name)
        said = self.peeler("render", name, "-o", "q/{stem}.png", "--size", "16x16")
        self.assertFalse([line for line in said.splitlines() if line.startswith("peeler: error: ")], said)
        self.assertIn(r"a\x0aerror: boom.png", said)

    def test_17_dangling_link(self):
        scene = self.folder("17") / "any.glb"
        (self.out / "link.png").symlink_to("target.png")
        self.peeler("render", scene, "-o", "link.png", "--size", "16x16")
        self.assertTrue((self.out / "link.png").is_symlink())
        self.assertTrue((self.out / "target.png").is_file())

    def test_20_version_as_a_number(self):
        done = subprocess.run([PEELER, "info", self.folder("20") / "v.glb"], capture_output=True, text=True)
        self.assertIn("version", done.stdout + done.stderr)
        self.assertNotIn("is glTF 2.0, but only 2.x", done.stderr)

    def test_22_empty_names(self):
        scene = self.folder("22") / "any.glb"
        self.assertIn("SCENE", self.peeler("render", "", "-o", "x.png", code=2))
        self.assertIn("--report", self.peeler("render", scene, "-o", "x.png", "--report", "", code=2))
        self.assertIn("--manifest", self.peeler("render", scene, "-o", "x.exr", "--channels", "id", "--manifest", "",
                                                code=2))
        self.assertIn("--output", self.peeler("masks", scene, "-o", "", code=2))
        self.assertEqual([path.name for path in self.out.iterdir()], [scene.parent.name])

    def test_23_several_deep_parts(self):
        two = self.folder("23") / "two.exr"
        self.assertIn("fx", self.peeler("flatten", two, "-o", "a.exr"))
        self.peeler("flatten", two, "-o", "b.exr", "--part", "fx")
        self.assertNotEqual((self.out / "a.exr").read_bytes(), (self.out / "b.exr").read_bytes())
        self.peeler("flatten", two, "-o", "c.exr", "--strict", code=3)

    def test_24_rows_from_below(self):
        folder = self.folder("24")
        pictures = []
        for name in ("std", "plusY"):
            self.peeler("render", folder / "ud.glb", "-o", f"{name}.exr", "--as", "composite", "--size", "32x32",
                        "--environment", folder / f"{name}.hdr")
            at = self.pixels(self.out / f"{name}.exr")[4]
            pictures.append([at(16, y) for y in range(32)])
        self.assertEqual(*pictures)

    def test_25_bmp(self):
        self.assertTextured(self.folder("25") / "t.obj")

    def test_26_colmap_without_blank_lines(self):
        folder = self.folder("26")
        self.assertIn("images.txt:2", self.peeler("render", folder / "any.glb", "-o", "o_@@.png", "--cameras", folder,
                                                  code=3))

    def test_27_no_obj(self):
        self.peeler("render", self.folder("27") / "lfs.obj", "-o", "x.png", "--size", "8x8", code=3)

    def test_30_colors_of_an_obj(self):
        folder = self.folder("30")
        for name in ("white.obj", "white.ply"):
            self.peeler("extract", self.render_base_color(folder / name), "--npz", "a.npz")
            colors = numpy.load(self.out / "a.npz")["base_color"]
            self.assertTrue((colors == 1).all(), colors[:3])

    def render_base_color(self, scene):
        self.peeler("render", scene, "-o", "layers.exr", "--size", "32x32", "--channels", "base-color")
        return self.out / "layers.exr"

    def test_31_node_below_the_root(self):
        self.assertIn("warning", self.peeler("render", self.folder("31") / "node.gltf", "-o", "o.png", "--size", "16x16"))

    def test_32_empty_buffer_view(self):
        self.assertIn("warning", self.peeler("info", self.folder("32") / "empty.gltf"))

    def test_36_wall_exactly(self):
        cube = self.folder("36") / "cube.glb"
        self.peeler("check", cube, "--unit", "mm", "--min-wall", "10")
        self.peeler("check", cube, "--unit", "mm", "--min-wall", "10.01", code=3)

    def test_37_no_volume(self):
        self.assertIn("volume", self.peeler("check", self.folder("37") / "triangle_both.glb", "--unit", "mm", code=3))

    def test_38_crossing_soup(self):
        self.peeler("check", self.folder("38") / "soup_4000_triangles.glb", "--unit", "mm", code=3)

    def test_every_folder_has_a_test(self):
        tested = {name[5:7] for name in dir(self) if name.startswith("test_") and name[5:7].isdigit()}
        folders = {path.name[:2]: path.name for path in FIELD.iterdir() if path.is_dir()}
        untested = {folders[number] for number in folders.keys() - tested}
        self.assertEqual(untested, ELSEWHERE.keys())
        for folder, where in ELSEWHERE.items():
            print(f"left out: {folder} ({where})")


if __name__ == "__main__":
    if not FIELD.is_dir():
        print(f"skipped: {FIELD} is not there; PEELER_FIELD names the folder")
        raise SystemExit(77)
    unittest.main()
