#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# sh tests/gpu/pack.sh [BUILD] [OUTPUT]: packs all files for testing this build on a bare machine with a GPU: programs,
# libraries, scenes, and the scenes' results on this machine. On the other machine, run.sh needs only the C library, the
# driver, and the tools of every Debian (gzip, but not xz).
#   BUILD   a folder with a finished build on Debian (default: build/ci)
#   OUTPUT  the archive (default: BUILD/peeler-gpu.tar.gz)
set -eu
source=$(cd "$(dirname "$0")/../.." && pwd)
build=$(cd "${1:-$source/build/ci}" && pwd)
output=$(realpath "${2:-$build/peeler-gpu.tar.gz}")
assets=${PEELER_ASSETS:-$source/../shared/assets}
size=160x90

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
here=$scratch/peeler-gpu
mkdir -p "$here/scenes" "$here/examples/scenes" "$here/references"
cmake -D SETTINGS="$build/packing/portable_settings.cmake" -D ROOT="$here" -P "$source/tests/gpu/programs.cmake"
for file in run.sh common.sh classify.awk moved.awk scenes.txt; do
    cp "$source/tests/gpu/$file" "$here"
done
. "$here/common.sh"

# Packs the result of every scene on this machine, and the fragments of the picture moved by 1/256 of a pixel in each
# direction (classify.awk). These moves find all edges, because a step along both axes is longer than 1/256.
renderer=$(peeler render "$source/examples/scenes/panes.glb" -o "$scratch/any.npz" --size 16x16 --json --quiet |
    sed -n 's/^ *"renderer": "\(.*\)",$/\1/p')
echo "# made by $renderer: scene, fragments, layers" >"$here/references.txt"
git -C "$source" rev-parse HEAD >"$here/commit" 2>/dev/null || echo unknown >"$here/commit"
scenes | while read -r name file options; do
    if [ -f "$source/examples/scenes/$file" ]; then
        cp "$source/examples/scenes/$file" "$here/examples/scenes" # tests look for the file there
        ln -s "../examples/scenes/$file" "$here/scenes/$name.glb"
    elif [ -f "$assets/$file" ]; then
        cp "$assets/$file" "$here/scenes/$name.glb"
    else
        echo "pack.sh: left out, there is no $file (PEELER_ASSETS): $name" >&2
        continue
    fi
    reference=$here/references/$name
    # shellcheck disable=SC2086  # a list of words
    peeler render "$here/scenes/$name.glb" -o "$scratch/camera@.npz" --size $size --views 1 --around orbit \
        --cameras-out "$reference.json" --quiet $options
    awk '/"cx"/ { x = $2 + 0 }
        /"cy"/ { y = $2 + 0 }
        /"file_path"/ { view = $0; sub(/.*"peeler_near"/, "\"peeler_near\"", view); next }
        /"transform_matrix"/ {
            for (i = 0; i < 9; ++i)
                printf "{\"cx\": %.17g, \"cy\": %.17g, %s%s%s\n", x + (i % 3 - 1) / 256, y + (int(i / 3) - 1) / 256,
                    view, $0, i < 8 ? "," : ""
            next
        }
        { print }' "$reference.json" >"$scratch/moved.json"
    capture "$name" "$scratch/moved@.npz" "$scratch/moved.json"
    for moved in "$scratch"/moved*.npz; do
        fragments "$moved"
    done | awk -f "$here/moved.awk" | sort >"$reference.moved"
    rm "$scratch"/*.npz
    capture "$name" "$reference.npz" "$reference.json" --report "$scratch/report.json"
    awk -v name="$name" '/"fragmentsStored"/ { n = $2 + 0 } /"layers"/ { l = $2 + 0 } END { print name, n, l }' \
        "$scratch/report.json" >>"$here/references.txt"
done

tar -C "$scratch" --sort=name --owner=0 --group=0 --numeric-owner -czf "$output" peeler-gpu
bytes=$(stat -c %s "$output")
echo "$output: $(((bytes + 999999) / 1000000)) MB, $(grep -vc '^#' "$here/references.txt") scenes"
if [ "$bytes" -gt 60000000 ]; then
    echo "pack.sh: $output has more than 60 MB" >&2
    exit 1
fi
