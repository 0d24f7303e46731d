# SPDX-License-Identifier: Apache-2.0
"""A two-stage gearbox in a see-through housing: gears, shafts, bearings, bolts, oil."""
from __future__ import annotations

import math
from typing import Dict, List, Sequence, Tuple

from scene_kit.curves import arc, circle
from scene_kit.glb import Geometry, Glb
from scene_kit.shapes import extrude, rounded_box, sphere
from scene_kit.vec import IDENTITY, Vec2, Vec3, Vec4, X, Y, Z, axis_angle
from scene_kit.machine import (
    bearing_ring,
    bolt,
    gear,
    hex_head,
    hull,
    pulley,
    ring,
    shaft,
    sharp,
    spun,
    torus,
    washer,
)

MODULE = 0.004
# The numbers of teeth in each gear pair. They determine the distances between the shafts.
FIRST, SECOND = (15, 33), (17, 30)
COUNTER_X = 0.0
INPUT_X = COUNTER_X - MODULE * sum(FIRST) / 2
OUTPUT_X = COUNTER_X + MODULE * sum(SECOND) / 2
SHAFTS = (("input", INPUT_X), ("counter", COUNTER_X), ("output", OUTPUT_X))
FIRST_Z, SECOND_Z = 0.028, -0.026

HALF_DEPTH, PLATE, WALL = 0.058, 0.012, 0.006
BORE, RACE = 0.010, 0.025  # radii of the shaft and of the seat of a bearing
CASE_CIRCLES = ((INPUT_X, 0.058), (COUNTER_X, 0.090), (OUTPUT_X, 0.084))
SPLIT = 0.0008  # half the thickness of the gasket between the two halves of the housing
FLANGE_REACH = HALF_DEPTH + PLATE
FLANGES = (
    ("left", CASE_CIRCLES[0][0] - CASE_CIRCLES[0][1] - 0.0122),
    ("right", CASE_CIRCLES[2][0] + CASE_CIRCLES[2][1] + 0.0122),
)


def _case(inset: float) -> List[Vec2]:
    """Returns the outline of the housing: a belt around three circles."""
    points = [p for x, radius in CASE_CIRCLES for p in circle((x, 0.0), radius - inset, 72)]
    return [(x, 0.0 if abs(y) < 1e-9 else y) for x, y in hull(points)]


def _half(outline: Sequence[Vec2], split: float) -> List[Vec2]:
    """Returns the part of a convex outline above y = `split`, from the right over the top to the left."""
    above: List[Vec2] = []
    ends: List[float] = []
    for a, c in zip(outline, [*outline[1:], outline[0]]):
        if a[1] > split + 1e-6:
            above.append(a)
        if (a[1] > split) != (c[1] > split):
            ends.append(a[0] + (c[0] - a[0]) * (split - a[1]) / (c[1] - a[1]))
    above.sort(key=lambda p: -p[0])
    return [(max(ends), split), *above, (min(ends), split)]


def _flipped(points: Sequence[Vec2]) -> List[Vec2]:
    return [(x, -y) for x, y in reversed(points)]


def _arch() -> List[Vec2]:
    return _half(_case(0.0), SPLIT) + _half(_case(WALL), SPLIT)[::-1]


def _end_plate() -> List[Vec2]:
    """Returns half an end wall, with half a seat for each bearing."""
    out = _half(_case(0.0), SPLIT)
    lift = math.degrees(math.asin(SPLIT / RACE))
    for _, x in SHAFTS:
        out += arc((x, 0.0), RACE, 180 - lift, lift, 24)
    return out


def _rim_places(count: int) -> List[Vec2]:
    """Returns places that are spread evenly along the arch, in the middle of the end plate's edge."""
    line = _half(_case(0.0075), 0.012)
    steps = [math.dist(a, b) for a, b in zip(line, line[1:])]
    places: List[Vec2] = []
    for k in range(count):
        want = sum(steps) * (k + 0.5) / count
        for (a, b), step in zip(zip(line, line[1:]), steps):
            if want <= step:
                places.append(
                    (a[0] + (b[0] - a[0]) * want / step, a[1] + (b[1] - a[1]) * want / step)
                )
                break
            want -= step
    return places


