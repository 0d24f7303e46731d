# SPDX-License-Identifier: Apache-2.0
"""A reference of Gaussian splatting in double precision, from the papers: Zwicker et al., "EWA Splatting" (2002), and
Kerbl et al., "3D Gaussian Splatting for Real-Time Radiance Field Rendering" (2023). It shares nothing with peeler."""

from math import factorial, pi, sqrt
from typing import NamedTuple

import numpy as np

MOST, LEAST, REACH, FIELD = 0.99, 1 / 255, 3, 1.3  # opacities, standard deviations, times the field of view
THIN = 1e-4  # peeler's: the least axis, as a share of the longest, for depths along rays


class Cloud(NamedTuple):
    means: np.ndarray  # (n, 3)
    scales: np.ndarray  # (n, 3), standard deviations
    turns: np.ndarray  # (n, 4), quaternions w, x, y, z
    opacities: np.ndarray  # (n,)
    harmonics: np.ndarray  # (n, (degree + 1)², 3)
    compensated: bool = False  # antialiased training
    node: np.ndarray = np.eye(4)  # to the world


class Camera(NamedTuple):
    pose: np.ndarray  # (3, 4), world to camera: x right, y down, z forward
    focal: np.ndarray  # (2,), pixels per slope; parallel: per unit
    size: tuple  # width, height
    near: float = 0.01
    parallel: bool = False

    @property
    def middle(self):
        return np.array(self.size) / 2


def read_ply(path):
    """Reads a binary 3DGS PLY of floats."""
    head, body = path.read_bytes().split(b"end_header\n", 1)
    names = [line.split()[2].decode() for line in head.splitlines() if line.startswith(b"property float")]
    rows = np.frombuffer(body, "<f4").reshape(-1, len(names)).astype(float)
    take = lambda *wanted: np.stack([rows[:, names.index(name)] for name in wanted], -1)  # noqa: E731
    higher = sum(name.startswith("f_rest_") for name in names) // 3
    rest = take(*(f"f_rest_{i}" for i in range(3 * higher))) if higher else np.zeros((len(rows), 0))
    return Cloud(take("x", "y", "z"), np.exp(take("scale_0", "scale_1", "scale_2")),
                 take("rot_0", "rot_1", "rot_2", "rot_3"), 1 / (1 + np.exp(-take("opacity")[:, 0])),
                 np.concatenate([take("f_dc_0", "f_dc_1", "f_dc_2")[:, None],
                                 rest.reshape(len(rows), 3, higher).transpose(0, 2, 1)], 1),
                 b"SplatRenderMode: mip" in head)


def rotations(turns):
    w, x, y, z = (turns / np.linalg.norm(turns, axis=1, keepdims=True)).T
    return np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                     2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                     2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1).reshape(-1, 3, 3)


def legendre(degree, order, z):
    """The associated Legendre function with the Condon-Shortley phase, divided by sin^order."""
    value = np.full_like(z, (-1.0) ** order * np.prod(np.arange(1, 2 * order, 2.0)))
    before = np.zeros_like(z)
    for n in range(order + 1, degree + 1):
        value, before = ((2 * n - 1) * z * value - (n + order - 1) * before) / (n - order), value
    return value


def harmonics(degree, d):
    """Returns the real spherical harmonics (n, (degree + 1)²) of unit directions (n, 3)."""
    columns = []
    for n in range(degree + 1):
        for m in range(-n, n + 1):
            size = sqrt((2 * n + 1) / (4 * pi) * factorial(n - abs(m)) / factorial(n + abs(m)) * (2 if m else 1))
            wave = (d[:, 0] + 1j * d[:, 1]) ** abs(m)  # sin^m · e^imφ
            columns.append(size * legendre(n, abs(m), d[:, 2]) * (wave.imag if m < 0 else wave.real))
    return np.stack(columns, -1)


def linear(color):
    """Decodes sRGB."""
    return np.where(color <= 0.04045, color / 12.92, ((np.maximum(color, 0.04) + 0.055) / 1.055) ** 2.4)


def colors(cloud, camera):
    """Returns the stored colours (n, 3), 0 or more, towards the centres, or along parallel rays."""
    turn, eye = camera.pose[:, :3], -np.linalg.inv(camera.pose[:, :3]) @ camera.pose[:, 3]
    means = cloud.means @ cloud.node[:3, :3].T + cloud.node[:3, 3]
    toward = np.broadcast_to(turn[2], means.shape) if camera.parallel else means - eye
    # KHR_gaussian_splatting: harmonics turn with the node, but are not scaled.
    toward = toward @ (cloud.node[:3, :3] / np.linalg.norm(cloud.node[:3, :3], axis=0))
    bases = harmonics(round(sqrt(cloud.harmonics.shape[1])) - 1, toward / np.linalg.norm(toward, axis=1, keepdims=True))
    return np.maximum(0.5 + np.einsum("nk,nkc->nc", bases, cloud.harmonics), 0)


