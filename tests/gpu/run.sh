#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# sh run.sh: tests a build on this machine's GPU within 9 minutes, in the folder made by pack.sh. Writes results.* (a
# page and JSON). The exit code is 0 if everything passed. Without a GPU, runs the same tests in software.
# PEELER_GPU_SECONDS is the total time (default: 540). sh run.sh PART runs one part, and prints its findings.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
. "$here/common.sh"
work=$here/work
results=$here/results

# The parts in order, each with its share of the time. Later parts may use time left by earlier parts.
parts="devices 2  tests 46  methods 13  backends 8  references 8  lost 4  frames 9  benchmark 10"

# The skipped GL tests. They need Embree, or compare a software EGL with OSMesa.
embree=ClosedMeshes.*:Clip.ABallKeepsAsManyLayersAsEmbreeFindsHitsInside
osmesa=Backends.*:Shadows.AreTheSameOnBothBackends

methods="front-to-back two-pass back-to-front dual dual-max" # all but the default, a-buffer
growth=16777216 # the bytes by which a process may grow while it renders frames, once a tenth of them are done

say() { # say passed|failed|skipped|measured WHAT TEXT
    printf '%s\t%s\t%s\n' "$1" "$2" "$(printf '%s' "$3" | tr '\n\t' '; ')"
}

number() { # number KEY FILE: prints the last value of a key in JSON that has one key per line
    sed -n 's/^ *"'"$1"'": \(.*[^,]\),*$/\1/p' "$2" | tail -n 1 | tr -d '"'
}

# judge WHAT FOUND EXPECTED NAME: checks that two files have the same fragments of a scene, or fragments that differ
# within limits.
judge() {
    if cmp -s "$2" "$3"; then
        say passed "$1" "the same bytes, $(number fragmentsStored "$work/report.json") fragments"
        return
    fi
    fragments "$3" >"$work/expected"
    fragments "$2" >"$work/found"
    verdict=passed
    text=$(awk -f "$here/classify.awk" "$here/references/$4.moved" "$work/expected" "$work/found") || verdict=failed
    case $text in
    *" 0 other depth, 0 other colour, 0 at edges, 0 beyond"*)
        verdict=failed
        text="$text; the files differ in what is not compared by class"
        ;;
    esac
    say $verdict "$1" "$text"
}

captured() { # captured NAME OUT [OPTIONS]: captures a scene as it was captured for the package; reports a failure
    name=$1 out=$2
    shift 2
    capture "$name" "$out" "$here/references/$name.json" --report "$work/report.json" "$@" 2>"$work/error" ||
        { say failed "$name $*" "exit code $?: $(head -n 3 "$work/error")"; return 1; }
}

names() {
    awk '!/^#/ { print $1 }' "$here/references.txt"
}

render_any() { # render_any OPTIONS: renders the quickest scene, and writes its report
    peeler render "$here/scenes/panes.glb" -o "$work/any.png" --size 64x36 --quiet --report "$work/any.json" "$@"
}

devices() {
    peeler devices --json >"$work/devices.json"
    if ! render_any 2>"$work/error"; then
        say failed device "$(head -n 3 "$work/error")"
        return
    fi
    mv "$work/any.json" "$work/device.json"
    say passed device "$(number backend "$work/device.json"): $(number renderer "$work/device.json")"
    say measured commit "packed at commit $(cat "$here/commit")"
    say measured machine "$(peeler --version), $(nproc) processors, $(getconf GNU_LIBC_VERSION)"
    if render_any --require-gpu 2>"$work/error"; then
        say passed GPU "there is one"
    else
        say skipped GPU "all is done in software: $(head -n 1 "$work/error")"
        touch "$work/software"
    fi
}

