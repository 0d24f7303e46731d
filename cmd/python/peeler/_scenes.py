# SPDX-License-Identifier: Apache-2.0
"""Scenes: files as the command line reads them, and meshes made of arrays."""

import json
import os
import weakref

import numpy as np

from . import _arrays, _options, _worker
from ._error import Error

MODES = {"triangles": 3, "lines": 2, "points": 1}
ALPHA_MODES = ("OPAQUE", "MASK", "BLEND")


def _refuse_shape(name, expected, array):
    raise Error("usage", f"expected an array of shape {expected}, not {array.shape}", name)


def _array(name, value, kinds="fiu"):
    """Returns an array of numbers of these kinds."""
    try:
        array = np.asarray(value)
    except ValueError:
        raise Error("usage", "expected an array of numbers", name) from None
    if array.dtype.kind not in kinds and (array.size > 0 or array.dtype.kind not in "fiu"):
        if array.dtype.kind not in "fiucb":
            raise Error("usage", "expected an array of numbers", name)
        raise Error("usage", f"expected {'numbers' if 'f' in kinds else 'whole numbers'}, not {array.dtype}", name)
    return array


def _vectors(name, value, components, rows=None):
    array = _array(name, value)
    if array.ndim != 2 or array.shape[1] != components or (rows is not None and len(array) != rows):
        _refuse_shape(name, f"({'n' if rows is None else rows}, {components})", array)
    return np.asarray(array, np.float32)


def _faces(value, vertices, corners):
    array = _array("faces", value, "iu")
    if array.ndim != 2 or array.shape[1] != corners:
        _refuse_shape("faces", f"(m, {corners})", array)
    outside = array[(array < 0) | (array >= vertices)] if array.size else array
    if outside.size:
        raise Error("usage", f"vertex index {outside.flat[0]} is out of range for {vertices} vertices", "faces")
    return array.astype(np.uint32)


def _colors(value, rows):
    """Returns linear colours, 0 to 1. Refuses integers other than uint8 and uint16, because their white is unknown."""
    array = _array("colors", value)
    whites = {np.dtype(np.uint8): 255, np.dtype(np.uint16): 65535}
    white = whites.get(array.dtype, 1)
    if white == 1 and array.dtype.kind != "f" and array.size:
        raise Error("usage", f"expected floats from 0 to 1, uint8 or uint16, not {array.dtype}", "colors",
                    "give them as numpy.uint8 or numpy.float32")
    array = _vectors("colors", value, 3 if array.ndim == 2 and array.shape[1] == 3 else 4, rows)
    array = array / np.float32(white)
    if not ((array >= -1e-3) & (array <= 1 + 1e-3)).all():
        raise Error("usage", "expected numbers from 0 to 1", "colors", "give colours of 0 to 255 as numpy.uint8")
    return np.clip(array, 0, 1)


def _texture(value):
    array = np.asarray(value)
    if array.dtype != np.uint8:
        raise Error("usage", f"expected uint8, not {array.dtype}", "texture",
                    "convert floats from 0 to 1 with numpy.uint8(numpy.round(255 * texture))")
    if array.ndim != 3 or array.shape[2] not in (3, 4) or array.size == 0:
        _refuse_shape("texture", "(height, width, 3 or 4)", array)
    return array


def _choice(name, value, choices):
    if value not in choices:
        raise Error("usage", f"unknown {name} {value!r}", name, "choose one of: " + ", ".join(choices))
    return value


