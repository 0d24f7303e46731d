# SPDX-License-Identifier: Apache-2.0
"""LDR-FLIP: the perceived difference of two pictures that alternate in the same place.

Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A Difference Evaluator for Alternating Images",
Proceedings of the ACM on Computer Graphics and Interactive Techniques 3 (2), 2020. The filters are separated into rows
and columns, which only saves time.
"""
from __future__ import annotations

import math
from typing import List, Sequence, Tuple

import numpy as np

# A screen of 3840 pixels on 0.7 m, viewed from 0.7 m.
PIXELS_PER_DEGREE = 0.7 * (3840 / 0.7) * math.pi / 180
Q_COLOR, Q_FEATURE = 0.7, 0.5  # exponents q_c and q_f
KNEE, KNEE_ERROR = 0.4, 0.95  # p_c and p_t: errors up to 0.4 of the maximum are mapped to 0.95 of the range
FEATURE_DEGREES = 0.082  # w: the width of the edge that is most visible

# The primaries and white of sRGB (IEC 61966-2-1), and the white in XYZ.
TO_XYZ = np.array([[10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
                   [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
                   [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382]])
WHITE = TO_XYZ.sum(axis=1)

# Contrast sensitivity for the three opponent channels: sums of a · sqrt(π / b) · exp(−π² x² / b) with x in degrees,
# given as pairs of a and b.
Terms = Sequence[Tuple[float, float]]
ACHROMATIC: Terms = ((1.0, 0.0047),)
RED_GREEN: Terms = ((1.0, 0.0053),)
BLUE_YELLOW: Terms = ((34.1, 0.04), (13.5, 0.025))


def linear(srgb: np.ndarray) -> np.ndarray:
    return np.where(srgb <= 0.04045, srgb / 12.92, ((np.maximum(srgb, 0.04045) + 0.055) / 1.055) ** 2.4)


def encoded(light: np.ndarray) -> np.ndarray:
    """Returns linear light as sRGB, clipped to the range of a screen."""
    light = np.clip(light, 0.0, 1.0)
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * np.maximum(light, 0.0031308) ** (1 / 2.4) - 0.055)


def opponents(light: np.ndarray) -> np.ndarray:
    """Converts linear RGB to YCxCz."""
    x, y, z = np.moveaxis(light @ (TO_XYZ / WHITE[:, None]).T, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def from_opponents(opponent: np.ndarray) -> np.ndarray:
    y = (opponent[..., 0] + 16) / 116
    xyz = np.stack([opponent[..., 1] / 500 + y, y, y - opponent[..., 2] / 200], axis=-1)
    return xyz @ np.linalg.inv(TO_XYZ / WHITE[:, None]).T


def hunted_lab(light: np.ndarray) -> np.ndarray:
    """Converts linear RGB to L*a*b*, in which darker colours are less saturated (Hunt's effect)."""
    relative = light @ (TO_XYZ / WHITE[:, None]).T
    delta = 6 / 29
    root = np.where(relative > delta**3, np.cbrt(relative), relative / (3 * delta * delta) + 4 / 29)
    x, y, z = np.moveaxis(root, -1, 0)
    lightness = 116 * y - 16
    return np.stack([lightness, 0.01 * lightness * 500 * (x - y), 0.01 * lightness * 200 * (y - z)], axis=-1)


def hyab(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Returns a distance suited to large differences (Abasi and others, "Distancing from color", 2020)."""
    return np.abs(a[..., 0] - b[..., 0]) + np.hypot(a[..., 1] - b[..., 1], a[..., 2] - b[..., 2])


def along(image: np.ndarray, kernel: np.ndarray, axis: int) -> np.ndarray:
    """Convolves along one axis with a kernel of odd length. Pixels beyond the picture repeat its border."""
    reach, length = len(kernel) // 2, image.shape[axis]
    padding = [(reach, reach) if i == axis else (0, 0) for i in range(image.ndim)]
    padded = np.pad(image, padding, mode="edge")
    return sum(weight * np.take(padded, range(i, i + length), axis) for i, weight in enumerate(kernel))


def seen_opponent(image: np.ndarray, terms: Terms, ppd: float) -> np.ndarray:
    """Filters an opponent channel by the contrast sensitivity of the eye."""
    widest = max(b for _, b in (*ACHROMATIC, *RED_GREEN, *BLUE_YELLOW))
    reach = math.ceil(3 * math.sqrt(widest / (2 * math.pi**2)) * ppd)
    at = np.arange(-reach, reach + 1) / ppd
    total, mass = np.zeros_like(image), 0.0
    for a, b in terms:
        kernel = np.exp(-(math.pi * at) ** 2 / b)
        strength = a * math.sqrt(math.pi / b)
        total += strength * along(along(image, kernel, 0), kernel, 1)
        mass += strength * kernel.sum() ** 2
    return total / mass


def color_error(a: np.ndarray, b: np.ndarray, ppd: float) -> np.ndarray:
    """Returns ΔE_c, from 0 to 1, between two pictures of opponent channels."""
    labs: List[np.ndarray] = []
    for image in (a, b):
        parts = [seen_opponent(image[..., i], terms, ppd) for i, terms in
                 enumerate((ACHROMATIC, RED_GREEN, BLUE_YELLOW))]
        labs.append(hunted_lab(np.clip(from_opponents(np.stack(parts, axis=-1)), 0.0, 1.0)))
    green, blue = (hunted_lab(np.array(color, dtype=float)) for color in ((0, 1, 0), (0, 0, 1)))
    greatest = hyab(green, blue) ** Q_COLOR
    error, knee = hyab(*labs) ** Q_COLOR, KNEE * greatest
    return np.where(error < knee, KNEE_ERROR / knee * error,
                    KNEE_ERROR + (error - knee) / (greatest - knee) * (1 - KNEE_ERROR))


def features(lightness: np.ndarray, ppd: float) -> Tuple[np.ndarray, np.ndarray]:
    """Returns the strength of edges and of points at each pixel."""
    deviation = 0.5 * FEATURE_DEGREES * ppd
    reach = math.ceil(3 * deviation)
    at = np.arange(-reach, reach + 1)
    bell = np.exp(-(at**2) / (2 * deviation**2))
    strengths = []
    for kernel in (-at * bell, (at**2 / deviation**2 - 1) * bell):
        positive, negative = kernel[kernel > 0].sum(), -kernel[kernel < 0].sum()
        kernel = np.where(kernel > 0, kernel / positive, kernel / negative)
        smooth = bell / bell.sum()
        strengths.append(np.hypot(along(along(lightness, kernel, 1), smooth, 0),
                                  along(along(lightness, kernel, 0), smooth, 1)))
    return strengths[0], strengths[1]


def flip(a: np.ndarray, b: np.ndarray, ppd: float = PIXELS_PER_DEGREE) -> np.ndarray:
    """Returns each pixel's error, from 0 (none) to 1, between two sRGB pictures [height, width, 3] of values from 0 to
    1."""
    first, second = (opponents(linear(np.clip(image, 0.0, 1.0))) for image in (a, b))
    edges_a, points_a = features((first[..., 0] + 16) / 116, ppd)
    edges_b, points_b = features((second[..., 0] + 16) / 116, ppd)
    difference = np.maximum(np.abs(edges_a - edges_b), np.abs(points_a - points_b))
    feature_error = np.clip(difference / math.sqrt(2), 0.0, 1.0) ** Q_FEATURE
    return np.clip(color_error(first, second, ppd), 0.0, 1.0) ** (1 - feature_error)
