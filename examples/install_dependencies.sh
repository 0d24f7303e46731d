#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs the Debian packages that peeler needs, if any is missing (for Debian 12 and 13).
#   sh examples/install_dependencies.sh [build] [test] [datasets] [packages] [arm64] [coverage] [mutations] [fuzz] [bench]
set -eu

run="libegl1 libgl1-mesa-dri libosmesa6"
tools="g++ cmake ninja-build pkg-config libglm-dev nlohmann-json3-dev libcli11-dev fonts-dejavu-core"
# The CMake files of libopenimageio-dev fail without openimageio-tools.
libraries="libgl-dev libegl-dev libopenexr-dev libopenimageio-dev openimageio-tools libtinygltf-dev libdeflate-dev
    libdraco-dev lib3mf-dev libfreetype-dev libspng-dev zlib1g-dev libzstd-dev libturbojpeg0-dev libxxhash-dev
    libmeshoptimizer-dev libopenvdb-dev libtbb-dev libboost-dev"
test="libgtest-dev libembree-dev openexr libopenvdb-tools python3 python3-numpy python3-scipy python3-pil
    python3-openimageio python3-openvdb python3-meshio clang-format clang-tidy chromium
    chromium-driver python3-selenium python3-yaml locales slurmctld slurmd slurm-client munge parallel
    debootstrap faketime python3-distributed glslang-tools spirv-tools groff-base mandoc fish zsh dpkg-dev file lintian
    rpm"
# Programs that read training data, write meshes, or run arm64 programs. `sh tests/run.sh all` runs them.
datasets="qemu-user-static python3-opencv python3-torch python3-imageio python3-png colmap meshlab python3-open3d xvfb xauth"
# Needed by the target `packages`.
pack="dpkg-dev file rpm"
# Needed by the preset `arm64`, beside arm64's libraries.
arm64="crossbuild-essential-arm64 qemu-user-static python3"
# Needed by `sh tests/run.sh coverage`, to count lines.
coverage="gcovr"
# Needed by `sh tests/run.sh mutations`, to parse.
mutations="python3-clang"
# Needed by `sh tests/run.sh fuzz`, to build the fuzzers and to symbolise their findings.
fuzz="clang libclang-rt-dev llvm"
# Needed by `sh tests/run.sh bench`, to build the benchmarks and to compare peeler with other programs.
bench="libgtest-dev libembree-dev git f3d xvfb python3 python3-vtk9 openimageio-tools linux-perf python3-numpy
    python3-openimageio chromium chromium-driver python3-selenium"
# npm fetches three.js. Node.js from sources other than Debian includes npm, and conflicts with Debian's package.
command -v npm >/dev/null || bench="$bench npm"

packages=$run
foreign=
for set in "$@"; do
    case $set in
    build) packages="$packages $tools $libraries" ;;
    arm64)
        dpkg --print-foreign-architectures | grep -q arm64 || foreign=arm64
        packages="$packages $tools $pack $arm64"
        for library in $libraries; do packages="$packages $library:arm64"; done
        ;;
    test) packages="$packages $test" ;;
    datasets) packages="$packages $datasets" ;;
    packages) packages="$packages $pack" ;;
    coverage) packages="$packages $coverage" ;;
    mutations) packages="$packages $mutations" ;;
    fuzz) packages="$packages $fuzz" ;;
    bench) packages="$packages $bench" ;;
    *) echo "usage: $0 [build] [test] [datasets] [packages] [arm64] [coverage] [mutations] [fuzz] [bench]" >&2; exit 2 ;;
    esac
done

missing=
for package in $packages; do
    dpkg-query -W -f '${Status}\n' "$package" 2>/dev/null | grep -q '^install ok' ||
        missing="$missing $package"
done
[ -n "$missing" ] || exit 0

echo "installing:$missing" >&2
sudo=
[ "$(id -u)" -eq 0 ] || sudo=sudo
[ -z "$foreign" ] || $sudo dpkg --add-architecture $foreign
$sudo apt-get update -qq
# shellcheck disable=SC2086  # a list of words
$sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing
