# SPDX-License-Identifier: Apache-2.0
"""Pictures: layers and composites as arrays, operations on them, and their files."""

import json
import os

import numpy as np

from . import _arrays, _options, _worker
from ._error import Error

_DISPLAY = (".png", ".jpg", ".jpeg", ".tif", ".tiff")
_MOST_SHOWN = 1024  # pixels a side of a picture in a notebook


class _Picture:
    """Base of both kinds of pictures. The arrays are views of the bytes that the worker wrote."""

    def __init__(self, arrays, metadata):
        self._arrays, self._metadata = arrays, metadata
        x, y, width, height = json.loads(metadata["dataWindow"])
        self._window = (x, y, x + width, y + height)
        self._display = tuple(json.loads(metadata["displayWindow"]))
        camera = metadata.get("peeler:cameraJson")
        self._camera = json.loads(camera) if camera else None

    @property
    def shape(self):
        """(height, width) in pixels"""
        x0, y0, x1, y1 = self._window
        return y1 - y0, x1 - x0

    @property
    def size(self):
        """(width, height) in pixels"""
        return self.shape[::-1]

    @property
    def window(self):
        """(x0, y0, x1, y1): the pixels of the display window that the picture covers"""
        return self._window

    @property
    def display(self):
        """(width, height) of the display window; the camera's axis goes through its centre"""
        return self._display

    @property
    def K(self):
        """(3, 3) float64, pixels: x right, y down, (0, 0) the centre of the first pixel (OpenCV);
        None for an orthographic or unknown camera"""
        camera = self._camera
        if not camera or camera["projection"] != "perspective":
            return None
        (width, height), sample = self._display, camera.get("sample", (0.5, 0.5))
        fx, fy = width / (2 * camera["halfWidth"]), height / (2 * camera["halfHeight"])
        cx, cy = width / 2 - sample[0] - self._window[0], height / 2 - sample[1] - self._window[1]
        return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]], np.float64)

    @property
    def world_to_camera(self):
        """(4, 4) float64: world to camera, with x right, y down, z forward (OpenCV); None if unknown"""
        if not self._camera:
            return None
        matrix = np.linalg.inv(self.gltf)
        matrix[1:3] = -matrix[1:3] + 0.0
        return matrix

    @property
    def gltf(self):
        """(4, 4) float64: the camera's pose as in glTF and pyrender, camera to world, looking along -Z with +Y up;
        None if unknown"""
        return np.array(self._camera["cameraToWorld"], np.float64).reshape(4, 4) if self._camera else None

    @property
    def near(self):
        """Distance of the near plane, scene units"""
        return self._camera["near"] if self._camera else 0.0

    @property
    def far(self):
        """Distance of the far plane, scene units; may be inf"""
        far = self._camera["far"] if self._camera else None
        return np.inf if far is None else far

    @property
    def camera(self):
        """Name of the scene's camera; '' for any other camera"""
        return self._camera["name"] if self._camera else ""

    @property
    def renderer(self):
        """GL_RENDERER of the device"""
        return self._metadata.get("peeler:renderer", "")

    @property
    def _source(self):
        scene = self._metadata.get("peeler:scene")
        return f" of '{scene}'" if scene else ""

    def _written(self):
        """Writes the picture to a file for the worker; the caller removes it."""
        path = _arrays.place()
        try:
            _arrays.write(path, self._arrays, self._metadata)
        except BaseException:
            _arrays.remove(path)
            raise
        return path

    def _run(self, verb, arguments, **keywords):
        """Runs a verb on the picture. Returns the resulting arrays."""
        path = self._written()
        try:
            return _arrays.run(verb, [path, *arguments], **keywords)
        finally:
            _arrays.remove(path)

    def _save(self, verb, path, keywords, option="--output"):
        source = self._written()
        try:
            arguments = _options.arguments(verb, keywords, _worker.place)
            _worker.run(verb, [source, f"{option}={_worker.place(path)}", *arguments])
        finally:
            _arrays.remove(source)


