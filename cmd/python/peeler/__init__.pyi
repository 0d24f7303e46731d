# SPDX-License-Identifier: Apache-2.0
"""Every layer of a glTF scene, headless, as NumPy arrays."""

from os import PathLike
from types import TracebackType
from typing import Any, Callable, Literal, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str

Path = str | bytes | PathLike[str]
Numbers = Sequence[float] | NDArray[Any]
Progress = Callable[[float], Any]
Method = Literal[
    "a-buffer", "front-to-back", "two-pass", "back-to-front", "dual", "dual-max",
    "weighted-average", "weighted-sum", "unsorted"
]
Channel = Literal[
    "normal", "geometric-normal", "position", "uv", "tangent", "base-color", "emissive",
    "roughness-metallic", "facing", "motion", "id", "barycentric", "distance", "all"
]

class Error(Exception):
    """Raised by everything in peeler."""

    kind: Literal["usage", "input", "output", "device", "incomplete", "memory", "internal"]
    what: str
    where: str
    hint: str
    def __init__(self, kind: str, what: str, where: str = ..., hint: str = ...) -> None: ...

class Scene:
    """What a file (glTF, PLY, STL, OBJ), or a mesh of arrays, shows. Right-handed, +Y up, scene units."""

    def __init__(
        self,
        path: Path,
        *,
        scene: str | int | None = ...,
        include: str | Sequence[str] | None = ...,
        exclude: str | Sequence[str] | None = ...,
        allow_outside: bool = ...,
        ignore_extension: str | Sequence[str] | None = ...,
        smooth_normals: float | None = ...,
        unit: Literal["m", "mm", "cm", "inch", "in"] | None = ...,
        up: Literal["x", "y", "z"] | None = ...,
        variant: str | int | None = ...,
        transmission: Literal["color", "alpha", "none"] | None = ...,
        environment: Path | None = ...,
        environment_rotation: float | None = ...,
        strict: bool = ...,
    ) -> None: ...
    @staticmethod
    def from_arrays(
        vertices: ArrayLike,
        faces: ArrayLike | None = ...,
        *,
        normals: ArrayLike | None = ...,
        uv: ArrayLike | None = ...,
        texture: ArrayLike | None = ...,
        colors: ArrayLike | None = ...,
        base_color: Sequence[float] = ...,
        metallic: float = ...,
        roughness: float = ...,
        alpha_mode: Literal["OPAQUE", "MASK", "BLEND"] = ...,
        double_sided: bool = ...,
        mode: Literal["triangles", "lines", "points"] = ...,
        name: str = ...,
    ) -> Scene: ...
    @property
    def bounds(self) -> NDArray[np.float64] | None: ...
    @property
    def cameras(self) -> list[str]: ...
    @property
    def nodes(self) -> list[str]: ...
    @property
    def materials(self) -> list[str]: ...
    @property
    def animations(self) -> list[str]: ...
    @property
    def variants(self) -> list[str]: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def name(self) -> str: ...

class _Picture:
    @property
    def shape(self) -> tuple[int, int]: ...
    @property
    def size(self) -> tuple[int, int]: ...
    @property
    def window(self) -> tuple[int, int, int, int]: ...
    @property
    def display(self) -> tuple[int, int]: ...
    @property
    def K(self) -> NDArray[np.float64] | None: ...
    @property
    def world_to_camera(self) -> NDArray[np.float64] | None: ...
    @property
    def gltf(self) -> NDArray[np.float64] | None: ...
    @property
    def near(self) -> float: ...
    @property
    def far(self) -> float: ...
    @property
    def camera(self) -> str: ...
    @property
    def renderer(self) -> str: ...
    def save(
        self,
        path: Path,
        *,
        as_: str | None = ...,
        layout: str | None = ...,
        compression: str | None = ...,
        no_composite: bool = ...,
        deep_merge: str | None = ...,
        deep_z_tolerance: float | None = ...,
        deep_alpha_tolerance: float | None = ...,
        dense: int | None = ...,
        fill: float | str | None = ...,
        dense_type: Literal["float", "half"] | None = ...,
        cryptomatte: bool = ...,
        background: str | Numbers | None = ...,
        exposure: float | None = ...,
        tone_map: str | None = ...,
        no_clobber: bool = ...,
        no_mkdir: bool = ...,
    ) -> None: ...

