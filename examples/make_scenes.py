#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the example scenes: python3 examples/make_scenes.py [--check] [NAME ...]

Everything is computed with fixed seeds by the standard library alone, so the bytes are the same every time. `--check`
writes nothing and exits with 1 if a scene differs from the committed file. (Python's zlib module compresses the
textures. If it uses another library, such as zlib-ng, the bytes differ although the pixels are the same.)
"""
from __future__ import annotations

import argparse
import importlib
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
# A scene is a file in sets/ that has a `build()`.
NAMES = tuple(sorted(path.stem for path in (HERE / "sets").glob("[!_]*.py")))


def main() -> int:
    parser = argparse.ArgumentParser(description="Writes peeler's example scenes.")
    parser.add_argument(
        "--out", type=Path, default=HERE / "scenes", help="folder (default: %(default)s)"
    )
    parser.add_argument(
        "--check", action="store_true", help="compare with the files that are there"
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help="which ones (default: all)")
    options = parser.parse_args()
    unknown = sorted(set(options.names) - set(NAMES))
    if unknown:
        parser.error(f"no scene is called {', '.join(unknown)}; there are {', '.join(NAMES)}")

    sys.path.insert(0, str(HERE))
    differing = 0
    for name in options.names or NAMES:
        glb = importlib.import_module(f"sets.{name}").build()
        data = glb.bytes()
        path = options.out / f"{name}.glb"
        if options.check:
            same = path.is_file() and path.read_bytes() == data
            differing += not same
            print(f"{path.name}: {'the same' if same else 'DIFFERS'}")
        else:
            options.out.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
            counts = ", ".join(f"{count} {what}" for what, count in glb.summary().items())
            print(f"{path.name}: {len(data) / 1e3:.0f} kB, {counts}")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
