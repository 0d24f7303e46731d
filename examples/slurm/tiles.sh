#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Renders one large picture as a job array over its tiles, and merges the tiles in a final job.
#   sh tiles.sh TILES OUT SCENE [more options of peeler render]
# OUT may be .exr (layers) or a picture; you may delete the tiles, OUT.tiles/*.exr, afterwards.
set -eu
tiles=$1 out=$2
shift 2
here=$(dirname "$0")
folder=$out.tiles
mkdir -p "$folder"

job=$(sbatch --parsable --array="1-$tiles" "$here/peeler.sbatch" \
    render "$@" -o "$folder/%a.exr" --tile "%a/$tiles" --skip-existing)

set --
for tile in $(seq "$tiles"); do
    set -- "$@" "$folder/$tile.exr"
done
exec sbatch --parsable --dependency="afterok:$job" --kill-on-invalid-dep=yes "$here/peeler.sbatch" \
    merge "$@" -o "$out"
