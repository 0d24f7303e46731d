#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Shows the channels of a layer side by side: python3 channels_to_png.py IN.exr OUT.png [PART]

Vectors go from -1..1 to 0..1, positions and distances from their minimum to their maximum, ids to one colour each. PART
is the index of the part, default 0: the only part of a file written with --as composite; in a file of layers the part
`composite`, which has colour only. Needs Debian's python3-openimageio and python3-numpy.
"""
import sys

import numpy
import OpenImageIO as oiio

PANELS = [  # the channels, and how they are shown
    (("R", "G", "B"), "colour"), (("N.X", "N.Y", "N.Z"), "vector"), (("Ng.X", "Ng.Y", "Ng.Z"), "vector"),
    (("T.X", "T.Y", "T.Z"), "vector"), (("P.X", "P.Y", "P.Z"), "range"), (("distance",), "range"),
    (("UV.U", "UV.V"), "fraction"), (("barycentric.U", "barycentric.V"), "fraction"),
    (("baseColor.R", "baseColor.G", "baseColor.B"), "colour"),
    (("emissive.R", "emissive.G", "emissive.B"), "colour"),
    (("material.roughness", "material.metallic"), "fraction"), (("facing",), "vector"),
    (("motion.X", "motion.Y"), "motion"), (("id.object",), "id"), (("id.material",), "id"),
    (("id.primitive",), "id"), (("id.instance",), "id"),
]


def read(path, part):
    """Returns {name: channel}, with ids as integers and all others as floats. (OpenImageIO would scale ids.)"""
    source = oiio.ImageInput.open(path)
    if source is None:
        sys.exit(oiio.geterror())
    spec = source.spec(part)
    pixels = {}
    for index, name in enumerate(spec.channelnames):
        kind = oiio.UINT32 if name.startswith("id.") else oiio.FLOAT
        pixels[name] = source.read_image(part, 0, index, index + 1, kind).squeeze()
    return pixels


def shown(values, how, there):
    if how == "colour":
        values = numpy.clip(values, 0, 1) ** (1 / 2.2)
    elif how == "vector":
        values = values / 2 + 0.5
    elif how == "motion":
        values = values / (2 * max(numpy.abs(values).max(), 1e-9)) + 0.5
    elif how == "fraction":
        values = values % 1
    elif how == "range":
        least, most = values[there].min(0), values[there].max(0)
        values = (values - least) / numpy.maximum(most - least, 1e-9)
    elif how == "id":
        factors = numpy.array([2654435761, 2246822519, 3266489917], dtype=numpy.uint64)
        values = (values.astype(numpy.uint64) * factors >> numpy.uint64(16)) % 256 / 255
    if values.shape[2] == 1:
        values = numpy.repeat(values, 3, 2)
    elif values.shape[2] == 2:
        values = numpy.dstack([values, 0 * values[:, :, 0]])
    return numpy.where(there[:, :, None], values, 0)


def main():
    path, target = sys.argv[1:3]
    pixels = read(path, int(sys.argv[3]) if len(sys.argv) > 3 else 0)
    there = numpy.isfinite(pixels["Z"])
    panels = [shown(numpy.dstack([pixels[name] for name in names]), how, there)
              for names, how in PANELS if names[0] in pixels]
    columns = min(4, len(panels))
    panels += [0 * panels[0]] * (-len(panels) % columns)
    rows = [numpy.concatenate(panels[i:i + columns], 1) for i in range(0, len(panels), columns)]
    picture = oiio.ImageBuf(numpy.ascontiguousarray(numpy.concatenate(rows, 0), dtype=numpy.float32))
    if not picture.write(target, oiio.UINT8):
        sys.exit(picture.geterror())


main()
