# SPDX-License-Identifier: Apache-2.0
"""Cameras around a scene, as keywords for a Renderer."""

import numpy as np

from . import _arrays, _options, _worker
from ._error import Error
from ._scenes import Scene


def views(n, scene=None, **keywords):
    """views(n, scene=None, *, around='sphere', distance=None, seed=None, size=(1280, 720), fov=None, near=None,
    far=None, animation=None) -> list of dict

    The cameras of `peeler render --views N --around ...`, as keywords for a Renderer's methods: size, K and
    world_to_camera (OpenCV), and near and far if given. Without a scene, they surround the unit cube, in which every
    Scene.normalized() lies.

        for view in peeler.views(24, around="hemisphere", size=(512, 512)):
            img = r.layers(scene.normalized(), **view)

    around: 'sphere', 'hemisphere', 'orbit' or 'random' (seed); distance: from the centre, scene units
    """
    _options.check("views", keywords)
    if scene is None:
        ends = (-0.5, 0.5)
        scene = Scene.from_arrays([(x, y, z) for x in ends for y in ends for z in ends], mode="points")
    elif not isinstance(scene, Scene):
        raise TypeError(f"expected a peeler.Scene, not {type(scene).__name__}")
    if not isinstance(n, (int, np.integer)):
        raise Error("usage", "expected a whole number", "n")
    output = _arrays.place().replace(".safetensors", "@@@@.safetensors")  # a dry run writes nothing
    arguments = [f"--views={n}", f"--output={output}", *_options.arguments("render", keywords)]
    planned = _worker.run("render", [*scene._arguments("render"), *arguments, "--dry-run"])
    kept = {k: keywords[k] for k in ("near", "far") if keywords.get(k) is not None}
    return [
        {"size": tuple(view["size"]), "K": np.array(view["K"], np.float64),
         "world_to_camera": np.array(view["world_to_camera"], np.float64), **kept}
        for view in planned["pictures"]
    ]  # fmt: skip


views.__module__ = "peeler"
