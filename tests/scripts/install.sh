#!/usr/bin/env bash
# The programs of docs/library.md, word for word, built against an installed darb alone, and run.
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
block c++ >program/repaint.cpp
cat >>program/CMakeLists.txt <<'END'
add_executable(repaint repaint.cpp)
target_link_libraries(repaint PRIVATE darb::darb)
END

cmake --install "$build" --prefix "$work/prefix" >/dev/null
prefix/bin/darb --version
cmake -G Ninja -S program -B out -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_CXX_COMPILER="${CXX:-c++}"
cmake --build out
out/reconstruct "$root/assets/scene" 30
prefix/bin/darb info scene.ply
[[ -s view.png ]]
out/repaint scene.ply >losses
awk 'NR == 1 { first = $2 } END { exit !(NR == 20 && $2 < first / 2) }' losses
status=0
out/reconstruct /nowhere 30 2>message || status=$?
[[ $status == 2 ]]
grep -q '^error: /nowhere' message
