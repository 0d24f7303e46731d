#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A tour of the module `peeler`, from a file to pictures: python3 examples/python/tour.py [FOLDER]

Each part is independent, like a cell of a notebook. Needs NumPy. The pictures are written to FOLDER (default: tour).
"""

import pathlib
import sys

import numpy as np

import peeler

SCENES = pathlib.Path(__file__).resolve().parents[1] / "scenes"
OUT = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "tour")
OUT.mkdir(parents=True, exist_ok=True)


def picture(name, rgb):
    """Writes numbers from 0 to 1 as a PNG, using only the module: the scene is one unlit textured square."""
    rgb = np.clip(np.nan_to_num(rgb), 0, 1)
    if rgb.ndim == 2:
        rgb = np.repeat(rgb[..., None], 3, axis=2)
    height, width = rgb.shape[:2]
    square = [[0, 0, 0], [width, 0, 0], [width, height, 0], [0, height, 0]]
    canvas = peeler.Scene.from_arrays(
        square, [[0, 1, 2], [0, 2, 3]], uv=[[0, 1], [1, 1], [1, 0], [0, 0]], texture=(rgb * 255 + 0.5).astype(np.uint8)
    )
    with peeler.Renderer() as easel:
        shown = easel.composite(
            canvas, size=(width, height), eye=(width / 2, height / 2, 1), target=(width / 2, height / 2, 0),
            ortho_height=height, shading="unlit",
        )
    shown.save(OUT / name, exposure=0, tone_map="none")


# --- 1. A scene, and every layer of it -------------------------------------------------------------------------------

engine = peeler.Scene(SCENES / "engine.glb")
print(engine, engine.cameras)

r = peeler.Renderer()  # in a program, use: with peeler.Renderer() as r
print(r.device)

img = r.layers(engine, size=(960, 540), camera="main", channels=["normal", "id"])
print(img)
img.flatten().save(OUT / "1_engine.png")  # in a notebook `img` alone shows this

# --- 2. CSR: pixel p has the fragments splits[p] to splits[p + 1], front to back -------------------------------------

height, width = img.shape
counts = np.diff(img.splits.astype(np.int64)).reshape(height, width)
y, x = np.unravel_index(counts.argmax(), counts.shape)
first = img.splits[y * width + x]
for f in range(first, first + counts[y, x]):
    node = img.objects[img["id.object"][f] - 1]
    print(f"  ({x}, {y}) layer {f - first}: z = {img.z[f]:.4f} m, alpha {img.rgba[f, 3]:.2f}, {node}")

ramp = np.array([[0, 0, 0], [0.2, 0.05, 0.45], [0.75, 0.15, 0.4], [1, 0.6, 0.1], [1, 1, 0.75]])
share = counts / counts.max() * (len(ramp) - 1)
picture("2_depth_complexity.png", np.stack([np.interp(share, range(len(ramp)), ramp[:, c]) for c in range(3)], axis=2))

# --- 3. Dense arrays, for code that cannot use lists -----------------------------------------------------------------

z = img.dense(8, fill=float("nan"))  # (height, width, 8)
thick = np.nanmax(z, axis=2, initial=0) - np.nanmin(z, axis=2, initial=np.inf)
print("the engine is up to", round(float(thick[np.isfinite(thick)].max()), 3), "m deep along the pixels' rays")

# --- 4. X-ray vision: the layers behind the first ones ---------------------------------------------------------------

strips = []
for k in (0, 2, 4, 6):
    normals = img.layer(k).dense(1, "normal")[:, :, 0, :].astype(np.float32)
    strips.append(np.where(np.any(normals, axis=2, keepdims=True), normals * 0.5 + 0.5, 1.0)[::2, ::2])
picture("4_layers.png", np.vstack((np.hstack(strips[:2]), np.hstack(strips[2:]))))

# --- 5. Parts by their ids, also behind other parts ------------------------------------------------------------------

hue = (np.arange(len(img.objects) + 1) * 0.61803) % 1
colors = np.clip(np.abs((hue[:, None] * 6 + [0, 4, 2]) % 6 - 3) - 1, 0, 1) * 0.75 + 0.2
colors[0] = 1
ids = img.dense(6, "id.object")  # 0: no fragment
mixed = np.ones((height, width, 3))
for k in range(ids.shape[2] - 1, -1, -1):  # from back to front, each 45 % opaque
    there = (ids[..., k] > 0)[..., None]
    mixed = np.where(there, 0.55 * mixed + 0.45 * colors[ids[..., k]], mixed)
picture("5_parts.png", mixed)

# --- 6. A calibrated camera: K in pixels and world_to_camera, in OpenCV's convention ---------------------------------

K = img.K
K[0, 2] += 160  # moves the principal point off the centre
aside = r.layers(engine, size=(960, 540), K=K, world_to_camera=img.world_to_camera)
print("off centre:", aside.K.round(1).tolist(), aside)
aside.flatten().save(OUT / "6_off_centre.png")

# --- 7. Rays: all hits, and the lengths between them -----------------------------------------------------------------

hits = r.rays(engine, direction=(0, 0, -1), resolution=1024)
print(hits, hits["node_ids"][:5], hits.t[:5])
maps = r.ray_maps(engine, map=["thickness"], direction=(0, 0, -1), resolution=1024)
inside = maps[0]["thickness"]
picture("7_xray.png", 1 - np.exp(-inside / 0.03))

# --- 8. A mesh of your own -------------------------------------------------------------------------------------------

u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 241), np.linspace(0, 2 * np.pi, 81))
tube = 0.34 + 0.06 * np.cos(5 * u)
knot = np.stack(((1 + tube * np.cos(v)) * np.cos(u), tube * np.sin(v), (1 + tube * np.cos(v)) * np.sin(u)), axis=2)
rows, columns = u.shape
corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
faces = np.concatenate(
    [np.stack((corner, corner + columns, corner + 1), 1), np.stack((corner + 1, corner + columns, corner + columns + 1), 1)]
)
tint = np.stack((0.5 + 0.5 * np.cos(u), 0.5 + 0.5 * np.cos(u + 2.1), 0.5 + 0.5 * np.cos(u + 4.2)), axis=2)
stripes = np.where(np.sin(9 * u + 4 * v) > 0, 0.9, 0.25)
ring = peeler.Scene.from_arrays(
    knot.reshape(-1, 3), faces, colors=np.dstack((tint, stripes)).reshape(-1, 4), alpha_mode="BLEND", double_sided=True
)
flat = r.composite(ring, size=(960, 540), method="dual", samples=8)
flat.save(OUT / "8_ring.png", background=(1, 1, 1))

# --- 9. Errors: problem, place, remedy -------------------------------------------------------------------------------

try:
    r.layers(engine, camera="mian")
except peeler.Error as error:
    print(f"{error.kind}: {error.what} ({error.where})\n  {error.hint}")

# --- 10. Files -------------------------------------------------------------------------------------------------------

img.save(OUT / "engine.exr")  # the same bytes as `peeler render engine.glb -o engine.exr --size 960x540 ...`
again = peeler.read(OUT / "engine.exr")
assert np.array_equal(again.z, img.z) and np.array_equal(again["id"], img["id"])
print(peeler.verify(OUT / "engine.exr")["verdict"])

r.close()
