# SPDX-License-Identifier: Apache-2.0
"""Runs the command on every model of the glTF collections, in small pictures. The command writes a picture with all
channels, arrays, hits and baked values, or rejects the file. Looks for sanitizer errors, which have an exit code of their own.

    PEELER=build/asan/peeler python3 -B tests/sanitizers/every_model_test.py I/N

Runs on the I-th of every N models of $PEELER_ASSETS (or ../shared/assets next to the repository).
"""

import os
import pathlib
import subprocess
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
ASSETS = pathlib.Path(os.environ.get("PEELER_ASSETS") or SOURCE.parent / "shared" / "assets")
PEELER = os.environ["PEELER"]
SKIPPED = 77

COMMANDS = (
    ("info", "--json"),
    ("render", "-o", "layers.exr", "--size", "64x48", "--channels", "all", "--environment", "studio"),
    ("render", "-o", "arrays.npz", "--size", "64x48", "--time", "0.3"),
    ("rays", "-o", "hits.npz", "--directions", "2", "--resolution", "32"),
    ("bake", "-o", "baked.glb", "--directions", "4", "--resolution", "32"),
)
DONE, REFUSED = 0, 3


def models():
    folders = (ASSETS / "gltf-sample-assets", ASSETS / "gltf-asset-generator", SOURCE / "examples" / "scenes")
    return sorted(path for folder in folders for path in folder.rglob("*") if path.suffix in (".gltf", ".glb"))


def main():
    if not (ASSETS / "gltf-sample-assets").is_dir():
        print(f"skipped: there are no models in {ASSETS}")
        sys.exit(SKIPPED)
    index, count = map(int, sys.argv[1].split("/"))
    ends, failed = {DONE: 0, REFUSED: 0}, False
    with tempfile.TemporaryDirectory() as folder:
        for model in models()[index - 1 :: count]:
            for verb, *options in COMMANDS:
                done = subprocess.run(
                    [PEELER, verb, str(model), *options], cwd=folder, stdin=subprocess.DEVNULL,
                    stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", check=False,
                )
                if done.returncode in ends:
                    ends[done.returncode] += 1
                    continue
                failed = True
                print(f"exit code {done.returncode}: {verb} {model}\n{done.stdout}", flush=True)
    print(f"{ends[DONE]} commands wrote what they were to, {ends[REFUSED]} refused their model")
    sys.exit(1 if failed or ends[DONE] <= ends[REFUSED] else 0)


if __name__ == "__main__":
    main()
