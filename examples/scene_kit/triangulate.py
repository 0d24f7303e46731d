# SPDX-License-Identifier: Apache-2.0
"""Ear clipping with holes (D. Eberly, "Triangulation by Ear Clipping", 2002)."""
from __future__ import annotations

from typing import List, Sequence, Tuple

from .vec import Vec2


def _turn(a: Vec2, b: Vec2, c: Vec2) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def area(loop: Sequence[Vec2]) -> float:
    """Returns the signed area of a loop, positive if it is counter-clockwise."""
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(loop, [*loop[1:], loop[0]])) / 2


def _inside(p: Vec2, a: Vec2, b: Vec2, c: Vec2) -> bool:
    return _turn(a, b, p) >= 0 and _turn(b, c, p) >= 0 and _turn(c, a, p) >= 0


def _bridge(outer: List[int], hole: List[int], points: Sequence[Vec2]) -> List[int]:
    """Joins the hole to the outer loop with a bridge (section 3 of the paper)."""
    start = max(range(len(hole)), key=lambda i: points[hole[i]])
    m = points[hole[start]]
    best_x, edge = float("inf"), -1
    for i, index in enumerate(outer):
        a, b = points[index], points[outer[(i + 1) % len(outer)]]
        # Only rising edges have the interior, with the hole, on their left.
        if a[1] <= m[1] < b[1] or (a[1] <= m[1] == b[1] and a[1] < b[1]):
            x = a[0] + (m[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
            if m[0] <= x < best_x:
                best_x, edge = x, i
    candidate = max(edge, (edge + 1) % len(outer), key=lambda i: points[outer[i]][0])
    hit, corner = (best_x, m[1]), points[outer[candidate]]
    triangle = (m, hit, corner) if _turn(m, hit, corner) > 0 else (m, corner, hit)
    blockers = [
        i
        for i, index in enumerate(outer)
        if points[index] != corner and _turn(*triangle) != 0 and _inside(points[index], *triangle)
    ]
    if blockers:

        def slope(i: int) -> Tuple[float, float]:
            p = points[outer[i]]
            dx, dy = p[0] - m[0], abs(p[1] - m[1])
            return (dy / dx if dx > 0 else float("inf"), dx)

        candidate = min(blockers, key=slope)
    around = hole[start:] + hole[: start + 1]
    return outer[: candidate + 1] + around + outer[candidate:]


def triangulate(
    outer: Sequence[Vec2], holes: Sequence[Sequence[Vec2]] = ()
) -> List[Tuple[int, int, int]]:
    """Returns counter-clockwise triangles; their indices count the points of `outer`, then those of each hole as
    given."""
    points: List[Vec2] = list(outer)
    loop = list(range(len(outer)))
    if area(outer) < 0:
        loop.reverse()
    rings: List[List[int]] = []
    for hole in holes:
        ring = list(range(len(points), len(points) + len(hole)))
        points += hole
        if area(hole) > 0:
            ring.reverse()
        rings.append(ring)
    for ring in sorted(rings, key=lambda r: max(points[i] for i in r), reverse=True):
        loop = _bridge(loop, ring, points)

    triangles: List[Tuple[int, int, int]] = []
    i, misses = 0, 0
    while len(loop) > 3 and misses <= len(loop):
        n = len(loop)
        ia, ib, ic = loop[(i - 1) % n], loop[i % n], loop[(i + 1) % n]
        a, b, c = points[ia], points[ib], points[ic]
        convex = _turn(a, b, c) > 1e-16
        if convex and not any(
            _inside(points[k], a, b, c)
            for k in loop
            if points[k] != a and points[k] != b and points[k] != c
        ):
            triangles.append((ia, ib, ic))
            del loop[i % n]
            misses = 0
            # Advance by one point, to spread the ears around the loop. Otherwise, they would form a fan of slivers.
            i = (i + 1) % len(loop)
        else:
            i = (i + 1) % n
            misses += 1
    if len(loop) == 3:
        triangles.append((loop[0], loop[1], loop[2]))
    if misses > len(loop):
        raise ValueError(f"no ear left with {len(loop)} corners to go: the outline crosses itself")
    return triangles
