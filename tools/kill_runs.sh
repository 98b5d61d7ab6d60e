#!/usr/bin/env bash
# Kills a training run with SIGKILL at random moments, KILLS times (default 50), resumes it each time, and compares
# the scene with that of a run nobody killed: it must be the same to the byte. No checkpoint may be unreadable.
#   tools/kill_runs.sh [KILLS]
set -euo pipefail
cd "$(dirname "$0")/.."

darb=${DARB:-build/darb} # the command under test
kills=${1:-50}
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
options=(assets/scene -r 8 -q --iterations 1000 --checkpoint-interval 5 --densify-from-iter 20
    --densification-interval 20 --opacity-reset-interval 50)
scene=point_cloud/iteration_1000/point_cloud.ply
"$darb" train "${options[@]}" -o "$out/whole" >/dev/null
killed=0 tries=0
while ((killed < kills)); do
    resume=()
    [[ ! -f $out/killed/checkpoint.darb ]] || resume=(--resume)
    ((++tries <= kills * 4)) || { echo "the run ends before it is killed"; exit 1; }
    "$darb" train "${options[@]}" "${resume[@]}" -o "$out/killed" >"$out/log" 2>&1 &
    run=$!
    sleep "$((RANDOM % 3)).$((RANDOM % 10))$((RANDOM % 10))"
    if kill -9 $run 2>/dev/null; then killed=$((killed + 1)); fi
    status=0
    wait $run 2>/dev/null || status=$?
    if [[ $status == 2 ]]; then
        cat "$out/log"
        echo "kill $killed: the run could not go on"
        exit 1
    fi
    # Done before its kill: kill the next one from the start.
    if [[ -f $out/killed/$scene ]]; then
        cmp "$out/whole/$scene" "$out/killed/$scene"
        rm -rf "$out/killed"
    fi
done
"$darb" train "${options[@]}" $([[ -f $out/killed/checkpoint.darb ]] && echo --resume) -o "$out/killed" >/dev/null
cmp "$out/whole/$scene" "$out/killed/$scene"
echo "$killed of $kills kills survived, the scene is the same to the byte"
