# SPDX-License-Identifier: Apache-2.0
"""A still life of glass: every vessel has an outer and an inner wall, and some have something inside."""
from __future__ import annotations

import math
import random
from typing import List, Sequence

from scene_kit.curves import arc, simplified, smooth
from scene_kit.glb import Geometry, Glb
from scene_kit.noise import fractal, noise
from scene_kit.png import dot_coverage, png, png_ramp
from scene_kit.shapes import graded_wall, lathe, rounded_box, sphere
from scene_kit.vec import Vec2, Vec3, X, Y, Z, axis_angle, lerp, quat_mul, smoothstep, srgb, srgb8

TABLE_RADIUS = 0.42
# Liquid stands this far off the wall, so that glass and liquid are two surfaces and not one.
GAP = 0.0006

# How far a simplified outline may leave the curve it stands for.
TOLERANCE = 0.0001
# A thin wall's share of the alpha of solid glass.
THIN = 0.30

Run = Sequence[Vec2]


def _rim(outer: Vec2, inner: Vec2) -> List[Vec2]:
    """A half circle from the outer wall over to the inner one."""
    middle = ((outer[0] + inner[0]) / 2, (outer[1] + inner[1]) / 2)
    return arc(middle, math.dist(outer, inner) / 2, 0, 180, 6)


def _vessel(outer: List[Vec2], inner: List[Vec2], segments: int = 64) -> Geometry:
    """Outer wall from the axis up to the rim, inner wall from the rim down to the axis."""
    outer, inner = simplified(outer, TOLERANCE), simplified(inner, TOLERANCE)
    out = lathe([outer + _rim(outer[-1], inner[0])[1:-1] + inner], segments)
    # Solid glass below the inner wall's lowest point, and a rim that catches the light, tint more
    # than a thin wall does.
    bottom, rim = inner[-1][1], inner[0][1]
    for _, y, _ in out.positions:
        solid = max(1.0 - smoothstep(bottom, bottom + 0.02, y), smoothstep(rim - 0.004, rim, y))
        out.colors.append((1.0, 1.0, 1.0, lerp(THIN, 1.0, solid)))
    return out


def _liquid(inner: Run, level: float, segments: int = 64) -> Geometry:
    """What fills an inner wall (given rim first) up to a level, with a little meniscus."""
    inner = simplified(inner, TOLERANCE)
    wall = [(max(0.0, r - GAP), y + GAP) for r, y in reversed(inner) if y + GAP < level - 0.0005]
    wall[0] = (0.0, wall[0][1])
    below = max((p for p in inner if p[1] < level), key=lambda p: p[1])
    above = min((p for p in inner if p[1] >= level), key=lambda p: p[1])
    edge = lerp(below[0], above[0], (level - below[1]) / (above[1] - below[1])) - GAP
    surface = [(edge, level + 0.0008), (edge - 0.0012, level + 0.0002), (edge - 0.004, level), (0.0, level)]
    return lathe([wall + surface[:1], surface], segments)


def _cup(points: Sequence[Vec2], steps: int) -> List[Vec2]:
    """A smooth wall that leaves the axis (its first point) at a right angle."""
    (r0, y0), rest = points[0], points[1:]
    assert r0 == 0.0
    mirrored = smooth([(-rest[0][0], rest[0][1]), (0.0, y0), *rest], steps)
    return [(0.0, y0)] + mirrored[steps + 1:]


WINE_INNER = list(reversed(_cup([(0.0, 0.104), (0.020, 0.109), (0.036, 0.127), (0.042, 0.150), (0.040, 0.178),
                                 (0.0325, 0.2135)], 8)))


def _wine_glass() -> Geometry:
    foot = smooth([(0.0, 0.0035), (0.018, 0.0022), (0.034, 0.0)], 8)
    top = arc((0.0345, 0.0012), 0.0012, -90, 80, 4)
    stem = smooth([(0.030, 0.0034), (0.012, 0.0072), (0.0056, 0.016), (0.0040, 0.040), (0.0041, 0.075),
                   (0.0078, 0.0955), (0.0205, 0.1075), (0.0372, 0.1265), (0.0433, 0.150), (0.0413, 0.178),
                   (0.0335, 0.2135)], 8)
    outer = foot + top + stem
    return _vessel(outer, WINE_INNER)


