#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs clang-format on every source file. Runs clang-tidy on the product's files in a build folder: with `all`, on all
# files; otherwise on the files that differ from the last landed commit and a quarter of the others in turn, but on at
# most half of all files (style_units.py). clang-tidy gets many files as one unit, because separate files would take
# twenty times as long.
#   sh tests/check_style.sh BUILD_FOLDER [all]
set -eu
cd "$(dirname "$0")/.."
build=$1

# --dry-run does not work: clang-format 14 rejects the ends of `namespace a::inline b` that it writes itself. So copies
# are formatted, many files per process, which is faster than one process per file.
copies=$(mktemp -d)
trap 'rm -rf "$copies"' EXIT
mkdir "$copies/written" "$copies/formatted"
for copy in written formatted; do
    git ls-files -z '*.cpp' '*.h' .clang-format | xargs -0 cp --parents -t "$copies/$copy"
done
git ls-files -z '*.cpp' '*.h' | (cd "$copies/formatted" && xargs -0 -P "$(nproc)" -n 64 clang-format -i)
(cd "$copies" && diff -ru written formatted)
echo "clang-format: every file is formatted"

/usr/bin/python3 -B tests/style_units.py "$build" "$build/style" ${2:-}
