#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the scenes of the benchmarks: python3 tests/benchmarks/scenes.py FOLDER [NAME ...]

Uses only the standard library, with fixed seeds, so the bytes are always the same. Each scene has one camera with an
aspect ratio of 16:9. N is one of the numbers in LAYERS or SOUPS.

    spheres        30 glass spheres of 6,240 triangles each, up to 24 layers
    fine-spheres   30 glass spheres of 57,120 triangles each
    small-spheres  200 glass spheres of 6,240 triangles each, up to 38 layers
    large-spheres  100 glass spheres of 1,520 triangles each, about 70 layers
    forest         300 trees whose leaves are cut out of cards by a MASK material
    city           1,600 opaque buildings
    soup-192k      30 overlapping spheres of 6,400 triangles each, for parallel rays
    soup-1728k     30 overlapping spheres of 57,600 triangles each
    soup-1280k     200 spheres of 6,400 triangles each
    soup-640k      400 large spheres of 1,600 triangles each, about 28 hits per ray
    cube-192k      30 spheres of 6,400 triangles each, in a cube
    cube-160k      100 spheres of 1,600 triangles each, in a cube
    soup-of-N      N spheres of 1,600 triangles each; hits per ray grow in proportion to N
    quads-N        N panes of glass, each over the whole picture: N layers in every pixel
    triangle       one triangle
