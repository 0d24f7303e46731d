#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures how near spheres in an environment come to the integral of glTF's lobes: referee.py PEELER

Each material is shown on one sphere, seen by parallel rays, in an environment with a gradient, coloured sides and a
small bright box. `peeler render --environment` shades the spheres from prefiltered maps. At every pixel the referee
integrates light times lobe over all directions, by importance sampling with a fixed set of samples (Hammersley). It
implements the specifications and shares no code with the shaders:

- glTF 2.0, appendix B: GGX with height-correlated Smith visibility, Schlick's Fresnel term at the half vector, Lambert
  below it, dielectric and metal mixed by metalness;
- KHR_materials_specular, _ior, _clearcoat, _anisotropy; KHR_materials_sheen with the Charlie lobe, its shadowing, and
  what is below scaled by the lobe's own albedo;
- light that microfacets pass on to each other, which glTF leaves open and peeler adds, so that white stays white: Kulla &
  Conty, "Revisiting Physically Based Shading at Imageworks", 2017, with albedos that are integrated here.

It shares no code with the shaders. The table has a row per material: the mean of our spheres over the referee's, and the
relative error, which is the root of the mean square difference over that of the referee's pixels, R, G and B together.
White spheres are also rendered in an environment that is 1 everywhere, where they should be 1 (a furnace); the referee
does not judge there, since glTF's lobes, added up, do not come to 1 exactly. The text below gives the limits, the largest
difference in the furnace, and the spheres that miss a limit.
Pixels whose normal leans more than `--edge` degrees from the view are left out: they are edges, where a pixel sees more
than its middle.

Needs Debian's python3-numpy and python3-openimageio.
"""
from __future__ import annotations

import argparse
import math
import re
import subprocess
import tempfile
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Tuple

import numpy as np
import OpenImageIO as oiio

from referee_spheres import WHITE, Array, Ball, balls, environment, scene

VIEW = np.array([0.0, 0.0, 1.0])  # points from every surface toward the eye
# The limits of a Nearness for roughness 0.2 and above.
MEAN, ERROR, FURNACE = 0.03, 0.1, 0.02


def radiance(image: Array, direction: Array) -> Array:
    """Returns radiance interpolated between the four nearest pixels."""
    height, width, _ = image.shape
    u = 0.5 - np.arctan2(direction[..., 0], direction[..., 2]) / (2 * np.pi)
    v = 0.5 - np.arcsin(np.clip(direction[..., 1], -1, 1)) / np.pi
    x, y = u * width - 0.5, np.clip(v * height - 0.5, 0, height - 1)
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    across, down = (x - left)[..., None], (y - top)[..., None]
    right, below = (left + 1) % width, np.minimum(top + 1, height - 1)
    left = left % width
    flat = image.reshape(-1, 3)
    rows = [flat[row * width + left] * (1 - across) + flat[row * width + right] * across for row in (top, below)]
    return rows[0] * (1 - down) + rows[1] * down


# Lobes. Directions are in the tangent frame: z along the normal, x along the tangent.


def hammersley(count: int) -> Tuple[Array, Array]:
    reversed_bits, digit, n = np.zeros(count), 0.5, np.arange(count)
    while n.any():
        reversed_bits, digit, n = reversed_bits + digit * (n % 2), digit / 2, n // 2
    return (np.arange(count) + 0.5) / count, reversed_bits


def dot(a: Array, b: Array) -> Array:
    return (a * b).sum(-1)


def unit(a: Array) -> Array:
    return a / np.sqrt(dot(a, a))[..., None]


def schlick(f0: Array, f90: float, cosine: Array) -> Array:
    return f0 + (f90 - f0) * ((1 - cosine) ** 5)[..., None]


def smith(alpha: Tuple[float, float], w: Array) -> Array:
    """Returns the Lambda of GGX's masking function."""
    slope = ((alpha[0] * w[..., 0]) ** 2 + (alpha[1] * w[..., 1]) ** 2) / np.maximum(w[..., 2], 1e-9) ** 2
    return (np.sqrt(1 + slope) - 1) / 2


