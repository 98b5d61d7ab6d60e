#!/usr/bin/env bash
# Include arrows, guards of the hard cases, file length and layout of every source file, and the length of the sentences
# of every page; prints each violation.
#   tools/check_style.sh [--fix] [ROOT]      --fix: let clang-format rewrite the files
set -uo pipefail
case ${1:-} in -h | --help) sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 0 ;; esac

fix=0
[[ ${1:-} == --fix ]] && { fix=1; shift; }
here=$(cd "$(dirname "$0")" && pwd)
cd "${1:-$here/..}" || exit 2

cpp_cap=500 command_cap=150 glsl_cap=250 # lines
failed=0

python3 "$here/check_includes.py" . || failed=1
python3 "$here/prose.py" --check --root . || failed=1
[[ ! -f tools/guards.py ]] || python3 tools/guards.py check || failed=1
[[ ! -f tools/price_of_determinism.py ]] || python3 tools/price_of_determinism.py --check || failed=1
[[ ! -f tools/new_attribute.py ]] || python3 tools/new_attribute.py --check || failed=1

folders=()
for folder in engine trainer viewer tools tests shaders; do
    [[ -d $folder ]] && folders+=("$folder")
done
mapfile -t cpp < <(find "${folders[@]}" -name '*.cpp' -o -name '*.h' | sort)
mapfile -t glsl < <(find "${folders[@]}" -name '*.comp' -o -name '*.glsl' | sort)

long=0
for file in "${cpp[@]}" "${glsl[@]}"; do
    case $file in
        *.comp | *.glsl) cap=$glsl_cap ;;
        tools/darb/*.cpp) cap=$command_cap ;;
        *) cap=$cpp_cap ;;
    esac
    lines=$(wc -l <"$file")
    if ((lines > cap)); then
        echo "$file:1: $lines lines, the cap is $cap"
        long=$((long + 1))
    fi
done
echo "length: $((${#cpp[@]} + ${#glsl[@]})) files, $long over the cap"
[[ $long == 0 ]] || failed=1

if [[ $fix == 1 ]]; then
    clang-format-14 -i "${cpp[@]}"
elif clang-format-14 --dry-run -Werror --ferror-limit=1 "${cpp[@]}"; then
    echo "layout: ${#cpp[@]} files, clean"
else
    echo "layout: run tools/check_style.sh --fix"
    failed=1
fi
exit "$failed"
