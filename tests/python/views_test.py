# SPDX-License-Identifier: Apache-2.0
"""Tests views around scenes, and normalized scenes."""

import pickle
import unittest

from module import SCENES, ModuleTest, command, np, peeler, scene


class Views(ModuleTest):
    def test_are_those_of_the_command_line(self):
        model, options = scene("coincident"), {"around": "orbit", "size": (32, 24), "distance": 3}
        command("render", SCENES / "coincident.glb", "-o", self.folder / "@@@@.safetensors", "--views", 3,
                "--around", "orbit", "--size", "32x24", "--distance", 3)
        views = peeler.views(3, model, **options)
        self.assertEqual(len(views), 3)
        middle = np.append(model.bounds.mean(axis=0), 1)
        for number, view in enumerate(views):
            np.testing.assert_allclose(view["world_to_camera"] @ middle, [0, 0, 3, 1], atol=1e-12)
            there = peeler.read(self.folder / f"{number:04}.safetensors")
            here = self.r.layers(model, **view)
            self.assertEqual(here.size, (32, 24))
            self.assert_same(here.splits, there.splits)
            np.testing.assert_allclose(here.z, there.z, rtol=1e-6)
            self.assert_same(here.K, view["K"])
            self.assertGreater(len(self.r.rays(model, engine="cpu", **view)), 0)

    def test_without_a_scene_surround_normalized_scenes(self):
        model = scene("coincident").normalized()
        views = peeler.views(4, around="random", seed=7, size=(24, 24), near=0.1)
        self.assertEqual([view["near"] for view in views], [0.1] * 4)
        for view in views:
            origin = view["world_to_camera"] @ [0, 0, 0, 1]
            np.testing.assert_allclose(origin[:2], 0, atol=1e-12)
            self.assertGreater(origin[2], np.sqrt(3) / 2)
            alpha = np.asarray(self.r.composite(model, **view))[..., 3]
            self.assertGreater(alpha.max(), 0)
            for border in (alpha[0], alpha[-1], alpha[:, 0], alpha[:, -1]):
                self.assertEqual(border.max(), 0)

    def test_wrong_calls(self):
        self.assert_error("usage", peeler.views, 2.5)
        self.assert_error("usage", peeler.views, 0)
        self.assert_error("usage", peeler.views, 2, around="orbi")
        with self.assertRaisesRegex(TypeError, "views"):
            peeler.views(2, arround="orbit")
        with self.assertRaises(TypeError):
            peeler.views(2, "engine.glb")


class Normalized(ModuleTest):
    def test_scenes(self):
        box = peeler.Scene.from_arrays([(1, 1, 1), (5, 1, 1), (1, 3, 1)])
        for model in (box, scene("coincident")):
            unit = model.normalized()
            np.testing.assert_allclose(unit.bounds.mean(axis=0), 0, atol=1e-12)
            self.assertAlmostEqual(np.ptp(unit.bounds, axis=0).max(), 1)
            np.testing.assert_allclose(unit.bounds, pickle.loads(pickle.dumps(unit)).bounds)
            self.assertEqual(unit.nodes, model.nodes)
            self.assertGreater(np.ptp(model.bounds, axis=0).max(), 1)  # the original is as it was
        # The middle of the bounds is (3, 2, 1). The farthest vertex is at distance sqrt(5) from it.
        sphere = box.normalized("unit-sphere")
        np.testing.assert_allclose(sphere.bounds[1], [2 / np.sqrt(5), 1 / np.sqrt(5), 0], atol=1e-6)

    def test_pictures_are_those_of_render(self):
        command("render", SCENES / "coincident.glb", "-o", self.folder / "a.safetensors", "--normalize", "unit-sphere",
                "--size", "32x24", "--eye", "0,1,3", "--target", "0,0,0")
        there = peeler.read(self.folder / "a.safetensors")
        model = scene("coincident").normalized("unit-sphere")
        here = self.r.layers(model, size=(32, 24), eye=(0, 1, 3), target=(0, 0, 0))
        self.assert_same(here.z, there.z)
        self.assert_same(here.splits, there.splits)

    def test_what_cannot_be_normalized_is_refused(self):
        self.assert_error("usage", scene("coincident").normalized, "cube")
        self.assert_error("usage", peeler.check_scene, scene("bracket").normalized())


if __name__ == "__main__":
    unittest.main()
