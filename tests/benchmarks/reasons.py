# SPDX-License-Identifier: Apache-2.0
"""Why rows miss their targets: what a profile shows to bound them, by the rows' names."""
from __future__ import annotations

from typing import Dict

REASONS: Dict[str, str] = {
    "capture": "Embree traces up to 16 coherent rays at once and shades nothing; llvmpipe shades every fragment, 8 pixels at "
               "once whether a triangle covers them or not. Counting alone, which shades nothing either, takes a third of "
               "Embree's time; the rest is the fragment shader, some 950 instructions for 8 pixels, and the set-up of triangles.",
    "composite, exact": "It is the capture above; sorting and compositing on the processor come to a fifth of it at most.",
    "whole command to PNG": "We draw every triangle twice, to count and to shade every layer, hidden ones included; f3d draws "
                            "what is opaque once. Draco's data is decoded by us and not by f3d.",
    "whole command, layered file": "What lies outside the stages is the same whatever the scene: some 8 ms until main, 20 ms of "
                                   "planning, and the kernel taking hundreds of megabytes of pages back at the end.",
    "writing the layered file": "Deflate: OpenEXR compresses the same pixels and, with full windows, empty ones in addition, which "
                                "compress soon. The more layers fill the picture the less can be left out.",
    "size of the layered file": "Level 2 of libdeflate beside OpenEXR's level 4 of zlib: mostly a little smaller, here a little "
                                "larger.",
    "exponent of a-buffer's time over fragments, N from 8 to 128":
        "The step from 8 to 16 layers (2.2 to 2.65 times as long): the compiled shaders' share of the samples grows from 70 to "
        "76 % there and nothing else's does. From 16 to 128 layers the exponent is 1.07.",
}
