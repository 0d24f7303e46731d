# SPDX-License-Identifier: Apache-2.0
"""Machine parts such as gears, shafts, bearings and bolts, each with its axis along z."""
from __future__ import annotations

import math
from typing import List, Sequence, Tuple

from .curves import arc, circle, gear_outline, polygon
from .glb import Geometry
from .shapes import cylinder, extrude, lathe, moved
from .vec import Vec2, X, axis_angle

UPRIGHT_TO_Z = axis_angle(X, 90)


def spun(runs: Sequence[Sequence[Vec2]], segments: int = 48) -> Geometry:
    """Returns a solid of revolution about z with the profile (radius, z)."""
    return moved(lathe(runs, segments), turn=UPRIGHT_TO_Z)


def sharp(outline: Sequence[Vec2]) -> List[Sequence[Vec2]]:
    """Returns one run per edge of the outline, for `spun`; coincident corners are merged."""
    return [(p, q) for p, q in zip(outline, outline[1:]) if math.dist(p, q) > 1e-9]


def ring(
    inner: float, outer: float, z0: float, z1: float, bevel: float, segments: int = 48
) -> Geometry:
    """Returns a tube with a rectangular section and bevelled edges."""
    b = bevel
    corners = [
        (inner + b, z0),
        (outer - b, z0),
        (outer, z0 + b),
        (outer, z1 - b),
        (outer - b, z1),
        (inner + b, z1),
        (inner, z1 - b),
        (inner, z0 + b),
    ]
    return spun(sharp([*corners, corners[0]]), segments)


def gear(teeth: int, module: float, width: float, bore: float, spokes: int = 0) -> Geometry:
    """Returns a spur gear with a hub that protrudes on both sides and, if `spokes`, holes in its web."""
    pitch, hub = module * teeth / 2, bore * 1.75
    holes: List[List[Vec2]] = [circle((0.0, 0.0), bore, 48)]
    rim = pitch - 2.4 * module
    if spokes:
        middle, radius = (rim + hub) / 2, (rim - hub) * 0.40
        for k in range(spokes):
            angle = 2 * math.pi * (k + 0.5) / spokes
            holes.append(circle((middle * math.cos(angle), middle * math.sin(angle)), radius, 28))
    half = width / 2
    out = extrude(gear_outline(teeth, module), holes, -half, half)
    if rim > hub:
        for z0, z1 in ((half, half + 0.004), (-half - 0.004, -half)):
            out.append(ring(bore, hub, z0, z1, 0.0008))
    return out


def shaft(steps: Sequence[Tuple[float, float]], z0: float) -> Geometry:
    """Returns a shaft: one cylinder after another, (radius, length) each, with every shoulder cut at 45 degrees."""
    b = 0.0008
    outline: List[Vec2] = [(0.0, z0)]
    z = z0
    for radius, length in steps:
        outline += [
            (radius - b, z),
            (radius, z + b),
            (radius, z + length - b),
            (radius - b, z + length),
        ]
        z += length
    outline.append((0.0, z))
    return spun(sharp(outline), 40)


def bearing_ring(
    inner: float, outer: float, width: float, ball_pitch: float, ball: float, groove_outside: bool
) -> Geometry:
    """Returns one race of a bearing; its groove is slightly wider than the balls that run in it."""
    h, groove = width / 2, ball * 1.06
    wall = outer if groove_outside else inner
    reach = math.degrees(math.acos(min(1.0, abs(wall - ball_pitch) / groove)))
    b = 0.0006
    if groove_outside:  # the inner race, whose groove is on its outside
        track = arc((ball_pitch, 0.0), groove, 180 + reach, 180 - reach, 10)
        corners = [(inner + b, -h), (outer - b, -h), (outer, -h + b), track[0]]
        after = [
            track[-1],
            (outer, h - b),
            (outer - b, h),
            (inner + b, h),
            (inner, h - b),
            (inner, -h + b),
            corners[0],
        ]
    else:
        track = arc((ball_pitch, 0.0), groove, reach, -reach, 10)
        corners = [
            (inner + b, -h),
            (outer - b, -h),
            (outer, -h + b),
            (outer, h - b),
            (outer - b, h),
            (inner + b, h),
            (inner, h - b),
            track[0],
        ]
        after = [track[-1], (inner, -h + b), corners[0]]
    runs: List[Sequence[Vec2]] = [[a, c] for a, c in zip(corners, corners[1:])]
    runs.append(track)
    runs += [[a, c] for a, c in zip(after, after[1:])]
    return spun(runs, 48)


def hex_head(radius: float, height: float) -> Geometry:
    """Returns a hexagonal head with a low turned crown, which extends upward from z = 0."""
    out = extrude(polygon(6, radius), [], 0.0, height)
    flat = radius * math.cos(math.pi / 6)
    return out.append(
        spun(
            [
                [(flat * 0.96, height), (flat * 0.80, height + radius * 0.10)],
                [(flat * 0.80, height + radius * 0.10), (0.0, height + radius * 0.10)],
            ],
            24,
        )
    )


def bolt(thread: float, length: float) -> Geometry:
    """Returns a bolt with its head above z = 0 and its shank below."""
    out = hex_head(thread * 1.9, thread * 1.3)
    return out.append(
        moved(cylinder(thread, -length, 0.0, 20, bevel=thread * 0.2), turn=UPRIGHT_TO_Z)
    )


def washer(thread: float) -> Geometry:
    return ring(thread * 1.05, thread * 2.2, 0.0, thread * 0.4, thread * 0.08, 28)


def pulley(radius: float, width: float, bore: float, grooves: int) -> Geometry:
    """Returns a pulley with several V-belt grooves, a recessed face and a hub."""
    pitch = width / grooves
    z = -width / 2
    outline: List[Vec2] = [
        (bore, z),
        (bore * 2.0, z),
        (bore * 2.0, z + 0.006),
        (radius * 0.72, z + 0.006),
        (radius * 0.78, z),
        (radius, z),
    ]
    for k in range(grooves):
        base = z + k * pitch
        outline += [
            (radius, base + 0.16 * pitch),
            (radius - 0.5 * pitch, base + 0.38 * pitch),
            (radius - 0.5 * pitch, base + 0.62 * pitch),
            (radius, base + 0.84 * pitch),
        ]
    outline += [
        (radius, -z),
        (radius * 0.78, -z),
        (radius * 0.72, -z - 0.006),
        (bore * 2.0, -z - 0.006),
        (bore * 2.0, -z + 0.003),
        (bore, -z + 0.003),
        (bore, z),
    ]
    return spun(sharp(outline), 64)


def torus(radius: float, thickness: float) -> Geometry:
    return spun([arc((radius, 0.0), thickness, 0, 360, 16)], 40)


def hull(points: Sequence[Vec2]) -> List[Vec2]:
    """Returns the convex hull of the points, counter-clockwise (A. M. Andrew, 1979)."""
    ordered = sorted(set(points))

    def half(run: Sequence[Vec2]) -> List[Vec2]:
        chain: List[Vec2] = []
        for p in run:
            while (
                len(chain) > 1
                and (
                    (chain[-1][0] - chain[-2][0]) * (p[1] - chain[-2][1])
                    - (chain[-1][1] - chain[-2][1]) * (p[0] - chain[-2][0])
                )
                <= 1e-15
            ):
                chain.pop()
            chain.append(p)
        return chain[:-1]

    return half(ordered) + half(ordered[::-1])
