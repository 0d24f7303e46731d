# SPDX-License-Identifier: Apache-2.0
"""A writer of binary glTF 2.0. There is one buffer; meshes may share vertex data in it."""
from __future__ import annotations

import json
import struct
from array import array
from dataclasses import dataclass, field
from typing import Any, Dict, List, Optional, Sequence, Tuple

from .vec import IDENTITY, Vec2, Vec3, Vec4, Y, look_at, srgb

ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
UNSIGNED_BYTE, SHORT, UNSIGNED_SHORT, UNSIGNED_INT, FLOAT = 5121, 5122, 5123, 5125, 5126
POINTS = 0
SPLATS = "KHR_gaussian_splatting"
LINEAR, LINEAR_MIPMAP_LINEAR, CLAMP, REPEAT = 9729, 9987, 33071, 10497


@dataclass
class Geometry:
    """An indexed triangle list in metres; `uvs` and `colors` (linear) may be empty."""

    positions: List[Vec3] = field(default_factory=list)
    normals: List[Vec3] = field(default_factory=list)
    uvs: List[Vec2] = field(default_factory=list)
    colors: List[Vec4] = field(default_factory=list)
    indices: List[int] = field(default_factory=list)

    def append(self, other: "Geometry") -> "Geometry":
        base = len(self.positions)
        self.positions += other.positions
        self.normals += other.normals
        self.uvs += other.uvs
        self.colors += other.colors
        self.indices += [base + i for i in other.indices]
        return self


@dataclass
class Splats:
    """Gaussian splats in metres, with unit quaternions and sRGB colours from 0 to 1."""

    means: List[Vec3] = field(default_factory=list)
    scales: List[Vec3] = field(default_factory=list)
    turns: List[Vec4] = field(default_factory=list)
    opacities: List[float] = field(default_factory=list)
    colors: List[Vec3] = field(default_factory=list)


@dataclass(frozen=True)
class Stored:
    """The accessors of a geometry that is stored in the buffer; several meshes may share them."""

    attributes: Tuple[Tuple[str, int], ...]
    indices: int


