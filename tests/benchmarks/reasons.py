# SPDX-License-Identifier: Apache-2.0
"""Reasons why rows miss their targets, by the rows' names; the profiles below have each one's share."""
from __future__ import annotations

from typing import Dict

REASONS: Dict[str, str] = {
    "capture": "Embree traces up to 16 coherent rays at once and shades nothing; llvmpipe shades every fragment, 8 pixels at "
               "once whether a triangle covers them or not. What takes the time is the compiled fragment shader and, of many "
               "small triangles, Mesa's set-up and rasterising of them.",
    "composite, exact": "It is the capture above; sorting and compositing on the processor are the lesser part.",
    "whole command to PNG": "Both draw what is opaque once. Draco's data is decoded by us and not by f3d. Triangles of two or "
                            "three pixels are shaded sixteen pixels at a time.",
    "whole command to PNG, 4 samples": "All is drawn and shaded four times, once a sample; f3d shades once.",
    "whole command, layered file": "What lies outside the stages is the same whatever the scene: until main, planning, and the "
                                   "kernel taking hundreds of megabytes of pages back at the end.",
    "writing the layered file": "Deflate: OpenEXR compresses the same pixels and, with full windows, empty ones in addition, which "
                                "compress soon. The more layers fill the picture the less can be left out.",
    "size of the layered file": "Level 2 of libdeflate beside OpenEXR's level 4 of zlib: mostly a little smaller, here a little "
                                "larger.",
    "all hits of a bundle, sorted, processor time":
        "A source is made for every run, and a fifth of its time or more is the kernel's and the clearing of memory that is "
        "taken anew; the rest is storing what triangles cover of rows, and filling lists from that. Embree is quick where few "
        "large surfaces lie in one another, and slow where its hierarchy is large.",
    "all hits of 64 bundles, sorted, processor time":
        "Every bundle places and rasterises all triangles again, however few rays it has; Embree builds its hierarchy once.",
    **{f"{what} with its hits, processor time":
       "The solid of every hit is looked up and its spans are opened and closed, which weighs the more the sooner hits are "
       "found. Of a model with many meshes most is their topology, whose edges are sorted once to know what is closed."
       for what in ("thickness map", "parity")},
    "voxels with its hits, processor time":
        "The solids of every hit are looked up, and three bits a cell are settled and counted, of which there are far more "
        "than hits; of a model "
        "with many meshes it is their topology, as of the maps.",
    "exponent of a-buffer's time over fragments, N from 8 to 128":
        "From 8 to 16 layers the compiled shaders' share grows, and nothing else's does; beyond, time grows as the fragments do.",
}

# Reasons why pictures of three.js are far from ours, by the rows' names: the first words of paragraphs in
# examples/guide/light.md, "Beside three.js".
THREE: Dict[str, str] = {
    **{name: "Glass" for name in ("GlassVaseFlowers", "LightsPunctualLamp", "ToyCar", "TransmissionTest")},
    **{name: "Cloth" for name in ("cloth, roughness 0.3", "cloth, roughness 0.8")},
    **{name: "Highlights at the rim" for name in ("metal, roughness 0.5", "OrientationTest")},
}
