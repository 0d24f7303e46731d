#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Renders an animation with several processes, on this machine or on others. A second run does the chunks that failed.
#   sh frames.sh CHUNKS JOBS SCENE -o OUT.####.exr --frames 0-95 [more options of peeler render]
set -eu
chunks=$1 jobs=$2
shift 2
log=${PEELER_JOBLOG:-peeler.joblog}

# The log of the previous run lists the finished chunks. It applies only if the command line is the same.
again=
[ ! -s "$log" ] || again=--resume-failed
# After a failure (no scene, no disk space, …), running jobs finish and no new ones start. Each process has one thread,
# because there are many processes.
# shellcheck disable=SC2086  # an option or nothing
seq "$chunks" | parallel --quote --jobs "$jobs" --joblog "$log" $again --halt soon,fail=1 \
    --termseq TERM,5000,KILL,25 ${PEELER_HOSTS:+--sshlogin "$PEELER_HOSTS" --workdir .} \
    "${PEELER:-peeler}" render "$@" --chunk "{}/$chunks" --skip-existing --threads 1