class Glb:
    """A scene under construction; write() makes the file."""

    def __init__(self, title: str) -> None:
        self.json: Dict[str, Any] = {
            "asset": {
                "version": "2.0",
                "generator": "peeler make_scenes",
                "copyright": "CC0",
                "extras": {"title": title},
            },
            "scene": 0,
            "scenes": [{"name": title, "nodes": []}],
        }
        # One buffer view per layout, to keep the JSON short. Accessors point into the view.
        self._views: Dict[Tuple[int, int], bytearray] = {}
        self._images: List[bytes] = []

    def _list(self, key: str) -> List[Any]:
        entries: List[Any] = self.json.setdefault(key, [])
        return entries

    def push(self, key: str, value: Dict[str, Any]) -> int:
        self._list(key).append(value)
        return len(self._list(key)) - 1

    def extend(self, extension: str) -> None:
        """Declares an extension as used."""
        if extension not in self._list("extensionsUsed"):
            self._list("extensionsUsed").append(extension)

    def accessor(
        self,
        target: int,
        stride: int,
        component: int,
        shape: str,
        count: int,
        data: bytes,
        **extra: Any,
    ) -> int:
        """Stores data in a buffer view for `target`: ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER or 0 (neither)."""
        block = self._views.setdefault((target, stride), bytearray())
        view = list(self._views).index((target, stride))
        offset = len(block)
        block += data
        return self.push(
            "accessors",
            {
                "bufferView": view,
                "byteOffset": offset,
                "componentType": component,
                "count": count,
                "type": shape,
                **extra,
            },
        )

    def store(self, geometry: Geometry) -> Stored:
        count = len(geometry.positions)
        positions = array("f", [v for p in geometry.positions for v in p])
        bounds = {
            "min": [min(positions[k::3]) for k in range(3)],
            "max": [max(positions[k::3]) for k in range(3)],
        }
        attributes = [
            (
                "POSITION",
                self.accessor(
                    ARRAY_BUFFER, 12, FLOAT, "VEC3", count, little(positions), **bounds
                ),
            ),
            (
                "NORMAL",
                self.accessor(
                    ARRAY_BUFFER,
                    12,
                    FLOAT,
                    "VEC3",
                    count,
                    little(array("f", [v for n in geometry.normals for v in n])),
                ),
            ),
        ]
        if geometry.uvs:
            data = little(array("f", [v for t in geometry.uvs for v in t]))
            attributes.append(
                ("TEXCOORD_0", self.accessor(ARRAY_BUFFER, 8, FLOAT, "VEC2", count, data))
            )
        if geometry.colors:
            data = bytes(round(min(1.0, max(0.0, v)) * 255) for c in geometry.colors for v in c)
            attributes.append(
                (
                    "COLOR_0",
                    self.accessor(
                        ARRAY_BUFFER, 4, UNSIGNED_BYTE, "VEC4", count, data, normalized=True
                    ),
                )
            )
        wide = count > 65535
        data = little(array("I" if wide else "H", geometry.indices))
        indices = self.accessor(
            ELEMENT_ARRAY_BUFFER,
            4 if wide else 2,
            UNSIGNED_INT if wide else UNSIGNED_SHORT,
            "SCALAR",
            len(geometry.indices),
            data,
        )
        return Stored(tuple(attributes), indices)

    def splats(self, name: str, splats: Splats) -> int:
        """Adds a mesh of Gaussian splats (KHR_gaussian_splatting) of one colour each."""
        self.extend(SPLATS)
        count = len(splats.means)

        def floats(values: Sequence[Vec3], **extra: Any) -> int:
            data = array("f", [v for value in values for v in value])
            return self.accessor(ARRAY_BUFFER, 12, FLOAT, "VEC3", count, little(data), **extra)

        # Bounds are those of the stored numbers.
        stored = array("f", [v for mean in splats.means for v in mean])
        single = list(zip(stored[0::3], stored[1::3], stored[2::3]))
        # The base function of degree 0 is sqrt(1 / (4 pi)).
        base = 0.28209479177387814
        turns = array("h", [round(v * 32767) for turn in splats.turns for v in turn])
        # Opacities lie 4 bytes apart.
        opacities = b"".join(bytes((round(v * 255), 0, 0, 0)) for v in splats.opacities)
        attributes = {
            "POSITION": floats(
                splats.means,
                min=[min(mean[k] for mean in single) for k in range(3)],
                max=[max(mean[k] for mean in single) for k in range(3)],
            ),
            f"{SPLATS}:ROTATION": self.accessor(
                ARRAY_BUFFER, 8, SHORT, "VEC4", count, little(turns), normalized=True
            ),
            f"{SPLATS}:SCALE": floats(splats.scales),
            f"{SPLATS}:OPACITY": self.accessor(
                ARRAY_BUFFER, 4, UNSIGNED_BYTE, "SCALAR", count, opacities, normalized=True
            ),
            f"{SPLATS}:SH_DEGREE_0_COEF_0": floats(
                [tuple((v - 0.5) / base for v in color) for color in splats.colors]
            ),
        }
        extension = {"kernel": "ellipse", "colorSpace": "srgb_rec709_display"}
        primitive = {"attributes": attributes, "mode": POINTS, "extensions": {SPLATS: extension}}
        return self.push("meshes", {"name": name, "primitives": [primitive]})

    def texture(self, name: str, png: bytes, wrap: int = REPEAT) -> int:
        self._images.append(png)
        image = self.push(
            "images", {"name": name, "mimeType": "image/png", "bufferView": -len(self._images)}
        )
        sampler = {
            "magFilter": LINEAR,
            "minFilter": LINEAR_MIPMAP_LINEAR,
            "wrapS": wrap,
            "wrapT": wrap,
        }
        samplers = self._list("samplers")
        if sampler not in samplers:
            samplers.append(sampler)
        return self.push(
            "textures", {"name": name, "source": image, "sampler": samplers.index(sampler)}
        )

    def material(
        self,
        name: str,
        colour: str = "#ffffff",
        alpha: float = 1.0,
        metallic: float = 0.0,
        roughness: float = 0.5,
        texture: Optional[int] = None,
        mode: str = "OPAQUE",
        double_sided: bool = False,
        cutoff: float = 0.5,
    ) -> int:
        """Adds a material. `colour` is sRGB. `mode` is OPAQUE, MASK or BLEND."""
        surface: Dict[str, Any] = {
            "baseColorFactor": [round(c, 5) for c in (*srgb(colour), alpha)],
            "metallicFactor": metallic,
            "roughnessFactor": roughness,
        }
        if texture is not None:
            surface["baseColorTexture"] = {"index": texture}
        material: Dict[str, Any] = {"name": name, "pbrMetallicRoughness": surface}
        if mode != "OPAQUE":
            material["alphaMode"] = mode
        if mode == "MASK":
            material["alphaCutoff"] = cutoff
        if double_sided:
            material["doubleSided"] = True
        return self.push("materials", material)

    def glass(self, name: str, colour: str, alpha: float, roughness: float) -> int:
        """Adds a double-sided BLEND material."""
        return self.material(
            name, colour, alpha, roughness=roughness, mode="BLEND", double_sided=True
        )

    def mesh(self, name: str, *parts: Tuple[Stored, int]) -> int:
        """Adds a mesh; each part is a stored geometry and its material."""
        return self.push(
            "meshes",
            {
                "name": name,
                "primitives": [
                    {
                        "attributes": dict(stored.attributes),
                        "indices": stored.indices,
                        "material": material,
                    }
                    for stored, material in parts
                ],
            },
        )

    def node(
        self,
        name: str,
        mesh: Optional[int] = None,
        at: Vec3 = (0.0, 0.0, 0.0),
        turn: Vec4 = IDENTITY,
        size: Vec3 = (1.0, 1.0, 1.0),
        parent: Optional[int] = None,
    ) -> int:
        node: Dict[str, Any] = {"name": name}
        if mesh is not None:
            node["mesh"] = mesh
        if at != (0.0, 0.0, 0.0):
            node["translation"] = [round(v, 6) for v in at]
        if turn != IDENTITY:
            node["rotation"] = [round(v, 8) for v in turn]
        if size != (1.0, 1.0, 1.0):
            node["scale"] = list(size)
        index = self.push("nodes", node)
        siblings = (
            self.json["scenes"][0]["nodes"]
            if parent is None
            else self._list("nodes")[parent].setdefault("children", [])
        )
        siblings.append(index)
        return index

    def perspective(
        self,
        name: str,
        eye: Vec3,
        target: Vec3,
        yfov: float,
        aspect: float = 16 / 9,
        near: float = 0.01,
        far: Optional[float] = None,
        up: Vec3 = Y,
    ) -> None:
        lens: Dict[str, Any] = {"yfov": yfov, "aspectRatio": aspect, "znear": near}
        if far is not None:
            lens["zfar"] = far
        self._camera(
            name, {"name": name, "type": "perspective", "perspective": lens}, eye, target, up
        )

    def orthographic(
        self,
        name: str,
        eye: Vec3,
        target: Vec3,
        half_height: float,
        aspect: float = 16 / 9,
        near: float = 0.01,
        far: float = 10.0,
        up: Vec3 = Y,
    ) -> None:
        box = {"xmag": half_height * aspect, "ymag": half_height, "znear": near, "zfar": far}
        self._camera(
            name, {"name": name, "type": "orthographic", "orthographic": box}, eye, target, up
        )

    def _camera(self, name: str, camera: Dict[str, Any], eye: Vec3, target: Vec3, up: Vec3) -> None:
        index = self.push("cameras", camera)
        node = self.node(name, at=eye, turn=look_at(eye, target, up))
        self._list("nodes")[node]["camera"] = index

    def bytes(self) -> bytes:
        buffer = bytearray()
        views: List[Dict[str, Any]] = []

        def place(data: Sequence[int], **extra: Any) -> None:
            buffer.extend(b"\0" * (-len(buffer) % 4))
            views.append({"buffer": 0, "byteOffset": len(buffer), "byteLength": len(data), **extra})
            buffer.extend(data)

        for (target, stride), data in self._views.items():
            # Only views of vertex data may have a stride; indices are always tightly packed. Views of other data
            # (target 0) have no target.
            what = {"target": target} if target else {}
            place(data, **what, **({"byteStride": stride} if target == ARRAY_BUFFER else {}))
        first_image = len(views)
        for png in self._images:
            place(png)
        document = dict(self.json)
        if self._images:
            document["images"] = [
                {**image, "bufferView": first_image - image["bufferView"] - 1}
                for image in self.json["images"]
            ]
        buffer.extend(b"\0" * (-len(buffer) % 4))
        document["bufferViews"] = views
        document["buffers"] = [{"byteLength": len(buffer)}]
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        chunks = (
            struct.pack("<II", len(text), 0x4E4F534A)
            + text
            + struct.pack("<II", len(buffer), 0x004E4942)
            + buffer
        )
        return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks

    def _instances(self, node: Dict[str, Any]) -> int:
        """Returns how many instances of its mesh a node has."""
        extension = node.get("extensions", {}).get("EXT_mesh_gpu_instancing")
        if not extension:
            return 1
        count: int = self.json["accessors"][extension["attributes"]["TRANSLATION"]]["count"]
        return count

    def summary(self) -> Dict[str, int]:
        """Returns the counts of everything that the scene draws, including all instances."""
        triangles = splats = 0
        for node in self.json["nodes"]:
            if "mesh" in node:
                for part in self.json["meshes"][node["mesh"]]["primitives"]:
                    is_mesh = "indices" in part
                    index = part["indices"] if is_mesh else part["attributes"]["POSITION"]
                    elements = self.json["accessors"][index]["count"] * self._instances(node)
                    triangles += elements // 3 if is_mesh else 0
                    splats += 0 if is_mesh else elements
        return {
            "nodes": len(self.json["nodes"]),
            "meshes": len(self.json["meshes"]),
            "materials": len(self.json["materials"]),
            "triangles": triangles,
            **({"splats": splats} if splats else {}),
        }


def little(values: "array[Any]") -> bytes:
    """Returns the values as little-endian bytes, which glTF requires on every machine."""
    if struct.pack("=H", 1) != struct.pack("<H", 1):
        values = array(values.typecode, values)
        values.byteswap()
    return values.tobytes()
