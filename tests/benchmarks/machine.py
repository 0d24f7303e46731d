# SPDX-License-Identifier: Apache-2.0
"""The conditions of a measurement: commit, machine, renderer, versions."""
from __future__ import annotations

import json
import os
import platform
import subprocess
from pathlib import Path
from typing import Any, Dict

ROOT = Path(__file__).resolve().parents[2]
ASSETS = Path(os.environ.get("PEELER_ASSETS", ROOT.parent / "shared" / "assets"))
PACKAGES = {"Embree": "libembree-dev", "VTK": "python3-vtk9", "f3d": "f3d", "OpenEXR": "libopenexr-dev",
            "OpenImageIO": "libopenimageio-dev"}


def output(*command: Any) -> str:
    """Returns the output of a command, or "" if it fails or does not exist."""
    try:
        done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                              text=True, cwd=ROOT, check=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return done.stdout.strip()


def commit() -> str:
    """Returns the current commit, marked if any file other than the results has changed since."""
    changed = output("git", "status", "--porcelain", "--", ".", ":!README.md", ":!tests/benchmarks/RESULTS.md")
    return (output("git", "rev-parse", "HEAD") or "unknown") + (", modified" if changed else "")


def machine() -> str:
    model = next((line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines()
                  if line.startswith("model name")), platform.processor())
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return f"{model}, {len(os.sched_getaffinity(0))} cores used, {memory / 2**30:.0f} GiB of memory"


def facts(peeler: Path) -> Dict[str, str]:
    devices = json.loads(output(peeler, "devices", "--json") or '{"devices": []}')["devices"]
    renderer = next((f"{d['renderer']}, OpenGL {d['version']}" for d in devices if d["usable"]), "none")
    versions = [f"{name} {output('dpkg-query', '-W', '-f', '${Version}', package) or 'missing'}"
                for name, package in PACKAGES.items()]
    return {"commit": commit(), "machine": machine(), "renderer": renderer, "versions": ", ".join(versions)}
