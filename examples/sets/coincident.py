# SPDX-License-Identifier: Apache-2.0
"""Coincident surfaces, and triangles that intersect each other.

Cases where an offset, an epsilon or a sorted triangle list fails, side by side.
"""
from __future__ import annotations

import math

from scene_kit.glb import Geometry, Glb
from scene_kit.png import png_ramp
from scene_kit.shapes import box, cylinder, quad
from scene_kit.vec import X, Y, Z, Vec3, axis_angle, cross, normalize, sub


def _triangle(a: Vec3, b: Vec3, c: Vec3) -> Geometry:
    normal = normalize(cross(sub(b, a), sub(c, a)))
    return Geometry([a, b, c], [normal] * 3, [], [], [0, 1, 2])


def build() -> Glb:
    glb = Glb("Coincident surfaces")
    red = glb.glass("red", "#e5383b", 0.5, 0.35)
    blue = glb.glass("blue", "#2a6fdb", 0.5, 0.35)
    amber = glb.glass("amber", "#f4a020", 0.4, 0.35)
    petals = [
        glb.glass(name, colour, 0.6, 0.35)
        for name, colour in (("rose", "#e0447c"), ("lime", "#8cc63f"), ("sky", "#2ba8e0"))
    ]
    stone = glb.material("stone", "#8d8a86", roughness=0.9)
    slab = glb.texture(
        "squares",
        png_ramp(
            64,
            64,
            [(222, 219, 212), (176, 172, 166)],
            lambda x, y: float((x // 32 + y // 32) % 2),
            steps=2,
        ),
    )
    floor = glb.material("floor", roughness=0.9, texture=slab)

    glb.node(
        "floor",
        glb.mesh("floor", (glb.store(quad(1.25, 0.75, 0.25)), floor)),
        at=(0.0, 0.0, 0.2),
        turn=axis_angle(X, -90),
    )
    plinth = glb.mesh("plinth", (glb.store(cylinder(0.17, 0.0, 0.06, 48, bevel=0.006)), stone))

    # Two meshes of one geometry, which differ only in tint, drawn by two nodes at the same place.
    left = glb.node("same quad twice", at=(-0.45, 0.0, 0.0))
    glb.node("same quad twice/plinth", plinth, parent=left)
    pane = glb.store(quad(0.14, 0.15))
    for name, material in (("red", red), ("blue", blue)):
        glb.node(
            f"same quad twice/{name}",
            glb.mesh(f"quad {name}", (pane, material)),
            at=(0.0, 0.21, 0.0),
            turn=axis_angle(Y, 20),
            parent=left,
        )

    # One mesh, drawn by two nodes with the same transform.
    middle = glb.node("same cube twice")
    glb.node("same cube twice/plinth", plinth, parent=middle)
    cube = glb.mesh("cube", (glb.store(box((0.1, 0.1, 0.1))), amber))
    for copy in ("first", "second"):
        glb.node(
            f"same cube twice/{copy}",
            cube,
            at=(0.0, 0.161, 0.0),
            turn=axis_angle(Y, 34),
            parent=middle,
        )

    # Each triangle is partly in front of the next, the last one in front of the first, so no order of whole triangles
    # is right.
    right = glb.node("through each other", at=(0.45, 0.0, 0.0))
    glb.node("through each other/plinth", plinth, parent=right)
    for k, material in enumerate(petals):
        a, b, c = (-0.15, -0.03, -0.07), (0.15, -0.06, 0.05), (0.13, 0.09, 0.07)
        glb.node(
            f"through each other/{k + 1}",
            glb.mesh(f"triangle {k + 1}", (glb.store(_triangle(a, b, c)), material)),
            at=(0.0, 0.23, 0.0),
            turn=axis_angle(Z, 120.0 * k + 90.0),
            parent=right,
        )

    glb.perspective("main", (0.0, 0.55, 1.75), (0.0, 0.135, 0.0), math.radians(25))
    glb.orthographic("front", (0.0, 0.2, 1.0), (0.0, 0.2, 0.0), 0.4, near=0.1, far=2.0)
    return glb