class Projected(NamedTuple):
    means: np.ndarray  # (n, 2), pixels
    covariances: np.ndarray  # (n, 2, 2), dilated
    opacities: np.ndarray  # (n,)
    at: np.ndarray  # (n, 3), camera space
    axes: np.ndarray  # (n, 3, 3), camera space: columns, of length 1 if the node has no scale


def project(cloud, camera, dilation):
    """Projects covariances: J W Σ Wᵀ Jᵀ + dilation. Slopes in J are limited to the field of view and a margin."""
    to_camera = camera.pose @ cloud.node
    at = cloud.means @ to_camera[:, :3].T + to_camera[:, 3]
    axes = to_camera[:, :3] @ rotations(cloud.turns)
    spread = (axes * cloud.scales[:, None] ** 2) @ axes.transpose(0, 2, 1)
    depth = np.ones(len(at)) if camera.parallel else at[:, 2]
    field = FIELD * camera.middle / camera.focal
    jacobian = np.zeros((len(at), 2, 3))
    jacobian[:, [0, 1], [0, 1]] = camera.focal / depth[:, None]
    if not camera.parallel:
        jacobian[:, :, 2] = -jacobian[:, [0, 1], [0, 1]] * np.clip(at[:, :2] / depth[:, None], -field, field)
    flat = jacobian @ spread @ jacobian.transpose(0, 2, 1)
    dilated = flat + dilation * np.eye(2)
    opacities = cloud.opacities
    if cloud.compensated:
        opacities = opacities * np.sqrt(np.maximum(np.linalg.det(flat), 0) / np.linalg.det(dilated))
    return Projected(camera.middle + camera.focal * at[:, :2] / depth[:, None], dilated, opacities, at, axes)


class Fragments(NamedTuple):
    """Values of every splat at every pixel; `margin` is 0 or more where there is a fragment, and is what an exponent or
    the logarithm of an opacity has to lose before there is none."""

    margin: np.ndarray  # (n, height, width)
    alpha: np.ndarray  # (n, height, width)
    z: np.ndarray  # (n, height, width)
    exponent: np.ndarray  # (n, height, width)


def fragments(cloud, camera, dilation, order="z"):
    """Returns the fragments at the centres of pixels. Their depths, by which they are sorted, are camera Z: "z" and
    "distance" of the mean, "ray" of the largest response along the pixel's ray."""
    splats = project(cloud, camera, dilation)
    pixels = np.stack(np.meshgrid(*(np.arange(n) + 0.5 for n in camera.size)), -1)
    away = pixels - splats.means[:, None, None]
    exponent = -0.5 * np.einsum("nyxi,nij,nyxj->nyx", away, np.linalg.inv(splats.covariances), away)
    opacity = splats.opacities[:, None, None]
    with np.errstate(divide="ignore"):
        margin = np.minimum(exponent + REACH**2 / 2, np.log(opacity) + exponent - np.log(LEAST))
    margin = np.where(splats.at[:, 2, None, None] > camera.near, margin, -np.inf)
    z = np.broadcast_to(splats.at[:, 2, None, None], margin.shape)
    slopes = (pixels - camera.middle) / camera.focal
    one, none = np.ones_like(slopes[..., :1]), np.zeros_like(slopes)
    if order == "distance":
        away = np.linalg.norm(splats.at, axis=1)[:, None, None]
        z = away / np.linalg.norm(np.concatenate([slopes, one], -1), axis=-1)
    if order == "ray":  # it meets the mean's conjugate plane
        thick = np.maximum(cloud.scales, THIN * cloud.scales.max(1, keepdims=True))
        origin, ray = (np.concatenate(parts, -1) for parts in
                       (((slopes, 0 * one), (none, one)) if camera.parallel else ((none, 0 * one), (slopes, one))))
        spread = (splats.axes * thick[:, None] ** 2) @ splats.axes.transpose(0, 2, 1)
        depth = 1 if camera.parallel else splats.at[:, 2:]
        spread[:, [0, 1], [0, 1]] += dilation * (depth / camera.focal) ** 2
        white = np.linalg.inv(np.linalg.cholesky(spread))  # to where the dilated splat is a unit sphere
        steps = np.einsum("nij,yxj->nyxi", white, ray)
        to_mean = np.einsum("nij,nyxj->nyxi", white, splats.at[:, None, None] - origin)
        along = (steps * to_mean).sum(-1) / (steps**2).sum(-1)
        z = along if camera.parallel else np.where(along > 0, along, z)
    return Fragments(margin, np.minimum(MOST, opacity * np.exp(exponent)), z, exponent)


def over(alpha, color):
    """Composites a pixel's fragments, nearest first: alpha (k,), color (k, 3) without alpha. Returns R, G, B, A."""
    through = np.concatenate([[1.0], np.cumprod(1 - alpha)])
    weights = alpha * through[:-1]
    return np.append(weights @ color, 1 - through[-1])
