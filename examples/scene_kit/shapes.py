# SPDX-License-Identifier: Apache-2.0
"""Solids as indexed triangles, in metres; fronts are counter-clockwise, and normals point outward."""
from __future__ import annotations

import math
from typing import List, Optional, Sequence, Tuple

from .glb import Geometry
from .triangulate import area, triangulate
from .vec import (
    IDENTITY,
    X,
    Y,
    Z,
    Vec2,
    Vec3,
    Vec4,
    add,
    cross,
    dot,
    mix,
    normalize,
    rotate,
    scale,
    sub,
)


def moved(geometry: Geometry, at: Vec3 = (0.0, 0.0, 0.0), turn: Optional[Vec4] = None) -> Geometry:
    """Returns a copy of the geometry that is rotated, then translated."""
    spin = turn or IDENTITY
    return Geometry(
        [add(rotate(spin, p), at) for p in geometry.positions],
        [rotate(spin, n) for n in geometry.normals],
        list(geometry.uvs),
        list(geometry.colors),
        list(geometry.indices),
    )


def lathe(runs: Sequence[Sequence[Vec2]], segments: int = 64, uv: bool = False) -> Geometry:
    """Spins a profile (radius, height) about y.

    In the (radius, height) plane the solid is on the profile's left. Each run is smooth; the edge between two runs is
    sharp. With `uv`, u goes once around and v runs down the profile.
    """
    out = Geometry()
    lengths = [0.0]
    flat = [p for run in runs for p in run]
    for p, q in zip(flat, flat[1:]):
        lengths.append(lengths[-1] + math.dist(p, q))
    for before, after in zip(runs, runs[1:]):
        if math.dist(before[-1], after[0]) > 1e-7:
            raise ValueError(f"a run starts at {after[0]}, but the one before ends at {before[-1]}")
    done = 0
    for run in runs:
        rings: List[Tuple[int, int]] = []
        for i, point in enumerate(run):
            pole = point[0] < 1e-9
            count = 1 if pole and not uv else segments + (1 if uv else 0)
            rings.append((len(out.positions), count))
            _put_ring(out, point, _profile_normal(run, i), count, segments)
            if uv:
                v = 1.0 - lengths[done + i] / lengths[-1]
                out.uvs += [(1.0 - k / segments, v) for k in range(count)]
        for i in range(len(run) - 1):
            _join_rings(out, rings[i], rings[i + 1], run[i][0], run[i + 1][0], segments)
        done += len(run)
    return out


def _put_ring(out: Geometry, point: Vec2, normal: Vec2, count: int, segments: int) -> None:
    radius, height = point
    for k in range(count):
        # The last vertex reuses angle 0, so that both sides of the seam are bitwise equal.
        angle = 2 * math.pi * (k % segments) / segments
        c, s = math.cos(angle), math.sin(angle)
        out.positions.append((radius * c, height, radius * s))
        out.normals.append((normal[0] * c, normal[1], normal[0] * s))


def _join_rings(
    out: Geometry,
    low: Tuple[int, int],
    high: Tuple[int, int],
    low_radius: float,
    high_radius: float,
    segments: int,
) -> None:
    """Joins two rings, each given as (first vertex, number of vertices); at the axis, a quad becomes one triangle."""
    for k in range(segments):
        a, b = low[0] + k % low[1], low[0] + (k + 1) % low[1]
        c, d = high[0] + k % high[1], high[0] + (k + 1) % high[1]
        if low_radius < 1e-9:
            out.indices += [a, c, d]
        elif high_radius < 1e-9:
            out.indices += [a, d, b]
        else:
            out.indices += [a, c, b, b, c, d]


def _profile_normal(run: Sequence[Vec2], i: int) -> Vec2:
    if len(run) > 2 and run[i][0] < 1e-9:
        # A smooth run must meet the axis at a right angle. Otherwise, there would be a crease at the pole.
        neighbour = run[i + 1] if i == 0 else run[i - 1]
        outward = neighbour[0] if i == 0 else -neighbour[0]
        return (0.0, -1.0 if outward > 0 else 1.0)
    if i == 0 or i == len(run) - 1:
        a, b = run[max(0, i - 1)], run[min(len(run) - 1, i + 1)]
        tangent = (b[0] - a[0], b[1] - a[1])
    else:
        # The tangent of the parabola through the three points. The nearer neighbour has more weight.
        before, after = math.dist(run[i - 1], run[i]), math.dist(run[i], run[i + 1])
        tangent = (
            (run[i][0] - run[i - 1][0]) * after / before
            + (run[i + 1][0] - run[i][0]) * before / after,
            (run[i][1] - run[i - 1][1]) * after / before
            + (run[i + 1][1] - run[i][1]) * before / after,
        )
    length = math.hypot(*tangent)
    return (tangent[1] / length, -tangent[0] / length)


