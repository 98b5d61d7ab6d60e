#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Several ranks by mpirun: a scene has the same bits on 1, 2 and 4 of them, and what goes wrong on one ends all.
#   ranks.sh BUILD quick   two ranks and one, a resume in between
#   ranks.sh BUILD long    strategies, kernels and effects on 1, 2 and 4; data sets, kills and stops
set -uo pipefail
build=${1:?the build folder} what=${2:-quick}
root=$(cd "$(dirname "$0")/../.." && pwd)
darb=$build/darb
command -v mpirun >/dev/null || { echo "skipped: no mpirun (tools/setup.sh --with-mpi)"; exit 77; }
"$darb" --version | grep -q '^with ' || { echo "skipped: $darb is built without MPI"; exit 77; }
# shellcheck source=check.sh
source "$(dirname "$0")/check.sh"

export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1
export OMPI_MCA_btl_base_warn_component_unused=0
data=$root/assets/scene

# train RANKS FOLDER OPTIONS...: the words of all ranks into FOLDER.log.
train() {
    local ranks=$1 out=$2
    shift 2
    timeout 300 mpirun -n "$ranks" "$darb" train "$data" -o "$out" --batch 4 --no-report -q "$@" >"$out.log" 2>&1
}
scene() { sha256sum <"$1"/point_cloud/iteration_"$2"/point_cloud.ply; }
same() { # NAME FOLDER FOLDER ITERATION
    [[ -s $2/point_cloud/iteration_$4/point_cloud.ply ]] || { echo "FAILED  $1: no scene"; cat "$2.log"; failed=1; return; }
    check "$1" "^$(scene "$2" "$4")\$" "$(scene "$3" "$4")"
}

run=(-r 50 --densify-from-iter 6 --densification-interval 6 --densify-until-iter 40)
train 1 "$folder/one" "${run[@]}" --iterations 30 --checkpoint-iterations 20
train 2 "$folder/two" "${run[@]}" --iterations 30
same 'two ranks leave what one leaves' "$folder/one" "$folder/two" 30
for ranks in 1 2; do train "$ranks" "$folder/grid.$ranks" -r 50 --exposure-grid --iterations 12; done
same 'two ranks train the grids of exposure that one trains' "$folder/grid.1" "$folder/grid.2" 12
if [[ -x $build/make_scene ]]; then
    "$build/make_scene" depths "$folder/scene_with_depths"
    for ranks in 1 2; do
        data=$folder/scene_with_depths train "$ranks" "$folder/depth.$ranks" -r 50 --iterations 12 --effects +depth
    done
    train 1 "$folder/colour" -r 50 --iterations 12
    same 'two ranks train by the depths that one trains by' "$folder/depth.1" "$folder/depth.2" 12
    [[ $(scene "$folder/depth.1" 12) != $(scene "$folder/colour" 12) ]] || { echo 'FAILED  depths changed nothing'; failed=1; }
else
    echo 'skipped  training by depths: the build has no make_scene (-DDARB_LAB=ON)'
fi
for ranks in 1 2; do
    mpirun -n "$ranks" "$darb" eval "$folder/one" "$data" -r 50 -q --json "$folder/eval.$ranks" >"$folder/eval.log" 2>&1
done
[[ -s $folder/eval.1 && -s $folder/eval.2 ]] || { echo "FAILED  eval: no figures"; cat "$folder/eval.log"; failed=1; }
check 'two ranks measure what one measures' "^$(sha256sum <"$folder/eval.1")\$" "$(sha256sum <"$folder/eval.2")"
compare=(compare "$data" -r 50 --iterations 10 --kernels gaussian,sinc --blending-views 1 -q)
for ranks in 1 2; do
    timeout 300 mpirun -n "$ranks" "$darb" "${compare[@]}" -o "$folder/compare.$ranks" >"$folder/compare.log" 2>&1
    grep -hE '"(psnr_db|ssim|kernel|seed|splats|failure|notes|blended_per_pixel)"' "$folder/compare.$ranks/compare.json" >"$folder/figures.$ranks"
done
[[ $(grep -c '"psnr_db": [0-9]' "$folder/figures.1") -gt 1 ]] || { echo "FAILED  compare: no figures"; cat "$folder/compare.log"; failed=1; }
check 'two ranks compare what one compares' "^$(sha256sum <"$folder/figures.1")\$" "$(sha256sum <"$folder/figures.2")"
mkdir "$folder/photos"
ln -s "$data/images" "$folder/photos/images"
cp "$data/transforms_train.json" "$folder/photos"
said=$(timeout 100 mpirun -n 2 "$darb" train "$folder/photos" -o "$folder/refused" --batch 2 -r 50 -q 2>&1)
check 'two ranks do not begin from stereo' 'no points, and stereo in their place is not begun by 2 ranks' "$said"
check 'they say how to begin instead' 'or use --start random' "$said"
check 'they leave no folder' '^none$' "$(ls "$folder/refused" 2>/dev/null || echo none)"
[[ $what == long ]] || exit "$failed"

train 4 "$folder/four" "${run[@]}" --iterations 30 --start-checkpoint "$folder/one/chkpnt20.darb"
same 'four ranks go on where one stopped' "$folder/one" "$folder/four" 30
for kernel in gaussian raised_cosine; do
    for strategy in adc budget mcmc; do
        options=("${run[@]}" --kernel "$kernel" --strategy "$strategy" --max-splats 4600 --iterations 62)
        case $strategy in
            adc) options+=(--effects all) ;;  # exposure, anti-aliasing, lenses
            budget) options+=(--sh-rest-every 8 --effects +sh) ;;
        esac
        name=${kernel}_$strategy
        train 1 "$folder/$name.1" "${options[@]}"
        train 2 "$folder/$name.2" "${options[@]}" --checkpoint-iterations 36
        train 4 "$folder/$name.4" "${options[@]}"
        train 4 "$folder/$name.resumed" "${options[@]}" --start-checkpoint "$folder/$name.2/chkpnt36.darb"
        for ranks in 2 4 resumed; do
            same "$name, $ranks" "$folder/$name.1" "$folder/$name.$ranks" 62
        done
    done
