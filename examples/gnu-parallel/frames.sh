#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Renders frames and views with several processes, on this machine or on others, or runs another verb over them. A
# second run does the chunks that failed.
#   sh frames.sh CHUNKS JOBS [render] SCENE -o OUT.@@@@.####.exr --frames 0-95 --views 8 [more options]
#   sh frames.sh CHUNKS JOBS flatten IN.@@@@.####.exr -o OUT.@@@@.####.png [more options]
set -eu
chunks=$1 jobs=$2 verb=render
shift 2
case $1 in render | flatten | convert | merge | view | extract | sheet)
    verb=$1
    shift
    ;;
esac
log=${PEELER_JOBLOG:-peeler.joblog}

# The log of the previous run lists the finished chunks. It is used only if the command line is the same.
again=
[ ! -s "$log" ] || again=--resume-failed
# After a failure (no scene, no disk space, …), running jobs finish and no new jobs start. Each process has one thread,
# because there are many processes.
# shellcheck disable=SC2086  # an option or nothing
seq "$chunks" | parallel --quote --jobs "$jobs" --joblog "$log" $again --halt soon,fail=1 \
    --termseq TERM,5000,KILL,25 ${PEELER_HOSTS:+--sshlogin "$PEELER_HOSTS" --workdir .} \
    "${PEELER:-peeler}" "$verb" "$@" --chunk "{}/$chunks" --skip-existing --threads 1