class Composite(_Picture):
    """A flat picture: (height, width, 4) float32, linear Rec. 709, premultiplied."""

    @property
    def rgba(self) -> NDArray[np.float32]: ...
    @property
    def z(self) -> NDArray[np.float32]: ...
    def __array__(self, dtype: Any = ...) -> NDArray[Any]: ...
    def _repr_png_(self) -> bytes: ...

class Image(_Picture):
    """All fragments of every pixel, front to back: pixel p has splits[p] up to splits[p + 1]."""

    @property
    def z(self) -> NDArray[np.float32]: ...
    @property
    def rgba(self) -> NDArray[np.float16] | NDArray[np.float32]: ...
    @property
    def opacity(self) -> NDArray[Any] | None: ...
    @property
    def splits(self) -> NDArray[np.uint32]: ...
    @property
    def channels(self) -> list[str]: ...
    @property
    def layers(self) -> int: ...
    @property
    def complete(self) -> bool: ...
    @property
    def counts(self) -> NDArray[np.uint32]: ...
    @property
    def objects(self) -> list[str]: ...
    @property
    def materials(self) -> list[str]: ...
    def __len__(self) -> int: ...
    def __getitem__(self, channel: str) -> NDArray[Any]: ...
    def __contains__(self, channel: str) -> bool: ...
    def dense(
        self, layers: int | None = ..., channel: str = ..., fill: float | None = ...
    ) -> NDArray[Any]: ...
    def positions(self) -> NDArray[np.float32]: ...
    def layer(self, k: int) -> Image: ...
    def nearest(self, layers: int) -> Image: ...
    def flatten(
        self, layers: int | None = ..., tail: Literal["drop", "blend"] = ...
    ) -> Composite: ...
    def _repr_png_(self) -> bytes | None: ...

class Hits:
    """All hits of bundles of rays: ray r has splits[r] up to splits[r + 1], nearest first."""

    @property
    def splits(self) -> NDArray[np.uint32] | NDArray[np.int64]: ...
    @property
    def z(self) -> NDArray[np.float32]: ...
    @property
    def t(self) -> NDArray[np.float32]: ...
    @property
    def columns(self) -> list[str]: ...
    @property
    def bundles(self) -> list[dict[str, Any]]: ...
    @property
    def images(self) -> list[Image]: ...
    def __len__(self) -> int: ...
    def __getitem__(self, column: str) -> NDArray[Any]: ...
    def next_to(self, points: ArrayLike) -> dict[str, NDArray[np.float64]]: ...
    def save(self, path: Path, *, double: bool = ...) -> None: ...

