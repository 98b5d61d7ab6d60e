#!/usr/bin/env bash
# Sets up, builds and runs every check that a commit must pass; under 30 minutes on two cores.
# Ends with the names of what failed, then "N passed, N failed" (cases of all runs, plus one per other step).
set -uo pipefail
cd "$(dirname "$0")/.." || exit 1

all_steps="setup style release unit sync gpu clang sanitize fuzz"
usage() {
    cat <<TEXT
usage: tools/test.sh [full | quick | STEP...]      (default: full, which is all before includes)
  setup      install missing packages (tools/setup.sh)
  style      include arrows, links, clang-format (tools/check_style.sh)
  release    build with gcc, warnings are errors; with the Python module
  unit       tests that need no device, and the Python module's import, a picture and some iterations
  sync       the quick device tests, under Vulkan synchronization validation
  gpu        the other device tests: training, long frames, numerics, scripts
  clang      build what reads files, its unit tests and the fuzzers with clang, ASan and UBSan; warnings are errors
  sanitize   unit tests of that build
  fuzz       the fuzzers of that build, a second each (tools/fuzz.sh)
  includes   build all with clang without precompiled headers: a forgotten include is an error
  pipelines  build command and tests with clang, ASan and UBSan, and run all unit tests and the quick ones of pipelines
  long       device tests that take minutes
  python     all of tests/python: installs PyTorch, builds the module and the command
  quick      = setup style release unit
TEXT
}

case "${1:-full}" in
    full) steps=$all_steps ;;
    quick) steps="setup style release unit" ;;
    -h | --help) usage; exit 0 ;;
    *) steps=$* ;;
esac
for step in $steps; do
    [[ " $all_steps includes pipelines long python " == *" $step "* ]] || { usage >&2; exit 2; }
done

jobs=$(nproc)
passed=0 failed=0 skipped=0 failures=() failed_cases=()
logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT

# Device tests start their own threads, one per core, so two at a time are plenty.
# A device test runs once here, under validation (sync) or without (gpu); those of pipelines also under sanitizers, in
# the step of that name, a process a case.
# Without validation: cases whose name ends in _slow, those that look at SPIR-V or at other vector widths;
# those in _long in the step of that name.
long='_long(/|$| )' # a space: ctest adds the parameter
gpu_alone="_slow(/|\$)|$long|PassSpirv|_at_vector_width_"
# Of the device, with no more host code than others, the same host code for long, or none that reads files of users: not
# under sanitizers.
# Names are those of suites, for pipelines those of cases. ctest takes nine groups in all of an expression.
numerics='\.(StrategyTable|ClusterRows|Undistort)$|every[a-z_]*/|settings/|Reference/|WalkCases|TuningWalk|^Psi\.|\.Psi$|HardCases|EffectPicture|EffectTraining|for_every_kernel$|Accuracy_switch_changes|^trained_command_test$'
# Of processes and of scripts, seconds each: they find nothing new under sanitizers or validation.
once='^(scripts|pages)\.|Outputs\.|\.Outputs$'
# Passes that other tests also record, with other numbers: without validation.
same_passes='^(kernel_gradient|walk|accuracy_walk|hard_case|blend|blend_backward|project|effect_picture|viewer_picture)_test$'
without_validation="$gpu_alone|$once|$same_passes"
# Passed, failed and skipped cases of ctest's output and its log, by the numbers of its tests: those of GoogleTest one by
# one, any other test as one.
count_cases='
NR == FNR {
    if (match($0, /Test +#[0-9]+: /)) {
        number = substr($0, RSTART, RLENGTH)
        gsub(/[^0-9]/, "", number)
        state[number] = /\*\*\*Skipped|\(Disabled\)/ ? "out" : / Passed +[0-9.]+ sec$/ ? "good" : "bad"
    }
    next
}
/^[0-9]+\/[0-9]+ Testing: / { number = $1 + 0 }
/^\[       OK \] .* ms\)$/ { ++good[number] }
/^\[  FAILED  \] .* ms\)$/ { ++bad[number] }
/^\[  SKIPPED \] .* ms\)$/ { ++out[number] }
END {
    for (t in state) {
        if (state[t] == "good" && good[t] + out[t] == 0) good[t] = 1
        if (state[t] == "bad" && bad[t] == 0) bad[t] = 1
        if (state[t] == "out" && out[t] == 0) out[t] = 1
        g += good[t]; b += bad[t]; o += out[t]
    }
    print g + 0, b + 0, o + 0
}'
run_ctest() {
    local preset=$1 log
    log=$(mktemp "$logs/$step.XXXX")
    shift
    local cases=$preset/Testing/Temporary/LastTest.log
    rm -f "$cases"
    ctest --test-dir "$preset" --output-on-failure --no-tests=error -j2 "$@" 2>&1 | tee "$log"
    local status=${PIPESTATUS[0]} good bad out
    mapfile -t -O "${#failed_cases[@]}" failed_cases < <( # ctest's own list at its end, and GoogleTest's cases
        sed -nE "/^The following tests FAILED:/,\$ s/^[[:space:]]+[0-9]+ - (.*)/$step: \1/p" "$log"
        sed -nE "s/^\[  FAILED  \] (.*) \([0-9]+ ms\)\$/$step: \1/p" "$log")
    [[ -e $cases ]] || cases=/dev/null # ctest found nothing to run
    read -r good bad out < <(awk "$count_cases" "$log" "$cases")
    passed=$((passed + good)) failed=$((failed + bad)) skipped=$((skipped + out))
    [[ $status == 0 || $bad != 0 ]] || failed=$((failed + 1))
    return "$status"
}

