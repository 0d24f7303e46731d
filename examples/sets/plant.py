# SPDX-License-Identifier: Apache-2.0
"""A potted plant: a MASK material cuts leaves out of cards, so that layers are full of holes."""
from __future__ import annotations

import math
import random
from typing import List, Sequence

from scene_kit.curves import arc, smooth3
from scene_kit.glb import CLAMP, Geometry, Glb
from scene_kit.noise import fractal, noise
from scene_kit.png import Pixel, png, png_ramp
from scene_kit.shapes import cylinder, lathe, sphere, tube
from scene_kit.vec import (
    Vec3,
    Y,
    add,
    cross,
    dot,
    lerp,
    mix,
    normalize,
    scale,
    smoothstep,
    srgb,
    srgb8,
    sub,
)

GOLDEN_ANGLE = math.radians(137.50776)
BRANCHES, LEAVES_PER_BRANCH = 9, 30
SOIL_HEIGHT = 0.150


def _leaf_half_width(t: float) -> float:
    """Returns half the width of a leaf, a pointed oval, relative to the card's width; t goes from the stalk (0) to the
    tip (1)."""
    if t < 0.0 or t > 1.0:
        return 0.0
    return 0.49 * math.pow(math.sin(math.pi * math.pow(t, 0.72)), 0.85) * (1.0 - 0.25 * t)


def _leaf_texel(x: int, y: int, width: int, height: int) -> Pixel:
    """Returns a texel of a leaf with a pale midrib, pale side veins and a darker rim; grey-green, because vertex
    colours tint it."""
    t = 1.0 - (y + 0.5) / height
    across = (x + 0.5) / width - 0.5
    blade = min(
        1.0, max(0.0, (_leaf_half_width((t - 0.06) / 0.93) - abs(across)) * width / 1.6 + 0.5)
    )
    stalk = min(1.0, max(0.0, (0.022 - abs(across)) * width / 1.6 + 0.5)) if t < 0.2 else 0.0
    # Side veins leave the midrib towards the tip.
    vein_phase = (t - 0.55 * abs(across)) * 11.0 % 1.0
    vein = (1.0 - smoothstep(0.0, 0.10, min(vein_phase, 1.0 - vein_phase))) * smoothstep(
        0.0, 0.04, abs(across)
    )
    midrib = 1.0 - smoothstep(0.008, 0.030, abs(across))
    rim = smoothstep(0.30, 0.5, abs(across)) * 0.25
    tone = (
        0.72
        + 0.16 * (fractal(x / 20.0, y / 20.0, 5) - 0.5)
        - rim
        + 0.14 * vein * 0.7
        + 0.26 * midrib
    )
    warm = 0.5 * midrib + 0.15 * vein
    r, g, b = tone * lerp(0.93, 1.0, warm), tone, tone * lerp(0.86, 0.78, warm)
    return (
        *(round(255 * min(1.0, max(0.0, c))) for c in (r, g, b)),
        round(255 * max(blade, stalk)),
    )


def _leaf(
    base: Vec3,
    forward: Vec3,
    up: Vec3,
    length: float,
    width: float,
    droop: float,
    fold: float,
    colour: Vec3,
    tip_colour: Vec3,
) -> Geometry:
    """Adds two columns of seven quads that start along `forward` and bend down by `droop` radians."""
    rows = 7
    side = normalize(cross(forward, up))
    up = cross(side, forward)
    out = Geometry()
    p = base
    for i in range(rows + 1):
        t = i / rows
        angle = -droop * t * t
        ahead = add(scale(forward, math.cos(angle)), scale(up, math.sin(angle)))
        top = sub(scale(up, math.cos(angle)), scale(forward, math.sin(angle)))
        if i:
            p = add(p, scale(ahead, length / rows))
        tint = mix(colour, tip_colour, t)
        for k in (-1, 0, 1):
            # The halves rise from the midrib like the pages of an open book; the part at the stalk stays flat.
            lift = fold * smoothstep(0.0, 0.3, t)
            out.positions.append(
                add(
                    p,
                    add(
                        scale(side, k * width / 2 * math.cos(lift)),
                        scale(top, abs(k) * width / 2 * math.sin(lift)),
                    ),
                )
            )
            out.normals.append(normalize(sub(top, scale(side, k * math.sin(lift) * 0.8))))
            out.uvs.append(((k + 1) / 2, 1.0 - t))
            out.colors.append((*tint, 1.0))
    for i in range(rows):
        for k in range(2):
            a = 3 * i + k
            out.indices += [a, a + 1, a + 4, a, a + 4, a + 3]
    return out


