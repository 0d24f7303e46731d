# SPDX-License-Identifier: Apache-2.0
"""PlayCanvas' splat-transform, a converter and renderer of splats (MIT licence), from npm."""

import json
import pathlib
import shutil
import subprocess

from clouds import skip

PACKAGE, VERSION = "@playcanvas/splat-transform", "2.7.1"


def install(folder):
    """Returns the program; npm fetches it into a folder if it is not there. Skips the test if that fails."""
    folder = pathlib.Path(folder)
    package = folder / "node_modules" / PACKAGE
    told = package / "package.json"
    if not told.is_file() or json.loads(told.read_text())["version"] != VERSION:
        if not shutil.which("npm"):
            skip("npm is missing (apt-get install npm)")
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "package.json").write_text("{}\n")  # keeps npm from searching the folders above
        command = ["npm", "install", "--prefix", folder, "--ignore-scripts", "--no-audit", "--no-fund",
                   "--no-package-lock", f"{PACKAGE}@{VERSION}"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            skip(f"npm does not install {PACKAGE}: {done.stderr.strip()[-300:]}")
    return package / "bin" / "cli.mjs"


def run(program, *words, **options):
    done = subprocess.run(["node", program, "-q", "-w", *map(str, words)], capture_output=True, text=True, check=False,
                          **options)
    if done.returncode != 0:
        raise RuntimeError(f"splat-transform {' '.join(map(str, words))}: {done.stderr.strip()[-1000:]}")