def extrude(
    outer: Sequence[Vec2],
    holes: Sequence[Sequence[Vec2]],
    z0: float,
    z1: float,
    crease: float = 30.0,
) -> Geometry:
    """Extrudes a flat outline with holes from z0 to z1; walls are smooth where they bend by less than `crease`
    degrees."""
    out = Geometry()
    flat = [*outer, *(p for hole in holes for p in hole)]
    triangles = triangulate(outer, holes)
    for z, normal in ((z1, 1.0), (z0, -1.0)):
        base = len(out.positions)
        out.positions += [(x, y, z) for x, y in flat]
        out.normals += [(0.0, 0.0, normal)] * len(flat)
        for a, b, c in triangles:
            out.indices += (
                [base + a, base + b, base + c] if normal > 0 else [base + a, base + c, base + b]
            )
    for loop, is_hole in [(outer, False), *((hole, True) for hole in holes)]:
        # Along the loop, the solid is on the left and the outside on the right.
        ring = list(loop) if (area(loop) > 0) != is_hole else list(reversed(loop))
        _wall(out, ring, z0, z1, math.cos(math.radians(crease)))
    return out


def _wall(out: Geometry, ring: Sequence[Vec2], z0: float, z1: float, min_cosine: float) -> None:
    n = len(ring)
    facing: List[Vec2] = []
    for p, q in zip(ring, [*ring[1:], ring[0]]):
        length = math.dist(p, q)
        facing.append(((q[1] - p[1]) / length, -(q[0] - p[0]) / length))
    # Corner i has two vertices: the end of edge i-1, and the start of edge i.
    ends, starts = [0] * n, [0] * n
    for i in range(n):
        before, after = facing[i - 1], facing[i]
        soft = before[0] * after[0] + before[1] * after[1] > min_cosine
        if soft:
            length = math.hypot(before[0] + after[0], before[1] + after[1])
            before = after = ((before[0] + after[0]) / length, (before[1] + after[1]) / length)
        for target, normal in ((ends, before), (starts, after)):
            if soft and target is starts:
                starts[i] = ends[i]
                continue
            target[i] = len(out.positions)
            out.positions += [(*ring[i], z0), (*ring[i], z1)]
            out.normals += [(*normal, 0.0)] * 2
    for i in range(n):
        a, b = starts[i], ends[(i + 1) % n]
        out.indices += [a, b, b + 1, a, b + 1, a + 1]


def box(half: Vec3) -> Geometry:
    """Returns a box with six faces and sharp edges."""
    out = Geometry()
    for axis in range(3):
        for sign in (1.0, -1.0):
            normal, right = scale((X, Y, Z)[axis], sign), (Y, Z, X)[axis]
            up = cross(normal, right)
            base = len(out.positions)
            for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                p = add(normal, add(scale(right, u), scale(up, v)))
                out.positions.append((p[0] * half[0], p[1] * half[1], p[2] * half[2]))
                out.normals.append(normal)
            out.indices += [base, base + 1, base + 2, base, base + 2, base + 3]
    return out


def rounded_box(half: Vec3, radius: float, steps: int = 3) -> Geometry:
    """Returns a box with edges and corners rounded by `radius`."""
    out = Geometry()

    def stations(h: float) -> List[float]:
        rise = [math.tan(math.radians(45 * i / steps)) * radius for i in range(steps + 1)]
        return [-(h - radius) - r for r in reversed(rise)] + [(h - radius) + r for r in rise]

    for axis in range(3):
        ku, kv = (axis + 1) % 3, (axis + 2) % 3
        us, vs = stations(half[ku]), stations(half[kv])
        for sign in (1.0, -1.0):
            base = len(out.positions)
            for v in vs:
                for u in us:
                    q = [0.0, 0.0, 0.0]
                    q[axis], q[ku], q[kv] = sign * half[axis], u, v
                    cx, cy, cz = (
                        min(half[k] - radius, max(radius - half[k], q[k])) for k in range(3)
                    )
                    core: Vec3 = (cx, cy, cz)
                    normal = normalize(sub((q[0], q[1], q[2]), core))
                    out.positions.append(add(core, scale(normal, radius)))
                    out.normals.append(normal)
            _grid_indices(out, base, len(us), len(vs), flip=sign < 0)
    return out


