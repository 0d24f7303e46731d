# SPDX-License-Identifier: Apache-2.0
"""A still life of glass: every vessel has two walls, and some are filled."""
from __future__ import annotations

import math
from typing import List, Tuple

from scene_kit.curves import arc
from scene_kit.glb import Geometry, Glb
from scene_kit.noise import fractal, noise
from scene_kit.png import Pixel, dot_coverage, png, png_ramp
from scene_kit.shapes import cylinder, graded_wall, lathe, rounded_box, sphere
from scene_kit.vec import Vec2, Vec3, X, Y, axis_angle, lerp, quat_mul, srgb, srgb8
from scene_kit.vessels import VESSELS

TABLE_RADIUS = 0.42


def _label(radius: float, y0: float, y1: float, half_angle: float) -> Geometry:
    """Returns a strip of paper around the bottle, whose middle is towards +z."""
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

    def texel(x: int, y: int) -> Pixel:
        paper, ink, accent = srgb8("#f2e8d0"), srgb8("#2b2320"), srgb8("#9c2f2a")
        edge = min(x, y, width - 1 - x, height - 1 - y)
        if 5 <= edge < 7:
            return accent
        cover = dot_coverage("PEELER", (x - 23.0) / 4.2, (y - 34.0) / 4.2, radius=0.62)
        for row in range(5):  # sheets that slant, one above the other
            along, across = x - 96.0, y - (134 - 12 * row)
            if abs(across + abs(along) * 0.22 - 8) < 1.6 and abs(along) < 38:
                return accent if row == 4 else srgb8("#b8895a")
        return tuple(round(lerp(p, i, cover)) for p, i in zip(paper, ink))

    return png(width, height, texel)


def _wood_png() -> bytes:
    """Returns a texture of boards with grain along x, a little darker at the joints."""
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

    return png_ramp(
        size,
        size,
        [srgb8("#2b1a11"), srgb8("#54341f"), srgb8("#7a4f30"), srgb8("#946743")],
        value,
        32,
    )


def _table() -> Geometry:
    """Returns a round board. Its UVs are projected from above, because the grain runs straight through the wood."""
    r, bevel = TABLE_RADIUS, 0.006
    runs = [
        [(0.0, -0.028), (r - bevel, -0.028)],
        arc((r - bevel, -0.028 + bevel), bevel, -90, 0, 4)
        + arc((r - bevel, -bevel), bevel, 0, 90, 4),
        [(r - bevel, 0.0), (0.0, 0.0)],
    ]
    out = lathe(runs, 96)
    # The rim shows the end grain, so the grain shifts with height.
    out.uvs = [(x / (2 * r) + 0.5, z / (2 * r) + 0.5 + 0.8 * y) for x, y, z in out.positions]
    return out


# Each vessel: name, shape, glass, place on the table (x, z), contents, and the height of the contents.
GLASSES: Tuple[Tuple[str, str, str, Vec2, str, float], ...] = (
    ("green bottle", "bottle", "bottle green", (-0.135, -0.160), "red wine", 0.168),
    ("cobalt bottle", "bottle", "cobalt", (0.050, -0.215), "", 0.0),
    ("red wine", "wine glass", "clear", (-0.03, -0.03), "red wine", 0.150),
    ("white wine", "wine glass", "clear", (0.135, -0.085), "white wine", 0.158),
    ("empty glass", "wine glass", "rose", (-0.225, 0.0), "", 0.0),
    ("flute", "flute", "smoke", (0.225, -0.175), "white wine", 0.205),
    ("aqua tumbler", "tumbler", "aqua", (0.205, 0.075), "water", 0.066),
    ("whisky", "tumbler", "clear", (0.065, 0.115), "whisky", 0.052),
    ("bowl", "bowl", "clear", (-0.125, 0.155), "", 0.0),
)
TINTS = (
    ("clear", "#bcd0d4", 0.30),
    ("smoke", "#8d9aa6", 0.34),
    ("aqua", "#35a8b4", 0.45),
    ("rose", "#e0607e", 0.45),
    ("bottle green", "#1c6234", 0.80),
    ("cobalt", "#2044b4", 0.70),
    ("red wine", "#74001a", 0.72),
    ("white wine", "#eec040", 0.40),
    ("whisky", "#c47a00", 0.66),
    ("water", "#9fc9dc", 0.15),
)


