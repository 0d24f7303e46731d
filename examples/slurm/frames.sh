#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Renders an animation as a job array. Each task renders a share of the frames, and keeps frames that exist.
#   sh frames.sh TASKS AT_ONCE SCENE -o OUT.####.exr --frames 0-49 [more options of peeler render]
set -eu
tasks=$1 at_once=$2
shift 2
exec sbatch --parsable --array="1-$tasks%$at_once" "$(dirname "$0")/peeler.sbatch" \
    render "$@" --chunk "%a/$tasks" --skip-existing
