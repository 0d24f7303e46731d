# SPDX-License-Identifier: Apache-2.0
"""Every layer of a glTF scene, headless, as NumPy arrays.

    import peeler
    scene = peeler.Scene("engine.glb")
    with peeler.Renderer() as r:
        img = r.layers(scene, size=(1280, 720), channels=["normal", "id"])
        img.z, img.rgba, img.splits, img["normal"]  # CSR: pixel p has the fragments splits[p] up to splits[p + 1]

Scene, Renderer, Image, Composite and Hits hold data; check_scene, bake_scene, compare_images and merge_images find
something in it. The functions that are called as the verbs of the command line (bake, check, compare, convert,
devices, extract, flatten, info, masks, merge, rays, render, sheet, verify, view) do what those do, from files to files,
in this process. Lengths are in scene units, space is right-handed with +Y up, colours are linear Rec. 709.
"""

from . import _peeler
from ._error import Error
from ._peeler import *  # noqa: F403

__version__ = _peeler.__version__
__all__ = ["Error", *(name for name in vars(_peeler) if not name.startswith("_"))]

for _name in __all__:  # as they are called, for repr and pickle
    if isinstance(_thing := globals()[_name], type):
        _thing.__module__ = __name__
del _name, _thing
