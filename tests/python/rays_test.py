# SPDX-License-Identifier: Apache-2.0
"""Tests that rays of the Python module give the same hits as `peeler rays`."""

import json
import unittest

from module import SCENES, ModuleTest, command, np, peeler, scene

ENGINE = ("--engine", "cpu")


class Rays(ModuleTest):
    def test_hits_are_those_of_the_command_line(self):
        panes = scene("panes")
        for options, keywords in (
            (["--direction", "0,0,1"], {"direction": (0, 0, 1)}),
            (["--direction", "1,0,0", "--direction", "0,-1,0.5"], {"direction": [(1, 0, 0), (0, -1, 0.5)]}),
            (["--directions", "3", "--hemisphere"], {"directions": 3, "hemisphere": True}),
            (["--axes", "--faces", "front", "--no-refine"], {"axes": True, "faces": "front", "refine": False}),
        ):
            with self.subTest(str(keywords)):
                npz = self.folder / "hits.npz"
                command("rays", SCENES / "panes.glb", "-o", npz, *options, "--resolution", "64", *ENGINE)
                hits = self.r.rays(panes, resolution=64, engine="cpu", **keywords)
                there = np.load(npz)
                for column in hits.columns:
                    self.assert_same(hits[column], there[column], column)
                self.assertTrue(np.array_equal(hits.splits, there["ray_splits"]))
                self.assert_same(hits.t, there["t_hit"])
                self.assertEqual(len(hits), len(there["t_hit"]))
                for i, bundle in enumerate(hits.bundles):
                    self.assert_same(bundle["direction"], there["bundle_direction"][i])
                    self.assert_same(bundle["origin"], there["bundle_origin"][i])
                hits.save(self.folder / "saved.npz")
                self.assertEqual((self.folder / "saved.npz").read_bytes(), npz.read_bytes())

    def test_one_bundle_is_not_copied(self):
        hits = self.r.rays(scene("panes"), direction=(0, 0, 1), resolution=64, columns=["t_hit", "node_ids"])
        self.assertTrue(np.shares_memory(hits.z, hits.images[0].z))
        self.assertTrue(np.shares_memory(hits.splits, hits.images[0].splits))
        self.assertEqual(hits.columns, ["t_hit", "node_ids"])
        with self.assertRaises(KeyError):
            hits["normals"]

    def test_rays_of_a_camera_hit_what_a_picture_shows(self):
        panes = scene("panes")
        img = self.r.layers(panes, size=(64, 36))
        hits = self.r.rays(panes, camera=0, size=(64, 36), engine="gl")
        self.assertTrue(np.array_equal(hits.splits, img.splits))
        self.assertLess(np.abs(hits.z - img.z).max(), 1e-3)

    def test_rays_hit_the_splats_that_a_picture_shows(self):
        knot = scene("splats", include="knot")
        img = self.r.layers(knot, size=(64, 36), splat_order="ray", precision="float")
        hits = self.r.rays(knot, camera=0, size=(64, 36), columns=["t_hit", "base_color"])
        self.assertTrue(np.array_equal(hits.splits, img.splits))
        self.assertLess(np.abs(hits.z - img.z).max(), 1e-5)
        color = hits["base_color"]
        self.assertLess(np.abs(color[:, 3] - img.rgba[:, 3]).max(), 1e-6)
        self.assertLess(np.abs(color[:, :3] * color[:, 3:] - img.rgba[:, :3]).max(), 1e-5)

    def test_lenses_and_lists_of_rays(self):
        """The module uses the worker; a batch and the command line give the same."""
        camera = {"lens": "opencv-fisheye", "distortion": (0.1, -0.02, 0, 0), "intrinsics": (24, 24, 31.5, 23.5),
                  "size": (64, 48), "eye": (0.5, 0.4, 2)}
        options = {"lens": "opencv-fisheye", "distortion": "0.1,-0.02,0,0", "intrinsics": "24,24,31.5,23.5",
                   "size": "64x48", "eye": "0.5,0.4,2"}
        npz, batch, jobs = self.folder / "lens.npz", self.folder / "batch.npz", self.folder / "jobs.jsonl"
        command("rays", SCENES / "panes.glb", "-o", npz, *(f"--{key}={value}" for key, value in options.items()))
        job = {"verb": "rays", "args": [str(SCENES / "panes.glb"), "-o", str(batch)], "options": options}
        jobs.write_text(json.dumps(job))
        command("batch", jobs)
        self.assertEqual(batch.read_bytes(), npz.read_bytes())
        hits, there = self.r.rays(scene("panes"), **camera), np.load(npz)
        self.assertGreater(len(hits), 100)
        for column in hits.columns:
            self.assert_same(hits[column], there[column], column)
        self.assertTrue(np.array_equal(hits.z, hits.t))
        picture = self.r.ray_maps(scene("panes"), map=["base-color", "first"], **camera)[0]
        self.assertEqual(list(picture), ["R", "G", "B", "A", "first"])
        self.assertTrue(((picture["A"] > 0) == np.isfinite(picture["first"])).all())

        rays = np.zeros((2, 6))
        rays[:, 2], rays[:, 5] = 2, (-1, 1)  # towards the panes, and away from them
        np.save(self.folder / "rays.npy", rays)
        listed = self.r.rays(scene("panes"), rays=self.folder / "rays.npy")
        self.assertGreater(listed.splits[1], 0)
        self.assertEqual(listed.splits[2], listed.splits[1])
        self.assertTrue(np.array_equal(listed.z, listed.t))

    def test_maps(self):
        maps = self.r.ray_maps(scene("bracket"), map=["thickness", "count", "first"], direction=(0, 1, 0),
                               resolution=80, engine="cpu")
        self.assertEqual(list(maps[0]), ["thickness", "count", "first"])
        hits = self.r.rays(scene("bracket"), direction=(0, 1, 0), resolution=80, engine="cpu")
        counts = np.diff(hits.splits.astype(np.int64))
        self.assertTrue(np.array_equal(maps[0]["count"].ravel(), counts))
        self.assertTrue((np.isinf(maps[0]["first"].ravel()) == (counts == 0)).all())
        self.assertGreater(maps[0]["thickness"].max(), 0)
        path = self.folder / "map.exr"
        found = command("rays", SCENES / "bracket.glb", "-o", path, "--map", "thickness", "--direction", "0,1,0",
                        "--resolution", "80", *ENGINE, "--json")
        self.assertIn(f'"greatest": {maps[0]["thickness"].max():.6}'[:16], found)

    def test_voxels(self):
        npz = self.folder / "voxels.npz"
        command("rays", SCENES / "bracket.glb", "-o", npz, "--voxels", "24", *ENGINE)
        found, there = self.r.voxels(scene("bracket"), 24, engine="cpu"), np.load(npz)
        for name in ("occupancy", "votes", "corner"):
            self.assert_same(found[name], there[name], name)
        self.assertEqual(found["occupied"], there["occupancy"].sum())

    def test_parity(self):
        found = self.r.parity(scene("bracket"), directions=4, resolution=64, engine="cpu")
        self.assertTrue(found["holds"], found)
        vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
        triangle = peeler.Scene.from_arrays(vertices, [[0, 1, 2]], name="open")
        found = self.r.parity(triangle, direction=(0, 0, 1), resolution=32, engine="cpu")
        self.assertFalse(found["holds"])
        self.assertEqual(found["solids"][0]["node"], "open")

    def test_hits_next_to_points(self):
        """The points lie between two squares, at z = 0 and z = 1."""
        square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
        both = peeler.Scene.from_arrays(np.vstack((square, square + [0, 0, 1])),
                                        [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
        hits = self.r.rays(both, direction=(0, 0, 1), resolution=32, engine="cpu")
        next_to = hits.next_to([[0.1, 0.2, 0.25], [0.3, -0.4, 2]])
        self.assertTrue(np.allclose(next_to["t_before"], [[0.25, 1]]))
        self.assertTrue(np.allclose(next_to["t_after"], [[0.75, np.inf]]))


class Findings(ModuleTest):
    def test_what_vertices_see(self):
        square = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], float)
        found = peeler.bake_scene(peeler.Scene.from_arrays(square, [[0, 1, 2], [0, 2, 3]]), directions=64)
        self.assertEqual((found["values"].shape, found["values"].dtype), ((4, 1), np.float32))
        self.assertTrue(np.allclose(found["values"], 1))
        self.assertTrue(np.allclose(found["normals"], [0, 1, 0]))
        self.assertTrue(np.allclose(found["positions"], square))
        self.assertEqual(found["ranges"][0]["count"], 4)
        self.assert_error("usage", peeler.bake_scene, scene("panes"), output="x.glb")

    def test_whether_parts_can_be_printed(self):
        found = peeler.check_scene(scene("bracket"))
        there = peeler.check(SCENES / "bracket.glb")
        for key in ("verdict", "volume", "parts"):
            self.assertEqual(found[key], there[key])

    def test_pictures_compared(self):
        a = self.r.layers(scene("panes"), size=(64, 36))
        b = self.r.layers(scene("panes"), size=(64, 36), shading="unlit")
        self.assertTrue(peeler.compare_images(a, a)["identical"])
        self.assertFalse(peeler.compare_images(a, b)["identical"])
        self.assert_error("usage", peeler.compare_images, a, self.r.layers(scene("panes"), size=(32, 36)))


if __name__ == "__main__":
    unittest.main()
