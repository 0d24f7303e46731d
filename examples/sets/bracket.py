# SPDX-License-Identifier: Apache-2.0
"""A printable plate: four screw holes, and a window that leaves 1.2 mm of wall above it.

The example for `peeler check`: the wall is thin in one place and thicker everywhere else.
"""
from __future__ import annotations

import math
from typing import List

from scene_kit.curves import circle, rounded_rectangle
from scene_kit.glb import Glb
from scene_kit.shapes import extrude
from scene_kit.vec import X, Vec2, axis_angle

MM = 1e-3


def build() -> Glb:
    glb = Glb("A bracket to be printed")
    steel = glb.material("blue plastic", "#4a78b0", roughness=0.6)
    outline = rounded_rectangle(30 * MM, 20 * MM, 5 * MM, 8)
    holes: List[List[Vec2]] = [
        circle((x * 24 * MM, y * 14 * MM), 2.2 * MM, 32) for x in (-1, 1) for y in (-1, 1)
    ]
    # The upper edge of the plate is at 20 mm.
    left, right, low, high = -14 * MM, 14 * MM, 6 * MM, 18.8 * MM
    holes.append([(left, low), (right, low), (right, high), (left, high)])
    plate = extrude(outline, holes, 0.0, 6 * MM)
    glb.node("bracket", glb.mesh("bracket", (glb.store(plate), steel)), turn=axis_angle(X, -90))
    glb.perspective("main", (0.045, 0.1, 0.11), (0.0, 0.0, 0.002), math.radians(25))
    return glb