def _branch_path(rng: random.Random, k: int) -> List[Vec3]:
    """Returns a path from the soil upwards and outwards; inner branches are straighter and higher."""
    outward = math.sqrt((k + 0.5) / BRANCHES)
    angle = GOLDEN_ANGLE * k + rng.uniform(-0.15, 0.15)
    c, s = math.cos(angle), math.sin(angle)
    reach = 0.03 + 0.17 * outward
    top = SOIL_HEIGHT + 0.44 - 0.20 * outward * outward + rng.uniform(-0.03, 0.03)
    start = 0.012 + 0.020 * outward
    sway = rng.uniform(-0.02, 0.02)
    knots: List[Vec3] = [(c * start, SOIL_HEIGHT - 0.02, s * start)]
    for t, share in ((0.33, 0.16), (0.66, 0.50), (1.0, 1.0)):
        radius = start + reach * share
        knots.append(
            (
                c * radius - s * sway * t,
                lerp(SOIL_HEIGHT, top, math.sin(t * math.pi / 2) ** 0.9),
                s * radius + c * sway * t,
            )
        )
    return smooth3(knots, 7)


def _leaves(rng: random.Random, path: Sequence[Vec3], branch: int) -> Geometry:
    out = Geometry()
    young, mature, old = srgb("#b9dc5a"), srgb("#4f9a48"), srgb("#2f6b46")
    last = len(path) - 1
    for i in range(LEAVES_PER_BRANCH):
        share = i / (LEAVES_PER_BRANCH - 1)
        t = lerp(0.30, 1.0, share**0.9) * last
        k = min(int(t), last - 1)
        base = mix(path[k], path[k + 1], t - k)
        along = normalize(sub(path[k + 1], path[k]))
        angle = GOLDEN_ANGLE * i + branch
        side = normalize(cross(along, (0.31, 0.2, 0.93)))
        radial = add(scale(side, math.cos(angle)), scale(cross(along, side), math.sin(angle)))
        # Young leaves at the tip point up; older leaves further down lie flat or hang.
        rise = lerp(0.15, 1.25, share**2.2) + rng.uniform(-0.12, 0.12)
        forward = normalize(add(scale(radial, math.cos(rise)), scale(along, math.sin(rise))))
        up = normalize(add(along, scale(Y, 0.6)))
        if abs(dot(up, forward)) > 0.98:
            up = radial
        size = lerp(1.0, 0.52, share**2.5) * rng.uniform(0.85, 1.12)
        tint = mix(old, mature, min(1.0, share * 1.6 + rng.uniform(-0.2, 0.2)))
        tint = mix(tint, young, smoothstep(0.62, 1.0, share + rng.uniform(-0.1, 0.1)))
        tip = mix(tint, young, 0.25)
        if rng.random() < 0.035:
            tint, tip = srgb("#d9b53c"), srgb("#b8682a")  # a leaf about to fall
        out.append(
            _leaf(
                base,
                forward,
                up,
                0.118 * size,
                0.056 * size,
                rng.uniform(0.5, 1.2),
                rng.uniform(0.15, 0.45),
                tint,
                tip,
            )
        )
    return out


def _pot() -> Geometry:
    """Returns the outer wall, the rolled rim and the inner wall; the pot is closed below."""
    b = 0.004
    return lathe(
        [
            [(0.0, 0.012), (0.070 - b, 0.012)],
            arc((0.070 - b, 0.012 + b), b, -90, 0, 4),
            [(0.070, 0.012 + b), (0.0925, 0.130)],
            [(0.0925, 0.130), (0.1010, 0.130)],
            arc((0.1010, 0.133), 0.003, -90, 0, 3)
            + [(0.1050, 0.164)]
            + arc((0.1000, 0.167), 0.005, 10, 90, 4)
            + arc((0.0945, 0.167), 0.005, 90, 175, 4),
            [arc((0.0945, 0.167), 0.005, 90, 175, 4)[-1], (0.0840, 0.130), (0.0620, 0.024)],
            [(0.0620, 0.024), (0.0, 0.024)],
        ],
        64,
        uv=True,
    )


def _saucer() -> Geometry:
    return lathe(
        [
            [(0.0, 0.0), (0.088, 0.0)],
            [(0.088, 0.0), (0.118, 0.027)],
            arc((0.1155, 0.027), 0.0025, 0, 180, 6),
            [(0.113, 0.027), (0.086, 0.010)],
            [(0.086, 0.010), (0.0, 0.010)],
        ],
        64,
        uv=True,
    )


def _soil() -> Geometry:
    """Returns a disc of crumbs, made of displaced rings; the normals come from differences."""
    rings, segments, radius = 16, 56, 0.0865

    def height(x: float, z: float) -> float:
        return (
            SOIL_HEIGHT
            + 0.012 * (fractal(x * 90 + 40, z * 90 + 40, 8) - 0.5)
            - 0.6 * (x * x + z * z)
        )

    out = Geometry()
    dark, pale = srgb("#2e2019"), srgb("#6a4c36")

    def put(x: float, z: float) -> None:
        e = 0.001
        y = height(x, z)
        slope_x, slope_z = (height(x + e, z) - y) / e, (height(x, z + e) - y) / e
        out.positions.append((x, y, z))
        out.normals.append(normalize((-slope_x, 1.0, -slope_z)))
        out.colors.append((*mix(dark, pale, noise(x * 300 + 9, z * 300 + 9, 4)), 1.0))

    put(0.0, 0.0)
    for ring in range(1, rings + 1):
        for k in range(segments):
            angle = 2 * math.pi * k / segments
            put(radius * ring / rings * math.cos(angle), radius * ring / rings * math.sin(angle))
    for ring in range(rings):
        for k in range(segments):
            n = (k + 1) % segments
            c, d = 1 + ring * segments + k, 1 + ring * segments + n
            if ring == 0:
                out.indices += [0, d, c]
            else:
                a, b = c - segments, d - segments
                out.indices += [a, b, d, a, d, c]
    return out


