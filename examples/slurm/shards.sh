#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Renders a data set as a job array. Each task takes a share of the scenes (or of the views of a single scene), and
# writes its own tar shards. Keeps existing samples, and skips scenes that fail.
#   sh shards.sh TASKS AT_ONCE SCENES -o OUT-{chunk}-%06d.tar [more options of peeler render]
# SCENES are files, folders and globs in quotes.
set -eu
tasks=$1 at_once=$2
shift 2
exec sbatch --parsable --array="1-$tasks%$at_once" "$(dirname "$0")/peeler.sbatch" \
    render "$@" --chunk "%a/$tasks" --skip-existing --keep-going