def _table_and_backdrop(glb: Glb) -> None:
    wall = glb.store(graded_wall(1.4, -0.9, 1.3, srgb("#77808a"), srgb("#262d36")))
    matte = glb.material("backdrop", roughness=1.0)
    glb.node("backdrop", glb.mesh("backdrop", (wall, matte)), at=(0.0, 0.0, -0.9))
    wood = glb.material("oiled wood", roughness=0.55, texture=glb.texture("wood", _wood_png()))
    glb.node("table", glb.mesh("table", (glb.store(_table()), wood)), turn=axis_angle(Y, 12))


def _dress_bottle(glb: Glb, bottle: int) -> None:
    """Adds a paper label and a cork, the opaque parts of the scene."""
    paper = glb.material("label", roughness=0.8, texture=glb.texture("label", _label_png()))
    label = glb.mesh("label", (glb.store(_label(0.0380, 0.055, 0.135, 62.0)), paper))
    glb.node("green bottle/label", label, turn=axis_angle(Y, 8), parent=bottle)
    stopper = glb.store(cylinder(0.0094, 0.0, 0.034, bevel=0.0008))
    cork = glb.mesh("cork", (stopper, glb.material("cork", "#c79a6b", roughness=0.95)))
    glb.node("green bottle/cork", cork, at=(0.0, 0.282, 0.0), parent=bottle)


def _ice(glb: Glb, tumbler: int) -> None:
    cube = glb.store(rounded_box((0.013, 0.013, 0.013), 0.0035))
    ice = glb.mesh("ice cube", (cube, glb.glass("ice", "#e4f1f6", 0.24, 0.2)))
    for k, (x, y, z, tilt) in enumerate(((0.010, 0.036, 0.006, 18), (-0.013, 0.047, -0.010, -24))):
        turn = quat_mul(axis_angle(Y, 31 + 47 * k), axis_angle(X, tilt))
        glb.node(f"whisky/ice {k + 1}", ice, at=(x, y, z), turn=turn, parent=tumbler)


def _marbles(glb: Glb, bowl: int) -> None:
    """Adds one marble in the middle, a ring of six around it, and three on top. Each is a lens with two layers."""
    ball = glb.store(sphere(0.0155, 24))
    kinds: List[int] = []
    for name, colour in (
        ("ruby", "#c81e3a"),
        ("amber", "#e8961e"),
        ("emerald", "#1e9a5a"),
        ("sapphire", "#2250c8"),
        ("violet", "#8a3cc0"),
    ):
        kinds.append(glb.mesh(f"{name} marble", (ball, glb.glass(name, colour, 0.5, 0.05))))
    places: List[Vec3] = [(0.0, 0.0265, 0.0)]
    for count, first, radius, height in ((6, 8, 0.0335, 0.0325), (3, 38, 0.0185, 0.0565)):
        for k in range(count):
            angle = math.radians(first + 360 * k / count)
            places.append((radius * math.cos(angle), height, radius * math.sin(angle)))
    for k, at in enumerate(places):
        kind = kinds[(k * 3 + k // 4) % len(kinds)]
        glb.node(f"bowl/marble {k + 1}", kind, at=at, parent=bowl)


def build() -> Glb:
    glb = Glb("Glasses")
    _table_and_backdrop(glb)
    tints = {name: glb.glass(name, colour, alpha, 0.06) for name, colour, alpha in TINTS}
    walls = {name: glb.store(vessel.glass()) for name, vessel in VESSELS.items()}
    groups = {}
    for name, shape, tint, (x, z), content, level in GLASSES:
        # The vessels are slightly above the table, because surfaces must not coincide there.
        group = groups[name] = glb.node(name, at=(x, 0.0002, z))
        glass = glb.mesh(f"{shape}, {tint}", (walls[shape], tints[tint]))
        glb.node(f"{name}/glass", glass, parent=group)
        if content:
            body = glb.store(VESSELS[shape].filled(level))
            liquid = glb.mesh(f"{content} in {name}", (body, tints[content]))
            glb.node(f"{name}/{content}", liquid, parent=group)
    _dress_bottle(glb, groups["green bottle"])
    _ice(glb, groups["whisky"])
    _marbles(glb, groups["bowl"])
    glb.perspective("main", (0.05, 0.43, 1.06), (0.005, 0.118, -0.02), math.radians(24.5))
    glb.perspective("top", (0.0, 1.3, 0.0), (0.0, 0.0, 0.0), math.radians(40), up=(0.0, 0.0, -1.0))
    return glb
