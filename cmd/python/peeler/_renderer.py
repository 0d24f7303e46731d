# SPDX-License-Identifier: Apache-2.0
"""Renderer: pictures and rays of scenes, with the command line's options as keywords."""

import os
import threading
import weakref

import numpy as np

from . import _arrays, _images, _options, _rays, _worker
from ._error import Error
from ._scenes import Scene

_CAMERA = """Camera: camera (name or index), or eye, target, up, fov (degrees) or ortho_height; or K=(3, 3) in pixels
        (OpenCV: x right, y down, (0, 0) the centre of the first pixel; pixel_center=0.5 if that is at (0.5, 0.5), as in
        pyrender and COLMAP) and world_to_camera=(4, 4) (OpenCV: z forward), or gltf=(4, 4), camera to world as in glTF
        and pyrender (-Z forward, +Y up). near, far, size=(width, height), crop=(x, y, width, height), tile='1/4'.
        Time: animation, time (seconds).
        progress: called with the share of the work that is done, 0 to 1; an exception that it raises ends the work."""


def _documented(function):
    function.__doc__ = function.__doc__.replace("{camera}", _CAMERA)
    return function


def _matrix(name, value, shapes):
    try:
        array = np.asarray(value, np.float64)
    except (TypeError, ValueError):
        raise Error("usage", "expected an array of numbers", name) from None
    if array.shape not in shapes:
        raise Error("usage", f"expected an array of shape {' or '.join(map(str, shapes))}, not {array.shape}", name)
    if not np.isfinite(array).all():
        raise Error("usage", "expected finite numbers", name)
    return array


def _take_camera(given):
    """Replaces the keywords of calibrated cameras by intrinsics and pose; returns {option: keyword}."""
    k, world_to_camera, gltf, centre = (given.pop(name, None) for name in _options.CALIBRATED)
    names = {}
    if world_to_camera is not None and gltf is not None:
        raise Error("usage", "a camera has one pose", "world_to_camera, gltf", "leave one of them out")
    if world_to_camera is not None:
        given["pose"] = _matrix("world_to_camera", world_to_camera, [(4, 4), (3, 4)])
        names["pose"] = "world_to_camera"
    if gltf is not None:
        matrix, names["pose"] = _matrix("gltf", gltf, [(4, 4)]), "gltf"
        try:
            given["pose"] = np.diag([1.0, -1, -1, 1]) @ np.linalg.inv(matrix)
        except np.linalg.LinAlgError:
            raise Error("usage", "expected a rotation and a translation", "gltf") from None
    if k is None:
        if centre is not None:
            raise Error("usage", "a pixel centre needs K", "pixel_center", "add K")
        return names
    k, centre = _matrix("K", k, [(3, 3)]), 0 if centre is None else float(centre)
    if k[0, 1] or k[1, 0] or k[2, 0] or k[2, 1] or k[2, 2] != 1:
        raise Error("usage", "expected [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]", "K",
                    "skew and lens distortion are not rendered")
    given["intrinsics"] = [k[0, 0], k[1, 1], k[0, 2] - centre, k[1, 2] - centre]
    names["intrinsics"] = "K"
    return names