class Scene:
    """Scene(path, **keywords)

    The scene in a file (glTF, PLY, STL, OBJ, 3MF). It never changes, any number of Renderers may render it, and it can be
    pickled for another process. Space: right-handed, +Y up, the file's units (metres in valid glTF).

    Keywords are those of `peeler render`: scene, include, exclude, allow_outside, ignore_extension, smooth_normals,
    unit, up, variant, transmission, environment, environment_rotation, normalize, strict.
    Warnings of readers become UserWarnings. Raises peeler.Error of kind 'input'.
    """

    def __init__(self, path, **keywords):
        _options.check("Scene", keywords)
        path = _options.path_of(path)
        self._name, self._bytes, self._owned = os.path.basename(path), None, None
        self._path = _worker.file_argument(path)
        self._keywords = {k: v for k, v in keywords.items() if v is not None}
        if self._keywords.get("environment") not in (None, "studio", "none"):
            self._keywords["environment"] = os.path.abspath(_options.path_of(self._keywords["environment"]))
        self._given = {}  # arguments by verb
        self._facts = None
        self._read()
        if not os.path.isabs(self._path):  # valid even if the current folder changes
            self._path = os.path.join(os.getcwd(), self._path)
        _worker.warn(self._facts["warnings"])

    @staticmethod
    def from_arrays(
        vertices, faces=None, *, normals=None, uv=None, texture=None, colors=None, base_color=(1, 1, 1, 1), metallic=0,
        roughness=1, alpha_mode="OPAQUE", double_sided=False, mode="triangles", name="mesh"
    ):  # fmt: skip
        """A scene with one mesh. The arrays are copied, as 32-bit floats.

        vertices: (n, 3), world space
        faces: (m, 3) indices, counter-clockwise seen from the front; None = the vertices in order;
            m = 0: an empty mesh. (m, 2) with mode='lines', (m, 1) with mode='points'
        normals: (n, 3), unit; None = every triangle is flat
        uv: (n, 2), V down, (0, 0) is the upper left corner of the texture
        texture: (height, width, 3 or 4), uint8, sRGB and straight alpha
        colors: (n, 3 or 4), linear: floats from 0 to 1, uint8 or uint16; multiplied with the texture and base_color
        base_color: linear RGBA; alpha_mode: 'OPAQUE', 'MASK' or 'BLEND'

        Raises peeler.Error of kind 'usage' for an array of another shape or type.
        """
        corners = MODES[_choice("mode", mode, MODES)]
        arrays = {"vertices": _vectors("vertices", vertices, 3)}
        if not np.isfinite(arrays["vertices"]).all():
            raise Error("usage", "expected finite numbers", "vertices")
        count = len(arrays["vertices"])
        if faces is not None:
            arrays["faces"] = _faces(faces, count, corners)
        if normals is not None:
            arrays["normals"] = _vectors("normals", normals, 3, count)
        if uv is not None:
            arrays["uv"] = _vectors("uv", uv, 2, count)
        if colors is not None:
            arrays["colors"] = _colors(colors, count)
        if texture is not None:
            if uv is None:
                hint = "give uv, an array of shape (n, 2)"
                raise Error("usage", "a texture needs texture coordinates", "texture", hint)
            arrays["texture"] = _texture(texture)
        metadata = {
            "base_color": json.dumps([float(c) for c in base_color]),
            "metallic": repr(float(metallic)),
            "roughness": repr(float(roughness)),
            "alpha_mode": _choice("alpha_mode", alpha_mode, ALPHA_MODES),
            "double_sided": "true" if double_sided else "false",
            "mode": mode,
            "name": str(name),
        }
        path = _arrays.place("mesh.safetensors")
        try:
            _arrays.write(path, arrays, metadata)
            return _of_bytes(_arrays.mapped(path), path, {})
        except BaseException:
            _arrays.remove(path)
            raise

    def normalized(self, to="unit-cube"):
        """normalized(to='unit-cube') -> Scene

        The same scene, centred on the origin and scaled uniformly: the longest side of its bounds is 1, or with
        'unit-sphere' the farthest vertex is at distance 1.
        """
        keywords = {**self._keywords, "normalize": to}
        if self._bytes is None:
            scene = _of_file(self._path, self._name, keywords, None)
        else:
            scene = _of_bytes(self._bytes, None, keywords)
        scene._read()
        return scene

    def _read(self):
        known = _options.table("info")
        given = {k: v for k, v in self._keywords.items() if k in known}
        arguments = [self._file(), *_options.arguments("info", given, _worker.place)]
        self._facts = _worker.run("info", [*arguments, "--json"])
        self._facts["warnings"] = [_options.in_keywords(sentence) for sentence in self._facts["warnings"]]

    def _known(self, key):
        if not self._facts:
            self._read()
        return self._facts[key]

    def _file(self):
        """Returns the file for the worker. For arrays, writes it again if it is gone or another process owns it."""
        if self._bytes is None:
            return self._path
        if self._owned != os.getpid() or not os.path.exists(self._path):
            self._path, self._owned = _arrays.place("mesh.safetensors"), os.getpid()
            with open(self._path, "xb") as file:
                file.write(self._bytes)
            weakref.finalize(self, _remove, self._path, self._owned)
        return self._path

    def _arguments(self, verb):
        """Returns the scene's arguments for a verb."""
        if verb not in self._given:
            known = _options.table(verb)
            if "normalize" in self._keywords and "normalize" not in known:
                hint = "use the scene as it is in its file"
                raise Error("usage", f"{verb} cannot normalize scenes", "normalize", hint)
            given = {k: v for k, v in self._keywords.items() if k in known and k != "strict"}
            self._given[verb] = _options.arguments(verb, given, _worker.place)
        return [self._file(), *self._given[verb]]

    @property
    def bounds(self):
        """(2, 3) float64: the bounding box's lower and upper corner, world space; None if the scene shows nothing"""
        bounds = self._known("bounds")
        return None if bounds is None else np.array([bounds["min"], bounds["max"]], np.float64)

    @property
    def cameras(self):
        """Names of the cameras, in draw order, for `camera`"""
        return [camera["name"] for camera in self._known("cameras")]

    @property
    def nodes(self):
        """Names of the nodes; the id of a node is its index + 1"""
        return list(self._known("objectNames"))

    @property
    def materials(self):
        """Names of the materials; the id of a material is its index + 1. The last is glTF's default material"""
        return list(self._known("materialNames"))

    @property
    def animations(self):
        """Names of the animations, for `animation`"""
        return [animation["name"] for animation in self._known("animations")]

    @property
    def variants(self):
        """Names of the material variants"""
        return list(self._known("variants"))

    @property
    def warnings(self):
        """The reader's warnings about content that it ignored, in sentences"""
        return list(self._known("warnings"))

    @property
    def name(self):
        """Name of the file; '' for arrays"""
        return self._name

    def __reduce__(self):
        if self._bytes is not None:
            return _of_bytes, (bytes(self._bytes), None, self._keywords)
        return _of_file, (self._path, self._name, self._keywords, self._facts)

    def __repr__(self):
        named = repr(self._name) if self._name else "from arrays"
        counts = (("triangles", self._known("triangles")), ("nodes", len(self.nodes)),
                  ("materials", len(self.materials) - 1), ("cameras", len(self.cameras)))
        text = ", ".join(f"{count} {noun}" for noun, count in counts)
        return f"<peeler.Scene {named}: {text}{f', {len(self.animations)} animations' if self.animations else ''}>"


def _remove(path, process):
    if process == os.getpid():
        _arrays.remove(path)


def _bare():
    scene = Scene.__new__(Scene)
    scene._keywords, scene._given, scene._facts = {}, {}, None
    return scene


def _of_file(path, name, keywords, facts):
    scene = _bare()
    scene._path, scene._name, scene._keywords, scene._facts = path, name, keywords, facts
    scene._bytes = scene._owned = None
    return scene


def _of_bytes(data, path, keywords):
    scene = _bare()
    scene._keywords = keywords
    scene._bytes, scene._path, scene._name = data, path, ""
    scene._owned = os.getpid() if path else None
    if path:
        weakref.finalize(scene, _remove, path, scene._owned)
    return scene


Scene.__module__ = "peeler"
