# SPDX-License-Identifier: Apache-2.0
"""Smooth value noise, made with an integer hash so that it is the same on every machine and Python version."""
from __future__ import annotations

import math


def _hash(x: int, y: int, seed: int) -> float:
    h = (x * 374761393 + y * 668265263 + seed * 974634777) & 0xFFFFFFFF
    h = ((h ^ (h >> 13)) * 1274126177) & 0xFFFFFFFF
    return ((h ^ (h >> 16)) & 0xFFFFFF) / 0xFFFFFF


def noise(x: float, y: float, seed: int = 0) -> float:
    """Returns noise from 0 to 1, with about one feature per unit."""
    ix, iy = math.floor(x), math.floor(y)
    fx, fy = x - ix, y - iy
    sx, sy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)
    top = _hash(ix, iy, seed) * (1 - sx) + _hash(ix + 1, iy, seed) * sx
    bottom = _hash(ix, iy + 1, seed) * (1 - sx) + _hash(ix + 1, iy + 1, seed) * sx
    return top * (1 - sy) + bottom * sy


def fractal(x: float, y: float, seed: int = 0, octaves: int = 4) -> float:
    total, weight = 0.0, 0.0
    for octave in range(octaves):
        amplitude = 0.5**octave
        total += amplitude * noise(x * 2**octave, y * 2**octave, seed + octave)
        weight += amplitude
    return total / weight
