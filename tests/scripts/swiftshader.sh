#!/usr/bin/env bash
# SwiftShader, the second driver that executes: darb check passes whole. Skips (77) where Debian's chromium, which brings it, is not installed.
#   swiftshader.sh BUILD
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
on_swiftshader=(env "VK_DRIVER_FILES=$folder/icd.json" "VK_ICD_FILENAMES=$folder/icd.json" "XDG_CACHE_HOME=$folder" "$darb")
"${on_swiftshader[@]}" check >"$folder/check" || { grep -B 3 FAIL "$folder/check" | head -60; exit 1; }
tail -n 1 "$folder/check"
