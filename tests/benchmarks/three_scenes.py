# SPDX-License-Identifier: Apache-2.0
"""The scenes of against_three.py: sample models, generated spheres of materials, and two environments."""
from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any, Callable, Dict, NamedTuple, Tuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "examples"))

from scene_kit.glb import REPEAT, Glb  # noqa: E402
from scene_kit.png import png  # noqa: E402
from scene_kit.shapes import quad, sphere  # noqa: E402

# three.js filters cube faces a quarter as wide as the picture. With this width, both programs filter at the same
# resolution.
WIDTH, HEIGHT = 2048, 1024

# Paths of models, relative to gltf-sample-assets.
MODELS: Tuple[str, ...] = (
    "2CylinderEngine/glTF/2CylinderEngine.gltf",
    "AlphaBlendModeTest/glTF/AlphaBlendModeTest.gltf",
    "AnimatedMorphCube/glTF-Binary/AnimatedMorphCube.glb",
    "BoxTextured/glTF-Binary/BoxTextured.glb",
    "BoxTexturedMeshopt/BoxTextured_meshopt.glb",
    "BoxTexturedNonPowerOfTwo/glTF-Binary/BoxTexturedNonPowerOfTwo.glb",
    "BoxTexturedWebP/box-textured-separate.gltf",
    "BoxVertexColors/glTF-Binary/BoxVertexColors.glb",
    "CesiumMan/glTF-Binary/CesiumMan.glb",
    "CesiumMilkTruck/glTF/CesiumMilkTruck.gltf",
    "DamagedHelmet/glTF-Binary/DamagedHelmet.glb",
    "Duck/glTF-Binary/Duck.glb",
    "Fox/glTF/Fox.gltf",
    "GearboxAssy/glTF-Draco/GearboxAssy.gltf",
    "GlassVaseFlowers/glTF/GlassVaseFlowers.gltf",
    "InterpolationTest/glTF-Binary/InterpolationTest.glb",
    "LightsPunctualLamp/glTF/LightsPunctualLamp.gltf",
    "MetalRoughSpheresNoTextures/glTF-Binary/MetalRoughSpheresNoTextures.glb",
    "MorphPrimitivesTest/glTF/MorphPrimitivesTest.gltf",
    "MultiUVTest/glTF-Binary/MultiUVTest.glb",
    "NegativeScaleTest/glTF-Binary/NegativeScaleTest.glb",
    "NormalTangentTest/glTF-Binary/NormalTangentTest.glb",
    "OrientationTest/glTF-Binary/OrientationTest.glb",
    "Pirate/pirate.glb",
    "RiggedSimple/glTF-Binary/RiggedSimple.glb",
    "SimpleInstancing/glTF-Binary/SimpleInstancing.glb",
    "StainedGlassLamp/glTF-JPG-PNG/StainedGlassLamp.gltf",
    "TextureSettingsTest/glTF-Binary/TextureSettingsTest.glb",
    "TextureTransformTest/glTF/TextureTransformTest.gltf",
    "TransmissionTest/glTF-Binary/TransmissionTest.glb",
    "UnlitTest/glTF-Binary/UnlitTest.glb",
    "VertexColorTest/glTF-Binary/VertexColorTest.glb",
    # Some copies of the model collection lack the models below.
    "MetalRoughSpheres/glTF-Binary/MetalRoughSpheres.glb",
    "TextureTransformMultiTest/glTF-Binary/TextureTransformMultiTest.glb",
    "ToyCar/glTF-Binary/ToyCar.glb",
)


class Made(NamedTuple):
    scene: Callable[[], Glb]
    environment: str  # a key of ENVIRONMENTS


def ball(base: float = 1.0, metallic: float = 0.0, roughness: float = 1.0,
         **extensions: Dict[str, Any]) -> Callable[[], Glb]:
    """Returns a function that makes a sphere of one material; extensions are named without KHR_materials_."""
    def make() -> Glb:
        glb = Glb("ball")
        for name in extensions:
            glb.extend(f"KHR_materials_{name}")
        material = glb.push("materials", {
            "pbrMetallicRoughness": {"baseColorFactor": [base, base, base, 1.0], "metallicFactor": metallic,
                                     "roughnessFactor": roughness},
            "extensions": {f"KHR_materials_{name}": value for name, value in extensions.items()}})
        glb.node("ball", glb.mesh("ball", (glb.store(sphere(1.0, 256)), material)))
        glb.perspective("camera", (0.0, 0.0, 4.0), (0.0, 0.0, 0.0), math.radians(32), aspect=1.0)
        return glb
    return make


def _hemisphere(x: int, y: int, side: int = 64) -> Tuple[int, ...]:
    """Returns a texel of a normal map with one dome off its centre, so that every rotation looks different."""
    u, v = (x + 0.5) / side * 2 - 1.2, 0.9 - (y + 0.5) / side * 2
    square = (u * u + v * v) / 0.64
    normal = (u / 0.8, v / 0.8, math.sqrt(1 - square)) if square < 0.95 else (0.0, 0.0, 1.0)
    return tuple(round(127.5 * (n + 1)) for n in normal)


