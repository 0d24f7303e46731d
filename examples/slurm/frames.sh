#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Renders frames and views as a job array, or runs another verb over them. Each task makes a share of the pictures, and
# keeps existing pictures.
#   sh frames.sh TASKS AT_ONCE [render] SCENE -o OUT.@@@@.####.exr --frames 0-49 --views 8 [more options]
#   sh frames.sh TASKS AT_ONCE flatten IN.@@@@.####.exr -o OUT.@@@@.####.png [more options]
set -eu
tasks=$1 at_once=$2 verb=render
shift 2
case $1 in render | flatten | convert | merge | view | extract | sheet)
    verb=$1
    shift
    ;;
esac
exec sbatch --parsable --array="1-$tasks%$at_once" "$(dirname "$0")/peeler.sbatch" \
    "$verb" "$@" --chunk "%a/$tasks" --skip-existing
