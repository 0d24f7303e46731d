#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Renders glTF models with peeler and with three.js in headless Chromium, and prints how much the pictures differ.

    python3 tests/benchmarks/against_three.py --build build/ci [--only "Duck;Fox"] [--size 512] [--samples 16]

Both programs use the same camera, the same sample positions in each pixel and the same environment, in linear light
without tone mapping, shadows or background. npm installs a fixed version of three.js into the build folder. The
pictures of three.js are kept there and reused while their inputs are unchanged. The pictures (ours, three's, their
difference) are in the folder against-three of the build folder. Missing models are skipped with a note.
"""
from __future__ import annotations

import argparse
import hashlib
import json
import shutil
import subprocess
import sys
import tempfile
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Tuple
from urllib.parse import quote, unquote

import numpy as np

from flip import encoded, flip
from machine import ASSETS, ROOT
from reasons import THREE
from side_by_side import run, say
from three_scenes import ENVIRONMENTS, MADE, MODELS

THREE_VERSION = "0.187.0"
# The centre of an environment picture is along +X in three.js, and along +Z in peeler.
ROTATION = "90"
LEAST = 30.0  # in dB; a picture with a lower PSNR needs a reason (reasons.py)
CLOSE = 35.0  # in dB; pictures with at least this PSNR are listed below the table
PAGE = Path(__file__).resolve().parent / "three_page.html"


class Scene(NamedTuple):
    name: str
    path: Path
    environment: str


class Measured(NamedTuple):
    """The differences between two pictures, over the pixels that either picture covers. PSNR and FLIP compare displayed
    values up to 1."""

    psnr: float  # in dB, in linear light with a peak of 1
    flip: float  # mean over sRGB pictures
    luminance: float  # ratio of ours to theirs, without clipping


def compared(ours: np.ndarray, theirs: np.ndarray) -> Measured:
    """Compares two pictures [height, width, 4] in linear light with premultiplied alpha."""
    covered = (ours[..., 3] > 0) | (theirs[..., 3] > 0)
    if not covered.any():
        return Measured(np.inf, 0.0, 1.0)
    a, b = (np.clip(image[..., :3], 0.0, 1.0) for image in (ours, theirs))
    error = np.mean((a - b)[covered] ** 2)
    luminances = [np.mean(image[covered][:, :3] @ (0.2126, 0.7152, 0.0722)) for image in (ours, theirs)]
    return Measured(-10 * np.log10(error) if error > 0 else np.inf, float(flip(encoded(a), encoded(b))[covered].mean()),
                    luminances[0] / luminances[1] if luminances[1] > 0 else np.inf)


def sample_positions(count: int) -> List[Tuple[float, float]]:
    """Returns the positions of peeler's samples within a pixel, relative to its upper left corner
    (core/fragments/supersampling.h)."""
    def mirrored(n: int) -> float:
        value, digit = 0.0, 0.5
        while n:
            value, n, digit = value + digit * (n & 1), n >> 1, digit / 2
        return value
    # Four samples are at the positions of multisampling.
    return [((i + 0.5) / count, mirrored(i ^ 2 if count == 4 else i) + 0.5 / count) for i in range(count)]


def line(scene: str, measured: Measured) -> str:
    return f"| {scene} | {measured.psnr:.1f} | {measured.flip:.3f} | {measured.luminance:.3f} |"


def reasons(rows: Dict[str, Measured]) -> str:
    """Returns the text below the table: the pictures that differ much, grouped by reason."""
    far: Dict[str, List[str]] = {}
    for scene, measured in rows.items():
        if measured.psnr < LEAST:
            far.setdefault(THREE.get(scene, "Not looked into"), []).append(scene)
    lines = [f"- **{reason}.** {'; '.join(scenes)}." for reason, scenes in far.items()]
    return "\n".join(["", f"Below {LEAST:g} dB:", "", *lines]) if lines else f"\nNothing is below {LEAST:g} dB."


def table(rows: Dict[str, Measured]) -> str:
    """Returns the table of the pictures, and the ranges of those that hardly differ."""
    lines = [line(scene, measured) for scene, measured in rows.items() if measured.psnr < CLOSE]
    close = {scene: measured for scene, measured in rows.items() if measured.psnr >= CLOSE}
    text = "\n".join(["| scene | PSNR, dB | FLIP | luminance |", "| --- | ---: | ---: | ---: |", *lines])
    if close:
        levels, flips, ratios = zip(*close.values())
        text += (f"\n\n{len(close)} other [scenes](three_scenes.py) have {min(levels):.1f} to {max(levels):.1f} dB, FLIP up to "
                 f"{max(flips):.3f}, luminance {min(ratios):.3f} to {max(ratios):.3f}.")
    return text


def install(build: Path) -> Path:
    """Returns the folder of three.js; npm fetches it if it is missing."""
    folder = build / "three"
    package = folder / "node_modules" / "three"
    told = package / "package.json"
    if not told.is_file() or json.loads(told.read_text())["version"] != THREE_VERSION:
        if not shutil.which("npm"):
            raise RuntimeError("there is no npm: apt-get install npm")
        folder.mkdir(parents=True, exist_ok=True)
        say(f"npm install three@{THREE_VERSION}")
        # A package.json keeps npm from searching the folders above.
        (folder / "package.json").write_text("{}\n")
        subprocess.run(["npm", "install", "--prefix", folder, "--ignore-scripts", "--no-audit", "--no-fund",
                        "--no-package-lock", f"three@{THREE_VERSION}"], check=True, stdout=sys.stderr)
    return package


class Server(ThreadingHTTPServer):
    """A server for this machine only. It serves folders and bytes to the page and receives the page's pictures."""

    daemon_threads = True

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.folders: Dict[str, Path] = {}  # by the first part of the path
        self.blobs: Dict[str, bytes] = {}  # by the whole path
        self.answer = b""
        threading.Thread(target=self.serve_forever, daemon=True).start()

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.server_port}"

    def share(self, name: str, path: Path) -> str:
        """Serves the folder of a file; returns the file's address."""
        self.folders[name] = path.parent
        return f"/{name}/{quote(path.name)}"


