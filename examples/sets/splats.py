# SPDX-License-Identifier: Apache-2.0
"""A knot of Gaussian splats through a glass ball, an opaque ring and thin fog."""
from __future__ import annotations

import colorsys
import math

from scene_kit.curves import arc
from scene_kit.glb import Glb, Splats
from scene_kit.noise import fractal
from scene_kit.shapes import lathe, sphere
from scene_kit.vec import Vec3, X, Z, add, axis_angle, cross, from_axes, normalize, quat_mul, scale

ALONG, AROUND = 200, 26  # splats of the knot
TUBE = 0.17
FOG = 300
GOLDEN_ANGLE = math.pi * (3 - math.sqrt(5))


def _knot(t: float) -> Vec3:
    """Returns a point on a trefoil knot."""
    return (
        (math.sin(t) + 2 * math.sin(2 * t)) / 3,
        (math.cos(t) - 2 * math.cos(2 * t)) / 3,
        -math.sin(3 * t) / 2,
    )


def _along(t: float) -> Vec3:
    """Returns the direction of the knot at a point."""
    return normalize(
        (
            math.cos(t) + 4 * math.cos(2 * t),
            -math.sin(t) + 4 * math.sin(2 * t),
            -4.5 * math.cos(3 * t),
        )
    )


def _add_knot(splats: Splats) -> None:
    """Adds flat splats on the surface of a tube along the knot."""
    for i in range(ALONG):
        t = 2 * math.pi * i / ALONG
        along = _along(t)
        side = normalize(cross(along, Z if abs(along[2]) < 0.9 else X))
        up = cross(along, side)
        for k in range(AROUND):
            angle = 2 * math.pi * (k + 0.5 * (i % 2)) / AROUND
            normal = add(scale(side, math.cos(angle)), scale(up, math.sin(angle)))
            grain = fractal(24.0 * i / ALONG, 6.0 * k / AROUND)
            hue = (i / ALONG + 0.12 * math.sin(angle)) % 1.0
            splats.means.append(add(_knot(t), scale(normal, TUBE)))
            splats.turns.append(from_axes(along, cross(normal, along), normal))
            splats.scales.append((0.022, 0.020, 0.004))
            splats.opacities.append(0.55 + 0.4 * grain)
            splats.colors.append(colorsys.hsv_to_rgb(hue, 0.35 + 0.5 * grain, 0.95))


def _add_fog(splats: Splats) -> None:
    """Adds large, faint, round splats in a ball."""
    for i in range(FOG):
        height = 1 - 2 * (i + 0.5) / FOG
        radius = 1.25 * ((i * 0.618034) % 1.0) ** (1 / 3)
        flat = math.sqrt(1 - height * height)
        angle = GOLDEN_ANGLE * i
        place = scale((flat * math.cos(angle), height, flat * math.sin(angle)), radius)
        splats.means.append(place)
        splats.turns.append((0.0, 0.0, 0.0, 1.0))
        splats.scales.append((0.13, 0.13, 0.13))
        splats.opacities.append(0.05)
        splats.colors.append((0.75, 0.85, 1.0))


def build() -> Glb:
    glb = Glb("A knot of splats")
    knot, fog = Splats(), Splats()
    _add_knot(knot)
    _add_fog(fog)
    glb.node("knot", glb.splats("knot", knot))
    glb.node("fog", glb.splats("fog", fog))

    glass = glb.glass("glass", "#a8d8c8", 0.25, roughness=0.05)
    ball = glb.node("ball", at=(0.45, -0.1, 0.1))
    glb.node("ball/glass", glb.mesh("ball", (glb.store(sphere(0.5, 64)), glass)), parent=ball)

    brass = glb.material("brass", "#c9a24b", metallic=0.7, roughness=0.4)
    ring = lathe([arc((0.62, 0.0), 0.05, -180, 180, 24)], segments=96)
    turn = quat_mul(axis_angle(Z, 25.0), axis_angle(X, 70.0))
    glb.node("ring", glb.mesh("ring", (glb.store(ring), brass)), at=(-0.45, 0.1, 0.0), turn=turn)

    glb.perspective("main", (0.5, 0.9, 4.6), (0.0, -0.02, 0.0), math.radians(32.0))
    return glb
