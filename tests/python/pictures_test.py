# SPDX-License-Identifier: Apache-2.0
"""Tests that pictures of the Python module equal the files of the command line, and are not copied."""

import shutil
import subprocess
import unittest

from module import SCENES, ModuleTest, command, np, peeler, resident, scene


def owner(array):
    """Returns the object that owns an array's memory."""
    while isinstance(array, np.ndarray):
        array = array.base
    return array


class Pictures(ModuleTest):
    def test_arrays_are_those_of_extract(self):
        for name, keywords, options in (
            ("engine", {"channels": ["normal", "id"]}, ["--channels", "normal,id"]),
            ("glasses", {"channels": "all"}, ["--channels", "all"]),
            ("coincident", {"precision": "float", "layers": 3}, ["--precision", "float", "--layers", "3"]),
        ):
            with self.subTest(name):
                exr, npz = self.folder / f"{name}.exr", self.folder / f"{name}.npz"
                command("render", SCENES / f"{name}.glb", "-o", exr, "--size", "160x90", *options)
                command("extract", exr, "--npz", npz)
                img = self.r.layers(scene(name), size=(160, 90), **keywords)
                there = np.load(npz)
                self.assert_same(img.z, there["z"])
                self.assert_same(img.rgba, there["rgba"])
                self.assertTrue(np.array_equal(img.splits, there["ray_splits"]))
                if "opacity" in there:
                    self.assert_same(img.opacity, there["opacity"])
                else:
                    self.assertIsNone(img.opacity)
                if "id" in img:
                    self.assert_same(img["id.object"] - np.uint32(1), there["node_ids"])
                    self.assert_same(img["id"][:, 2] - np.uint32(1), there["primitive_ids"])
                if "position" in img:
                    self.assert_same(img["position"], there["positions"])
                    self.assert_same(img["distance"], there["t_hit"])
                    self.assert_same(img["uv"], there["texcoords"])
                # The saved files equal those of the command line byte for byte.
                img.save(self.folder / "saved.exr")
                self.assertEqual((self.folder / "saved.exr").read_bytes(), exr.read_bytes())
                img.save(self.folder / "saved.npz")
                self.assertEqual((self.folder / "saved.npz").read_bytes(), npz.read_bytes())

    def test_composites_are_those_of_render(self):
        exr = self.folder / "flat.exr"
        command("render", SCENES / "panes.glb", "-o", exr, "--size", "96x54", "--method", "dual",
                "--as", "composite", "--precision", "float")
        flat = self.r.composite(scene("panes"), size=(96, 54), method="dual", precision="float")
        flat.save(self.folder / "saved.exr")
        difference = peeler.compare(exr, self.folder / "saved.exr")
        self.assertTrue(difference["identical"], difference)
        layered = self.r.layers(scene("panes"), size=(96, 54), precision="float").flatten()
        self.assertLess(np.abs(flat.rgba - layered.rgba).max(), 1e-5)
        self.assertEqual(flat.rgba.shape, (54, 96, 4))
        self.assertTrue(np.isinf(flat.z[flat.rgba[..., 3] == 0]).all())

    def test_no_copy_is_made(self):
        engine = scene("engine")
        keywords = {"size": (960, 540), "channels": ["normal", "id", "position"]}
        warm = self.r.layers(engine, **keywords)  # allocates the renderer's own memory
        before = resident()
        img = self.r.layers(engine, **keywords)
        arrays = [img.z, img.rgba, img.splits, *(img[c] for c in img.channels), img["N.X"]]
        grown = resident() - before
        taken = sum(a.nbytes for a in arrays[:-1])
        print(f"{taken} bytes of arrays, {grown} bytes more resident")
        self.assertGreater(taken, 30e6)
        self.assertLess(grown, 1.35 * taken)
        for array in arrays:
            self.assertTrue(array.flags.writeable)
            if array is not arrays[2]:  # `splits`, whose 32-bit numbers have memory of their own
                self.assertIs(owner(array), owner(img.z))
        self.assertTrue(np.shares_memory(arrays[0], img.z))
        self.assertTrue(np.shares_memory(arrays[-1], img["normal"]))
        self.assertEqual(len(warm), len(img))
        z = img.z
        del img, arrays, array  # an array keeps its memory alive
        self.assert_same(z, warm.z)

    @unittest.skipUnless(hasattr(np, "from_dlpack"), "needs NumPy 1.22")
    def test_dlpack(self):
        img = self.r.layers(scene("coincident"), size=(64, 36), channels=["id"])
        for array in (img.z, img.rgba, img.splits, img["id"]):
            shared = np.from_dlpack(array)
            self.assertTrue(np.shares_memory(shared, array))
            self.assert_same(shared, array)

    def test_types(self):
        img = self.r.layers(scene("coincident"), size=(64, 36), channels=["id", "normal"])
        self.assertEqual((img.z.dtype, img.rgba.dtype, img.splits.dtype), (np.float32, np.float16, np.uint32))
        self.assertEqual((img["id"].dtype, img["normal"].dtype), (np.uint32, np.float16))
        self.assertEqual(img["normal"].shape, (len(img), 3))
        self.assertEqual(img.shape, (36, 64))
        self.assertEqual(img.splits.shape, (36 * 64 + 1,))
        self.assertEqual(img.objects, scene("coincident").nodes)
        with self.assertRaises(KeyError):
            img["norml"]
        self.assertIn("normal", str(img))

    def test_dense(self):
        img = self.r.layers(scene("coincident"), size=(64, 36), channels=["id", "normal"])
        z = img.dense(8, fill=float("nan"))
        self.assertEqual((z.shape, z.dtype), ((36, 64, 8), np.float32))
        counts = np.diff(img.splits.astype(np.int64)).reshape(36, 64)
        self.assert_same(counts.astype(np.uint32), img.counts)
        self.assertTrue((np.minimum(counts, 8) == (~np.isnan(z)).sum(axis=2)).all())
        y, x = np.argwhere(counts > 1)[0]
        first = img.splits[y * 64 + x]
        self.assert_same(z[y, x, : counts[y, x]], img.z[first : first + counts[y, x]])
        ids = img.dense(2, "id.object", fill=7)
        self.assertEqual((ids.dtype, ids[0, 0].tolist() if counts[0, 0] == 0 else [7, 7]), (np.uint32, [7, 7]))
        self.assert_same(ids[y, x], img["id"][first : first + 2, 0])
        self.assertEqual(img.dense(channel="normal").shape, (36, 64, img.layers, 3))
        self.assert_same(img.dense(1)[..., 0], img.layer(0).dense(1)[..., 0])
        self.assertEqual(img.nearest(2).layers, 2)

    def test_dense_is_what_files_have(self):
        engine = SCENES / "engine.glb"
        img = self.r.layers(scene("engine"), size=(64, 36), channels=["id", "normal"])
        file = self.folder / "dense.npz"
        peeler.render(engine, output=file, size=(64, 36), channels=["id", "normal"], dense=5, fill=float("nan"))
        there = np.load(file)
        self.assert_same(img.dense(5, fill=float("nan")), there["z"])
        self.assert_same(img.counts, there["count"])
        self.assert_same(img.dense(5, "rgba", fill=float("nan")).astype(np.float32), there["rgba"])
        self.assert_same(img.dense(5, "normal", fill=float("nan")).astype(np.float32), there["viewer_normals"])
        self.assert_same(img.dense(5, "id.object") - np.uint32(1), there["node_ids"])
        peeler.render(engine, output=file, size=(64, 36), dense=3, fill=-1, dense_type="half")
        self.assert_same(img.dense(3, fill=-1).astype(np.float16), np.load(file)["z"])
        img.save(file, dense=2, fill="last")
        self.assert_same(np.load(file)["z"][..., 0], img.dense(1, fill=float("nan"))[..., 0])
        self.assertEqual(np.load(file)["z"].shape, (36, 64, 2))
        peeler.rays(engine, output=file, camera="main", size=(64, 36), dense=4, engine="cpu")
        self.assertEqual(np.load(file)["t_hit"].shape, (36, 64, 4))
        self.assert_error("usage", peeler.render, engine, output=file, dense=0)
        self.assert_error("usage", img.save, self.folder / "x.exr", dense=2)

    @unittest.skipUnless(shutil.which("oiiotool"), "needs oiiotool")
    def test_parts_of_other_programs_are_warned_of_and_chosen(self):
        path = self.folder / "two.exr"
        part = lambda name, grey: ["--pattern", f"constant:color={grey},{grey},{grey},1", "4x3", "4",
                                   "--attrib", "oiio:subimagename", name]
        subprocess.run(["oiiotool", *part("a", 0.5), *part("b", 0.25), "--siappend", "-o", path], check=True)
        with self.assertWarnsRegex(UserWarning, '"b" is not read; part selects'):
            self.assertEqual(peeler.read(path).rgba[0, 0], 0.5)
        self.assertEqual(peeler.read(path, part="b", strict=True).rgba[0, 0], 0.25)
        self.assert_error("input", peeler.read, path, strict=True)
        self.assert_error("usage", peeler.read, path, part="c")
        self.assertRaises(TypeError, peeler.read, path, parts="b")

    def test_files_are_read_again(self):
        img = self.r.layers(scene("jellyfish"), size=(80, 60), channels=["id"], time=0.5)
        for keywords in ({}, {"as_": "deep"}, {"compression": "zip"}, {"layout": "per-file"}):
            path = self.folder / "again.exr"
            img.save(path, **keywords)
            again = peeler.read(path)
            for a, b in ((img.z, again.z), (img.rgba, again.rgba), (img.splits, again.splits), (img["id"], again["id"])):
                self.assert_same(a, b, keywords)
            self.assert_same(img.K, again.K)
            self.assertEqual(img.objects, again.objects)
            self.assertTrue(peeler.compare_images(img, again)["identical"])
        self.assert_same(img.flatten().rgba, peeler.read(path).flatten().rgba)
        positions = img.positions()
        self.assertEqual(positions.shape, (len(img), 3))
        least, greatest = scene("jellyfish").bounds
        self.assertTrue((positions >= least - 5).all() and (positions <= greatest + 5).all())

    def test_tiles_are_put_together(self):
        plant = scene("plant")
        whole = self.r.layers(plant, size=(60, 80))
        tiles = [self.r.layers(plant, size=(60, 80), tile=f"{i}/3") for i in (1, 2, 3)]
        merged = peeler.merge_images(tiles)
        self.assert_same(whole.z, merged.z)
        self.assert_same(whole.splits, merged.splits)

    def test_pictures_for_notebooks(self):
        img = self.r.layers(scene("coincident"), size=(64, 36))
        for shown in (img, img.flatten()):
            png = shown._repr_png_()
            self.assertEqual(png[:8], b"\x89PNG\r\n\x1a\n")
            self.assertEqual((int.from_bytes(png[16:20], "big"), int.from_bytes(png[20:24], "big")), (64, 36))
        large = self.r.composite(scene("coincident"), size=(2100, 300))._repr_png_()
        self.assertEqual(int.from_bytes(large[16:20], "big"), 700)

    def test_repr_tells_something(self):
        self.assertIn("triangles", repr(scene("engine")))
        self.assertIn("fragments", repr(self.r.layers(scene("panes"), size=(32, 18))))


