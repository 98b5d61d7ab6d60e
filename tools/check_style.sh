#!/usr/bin/env bash
# Include arrows, guards of the hard cases and layout of every source file, and the links of every page; prints each
# violation.
#   tools/check_style.sh [--fix] [ROOT]      --fix: let clang-format rewrite the files
set -uo pipefail
case ${1:-} in -h | --help) sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 0 ;; esac

fix=0
[[ ${1:-} == --fix ]] && { fix=1; shift; }
here=$(cd "$(dirname "$0")" && pwd)
cd "${1:-$here/..}" || exit 2

failed=0

python3 "$here/check_includes.py" . || failed=1
python3 "$here/links.py" --root . || failed=1
# python3 "$here/spdx.py" --root . --check || failed=1    # to be enabled once tools/spdx.py has written the lines
[[ ! -f tools/guards.py ]] || python3 tools/guards.py check || failed=1
[[ ! -f tools/price_of_determinism.py ]] || python3 tools/price_of_determinism.py --check || failed=1
[[ ! -f tools/new_attribute.py ]] || python3 tools/new_attribute.py --check || failed=1

folders=()
for folder in engine trainer viewer tools examples tests shaders; do
    [[ -d $folder ]] && folders+=("$folder")
done
mapfile -t cpp < <(find "${folders[@]}" -name '*.cpp' -o -name '*.h' | sort)

if [[ $fix == 1 ]]; then
    clang-format-14 -i "${cpp[@]}"
elif clang-format-14 --dry-run -Werror --ferror-limit=1 "${cpp[@]}"; then
    echo "layout: ${#cpp[@]} files, clean"
else
    echo "layout: run tools/check_style.sh --fix"
    failed=1
fi
exit "$failed"