class Renderer:
    """Renders any number of pictures of any number of scenes, one at a time."""

    def __init__(
        self,
        *,
        device: str | int | None = ...,
        backend: Literal["auto", "egl", "osmesa"] | None = ...,
        memory: str | int | None = ...,
        require_gpu: bool = ...,
        threads: int | None = ...,
    ) -> None: ...
    def __enter__(self) -> Renderer: ...
    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...
    def close(self) -> None: ...
    @property
    def device(self) -> str: ...
    def layers(
        self,
        scene: Scene,
        *,
        camera: str | int | None = ...,
        eye: Numbers | None = ...,
        target: Numbers | None = ...,
        up: Numbers | None = ...,
        fov: float | None = ...,
        ortho_height: float | None = ...,
        near: float | None = ...,
        far: float | None = ...,
        K: ArrayLike | None = ...,
        world_to_camera: ArrayLike | None = ...,
        gltf: ArrayLike | None = ...,
        pixel_center: float | None = ...,
        size: Sequence[int] | int | None = ...,
        crop: Sequence[int] | None = ...,
        tile: str | None = ...,
        animation: str | int | None = ...,
        time: float | None = ...,
        method: Method | None = ...,
        layers: int | Literal["all"] | None = ...,
        occlusion_ratio: float | None = ...,
        tail: Literal["drop"] | None = ...,
        samples: int | None = ...,
        surfaces: Literal["all", "visible", "transparent"] | None = ...,
        faces: Literal["gltf", "front", "back", "both"] | None = ...,
        shading: Literal["pbr", "unlit"] | None = ...,
        point_size: int | None = ...,
        precision: Literal["half", "float"] | None = ...,
        clip_box: Numbers | Sequence[Numbers] | None = ...,
        clip_plane: Numbers | Sequence[Numbers] | None = ...,
        clip_mesh: str | Sequence[str] | None = ...,
        clip: Literal["keep-inside", "keep-outside"] | None = ...,
        shadows: bool = ...,
        shadow_size: int | None = ...,
        channels: Channel | Sequence[Channel] | None = ...,
        cryptomatte: bool = ...,
        strict: bool = ...,
        progress: Progress | None = ...,
    ) -> Image: ...
    def composite(
        self,
        scene: Scene,
        *,
        camera: str | int | None = ...,
        eye: Numbers | None = ...,
        target: Numbers | None = ...,
        up: Numbers | None = ...,
        fov: float | None = ...,
        ortho_height: float | None = ...,
        near: float | None = ...,
        far: float | None = ...,
        K: ArrayLike | None = ...,
        world_to_camera: ArrayLike | None = ...,
        gltf: ArrayLike | None = ...,
        pixel_center: float | None = ...,
        size: Sequence[int] | int | None = ...,
        crop: Sequence[int] | None = ...,
        tile: str | None = ...,
        animation: str | int | None = ...,
        time: float | None = ...,
        method: Method | None = ...,
        layers: int | Literal["all"] | None = ...,
        occlusion_ratio: float | None = ...,
        tail: Literal["drop", "blend"] | None = ...,
        samples: int | None = ...,
        surfaces: Literal["all", "visible", "transparent"] | None = ...,
        faces: Literal["gltf", "front", "back", "both"] | None = ...,
        shading: Literal["pbr", "unlit"] | None = ...,
        point_size: int | None = ...,
        precision: Literal["half", "float"] | None = ...,
        clip_box: Numbers | Sequence[Numbers] | None = ...,
        clip_plane: Numbers | Sequence[Numbers] | None = ...,
        clip_mesh: str | Sequence[str] | None = ...,
        clip: Literal["keep-inside", "keep-outside"] | None = ...,
        shadows: bool = ...,
        shadow_size: int | None = ...,
        strict: bool = ...,
        progress: Progress | None = ...,
    ) -> Composite: ...
    def rays(
        self,
        scene: Scene,
        *,
        direction: Numbers | Sequence[Numbers] | None = ...,
        directions: int | None = ...,
        hemisphere: bool = ...,
        directions_file: Path | None = ...,
        axes: bool = ...,
        resolution: int | None = ...,
        spacing: float | None = ...,
        bounds: ArrayLike | None = ...,
        columns: str | Sequence[str] | None = ...,
        faces: Literal["both", "gltf", "front", "back"] | None = ...,
        refine: bool = ...,
        engine: Literal["auto", "cpu", "gl"] | None = ...,
        camera: str | int | None = ...,
        eye: Numbers | None = ...,
        target: Numbers | None = ...,
        up: Numbers | None = ...,
        fov: float | None = ...,
        ortho_height: float | None = ...,
        near: float | None = ...,
        far: float | None = ...,
        K: ArrayLike | None = ...,
        world_to_camera: ArrayLike | None = ...,
        gltf: ArrayLike | None = ...,
        pixel_center: float | None = ...,
        size: Sequence[int] | int | None = ...,
        crop: Sequence[int] | None = ...,
        tile: str | None = ...,
        animation: str | int | None = ...,
        time: float | None = ...,
        progress: Progress | None = ...,
    ) -> Hits: ...
    def ray_maps(
        self,
        scene: Scene,
        *,
        map: str | Sequence[str],
        attenuation: Mapping[str, float] | None = ...,
        part: Sequence[str] | None = ...,
        **rays: Any,
    ) -> list[dict[str, NDArray[np.float32]]]: ...
    def voxels(
        self, scene: Scene, voxels: int, *, bounds: ArrayLike | None = ..., **rays: Any
    ) -> dict[str, Any]: ...
    def parity(self, scene: Scene, **rays: Any) -> dict[str, Any]: ...

