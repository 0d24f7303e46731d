# SPDX-License-Identifier: Apache-2.0
"""Every layer of a glTF scene, headless, as NumPy arrays.

    import peeler
    scene = peeler.Scene("engine.glb")
    with peeler.Renderer() as r:
        img = r.layers(scene, size=(1280, 720), channels=["normal", "id"])
        img.z, img.rgba, img.splits, img["normal"]  # CSR: pixel p has the fragments splits[p] up to splits[p + 1]

Scene, Renderer, Image, Composite and Hits hold data; check_scene, bake_scene, compare_images and merge_images work on
them, and views places cameras around them. Functions named like the verbs of the command line (bake, check, compare, convert, devices, extract, flatten,
info, masks, merge, rays, render, sheet, verify, view) run these verbs, from files to files.
A worker, a process of the program `peeler`, does all the work. The first call starts it: $PEELER, the program that was
built or installed with this module, or the one in the path. `await peeler.aio(r.layers, scene)` waits for a call
without blocking an event loop. Lengths are in scene units, space is right-handed with +Y up, colours are linear
Rec. 709.
"""

from . import _options, _verbs
from ._error import Error
from ._images import Composite, Image, compare_images, merge_images, read
from ._rays import Hits
from ._renderer import Renderer, bake_scene, check_scene
from ._scenes import Scene
from ._views import views
from ._worker import aio

__version__ = _options.description()["version"]
__all__ = [
    "Composite", "Error", "Hits", "Image", "Renderer", "Scene", "aio", "bake_scene", "check_scene", "compare_images",
    "merge_images", "read", "views", *_verbs.NAMES,
]  # fmt: skip

for _name in _verbs.NAMES:
    globals()[_name] = _verbs.function(_name)
del _name
aio.__module__ = __name__
