#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing (Debian 12), builds, and runs every test.
#   sh tests/run.sh            all of it
#   sh tests/run.sh -L unit    arguments go to ctest
#   sh tests/run.sh bench      measures instead, side by side with other programs; about 20 minutes
#                              on 2 cores; what else can be said: benchmarks/table.py
set -eu
cd "$(dirname "$0")/.."

if [ "${1:-}" = bench ]; then
    shift
    sh examples/install_dependencies.sh build bench
    cmake --preset ci ${PEELER_CMAKE_ARGUMENTS:-} >&2
    cmake --build --preset ci -j "$(nproc)" --target benchmarks >&2
    exec /usr/bin/python3 -B tests/benchmarks/table.py --build build/ci "$@"
fi

sh examples/install_dependencies.sh build test

cmake --preset ci ${PEELER_CMAKE_ARGUMENTS:-}
cmake --build --preset ci -j "$(nproc)"

if [ $# -eq 0 ]; then
    sh tests/check_style.sh build/ci
fi

exec ctest --preset ci -j "$(nproc)" "$@"