def read(
    path: Path, *, part: str | None = ..., view: str | None = ..., strict: bool = ...
) -> Image: ...
def merge_images(images: Sequence[Image], elements: bool = ...) -> Image: ...
def compare_images(a: Image, b: Image) -> dict[str, Any]: ...
def check_scene(
    scene: Scene,
    *,
    together: bool = ...,
    unit: float = ...,
    min_wall: float | None = ...,
    progress: Progress | None = ...,
) -> dict[str, Any]: ...
def bake_scene(
    scene: Scene,
    *,
    quantity: Literal["ao", "bent-normal", "sky-visibility", "thickness", "irradiance"] | None = ...,
    directions: int | None = ...,
    resolution: int | None = ...,
    max_distance: float | None = ...,
    bounces: int | None = ...,
    faces: Literal["both", "gltf", "front", "back"] | None = ...,
    animation: str | int | None = ...,
    time: float | None = ...,
    progress: Progress | None = ...,
) -> dict[str, Any]: ...

# What the verbs of the command line do, from files to files; help() lists the keywords.
def bake(scene: Path, *, output: Path, progress: Progress | None = ..., **keywords: Any) -> dict[str, Any]: ...
def check(scene: Path, *, progress: Progress | None = ..., **keywords: Any) -> dict[str, Any]: ...
def compare(a: Path, b: Path, *, progress: Progress | None = ..., **keywords: Any) -> dict[str, Any]: ...
def convert(image: Path, *, output: Path, progress: Progress | None = ..., **keywords: Any) -> dict[str, Any]: ...
def devices() -> dict[str, Any]: ...
def extract(image: Path, *, progress: Progress | None = ..., **keywords: Any) -> dict[str, Any]: ...
def flatten(image: Path, *, output: Path, progress: Progress | None = ..., **keywords: Any) -> dict[str, Any]: ...
def info(
    file: Path,
    *,
    allow_outside: bool = ...,
    unit: Literal["m", "mm", "cm", "inch", "in"] | None = ...,
    up: Literal["x", "y", "z"] | None = ...,
) -> dict[str, Any]: ...
def masks(scene: Path, *, output: Path, progress: Progress | None = ..., **keywords: Any) -> dict[str, Any]: ...
def merge(*tiles: Path, output: Path, progress: Progress | None = ..., **keywords: Any) -> dict[str, Any]: ...
def rays(scene: Path, *, progress: Progress | None = ..., **keywords: Any) -> dict[str, Any]: ...
def render(*scenes: Path, output: Path, progress: Progress | None = ..., **keywords: Any) -> dict[str, Any]: ...
def sheet(file: Path, *, output: Path, progress: Progress | None = ..., **keywords: Any) -> dict[str, Any]: ...
def verify(*files: Path, progress: Progress | None = ..., **keywords: Any) -> dict[str, Any]: ...
def view(image: Path, *, output: Path, progress: Progress | None = ..., **keywords: Any) -> dict[str, Any]: ...
