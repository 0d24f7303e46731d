#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# An animation by several processes, on this machine or on others; run again, it does what failed.
#   sh frames.sh CHUNKS JOBS SCENE -o OUT.####.exr --frames 0-95 [more options of peeler render]
set -eu
chunks=$1 jobs=$2
shift 2
log=${PEELER_JOBLOG:-peeler.joblog}

# The log of the run before, if it was of the same command line, says which chunks are done.
again=
[ ! -s "$log" ] || again=--resume-failed
# A failure (no scene, no disk space, …) lets what runs end and starts nothing more. A thread for each
# process, since there are many of them.
# shellcheck disable=SC2086  # an option or nothing
seq "$chunks" | parallel --quote --jobs "$jobs" --joblog "$log" $again --halt soon,fail=1 \
    --termseq TERM,5000,KILL,25 ${PEELER_HOSTS:+--sshlogin "$PEELER_HOSTS" --workdir .} \
    "${PEELER:-peeler}" render "$@" --chunk "{}/$chunks" --skip-existing --threads 1
