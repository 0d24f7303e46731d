# SPDX-License-Identifier: Apache-2.0
"""The scenes of referee.py: spheres with every lobe of glTF, and the environment around them."""
from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Tuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "examples"))

from scene_kit.glb import Geometry, Glb  # noqa: E402

Array = Any  # numpy's type annotations differ between its releases


class Ball(NamedTuple):
    """A sphere and its material, in glTF's terms."""

    name: str
    color: Tuple[float, float, float] = (1.0, 1.0, 1.0)
    metallic: float = 0.0
    roughness: float = 0.5
    specular: float = 1.0
    ior: float = 1.5
    coat: Optional[float] = None  # roughness of the clearcoat
    sheen: Optional[float] = None  # roughness of the sheen, whose colour is white
    anisotropy: float = 0.0

    def material(self, glb: Glb) -> Dict[str, Any]:
        extensions: Dict[str, Any] = {}
        if self.specular != 1:
            extensions["KHR_materials_specular"] = {"specularFactor": self.specular}
        if self.ior != 1.5:
            extensions["KHR_materials_ior"] = {"ior": self.ior}
        if self.coat is not None:
            extensions["KHR_materials_clearcoat"] = {"clearcoatFactor": 1, "clearcoatRoughnessFactor": self.coat}
        if self.sheen is not None:
            extensions["KHR_materials_sheen"] = {"sheenColorFactor": [1, 1, 1], "sheenRoughnessFactor": self.sheen}
        if self.anisotropy:
            extensions["KHR_materials_anisotropy"] = {"anisotropyStrength": self.anisotropy}
        for extension in extensions:
            glb.extend(extension)
        return {
            "name": self.name,
            "pbrMetallicRoughness": {"baseColorFactor": [*self.color, 1], "metallicFactor": self.metallic,
                                     "roughnessFactor": self.roughness},
            "extensions": extensions,
        }


BLACK, WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)


def balls() -> List[Ball]:
    """Returns spheres for every lobe, with roughness 0.2 and above."""
    some, many = (0.2, 0.4, 0.6, 0.8, 1.0), (0.2, 0.3, 0.5, 0.7, 1.0)
    return [
        Ball("white diffuse", specular=0.0),
        *(Ball(f"white metal {r}", metallic=1, roughness=r) for r in many),
        *(Ball(f"gold {r}", (1.0, 0.78, 0.34), 1, r) for r in (0.3, 0.6)),
        *(Ball(f"black dielectric {r}", BLACK, 0, r) for r in many),
        *(Ball(f"white dielectric {r}", roughness=r) for r in (0.2, 0.6, 1.0)),
        Ball("red plastic, index 1.8", (0.8, 0.1, 0.1), 0, 0.3, ior=1.8),
        *(Ball(f"half metal {r}", (0.9, 0.6, 0.3), 0.5, r) for r in (0.2, 0.6, 1.0)),
        *(Ball(f"clearcoat {r} on black", BLACK, 0, 1, 0.0, coat=r) for r in (0.2, 0.6)),
        *(Ball(f"sheen {r} on black", BLACK, 0, 1, 0.0, sheen=r) for r in some),
        *(Ball(f"anisotropic metal {r}", metallic=1, roughness=r, anisotropy=0.7) for r in (0.3, 0.6)),
    ]


def unit_sphere(around: int, rows: int) -> Geometry:
    out = Geometry()
    for j in range(rows + 1):
        for i in range(around + 1):
            theta, phi = math.pi * j / rows, 2 * math.pi * i / around
            p = (math.sin(theta) * math.sin(phi), math.cos(theta), math.sin(theta) * math.cos(phi))
            out.positions.append(p)
            out.normals.append(p)
            out.uvs.append((i / around, j / rows))
    for j in range(rows):
        for i in range(around):
            a, b = j * (around + 1) + i, (j + 1) * (around + 1) + i
            out.indices += [*([] if j == 0 else [a, b, a + 1]), *([] if j == rows - 1 else [a + 1, b, b + 1])]
    return out


def scene(chosen: List[Ball]) -> Glb:
    """Returns the spheres in a row along X, at a spacing of two."""
    glb = Glb("spheres")
    stored = glb.store(unit_sphere(192, 96))
    for i, ball in enumerate(chosen):
        mesh = glb.mesh(ball.name, (stored, glb.push("materials", ball.material(glb))))
        glb.node(ball.name, mesh, at=(2.0 * i - len(chosen) + 1, 0.0, 0.0))
    return glb


# The environment is equirectangular as in OpenEXR's ImfEnvmap.h: +Z at the centre, +X to the left.


def smooth(x: Array) -> Array:
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)


def environment(height: int) -> Array:
    """Returns the radiance of `height` x 2 `height` pixels: a floor, a sky, a red and a green side, and a bright box
    with soft edges."""
    longitude = (0.5 - (np.arange(2 * height) + 0.5) / (2 * height)) * 2 * np.pi
    latitude = ((0.5 - (np.arange(height) + 0.5) / height) * np.pi)[:, None]
    y, x = np.sin(latitude) + 0 * longitude, np.sin(longitude) * np.cos(latitude)
    floor, horizon, zenith = (np.array(c) for c in ((0.20, 0.18, 0.16), (0.65, 0.66, 0.70), (0.25, 0.35, 0.60)))
    light = floor + (horizon - floor) * smooth((y + 0.05) / 0.1)[..., None]
    light = light + (zenith - horizon) * smooth(y)[..., None]
    for sign, color in ((1, (0.9, 0.15, 0.1)), (-1, (0.1, 0.6, 0.2))):
        light = light + (np.array(color) - light) * 0.8 * smooth((sign * x - 0.6) / 0.3)[..., None]
    across, up = np.degrees(longitude + 0.7), np.degrees(latitude - 0.6)
    box = smooth((11 - np.abs(across)) / 2) * smooth((11 - np.abs(up)) / 2)
    return light + box[..., None] * (np.array((12.0, 11.4, 10.2)) - light)
