#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Goes from a fresh Debian 12 or 13 to the first layered picture: installs missing packages, builds, renders a scene.
set -eu
cd "$(dirname "$0")/.."

cat <<'TEXT'
Quickstart
  1. installs the Debian packages that are missing, with sudo unless you are root: compiler, CMake, libraries
  2. builds peeler into build/release, in about 4 minutes on 4 cores
  3. renders a scene into build/quickstart
Everything but the packages stays in this folder.
TEXT

sh examples/install_dependencies.sh build

cmake --preset release -DPEELER_BUILD_TESTS=OFF
cmake --build --preset release -j "$(nproc)" --target peeler

out=build/quickstart
mkdir -p "$out"
unset DISPLAY WAYLAND_DISPLAY || true
peeler=build/release/peeler

# Renders every layer of the scene into a multi-part OpenEXR file.
"$peeler" render examples/scenes/glasses.glb -o "$out/glasses.exr"
# Flattens the same layers into a PNG.
"$peeler" flatten "$out/glasses.exr" -o "$out/glasses.png" --background '#f2f0ec'
"$peeler" info "$out/glasses.exr"

cat <<TEXT

The pictures are in $PWD/$out:
  glasses.png  the composite
  glasses.exr  every layer

To try next:
  PATH=\$PWD/build/release:\$PATH
  peeler view $out/glasses.exr -o $out/glasses.html   # a page to orbit and peel the layers
  peeler sheet $out/glasses.exr -o $out/sheet.png     # all layers side by side
  peeler render YOUR_MODEL.glb -o model.png                         # your own scene
TEXT