def facets(v: Array, alpha: Tuple[float, float], count: int) -> Array:
    """Returns `count` half vectors for each view in `v`, distributed like the normals of visible microfacets (Heitz,
    "Sampling the GGX Distribution of Visible Normals", 2018)."""
    u1, u2 = hammersley(count)
    stretched = unit(v * np.array([alpha[0], alpha[1], 1.0]))[:, None, :]
    across = np.stack([-stretched[..., 1], stretched[..., 0], 0 * stretched[..., 0]], -1)
    size = np.sqrt(dot(across, across))[..., None]
    across = np.where(size > 1e-7, across / np.maximum(size, 1e-7), np.array([1.0, 0.0, 0.0]))
    along = np.cross(stretched, across)
    r, phi, share = np.sqrt(u1), 2 * np.pi * u2, 0.5 * (1 + stretched[..., 2])
    t1 = r * np.cos(phi) + 0 * share
    t2 = (1 - share) * np.sqrt(1 - t1 * t1) + share * r * np.sin(phi)
    up = np.sqrt(np.maximum(0, 1 - t1 * t1 - t2 * t2))
    h = t1[..., None] * across + t2[..., None] * along + up[..., None] * stretched
    h = h * np.array([alpha[0], alpha[1], 1.0])
    h[..., 2] = np.maximum(h[..., 2], 1e-9)
    return unit(h)


def ggx_weights(v: Array, alpha: Tuple[float, float], count: int) -> Tuple[Array, Array, Array]:
    """Returns directions, the cosines v·h, and weights. Light times weight is light times GGX times cosine, without the
    Fresnel term."""
    h = facets(v, alpha, count)
    v = v[:, None, :]
    v_dot_h = np.clip(dot(v, h), 0, 1)
    light = 2 * v_dot_h[..., None] * h - v
    hidden = 1 + smith(alpha, v)
    weight = np.where(light[..., 2] > 0, hidden / (hidden + smith(alpha, light)), 0)
    return light, weight / count, v_dot_h


class Albedo:
    """The albedo of GGX in white light with a Fresnel term of 1: by cosine, averaged over all azimuths, and averaged
    over all directions."""

    def __init__(self, alpha: Tuple[float, float]) -> None:
        self.cosine = np.linspace(0.01, 1, 64)
        azimuths = np.array([0.0]) if alpha[0] == alpha[1] else (np.arange(8) + 0.5) * np.pi / 16
        sine = np.sqrt(1 - self.cosine**2)
        views = [np.stack([sine * np.cos(a), sine * np.sin(a), self.cosine], -1) for a in azimuths]
        self.value = np.mean([ggx_weights(view, alpha, 1024)[1].sum(1) for view in views], 0)
        even = np.linspace(0, 1, 512)
        self.mean = float((np.interp(even, self.cosine, self.value) * 2 * even).mean())

    def at(self, cosine: Array) -> Array:
        return np.interp(cosine, self.cosine, self.value)


def hemisphere(count: int) -> Array:
    """Returns cosine-distributed directions."""
    u, w = hammersley(count)
    return np.stack([np.sqrt(u) * np.cos(2 * np.pi * w), np.sqrt(u) * np.sin(2 * np.pi * w), np.sqrt(1 - u)], -1)


def charlie(alpha: float, v: Array, light: Array) -> Array:
    """Returns the Charlie sheen BRDF (Estevez & Kulla, "Production Friendly Microfacet Sheen BRDF", 2017)."""
    h = unit(v + light)
    sine = np.sqrt(np.clip(1 - h[..., 2] ** 2, 0, 1))
    distribution = (2 + 1 / alpha) * sine ** (1 / alpha) / (2 * np.pi)
    mixed = [a + (b - a) * (1 - alpha) ** 2 for a, b in ((21.5473, 25.3245), (3.82987, 3.32435), (0.19823, 0.16801),
                                                         (-1.97760, -1.27393), (-4.32054, -4.85967))]

    def fit(x: Array) -> Array:
        return mixed[0] / (1 + mixed[1] * x ** mixed[2]) + mixed[3] * x + mixed[4]

    def shadowing(x: Array) -> Array:
        return np.exp(np.where(x < 0.5, fit(x), 2 * fit(np.array(0.5)) - fit(1 - x)))

    l_z, v_z = np.maximum(light[..., 2], 1e-6), np.maximum(v[..., 2], 1e-6)
    return distribution / ((1 + shadowing(v_z) + shadowing(l_z)) * 4 * l_z * v_z)