class _Builder:
    """The file, its materials, and the meshes shared by many nodes."""

    def __init__(self) -> None:
        self.glb = glb = Glb("Gearbox")
        self.mat: Dict[str, int] = {
            "gear": glb.material("gear steel", "#b4b9c0", metallic=1.0, roughness=0.34),
            "bronze": glb.material("bronze", "#c8913f", metallic=1.0, roughness=0.30),
            "copper": glb.material("copper", "#c9704a", metallic=1.0, roughness=0.28),
            "shaft": glb.material("ground steel", "#dadde0", metallic=1.0, roughness=0.18),
            "race": glb.material("bearing steel", "#8e959d", metallic=1.0, roughness=0.22),
            "ball": glb.material("polished steel", "#eceef0", metallic=1.0, roughness=0.06),
            "bolt": glb.material("black oxide", "#3a3b3f", metallic=0.9, roughness=0.42),
            "zinc": glb.material("zinc plate", "#d9c98a", metallic=0.95, roughness=0.38),
            "red": glb.material("red paint", "#b8232a", roughness=0.35),
            "cast": glb.material("green enamel", "#2f5d50", roughness=0.5),
            "iron": glb.material("cast iron", "#4b4d50", metallic=0.6, roughness=0.7),
            "gasket": glb.material("gasket", "#22252a", roughness=0.9),
            "upper": glb.glass("upper housing", "#7fb4e0", 0.09, 0.12),
            "lower": glb.glass("lower housing", "#a9bccb", 0.12, 0.12),
            "oil": glb.glass("oil", "#e08a00", 0.5, 0.12),
        }
        self._meshes: Dict[str, int] = {}

    def mesh(self, name: str, *parts: Tuple[Geometry, str]) -> int:
        if name not in self._meshes:
            self._meshes[name] = self.glb.mesh(
                name, *((self.glb.store(g), self.mat[m]) for g, m in parts)
            )
        return self._meshes[name]

    def put(
        self,
        name: str,
        mesh: int,
        at: Vec3 = (0.0, 0.0, 0.0),
        turn: Vec4 = IDENTITY,
        parent: int = -1,
    ) -> int:
        return self.glb.node(name, mesh, at, turn, parent=None if parent < 0 else parent)


DOWN, UP, BACK = axis_angle(X, 90), axis_angle(X, -90), axis_angle(Y, 180)  # these rotate +z to -y, +y and -z


def _housing(b: _Builder, root: int, bolt_mesh: int) -> None:
    for half, flip in (("upper", False), ("lower", True)):
        group = b.glb.node(f"housing/{half}", parent=root)
        _half_housing(b, group, half, flip, bolt_mesh)
    nut = b.mesh("nut", (hex_head(0.0057, 0.004), "zinc"))
    seam = b.mesh("gasket", (rounded_box((0.012, SPLIT, FLANGE_REACH), 0.0003, 1), "gasket"))
    for side, x in FLANGES:
        b.put(f"housing/gasket {side}", seam, (x, 0.0, 0.0), parent=root)
        for k in range(4):
            z = -0.051 + 0.034 * k
            b.put(f"housing/flange bolt {side} {k + 1}", bolt_mesh, (x, 0.0112, z), UP, root)
            b.put(f"housing/flange nut {side} {k + 1}", nut, (x, -0.0112, z), DOWN, root)
    _oil_and_fittings(b, root)


def _half_housing(b: _Builder, group: int, half: str, flip: bool, bolt_mesh: int) -> None:
    """Adds the shell, two end plates and two flanges, and the bolts that hold the plates."""
    name = f"housing/{half}"
    arch, plate_outline = _arch(), _end_plate()
    if flip:
        arch, plate_outline = _flipped(arch), _flipped(plate_outline)
    shell = b.mesh(f"{half} shell", (extrude(arch, [], -HALF_DEPTH, HALF_DEPTH), half))
    b.put(f"{name}/shell", shell, parent=group)
    plate = b.mesh(f"{half} end plate", (extrude(plate_outline, [], 0.0, PLATE), half))
    flange = b.mesh(f"{half} flange", (rounded_box((0.012, 0.005, FLANGE_REACH), 0.0018, 2), half))
    sign = -1.0 if flip else 1.0
    for side, x in FLANGES:
        b.put(f"{name}/flange {side}", flange, (x, sign * (0.005 + SPLIT), 0.0), parent=group)
    for side, z in (("front", HALF_DEPTH + 0.0002), ("back", -HALF_DEPTH - PLATE - 0.0002)):
        b.put(f"{name}/{side} plate", plate, (0.0, 0.0, z), parent=group)
        head = math.copysign(HALF_DEPTH + PLATE + 0.0005, z)
        for k, (x, y) in enumerate(_rim_places(9)):
            at = (x, sign * y, head)
            b.put(f"{name}/{side} bolt {k + 1}", bolt_mesh, at, IDENTITY if z > 0 else BACK, group)