def build() -> Glb:
    rng = random.Random(11)
    glb = Glb("Potted plant")
    leaf_png = png(96, 192, lambda x, y: _leaf_texel(x, y, 96, 192))
    leaf = glb.material(
        "leaf",
        texture=glb.texture("leaf", leaf_png, CLAMP),
        mode="MASK",
        roughness=0.45,
        double_sided=True,
    )
    bark = glb.material("stem", "#7c6a45", roughness=0.8)
    clay = png_ramp(
        256,
        128,
        [srgb8("#9a4a2c"), srgb8("#bd6840"), srgb8("#d38a60"), srgb8("#e3b496")],
        lambda x, y: _clay(x, y, 256, 128),
        32,
    )
    terracotta = glb.material("terracotta", roughness=0.85, texture=glb.texture("clay", clay))
    earth = glb.material("soil", roughness=1.0)
    pebble = glb.material("pebble", "#b9b2a6", roughness=0.7)
    shelf = glb.material("shelf", "#8f877a", roughness=0.8)

    glb.node(
        "shelf", glb.mesh("shelf", (glb.store(cylinder(0.26, -0.022, 0.0, 96, bevel=0.003)), shelf))
    )
    pot = glb.node("pot")
    glb.node("pot/saucer", glb.mesh("saucer", (glb.store(_saucer()), terracotta)), parent=pot)
    glb.node("pot/wall", glb.mesh("pot", (glb.store(_pot()), terracotta)), parent=pot)
    glb.node("pot/soil", glb.mesh("soil", (glb.store(_soil()), earth)), parent=pot)

    stone = glb.mesh("pebble", (glb.store(sphere(1.0, 20)), pebble))
    for k in range(12):
        angle, radius = GOLDEN_ANGLE * k + 0.4, 0.040 + 0.034 * rng.random()
        r = rng.uniform(0.0045, 0.008)
        glb.node(
            f"pot/pebble {k + 1}",
            stone,
            parent=pot,
            size=(round(r * 1.3, 5), round(r * 0.7, 5), round(r, 5)),
            at=(radius * math.cos(angle), SOIL_HEIGHT - 0.001, radius * math.sin(angle)),
        )

    plant = glb.node("plant")
    for k in range(BRANCHES):
        path = _branch_path(rng, k)
        radii = [lerp(0.0052, 0.0014, i / (len(path) - 1)) for i in range(len(path))]
        branch = glb.node(f"plant/branch {k + 1}", parent=plant)
        glb.node(
            f"plant/branch {k + 1}/stem",
            glb.mesh(f"stem {k + 1}", (glb.store(tube(path, radii, 10)), bark)),
            parent=branch,
        )
        glb.node(
            f"plant/branch {k + 1}/leaves",
            glb.mesh(f"leaves {k + 1}", (glb.store(_leaves(rng, path, k)), leaf)),
            parent=branch,
        )

    fallen = Geometry()
    for x, z, angle in ((0.145, 0.135, 0.9), (-0.165, 0.085, 2.6)):
        fallen.append(
            _leaf(
                (x, 0.006, z),
                (math.cos(angle), 0.0, math.sin(angle)),
                Y,
                0.10,
                0.048,
                0.12,
                0.2,
                srgb("#d9b53c"),
                srgb("#b8682a"),
            )
        )
    glb.node("fallen leaves", glb.mesh("fallen leaves", (glb.store(fallen), leaf)))

    glb.perspective("main", (0.25, 0.62, 1.62), (0.0, 0.285, 0.0), math.radians(26), aspect=1.0)
    return glb


def _clay(x: int, y: int, width: int, height: int) -> float:
    """Returns the fine grain and the pale bloom of lime on an old pot; wraps around in x."""
    turn = 2 * math.pi * x / width
    u, v = math.cos(turn) * 1.6 + 9.0, math.sin(turn) * 1.6 + 9.0
    bloom = smoothstep(0.52, 0.78, fractal(u + y / height * 3.0, v + y / height * 5.0, 2))
    grain = noise(x * 0.9, y * 0.9, 6)
    return 0.28 + 0.12 * grain + 0.10 * fractal(u * 3, v * 3 + y / 12.0, 12) + 0.40 * bloom