TURNS: Tuple[Tuple[float, Tuple[float, float]], ...] = tuple(
    (math.radians(degrees), scale) for scale in ((1.0, 1.0), (-1.0, 1.0), (1.0, -1.0))
    for degrees in (0.0, 90.0, 180.0, -30.0))


def turned_maps(varnish: bool) -> Glb:
    """Returns squares without tangents, whose normal maps or clearcoat normal maps are rotated and mirrored by
    KHR_texture_transform."""
    glb = Glb("turned normal maps")
    glb.extend("KHR_texture_transform")
    stored = glb.store(quad(0.45, 0.45, tile=0.9))
    texture = glb.texture("dome", png(64, 64, _hemisphere), REPEAT)
    for i, (rotation, scale) in enumerate(TURNS):
        info = {"index": texture, "extensions": {"KHR_texture_transform": {"rotation": rotation, "scale": list(scale)}}}
        material: Dict[str, Any] = {"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.6}}
        if varnish:
            glb.extend("KHR_materials_clearcoat")
            material["extensions"] = {"KHR_materials_clearcoat": {
                "clearcoatFactor": 1.0, "clearcoatRoughnessFactor": 0.3, "clearcoatNormalTexture": info}}
        else:
            material["normalTexture"] = info
        mesh = glb.mesh(f"turn {i}", (stored, glb.push("materials", material)))
        glb.node(f"turn {i}", mesh, at=(i % 4 - 1.5, 1.0 - i // 4, 0.0))
    glb.perspective("camera", (0.0, 0.0, 7.0), (0.0, 0.0, 0.0), math.radians(32), aspect=1.0)
    return glb


METAL, CLOTH = {"metallic": 1.0}, {"sheenColorFactor": [1.0, 1.0, 1.0]}
MADE: Dict[str, Made] = {
    "white, diffuse": Made(ball(specular={"specularFactor": 0.0}), "studio"),
    "black, roughness 0.3": Made(ball(0.0, roughness=0.3), "studio"),
    "metal, roughness 0.2": Made(ball(roughness=0.2, **METAL), "studio"),
    "metal, roughness 0.5": Made(ball(roughness=0.5, **METAL), "studio"),
    "metal, roughness 1": Made(ball(roughness=1.0, **METAL), "studio"),
    "half a metal, roughness 0.5": Made(ball(metallic=0.5, roughness=0.5), "studio"),
    "varnish": Made(ball(0.2, roughness=0.8, clearcoat={"clearcoatFactor": 1.0, "clearcoatRoughnessFactor": 0.1}),
                    "studio"),
    "cloth, roughness 0.3": Made(ball(0.1, sheen={**CLOTH, "sheenRoughnessFactor": 0.3}), "studio"),
    "cloth, roughness 0.8": Made(ball(0.1, sheen={**CLOTH, "sheenRoughnessFactor": 0.8}), "studio"),
    "furnace: metal, roughness 0.5": Made(ball(roughness=0.5, **METAL), "white"),
    "furnace: half a metal, roughness 0.5": Made(ball(metallic=0.5, roughness=0.5), "white"),
    "furnace: dielectric, roughness 0.5": Made(ball(roughness=0.5), "white"),
    "turned normal maps": Made(lambda: turned_maps(False), "studio"),
    "turned normal maps of varnish": Made(lambda: turned_maps(True), "studio"),
}


def studio(width: int = WIDTH, height: int = HEIGHT) -> np.ndarray:
    """Returns linear RGB [height, width, 3] of floats, zenith first: a pale floor, a sky, three boxes of light and a
    dark wall. All edges are blurred over one degree, so that the result hardly depends on the filter that samples
    them."""
    v, u = np.mgrid[0:height, 0:width]
    latitude, longitude = 90 - (v + 0.5) * 180 / height, (u + 0.5) * 360 / width - 180

    def step(value: np.ndarray, wide: float) -> np.ndarray:
        t = np.clip(value / wide + 0.5, 0.0, 1.0)
        return t * t * (3 - 2 * t)

    def box(at: Tuple[float, float], half: Tuple[float, float]) -> np.ndarray:
        across = np.abs((longitude - at[0] + 180) % 360 - 180)
        return step(half[0] - across, 2.0) * step(half[1] - np.abs(latitude - at[1]), 2.0)

    def mixed(below: np.ndarray, share: np.ndarray, color: Tuple[float, float, float]) -> np.ndarray:
        return below + share[..., None] * (np.array(color) - below)

    sky = np.zeros((height, width, 3)) + (0.45, 0.55, 0.75)
    sky = mixed(sky, step(45 - latitude, 70), (0.75, 0.72, 0.68))
    light = mixed(sky, step(-latitude, 6), (0.22, 0.18, 0.14))
    light = mixed(light, box((120, 5), (35, 30)), (0.03, 0.03, 0.04))
    light = mixed(light, box((-60, 40), (22, 16)), (5.0, 4.7, 4.2))
    light = mixed(light, box((60, 20), (8, 28)), (3.0, 3.6, 4.4))
    return mixed(light, box((-150, -15), (12, 12)), (2.4, 0.7, 0.3)).astype(np.float32)


ENVIRONMENTS: Dict[str, Callable[[], np.ndarray]] = {
    "studio": studio,
    "white": lambda: np.ones((HEIGHT, WIDTH, 3), dtype=np.float32),
}