FLUTE_INNER = list(reversed(_cup([(0.0, 0.092), (0.006, 0.096), (0.0165, 0.120), (0.0225, 0.160), (0.0235, 0.200),
                                  (0.0215, 0.236)], 8)))


def _flute() -> Geometry:
    foot = smooth([(0.0, 0.0030), (0.016, 0.0020), (0.029, 0.0)], 8)
    top = arc((0.0295, 0.0011), 0.0011, -90, 80, 4)
    stem = smooth([(0.025, 0.0030), (0.010, 0.0064), (0.0046, 0.015), (0.0036, 0.040), (0.0040, 0.070),
                   (0.0070, 0.0905), (0.0175, 0.119), (0.0236, 0.160), (0.0245, 0.200), (0.0224, 0.236)], 8)
    return _vessel(foot + top + stem, FLUTE_INNER, 48)


TUMBLER_INNER = list(reversed(_cup([(0.0, 0.014), (0.028, 0.0145), (0.0335, 0.019), (0.0345, 0.028), (0.0362, 0.060),
                                    (0.0380, 0.095)], 8)))


def _tumbler() -> Geometry:
    outer = smooth([(0.0, 0.003), (0.020, 0.002), (0.031, 0.0), (0.0355, 0.004), (0.0366, 0.020), (0.0382, 0.060),
                    (0.0398, 0.095)], 8)
    return _vessel(outer, TUMBLER_INNER)


BOTTLE_INNER = list(reversed(_cup([(0.0, 0.022), (0.020, 0.015), (0.031, 0.009), (0.0343, 0.020), (0.0345, 0.060),
                                   (0.0345, 0.150), (0.0335, 0.185), (0.022, 0.212), (0.0125, 0.232), (0.0105, 0.262),
                                   (0.0100, 0.300)], 8)))


def _bottle() -> Geometry:
    outer = (_cup([(0.0, 0.017), (0.018, 0.010), (0.030, 0.001), (0.0363, 0.008), (0.0375, 0.024)], 8)
             + smooth([(0.0375, 0.024), (0.0375, 0.080), (0.0375, 0.150), (0.0365, 0.186), (0.0247, 0.214),
                       (0.0150, 0.234), (0.0132, 0.262), (0.0132, 0.280), (0.0150, 0.283), (0.0152, 0.294),
                       (0.0138, 0.300)], 8)[1:])
    return _vessel(outer, BOTTLE_INNER)


BOWL_INNER = list(reversed(_cup([(0.0, 0.010), (0.030, 0.012), (0.056, 0.026), (0.068, 0.048), (0.071, 0.062)], 8)))


def _bowl() -> Geometry:
    outer = smooth([(0.0, 0.003), (0.016, 0.002), (0.026, 0.0), (0.034, 0.003), (0.058, 0.0225), (0.0705, 0.047),
                    (0.0738, 0.062)], 8)
    return _vessel(outer, BOWL_INNER)


def _label(radius: float, y0: float, y1: float, half_angle: float) -> Geometry:
    """A strip of paper around the bottle, its middle towards +z."""
    steps = 24
    out = Geometry()
    for i in range(steps + 1):
        angle = math.radians(90.0 + half_angle - 2 * half_angle * i / steps)
        c, s = math.cos(angle), math.sin(angle)
        for y, v in ((y0, 1.0), (y1, 0.0)):
            out.positions.append((radius * c, y, radius * s))
            out.normals.append((c, 0.0, s))
            out.uvs.append((i / steps, v))
    for i in range(steps):
        a = 2 * i
        out.indices += [a, a + 2, a + 3, a, a + 3, a + 1]
    return out


def _label_png() -> bytes:
    width, height = 192, 160

    def texel(x: int, y: int) -> Sequence[int]:
        paper, ink, accent = srgb8("#f2e8d0"), srgb8("#2b2320"), srgb8("#9c2f2a")
        edge = min(x, y, width - 1 - x, height - 1 - y)
        if 5 <= edge < 7:
            return accent
        cover = dot_coverage("PEELER", (x - 23.0) / 4.2, (y - 34.0) / 4.2, radius=0.62)
        for row in range(5):  # sheets seen at a slant, one above the other
            along, across = x - 96.0, y - (134 - 12 * row)
            if abs(across + abs(along) * 0.22 - 8) < 1.6 and abs(along) < 38:
                return accent if row == 4 else srgb8("#b8895a")
        return tuple(round(lerp(p, i, cover)) for p, i in zip(paper, ink))

    return png(width, height, texel)