"""
from __future__ import annotations

import argparse
import math
import random
import sys
from pathlib import Path
from typing import Callable, Dict, List, Tuple

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "examples"))

from scene_kit.glb import CLAMP, Geometry, Glb  # noqa: E402
from scene_kit.png import Pixel, png  # noqa: E402
from scene_kit.shapes import box, lathe, moved, quad, tube  # noqa: E402
from scene_kit.vec import X, Y, Vec3, axis_angle, cross, normalize, scale, sub  # noqa: E402

YFOV = math.radians(40)
GLASS = ("#e5383b", "#2a6fdb", "#f4a020", "#8cc63f", "#b455d0", "#2bc4b8")


def _glasses(glb: Glb) -> List[int]:
    return [glb.glass(colour, colour, 0.4, 0.35) for colour in GLASS]


def _sphere(segments: int, rows: int) -> Geometry:
    """Returns a sphere with 2 · segments · (rows − 1) triangles."""
    profile = [(math.sin(math.pi * i / rows) if 0 < i < rows else 0.0, -math.cos(math.pi * i / rows))
               for i in range(rows + 1)]
    return lathe([profile], segments)


def _spheres(count: int, segments: int, rows: int, radius: float, seed: int, half: Vec3 = (3.4, 1.7, 3.0)) -> Glb:
    """Returns spheres at random positions. The callers choose radius and seed for a number of fragments and layers at
    1920 x 1080 pixels. `half` is half the size of the box that contains their centres."""
    glb = Glb(f"{count} spheres")
    stored = glb.store(_sphere(segments, rows))
    meshes = [glb.mesh(f"sphere {i}", (stored, glass)) for i, glass in enumerate(_glasses(glb))]
    dice = random.Random(seed)
    for i in range(count):
        x, y, z = ((2 * dice.random() - 1) * side for side in half)
        size = radius * (0.75 + 0.5 * dice.random())
        glb.node(f"sphere {i}", meshes[i % len(meshes)], at=(x, y, z), size=(size,) * 3)
    glb.perspective("camera", (0.0, 0.0, 10.0), (0.0, 0.0, 0.0), YFOV, near=0.1)
    return glb


def _leaf_texel(x: int, y: int, side: int = 64) -> Pixel:
    """Returns a texel of a leaf, a pointed oval with a pale midrib. At the rim, alpha falls to 0 over two texels."""
    across, along = abs((x + 0.5) / side - 0.5), 1.0 - (y + 0.5) / side
    inside = (0.42 * math.sin(math.pi * along) ** 0.8 - across) * side / 2 + 0.5
    tone = 1.25 if across < 0.03 else 0.85 + 0.3 * along
    return (round(70 * tone), round(140 * tone), round(45 * tone), round(255 * min(1, max(0, inside))))


def _cluster(dice: random.Random, leaves: int) -> Geometry:
    """Returns leaves at the rim of a crown, each on a card rotated at random."""
    out, card = Geometry(), quad(0.16, 0.22)
    for _ in range(leaves):
        height, angle = 2 * dice.random() - 1, 2 * math.pi * dice.random()
        reach = (0.35 + 0.65 * dice.random()) * math.sqrt(1 - height * height)
        at = (1.3 * reach * math.cos(angle), 3.0 + 1.6 * height, 1.3 * reach * math.sin(angle))
        yaw, pitch = axis_angle(Y, 360 * dice.random()), axis_angle(X, 120 * dice.random() - 60)
        out.append(moved(moved(card, turn=pitch), at, yaw))
    return out


def forest() -> Glb:
    glb, dice = Glb("Forest"), random.Random(11)
    bark = glb.material("bark", "#6b4a33", roughness=0.95)
    soil = glb.material("soil", "#5d6b3a", roughness=1.0)
    leaf = glb.material("leaf", roughness=0.8, texture=glb.texture("leaf", png(64, 64, _leaf_texel), CLAMP),
                        mode="MASK", double_sided=True)
    trunk = glb.store(tube([(0.0, 0.0, 0.0), (0.05, 1.5, 0.0), (0.0, 3.2, 0.05)], [0.18, 0.13, 0.05], 8))
    trees = [glb.mesh(f"tree {i}", (trunk, bark), (glb.store(_cluster(dice, 420)), leaf)) for i in range(3)]
    glb.node("ground", glb.mesh("ground", (glb.store(quad(60, 60)), soil)), turn=axis_angle(X, -90))
    for i in range(300):
        at = (44 * dice.random() - 22, 0.0, -2 - 46 * dice.random())
        size = 0.8 + 0.5 * dice.random()
        glb.node(f"tree {i}", trees[i % 3], at=at, turn=axis_angle(Y, 360 * dice.random()), size=(size,) * 3)
    glb.perspective("camera", (0.0, 2.2, 6.0), (0.0, 2.6, -10.0), math.radians(50), near=0.1)
    return glb


def _building(floors: int) -> Geometry:
    """Returns a shaft with a ledge at each floor, pillars at its corners and a small house on its roof."""
    height = 0.3 * floors
    out = moved(box((0.36, height / 2, 0.36)), (0.0, height / 2, 0.0))
    for floor in range(1, floors + 1):
        out.append(moved(box((0.4, 0.03, 0.4)), (0.0, 0.3 * floor, 0.0)))
    for x in (-0.36, 0.36):
        for z in (-0.36, 0.36):
            out.append(moved(box((0.03, height / 2, 0.03)), (x, height / 2, z)))
    return out.append(moved(box((0.14, 0.1, 0.18)), (0.1, height + 0.13, 0.0)))


def city() -> Glb:
    glb, dice = Glb("City"), random.Random(12)
    walls = [glb.material(colour, colour, roughness=0.8)
             for colour in ("#b9b2a3", "#8f9aa5", "#a5735a", "#d0c7b5", "#6f7680")]
    asphalt = glb.material("asphalt", "#3c3d40", roughness=0.95)
    kinds = [glb.mesh(f"building {floors}", (glb.store(_building(floors)), walls[i % 5]))
             for i, floors in enumerate((5, 7, 9, 12, 15, 19, 24))]
    glb.node("street", glb.mesh("street", (glb.store(quad(30, 30)), asphalt)), turn=axis_angle(X, -90))
    for row in range(40):
        for column in range(40):
            tall = 0.7 + 0.6 * dice.random()
            glb.node(f"building {row},{column}", kinds[int(dice.random() * len(kinds))],
                     at=(1.2 * (column - 19.5), 0.0, 1.2 * (row - 19.5)), size=(1.0, tall, 1.0))
    glb.perspective("camera", (3.0, 11.0, 30.0), (0.0, 1.0, 2.0), YFOV, near=0.1)
    return glb


def quads(count: int) -> Glb:
    glb = Glb(f"{count} panes")
    pane = glb.store(quad(2.0, 1.2))
    meshes = [glb.mesh(f"pane {i}", (pane, glass)) for i, glass in enumerate(_glasses(glb))]
    for i in range(count):
        glb.node(f"pane {i}", meshes[i % len(meshes)], at=(0.0, 0.0, -i / 128))
    glb.perspective("camera", (0.0, 0.0, 2.0), (0.0, 0.0, 0.0), YFOV, near=0.1)
    return glb


def triangle() -> Glb:
    glb = Glb("Triangle")
    a, b, c = (-0.5, -0.4, 0.0), (0.5, -0.4, 0.0), (0.0, 0.5, 0.0)
    normal: Vec3 = normalize(cross(sub(b, a), sub(c, a)))
    stored = glb.store(Geometry([a, b, c], [normal] * 3, [], [], [0, 1, 2]))
    glb.node("triangle", glb.mesh("triangle", (stored, glb.glass("glass", GLASS[0], 0.4, 0.35))))
    glb.perspective("camera", scale((0.0, 0.0, 1.0), 2.0), (0.0, 0.0, 0.0), YFOV, near=0.1)
    return glb


LAYERS: Tuple[int, ...] = (1, 2, 4, 8, 16, 32, 64, 128)
SOUPS: Tuple[int, ...] = (16, 32, 64, 128, 256, 512, 1024)
CUBE: Vec3 = (2.4, 2.4, 2.4)
SCENES: Dict[str, Callable[[], Glb]] = {
    "spheres": lambda: _spheres(30, 80, 40, 1.206, 17),
    "fine-spheres": lambda: _spheres(30, 240, 120, 1.206, 17),
    "small-spheres": lambda: _spheres(200, 80, 40, 0.516, 5),
    "large-spheres": lambda: _spheres(100, 40, 20, 1.519, 1),
    "forest": forest,
    "city": city,
    "soup-192k": lambda: _spheres(30, 80, 41, 1.804, 17),
    "soup-1728k": lambda: _spheres(30, 240, 121, 1.803, 17),
    "soup-1280k": lambda: _spheres(200, 80, 41, 0.391, 5),
    "soup-640k": lambda: _spheres(400, 40, 21, 1.895, 1),
    "cube-192k": lambda: _spheres(30, 80, 41, 1.149, 17, CUBE),
    "cube-160k": lambda: _spheres(100, 40, 21, 0.871, 1, CUBE),
    **{f"soup-of-{n}": lambda n=n: _spheres(n, 40, 21, 0.95, 3) for n in SOUPS},  # type: ignore[misc]
    "triangle": triangle,
    **{f"quads-{n}": lambda n=n: quads(n) for n in LAYERS},  # type: ignore[misc]
}


def write(folder: Path, name: str) -> Path:
    """Writes a scene and returns its path."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.glb"
    path.write_bytes(SCENES[name]().bytes())
    return path


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", metavar="NAME", help="which ones (default: all)")
    options = parser.parse_args()
    unknown = sorted(set(options.names) - set(SCENES))
    if unknown:
        parser.error(f"no scene is called {', '.join(unknown)}; there are {', '.join(SCENES)}")
    for name in options.names or SCENES:
        path = write(options.folder, name)
        counts = ", ".join(f"{count} {what}" for what, count in SCENES[name]().summary().items())
        print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB, {counts}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
