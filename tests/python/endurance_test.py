# SPDX-License-Identifier: Apache-2.0
"""Tests that many renders and loads in one process do not increase its memory, descriptors or threads.

Mesa's software rasteriser keeps GL objects in the memory of the process, so leaked objects would increase it. With
PEELER_TEST_ALL there are 50,000 renders and 3,000 loads.
"""

import ctypes
import gc
import unittest

from module import ALL, ModuleTest, descriptors, np, peeler, resident, scene, threads

RENDERS, LOADS = (50_000, 3_000) if ALL else (600, 60)
WARM = 60  # the number of renders after which drivers and allocators have filled their caches
MOST_GROWTH = 6 << 20  # bytes of allocator overhead; a leak of 130 bytes per render would exceed it in 50,000 renders

LIBC = ctypes.CDLL("libc.so.6")


def state():
    gc.collect()
    LIBC.malloc_trim(0)  # returns cached free memory to the system, so that it does not count
    return resident(), descriptors(), threads()


class Endurance(ModuleTest):
    def assert_flat(self, what, work, count, warm=WARM):
        for i in range(warm):
            work(i)
        before = state()
        for i in range(count):
            work(i)
        after = state()
        print(f"{count} {what}: {after[0] - before[0]:+} bytes, {after[1] - before[1]:+} descriptors")
        self.assertLess(after[0] - before[0], MOST_GROWTH)
        self.assertEqual(after[1:], before[1:])

    def test_renders(self):
        rng = np.random.default_rng(2)
        vertices = rng.uniform(-1, 1, (30, 3))
        soup = peeler.Scene.from_arrays(vertices, np.arange(30).reshape(-1, 3), double_sided=True, alpha_mode="BLEND",
                                        base_color=(0.8, 0.5, 0.3, 0.6))
        calls = (
            lambda i: self.r.layers(soup, size=(64, 64), eye=(3, i % 7, 3), channels=["id", "normal"]).z.sum(),
            lambda i: self.r.composite(soup, size=(64, 64), method=("dual", "a-buffer")[i // 4 % 2]),
            lambda i: self.r.layers(soup, size=(64, 64), layers=2).dense(2),
            lambda i: len(self.r.rays(soup, direction=(0, i % 5, 1), resolution=64, engine="gl")),
        )
        self.assert_flat("renders of 64 x 64", lambda i: calls[i % 4](i), RENDERS)

    def test_loads(self):
        names = ("coincident", "panes")

        def load(i):
            loaded = scene(names[i % 2])
            if i % 10 == 0:  # drops uploaded scenes too
                self.r.layers(loaded, size=(16, 16))

        self.assert_flat("loads of scenes", load, LOADS)

    def test_renderers(self):
        def make(_):
            with peeler.Renderer() as r:
                r.layers(scene("panes"), size=(16, 16))

        self.assert_flat("Renderers", make, 200 if ALL else 4, 60 if ALL else 4)

    def test_errors(self):
        panes = scene("panes")

        def stop(_):
            raise ZeroDivisionError

        def fail(i):
            try:
                keywords = ({"camera": "nobody"}, {"progress": stop}, {"K": np.eye(2)}, {"sizes": 1})[i % 4]
                self.r.layers(panes, size=(200, 200), **keywords)
            except (peeler.Error, ZeroDivisionError, TypeError):
                pass

        def errors(i):
            for kind in range(4):
                fail(kind)
            # Render again, because the memory kept by a stopped render depends on where it stopped.
            self.r.layers(panes, size=(200, 200))

        self.assert_flat("rounds of errors", errors, RENDERS // 40)


if __name__ == "__main__":
    unittest.main()