def _wood_png() -> bytes:
    """Boards with grain along x, a little darker where two meet."""
    size, boards = 512, 6

    def value(x: int, y: int) -> float:
        board, across = divmod(y * boards / size, 1.0)
        shift = 37.0 * board
        wave = fractal(x / 180.0 + shift, y / 26.0 + shift, 3, 3)
        rings = 0.5 + 0.5 * math.sin(2 * math.pi * (wave * 5.0 + y / 60.0))
        fibre = noise(x / 30.0 + shift, y * 0.8, 9)
        tone = 0.30 + 0.16 * noise(board * 7.3, 0.5, 21) + 0.30 * rings + 0.20 * fibre
        seam = min(across, 1.0 - across) * size / boards
        return tone * (0.45 if seam < 1.2 else 1.0)

    return png_ramp(size, size, [srgb8("#2b1a11"), srgb8("#54341f"), srgb8("#7a4f30"), srgb8("#946743")], value, 32)


def _table() -> Geometry:
    """A round board; the wood runs straight through it, so its UVs are a projection from above."""
    r, bevel = TABLE_RADIUS, 0.006
    runs = [[(0.0, -0.028), (r - bevel, -0.028)],
            arc((r - bevel, -0.028 + bevel), bevel, -90, 0, 4) + arc((r - bevel, -bevel), bevel, 0, 90, 4),
            [(r - bevel, 0.0), (0.0, 0.0)]]
    out = lathe(runs, 96)
    # The rim's side looks down the boards' ends: the height shifts the grain.
    out.uvs = [(x / (2 * r) + 0.5, z / (2 * r) + 0.5 + 0.8 * y) for x, y, z in out.positions]
    return out