class Cameras(ModuleTest):
    def test_intrinsics_and_pose_are_opencvs(self):
        """Expects the vertices of a scene at the places that the formula gives."""
        rng = np.random.default_rng(1)
        # Small, separate triangles. The colour of each triangle is its number.
        places = rng.uniform(-1, 1, (12, 3))
        corner = np.array([[0, 0, 0], [0.06, 0, 0], [0, 0.06, 0]]) - [0.02, 0.02, 0]
        vertices = (places[:, None] + corner).reshape(-1, 3)
        dots = peeler.Scene.from_arrays(vertices, np.arange(36).reshape(-1, 3), double_sided=True)
        k = np.array([[700.0, 0, 251.3], [0, 820.0, 290.8], [0, 0, 1]])
        angle = 0.3
        e = np.array(
            [[np.cos(angle), 0, np.sin(angle), 0.1], [0, -1, 0, -0.2], [np.sin(angle), 0, -np.cos(angle), 4.5], [0, 0, 0, 1]]
        )
        self.assertAlmostEqual(np.linalg.det(e[:3, :3]), 1)
        for samples in (1, 8):
            img = self.r.layers(dots, size=(640, 480), K=k, world_to_camera=e, channels=["id"], samples=samples)
            self.assertEqual(img.shape, (480, 640))
            self.assertTrue(np.allclose(img.K, k) and np.allclose(img.world_to_camera, e))
            triangles = img["id.primitive"] - 1
            pixels = np.repeat(np.arange(480 * 640), np.diff(img.splits.astype(np.int64)))
            weight = img.rgba[:, 3].astype(float)
            for i, place in enumerate(places):
                x, y, z = e[:3, :3] @ place + e[:3, 3]
                at = np.array([k[0, 0] * x / z + k[0, 2], k[1, 1] * y / z + k[1, 2]])
                mine = triangles == i
                if not (5 < at[0] < 634 and 5 < at[1] < 474):
                    continue
                self.assertGreater(mine.sum(), 3)
                self.assertLess(abs(np.median(img.z[mine]) - z), 0.03)
                seen = np.average(np.stack((pixels[mine] % 640, pixels[mine] // 640), 1), axis=0, weights=weight[mine])
                self.assertLess(np.abs(seen - at).max(), 0.45 if samples == 1 else 0.12)

    def test_conventions_agree(self):
        engine = scene("engine")
        known = self.r.layers(engine, size=(160, 90), camera="main", near=0.01)
        same = self.r.layers(engine, size=(160, 90), K=known.K, gltf=known.gltf, near=0.01)
        moved = self.r.layers(engine, size=(160, 90), K=known.K, world_to_camera=known.world_to_camera[:3], near=0.01)
        shifted = self.r.layers(engine, size=(160, 90), K=known.K + [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]],
                                pixel_center=0.5, gltf=known.gltf, near=0.01)
        for other in (same, moved, shifted):
            self.assertEqual(other.window, (0, 0, 160, 90))
            self.assertLess(abs(len(other) - len(known)), 20)
        difference = peeler.compare_images(known, same)
        self.assertLess(difference["composite"]["rmse"], 0.01)

    def test_an_off_centre_picture_is_a_part_of_a_larger_one(self):
        engine = scene("engine")
        known = self.r.layers(engine, size=(160, 90), eye=(0.4, 0.3, 0.6))
        k = known.K.copy()
        k[0, 2] -= 40
        k[1, 2] -= 13
        part = self.r.layers(engine, size=(80, 60), K=k, gltf=known.gltf, near=known.near)
        same = self.r.layers(engine, size=(160, 90), eye=(0.4, 0.3, 0.6), crop=(40, 13, 80, 60))
        self.assertEqual(part.shape, same.shape)
        self.assertTrue(np.array_equal(part.splits, same.splits))
        self.assertLess(np.abs(part.z - same.z).max(), 1e-4)


if __name__ == "__main__":
    unittest.main()