def _grid_indices(out: Geometry, base: int, columns: int, rows: int, flip: bool) -> None:
    """Adds the quads of a grid whose columns follow the first axis and whose rows follow the second."""
    for row in range(rows - 1):
        for column in range(columns - 1):
            a = base + row * columns + column
            b, c, d = a + 1, a + columns, a + columns + 1
            out.indices += [a, d, b, a, c, d] if flip else [a, b, d, a, d, c]


def sphere(radius: float, segments: int = 32) -> Geometry:
    half = segments // 2
    profile = [
        (
            radius * math.sin(math.pi * i / half) if 0 < i < half else 0.0,
            -radius * math.cos(math.pi * i / half),
        )
        for i in range(half + 1)
    ]
    return lathe([profile], segments)


def cylinder(
    radius: float, y0: float, y1: float, segments: int = 32, bevel: float = 0.0, uv: bool = False
) -> Geometry:
    """Returns a cylinder that is closed at both ends; a bevel cuts its rims at 45 degrees."""
    r, b = radius, bevel
    runs: List[List[Vec2]] = [
        [(0.0, y0), (r - b, y0)],
        [(r, y0 + b), (r, y1 - b)],
        [(r - b, y1), (0.0, y1)],
    ]
    if b > 0:
        runs.insert(1, [(r - b, y0), (r, y0 + b)])
        runs.insert(3, [(r, y1 - b), (r - b, y1)])
    return lathe(runs, segments, uv)


def tube(path: Sequence[Vec3], radii: Sequence[float], segments: int = 12) -> Geometry:
    """Sweeps a round bar along a path without twist; the far end closes in a point."""
    out = Geometry()
    last = len(path) - 1
    side: Vec3 = (1.0, 0.0, 0.0)
    for i, (p, radius) in enumerate(zip(path, radii)):
        forward = normalize(sub(path[min(last, i + 1)], path[max(0, i - 1)]))
        if i == 0 and abs(dot(side, forward)) > 0.9:
            side = (0.0, 0.0, 1.0)
        # Parallel transport: projects the previous frame onto the new direction.
        side = normalize(sub(side, scale(forward, dot(side, forward))))
        other = cross(forward, side)
        for k in range(segments):
            angle = 2 * math.pi * k / segments
            normal = add(scale(side, math.cos(angle)), scale(other, math.sin(angle)))
            out.positions.append(add(p, scale(normal, radius)))
            out.normals.append(normal)
        for k in range(segments if i else 0):
            a, b = (i - 1) * segments + k, (i - 1) * segments + (k + 1) % segments
            out.indices += [a, b, b + segments, a, b + segments, a + segments]
    tip = len(out.positions)
    forward = normalize(sub(path[last], path[last - 1]))
    out.positions.append(add(path[last], scale(forward, radii[last])))
    out.normals.append(forward)
    for k in range(segments):
        out.indices += [last * segments + k, last * segments + (k + 1) % segments, tip]
    return out


def quad(half_x: float, half_y: float, tile: Optional[float] = None) -> Geometry:
    """Returns an upright quad in the xy plane, its front towards +z, the texture's top at +y.

    The texture covers the quad once, or repeats every `tile` metres.
    """
    repeat_x, repeat_y = (2 * half_x / tile, 2 * half_y / tile) if tile else (1.0, 1.0)
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return Geometry(
        [(u * half_x, v * half_y, 0.0) for u, v in corners],
        [(0.0, 0.0, 1.0)] * 4,
        [((u + 1) / 2 * repeat_x, (1 - v) / 2 * repeat_y) for u, v in corners],
        [],
        [0, 1, 2, 0, 2, 3],
    )


def graded_wall(
    half_x: float, y0: float, y1: float, low: Vec3, high: Vec3, rows: int = 8
) -> Geometry:
    """Returns a backdrop in the xy plane with vertex colours from `low` to `high` (linear)."""
    out = Geometry()
    for row in range(rows + 1):
        t = row / rows
        for x in (-half_x, half_x):
            out.positions.append((x, y0 + (y1 - y0) * t, 0.0))
            out.normals.append((0.0, 0.0, 1.0))
            out.colors.append((*mix(low, high, t), 1.0))
    _grid_indices(out, 0, 2, rows + 1, flip=False)
    return out