class Handler(BaseHTTPRequestHandler):
    server: Server
    KINDS = {".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm"}

    def do_GET(self) -> None:  # noqa: N802
        address = unquote(self.path.split("?")[0])
        data = self.server.blobs.get(address)
        if data is None:
            name, _, rest = address.lstrip("/").partition("/")
            path = self.server.folders.get(name, Path("/nowhere")) / rest
            data = path.read_bytes() if path.is_file() else None
        self.send_response(404 if data is None else 200)
        self.send_header("Content-Type", self.KINDS.get(Path(address).suffix, "application/octet-stream"))
        self.send_header("Cache-Control", "no-store")  # several models have files of the same name
        self.send_header("Content-Length", str(len(data or b"")))
        self.end_headers()
        self.wfile.write(data or b"")

    def do_POST(self) -> None:  # noqa: N802
        self.server.answer = self.rfile.read(int(self.headers["Content-Length"]))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *_: Any) -> None:
        pass


class Browser:
    """three.js in Chromium, which starts on first use."""

    def __init__(self, package: Path, images: Dict[str, np.ndarray]):
        self.driver: Any = None
        self.server = Server()
        self.server.folders["three"] = package
        self.server.blobs["/page.html"] = PAGE.read_bytes()
        for name, image in images.items():
            self.server.blobs[f"/environment/{name}"] = image[::-1].tobytes()
        self.images = images

    def start(self) -> None:
        sys.path.insert(0, str(ROOT / "tests" / "support"))
        import chromium
        try:
            self.driver = chromium.start()
        except chromium.Missing as what:
            raise RuntimeError(str(what)) from None
        self.driver.get(f"{self.server.address}/page.html")
        self.driver.execute_async_script(
            "const done = arguments[0], look = () => window.render ? done() : setTimeout(look, 50); look()")

    def render(self, scene: Scene, view: Dict[str, Any], samples: int) -> np.ndarray:
        if self.driver is None:
            self.start()
        image = self.images[scene.environment]
        height, width, _ = image.shape
        request = {
            "model": self.server.share("model", scene.path), "view": view, "samples": sample_positions(samples),
            "environment": {"url": f"/environment/{scene.environment}", "width": width, "height": height},
            "answer": "/answer",
        }
        from selenium.common.exceptions import WebDriverException
        try:
            wrong = self.driver.execute_async_script(
                "const done = arguments[1]; window.render(arguments[0]).then(done)", request)
        except WebDriverException as error:  # too slow, or out of memory; the next scene gets a new browser
            self.driver.quit()
            self.driver = None
            raise RuntimeError(f"Chromium: {error.msg.splitlines()[0]}") from None
        if wrong:
            raise RuntimeError(str(wrong).splitlines()[0])
        pixels = np.frombuffer(self.server.answer, dtype="<f4")
        return pixels.reshape(view["height"], view["width"], 4)[::-1].copy()

    def close(self) -> None:
        if self.driver is not None:
            self.driver.quit()
        self.server.shutdown()


def read(path: Path) -> Tuple[np.ndarray, Dict[str, Any]]:
    """Reads a composite written by peeler, and its camera."""
    import OpenImageIO as oiio
    buffer = oiio.ImageBuf(str(path))
    channels = [buffer.spec().channelnames.index(name) for name in "RGBA"]
    spec = buffer.spec()
    window = oiio.ROI(spec.full_x, spec.full_x + spec.full_width, spec.full_y, spec.full_y + spec.full_height)
    window.chbegin, window.chend = 0, spec.nchannels
    pixels = np.asarray(buffer.get_pixels(oiio.FLOAT, window))
    return pixels[..., channels], json.loads(spec.getattribute("peeler:cameraJson"))