class Renderer:
    """Renderer(*, device='auto', backend='auto', memory=None, require_gpu=False, threads=None)

    Renders any number of pictures of any number of scenes. All GL work happens in a separate process, a worker, which
    keeps scenes and devices open between calls and leaves this process untouched. Use the Renderer in a `with` block, or
    call close(). Calls from several threads wait for each other; two Renderers may render at the same time. Other
    Python threads run meanwhile. Ctrl-C ends a render, and the Renderer stays usable. A forked process has a worker of
    its own, and so has a process that unpickles the Renderer.

    device: 'auto', or a device as peeler.devices() lists it: 3, 'cuda:1', 'uuid:8932f937'
    memory: maximum number of bytes that a call may use: '2G', 512_000_000
    threads: number of threads that a call may use
    """

    def __init__(self, **keywords):
        _options.check("Renderer", keywords)
        if isinstance(keywords.get("device"), str) and keywords["device"] == "auto":
            keywords["device"] = None  # the default of the command line
        for keyword, value in keywords.items():
            choices = _options.keywords("Renderer")[keyword][1]["choices"]
            if value is not None and choices and value not in choices:
                raise Error("usage", f"unknown {keyword} {value!r}", keyword, "choose one of: " + ", ".join(choices))
        self._keywords, self._arguments = keywords, {}
        self._machine("render")  # refuses values other than numbers and texts
        self._device = None
        self._closed = False
        self._begin()

    def _begin(self):
        self._process, self._lock, self._user = os.getpid(), threading.Lock(), None
        _worker.open_user()
        self._end = weakref.finalize(self, _worker.close_user, self._process)

    def _machine(self, verb):
        if verb not in self._arguments:
            known = _options.table(verb)
            self._arguments[verb] = _options.arguments(verb, {k: v for k, v in self._keywords.items() if k in known})
        return self._arguments[verb]

    def _use(self):
        """Checks that a call may start. Raises Error if the Renderer is closed, or called from its own callback."""
        if self._closed:
            raise Error("usage", "the Renderer is closed", "Renderer")
        if self._process != os.getpid():  # forked
            self._end.detach()
            self._begin()
        if self._user == threading.get_ident():
            raise Error("usage", "a callback cannot use the Renderer that calls it", "progress",
                        "use another Renderer in the callback")
        return self

    def __reduce__(self):
        return _renderer, (self._keywords,)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        """Closes the Renderer; the last one also ends the worker, which releases the device."""
        self._closed = True
        self._end()

    @property
    def device(self):
        """GL_RENDERER of the device. Raises peeler.Error of kind 'device' if there is no usable one"""
        if self._device is None:
            dot = Scene.from_arrays(np.zeros((3, 3)))
            self._device = self.layers(dot, size=(1, 1), eye=(0, 0, 1)).renderer
        return self._device

    def _run(self, call, verb, scene, arguments, **keywords):
        if not isinstance(scene, Scene):
            raise TypeError(f"expected a peeler.Scene, not {type(scene).__name__}")
        self._use()
        with self._lock:
            self._user = threading.get_ident()
            try:
                told = scene._facts["warnings"] if scene._facts else ()
                job = [*scene._arguments(verb), *self._machine(verb), *arguments]
                return call(verb, job, known_warnings=told, **keywords)
            finally:
                self._user = None

    def _picture(self, call, scene, kind, given):
        self._use()
        _options.check(call, given, (*_options.CALIBRATED, "progress"))
        progress = given.pop("progress", None)
        names = _take_camera(given)
        if given.pop("cryptomatte", False):  # needs ids
            channels = given.get("channels") or []
            channels = channels.split(",") if isinstance(channels, str) else list(channels)
            if "id" not in channels and channels != ["all"]:
                given["channels"] = [*channels, "id"]
        arguments = _options.arguments("render", given, _worker.place)
        _, data = self._run(_arrays.run, "render", scene, [f"--as={kind}", *arguments], progress=progress, names=names)
        return data

    @_documented
    def layers(self, scene, **keywords):
        """layers(scene, **keywords) -> Image

        All fragments of every pixel, sorted by depth. Keywords are those of `peeler render`.

        {camera}
        Layers: method, layers (nearest ones), occlusion_ratio, samples, surfaces, faces, shading, point_size, precision
        ('half', 'float'); clip_box, clip_plane, clip_mesh, clip; shadows, shadow_size; channels: a list of normal,
        geometric-normal, position, uv, tangent, base-color, emissive, roughness-metallic, facing, motion, id,
        barycentric, distance; or 'all'.

        Raises peeler.Error: 'usage', 'device', 'memory'. The Renderer stays usable after an error.
        """
        return _images.image(self._picture("layers", scene, "layers", keywords))

    @_documented
    def composite(self, scene, **keywords):
        """composite(scene, **keywords) -> Composite

        The same picture as layers() followed by flatten(), but without storing layers. method takes 'dual' and so on, and also
        approximations ('weighted-average', 'weighted-sum', 'weighted-blended', 'moment-based', 'unsorted').

        {camera}
        The other keywords are those of layers(), without channels, and tail ('drop', 'blend'), shade_per ('sample', 'pixel',
        'auto').
        """
        return _images.composite(self._picture("composite", scene, "composite", keywords))

    def _trace(self, call, scene, given, more=()):
        """Returns (arguments, progress, {option: keyword}) of a call that traces rays."""
        self._use()
        _options.check(call, given, (*_options.CALIBRATED, "progress", *more))
        progress = given.pop("progress", None)
        names = _take_camera(given)
        return _options.arguments("rays", given, _worker.place), progress, names

    @_documented
    def rays(self, scene, **keywords):
        """rays(scene, **keywords) -> Hits

        All hits of bundles of rays: direction=(x, y, z) or a list of them, directions=N (over the sphere), hemisphere,
        directions_file, axes=True, or a camera's pixels. resolution (rays along the longer side), spacing, bounds;
        refine, faces, engine ('auto', 'cpu', 'gl'), columns (names of Hits, or 'all').

        {camera}
        """
        columns = keywords.pop("columns", None)
        arguments, progress, names = self._trace("hits", scene, dict(keywords), ("columns",))
        traced = _rays.Traced(scene, [*self._machine("rays"), *arguments], keywords.get("axes"))
        if columns is not None and columns != "all":
            columns = columns.split(",") if isinstance(columns, str) else list(columns)
            arguments = [*arguments, "--columns=" + ",".join({str(c): 0 for c in ["t_hit", *columns]})]
        else:
            columns = None
        _, data = self._run(_arrays.run, "rays", scene, arguments, progress=progress, names=names)
        return _rays.Hits(data, traced, columns)

    def ray_maps(self, scene, **keywords):
        """ray_maps(scene, *, map, attenuation=None, part=None, **rays) -> list of dict

        Maps of each bundle by name, (height, width) float32: first, last (inf without hits), count, thickness,
        path-length (path.MATERIAL), transmission (attenuation={'steel': mu}), parity, overlap (part=['A*', 'B*']),
        base-color (R, G, B, A: a picture without light, linear, premultiplied).
        Lengths in scene units. The rays are those of rays().
        """
        if keywords.get("map") is None or keywords["map"] in ("", [], ()):
            _options.check("ray_maps", keywords, (*_options.CALIBRATED, "progress"))
            raise Error("usage", "no map is given", "map", "give map=['thickness'], or first, last, count, "
                        "path-length, transmission, parity, overlap, base-color")
        arguments, progress, names = self._trace("ray_maps", scene, keywords)
        result, data = self._run(_arrays.run, "rays", scene, arguments, progress=progress, names=names)
        return _rays.maps(result, data)

    def voxels(self, scene, voxels, **keywords):
        """voxels(scene, voxels, *, bounds=None, ...) -> dict

        The cells of a lattice that are inside; its longest side has `voxels` cells. The dict has occupancy and votes (uint8,
        (nx, ny, nz)), corner (3,), spacing, occupied, disputed, volume; scene units.
        """
        arguments, progress, names = self._trace("voxels", scene, keywords)
        asked = [*arguments, f"--voxels={voxels}"]
        result, data = self._run(_arrays.run, "rays", scene, asked, progress=progress, names=names)
        arrays, _ = _arrays.parse(data)
        found = {name: arrays[name] for name in ("occupancy", "votes")}
        found["corner"] = arrays["corner"].reshape(3)
        found.update((key, result["voxels"][key]) for key in ("spacing", "occupied", "disputed", "volume"))
        return found

    def parity(self, scene, **keywords):
        """parity(scene, **rays) -> dict

        Whether rays leave every surface that they enter: holds, rays, odd_rays, and the solids with node, open_edges,
        odd_rays and so on.
        """
        arguments, progress, names = self._trace("parity", scene, keywords)
        line = self._run(_run_quietly, "rays", scene, [*arguments, "--parity=report"], progress=progress, names=names)
        found = line["parity"]
        keys = {"node": "node", "node_index": "nodeIndex", "instance": "instance", "triangles": "triangles",
                "open_edges": "openEdges", "rays": "rays", "odd_rays": "oddRays"}  # fmt: skip
        solids = [{ours: solid[theirs] for ours, theirs in keys.items()} for solid in found["solids"]]
        return {"holds": found["holds"], "rays": line["rays"], "odd_rays": found["oddRays"], "solids": solids}

    def __repr__(self):
        return "<peeler.Renderer, closed>" if self._closed else "<peeler.Renderer>"


