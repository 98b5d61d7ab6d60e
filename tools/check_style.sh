#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Include arrows and layout of every source file, and the links of every page; prints each violation.
#   tools/check_style.sh [--fix | --tidy] [ROOT]
#     --fix    let clang-format rewrite the files
#     --tidy   run clang-tidy instead, on every source file (it takes minutes); .clang-tidy lists its checks
set -uo pipefail
case ${1:-} in -h | --help) sed -n '3,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 0 ;; esac

fix=0 tidy=0
[[ ${1:-} == --fix ]] && { fix=1; shift; }
[[ ${1:-} == --tidy ]] && { tidy=1; shift; }
here=$(cd "$(dirname "$0")" && pwd)
cd "${1:-$here/..}" || exit 2

failed=0

if [[ $tidy == 1 ]]; then
    command -v clang-tidy-14 >/dev/null || { echo "check_style.sh: --tidy runs clang-tidy-14; install that package" >&2; exit 2; }
    cmake -S . -B build-tidy -G Ninja -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON \
        -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DDARB_TESTS=OFF >/dev/null || exit 1
    ninja -C build-tidy generated/constants/darb_constant_names.h >/dev/null || exit 1 # a generated header
    git ls-files 'engine/*.cpp' 'trainer/*.cpp' 'viewer/*.cpp' 'tools/*.cpp' |
        xargs -P "$(nproc)" -n 8 clang-tidy-14 -p build-tidy --quiet --warnings-as-errors='*' 2>/dev/null || exit 1
    echo "tidy: clean"
    exit 0
fi

python3 "$here/check_includes.py" . || failed=1
python3 "$here/links.py" --root . || failed=1
python3 "$here/spdx.py" --root . --check || failed=1

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