tests() {
    say skipped "$embree" "Embree is not packed"
    say skipped "$osmesa" "they compare EGL with OSMesa in software"
    PEELER_TEST_BACKEND=$(number backend "$work/device.json")
    PEELER_SOURCE=$here
    export PEELER_TEST_BACKEND PEELER_SOURCE
    for shard in 0 1 2 3 4 5 6 7; do
        # LP_NUM_THREADS=0: no extra threads for the software rasteriser, as under ctest.
        (
            code=0
            GTEST_TOTAL_SHARDS=8 GTEST_SHARD_INDEX=$shard LP_NUM_THREADS=0 LD_LIBRARY_PATH=$libraries \
                timeout --foreground -k 5 $((PART_SECONDS - 8)) "$here/bin/gl_tests" --gtest_filter="-$embree:$osmesa" \
                >"$work/tests.$shard" 2>&1 || code=$?
            echo "[ended with $code]" >>"$work/tests.$shard"
        ) &
    done
    wait
    for shard in 0 1 2 3 4 5 6 7; do
        awk -v shard=$((shard + 1)) '
            function say(verdict, what, text) { printf "%s\t%s\t%s\n", verdict, what, text }
            /^\[ RUN      \]/ { test = $4; text = ""; next }
            /^\[       OK \]/ { ++passed; test = ""; next }
            /^\[  SKIPPED \] .* ms\)$/ { say("skipped", test, text); test = ""; next }
            /^\[  FAILED  \] .* ms\)$/ { say("failed", test, text); test = ""; next }
            test != "" { gsub(/\t/, " "); if (length(text) < 400) text = text (text == "" ? "" : "; ") $0 }
            /^\[ended with / {
                code = $3 + 0
                how = code == 124 ? "it took too long" : "it ended with exit code " code
                if (code > 1) say("failed", "shard " shard, how ", in " test)
                say(passed ? "passed" : "failed", "shard " shard, passed + 0 " tests passed")
            }' "$work/tests.$shard"
    done
}

methods() {
    for name in $(names); do
        captured "$name" "$work/default.npz" || continue
        different=
        for method in $methods; do
            captured "$name" "$work/method.npz" --method "$method" || { different="$different $method"; continue; }
            cmp -s "$work/default.npz" "$work/method.npz" || different="$different $method"
        done
        if [ -z "$different" ]; then
            say passed "$name" "a-buffer, $(echo "$methods" | sed 's/ /, /g'): the same bytes"
        else
            say failed "$name" "not the same as by a-buffer:$different"
        fi
    done
}

# Compares the GPU, or the software rasteriser in its place, with the packed rasteriser.
backends() {
    if [ ! -f "$here/lib/osmesa/libOSMesa.so.8" ]; then
        say skipped all "no libOSMesa.so.8 was packed"
        return
    fi
    if ! (libraries=$mesa && render_any --backend osmesa) 2>"$work/error"; then
        say skipped all "what was packed does not run here: $(head -n 3 "$work/error")"
        return
    fi
    for name in $(names); do
        (libraries=$mesa && captured "$name" "$work/software.npz" --backend osmesa) || continue
        captured "$name" "$work/found.npz" || continue
        judge "$name" "$work/found.npz" "$work/software.npz" "$name"
    done
}

references() {
    awk '!/^#/' "$here/references.txt" | while read -r name fragments layers; do
        captured "$name" "$work/found.npz" || continue
        judge "$name" "$work/found.npz" "$here/references/$name.npz" "$name"
        found="$(number fragmentsStored "$work/report.json") fragments in $(number layers "$work/report.json") layers"
        [ "$found" = "$fragments fragments in $layers layers" ] ||
            say measured "$name" "$found, where it was packed $fragments in $layers"
    done
}

