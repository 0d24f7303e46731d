# SPDX-License-Identifier: Apache-2.0
"""Hits of rays, and results computed from them."""

import json

import numpy as np

from . import _arrays, _options, _worker
from ._error import Error
from ._images import Image

_BUNDLE = ("origin", "direction", "right", "up", "size")
_AXES = ("axis_x", "axis_y", "axis_z")


class Hits:
    """All hits of bundles of rays in CSR form: ray r has the hits splits[r] up to splits[r + 1], nearest first. Rays
    are ordered by bundle, then row by row. hits[name] is a column, with the name and values of
    `peeler rays -o hits.npz`: t_hit (distance from the ray's start), geometry_ids, primitive_ids, primitive_uvs,
    facing, normals, primitive_normals, node_ids, mesh_ids, instance_ids, material_ids; base_color if it is named.
    """

    def __init__(self, data, traced, columns):
        self._arrays, _ = _arrays.parse(data)
        self._traced = traced
        named = ["ray_splits", "arrays_version"]
        self._columns = [n for n in self._arrays if n not in named and not n.startswith("bundle_")]
        order = _options.table("rays")["columns"][1]["choices"]
        self._columns.sort(key=order.index)
        if columns is not None:
            self._columns = [name for name in self._columns if name in columns]
        perspective = self._arrays["bundle_perspective"]
        self._windows = self._arrays["bundle_window"]
        rays = self._windows[:, 2] * self._windows[:, 3]
        self._first_rays = np.concatenate(([0], np.cumsum(rays)))
        self._z = self._arrays["t_hit"]
        if perspective.any() and not traced.through_lens:
            self._z = np.concatenate([self._depths(i) for i in range(len(perspective))])
        self._images = None

    def _depths(self, i):
        """Returns the depths of a bundle's hits along its direction."""
        first, last = self._first_rays[i : i + 2]
        splits = self.splits[first : last + 1]
        t = self._arrays["t_hit"][splits[0] : splits[-1]]
        if self._arrays["bundle_perspective"][i] != 1:
            return t
        width, height = self._arrays["bundle_resolution"][i]
        x0, y0, columns, rows = self._windows[i]
        size = self._arrays["bundle_size"][i]
        x = ((np.arange(columns) + x0 + 0.5) / width - 0.5) * size[0]
        y = ((np.arange(rows) + y0 + 0.5) / height - 0.5) * size[1]
        lengths = np.sqrt(1 + x[None, :] ** 2 + y[:, None] ** 2).ravel()
        return (t / np.repeat(lengths, np.diff(splits))).astype(np.float32)

    @property
    def splits(self):
        """(rays + 1,) int64: where the hits of each ray begin; no copy"""
        return self._arrays["ray_splits"]

    @property
    def z(self):
        """(n,) float32: depth along the bundle's direction (of lenses, moving cameras and lists: t), scene units"""
        return self._z

    @property
    def t(self):
        """(n,) float32: distance from the ray's start, scene units"""
        return self._arrays["t_hit"]

    @property
    def columns(self):
        """Names of the columns"""
        return list(self._columns)

    @property
    def bundles(self):
        """A list with a dict per bundle: name, parallel, origin, direction, right, up, size (scene units), shape (rows,
        columns of rays)"""
        found = []
        for i, window in enumerate(self._windows):
            entry = {"name": self._name(i), "parallel": not self._arrays["bundle_perspective"][i]}
            entry.update((key, np.array(self._arrays[f"bundle_{key}"][i])) for key in _BUNDLE)
            entry["size"] = tuple(float(side) for side in entry["size"])
            entry["shape"] = (int(window[3]), int(window[2]))
            found.append(entry)
        return found

    def _name(self, i):
        if self._arrays["bundle_perspective"][i]:
            return "camera"
        axis = i - len(self._windows) + len(_AXES)  # the axes come last
        return _AXES[axis] if self._traced.axes and axis >= 0 else f"bundle_{i:03}"

    @property
    def images(self):
        """The hits of each bundle as an Image, with dense(), counts and so on; its channels are the columns"""
        if self._images is None:
            self._images = [self._image(i) for i in range(len(self._windows))]
        return list(self._images)

    def _image(self, i):
        first, last = self._first_rays[i : i + 2]
        splits = self.splits[first : last + 1]
        hits = slice(splits[0], splits[-1])
        arrays = {name: self._arrays[name][hits] for name in self._columns}
        arrays.update(z=self._z[hits], splits=splits - splits[0] if splits[0] else splits)
        x, y, width, height = (int(n) for n in self._windows[i])
        metadata = {
            "dataWindow": json.dumps([x, y, width, height]),
            "displayWindow": json.dumps([int(n) for n in self._arrays["bundle_resolution"][i]]),
            "peeler:channels": json.dumps({name: [name] for name in self._columns}),
        }
        return Image(arrays, metadata)

    def __len__(self):
        return len(self._arrays["t_hit"])

    def __getitem__(self, column):
        """A column of all hits, bundle after bundle, as in a .npz of `peeler rays`; no copy"""
        if column not in self._columns:
            raise KeyError(f"no column '{column}'; there are {', '.join(self._columns)}")
        return self._arrays[column]

    def next_to(self, points):
        """next_to(points) -> dict

        Distances from each point (n, 3; world space) to the next hits before and after it along every parallel bundle:
        t_before, t_after (bundles, n) float64, inf = no hit. Traces the rays again.
        """
        points = np.asarray(points, np.float64)
        if points.ndim != 2 or points.shape[1] != 3:
            raise Error("usage", "expected an array of shape (n, 3)", "points")
        path = _arrays.place("points.npz")
        try:
            np.savez(path, points=points)
            _, data = self._traced.again([f"--points={path}"])
        finally:
            _arrays.remove(path)
        arrays, _ = _arrays.parse(data)
        return {name: arrays[name].astype(np.float64) for name in ("t_before", "t_after")}

    def save(self, path, *, double=False):
        """save(path, *, double=False)

        Writes .npz, .safetensors, .ply or .exr, as `peeler rays` does. Traces the rays again.
        """
        path = _worker.place(_options.path_of(path))
        asked = [f"--output={path}", *(["--double"] if double else [])]
        columns = self._columns
        if len(columns) < len(_options.table("rays")["columns"][1]["choices"]):
            asked.append("--columns=" + ",".join(columns))
        _worker.run("rays", [*self._traced.arguments, *asked])

    def __repr__(self):
        bundles = len(self._windows)
        noun = "bundle" if bundles == 1 else "bundles"
        return f"<peeler.Hits of {len(self.splits) - 1} rays in {bundles} {noun}: {len(self)} hits>"


