# SPDX-License-Identifier: Apache-2.0
"""A PNG writer (ISO/IEC 15948): 8-bit RGB, RGBA and palette images, and a tiny dot-matrix font."""
from __future__ import annotations

import math
import struct
import zlib
from typing import Callable, Dict, Sequence, Tuple

Pixel = Tuple[int, ...]


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _filter_row(row: bytes, above: bytes, step: int) -> bytes:
    """Returns the row filtered with Sub, Up or None, whichever leaves the smallest residuals (the heuristic of section
    12.8)."""
    sub = bytes((row[i] - (row[i - step] if i >= step else 0)) & 255 for i in range(len(row)))
    up = bytes((row[i] - above[i]) & 255 for i in range(len(row)))
    candidates = ((0, row), (1, sub), (2, up))
    kind, best = min(candidates, key=lambda c: sum(min(v, 256 - v) for v in c[1]))
    return bytes([kind]) + best


def _encode(
    width: int,
    height: int,
    colour_type: int,
    step: int,
    rows: Sequence[bytes],
    palette: bytes = b"",
) -> bytes:
    body = bytearray()
    above = bytes(width * step)
    for row in rows:
        # Neighbouring palette indices are unrelated, so filters make the file larger.
        body += b"\0" + row if colour_type == 3 else _filter_row(row, above, step)
        above = row
    header = struct.pack(">IIBBBBB", width, height, 8, colour_type, 0, 0, 0)
    out = b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header)
    if palette:
        out += _chunk(b"PLTE", palette)
    return out + _chunk(b"IDAT", zlib.compress(bytes(body), 9)) + _chunk(b"IEND", b"")


def png(width: int, height: int, pixel: Callable[[int, int], Pixel]) -> bytes:
    """Returns an RGB or RGBA image; `pixel(x, y)` returns 3 or 4 values from 0 to 255, and y increases downward."""
    rows = [bytes(v for x in range(width) for v in pixel(x, y)) for y in range(height)]
    channels = len(rows[0]) // width
    return _encode(width, height, {3: 2, 4: 6}[channels], channels, rows)


def png_ramp(
    width: int,
    height: int,
    ends: Sequence[Pixel],
    value: Callable[[int, int], float],
    steps: int = 48,
) -> bytes:
    """Returns a palette image: `value` (0 to 1) indexes a ramp through the colours `ends`."""
    palette = bytearray()
    for i in range(steps):
        t = i / (steps - 1) * (len(ends) - 1)
        k = min(int(t), len(ends) - 2)
        palette += bytes(round(a + (b - a) * (t - k)) for a, b in zip(ends[k], ends[k + 1]))
    rows = [
        bytes(round(min(1.0, max(0.0, value(x, y))) * (steps - 1)) for x in range(width))
        for y in range(height)
    ]
    return _encode(width, height, 3, 1, rows, bytes(palette))


# Glyphs of 5 x 7 dots: one number per row. The highest bit is the leftmost dot.
GLYPHS: Dict[str, Tuple[int, ...]] = {
    "1": (0b00100, 0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110),
    "2": (0b01110, 0b10001, 0b00001, 0b00110, 0b01000, 0b10000, 0b11111),
    "3": (0b01110, 0b10001, 0b00001, 0b00110, 0b00001, 0b10001, 0b01110),
    "4": (0b00010, 0b00110, 0b01010, 0b10010, 0b11111, 0b00010, 0b00010),
    "5": (0b11111, 0b10000, 0b11110, 0b00001, 0b00001, 0b10001, 0b01110),
    "6": (0b00110, 0b01000, 0b10000, 0b11110, 0b10001, 0b10001, 0b01110),
    "7": (0b11111, 0b00001, 0b00010, 0b00100, 0b01000, 0b01000, 0b01000),
    "8": (0b01110, 0b10001, 0b10001, 0b01110, 0b10001, 0b10001, 0b01110),
    "9": (0b01110, 0b10001, 0b10001, 0b01111, 0b00001, 0b00010, 0b01100),
    "P": (0b11110, 0b10001, 0b10001, 0b11110, 0b10000, 0b10000, 0b10000),
    "E": (0b11111, 0b10000, 0b10000, 0b11110, 0b10000, 0b10000, 0b11111),
    "L": (0b10000, 0b10000, 0b10000, 0b10000, 0b10000, 0b10000, 0b11111),
    "R": (0b11110, 0b10001, 0b10001, 0b11110, 0b10100, 0b10010, 0b10001),
}


def dot_coverage(text: str, x: float, y: float, radius: float = 0.47, edge: float = 0.08) -> float:
    """Returns how much of the point (x, y) the text covers, 0 to 1.

    One unit is one dot, y is down, and a letter takes six dots.
    """
    if not (0.0 <= y < 7.0 and 0.0 <= x < 6.0 * len(text)):
        return 0.0
    column, row = int(x % 6.0), int(y)
    if column == 5 or not GLYPHS[text[int(x // 6.0)]][row] >> (4 - column) & 1:
        return 0.0
    distance = math.hypot(x % 1.0 - 0.5, y % 1.0 - 0.5)
    return min(1.0, max(0.0, (radius - distance) / edge + 0.5))
