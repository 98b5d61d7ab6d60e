#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# SwiftShader, the second driver that executes. "train": 50 iterations of training end within 0.1 dB of those on the
# device that darb takes by itself. "check": darb check passes whole, which takes it minutes.
# Skips (77) where Debian's chromium, which brings it, is not installed.
#   swiftshader.sh BUILD train|check
set -euo pipefail
cd "$(dirname "$0")/../.."
darb=$1/darb library=/usr/lib/chromium/libvk_swiftshader.so
if [[ ! -e $library ]]; then
    echo "skipped: no $library; it comes with Debian's chromium"
    exit 77
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
printf '{"file_format_version": "1.0.0", "ICD": {"library_path": "%s", "api_version": "1.3.0"}}\n' "$library" \
    >"$folder/icd.json"
# To measure its passes takes it 40 s more. The checks take what GPUs begin with, but the forms for large splats, and the
# training takes what is the fastest here.
on_swiftshader=(env "VK_DRIVER_FILES=$folder/icd.json" "VK_ICD_FILENAMES=$folder/icd.json" "XDG_CACHE_HOME=$folder")
passes=blend=16x16,backward=team,loss=tiles,exp=polynomial
if [[ $2 == check ]]; then
    large=lists=counts,depths=three,emit=slots,tiles=longest,sums=chunks
    "${on_swiftshader[@]}" "DARB_TUNE=scan=subgroup,scatter=ballot,$large,$passes" "$darb" check >"$folder/check" || {
        grep -B 3 FAIL "$folder/check" | head -60
        exit 1
    }
    tail -n 1 "$folder/check"
    exit
fi

plain=lists=digits,depths=four,emit=splats,tiles=rows,sums=splats
train() { "$@" train assets/scene -q --no-report -r 25 --iterations 50 --eval -o "$folder/$name" >/dev/null; }
name=own train "$darb"
name=swiftshader train "${on_swiftshader[@]}" "DARB_TUNE=scan=thread,scatter=columns,$plain,$passes" "$darb"
python3 - "$folder" <<'PYTHON'
import json, sys
psnr = {name: json.load(open(f"{sys.argv[1]}/{name}/metrics.json"))["evaluations"][-1]["psnr_db"] for name in ("own", "swiftshader")}
print(f"held-out photos after 50 iterations: {psnr['swiftshader']:.3f} dB, on the own device {psnr['own']:.3f} dB")
sys.exit(abs(psnr["swiftshader"] - psnr["own"]) > 0.1)
PYTHON
