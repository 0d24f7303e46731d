# SPDX-License-Identifier: Apache-2.0
"""Tests that errors are reported and leave the Renderer usable, also in threads and processes."""

import multiprocessing
import os
import pickle
import signal
import threading
import time
import unittest
import warnings

from module import SCENES, ModuleTest, np, peeler, scene

TRIANGLE = [[-1, -1, 0], [1, -1, 0], [0, 1, 0]]


def lengths(names):
    """Runs in another process: renders the scenes, and returns their numbers of fragments."""
    with peeler.Renderer() as r:
        return [len(r.layers(scene(name), size=(48, 27))) for name in names]


class Errors(ModuleTest):
    def assert_usable(self):
        self.assertEqual(len(self.r.layers(scene("panes"), size=(32, 18))), self.fragments)

    def setUp(self):
        super().setUp()
        # Shells start background processes with SIGINT ignored.
        handler = signal.signal(signal.SIGINT, signal.default_int_handler)
        self.addCleanup(signal.signal, signal.SIGINT, handler)
        self.fragments = len(self.r.layers(scene("panes"), size=(32, 18)))

    def test_they_say_what_where_and_what_to_try(self):
        error = self.assert_error("input", peeler.Scene, "missing.glb")
        self.assertEqual((error.what, error.where), ("the file does not exist", "missing.glb"))
        self.assertIn("spelling", error.hint)
        self.assertIn("missing.glb", str(error))
        again = pickle.loads(pickle.dumps(error))
        self.assertEqual((again.kind, again.what, again.where, again.hint),
                         (error.kind, error.what, error.where, error.hint))
        error = self.assert_error("usage", self.r.layers, scene("panes"), camera="nobody")
        self.assertEqual(error.where, "camera nobody")
        error = self.assert_error("usage", self.r.layers, scene("panes"), camera="main", ortho_height=2)
        self.assertIn("ortho_height", error.what)
        self.assertNotIn("--", str(error))
        for name in ("a--size.glb", "--size.glb", "a `size` b.glb"):
            error = self.assert_error("input", peeler.Scene, self.folder / name)
            self.assertEqual(error.where, str(self.folder / name))
        self.assert_error("output", self.r.layers(scene("panes"), size=(8, 8)).save,
                          self.folder / "no" / "x.exr", no_mkdir=True)
        self.assert_error("incomplete", self.r.layers, scene("panes"), size=(32, 18), layers=1, strict=True)
        self.assert_error("usage", peeler.Renderer, backend="directx")
        self.assert_error("device", lambda: peeler.Renderer(device=99).device)
        self.assert_error("input", peeler.read, SCENES / "panes.glb")
        self.assert_usable()

    def test_keywords_that_are_none(self):
        for call in (self.r.layers, self.r.composite, self.r.rays, self.r.ray_maps):
            with self.assertRaisesRegex(TypeError, "did you mean '(size|crop|time)'"):
                call(scene("panes"), sizes=(1, 2))
        with self.assertRaisesRegex(TypeError, "did you mean 'variant'"):
            peeler.Scene(SCENES / "panes.glb", varian=1)
        for value in (True, object(), {1, "x"}, (1, 2, 3), -1, "big"):
            self.assert_error("usage", self.r.layers, scene("panes"), size=value)
        self.assert_usable()

    def test_arrays_of_wrong_shapes(self):
        for keywords in (
            {"vertices": np.zeros((3, 2))},
            {"vertices": np.zeros(9)},
            {"vertices": [["a"] * 3] * 3},
            {"vertices": np.full((3, 3), np.nan)},
            {"faces": [[0, 1]]},
            {"faces": [[0, 1, 3]]},
            {"faces": [[0, 1, -1]]},
            {"normals": np.zeros((2, 3))},
            {"uv": np.zeros((3, 3))},
            {"texture": np.zeros((4, 4, 3), np.uint8)},
            {"texture": np.zeros((4, 4), np.uint8), "uv": np.zeros((3, 2))},
            {"colors": np.zeros((3, 5))},
            {"alpha_mode": "GLASS"},
            {"vertices": np.zeros((3, 3), complex)},
            {"faces": [[0.0, 1.0, 2.0]]},
            {"faces": np.zeros((1, 3), bool)},
            {"colors": np.full((3, 3), 128)},  # int64 is NumPy's type for lists of int
            {"colors": np.full((3, 3), 128.0)},
            {"colors": np.full((3, 3), np.nan)},
            {"colors": np.ones((3, 3), bool)},
            {"texture": np.ones((4, 4, 3)), "uv": np.zeros((3, 2))},
            {"texture": np.full((4, 4, 3), 300), "uv": np.zeros((3, 2))},
        ):
            self.assert_error("usage", peeler.Scene.from_arrays, **{"vertices": TRIANGLE, "faces": [[0, 1, 2]], **keywords})
        panes = scene("panes")
        for keywords in (
            {"K": np.eye(4)},
            {"K": [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]},
            {"K": np.diag([-5.0, 5, 1])},
            {"K": np.eye(3), "fov": 40},
            {"world_to_camera": np.eye(3)},
            {"world_to_camera": 2 * np.eye(4)},
            {"world_to_camera": np.diag([1.0, 1, -1, 1])},
            {"world_to_camera": np.full((4, 4), np.nan)},
            {"gltf": np.eye(4), "world_to_camera": np.eye(4)},
            {"gltf": np.eye(4), "eye": (0, 0, 1)},
            {"pixel_center": 0.5},
        ):
            self.assert_error("usage", self.r.layers, panes, size=(32, 18), **keywords)
        self.assert_usable()

    def test_arrays_of_every_type_mean_the_same(self):
        colors = np.array([[1, 0.5, 0]] * 3)
        for factor, kind in ((1, np.float64), (1, np.float32), (255, np.uint8), (65535, np.uint16)):
            shown = peeler.Scene.from_arrays(TRIANGLE, colors=np.round(colors * factor).astype(kind)
                                             if factor > 1 else colors.astype(kind))
            image = self.r.layers(shown, size=(8, 8), shading="unlit", channels=["base-color"])
            np.testing.assert_allclose(image["base-color"][0][:3], colors[0], atol=0.003)

    def test_no_faces_are_nothing(self):
        for faces in (np.zeros((0, 3)), np.zeros((0, 3), int)):
            nothing = peeler.Scene.from_arrays(np.zeros((6, 3)), faces)
            self.assertIsNone(nothing.bounds)
            image = self.r.layers(nothing, size=(8, 8), eye=(0, 0, 3), target=(0, 0, 0))
            self.assertEqual(len(image.z), 0)
        self.assert_error("usage", peeler.Scene.from_arrays, TRIANGLE, np.zeros((0, 2), int))

    def test_empty_names(self):
        self.assert_error("usage", peeler.Scene, "")
        self.assert_error("usage", peeler.render, "", output=self.folder / "x.png")
        self.assert_error("usage", peeler.render, SCENES / "panes.glb", output="")
        self.assert_error("usage", peeler.render, SCENES / "panes.glb", output=self.folder / "x.png", report="")
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_what_a_callback_raises_ends_the_render(self):
        calls = []

        def stop(share):
            calls.append(share)
            raise ValueError("enough")

        for _ in range(3):
            with self.assertRaisesRegex(ValueError, "enough"):
                self.r.layers(scene("engine"), size=(1200, 900), samples=4, progress=stop)
            self.assert_usable()
        self.assertEqual(len(calls), 3)
        with self.assertRaisesRegex(ValueError, "enough"):
            peeler.bake(SCENES / "engine.glb", output=self.folder / "x.glb", progress=stop)
        self.assertEqual(list(self.folder.iterdir()), [])
        with self.assertRaises(TypeError):
            self.r.layers(scene("panes"), progress=3)

    def test_what_a_callback_raises_ends_all_pictures(self):
        def stop(share):
            calls.append(share)
            raise ValueError("enough")

        def interrupt(share):
            calls.append(share)
            signal.raise_signal(signal.SIGINT)

        two = (SCENES / "panes.glb", SCENES / "coincident.glb")
        for verb, scenes, output in (
            (peeler.render, two[:1], "x@@.png"),
            (peeler.render, two, "{stem}@@.png"),
            (peeler.masks, two[:1], "masks"),
            (peeler.sheet, two[:1], "x@@.png"),
            (peeler.rays, two[:1], "x@@.npz"),
        ):
            for callback, error in ((stop, ValueError), (interrupt, KeyboardInterrupt)):
                for keep_going in (False, True):
                    calls = []
                    with self.assertRaises(error):
                        verb(*scenes, output=self.folder / output, views=3, keep_going=keep_going,
                             progress=callback)
                    self.assertEqual(len(calls), 1, (verb, keep_going))

    def test_progress_grows_to_1(self):
        shares = []
        self.r.layers(scene("engine"), size=(1200, 900), progress=shares.append)
        self.assertEqual(shares, sorted(shares))
        self.assertEqual(shares[-1], 1)
        self.assertGreater(len(shares), 2)

    def test_a_callback_cannot_use_its_own_renderer(self):
        def again(_):
            self.r.layers(scene("panes"))

        self.assert_error("usage", self.r.layers, scene("engine"), size=(1200, 900), progress=again)
        self.assert_usable()

    def test_ctrl_c(self):
        engine = scene("engine")
        for _ in range(2):
            timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
            timer.start()
            start = time.monotonic()
            with self.assertRaises(KeyboardInterrupt):
                self.r.layers(engine, size=(3000, 2000), samples=16)
            timer.join()
            print(f"ended {time.monotonic() - start - 0.3:.2f} s after Ctrl-C")
            self.assert_usable()

    def test_python_runs_on(self):
        ticks, done = [], threading.Event()

        def tick():
            while not done.wait(0.01):
                ticks.append(0)

        thread = threading.Thread(target=tick)
        thread.start()
        self.r.layers(scene("engine"), size=(1000, 700))
        done.set()
        thread.join()
        self.assertGreater(len(ticks), 3)

    def test_closed(self):
        with peeler.Renderer() as r:
            self.assertTrue(r.device)
        self.assert_error("usage", r.layers, scene("panes"))
        r.close()
        self.assertIn("closed", repr(r))

    def test_two_renderers_in_two_threads(self):
        names = ["panes", "coincident", "glasses"] * 3
        results = {}

        def work(which):
            results[which] = lengths(names)

        both = [threading.Thread(target=work, args=(i,)) for i in range(2)]
        for thread in both:
            thread.start()
        for thread in both:
            thread.join()
        self.assertEqual(results[0], results[1])
        self.assertEqual(results[0][:3], results[0][3:6])

    def test_one_renderer_in_two_threads(self):
        found = []
        threads = [
            threading.Thread(target=lambda: found.extend(len(self.r.layers(scene("panes"), size=(32, 18))) for _ in range(5)))
            for _ in range(2)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(found, [self.fragments] * 10)

    def test_other_processes(self):
        here = lengths(["panes", "coincident"])
        with multiprocessing.get_context("spawn").Pool(2) as pool:
            self.assertEqual(pool.map(lengths, [["panes", "coincident"]] * 2), [here] * 2)

    def test_warnings_are_pythons(self):
        path = self.folder / "odd.gltf"
        path.write_text('{"asset": {"version": "2.0"}, "extensionsUsed": ["EXT_not_known"]}', encoding="utf-8")
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            odd = peeler.Scene(path)
        self.assertEqual([str(w.message) for w in caught], odd.warnings)


if __name__ == "__main__":
    unittest.main()