def _oil_and_fittings(b: _Builder, root: int) -> None:
    level, gap = -0.046, 0.0008
    sump = _flipped(_half(_case(WALL + gap), -level))
    oil = b.mesh("oil", (extrude(sump, [], -HALF_DEPTH + gap, HALF_DEPTH - gap), "oil"))
    b.put("housing/oil", oil, parent=root)
    top = 0.0885
    profile = [(0.0, -0.006), (0.006, -0.006), (0.006, 0.004), (0.013, 0.004), (0.013, 0.012)]
    cap = arc((0.009, 0.012), 0.004, 0, 90, 5) + [(0.0, 0.0175)]
    breather = b.mesh("breather", (spun([*sharp(profile), cap], 40), "bronze"))
    b.put("housing/breather", breather, (0.052, top, -0.010), UP, root)
    eye = b.mesh("lifting eye", (torus(0.012, 0.0032), "zinc"))
    b.put("housing/lifting eye", eye, (-0.008, top + 0.0155, 0.012), parent=root)


def _bearing(b: _Builder, name: str, z: float, parent: int) -> None:
    pitch, ball, width = (BORE + RACE) / 2, 0.0044, 0.013
    at = b.glb.node(name, at=(0.0, 0.0, z), parent=parent)
    inner = bearing_ring(BORE + 0.0002, pitch - 0.0026, width, pitch, ball, True)
    outer = bearing_ring(pitch + 0.0026, RACE - 0.0003, width, pitch, ball, False)
    b.put(f"{name}/inner race", b.mesh("inner race", (inner, "race")), parent=at)
    b.put(f"{name}/outer race", b.mesh("outer race", (outer, "race")), parent=at)
    ball_mesh = b.mesh("ball", (sphere(ball, 20), "ball"))
    for k in range(9):
        angle = 2 * math.pi * k / 9
        b.put(
            f"{name}/ball {k + 1}",
            ball_mesh,
            (pitch * math.cos(angle), pitch * math.sin(angle), 0.0),
            parent=at,
        )


def _shafts(b: _Builder, root: int, screw: int) -> None:
    groups = {name: b.glb.node(name, at=(x, 0.0, 0.0), parent=root) for name, x in SHAFTS}
    seat = BORE - 0.0001
    inside = (0.0125, 2 * HALF_DEPTH)
    stub, tail = (seat, PLATE + 0.002), (seat, PLATE + 0.012)
    out = [tail, inside, (seat, PLATE + 0.014), (0.0085, 0.036)]
    long_shaft = b.mesh("long shaft", (shaft(out, -FLANGE_REACH - 0.012), "shaft"))
    short_shaft = b.mesh(
        "short shaft", (shaft([stub, inside, stub], -FLANGE_REACH - 0.002), "shaft")
    )
    for name, group in groups.items():
        b.put(f"{name}/shaft", short_shaft if name == "counter" else long_shaft, parent=group)
        for side, z in (("front", HALF_DEPTH + PLATE / 2), ("back", -HALF_DEPTH - PLATE / 2)):
            _bearing(b, f"{name}/{side} bearing", z, group)

    for name, teeth, z, turn, material, holes in (
        ("input", FIRST[0], FIRST_Z, 0.0, "bronze", 0),
        ("counter", FIRST[1], FIRST_Z, 0.0, "gear", 6),
        ("counter", SECOND[0], SECOND_Z, 0.0, "copper", 0),
        ("output", SECOND[1], SECOND_Z, 180.0 / SECOND[1], "gear", 5),
    ):
        # A tooth of the left gear points at the right gear. A right gear with an even number of teeth is turned by half
        # a tooth, so that a gap faces this tooth.
        wheel = b.mesh(f"gear {teeth}", (gear(teeth, MODULE, 0.024, 0.0127, holes), material))
        spin = axis_angle(Z, turn) if turn else IDENTITY
        b.put(f"{name}/gear of {teeth}", wheel, (0.0, 0.0, z), spin, groups[name])

    _pulley(b, groups["input"])
    _coupling(b, groups["output"], screw)
    _covers(b, groups["counter"], screw)


