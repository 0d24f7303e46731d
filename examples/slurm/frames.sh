#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# An animation as a job array: each task renders a share of the frames; what is there is left alone.
#   sh frames.sh TASKS AT_ONCE SCENE -o OUT.####.exr --frames 0-49 [more options of peeler render]
set -eu
tasks=$1 at_once=$2
shift 2
exec sbatch --parsable --array="1-$tasks%$at_once" "$(dirname "$0")/peeler.sbatch" \
    render "$@" --chunk "%a/$tasks" --skip-existing
