# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=sh
# Parts shared by pack.sh and run.sh; $here is the unpacked folder.

# The libraries in search order: our own, the machine's, and copies of libraries that the machine may lack.
machine=/usr/lib/x86_64-linux-gnu:/lib/x86_64-linux-gnu:/usr/lib64:/lib64:/usr/lib:/lib
libraries=$here/lib:$machine:$here/lib/spare
mesa=$here/lib/osmesa:$libraries:$here/lib/osmesa/spare # libraries with Mesa's rasteriser as it was packed

peeler() {
    LD_LIBRARY_PATH=$libraries "$here/bin/peeler" "$@"
}

scenes() { # scenes [NAME]: prints lines of the table: name, file, options
    awk -v name="${1:-}" '!/^#/ && NF && (name == "" || $1 == name)' "$here/scenes.txt"
}

# capture NAME OUT CAMERAS [OPTIONS]: captures every fragment of a scene as arrays. For several cameras, OUT contains @.
capture() {
    set -- "$@" $(scenes "$1" | cut -s -d ' ' -f 2- | awk '{ $1 = ""; print }')
    scene=$here/scenes/$1.glb out=$2 cameras=$3
    shift 3
    peeler render "$scene" -o "$out" --cameras "$cameras" --channels id --quiet "$@"
}

# array FILE NAME BYTES TYPE: prints an array of an .npz, with BYTES bytes per line, in od's format TYPE. The members
# must be uncompressed, as peeler writes them. The first 64-bit size in a local header is the member's size
# (formats/README.md, "Arrays and points").
array() {
    at=0
    while [ "$(od -An -tu4 -j "$at" -N 4 "$1" | tr -d ' ')" = 67324752 ]; do # PK\3\4
        # shellcheck disable=SC2046  # two numbers
        set -- "$1" "$2" "$3" "$4" $(od -An -tu2 -j $((at + 26)) -N 4 "$1")
        data=$((at + 30 + $5 + $6))
        size=$(($(od -An -tu8 -j $((at + 34 + $5)) -N 8 "$1")))
        if [ "$(tail -c +$((at + 31)) "$1" | head -c "$5")" = "$2.npy" ]; then
            header=$((10 + $(od -An -tu2 -j $((data + 8)) -N 2 "$1")))
            od -An -v -w"$3" -t"$4" -j $((data + header)) -N $((size - header)) "$1"
            return
        fi
        at=$((data + size))
    done
    echo "$1 has no array $2" >&2
    return 1
}

# fragments FILE: prints one line per fragment of an .npz: its pixel, the bits of Z, R, G, B and A, and its triangle
# (node, instance, number).
fragments() {
    array "$1" z 4 u4 >"$1.z"
    array "$1" rgba 8 u2 >"$1.rgba"
    array "$1" ray_splits 8 u8 >"$1.splits"
    for ids in node instance primitive; do
        array "$1" ${ids}_ids 4 u4 >"$1.$ids"
    done
    paste -d ' ' "$1.z" "$1.rgba" "$1.node" "$1.instance" "$1.primitive" |
        awk 'NR == FNR { end[NR - 2] = $1; next }
             { while (FNR > end[pixel + 0]) ++pixel; $1 = $1; print pixel + 0, $0 }' "$1.splits" -
    rm -f "$1.z" "$1.rgba" "$1.splits" "$1.node" "$1.instance" "$1.primitive"
}