class Composite(_Picture):
    """A flat picture: premultiplied linear RGBA without a background, and the nearest depth."""

    @property
    def rgba(self):
        """(height, width, 4) float32: linear Rec. 709, premultiplied; no copy"""
        return self._arrays["rgba"]

    @property
    def z(self):
        """(height, width) float32: camera Z of the nearest fragment, scene units; inf = no fragment; no copy"""
        return self._arrays["z"]

    def __array__(self, dtype=None, copy=None):
        """The colours"""
        array = self.rgba
        return array.astype(dtype or array.dtype) if copy or (dtype and dtype != array.dtype) else array

    def save(self, path, **keywords):
        """save(path, *, background=, exposure=, tone_map=, ...)

        Writes .exr, .png, .jpg, .tif, .npz or .safetensors, with the keywords of `peeler flatten`. By default,
        a .png, .jpg or .tif gets a suitable exposure and the neutral tone map.
        """
        _options.check("save", keywords)
        path = _options.path_of(path)
        given = {k: v for k, v in keywords.items() if v is not None and v is not False}
        if given.pop("as_", "composite") != "composite":
            raise Error("usage", "a composite has no layers", path, "render them with layers()")
        self._refuse(path, given)
        self._save("flatten", path, given)

    @staticmethod
    def _refuse(path, given):
        """Raises Error for keywords that apply to layers only."""
        for keyword in given:
            if keyword not in _options.table("flatten"):
                raise Error("usage", "a composite has no layers", keyword, f"leave it out for {path}")

    def _written(self):
        """Writes the picture as one layer: one fragment in every covered pixel."""
        shown = np.isfinite(self.z).ravel()
        arrays = {"splits": np.concatenate(([0], np.cumsum(shown))), "z": self.z.ravel()[shown]}
        for name in ("rgba", "opacity"):
            if name in self._arrays:
                array = self._arrays[name]
                arrays[name] = array.reshape(-1, array.shape[2])[shown]
        metadata = {**self._metadata, "peeler:arrays": "layers"}
        metadata.update((key, str(len(arrays["z"]))) for key in ("peeler:fragmentsCounted", "peeler:fragmentsStored"))
        return Image(arrays, metadata)._written()

    def _repr_png_(self):
        return _png(self)

    def __repr__(self):
        return "<peeler.Composite {} x {}{}>".format(*self.size, self._source)


