# SPDX-License-Identifier: Apache-2.0
"""Reasons why rows miss their targets, by the rows' names; the JSON file of table.py has their profiles."""
from __future__ import annotations

from typing import Dict

REASONS: Dict[str, str] = {
    "capture": "llvmpipe shades every fragment, 8 pixels at once; Embree shades nothing",
    "composite, exact": "mostly the capture; sorting and compositing take less",
    "whole command to PNG": "only peeler decodes Draco; triangles of two or three pixels are shaded 16 pixels at once",
    "whole command to PNG, 4 samples": "peeler shades every sample, f3d every pixel",
    "whole command, layered file": "start, planning and the kernel's release of memory lie outside the stages",
    "writing the layered file": "deflate dominates, and the empty pixels of full windows compress quickly",
    "size of the layered file": "libdeflate's level 2 against zlib's level 4",
    "all hits of a bundle, sorted, processor time":
        "allocating and clearing memory takes a fifth or more; Embree is fast for few large nested surfaces",
    "all hits of 64 bundles, sorted, processor time":
        "every bundle rasterises all triangles again; Embree builds its hierarchy once",
    **{f"{what} with its hits, processor time":
       "every hit opens or closes a span of its solid; models of many meshes need their topology first"
       for what in ("thickness map", "parity")},
    "voxels with its hits, processor time":
        "three bits per cell, and far more cells than hits; models of many meshes need their topology first",
    "exponent of a-buffer's time over fragments, N from 8 to 128":
        "from 8 to 16 layers, the compiled shaders' share grows",
}

# Reasons why three.js's pictures are far from ours, by the rows' names. Each is the first words of a paragraph in
# examples/guide/light.md, "Beside three.js".
THREE: Dict[str, str] = {
    **{name: "Glass" for name in ("GlassVaseFlowers", "LightsPunctualLamp", "ToyCar", "TransmissionTest")},
    **{name: "Cloth" for name in ("cloth, roughness 0.3", "cloth, roughness 0.8")},
    **{name: "Highlights at the rim" for name in ("metal, roughness 0.5", "OrientationTest")},
}