# Preloads a libEGL that reports a lost context.
lost() {
    if [ "$(number backend "$work/device.json")" != egl ]; then
        say skipped all "there is no EGL whose context could be lost"
        return
    fi
    set -- "$here/scenes/jellyfish.glb" --size 64x36 --quiet --frames 1-3 --backend egl
    peeler render "$@" -o "$work/kept.%d.exr"
    libraries=$here/lib/fake_egl:$libraries
    for when in 1 4 9; do
        code=0
        PEELER_FAKE_EGL_LOST=$when peeler render "$@" -o "$work/again.%d.exr" 2>"$work/error" || code=$?
        same=0
        for frame in 1 2 3; do
            cmp -s "$work/kept.$frame.exr" "$work/again.$frame.exr" && same=$((same + 1))
        done
        [ "$code $same" = "0 3" ] && grep -q 'once more' "$work/error" && verdict=passed || verdict=failed
        say $verdict "once, at call $when" "exit code $code, $same of 3 frames the same bytes, $(tail -n 1 "$work/error")"
    done
    code=0
    PEELER_FAKE_EGL_LOST=9+ peeler render "$@" -o "$work/again.%d.exr" 2>"$work/error" || code=$?
    [ $code = 5 ] && verdict=passed || verdict=failed
    say $verdict "for good" "exit code $code"
}

frames() {
    count=2000
    if [ -f "$work/software" ]; then
        count=200
        say skipped "2,000 frames" "in software $count have to do"
    fi
    mkdir -p "$work/frames"
    code=0
    peeler render "$here/scenes/jellyfish.glb" -o "$work/frames/####.png" --frames 1-$count --size 16x9 --samples 1 \
        --quiet --report "$work/frames.json" 2>"$work/error" || code=$?
    rm -rf "$work/frames"
    if [ $code != 0 ]; then
        say failed "$count frames" "exit code $code: $(head -n 3 "$work/error")"
        return
    fi
    # The report has, for each frame, the peak of resident memory so far.
    set -- $(sed -n 's/^ *"peakMemory": \([0-9]*\),*$/\1/p' "$work/frames.json" |
        awk -v early=$((count / 10)) 'NR == early { first = $1 } END { print NR, first, $1 }')
    [ "$1" = $count ] && [ $(($3 - $2)) -le $growth ] && verdict=passed || verdict=failed
    say $verdict "$count frames" \
        "$1 rendered, $(($2 >> 20)) MiB resident at most after a tenth of them, $(($3 >> 20)) MiB after all"
}

# Times ways to count and sort, peeler's own and others (gpu_choices.cpp).
choices() {
    size="1920 1080 5"
    [ ! -f "$work/software" ] || size="480 270 3"
    # shellcheck disable=SC2086  # three numbers
    if ! LD_LIBRARY_PATH=$libraries "$here/bin/gpu_choices" $size >"$work/choices.measured.json" 2>"$work/error"; then
        say failed choices "$(head -n 3 "$work/error")"
        return
    fi
    say passed choices "all ways to count and to sort agree"
    awk '/^ "(counting|sorting)"/ { gsub(/[ ":{]/, ""); what = $0 }
        /^  ".*: {$/ { gsub(/^  "|": {$/, ""); name = $0; line = "" }
        /^   "/ { gsub(/[",:]/, ""); line = line (line == "" ? "" : ", ") $1 " " ($2 ~ /[.]/ ? sprintf("%.2f", $2) : $2) }
        /^  }/ { print what " " name ":" line }' "$work/choices.measured.json" |
        while IFS=: read -r what line; do
            say measured "$what, ms" "$line"
        done
}