class Image(_Picture):
    """Layers: all fragments of every pixel, front to back, in CSR form.

    Pixel p (row-major) has the fragments splits[p] up to splits[p + 1]. Arrays are views of the picture, never copies;
    writing to them changes the picture.
    """

    def __init__(self, arrays, metadata):
        super().__init__(arrays, metadata)
        splits = arrays["splits"]
        if splits.dtype != np.uint32 and metadata.get("peeler:arrays") == "layers":
            arrays["splits"] = splits.astype(np.uint32)  # a copy of only one number per pixel
        self._names = json.loads(metadata.get("peeler:channels", "{}"))  # component names, by channel

    @property
    def z(self):
        """(n,) float32: camera Z, positive in front, scene units; no copy"""
        return self._arrays["z"]

    @property
    def rgba(self):
        """(n, 4) float16, or float32 with precision='float': linear Rec. 709, premultiplied; no copy. None for rays"""
        return self._arrays.get("rgba")

    @property
    def opacity(self):
        """(n, 3): opacity per colour channel if there is coloured glass, else None; no copy"""
        return self._arrays.get("opacity")

    @property
    def splits(self):
        """(height * width + 1,) uint32: where each pixel's fragments begin"""
        return self._arrays["splits"]

    @property
    def channels(self):
        """Names of the channels"""
        return list(self._names)

    @property
    def layers(self):
        """The largest number of fragments in a pixel"""
        return int(self._counts.max(initial=0))

    @property
    def complete(self):
        """Whether all fragments are stored"""
        return int(self._metadata.get("peeler:fragmentsCounted", len(self))) == len(self)

    @property
    def counts(self):
        """(height, width) uint32: number of fragments of every pixel (a new array)"""
        return self._counts.reshape(self.shape).astype(np.uint32)

    @property
    def objects(self):
        """Names of the nodes by id - 1, if there are ids"""
        return self._ids("objects")

    @property
    def materials(self):
        """Names of the materials by id - 1, if there are ids"""
        return self._ids("materials")

    def _ids(self, kind):
        return json.loads(self._metadata.get("peeler:ids", "{}")).get(kind, [])

    @property
    def _counts(self):
        return np.diff(self.splits.astype(np.int64))

    def _places(self):
        """Returns each fragment's index within its pixel."""
        splits = self.splits.astype(np.int64)
        return np.arange(len(self)) - np.repeat(splits[:-1], np.diff(splits))

    def __len__(self):
        return len(self.z)

    def __getitem__(self, channel):
        """A channel by name ('normal', 'id'): (n, components), or (n,) for one component; or a component by its name in
        files ('N.X', 'id.object'). float16 or float32, ids uint32 (index + 1). No copy"""
        if channel in self._names or channel in ("z", "rgba", "opacity") and channel in self._arrays:
            return self._arrays[channel]
        for name, components in self._names.items():
            if channel in components:
                array = self._arrays[name]
                return array if array.ndim == 1 else array[:, components.index(channel)]
        there = ", ".join(["z", *(["rgba"] if "rgba" in self._arrays else []), *self._names])
        raise KeyError(f"no channel '{channel}'; there are {there}")

    def __contains__(self, channel):
        try:
            self[channel]
            return True
        except KeyError:
            return False

    def dense(self, layers=None, channel="z", fill=None):
        """dense(layers=None, channel='z', fill=None)

        (height, width, layers), or (height, width, layers, components): the k-th fragment of every pixel at [..., k],
        `fill` where a pixel has fewer (default: NaN for z, else 0). layers=None: all
        """
        values, counts = self[channel], self._counts
        depth = self.layers if layers is None else int(layers)
        if depth < 0:
            raise Error("usage", "expected a number of layers", "layers")
        if fill is None:
            fill = np.nan if channel == "z" else 0
        dense = np.full((len(counts), depth, *values.shape[1:]), fill, values.dtype)
        if len(counts) and counts.max() > depth:
            values = values[self._places() < depth]
        dense[np.arange(depth) < counts[:, None]] = values
        return dense.reshape(*self.shape, *dense.shape[1:])

    def positions(self):
        """(n, 3) float32: every fragment's position in world space (a new array)"""
        if not self._camera:
            raise Error("input", "the picture has no camera", "positions")
        camera, (x0, y0, x1, _) = self._camera, self._window
        width, height = self._display
        sample = camera.get("sample", (0.5, 0.5))
        pixels = np.repeat(np.arange(len(self.splits) - 1), self._counts)
        rows, columns = np.divmod(pixels, x1 - x0)
        z = self.z.astype(np.float64)
        scale = z if camera["projection"] == "perspective" else 1.0
        x = camera["halfWidth"] * (2 * (columns + x0 + sample[0]) / width - 1) * scale
        y = camera["halfHeight"] * (1 - 2 * (rows + y0 + sample[1]) / height) * scale
        matrix = self.gltf
        places = np.stack((x, y, -z), axis=1) @ matrix[:3, :3].T + matrix[:3, 3]
        return places.astype(np.float32)

    def _kept(self, chosen, counts):
        """Returns the chosen fragments as an Image."""
        arrays = {name: array[chosen] if array.ndim else array for name, array in self._arrays.items() if name != "splits"}
        arrays["splits"] = np.concatenate(([0], np.cumsum(counts))).astype(self.splits.dtype)
        metadata = {k: v for k, v in self._metadata.items() if k not in ("peeler:outputHash", "peeler:layers")}
        metadata["peeler:fragmentsStored"] = str(len(arrays["z"]))
        metadata.setdefault("peeler:fragmentsCounted", str(len(self)))
        return Image(arrays, metadata)

    def layer(self, k):
        """layer(k): the k-th fragment of every pixel, where there is one, as an Image"""
        return self._kept(self._places() == k, self._counts > k)

    def nearest(self, layers):
        """nearest(layers): the nearest fragments of every pixel, as an Image"""
        return self._kept(self._places() < layers, np.minimum(self._counts, layers))

    def flatten(self, layers=None, tail="drop"):
        """flatten(layers=None, tail='drop')

        The composite of all layers, or of the nearest `layers`, front to back, in 32-bit floats. Fragments behind these
        layers are left out, or blended as a weighted average with tail='blend'.
        """
        arguments = []
        if layers:
            arguments = [f"--layers={layers}", f"--tail={tail}"]
        elif tail not in ("drop", "blend"):
            raise Error("usage", f"unknown tail {tail!r}", "tail", "choose one of: drop, blend")
        _, data = self._run("flatten", arguments)
        return composite(data)

    def save(self, path, **keywords):
        """save(path, *, as_=, layout=, compression=, deep_merge=, ...)

        Writes .exr (layers, as_='deep' or as_='composite'), .html, .png, .jpg, .tif or .safetensors, with the keywords
        of `peeler render`, or .npz (dense=, fill=) or .ply, as `peeler extract` does.
        """
        _options.check("save", keywords)
        path = _options.path_of(path)
        given = {k: v for k, v in keywords.items() if v is not None and v is not False}
        kind = os.path.splitext(path)[1].lower()
        if "rgba" not in self._arrays:
            raise Error("usage", "hits have no colours", path, "write them with Hits.save()")
        if kind == ".ply" or (kind == ".npz" and "dense" not in given):
            for keyword in given:
                if keyword not in ("no_clobber", "no_mkdir"):
                    raise Error("usage", "arrays and points do not have this option", keyword, "leave it out")
            self._save("extract", path, given, "--points" if kind == ".ply" else "--npz")
        elif kind in _DISPLAY or given.get("as_") == "composite":
            given.pop("as_", None)
            Composite._refuse(path, given)
            self._save("flatten", path, given)
        elif "dense" in given:
            self._save("merge", path, given)
        else:
            known = _options.table("convert")
            for keyword in given:
                if keyword not in known:
                    hint = "add as_='composite', or leave it out"
                    raise Error("usage", "layers are stored as rendered", keyword, hint)
            self._save("convert", path, given)

    def _repr_png_(self):
        return _png(self.flatten()) if "rgba" in self._arrays else None

    def __repr__(self):
        text = "<peeler.Image {} x {}{}".format(*self.size, self._source)
        text += f": {self.layers} layers, {len(self)} fragments"
        text += "".join(f", {name}" for name in self._names)
        return text + (">" if self.complete else ", incomplete>")


