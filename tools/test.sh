#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Sets up, builds and runs the checks of the project. tests/labels.cmake says which tests belong to a step. It ends with
# what failed and then "N passed, N failed", which counts cases of tests, and one for each other step.
set -uo pipefail
cd "$(dirname "$0")/.." || exit 1

standard="setup style release unit sync gpu clang sanitize fuzz"
usage='usage: tools/test.sh [full | quick | STEP...]
  full       setup style release unit sync gpu clang sanitize fuzz: under 30 minutes on two cores; the default
  quick      setup style release unit
  setup      install missing packages            style     include arrows, links, clang-format
  release    build with gcc; warnings are errors  unit      tests without a device; the Python module in use
  sync       device tests under validation        gpu       the others: training, numerics, processes, scripts
  clang      build what reads files with ASan and UBSan, and the fuzzers
  sanitize   unit tests of that build             fuzz      a second of each fuzzer
  pipelines  the same for commands and device     includes  build with clang, without precompiled headers
  long       device tests that take minutes       python    all of tests/python, with PyTorch
  tidy       clang-tidy on every file             lab       the checks of tools/lab, and its programs
  windows    builds darb for Windows on Debian 12, and tries it under Wine
  libcxx     after release: whether all compiles with clang and libc++, as on macOS'
case "${1:-full}" in
    full) steps=$standard ;;
    quick) steps="setup style release unit" ;;
    -h | --help) echo "$usage"; exit 0 ;;
    *) steps=$* ;;
esac
logs=$(mktemp -d) && trap 'rm -rf "$logs"' EXIT
passed=0 failed=0 skipped=0 failures=()
build() { # PRESET [TARGET...]: goes on after an error, so that all errors are shown
    cmake --preset "$1" -DDARB_WERROR=ON >"$logs/configure" 2>&1 || { cat "$logs/configure"; return 1; }
    cmake --build --preset "$1" -j "$(nproc)" ${2:+--target "${@:2}"} -- -k 0
}
run_tests() { # BUILD LABEL [OPTION...]: tests start one thread per core themselves, so two at a time are enough
    local good bad out status
    rm -f "$1/Testing/Temporary/LastTest.log"
    ctest --test-dir "$1" --output-on-failure --no-tests=error -j2 -L "^$2\$" "${@:3}" 2>&1 | tee "$logs/ctest"
    status=${PIPESTATUS[0]}
    cat "$logs/ctest" >>"$logs/$step"
    read -r good bad out < <(awk -f tests/count_cases.awk "$logs/ctest" "$1/Testing/Temporary/LastTest.log")
    passed=$((passed + good)) failed=$((failed + bad)) skipped=$((skipped + out))
    return "$status"
}
logged() { "$@" 2>&1 | tee "$logs/$step"; }
sanitized() { ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1 run_tests build-asan sanitized --timeout 300 "$@"; }
readers='core|kernels|scene|data|mesh|trainer' # libraries that read files, and those below them
run_step() {
    case $1 in
        setup) logged tools/setup.sh ;;
        style) logged tools/check_style.sh ;;
        release) logged build release ;;
        unit | gpu | long) run_tests build "$1" ;;
        sync) DARB_VALIDATION=1 run_tests build sync --timeout 300 ;;
        clang) IFS='|' read -ra names <<<"$readers" && logged build asan "${names[@]/%/_unit_tests}" fuzzers make_seeds ;;
        sanitize) sanitized -R "^($readers)_unit_tests\\." ;;
        fuzz) logged tools/fuzz.sh 0.02 ;;
        includes) logged build clang ;;
        pipelines) logged build asan && sanitized ;;
        python) logged tools/setup.sh --with-python --with-torch && logged build python && run_tests build-python python ;;
        tidy) logged tools/check_style.sh --tidy ;;
        windows) logged tools/setup.sh --with-windows && logged tools/windows.sh build test package ;;
        libcxx) logged tools/lab/libcxx.py build ;;
        lab) logged build lab && logged tools/lab/check.sh ;;
        *) echo "$usage" >&2; exit 2 ;;
    esac
}
for step in $steps; do
    echo "=== $step"
    begun=$SECONDS before=$((passed + failed))
    if run_step "$step"; then word=ok; else word=FAILED failures+=("$step"); fi
    [[ $((passed + failed)) != "$before" ]] || { [[ $word == ok ]] && passed=$((passed + 1)) || failed=$((failed + 1)); }
    echo "=== $step: $word, $((SECONDS - begun)) s"
    [[ $word == ok || ! " setup release clang " == *" $step "* ]] || break # nothing after this could run
done
for step in ${failures[@]+"${failures[@]}"}; do
    echo "=== $step, what failed:"
    grep -A 30 -E '\*\*\*(Failed|Timeout|Exception)|^\[  FAILED  \].*ms\)' "$logs/$step" | head -120 || tail -n 60 "$logs/$step"
done
echo "$SECONDS s, $skipped skipped (they name what they miss)${failures[*]:+; failed steps: ${failures[*]}}"
echo "$passed passed, $failed failed"
[[ ${#failures[@]} == 0 ]]
