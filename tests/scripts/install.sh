#!/usr/bin/env bash
# The program of docs/library.md, word for word, built against an installed darb alone, and run.
#   install.sh BUILD_FOLDER
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
build=$(cd "$1" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

block() { sed -n "/^\`\`\`$1\$/,/^\`\`\`\$/p" "$root/docs/library.md" | sed '1d;$d'; } # LANGUAGE
mkdir program
block cmake >program/CMakeLists.txt
block cpp >program/reconstruct.cpp

cmake --install "$build" --prefix "$work/prefix" >/dev/null
prefix/bin/darb --version
cmake -G Ninja -S program -B out -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_CXX_COMPILER="${CXX:-c++}"
cmake --build out
out/reconstruct "$root/assets/scene" 30
prefix/bin/darb info scene.ply
[[ -s view.png ]]
status=0
out/reconstruct /nowhere 30 2>message || status=$?
[[ $status == 2 ]]
grep -q '^error: /nowhere' message
