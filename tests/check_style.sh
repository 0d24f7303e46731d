#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# clang-format on every source file, clang-tidy on every one of ours in the build folder given.
#   sh tests/check_style.sh BUILD_FOLDER
set -eu
cd "$(dirname "$0")/.."
build=$1

git ls-files '*.cpp' '*.h' | xargs clang-format --dry-run --Werror
echo "clang-format: every file is formatted"

# The clang driver does not know GCC's spelling of every warning, hence -Wno-unknown-warning-option.
git ls-files 'cmd/*.cpp' 'core/*.cpp' 'formats/*.cpp' |
    xargs -P "$(nproc)" -n 4 clang-tidy -p "$build" --quiet \
        --extra-arg=-Wno-unknown-warning-option 2>/dev/null
echo "clang-tidy: no findings"
