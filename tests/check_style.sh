#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# clang-format on every source file; clang-tidy on the product's files in the given build folder that differ from the last
# landed commit, and on a quarter of the others in turn (style_units.py), or on all of them. clang-tidy reads many files as
# one unit: one by one they take twenty times as long.
#   sh tests/check_style.sh BUILD_FOLDER [all]
set -eu
cd "$(dirname "$0")/.."
build=$1

# Not --dry-run: clang-format 14 objects to the ends of `namespace a::inline b` that it writes itself. On copies, many
# files at once: one or two processes per file take a minute.
copies=$(mktemp -d)
trap 'rm -rf "$copies"' EXIT
mkdir "$copies/written" "$copies/formatted"
for copy in written formatted; do
    git ls-files -z '*.cpp' '*.h' .clang-format | xargs -0 cp --parents -t "$copies/$copy"
done
git ls-files -z '*.cpp' '*.h' | (cd "$copies/formatted" && xargs -0 -P "$(nproc)" -n 64 clang-format -i)
(cd "$copies" && diff -ru written formatted)
echo "clang-format: every file is formatted"

# The clang driver does not know GCC's spelling of every warning, hence -Wno-unknown-warning-option. GCC warns about
# shadowed names, unit by unit: in these units everything stands beside everything.
/usr/bin/python3 -B tests/style_units.py "$build" "$build/style" ${2:-} |
    xargs -P "$(nproc)" -n 1 clang-tidy -p "$build/style" --quiet \
        --extra-arg=-Wno-unknown-warning-option --extra-arg=-Wno-shadow 2>/dev/null
echo "clang-tidy: no findings in $(cat "$build/style/"unit_*.cpp | wc -l) files"