build() {
    if ! cmake --preset "$1" >"$logs/configure" 2>&1; then
        cat "$logs/configure"
        return 1
    fi
    cmake --build --preset "$1" -j "$jobs" ${2:+--target "${@:2}"} -- -k 0 # every error, not only the first
}

# With the drivers of drivers.gpu_compilers_slow, which skips where they cannot be had.
do_setup() {
    tools/setup.sh || return 1
    [[ -e build/gpu_compilers/bookworm-backports-radeon.json ]] || timeout 120 tools/gpu_compilers.py fetch build/gpu_compilers ||
        echo "setup: AMD's driver for the test of its compiler cannot be had here"
}
do_style() { tools/check_style.sh; }
do_release() { build release; }
# Libraries that read files, and what those stand on: the rest is in the step `pipelines`.
read -ra readers <<<"core kernels scene data trainer"
do_clang() { build asan "${readers[@]/%/_unit_tests}" fuzzers make_seeds; }
do_unit() { run_ctest build -L '^unit$'; }
do_sync() { DARB_VALIDATION=1 run_ctest build -L '^(shader|pipeline)$' -E "$without_validation" --timeout 300; }
do_gpu() {
    local status=0
    run_ctest build -L '^training$' -E "$long" || status=1
    run_ctest build -L '^(shader|pipeline)$' -R "$without_validation" -E "$long" || status=1
    return "$status"
}
do_includes() { build clang; }
do_long() { run_ctest build -R "$long"; }
do_python() { tools/setup.sh --with-python --with-torch && build python && run_ctest build-python -R '^python\.'; }
run_sanitized() { # LABEL [options of ctest]
    ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1 \
        run_ctest build-asan -L "^$1\$" -E "$gpu_alone|$once|$numerics" --timeout 300 "${@:2}"
}
do_sanitize() { run_sanitized unit -R "^($(IFS='|' && echo "${readers[*]}"))_unit_tests\."; }
do_pipelines() { build asan && run_sanitized '(unit|pipeline)'; }
do_fuzz() { tools/fuzz.sh 0.02; }

started=$SECONDS
for step in $steps; do
    echo "=== $step"
    begun=$SECONDS
    if [[ " sanitize fuzz " == *" $step "* && " ${failures[*]-} " == *" clang "* ]]; then
        echo "=== $step: left out, its build failed"
        continue
    fi
    case $step in
        unit | gpu | sanitize | sync | pipelines | long | python) # counted case by case
            "do_$step"
            status=$?
            ;;
        *)
            "do_$step" 2>&1 | tee "$logs/$step.log"
            status=${PIPESTATUS[0]}
            if [[ $status == 0 ]]; then passed=$((passed + 1)); else failed=$((failed + 1)); fi
            ;;
    esac
    [[ $status == 0 ]] || failures+=("$step")
    echo "=== $step: $([[ $status == 0 ]] && echo ok || echo FAILED), $((SECONDS - begun)) s"
    # Nothing that follows can run without packages or without a build.
    [[ $status == 0 || ! " setup release " == *" $step "* ]] || break
done

# What failed, once more, as whoever sees only the end needs it.
for step in ${failures[@]+"${failures[@]}"}; do
    echo "=== $step, what failed:"
    case $step in
        unit | gpu | sanitize | sync | pipelines | long | python) grep -h -A 30 -E '\*\*\*(Failed|Timeout|Exception)' "$logs/$step".* | head -120 ;;
        *) tail -n 60 "$logs/$step.log" ;;
    esac
done
[[ ${#failures[@]} == 0 ]] || echo "failed steps: ${failures[*]}"
[[ ${#failed_cases[@]} == 0 ]] || printf 'failed case: %s\n' "${failed_cases[@]}"
echo "$((SECONDS - started)) s, $skipped skipped (they name what they miss)"
echo "$passed passed, $failed failed"
[[ ${#failures[@]} == 0 && $failed == 0 ]]
