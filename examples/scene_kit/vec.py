# SPDX-License-Identifier: Apache-2.0
"""Vectors, quaternions (x, y, z, w, the order of glTF) and colours, as plain tuples."""
from __future__ import annotations

import math
from typing import Tuple

Vec2 = Tuple[float, float]
Vec3 = Tuple[float, float, float]
Vec4 = Tuple[float, float, float, float]

X: Vec3 = (1.0, 0.0, 0.0)
Y: Vec3 = (0.0, 1.0, 0.0)
Z: Vec3 = (0.0, 0.0, 1.0)
IDENTITY: Vec4 = (0.0, 0.0, 0.0, 1.0)


def add(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def sub(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(a: Vec3, s: float) -> Vec3:
    return (a[0] * s, a[1] * s, a[2] * s)


def dot(a: Vec3, b: Vec3) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vec3, b: Vec3) -> Vec3:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def normalize(a: Vec3) -> Vec3:
    length = math.sqrt(dot(a, a))
    return (a[0] / length, a[1] / length, a[2] / length)


def lerp(a: float, b: float, t: float) -> float:
    return a + (b - a) * t


def mix(a: Vec3, b: Vec3, t: float) -> Vec3:
    return (lerp(a[0], b[0], t), lerp(a[1], b[1], t), lerp(a[2], b[2], t))


def smoothstep(lo: float, hi: float, x: float) -> float:
    t = min(1.0, max(0.0, (x - lo) / (hi - lo)))
    return t * t * (3.0 - 2.0 * t)


def axis_angle(axis: Vec3, degrees: float) -> Vec4:
    """Returns the quaternion for a counter-clockwise turn about a unit axis."""
    half = math.radians(degrees) / 2.0
    s = math.sin(half)
    return (axis[0] * s, axis[1] * s, axis[2] * s, math.cos(half))


def quat_mul(a: Vec4, b: Vec4) -> Vec4:
    """Returns the rotation that turns by `b` first, then by `a`."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def rotate(q: Vec4, v: Vec3) -> Vec3:
    u = (q[0], q[1], q[2])
    t = scale(cross(u, v), 2.0)
    return add(add(v, scale(t, q[3])), cross(u, t))


def look_at(eye: Vec3, target: Vec3, up: Vec3 = Y) -> Vec4:
    """Returns the rotation for a node at `eye` whose -Z axis points to `target`."""
    back = normalize(sub(eye, target))
    right = normalize(cross(up, back))
    true_up = cross(back, right)
    return from_axes(right, true_up, back)


def from_axes(x: Vec3, y: Vec3, z: Vec3) -> Vec4:
    """Returns the quaternion for the rotation matrix with the columns x, y, z (Shepperd's method)."""
    trace = x[0] + y[1] + z[2]
    choices = (trace, x[0], y[1], z[2])
    largest = choices.index(max(choices))
    if largest == 0:
        w = math.sqrt(1.0 + trace) / 2.0
        return ((y[2] - z[1]) / (4 * w), (z[0] - x[2]) / (4 * w), (x[1] - y[0]) / (4 * w), w)
    if largest == 1:
        a = math.sqrt(1.0 + x[0] - y[1] - z[2]) / 2.0
        return (a, (y[0] + x[1]) / (4 * a), (z[0] + x[2]) / (4 * a), (y[2] - z[1]) / (4 * a))
    if largest == 2:
        a = math.sqrt(1.0 - x[0] + y[1] - z[2]) / 2.0
        return ((y[0] + x[1]) / (4 * a), a, (z[1] + y[2]) / (4 * a), (z[0] - x[2]) / (4 * a))
    a = math.sqrt(1.0 - x[0] - y[1] + z[2]) / 2.0
    return ((z[0] + x[2]) / (4 * a), (z[1] + y[2]) / (4 * a), a, (x[1] - y[0]) / (4 * a))


def srgb(code: str) -> Vec3:
    """Converts an sRGB colour `"#rrggbb"` to linear light, in which glTF stores factors."""

    def linear(c: float) -> float:
        return c / 12.92 if c <= 0.04045 else math.pow((c + 0.055) / 1.055, 2.4)

    r, g, b = srgb8(code)
    return (linear(r / 255.0), linear(g / 255.0), linear(b / 255.0))


def srgb8(code: str) -> Tuple[int, int, int]:
    return (int(code[1:3], 16), int(code[3:5], 16), int(code[5:7], 16))