def save(path: Path, image: np.ndarray) -> None:
    """Writes an EXR of floats, or any other format as sRGB in 8 bits."""
    import OpenImageIO as oiio
    pixels = np.ascontiguousarray(image, dtype=np.float32)
    spec = oiio.ImageSpec(image.shape[1], image.shape[0], image.shape[2],
                          oiio.FLOAT if path.suffix == ".exr" else oiio.UINT8)
    file = oiio.ImageOutput.create(str(path))
    if not file or not file.open(str(path), spec) or not file.write_image(pixels):
        raise RuntimeError(f"cannot write {path}: {oiio.geterror()}")
    file.close()


def fingerprint(scene: Scene, view: Dict[str, Any], samples: int, image: np.ndarray) -> str:
    """Returns a hash of everything that determines three.js's picture."""
    state = hashlib.sha256(PAGE.read_bytes() + image.tobytes())
    for path in sorted(scene.path.parent.iterdir()):
        if path.is_file():
            state.update(path.name.encode() + path.read_bytes())
    state.update(json.dumps([THREE_VERSION, scene.path.name, view, samples], sort_keys=True).encode())
    return state.hexdigest()


class Bench:
    def __init__(self, peeler: Path, folder: Path, size: int, samples: int, browser: Browser):
        self.peeler, self.folder, self.size, self.samples, self.browser = peeler, folder, size, samples, browser

    def ours(self, scene: Scene) -> Tuple[np.ndarray, Dict[str, Any]]:
        out = self.folder / f"{scene.name}.ours.exr"
        run([self.peeler, "render", scene.path, "-o", out, "--as", "composite", "--surfaces", "visible", "--precision",
             "float", "--size", f"{self.size}x{self.size}", "--samples", self.samples, "--environment",
             self.folder / f"{scene.environment}.exr", "--environment-rotation", ROTATION, "--quiet"])
        return read(out)

    def theirs(self, scene: Scene, view: Dict[str, Any]) -> np.ndarray:
        kept, mark = (self.folder / f"{scene.name}.three.{end}" for end in ("npy", "txt"))
        wanted = fingerprint(scene, view, self.samples, self.browser.images[scene.environment])
        if mark.is_file() and kept.is_file() and mark.read_text() == wanted:
            return np.load(kept)
        picture = self.browser.render(scene, view, self.samples)
        np.save(kept, picture)
        mark.write_text(wanted)
        return picture

    def measured(self, scene: Scene) -> Measured:
        ours, view = self.ours(scene)
        theirs = self.theirs(scene, view)
        a, b = (encoded(image[..., :3]) for image in (ours, theirs))
        for name, image in (("ours", a), ("three", b), ("difference", np.clip(4 * np.abs(a - b), 0.0, 1.0))):
            save(self.folder / f"{scene.name}.{name}.png", image)
        return compared(ours, theirs)


def scenes(assets: Path, scratch: Path, only: Optional[List[str]], missing: List[str]) -> Iterator[Scene]:
    for name, made in MADE.items():
        if only is None or name in only:
            path = scratch / name.replace(":", "") / "ball.glb"
            path.parent.mkdir()
            path.write_bytes(made.scene().bytes())
            yield Scene(name, path, made.environment)
    for model in MODELS:
        name, path = model.split("/")[0], assets / "gltf-sample-assets" / model
        if only is not None and name not in only:
            continue
        if path.is_file():
            yield Scene(name, path, "studio")
        else:
            missing.append(name)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=Path, default=ROOT / "build" / "ci", help="a folder (default: build/ci)")
    parser.add_argument("--only", help="names of the table, separated by semicolons (default: all)")
    parser.add_argument("--size", type=int, default=512, help="pixels a side (default: 512)")
    parser.add_argument("--samples", type=int, default=16, help="places in a pixel (default: 16)")
    options = parser.parse_args()
    folder = options.build.resolve() / "against-three"
    folder.mkdir(parents=True, exist_ok=True)
    images = {name: make() for name, make in ENVIRONMENTS.items()}
    for name, image in images.items():
        save(folder / f"{name}.exr", image)
    browser = Browser(install(options.build.resolve()), images)
    bench = Bench(options.build.resolve() / "peeler", folder, options.size, options.samples, browser)
    missing: List[str] = []
    skipped: List[str] = []
    rows: Dict[str, Measured] = {}
    try:
        with tempfile.TemporaryDirectory() as scratch:
            only = options.only.split(";") if options.only else None
            for scene in scenes(ASSETS, Path(scratch), only, missing):
                try:
                    rows[scene.name] = bench.measured(scene)
                    say(line(scene.name, rows[scene.name]))
                except RuntimeError as error:
                    skipped.append(f"{scene.name}: {error}")
    finally:
        browser.close()
    print(table(rows), reasons(rows), sep="\n")
    skipped += [f"{', '.join(missing)}: missing"] if missing else []
    print("".join(f"\nSkipped: {why}." for why in skipped), end="\n" if skipped else "")
    say(f"pictures in {folder}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
