# SPDX-License-Identifier: Apache-2.0
"""Glasses, bottles and bowls with an outer and an inner wall, and their contents."""
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Dict, List

from .curves import arc, simplified, smooth
from .glb import Geometry
from .shapes import lathe
from .vec import Vec2, lerp, smoothstep

# The gap between liquid and wall, in metres. It keeps their surfaces apart.
GAP = 0.0006
# The maximum distance of a simplified outline from its curve, in metres.
TOLERANCE = 0.0001
# The alpha of a thin wall, relative to that of solid glass.
THIN = 0.30
STEPS = 8


def _mm(text: str) -> List[Vec2]:
    """Parses points written as "radius,height" in millimetres; returns metres."""
    pairs = (pair.split(",") for pair in text.split())
    return [(float(r) / 1000.0, float(y) / 1000.0) for r, y in pairs]


def _smooth(text: str) -> List[Vec2]:
    return smooth(_mm(text), STEPS)


def _cup(text: str) -> List[Vec2]:
    """Returns a smooth wall that leaves the axis (its first point) at a right angle."""
    points = _mm(text)
    mirrored = (-points[1][0], points[1][1])
    return points[:1] + smooth([mirrored, *points], STEPS)[STEPS + 1 :]


@dataclass(frozen=True)
class Vessel:
    """Two outlines, outside and inside, each from the axis up to the rim."""

    outer: List[Vec2]
    inner: List[Vec2]
    segments: int = 64

    def glass(self) -> Geometry:
        """Returns both walls as one mesh, joined by a round rim. The vertex alpha follows the thickness of the
        glass."""
        outer = simplified(self.outer, TOLERANCE)
        inner = simplified(self.inner, TOLERANCE)[::-1]
        middle = ((outer[-1][0] + inner[0][0]) / 2, (outer[-1][1] + inner[0][1]) / 2)
        rim = arc(middle, math.dist(outer[-1], inner[0]) / 2, 0, 180, 6)[1:-1]
        out = lathe([outer + rim + inner], self.segments)
        # Two parts have more tint than a thin wall: the solid glass below the inner wall's lowest point, and the rim,
        # because it catches the light.
        bottom, top = inner[-1][1], inner[0][1]
        for _, y, _ in out.positions:
            solid = max(1.0 - smoothstep(bottom, bottom + 0.01, y), smoothstep(top - 0.004, top, y))
            out.colors.append((1.0, 1.0, 1.0, lerp(THIN, 1.0, solid)))
        return out

    def filled(self, level: float) -> Geometry:
        """Returns the contents of the vessel up to a height, with a small meniscus."""
        inner = simplified(self.inner, TOLERANCE)
        wall = [(max(0.0, r - GAP), y + GAP) for r, y in inner if y + GAP < level - 0.0005]
        wall[0] = (0.0, wall[0][1])
        below = max((p for p in inner if p[1] < level), key=lambda p: p[1])
        above = min((p for p in inner if p[1] >= level), key=lambda p: p[1])
        share = (level - below[1]) / (above[1] - below[1])
        edge = lerp(below[0], above[0], share) - GAP
        brink = (edge, level + 0.0008)
        surface = [brink, (edge - 0.0012, level + 0.0002), (edge - 0.004, level), (0.0, level)]
        return lathe([[*wall, brink], surface], self.segments)


def _foot(text: str, edge_radius: float, edge: float) -> List[Vec2]:
    """Returns the underside of a stemmed glass, with the round edge of its foot."""
    return _smooth(text) + arc((edge_radius, edge), edge, -90, 80, 4)


VESSELS: Dict[str, Vessel] = {
    "wine glass": Vessel(
        _foot("0,3.5 18,2.2 34,0", 0.0345, 0.0012)
        + _smooth(
            "30,3.4 12,7.2 5.6,16 4,40 4.1,75 7.8,95.5 20.5,107.5 37.2,126.5 43.3,150 41.3,178"
            " 33.5,213.5"
        ),
        _cup("0,104 20,109 36,127 42,150 40,178 32.5,213.5"),
    ),
    "flute": Vessel(
        _foot("0,3 16,2 29,0", 0.0295, 0.0011)
        + _smooth("25,3 10,6.4 4.6,15 3.6,40 4,70 7,90.5 17.5,119 23.6,160 24.5,200 22.4,236"),
        _cup("0,92 6,96 16.5,120 22.5,160 23.5,200 21.5,236"),
        48,
    ),
    "tumbler": Vessel(
        _smooth("0,3 20,2 31,0 35.5,4 36.6,20 38.2,60 39.8,95"),
        _cup("0,14 28,14.5 33.5,19 34.5,28 36.2,60 38,95"),
    ),
    "bottle": Vessel(
        _cup("0,17 18,10 30,1 36.3,8 37.5,24")
        + _smooth(
            "37.5,24 37.5,80 37.5,150 36.5,186 24.7,214 15,234 13.2,262 13.2,280 15,283 15.2,294"
            " 13.8,300"
        )[1:],
        _cup("0,22 20,15 31,9 34.3,20 34.5,60 34.5,150 33.5,185 22,212 12.5,232 10.5,262 10,300"),
    ),
    "bowl": Vessel(
        _smooth("0,3 16,2 26,0 34,3 58,22.5 70.5,47 73.8,62"),
        _cup("0,10 30,12 56,26 68,48 71,62"),
    ),
}
