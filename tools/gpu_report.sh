#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Measures darb on this machine's GPU and leaves a folder with a page that you can attach to a report.
#   tools/gpu_report.sh [-o FOLDER] [--darb PATH] [--device NAME] [--photos DATASET] [--minutes N]
#
#   -o FOLDER          where to write; default: gpu_report. Its page is FOLDER/index.html, all of it FOLDER.tar.gz.
#   --darb PATH        the command; default: build/darb here, else the installed one, else it is built
#   --device NAME      as of `darb devices`; default: the one that darb takes
#   --photos DATASET   also train 500 iterations on photos of your own
#   --minutes N        time limit of all steps together; default: 10
#
# Each step has its own file in FOLDER and a share of the time. If a step fails or takes too long, the page says so and
# the other steps still run. Nothing is sent anywhere. The page names the device, its driver and the processor, but no
# path, name or address of this machine.
set -uo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
out=gpu_report darb= device=() photos= minutes=10
usage() { sed -n '3,/^[^#]/s/^# \{0,1\}//p' "$0"; }
while (($#)); do
    case $1 in
        -h | --help) usage; exit 0 ;;
        -o | --darb | --device | --photos | --minutes)
            (($# > 1)) || { echo "gpu_report.sh: $1 needs a value" >&2; exit 2; }
            case $1 in
                -o) out=$2 ;;
                --darb) darb=$2 ;;
                --device) device=(--device "$2") ;;
                --photos) photos=$2 ;;
                --minutes) minutes=$2 ;;
            esac
            shift 2 ;;
        *) echo "gpu_report.sh: no such option: '$1'; --help lists them" >&2; exit 2 ;;
    esac
done
[[ $minutes =~ ^[1-9][0-9]*$ ]] || { echo "gpu_report.sh: --minutes takes a whole number from 1, not '$minutes'" >&2; exit 2; }
[[ -z $photos || -e $photos ]] || { echo "gpu_report.sh: no folder '$photos' (--photos)" >&2; exit 2; }
[[ -z $photos ]] || photos=$(realpath "$photos") # so that the page can remove it
[[ ! -e $out || -e $out/steps.txt ]] || { echo "gpu_report.sh: '$out' exists and is not an earlier report; name another folder with -o" >&2; exit 2; }
if [[ -z $darb ]]; then
    if [[ -x $here/build/darb ]]; then darb=$here/build/darb
    elif command -v darb >/dev/null; then darb=$(command -v darb)
    else
        (cd "$here" && tools/setup.sh && cmake --preset release && cmake --build --preset release --target darb) || exit 1
        darb=$here/build/darb
    fi
fi
"$darb" --version >/dev/null || { echo "gpu_report.sh: '$darb' does not run" >&2; exit 2; }
mkdir -p "$out" || exit 2
out=$(cd "$out" && pwd)
# Removes the files of an earlier report.
for name in devices passes check bench filled forms growth train photos validation model; do
    rm -f "$out/$name.txt" "$out/$name.json"
done

# step NAME PERCENT COMMAND...: the output goes to NAME.txt, and a row NAME, state, seconds to steps.txt. Time that a
# step does not use goes to the next one.
spare=0
step() {
    local name=$1 limit=$((minutes * 60 * $2 / 100 + spare)) begun=$SECONDS state
    shift 2
    echo "$name, at most $limit s"
    timeout --signal=INT --kill-after=10 "$limit" "$@" >"$out/$name.txt" 2>&1
    case $? in
        0) state=ok ;;
        124 | 137) state="stopped after $limit s" ;;
        *) state=FAILED ;;
    esac
    spare=$((limit > SECONDS - begun ? limit - (SECONDS - begun) : 0))
    printf '%s\t%s\t%s\n' "$name" "$state" $((SECONDS - begun)) >>"$out/steps.txt"
    echo "  $state, $((SECONDS - begun)) s"
}
: >"$out/steps.txt"
step devices 5 "$darb" devices "${device[@]}"
step passes 10 "$darb" devices --passes "${device[@]}" --json "$out/passes.json"
step check 25 "$darb" check "${device[@]}"
step bench 15 "$darb" bench 'random_100k|sort/|scan/|tuning' "${device[@]}" --seconds 0.5 --samples 5 --json "$out/bench.json"
step filled 5 "$darb" bench 'train/(filled|trained)' "${device[@]}" --seconds 0.5 --samples 5 --json "$out/filled.json"
# Every form of passes for few, large splats, on a scene that has such; the first row is the device's own choice.
trained_forms() {
    for forms in '' lists=digits,depths=four,emit=splats,tiles=rows,sums=splats lists=counts depths=three emit=slots tiles=longest sums=chunks lists=counts,depths=three,emit=slots,tiles=longest,sums=chunks; do
        echo "--tune ${forms:-(as measured)}"
        DARB_TUNE=$forms "$darb" bench train/trained "${device[@]}" --seconds 0.3 --samples 5 || return
    done
}
export -f trained_forms
export darb
step forms 8 bash -c 'device=("$@"); trained_forms' bash "${device[@]}"
step growth 8 "$darb" bench --growth "${device[@]}" --seconds 0.2 --samples 3 --json "$out/growth.json"
if [[ -d $here/assets/scene ]]; then
    step train 15 "$darb" train "$here/assets/scene" -o "$out/scene" "${device[@]}" --iterations 300 --eval
fi
[[ -z $photos ]] || step photos 15 "$darb" train "$photos" -o "$out/photos" "${device[@]}" --iterations 500 -r 400 --eval
if compgen -G '/usr/share/vulkan/explicit_layer.d/*validation*' >/dev/null && [[ -d $here/assets/scene ]]; then
    step validation 10 env DARB_VALIDATION=1 "$darb" train "$here/assets/scene" -o "$out/validation" "${device[@]}" --iterations 20
    # Messages of the layer do not end a run.
    grep -q 'vulkan.validation:' "$out/validation.txt" && sed -i 's/^validation\tok/validation\tFAILED/' "$out/steps.txt"
fi
if [[ -s $out/passes.json ]]; then
    step model 2 bash -c 'python3 -B "$@" && python3 -B "$@" --trained --emit slots --sums chunks' bash \
        "$here/tools/lab/gpu_model.py" "$out/passes.json"
fi
python3 -B "$here/tools/lab/gpu_report_page.py" "$out" ${photos:+"$photos"} || exit 1
find "$out" -name 'checkpoint*' -delete
tar -C "$(dirname "$out")" -czf "$out.tar.gz" "$(basename "$out")"
echo "the page: $out/index.html"
echo "all of it, to attach: $out.tar.gz"
! grep -q FAILED "$out/steps.txt"