def build() -> Glb:
    glb = Glb("Glasses")
    clear = dict(mode="BLEND", roughness=0.06, double_sided=True)
    wood = glb.material("oiled wood", roughness=0.55, texture=glb.texture("wood", _wood_png()))
    paper = glb.material("label", roughness=0.8, texture=glb.texture("label", _label_png()))
    cork = glb.material("cork", "#c79a6b", roughness=0.95)
    crystal = glb.material("clear glass", "#bcd0d4", 0.30, **clear)
    smoke = glb.material("smoke glass", "#8d9aa6", 0.34, **clear)
    aqua = glb.material("aqua glass", "#35a8b4", 0.45, **clear)
    rose = glb.material("rose glass", "#e0607e", 0.45, **clear)
    green = glb.material("bottle green glass", "#1c6234", 0.8, **clear)
    cobalt = glb.material("cobalt glass", "#2044b4", 0.7, **clear)
    red_wine = glb.material("red wine", "#74001a", 0.72, **clear)
    white_wine = glb.material("white wine", "#eec040", 0.40, **clear)
    whisky = glb.material("whisky", "#c86400", 0.6, **clear)
    water = glb.material("water", "#9fc9dc", 0.15, **clear)
    ice = glb.material("ice", "#e4f1f6", 0.24, mode="BLEND", roughness=0.2, double_sided=True)

    wall = glb.store(graded_wall(1.4, -0.9, 1.3, srgb("#77808a"), srgb("#262d36")))
    glb.node("backdrop", glb.mesh("backdrop", (wall, glb.material("backdrop", roughness=1.0))), at=(0.0, 0.0, -0.9))
    glb.node("table", glb.mesh("table", (glb.store(_table()), wood)), turn=axis_angle(Y, 12))

    shapes = {"wine glass": glb.store(_wine_glass()), "flute": glb.store(_flute()),
              "tumbler": glb.store(_tumbler()), "bottle": glb.store(_bottle()), "bowl": glb.store(_bowl())}
    walls = {"wine glass": WINE_INNER, "flute": FLUTE_INNER, "tumbler": TUMBLER_INNER, "bottle": BOTTLE_INNER}

    def place(name: str, shape: str, glass: int, at: Vec2, liquid: int = -1, level: float = 0.0) -> int:
        group = glb.node(name, at=(at[0], 0.0002, at[1]))
        glb.node(f"{name}/glass", glb.mesh(f"{shape} of {name}", (shapes[shape], glass)), parent=group)
        if liquid >= 0:
            body = glb.store(_liquid(walls[shape], level))
            glb.node(f"{name}/liquid", glb.mesh(f"liquid of {name}", (body, liquid)), parent=group)
        return group

    wine = place("green bottle", "bottle", green, (-0.135, -0.160), red_wine, 0.168)
    glb.node("green bottle/label", glb.mesh("label", (glb.store(_label(0.0380, 0.055, 0.135, 62.0)), paper)),
             turn=axis_angle(Y, 8), parent=wine)
    stopper = lathe([[(0.0, 0.0), (0.0092, 0.0)], [(0.0092, 0.0), (0.0095, 0.026)], [(0.0095, 0.026), (0.0095, 0.034)],
                     [(0.0095, 0.034), (0.0, 0.034)]], 32)
    glb.node("green bottle/cork", glb.mesh("cork", (glb.store(stopper), cork)), at=(0.0, 0.282, 0.0), parent=wine)
    place("cobalt bottle", "bottle", cobalt, (0.050, -0.215))
    place("red wine", "wine glass", crystal, (-0.03, -0.03), red_wine, 0.150)
    place("white wine", "wine glass", crystal, (0.135, -0.085), white_wine, 0.158)
    place("empty glass", "wine glass", rose, (-0.225, 0.0))
    place("flute", "flute", smoke, (0.225, -0.175), white_wine, 0.205)
    place("aqua tumbler", "tumbler", aqua, (0.205, 0.075), water, 0.066)
    iced = place("whisky", "tumbler", crystal, (0.065, 0.115), whisky, 0.052)
    place("bowl", "bowl", crystal, (-0.125, 0.155))

    cube = glb.mesh("ice cube", (glb.store(rounded_box((0.013, 0.013, 0.013), 0.0035)), ice))
    for k, (at, tilt) in enumerate((((0.010, 0.036, 0.006), 18.0), ((-0.013, 0.047, -0.010), -24.0))):
        glb.node(f"whisky/ice {k + 1}", cube, at=at,
                 turn=quat_mul(axis_angle(Y, 31.0 + 47.0 * k), axis_angle(X, tilt)), parent=iced)

    _marbles(glb)

    glb.perspective("main", (0.05, 0.43, 1.06), (0.005, 0.118, -0.02), math.radians(24.5))
    glb.perspective("top", (0.0, 1.3, 0.001), (0.0, 0.0, 0.0), math.radians(40), up=(0.0, 0.0, -1.0))
    return glb


def _marbles(glb: Glb) -> None:
    """Glass marbles in the bowl: a ring of six, one in the middle, three on top."""
    rng = random.Random(7)
    radius = 0.0155
    ball = glb.store(sphere(radius, 24))
    kinds = [glb.mesh(f"marble {name}", (ball, glb.material(f"marble {name}", colour, 0.5, mode="BLEND", roughness=0.05,
                                                           double_sided=True)))
             for name, colour in (("ruby", "#c81e3a"), ("amber", "#e8961e"), ("emerald", "#1e9a5a"),
                                  ("sapphire", "#2250c8"), ("violet", "#8a3cc0"))]
    places: List[Vec3] = [(0.0, 0.0265, 0.0)]
    for k in range(6):
        angle = math.radians(60 * k + 8)
        places.append((0.0335 * math.cos(angle), 0.0325, 0.0335 * math.sin(angle)))
    for k in range(3):
        angle = math.radians(120 * k + 38)
        places.append((0.0185 * math.cos(angle), 0.0565, 0.0185 * math.sin(angle)))
    for k, (x, y, z) in enumerate(places):
        lift = rng.uniform(0.0, 0.0006)
        glb.node(f"marble {k + 1}", kinds[(k * 3 + k // 4) % len(kinds)], at=(x - 0.125, y + lift, z + 0.155))
