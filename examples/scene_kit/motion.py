# SPDX-License-Identifier: Apache-2.0
"""Motion in a scene: morph targets, skins, instances and animations, on top of Glb."""
from __future__ import annotations

from array import array
from typing import Any, Dict, List, Sequence, Tuple

from .glb import ARRAY_BUFFER, FLOAT, UNSIGNED_BYTE, Geometry, Glb, Stored, little
from .vec import Vec3, sub

# The one or two joints of a vertex: (first, second, weight of the second).
Binding = Tuple[int, int, float]


def _vectors(glb: Glb, vectors: Sequence[Vec3]) -> int:
    numbers = array("f", [v for vector in vectors for v in vector])
    bounds = {
        "min": [min(numbers[k::3]) for k in range(3)],
        "max": [max(numbers[k::3]) for k in range(3)],
    }
    return glb.accessor(ARRAY_BUFFER, 12, FLOAT, "VEC3", len(vectors), little(numbers), **bounds)


def morph(glb: Glb, mesh: int, part: int, rest: Geometry, other: Geometry) -> None:
    """Adds a morph target: weight 1 turns the part of the mesh into `other`, which has the same vertices."""
    target = {
        "POSITION": _vectors(glb, [sub(b, a) for a, b in zip(rest.positions, other.positions)]),
        "NORMAL": _vectors(glb, [sub(b, a) for a, b in zip(rest.normals, other.normals)]),
    }
    entry = glb.json["meshes"][mesh]
    entry["primitives"][part].setdefault("targets", []).append(target)
    entry["weights"] = [0.0]


def bind(glb: Glb, stored: Stored, bindings: Sequence[Binding]) -> Stored:
    """Returns the same geometry, bound to joints."""
    count = len(bindings)
    joints = bytes(v for a, b, _ in bindings for v in (a, b, 0, 0))
    seconds = [round(share * 255) for _, _, share in bindings]
    weights = bytes(v for second in seconds for v in (255 - second, second, 0, 0))
    more = (
        ("JOINTS_0", glb.accessor(ARRAY_BUFFER, 4, UNSIGNED_BYTE, "VEC4", count, joints)),
        (
            "WEIGHTS_0",
            glb.accessor(ARRAY_BUFFER, 4, UNSIGNED_BYTE, "VEC4", count, weights, normalized=True),
        ),
    )
    return Stored(stored.attributes + more, stored.indices)


def skin(glb: Glb, name: str, node: int, joints: Sequence[int], places: Sequence[Vec3]) -> None:
    """Skins the mesh of a node. `places` are the positions of the joints in the mesh at rest."""
    matrices = array("f")
    for x, y, z in places:
        matrices.extend((1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -x, -y, -z, 1))
    accessor = glb.accessor(0, 64, FLOAT, "MAT4", len(places), little(matrices))
    entry = {"name": name, "joints": list(joints), "inverseBindMatrices": accessor}
    glb.json["nodes"][node]["skin"] = glb.push("skins", entry)


def instances(glb: Glb, node: int, places: Sequence[Vec3], sizes: Sequence[float]) -> None:
    """Draws the mesh of a node at several places."""
    attributes = {
        "TRANSLATION": _vectors(glb, places),
        "SCALE": _vectors(glb, [(size, size, size) for size in sizes]),
    }
    glb.extend("EXT_mesh_gpu_instancing")
    glb.json["nodes"][node]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}


class Animation:
    """An animation, added to the scene with its first channel."""

    def __init__(self, glb: Glb, name: str) -> None:
        self._glb = glb
        self._json: Dict[str, Any] = {"name": name, "samplers": [], "channels": []}
        glb.push("animations", self._json)
        self._times: Dict[Tuple[float, ...], int] = {}

    def move(
        self,
        node: int,
        path: str,
        times: Sequence[float],
        values: Sequence[Sequence[float]],
        interpolation: str = "LINEAR",
    ) -> None:
        """Adds a channel with one value per time (for CUBICSPLINE: in-tangent, value and out-tangent)."""
        key = tuple(times)
        if key not in self._times:
            numbers = array("f", times)
            self._times[key] = self._glb.accessor(
                0,
                4,
                FLOAT,
                "SCALAR",
                len(times),
                little(numbers),
                min=[min(numbers)],
                max=[max(numbers)],
            )
        flat: List[float] = [v for value in values for v in value]
        width = len(values[0])
        shape = "SCALAR" if path == "weights" else f"VEC{width}"
        count = len(flat) if path == "weights" else len(values)
        output = self._glb.accessor(
            0, 4 * (1 if path == "weights" else width), FLOAT, shape, count,
            little(array("f", flat))
        )
        sampler = {"input": self._times[key], "output": output, "interpolation": interpolation}
        self._json["channels"].append(
            {
                "sampler": len(self._json["samplers"]),
                "target": {"node": node, "path": path},
            }
        )
        self._json["samplers"].append(sampler)