def _pulley(b: _Builder, group: int) -> None:
    wheel = b.mesh("pulley", (pulley(0.040, 0.026, 0.0086, 3), "red"))
    b.put("input/pulley", wheel, (0.0, 0.0, FLANGE_REACH + 0.030), parent=group)
    nut = b.mesh("shaft nut", (hex_head(0.013, 0.007), "zinc"))
    b.put("input/nut", nut, (0.0, 0.0, FLANGE_REACH + 0.0462), parent=group)


def _coupling(b: _Builder, group: int, screw: int) -> None:
    places = circle((0.0, 0.0), 0.0285, 6)
    holes = [circle((0.0, 0.0), 0.0086, 40), *(circle(p, 0.0031, 16) for p in places)]
    disc = extrude(circle((0.0, 0.0), 0.038, 64), holes, -0.004, 0.005)
    disc.append(ring(0.0086, 0.017, -0.018, -0.004, 0.001))
    mesh = b.mesh("coupling", (disc, "iron"))
    node = b.put("output/coupling", mesh, (0.0, 0.0, FLANGE_REACH + 0.040), parent=group)
    for k, (x, y) in enumerate(places):
        b.put(f"output/coupling/bolt {k + 1}", screw, (x, y, 0.0052), parent=node)


def _covers(b: _Builder, group: int, screw: int) -> None:
    """Adds lids over the bearings of the counter shaft, which ends inside the housing."""
    profile = [
        (0.0, 0.0),
        (0.032, 0.0),
        (0.032, 0.004),
        (0.022, 0.004),
        (0.019, 0.009),
        (0.0, 0.009),
    ]
    cover = b.mesh("bearing cover", (spun(sharp(profile), 56), "cast"))
    for side, z in (("front", FLANGE_REACH + 0.003), ("back", -FLANGE_REACH - 0.003)):
        turn = IDENTITY if z > 0 else BACK
        lid = b.put(f"counter/{side} cover", cover, (0.0, 0.0, z), turn, group)
        for k in range(4):
            angle = math.radians(45 + 90 * k)
            at = (0.0268 * math.cos(angle), 0.0268 * math.sin(angle), 0.0042)
            b.put(f"counter/{side} cover/bolt {k + 1}", screw, at, parent=lid)


def _base(b: _Builder, root: int) -> None:
    group = b.glb.node("base", parent=root)
    plate = rounded_box((0.215, 0.009, 0.100), 0.004, 3)
    b.put("base/plate", b.mesh("base plate", (plate, "iron")), (0.012, -0.120, 0.0), parent=group)
    # This outline follows the belly of the sump with a millimetre of clearance.
    belly = _flipped(_half(_case(-0.001), 0.040))
    foot = [(-0.144, -0.060), (-0.150, -0.1105), (0.182, -0.1105), (0.176, -0.060)]
    saddle = b.mesh("saddle", (extrude(foot + belly[::-1], [], -0.007, 0.007), "cast"))
    for side, z in (("front", 0.040), ("back", -0.040)):
        b.put(f"base/{side} saddle", saddle, (0.0, 0.0, z), parent=group)
    anchor = b.mesh("anchor", (bolt(0.006, 0.016), "bolt"), (washer(0.006), "zinc"))
    corners = ((-0.180, 0.080), (0.204, 0.080), (0.204, -0.080), (-0.180, -0.080))
    for k, (x, z) in enumerate(corners):
        b.put(f"base/anchor {k + 1}", anchor, (x, -0.1108, z), UP, group)


def build() -> Glb:
    b = _Builder()
    root = b.glb.node("gearbox", at=(0.0, 0.129, 0.0))
    bolt_mesh = b.mesh("bolt", (bolt(0.0029, 0.014), "bolt"), (washer(0.0029), "zinc"))
    screw = b.mesh("screw", (bolt(0.0024, 0.008), "bolt"))
    _base(b, root)
    _housing(b, root, bolt_mesh)
    _shafts(b, root, screw)
    b.glb.perspective("main", (0.33, 0.37, 0.80), (0.012, 0.112, 0.0), math.radians(24.5))
    b.glb.orthographic(
        "top", (0.0, 1.0, 0.0), (0.0, 0.0, 0.0), 0.16, near=0.1, far=2.0, up=(0.0, 0.0, -1.0)
    )
    return b.glb
