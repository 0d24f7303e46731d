#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The layers of a scene taken away one by one, nearest first, as an animated PNG: peel.py [SCENE [FILE [WxH]]]

Needs NumPy and the module `peeler`. The README shows examples/scenes/glasses.glb.
"""

import pathlib
import struct
import sys
import zlib

import numpy as np

import peeler

SCENE = sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parents[1] / "scenes" / "glasses.glb"
FILE = sys.argv[2] if len(sys.argv) > 2 else "peeling.png"
SIZE = tuple(int(side) for side in sys.argv[3].split("x")) if len(sys.argv) > 3 else (560, 315)

PAPER = np.float32(0.82)  # the background of the layers, in linear light
FIRST_MS, PEEL_MS, LAST_MS = 1600, 450, 1200
FADE = (0.5, 0.0)  # remaining share of the nearest layer's opacity, for each frame


def composite(layers, share):
    """Returns (h, w, 3) uint8 in sRGB: the layers (h, w, n, 4) over the paper, the first with a share of its
    opacity."""
    color = np.broadcast_to(PAPER, (*layers.shape[:2], 3)).copy()
    for k in range(layers.shape[2] - 1, -1, -1):
        rgba = layers[:, :, k] * (share if k == 0 else 1)
        color = rgba[..., :3] + (1 - rgba[..., 3:]) * color
    color = np.clip(color, 0, 1)
    srgb = np.where(color <= 0.0031308, 12.92 * color, 1.055 * color ** (1 / 2.4) - 0.055)
    return np.round(srgb * 255).astype(np.uint8)


def changed(before, after):
    """Returns the smallest window (x, y, width, height) that contains all pixels that differ; it has at least one
    pixel."""
    y, x = np.nonzero(np.any(before != after, axis=2))
    if not len(x):
        return 0, 0, 1, 1
    return int(x.min()), int(y.min()), int(np.ptp(x)) + 1, int(np.ptp(y)) + 1


def deflated(pixels):
    """Returns the compressed scan lines of a picture, each stored as the difference from the line above (PNG, filter
    2)."""
    height, width = pixels.shape[:2]
    above = np.concatenate((np.zeros((1, width, 3), np.uint8), pixels[:-1]))
    lines = np.empty((height, 1 + 3 * width), np.uint8)
    lines[:, 0] = 2
    lines[:, 1:] = (pixels - above).reshape(height, -1)
    return zlib.compress(lines.tobytes(), 9)


def write_apng(path, frames):
    """Writes [(pixels, milliseconds)] as an animated PNG (PNG third edition, 11.3.4); frames after the first are
    windows."""

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    height, width = frames[0][0].shape[:2]
    out = [b"\x89PNG\r\n\x1a\n", chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)),
           chunk(b"acTL", struct.pack(">II", len(frames), 0))]
    number, before = 0, None
    for pixels, milliseconds in frames:
        x, y, w, h = (0, 0, width, height) if before is None else changed(before, pixels)
        control = struct.pack(">IIIIIHHBB", number, w, h, x, y, milliseconds, 1000, 0, 0)
        out.append(chunk(b"fcTL", control))
        data = deflated(pixels[y : y + h, x : x + w])
        number += 1
        if before is None:
            out.append(chunk(b"IDAT", data))
        else:
            out.append(chunk(b"fdAT", struct.pack(">I", number) + data))
            number += 1
        before = pixels
    out.append(chunk(b"IEND", b""))
    pathlib.Path(path).write_bytes(b"".join(out))


with peeler.Renderer() as renderer:
    image = renderer.layers(peeler.Scene(SCENE), size=SIZE, samples=4)
layers = image.dense(channel="rgba").astype(np.float32)
frames = [(composite(layers, 1), FIRST_MS)]
for nearest in range(layers.shape[2] - 1):
    for share in FADE:
        last = nearest == layers.shape[2] - 2 and share == 0
        frames.append((composite(layers[:, :, nearest:], share), LAST_MS if last else PEEL_MS // len(FADE)))
write_apng(FILE, frames)
print(f"{FILE}: {len(frames)} frames, {layers.shape[2]} layers, {pathlib.Path(FILE).stat().st_size // 1024} KB")
