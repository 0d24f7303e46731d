#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs missing packages (Debian 12 or 13), builds, checks the style and runs the tests; prints the time of each
# stage and the slowest tests at the end.
#   sh tests/run.sh            the short run: every test, with samples of large counts
#                              (PEELER_STYLE=unchecked skips the style, which depends on clang-format's release)
#   sh tests/run.sh -L unit    arguments go to ctest; the style is not checked
#   sh tests/run.sh all        everything, about an hour (tests/README.md, "What only all runs")
#   sh tests/run.sh plain      a build without a preset, and some of its tests
#   sh tests/run.sh coverage   the short run, and the lines of the product that it covers
#   sh tests/run.sh asan|ubsan|tsan [ARGUMENTS]   the short run, and the command on every model, with a
#                              sanitizer for memory errors and leaks, undefined behaviour, or races
#                              (tests/README.md, "Sanitizers"); arguments go to ctest
#   sh tests/run.sh mutations  breaks the product in one place at a time; the tests must detect it
#                              (tests/README.md, "Coverage and mutations")
#   sh tests/run.sh fuzz [TARGET|all] [SECONDS]   fuzzes programs that read files and command lines with
#                              libFuzzer, 60 seconds each (tests/README.md, "Fuzzing")
#   sh tests/run.sh bench      benchmarks, and writes tests/benchmarks/RESULTS.md; about an hour on
#                              2 idle cores; more options: tests/benchmarks/results.py
#   sh tests/run.sh compare BEFORE [FILTER]   runs the same command lines with another build of peeler and
#                              this one; prints every difference (compare_programs.py)
set -eu
cd "$(dirname "$0")/.."
python="/usr/bin/python3 -B" # Debian's own Python has Debian's packages

stages=
stage() { # stage NAME COMMAND...: runs the command, and records the time that it took
    name=$1
    shift
    start=$(date +%s)
    "$@"
    stages="$stages $name=$(($(date +%s) - start))"
}

places= # a command prefix that disables address randomisation where it must be disabled

build() {
    cmake --preset "$preset" ${PEELER_CMAKE_ARGUMENTS:-}
    $places cmake --build --preset "$preset" -j "$(nproc)"
}

# run_tests TEST_PRESET [ARGUMENTS for ctest]
run_tests() {
    rm -rf "build/$preset/tests/results"
    $places ctest --preset "$@" -j "$(nproc)" --output-junit tests/results/ctest.xml || failed=1
}

# Builds like packagers: without a preset, and each file as a unit of its own. Runs the tests that start quickly, and an
# eighth of those that draw or start programs.
plain() {
    cmake -B build/plain ${PEELER_CMAKE_ARGUMENTS:-} &&
        cmake --build build/plain -j "$(nproc)" &&
        ctest --test-dir build/plain -j "$(nproc)" -R '^(unit|fuzz|cli\.1|gl\.egl\.1|process\.1)' --output-on-failure || failed=1
}

preset=ci
failed=0
case ${1:-} in
bench)
    shift
    sh examples/install_dependencies.sh build bench
    cmake --preset ci ${PEELER_CMAKE_ARGUMENTS:-} >&2
    cmake --build --preset ci -j "$(nproc)" --target benchmarks >&2
    exec $python tests/benchmarks/results.py --build build/ci "$@"
    ;;
compare)
    shift
    sh examples/install_dependencies.sh build test
    cmake --preset ci ${PEELER_CMAKE_ARGUMENTS:-} >&2
    cmake --build --preset ci -j "$(nproc)" --target peeler >&2
    exec $python tests/compare_programs.py "${1:?which peeler to compare with}" build/ci/peeler ${2:+"$2"}
    ;;
fuzz)
    shift
    sh examples/install_dependencies.sh build test fuzz
    cmake --preset fuzz ${PEELER_CMAKE_ARGUMENTS:-}
    cmake --build --preset fuzz -j "$(nproc)"
    exec $python tests/fuzz/fuzz.py build/fuzz "$@"
    ;;
mutations)
    shift
    sh examples/install_dependencies.sh build test mutations
    exec $python tests/mutations.py "$@"
    ;;
coverage)
    preset=coverage
    stage install sh examples/install_dependencies.sh build test coverage
    stage build build
    find build/coverage -name '*.gcda' -delete
    stage tests run_tests coverage
    stage coverage $python tests/coverage.py build/coverage
    ;;
asan | ubsan | tsan)
    preset=$1
    # GCC 12's ThreadSanitizer fails ("unexpected memory mapping") at some addresses that kernels choose if they
    # randomise more than 28 bits.
    if [ "$preset" = tsan ] && [ "$(cat /proc/sys/vm/mmap_rnd_bits)" -gt 28 ]; then
        places="setarch --addr-no-randomize"
    fi
    stage install sh examples/install_dependencies.sh build test
    stage build build
    rm -f "build/$preset/reports/"*
    stage tests run_tests "$@"
    # The reports include errors in processes whose exit codes no test checks.
    for report in "build/$preset/reports/"*; do
        [ -e "$report" ] || continue
        failed=1
        head -n 60 "$report"
    done
    ;;
all)
    stage install sh examples/install_dependencies.sh build test datasets
    stage build build
    stage benchmarks cmake --build --preset ci -j "$(nproc)" --target benchmarks
    stage headers $python tests/single_files.py build/ci headers
    stage plain plain
    stage style sh tests/check_style.sh build/ci all
    stage tests run_tests all
    ;;
plain)
    stage install sh examples/install_dependencies.sh build test
    stage plain plain
    exit $failed
    ;;
"")
    stage install sh examples/install_dependencies.sh build test
    stage build build
    stage single-files $python tests/single_files.py build/ci || failed=1
    [ "${PEELER_STYLE:-}" = unchecked ] || stage style sh tests/check_style.sh build/ci
    stage tests run_tests ci
    ;;
*)
    stage install sh examples/install_dependencies.sh build test
    stage build build
    stage tests run_tests ci "$@"
    ;;
esac

# shellcheck disable=SC2086  # a list of words
$python tests/summary.py "build/$preset/tests/results" $stages || failed=1
exit $failed