def image(data):
    """Returns a file's bytes as an Image."""
    return Image(*_arrays.parse(data))


def composite(data):
    return Composite(*_arrays.parse(data))


def _png(picture):
    """Returns a PNG for Jupyter, at most about 1000 pixels per side; averages the pixels of larger pictures."""
    height, width = picture.shape
    step = max(1, (max(width, height) - 1) // _MOST_SHOWN + 1)
    rows, columns = max(1, height // step), max(1, width // step)
    rgba = picture.rgba[: rows * step, : columns * step]
    if step > 1 and rgba.shape[:2] == (rows * step, columns * step):
        rgba = rgba.reshape(rows, step, columns, step, 4).mean(axis=(1, 3), dtype=np.float32)
    rgba = np.ascontiguousarray(rgba[:rows, :columns])
    metadata = {
        "peeler:arrays": "composite",
        "dataWindow": json.dumps([0, 0, columns, rows]),
        "displayWindow": json.dumps([columns, rows]),
    }
    shown = Composite({"rgba": rgba, "z": np.zeros((rows, columns), np.float32)}, metadata)
    path = _arrays.place("shown.png")
    try:
        shown.save(path)
        with open(path, "rb") as file:
            return file.read()
    finally:
        _arrays.remove(path)


def read(path, **keywords):
    """read(path, *, part=None, view=None, strict=False)

    Reads an .exr or .safetensors of peeler in any layout, a deep .exr of any program, or a flat .exr as one layer;
    returns an Image. In other programs' files, part selects a part or a layer of channels, and view a view. With
    strict, a warning is an error. Raises peeler.Error of kind 'input'.
    """
    _options.check("read", keywords)
    arguments = _options.arguments("convert", keywords)
    _, data = _arrays.run("convert", [_worker.file_argument(path), "--as=layers", *arguments])
    return image(data)


def merge_images(images, elements=False):
    """merge_images(images, elements=False)

    Joins the tiles of one picture. With elements=True, merges the fragments of several pictures of one camera by depth.
    """
    images = list(images)
    if not images:
        raise Error("usage", "no images are given", "images")
    paths = []
    try:
        for each in images:
            paths.append(each._written())
        _, data = _arrays.run("merge", [*paths, "--as=layers", *(["--elements"] if elements else [])])
        return image(data)
    finally:
        for path in paths:
            _arrays.remove(path)


def compare_images(a, b):
    """compare_images(a, b): the differences of two Images, as a dict like the result of `peeler compare --json`."""
    paths = []
    try:
        for each in (a, b):
            paths.append(each._written())
        found = _worker.run("compare", paths)
    finally:
        for path in paths:
            _arrays.remove(path)
    for name in ("a", "b"):
        found[name]["path"] = name
    return found


for _thing in (Composite, Image, read, merge_images, compare_images):
    _thing.__module__ = "peeler"