def _renderer(keywords):
    return Renderer(**keywords)


def _run_quietly(verb, arguments, known_warnings=(), **keywords):
    """Runs a verb without showing its warnings, which the result contains, too."""
    return _worker.run(verb, arguments, known_warnings=_Everything(), **keywords)


class _Everything:
    def __contains__(self, _):
        return True


def check_scene(scene, *, together=False, unit=1.0, min_wall=None, weld=None, progress=None):
    """check_scene(scene, *, together=False, unit=1.0, min_wall=None, weld=None, progress=None) -> dict

    Whether the scene's parts can be printed; a dict like the result of `peeler check --json`. unit: metres per scene
    unit; min_wall, weld: millimetres.
    """
    if scene._keywords.get("unit") is not None:
        raise Error("usage", "the Scene already has a unit", "unit", "open the Scene without unit, and give it here")
    given = {"together": together, "unit": unit, "min_wall": min_wall, "weld": weld}
    arguments = [*scene._arguments("check"), *_options.arguments("check", given)]
    return _run_quietly("check", arguments, progress=progress)


def bake_scene(scene, **keywords):
    """bake_scene(scene, *, quantity='ao', directions=256, resolution=512, max_distance=None, bounces=None,
    faces='both', animation=None, time=None, progress=None) -> dict

    Bakes a quantity (ao, bent-normal, sky-visibility, thickness or irradiance) at every vertex: values (n, 1 or 3)
    float32, positions and normals (n, 3) of the vertices in world space, and ranges, the vertices (first, count) of
    each node, instance and primitive.
    """
    progress = keywords.pop("progress", None)
    if keywords.get("output") is not None:
        raise Error("usage", "bake_scene() returns values and writes no file", "output", "write files with peeler.bake()")
    for keyword in ("target", "size", "padding", "uv"):
        if keywords.get(keyword) is not None:
            raise Error("usage", "bake_scene() returns vertex values only", keyword, "write textures with peeler.bake()")
    _options.check("bake_scene", keywords, ("output", "target", "size", "padding", "uv"))
    given = {k: v for k, v in keywords.items() if v is not None}
    arguments = [*scene._arguments("bake"), "--engine=cpu", "--target=vertices", *_options.arguments("bake", given)]
    _, data = _arrays.run("bake", arguments, progress=progress)
    return _rays.baked(data)


for _thing in (Renderer, check_scene, bake_scene):
    _thing.__module__ = "peeler"
