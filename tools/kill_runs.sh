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
checkpoint=$out/killed/checkpoint.darb

# Returns after a random number of new checkpoints and up to a second, or when the run has ended. Counted in
# checkpoints, the moment lies within training on a slow machine too.
random_moment() {
    local left=$((RANDOM % 4)) before now
    before=$(stat -c %.Y "$checkpoint" 2>/dev/null || true)
    while ((left > 0)) && kill -0 "$1" 2>/dev/null; do
        sleep 0.02
        now=$(stat -c %.Y "$checkpoint" 2>/dev/null || true)
        [[ $now == "$before" ]] || left=$((left - 1))
        before=$now
    done
    sleep "0.$((RANDOM % 10))$((RANDOM % 10))"
}

"$darb" train "${options[@]}" -o "$out/whole" >/dev/null
killed=0 resumed=0 tries=0
while ((killed < kills)); do
    resume=()
    [[ ! -f $checkpoint ]] || resume=(--resume)
    ((++tries <= kills * 4)) || { echo "the run ends before it is killed"; exit 1; }
    "$darb" train "${options[@]}" "${resume[@]}" -o "$out/killed" >"$out/log" 2>&1 &
    run=$!
    random_moment $run
    if kill -9 $run 2>/dev/null; then
        killed=$((killed + 1))
        [[ ! -f $checkpoint ]] || resumed=$((resumed + 1))
    fi
    status=0
    wait $run 2>/dev/null || status=$?
    if [[ $status != 0 && $status != 137 ]]; then
        cat "$out/log"
        echo "kill $killed: the run ended with status $status"
        exit 1
    fi
    # Done before its kill: kill the next one from the start.
    if [[ -f $out/killed/$scene ]]; then
        cmp "$out/whole/$scene" "$out/killed/$scene"
        rm -rf "$out/killed"
    fi
done
"$darb" train "${options[@]}" $([[ -f $checkpoint ]] && echo --resume) -o "$out/killed" >/dev/null
cmp "$out/whole/$scene" "$out/killed/$scene"
echo "$killed of $kills kills survived, $resumed of them with a checkpoint to resume; the scene is the same to the byte"
((resumed * 2 > kills)) || { echo "too few kills fell into training"; exit 1; }
