# SPDX-License-Identifier: Apache-2.0
"""Every layer of a glTF scene, headless, as NumPy arrays."""

# write_stub.py replaces each **NAME: Options by the keywords for options, and appends the functions of verbs.
from os import PathLike
from types import TracebackType
from typing import Any, Callable, Literal, Mapping, Sequence, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str

Path = str | bytes | PathLike[str]
Numbers = Sequence[float] | NDArray[Any]
Progress = Callable[[float], Any]
T = TypeVar("T")

class Error(Exception):
    """Raised by everything in peeler."""

    kind: Literal["usage", "input", "output", "device", "incomplete", "memory", "internal"]
    what: str
    where: str
    hint: str
    def __init__(self, kind: str, what: str, where: str = ..., hint: str = ...) -> None: ...

class Scene:
    """The scene in a file (glTF, PLY, STL, OBJ, 3MF), or a mesh of arrays. Right-handed, +Y up, scene units."""

    def __init__(
        self,
        path: Path,
        *,
        **Scene: Options,
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
    def normalized(self, to: Literal["unit-cube", "unit-sphere"] = ...) -> Scene: ...
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
        **save: Options,
    ) -> None: ...

class Composite(_Picture):
    """A flat picture: (height, width, 4) float32, linear Rec. 709, premultiplied."""

    @property
    def rgba(self) -> NDArray[np.float32]: ...
    @property
    def z(self) -> NDArray[np.float32]: ...
    def __array__(self, dtype: Any = ..., copy: bool | None = ...) -> NDArray[Any]: ...
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
    def splits(self) -> NDArray[np.int64]: ...
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
        **Renderer: Options,
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
        **layers: Options,
        K: ArrayLike | None = ...,
        world_to_camera: ArrayLike | None = ...,
        gltf: ArrayLike | None = ...,
        pixel_center: float | None = ...,
        progress: Progress | None = ...,
    ) -> Image: ...
    def composite(
        self,
        scene: Scene,
        *,
        **composite: Options,
        K: ArrayLike | None = ...,
        world_to_camera: ArrayLike | None = ...,
        gltf: ArrayLike | None = ...,
        pixel_center: float | None = ...,
        progress: Progress | None = ...,
    ) -> Composite: ...
    def rays(
        self,
        scene: Scene,
        *,
        **hits: Options,
        K: ArrayLike | None = ...,
        world_to_camera: ArrayLike | None = ...,
        gltf: ArrayLike | None = ...,
        pixel_center: float | None = ...,
        progress: Progress | None = ...,
    ) -> Hits: ...
    def ray_maps(
        self,
        scene: Scene,
        *,
        **ray_maps: Options,
        K: ArrayLike | None = ...,
        world_to_camera: ArrayLike | None = ...,
        gltf: ArrayLike | None = ...,
        pixel_center: float | None = ...,
        progress: Progress | None = ...,
    ) -> list[dict[str, NDArray[np.float32]]]: ...
    def voxels(
        self,
        scene: Scene,
        voxels: int,
        *,
        **voxels: Options,
        progress: Progress | None = ...,
    ) -> dict[str, Any]: ...
    def parity(
        self,
        scene: Scene,
        *,
        **parity: Options,
        K: ArrayLike | None = ...,
        world_to_camera: ArrayLike | None = ...,
        gltf: ArrayLike | None = ...,
        pixel_center: float | None = ...,
        progress: Progress | None = ...,
    ) -> dict[str, Any]: ...

async def aio(call: Callable[..., T], *arguments: Any, **keywords: Any) -> T: ...
def views(
    n: int,
    scene: Scene | None = ...,
    *,
    **views: Options,
) -> list[dict[str, Any]]: ...
def read(
    path: Path,
    *,
    **read: Options,
) -> Image: ...
def merge_images(images: Sequence[Image], elements: bool = ...) -> Image: ...
def compare_images(a: Image, b: Image) -> dict[str, Any]: ...
def check_scene(
    scene: Scene,
    *,
    together: bool = ...,
    unit: float = ...,
    min_wall: float | None = ...,
    weld: float | None = ...,
    progress: Progress | None = ...,
) -> dict[str, Any]: ...
def bake_scene(
    scene: Scene,
    *,
    **bake_scene: Options,
    progress: Progress | None = ...,
) -> dict[str, Any]: ...

# The verbs of the command line, from files to files.
