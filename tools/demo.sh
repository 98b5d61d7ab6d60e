#!/usr/bin/env bash
# Sets up, builds, trains the shipped scene and ends with the paths of a picture and a report.
#   tools/demo.sh [options of darb train]
set -euo pipefail
cd "$(dirname "$0")/.."

tools/setup.sh --no-tests
cmake --preset release -DDARB_TESTS=OFF >/dev/null
cmake --build --preset release --target darb
build/darb train assets/scene -o out/demo --eval --iterations 3000 "$@"
scene=$(find out/demo/point_cloud -name point_cloud.ply | sort -V | tail -1)
build/darb render "$scene" --cameras assets/scene -o out/demo/frames

echo "picture: $(find "$PWD/out/demo/frames" -name '*.png' | sort | head -1)"
echo "report:  $PWD/out/demo/report.html"