done

# What is wrong with one rank is said once, by its number, and ends all.
text=$(mpirun -n 3 "$darb" train "$data" -o "$folder/three" --batch 4 -q 2>&1)
check 'three ranks have no equal parts' 'no equal parts for 3 ranks' "$text"
mixed=(train "$data" -o "$folder/mixed" -r 50 --iterations 44 --batch 2 --no-report -q)
text=$(mpirun -n 1 "$darb" "${mixed[@]}" : -n 1 "$darb" "${mixed[@]}" --seed 4 2>&1)
check 'other settings are told' 'rank 1 has the settings .*"seed":4' "$text"
cp "$darb" "$folder/other" && printf 'x' >>"$folder/other"
text=$(mpirun -n 1 "$darb" "${mixed[@]}" : -n 1 "$folder/other" "${mixed[@]}" 2>&1)
check 'another build is told' 'rank 1 has the program' "$text"
mkdir "$folder/two_sets" && cp -r "$data" "$folder/two_sets/scene"
mapfile -t photos < <(find "$folder/two_sets" -name '*.jpg' -o -name '*.png' | sort)
cp "${photos[0]}" "${photos[1]}"
text=$(mpirun -n 1 "$darb" "${mixed[@]}" : -n 1 "$darb" train "$folder/two_sets/scene" "${mixed[@]:2}" 2>&1)
check 'another data set is told' 'rank 1 has the data set' "$text"
text=$(mpirun -n 1 "$darb" "${mixed[@]}" : -n 1 "$darb" "${mixed[@]}" --tune backward=buckets 2>&1)
check 'devices that round differently are told' 'rank 1 has the tuning .*buckets' "$text"
mpirun -n 1 "$darb" "${mixed[@]}" --allow-mixed --densify-from-iter 10 : \
    -n 1 "$darb" "${mixed[@]}" --allow-mixed --densify-from-iter 10 --tune backward=buckets >"$folder/mixed.log" 2>&1
check '--allow-mixed trains with them' 'point_cloud.ply' "$(cat "$folder/mixed.log")"

text=$(mpirun -n 1 "$darb" eval "$folder/one" "$data" -r 50 : -n 1 "$darb" eval "$folder/gaussian_mcmc.1" "$data" -r 50 2>&1)
check 'another scene is told' 'rank 1 has the scene' "$text"
text=$(mpirun -n 1 "$darb" eval "$folder/one" "$data" -r 50 : -n 1 "$darb" eval "$folder/one" "$data" -r 50 --split all 2>&1)
check 'other views are told' 'rank 1 has the views' "$text"
compare=(compare "$data" -r 50 --iterations 20 --seeds 1 -q)
text=$(mpirun -n 1 "$darb" "${compare[@]}" -o "$folder/compare" --kernels gaussian : \
    -n 1 "$darb" "${compare[@]}" -o "$folder/compare" --kernels sinc 2>&1)
check 'other runs of a comparison are told' 'rank 1 has the runs with seeds 1, kernels sinc' "$text"
mpirun -n 2 "$darb" train "$data" -o "$folder/ended" -r 50 --iterations 100000 --densify-until-iter 0 --batch 4 \
    --checkpoint-interval 1000000 -q >"$folder/ended.log" 2>&1 &
pid=$!
sleep 8
kill -TERM "$pid"
wait "$pid"
check 'a run that is ended saves' '.' "$(ls "$folder/ended/checkpoint.darb" 2>&1 | grep -v 'No such')"

# fault NAME SIGNAL RANK PATTERN: a rank gets the signal in the middle; every process ends, and the run goes on.
fault() {
    local out=$folder/fault pid start victim
    rm -rf "$out"
    mpirun -n 2 "$darb" train "$data" -o "$out" -r 50 --iterations 100000 --densify-until-iter 0 --batch 4 \
        --checkpoint-interval 40 -q >"$out.log" 2>&1 &
    pid=$!
    for _ in {1..300}; do [[ -s $out/checkpoint.darb ]] && break; sleep 0.1; done
    victim=$(pgrep -P "$pid" -f "darb train" | sort -n | sed -n "$(($3 + 1))p")
    start=$SECONDS
    kill "-$2" "$victim"
    wait "$pid" && { echo "FAILED  $1: exit code 0"; failed=1; }
    check "$1: ends within 30 s" '^([0-9]|[12][0-9])$' "$((SECONDS - start))"
    check "$1: names the rank" "$4" "$(cat "$out.log")"
    [[ -z $(pgrep -f "train $data -o $out ") ]] || { echo "FAILED  $1: processes are left"; failed=1; }
    check "$1: goes on" '.' "$(timeout 5 mpirun -n 1 "$darb" train "$data" -o "$out" -r 50 --iterations 100000 \
        --densify-until-iter 0 --batch 4 --resume 2>&1 | grep 'resumed .* at iteration')"
}
fault 'rank 1 is killed' KILL 1 'rank 1 '
fault 'rank 0 is killed' KILL 0 'rank 0 '
fault 'rank 1 is stopped' STOP 1 'error: rank 1 of 2 on .* has said nothing'
fault 'rank 0 is stopped' STOP 0 'error: rank 0 of 2 on .* has said nothing'
exit "$failed"
