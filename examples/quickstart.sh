#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Goes from a fresh Debian 12 or 13 to the first layered picture: installs missing packages, builds, renders a scene.
set -eu
cd "$(dirname "$0")/.."

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

echo "wrote $out/glasses.exr (every layer) and $out/glasses.png (the composite)"
