#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The composite and the layers of a layered file, side by side: needs oiiotool (openimageio-tools).
#   sh examples/contact_sheet.sh IN.exr OUT.png [COLUMNS]
set -eu
in=$1 out=$2 columns=${3:-4}

parts=$(oiiotool --info -v "$in" 2>/dev/null | sed -n 's/^ *oiio:subimages: //p' | head -n 1)
size=$(oiiotool --info "$in" | sed -n 's/.*: *\([0-9]*\) x *\([0-9]*\),.*/\1x\2/p' | head -n 1)
rows=$(((parts + columns - 1) / columns))

set --
part=0
while [ "$part" -lt "$parts" ]; do
    # A layer holds only the pixels it has: --croptofull puts it back in its place in the picture.
    set -- "$@" "$in" --subimage "$part" --ch R,G,B,A --croptofull \
        --create "$size" 4 --fill:color=0.86,0.85,0.83,1 "$size" --over --ch R,G,B --resize:filter=box 25%
    part=$((part + 1))
done
oiiotool "$@" --mosaic:pad=6 "${columns}x$rows" --colorconvert linear sRGB -d uint8 -o "$out"
