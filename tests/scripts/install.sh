#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# The programs of docs/library.md, word for word, and those of examples/, built against an installed darb alone, and run.
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
# A program of one's own trains the same bits as the command.
prefix/bin/darb train "$root/assets/scene" -o command -r 4 --iterations 30 --kernel raised_cosine -q
scene=point_cloud/iteration_30/point_cloud.ply
cmp "run/$scene" "command/$scene"
cp "run/$scene" scene.ply
prefix/bin/darb info scene.ply
[[ -s view.png ]]
cmake -G Ninja -S "$root/examples" -B examples -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_CXX_COMPILER="${CXX:-c++}"
cmake --build examples
examples/train_scene "$root/assets/scene" trained.ply 60 | tee trained
awk '/^PSNR/ { psnr = $2 } END { exit !(psnr > 15 && psnr < 60) }' trained
examples/render_scene trained.ply drawn.png
[[ $(file -b drawn.png) == "PNG image data, 960 x 720"* ]]
out/repaint scene.ply >losses
awk 'NR == 1 { first = $2 } END { exit !(NR == 20 && $2 < first / 2) }' losses
status=0
out/reconstruct /nowhere 30 2>message || status=$?
[[ $status == 2 ]]
grep -q '^error: /nowhere' message