class Referee:
    """Integrates light over an environment, with `count` samples per lobe and pixel."""

    def __init__(self, image: Array, count: int) -> None:
        self.image, self.count = image, count
        self.albedos: Dict[Tuple[float, float], Albedo] = {}

    def albedo(self, alpha: Tuple[float, float]) -> Albedo:
        if alpha not in self.albedos:
            self.albedos[alpha] = Albedo(alpha)
        return self.albedos[alpha]

    def glossy(self, frame: Array, v: Array, alpha: Tuple[float, float], f0: Array, f90: float) -> Array:
        light, weight, v_dot_h = ggx_weights(v, alpha, self.count)
        arriving = radiance(self.image, light @ frame)
        once = (schlick(f0, f90, v_dot_h) * weight[..., None] * arriving).sum(1)
        albedo = self.albedo(alpha)
        mean = f0 + (f90 - f0) / 21
        again = mean * mean * albedo.mean / (1 - mean * (1 - albedo.mean)) / max(1 - albedo.mean, 1e-6)
        spread = hemisphere(self.count)
        share = (1 - albedo.at(v[:, 2]))[:, None] * (1 - albedo.at(spread[:, 2]))
        return once + again * (share[..., None] * radiance(self.image, spread @ frame)).mean(1)

    def lambert(self, frame: Array, v: Array, f0: Array, f90: float) -> Array:
        spread = hemisphere(self.count)
        v_dot_h = np.sqrt(np.clip((1 + v @ spread.T) / 2, 0, 1))
        kept = 1 - schlick(f0, f90, v_dot_h).max(-1, keepdims=True)
        return (kept * radiance(self.image, spread @ frame)).mean(1)

    def cloth(self, frame: Array, v: Array, roughness: float) -> Tuple[Array, Array]:
        """Returns the reflected light and the lobe's albedo."""
        u, w = hammersley(self.count)
        sine = np.sqrt(1 - u * u)
        even = np.stack([sine * np.cos(2 * np.pi * w), sine * np.sin(2 * np.pi * w), u], -1)
        share = charlie(roughness**2, v[:, None, :], even[None]) * u * 2 * np.pi
        albedo = np.minimum(share.mean(1), 1)
        return (share[..., None] * radiance(self.image, even @ frame)).mean(1), albedo[:, None]

    def shade(self, ball: Ball, normals: Array) -> Array:
        """Returns the radiance toward the eye from surfaces with these normals."""
        east = np.stack([normals[:, 2], 0 * normals[:, 0], -normals[:, 0]], -1)
        tangents = unit(east + np.array([1e-9, 0, 0]))
        frame = np.stack([tangents, np.cross(normals, tangents), normals], 1)
        v = frame @ VIEW
        color, fine = np.array(ball.color), ball.roughness**2
        alpha = (fine + (1 - fine) * ball.anisotropy**2, fine)
        total = np.zeros_like(normals)
        if ball.metallic > 0:
            total += ball.metallic * self.glossy(frame, v, alpha, color, 1.0)
        if ball.metallic < 1:
            f0 = np.full(3, ball.specular * ((ball.ior - 1) / (ball.ior + 1)) ** 2)
            under = color * self.lambert(frame, v, f0, ball.specular) if color.any() else 0
            above = self.glossy(frame, v, alpha, f0, ball.specular) if ball.specular > 0 else 0
            total += (1 - ball.metallic) * (under + above)
        if ball.sheen is not None:
            light, albedo = self.cloth(frame, v, ball.sheen)
            total = (1 - albedo) * total + light
        if ball.coat is not None:
            fresnel = schlick(np.full(3, 0.04), 1.0, v[:, 2])
            coat = self.glossy(frame, v, (ball.coat**2, ball.coat**2), np.ones(3), 1.0)
            total = (1 - fresnel) * total + fresnel * coat
        return total

    def sphere(self, ball: Ball, normals: Array) -> Array:
        return np.concatenate([self.shade(ball, part) for part in np.array_split(normals, max(1, len(normals) // 48))])


# The spheres as peeler renders them.


def pixel_normals(size: int) -> Array:
    """Returns the normals of a sphere that fills `size` x `size` pixels; z is NaN outside the sphere."""
    x = 2 * (np.arange(size) + 0.5) / size - 1
    x, y = np.meshgrid(x, -x)
    with np.errstate(invalid="ignore"):
        return np.stack([x, y, np.sqrt(1 - x * x - y * y)], -1)


def rendered(peeler: str, chosen: List[Ball], image: Array, size: int, turn: str) -> Array:
    """Returns the pixels that peeler renders: rows, spheres, columns, channels."""
    if not chosen:
        return np.empty((size, 0, size, 3))
    with tempfile.TemporaryDirectory() as folder:
        glb, sky, out = (Path(folder) / name for name in ("spheres.glb", "sky.exr", "out.exr"))
        glb.write_bytes(scene(chosen).bytes())
        light = oiio.ImageBuf(np.ascontiguousarray(image, dtype=np.float32))
        if not light.write(str(sky), oiio.FLOAT):
            raise OSError(light.geterror())
        subprocess.run(
            [peeler, "render", str(glb), "-o", str(out), "--as", "composite", "--surfaces", "visible", "--quiet",
             "--eye", "0,0,10", "--target", "0,0,0", "--ortho-height", "2", "--size", f"{size * len(chosen)}x{size}",
             "--environment", str(sky), "--environment-rotation", turn],
            check=True)
        pixels = oiio.ImageBuf(str(out)).get_pixels(oiio.FLOAT)[..., :3]
    return pixels.reshape(size, len(chosen), size, 3)


class Nearness(NamedTuple):
    """Differences between the pixels of one of our spheres and the referee's."""

    mean: float  # ratio of our mean to the referee's
    error: float  # root mean square difference over the root mean square of the referee's pixels
    furnace: Optional[float]  # greatest difference from 1, for white spheres

    def missed(self) -> List[str]:
        """Returns the limits that this sphere misses; all of them if a measure is not a number."""
        met = {"mean": abs(self.mean - 1) <= MEAN, "relative error": self.error <= ERROR,
               "furnace": self.furnace is None or self.furnace <= FURNACE}
        return [limit for limit in met if not met[limit]]


def nearness(own: Array, theirs: Array, in_furnace: Optional[Array]) -> Nearness:
    """Compares the pixels of a sphere."""
    error = math.sqrt(((own - theirs) ** 2).mean() / (theirs**2).mean())
    furnace = None if in_furnace is None else float(np.abs(in_furnace - 1).max())
    return Nearness(float(own.mean() / theirs.mean()), error, furnace)


def table(found: Dict[str, Nearness]) -> str:
    """Returns a table with a row per material, over all its roughnesses, which end the spheres' names."""
    materials: Dict[str, List[Nearness]] = {}
    for name, near in found.items():
        materials.setdefault(re.sub(r"(?<!index) \d\.\d", "", name), []).append(near)
    lines = ["| spheres | | mean, ours to the referee's | relative error up to |", "| --- | ---: | ---: | ---: |"]
    for material, spheres in materials.items():
        means = list(dict.fromkeys(f"{mean(near.mean for near in spheres):.3f}" for mean in (min, max)))
        lines.append(f"| {material} | {len(spheres)} | {' to '.join(means)} | {max(near.error for near in spheres):.3f} |")
    return "\n".join(lines)


def judgement(found: Dict[str, Nearness]) -> str:
    """Returns the text below the table: the limits, the worst furnace, and the spheres that miss a limit."""
    worst = max((near.furnace for near in found.values() if near.furnace is not None), default=0.0)
    missed = [f"{name} ({', '.join(near.missed())})" for name, near in found.items() if near.missed()]
    return (f"Limits: mean within {100 * MEAN:g} % of the referee's, relative error {ERROR:g}, furnace {FURNACE:g} "
            f"(at most {worst:.3f}). Missed by: {'; '.join(missed) or 'none'}.")


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("peeler")
    parser.add_argument("--size", type=int, default=32, help="pixels a sphere")
    parser.add_argument("--samples", type=int, default=4096, help="of the referee, a lobe and pixel")
    parser.add_argument("--height", type=int, default=256, help="of the environment, pixels")
    parser.add_argument("--edge", type=float, default=80, help="greatest angle of normal and view, degrees")
    parser.add_argument("--only", default="", help="spheres whose name contains this")
    parser.add_argument("--environment-rotation", default="0", help="of peeler's; the referee's stays")
    return parser.parse_args()


def main() -> None:
    asked = arguments()
    chosen = [ball for ball in balls() if asked.only in ball.name]
    white = [ball for ball in chosen if ball.color == WHITE]
    image = environment(asked.height).astype(np.float32).astype(float)
    ours, furnace = (rendered(asked.peeler, spheres, light, asked.size, asked.environment_rotation)
                     for spheres, light in ((chosen, image), (white, np.ones_like(image))))
    normals = pixel_normals(asked.size)
    seen = normals[..., 2] > math.cos(math.radians(asked.edge))
    referee = Referee(image, asked.samples)
    found: Dict[str, Nearness] = {}
    for i, ball in enumerate(chosen):
        theirs, own = referee.sphere(ball, normals[seen]), ours[:, i][seen]
        found[ball.name] = nearness(own, theirs, furnace[:, white.index(ball)][seen] if ball in white else None)
    print(f"{table(found)}\n\n{judgement(found)}")


if __name__ == "__main__":
    main()
