#!/usr/bin/env bash
# The strategies adc, mcmc and budget side by side on data sets: the time that each takes to adc's final PSNR on
# held-out views, and its final PSNR at adc's number of splats, which is the budget of the two others; and where adc and
# budget end in a run of a share of the iterations, whose rates and growth are made for it.
#   tools/strategies.sh [-o OUT] [-n ITERATIONS] [-s "SEED..."] [-e EVALUATIONS] [-p PERCENT] SET...
#                       [-- options of darb train...]
# Default: -o strategies -n 30000 -s 0 -e 30 -p 40. Runs lie in OUT/SET/STRATEGY/seedN: finished ones are kept, one that
# was interrupted goes on. Times are those of training alone; run it on a quiet machine. DARB= names another command.
set -euo pipefail

usage() { sed -n '2,9s/^# \{0,1\}//p' "$0" >&2; exit 2; }
fail() { echo "strategies.sh: $*" >&2; exit 2; }
out=strategies iterations=30000 seeds=0 evaluations=30 percent=40 sets=() options=()
while [[ $# -gt 0 ]]; do
    case $1 in
        -o) out=${2:?} ;;
        -n) iterations=${2:?} ;;
        -s) seeds=${2:?} ;;
        -e) evaluations=${2:?} ;;
        -p) percent=${2:?} ;;
        --) shift; options=("$@"); break ;;
        -*) usage ;;
        *) sets+=("$1"); shift; continue ;;
    esac
    shift 2
done
[[ ${#sets[@]} -gt 0 ]] || usage
[[ $iterations -ge $evaluations && $evaluations -ge 1 ]] || fail "fewer iterations than evaluations"
darb=${DARB:-$(cd "$(dirname "$0")/.." && pwd)/build/darb}
[[ -x $darb ]] || fail "$darb is not built; name another with DARB="

names=("${sets[@]%/}")
[[ $(printf '%s\n' "${names[@]##*/}" | sort -u | wc -l) == "${#sets[@]}" ]] || fail "two data sets of one name"

[[ $percent -ge 1 && $percent -le 99 ]] || fail "-p $percent is no share in percent of a whole run"
short=$((iterations * percent / 100))
[[ $short -ge $evaluations ]] || fail "-p $percent: fewer iterations than evaluations"

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
        run "$set" "$folder/adc_$percent/seed$seed" "$short" --seed "$seed" --strategy adc
        splats=$(value "$folder/adc/seed$seed/metrics.json" splats)
        for strategy in mcmc budget; do
            run "$set" "$folder/$strategy/seed$seed" "$iterations" --seed "$seed" --strategy "$strategy" \
                --budget "$splats"
        done
        run "$set" "$folder/budget_$percent/seed$seed" "$short" --seed "$seed" --strategy budget --budget "$splats"
    done
done

python3 - "$out" "$iterations" "$seeds" "$percent" "${sets[@]}" <<'PYTHON'
import json
import os
import sys

out, iterations, seeds, percent, sets = sys.argv[1], int(sys.argv[2]), sys.argv[3].split(), sys.argv[4], sys.argv[5:]


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


print(f"\n{iterations} iterations, {percent} % of them where the name says so, seeds {' '.join(seeds)}: means over the seeds, "
      "times in s of training alone\n")
print("| set | strategy | splats | PSNR dB | SSIM | whole run | to adc's final PSNR | seeds that got there |")
print("|---|---|---|---|---|---|---|---|")
for name in sets:
    rows = {}
    for strategy in ("adc", f"adc_{percent}", "mcmc", "budget", f"budget_{percent}"):
        for seed in seeds:
            path = os.path.join(out, os.path.basename(name.rstrip("/")), strategy, f"seed{seed}", "metrics.json")
            metrics = json.load(open(path))
            goal = rows["adc"][len(rows.get(strategy, []))]["psnr_db"] if strategy != "adc" else None
            last = metrics["evaluations"][-1]
            rows.setdefault(strategy, []).append({
                "splats": metrics["splats"], "psnr_db": last["psnr_db"], "ssim": last["ssim"],
                "seconds": metrics["seconds"],
                "to": time_to(metrics["evaluations"], last["psnr_db"] if goal is None else goal)})
    for strategy, runs in rows.items():
        there = [r["to"] for r in runs if r["to"] is not None]
        to = f"{mean(there):.1f}" if there else "-"
        print(f"| {os.path.basename(name.rstrip('/'))} | {strategy} | {mean([r['splats'] for r in runs]):.0f} | "
              f"{mean([r['psnr_db'] for r in runs]):.2f} | {mean([r['ssim'] for r in runs]):.4f} | "
              f"{mean([r['seconds'] for r in runs]):.1f} | {to} | {len(there)} of {len(runs)} |")
PYTHON
