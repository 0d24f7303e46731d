# SPDX-License-Identifier: Apache-2.0
"""Polylines, the outlines from which shapes are spun, swept and cut."""
from __future__ import annotations

import math
from typing import List, Sequence

from .vec import Vec2, Vec3


def _spline(p0: float, p1: float, p2: float, p3: float, t: float) -> float:
    """Returns a point on a uniform Catmull-Rom spline."""
    return 0.5 * (
        2 * p1
        + (p2 - p0) * t
        + (2 * p0 - 5 * p1 + 4 * p2 - p3) * t * t
        + (3 * p1 - p0 - 3 * p2 + p3) * t * t * t
    )


def smooth(points: Sequence[Vec2], steps: int) -> List[Vec2]:
    """Returns a curve through the points, with `steps` pieces between neighbours."""
    spatial = smooth3([(x, y, 0.0) for x, y in points], steps)
    return [(x, y) for x, y, _ in spatial]


def smooth3(points: Sequence[Vec3], steps: int) -> List[Vec3]:
    out: List[Vec3] = []
    last = len(points) - 1
    for i in range(last):
        p0, p1, p2, p3 = points[max(0, i - 1)], points[i], points[i + 1], points[min(last, i + 2)]
        for s in range(steps):
            t = s / steps
            out.append(
                (
                    _spline(p0[0], p1[0], p2[0], p3[0], t),
                    _spline(p0[1], p1[1], p2[1], p3[1], t),
                    _spline(p0[2], p1[2], p2[2], p3[2], t),
                )
            )
    out.append(points[last])
    return out


def simplified(points: Sequence[Vec2], tolerance: float) -> List[Vec2]:
    """Returns the points with some removed; each removed point is within `tolerance` of the result (Douglas and
    Peucker, 1973)."""
    (ax, ay), (bx, by) = points[0], points[-1]
    length = math.hypot(bx - ax, by - ay)
    worst, at = 0.0, 0
    for i in range(1, len(points) - 1):
        x, y = points[i]
        off = abs((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / length
        if off > worst:
            worst, at = off, i
    if worst <= tolerance:
        return [points[0], points[-1]]
    return simplified(points[: at + 1], tolerance)[:-1] + simplified(points[at:], tolerance)


def arc(centre: Vec2, radius: float, start: float, end: float, steps: int) -> List[Vec2]:
    """Returns an arc from `start` to `end` (in degrees), including both ends."""
    angles = [math.radians(start + (end - start) * i / steps) for i in range(steps + 1)]
    return [(centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a)) for a in angles]


def circle(centre: Vec2, radius: float, steps: int) -> List[Vec2]:
    return arc(centre, radius, 0, 360, steps)[:-1]


def polygon(sides: int, radius: float) -> List[Vec2]:
    return circle((0.0, 0.0), radius, sides)


def rounded_rectangle(half_x: float, half_y: float, radius: float, steps: int = 6) -> List[Vec2]:
    x, y = half_x - radius, half_y - radius
    return (
        arc((x, y), radius, 0, 90, steps)
        + arc((-x, y), radius, 90, 180, steps)
        + arc((-x, -y), radius, 180, 270, steps)
        + arc((x, -y), radius, 270, 360, steps)
    )


def gear_outline(teeth: int, module: float, pressure: float = 20.0, flank: int = 4) -> List[Vec2]:
    """Returns the outline of a spur gear with involute flanks, counter-clockwise, with a tooth centred on +x."""
    pitch = module * teeth / 2
    base = pitch * math.cos(math.radians(pressure))
    root, tip = pitch - 1.2 * module, pitch + module

    def involute(radius: float) -> float:
        alpha = math.acos(min(1.0, base / radius))
        return math.tan(alpha) - alpha

    # Returns half the angle of a tooth at a radius. The backlash is a fiftieth of the tooth's width.
    def half_angle(radius: float) -> float:
        return (math.pi / (2 * teeth)) * 0.98 + involute(pitch) - involute(max(radius, base))

    def at(radius: float, angle: float) -> Vec2:
        return (radius * math.cos(angle), radius * math.sin(angle))

    start = max(root, base)
    radii = [start + (tip - start) * (i / flank) for i in range(flank + 1)]
    outline: List[Vec2] = []
    for tooth in range(teeth):
        middle = 2 * math.pi * tooth / teeth
        half_gap = math.pi / teeth
        if root < start - 1e-9:
            outline.append(
                at(root, middle - half_angle(start) - 0.12 * (half_gap - half_angle(start)))
            )
        outline += [at(r, middle - half_angle(r)) for r in radii]
        outline += [at(r, middle + half_angle(r)) for r in reversed(radii)]
        if root < start - 1e-9:
            outline.append(
                at(root, middle + half_angle(start) + 0.12 * (half_gap - half_angle(start)))
            )
    return outline