benchmark() {
    choices
    for name in engine glasses plant; do
        peeler render "$here/scenes/$name.glb" -o "$work/$name.exr" --size 1920x1080 --quiet \
            --report "$work/$name.measured.json"
        say measured "$name, 1920 x 1080, all layers, ms" "$(awk '/"milliseconds"/ { inside = 1; next }
            inside && /:/ { gsub(/[",:]/, ""); printf "%s %s %.0f", separator, $1, $2; separator = "," }' \
            "$work/$name.measured.json")"
    done
    report=$work/rays.measured.json
    peeler rays "$here/scenes/engine.glb" -o "$work/hits.npz" --directions 8 --resolution 512 --engine gl --quiet \
        --report "$report"
    say measured "hits of 8 bundles through engine" "$(awk '
        /"hits"/ { hits = $2 + 0 }
        /"(count|capture|sort)"/ { ms += $2 }
        END { printf "%d hits, %.1f million a second counted, captured and sorted", hits, hits / ms / 1e3 }' "$report")"
}

# write_results SECONDS: writes the page from the findings of the parts, and the JSON from the commands' JSON. Sets
# `code` to 1 if anything failed.
write_results() {
    awk -F '\t' -v when="$(date -u +%FT%TZ)" -v seconds="$1" -v page="${results}.md" -v json="${results}.json" '
        function quoted(text) {
            gsub(/\\/, "\\\\", text)
            gsub(/"/, "\\\"", text)
            gsub(/[\001-\037]/, " ", text)
            return "\"" text "\""
        }
        {
            if (!($1 in count)) order[++parts] = $1
            ++count[$1]
            ++verdicts[$1, $3]
            ++total[$3]
            line[NR] = $0
            if ($3 == "time") took[$1] = $4
        }
        END {
            verdict = total["failed"] ? "FAILED" : "passed"
            printf "# peeler on this machine: %s\n\n%s, %d s\n\n", verdict, when, seconds >page
            print "| part | passed | failed | skipped | s |\n| --- | ---: | ---: | ---: | ---: |" >page
            for (i = 1; i <= parts; ++i) {
                part = order[i]
                printf "| %s | %d | %d | %d | %d |\n", part, verdicts[part, "passed"], verdicts[part, "failed"],
                    verdicts[part, "skipped"], took[part] >page
            }
            split("failed skipped measured passed", sections, " ")
            for (s = 1; s <= 4; ++s) {
                if (total[sections[s]]) printf "\n## %s\n\n", sections[s] >page
                for (i = 1; i <= NR; ++i) {
                    split(line[i], field, "\t")
                    if (field[3] == sections[s]) printf "- %s, %s: %s\n", field[1], field[4], field[5] >page
                }
            }
            printf "{\"verdict\": %s, \"when\": %s, \"seconds\": %d,\n\"checks\": [", quoted(verdict), quoted(when), seconds >json
            for (i = 1; i <= NR; ++i) {
                split(line[i], field, "\t")
                if (field[3] == "time") continue
                printf "%s\n{\"part\": %s, \"verdict\": %s, \"what\": %s, \"text\": %s}", separator, quoted(field[1]),
                    quoted(field[3]), quoted(field[4]), quoted(field[5]) >json
                separator = ","
            }
            printf "]" >json
            exit total["failed"] > 0
        }' "$work/results" || code=1
    for report in "$work/devices.json" "$work"/*.measured.json; do
        [ -s "$report" ] || continue
        name=${report##*/}
        printf ',\n"%s": ' "${name%%.*}"
        cat "$report"
    done >>"${results}.json"
    echo "}" >>"${results}.json"
}

if [ $# = 1 ]; then
    "$1"
    exit
fi

rm -rf "$work" "${results}.md" "${results}.json"
mkdir "$work"
begin=$(date +%s)
deadline=$((begin + ${PEELER_GPU_SECONDS:-540}))
shares=100
set -- $parts
while [ $# -gt 0 ]; do
    start=$(date +%s)
    PART_SECONDS=$(((deadline - start) * $2 / shares))
    [ "$PART_SECONDS" -gt 0 ] || PART_SECONDS=1 # 0 would mean no limit
    shares=$((shares - $2))
    export PART_SECONDS
    code=0
    timeout -k 5 "$PART_SECONDS" sh "$here/run.sh" "$1" >"$work/said" 2>"$work/complained" || code=$?
    case $code in
    0) ;;
    124 | 137) say failed "the whole part" "it took more than $PART_SECONDS s" >>"$work/said" ;;
    *) say failed "the whole part" "exit code $code: $(tail -n 3 "$work/complained")" >>"$work/said" ;;
    esac
    took=$(($(date +%s) - start))
    awk -v part="$1" -v took=$took '{ print part "\t\t" $0 } END { print part "\t\ttime\t" took }' "$work/said" \
        >>"$work/results"
    echo "$1: $(grep -c '^passed' "$work/said") passed, $(grep -c '^failed' "$work/said") failed, $took s"
    shift 2
done
code=0
write_results $(($(date +%s) - begin))
echo "${results}.md: exit code $code"
exit $code