class Traced:
    """A call of `peeler rays` that can be repeated."""

    def __init__(self, scene, arguments, axes):
        self._scene, self._arguments, self.axes = scene, arguments, axes

    @property
    def arguments(self):
        return [*self._scene._arguments("rays"), *self._arguments]

    @property
    def through_lens(self):
        """Whether the rays are not those of a pinhole, nor parallel"""
        other = ("--lens=", "--distortion=", "--rays=", "--shutter=")
        return any(text.startswith(other) and text != "--lens=pinhole" for text in self._arguments)

    def again(self, more, **keywords):
        return _arrays.run("rays", [*self.arguments, *more], **keywords)


def maps(result, data):
    """Returns the maps of each bundle as a dict."""
    arrays, _ = _arrays.parse(data)
    return [
        {c["name"]: arrays[f"{c['name']}.{i}"].astype(np.float32, copy=False) for c in entry["channels"]}
        for i, entry in enumerate(result["maps"])
    ]


def baked(data):
    """Returns the result of bake_scene()."""
    arrays, _ = _arrays.parse(data)
    found = {name: arrays[name] for name in ("values", "positions", "normals")}
    names = ("node", "instance", "primitive", "first", "count")
    found["ranges"] = [dict(zip(names, row)) for row in arrays["ranges"].tolist()]
    return found


Hits.__module__ = "peeler"
