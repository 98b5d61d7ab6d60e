#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# The strategies adc, mcmc and budget side by side on data sets: the time that each takes to adc's final PSNR on
# held-out views, and its final PSNR at adc's number of splats, which is the budget of the two others. STRATEGY_P is a run
# of P percent of the iterations, whose rates and growth are made for it.
#   tools/lab/strategies.sh [-o OUT] [-n ITERATIONS] [-s "SEED..."] [-e EVALUATIONS] [-t "STRATEGY[_P]..."] SET...
#                       [-- options of darb train...]
# Default: -o strategies -n 30000 -s 0 -e 30 -t "adc_40 mcmc budget budget_60"; adc is always there. Runs lie in
# OUT/SET/STRATEGY/seedN: finished ones are kept, one that was interrupted goes on. Times are those of training alone;
# run it on a quiet machine. Beside the table all evaluations go to OUT/strategies.json. DARB= names another command.
set -euo pipefail
case ${1:-} in -h | --help) sed -n '3,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 0 ;; esac

usage() { sed -n '3,10s/^# \{0,1\}//p' "$0" >&2; exit 2; }
fail() { echo "strategies.sh: $*" >&2; exit 2; }
out=strategies iterations=30000 seeds=0 evaluations=30 sets=() options=()
strategies="adc_40 mcmc budget budget_60"
while [[ $# -gt 0 ]]; do
    case $1 in
        -o) out=${2:?} ;;
        -n) iterations=${2:?} ;;
        -s) seeds=${2:?} ;;
        -e) evaluations=${2:?} ;;
        -t) strategies=${2:?} ;;
        --) shift; options=("$@"); break ;;
        -*) usage ;;
        *) sets+=("$1"); shift; continue ;;
    esac
    shift 2
done
[[ ${#sets[@]} -gt 0 ]] || usage
[[ $iterations -ge $evaluations && $evaluations -ge 1 ]] || fail "fewer iterations than evaluations"
darb=${DARB:-$(cd "$(dirname "$0")/../.." && pwd)/build/darb}
[[ -x $darb ]] || fail "$darb is not built; name another with DARB="

names=("${sets[@]%/}")
[[ $(printf '%s\n' "${names[@]##*/}" | sort -u | wc -l) == "${#sets[@]}" ]] || fail "two data sets of one name"

length() { # STRATEGY[_P]
    local percent=100
    [[ $1 != *_* ]] || percent=${1#*_}
    echo $((iterations * percent / 100))
}
for strategy in $strategies; do
    [[ $strategy =~ ^(adc|mcmc|budget)(_[1-9][0-9]*)?$ && $strategy != adc ]] ||
        fail "-t $strategy: none of adc_P, mcmc, mcmc_P, budget, budget_P"
    [[ $(length "$strategy") -ge $evaluations ]] || fail "-t $strategy: fewer iterations than evaluations"
done

value() { # FILE KEY
    python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))[sys.argv[2]])' "$1" "$2"
}

finished() { # FOLDER ITERATIONS
    [[ -f $1/metrics.json ]] && [[ $(value "$1/metrics.json" interrupted) == False ]] &&
        [[ $(value "$1/metrics.json" iteration) == "$2" ]]
}

run() { # SET FOLDER ITERATIONS options of darb train...
    local set=$1 folder=$2 length=$3 resume=() at=() k
    shift 3
    for ((k = 1; k <= evaluations; ++k)); do at+=($((length * k / evaluations))); done
    if finished "$folder" "$length"; then echo "$folder: is there" >&2; return; fi
    [[ ! -f $folder/checkpoint.darb ]] || resume=(--resume)
    echo "$folder" >&2
    "$darb" train "$set" -o "$folder" --eval --iterations "$length" --test-iterations "${at[@]}" \
        --save-iterations "$length" --no-report -q "${resume[@]}" "${options[@]}" "$@"
    finished "$folder" "$length" || { echo "strategies.sh: interrupted; the same command goes on" >&2; exit 1; }
}

for set in "${sets[@]}"; do
    for seed in $seeds; do
        folder=$out/$(basename "$set")
        run "$set" "$folder/adc/seed$seed" "$iterations" --seed "$seed" --strategy adc
        splats=$(value "$folder/adc/seed$seed/metrics.json" splats)
        for strategy in $strategies; do
            budget=()
            [[ $strategy == adc_* ]] || budget=(--budget "$splats")
            run "$set" "$folder/$strategy/seed$seed" "$(length "$strategy")" --seed "$seed" \
                --strategy "${strategy%_*}" "${budget[@]}"
        done
    done
done

python3 - "$out" "$iterations" "$seeds" "adc $strategies" "${sets[@]}" <<'PYTHON'
import json
import os
import sys

out, iterations, seeds, strategies, sets = sys.argv[1], sys.argv[2], sys.argv[3].split(), sys.argv[4].split(), sys.argv[5:]


def time_to(evaluations, psnr):
    """Seconds of training until the PSNR is first reached, linear between evaluations; None: never."""
    before = None
    for e in evaluations:
        if e["psnr_db"] >= psnr:
            if before is None:
                return e["seconds"]
            share = (psnr - before["psnr_db"]) / (e["psnr_db"] - before["psnr_db"])
            return before["seconds"] + share * (e["seconds"] - before["seconds"])
        before = e
    return None


def mean(values):
    return sum(values) / len(values)


print(f"\n{iterations} iterations, P % of them where the name ends in _P, seeds {' '.join(seeds)}: means over the seeds, "
      "times in s of training alone\n")
print("| set | strategy | splats | PSNR dB, lowest to highest | SSIM | whole run | share of adc's time | "
      "to adc's final PSNR | seeds that got there |")
print("|---|---|---|---|---|---|---|---|---|")
kept = []
for name in (os.path.basename(s.rstrip("/")) for s in sets):
    adc = None
    for strategy in strategies:
        runs = []
        for seed in seeds:
            metrics = json.load(open(os.path.join(out, name, strategy, f"seed{seed}", "metrics.json")))
            runs.append({"set": name, "strategy": strategy, "seed": int(seed),
                         **{key: metrics[key] for key in ("iteration", "splats", "seconds", "evaluations")}})
        kept += runs
        psnr = [r["evaluations"][-1]["psnr_db"] for r in runs]
        seconds = mean([r["seconds"] for r in runs])
        adc = adc or (psnr, seconds)
        there = [t for t in map(time_to, (r["evaluations"] for r in runs), adc[0]) if t is not None]
        print(f"| {name} | {strategy} | {mean([r['splats'] for r in runs]):.0f} | "
              f"{mean(psnr):.2f}, {min(psnr):.2f} to {max(psnr):.2f} | "
              f"{mean([r['evaluations'][-1]['ssim'] for r in runs]):.4f} | {seconds:.1f} | "
              f"{100 * seconds / adc[1]:.0f} % | {f'{mean(there):.1f}' if there else '-'} | "
              f"{len(there)} of {len(runs)} |")
with open(os.path.join(out, "strategies.json"), "w") as file:
    json.dump({"iterations": int(iterations), "runs": kept}, file, indent=1)
PYTHON
