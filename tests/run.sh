#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing (Debian 12), builds, and runs every test.
#   sh tests/run.sh            all of it
#   sh tests/run.sh -L unit    arguments go to ctest
set -eu
cd "$(dirname "$0")/.."

sh examples/install_dependencies.sh build test

cmake --preset ci ${PEELER_CMAKE_ARGUMENTS:-}
cmake --build --preset ci -j "$(nproc)"

if [ $# -eq 0 ]; then
    sh tests/check_style.sh build/ci
fi

exec ctest --preset ci -j "$(nproc)" "$@"
