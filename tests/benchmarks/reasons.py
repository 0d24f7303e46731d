# SPDX-License-Identifier: Apache-2.0
"""Reasons why rows miss their targets, by the rows' names; the JSON file of table.py has their profiles."""
from __future__ import annotations

from typing import Dict

REASONS: Dict[str, str] = {
    "capture": "llvmpipe shades every fragment; Embree shades none",
    "composite, exact": "mostly the capture",
    "whole command to PNG": "only peeler decodes Draco; tiny triangles are shaded 16 pixels at once",
    "whole command to PNG, 4 samples": "of GearboxAssy, all four samples are rasterised; of the lamp, which has glass, also shaded",
    "whole command, layered file": "start, planning and freeing memory",
    "writing the layered file": "deflate; empty pixels compress quickly",
    "size of the file": "libdeflate's level 2 against zlib's level 4",
    "all hits of a bundle, sorted, processor time":
        "allocating memory; Embree is fast for few large nested surfaces",
    "all hits of 64 bundles, sorted, processor time":
        "every bundle rasterises all triangles again; Embree builds its hierarchy once",
    "maps and voxels with their hits, processor time":
        "hits open and close spans; cells outnumber hits; many meshes need their topology",
    "exponent of time over fragments of N quads": "from 8 to 16 layers, the compiled shaders' share grows",
}

# The reasons why three.js's pictures differ much from peeler's, by row name. Each reason is the first words of a
# paragraph in examples/guide/light.md, "Beside three.js".
THREE: Dict[str, str] = {
    **{name: "Glass" for name in ("GlassVaseFlowers", "LightsPunctualLamp", "ToyCar", "TransmissionTest")},
    **{name: "Cloth" for name in ("cloth, roughness 0.3", "cloth, roughness 0.8")},
    **{name: "Highlights at the rim" for name in ("metal, roughness 0.5", "OrientationTest")},
}
