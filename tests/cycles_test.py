# SPDX-License-Identifier: Apache-2.0
"""Tests distances through panoramic lenses with a witness: Blender's Cycles renders the same scene from the same point."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[1]
SCENE = SOURCE / "examples" / "scenes" / "engine.glb"
EYE = (0, 0.12, 0)  # in the gearbox

# Blender's Z points up, so it turns glTF's scene by 90 degrees. Debian 12's importer needs names that NumPy 1.24 lacks.
RENDER = """
import math, sys
import numpy
for name, kind in (("bool", bool), ("int", int), ("float", float), ("object", object)):
    if name not in numpy.__dict__: setattr(numpy, name, kind)
import bpy
scene_file, out, kind, width, height, x, y, z = sys.argv[sys.argv.index("--") + 1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=scene_file)
scene = bpy.context.scene
camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
scene.collection.objects.link(camera)
scene.camera = camera
camera.location = float(x), -float(z), float(y)
camera.rotation_euler = math.pi / 2, 0, 0
camera.data.type = "PANO"
camera.data.clip_start, camera.data.clip_end = 1e-4, 1e3
camera.data.cycles.panorama_type = kind
camera.data.cycles.fisheye_fov = math.radians(200)
scene.render.engine = "CYCLES"
scene.cycles.samples, scene.cycles.filter_width = 1, 0.01
scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = int(width), int(height), 100
scene.view_layers[0].use_pass_z = True
scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
scene.render.image_settings.color_depth = "32"
scene.render.filepath = out
bpy.ops.render.render(write_still=True)
"""


class Cycles(unittest.TestCase):
    def distances(self, kind, width, height, lens):
        """Returns the distances to the first surface: peeler's and Cycles'."""
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "render.py").write_text(RENDER, encoding="utf-8")
            subprocess.run(["blender", "-b", "--python-exit-code", "1", "--python", folder / "render.py", "--", SCENE,
                            folder / "cycles.exr", kind, str(width), str(height), *map(str, EYE)],
                           check=True, capture_output=True)
            subprocess.run([os.environ["PEELER"], "rays", SCENE, "-o", folder / "peeler.npz", "--map", "first",
                            "--faces", "both", "--eye", ",".join(map(str, EYE)), "--target",
                            f"{EYE[0]},{EYE[1]},{EYE[2] - 1}", "--size", f"{width}x{height}", *lens, "--quiet"], check=True)
            ours = np.load(folder / "peeler.npz")["first.0"].reshape(height, width)
            theirs = oiio.ImageBuf(str(folder / "cycles.exr"))
            names = theirs.spec().channelnames
            return ours, theirs.get_pixels(oiio.FLOAT)[:, :, names.index("ViewLayer.Depth.Z")]

    def expect_equal(self, ours, theirs):
        error = np.abs(ours - theirs) / theirs
        print(f"{len(error)} distances: half of them differ by less than {np.median(error):.1e}, the most by {error.max():.1e}")
        self.assertLess(np.median(error), 1e-5)
        self.assertLess(np.quantile(error, 0.99), 1e-4)
        self.assertLess(error.max(), 1e-3)

    def test_all_directions(self):
        ours, theirs = self.distances("EQUIRECTANGULAR", 512, 256, ["--lens", "equirectangular"])
        self.expect_equal(ours.ravel(), theirs.ravel())

    def test_a_fisheye_beyond_180_degrees(self):
        ours, theirs = self.distances("FISHEYE_EQUIDISTANT", 256, 256, ["--lens", "fisheye", "--fov", "200"])
        seen = theirs < 1e9  # Cycles' picture is a circle
        self.assertGreater(seen.sum(), 50_000)
        self.expect_equal(ours[seen], theirs[seen])


if __name__ == "__main__":
    if not shutil.which("blender"):
        print("skipped: blender is missing")
        sys.exit(77)
    try:
        import numpy as np
        import OpenImageIO as oiio
    except ImportError as error:
        print(f"skipped: {error}")
        sys.exit(77)
    unittest.main()
