# SPDX-License-Identifier: Apache-2.0
"""Nine numbered panes of tinted glass, one behind another, which all overlap in the middle."""
from __future__ import annotations

import math

from scene_kit.glb import CLAMP, Glb
from scene_kit.png import Pixel, dot_coverage, png, png_ramp
from scene_kit.shapes import graded_wall, quad, rounded_box
from scene_kit.vec import X, Y, Vec3, axis_angle, lerp, smoothstep, srgb, srgb8

# The panes from front to back: colour, and the alpha of the glass between digit and border.
PANES = (
    ("#e63946", 0.20),
    ("#f3722c", 0.24),
    ("#f9c74f", 0.22),
    ("#90be6d", 0.28),
    ("#2a9d8f", 0.27),
    ("#2aa7c9", 0.32),
    ("#3a5fcd", 0.32),
    ("#7b4fc9", 0.40),
    ("#c9429b", 0.48),
)
WIDTH, HEIGHT = 1.40, 0.88
TEXELS_X, TEXELS_Y = 560, 352


def _pane_texel(digit: str, colour: str, alpha: float, x: int, y: int) -> Pixel:
    """Returns a texel of a pane: the border is more opaque, and a nearly white digit is in the corner that no other
    pane covers."""
    border = min(x, y, TEXELS_X - 1 - x, TEXELS_Y - 1 - y)
    opacity = lerp(0.92, alpha, smoothstep(5.0, 8.0, border))
    dot = 7.5
    white = dot_coverage(digit, (x - (TEXELS_X - 14 - 5 * dot)) / dot, (y - 18) / dot, edge=0.14)
    opacity = lerp(opacity, 0.96, white)
    r, g, b = srgb8(colour)
    return (
        round(lerp(r, 252, white)),
        round(lerp(g, 250, white)),
        round(lerp(b, 245, white)),
        round(opacity * 255),
    )


def build() -> Glb:
    glb = Glb("Nine panes")
    checker = glb.texture(
        "checker",
        png_ramp(
            128,
            128,
            [(238, 234, 226), (62, 66, 74)],
            lambda x, y: float((x // 64 + y // 64) % 2),
            steps=2,
        ),
    )
    floor = glb.material("floor", roughness=0.85, texture=checker)
    glb.node(
        "floor", glb.mesh("floor", (glb.store(quad(3.2, 2.0, 0.4)), floor)), turn=axis_angle(X, -90)
    )

    wall = glb.material("wall", roughness=1.0)
    glb.node(
        "backdrop",
        glb.mesh(
            "backdrop",
            (glb.store(graded_wall(3.2, 0.0, 2.4, srgb("#aeb6bf"), srgb("#58626e"))), wall),
        ),
        at=(0.0, 0.0, -2.0),
    )

    steel = glb.material("steel", "#3c4046", metallic=0.2, roughness=0.45)
    foot = glb.mesh("foot", (glb.store(rounded_box((0.035, 0.025, 0.05), 0.006)), steel))
    sheet = glb.store(quad(WIDTH / 2, HEIGHT / 2))
    stack = glb.node("panes")
    for k, (colour, alpha) in enumerate(PANES):
        digit = str(k + 1)
        image = png(TEXELS_X, TEXELS_Y, lambda x, y: _pane_texel(digit, colour, alpha, x, y))
        texture = glb.texture(f"pane {digit}", image, CLAMP)
        material = glb.material(
            f"glass {digit}", texture=texture, mode="BLEND", roughness=0.15, double_sided=True
        )
        at: Vec3 = (-0.66 + 0.155 * k + 0.003 * k * k, 0.0, 0.72 - 0.18 * k)
        pane = glb.node(f"pane {digit}", at=at, turn=axis_angle(Y, 6.0 - 1.2 * k), parent=stack)
        glb.node(
            f"pane {digit}/glass",
            glb.mesh(f"glass {digit}", (sheet, material)),
            at=(0.0, 0.03 + HEIGHT / 2, 0.0),
            parent=pane,
        )
        for side, x in (("left", -0.58), ("right", 0.58)):
            glb.node(f"pane {digit}/foot {side}", foot, at=(x, 0.025, 0.0), parent=pane)

    glb.perspective("main", (-0.85, 1.55, 5.1), (-0.04, 0.38, 0.0), math.radians(18.5))
    glb.orthographic("front", (0.05, 1.30, 3.2), (0.05, 0.42, 0.0), 0.84, near=0.1, far=6.0)
    return glb
