#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Runs darb.exe under Wine and Xvfb, and looks whether it does what the command for Linux does.
#   tests/scripts/wine.sh DARB.EXE [DARB [SCREENSHOT.PNG]]
# DARB is the command for Linux, beside which results are held. Wine gets a folder of its own, whose drive Z: is taken
# away: through that it would read /proc and other places that Windows has not. Exit code 77: something is missing.
set -uo pipefail
exe=$(realpath "$1") native=$(realpath -m "${2:-build/darb}") screenshot=$(realpath -m "${3:-build-windows/window.png}")
source=$(cd "$(dirname "$0")/../.." && pwd)
wine=$(command -v wine64 || echo /usr/lib/wine/wine64)
[[ -x $wine ]] || { echo "skipped: no wine64 (tools/setup.sh --with-windows)"; exit 77; }
command -v Xvfb >/dev/null || { echo "skipped: no Xvfb (tools/setup.sh --with-windows)"; exit 77; }
[[ -x $native ]] || { echo "skipped: no command for Linux at $native (cmake --build --preset release)"; exit 77; }

work=$(mktemp -d)
export WINEPREFIX=$work/wine WINEDEBUG=-all WINEDLLOVERRIDES="mscoree=;mshtml=;winemenubuilder.exe=" XDG_STATE_HOME=$work/state \
    MESA_SHADER_CACHE_DIR=$work/mesa LC_ALL=C.UTF-8
server=
finish() {
    WINEPREFIX=$work/wine wineserver_of -k
    [[ -z $server ]] || kill "$server" 2>/dev/null
    rm -rf "$work"
}
wineserver_of() { "$(command -v wineserver || echo /usr/lib/wine/wineserver)" "$@" 2>/dev/null; }
trap finish EXIT
failed=0
ok() { echo "ok      $1"; }
bad() { echo "FAILED  $1"; failed=1; tail -q -n 5 "$work/out" "$work/err" 2>/dev/null | sed 's/^/    /'; }

# The display takes the first free number, and says which.
mkdir -p "$work/screen"
Xvfb -displayfd 3 -screen 0 1280x800x24 -fbdir "$work/screen" 3>"$work/display" >/dev/null 2>&1 &
server=$!
for _ in $(seq 100); do [[ -s $work/display ]] && break; sleep 0.1; done
DISPLAY=:$(<"$work/display")
export DISPLAY
"$wine" wineboot -i >/dev/null 2>&1
wineserver_of -w
rm -f "$WINEPREFIX/dosdevices/z:"
c=$WINEPREFIX/drive_c/work # C:\work
mkdir -p "$c"
cp "$exe" "$c/darb.exe"
cp -r "$source/assets/scene" "$c/scene"
cd "$c" || exit 1

# darb ARGUMENTS...: on Windows, in C:\work. Its output is in $work/out and $work/err.
darb() { "$wine" 'C:\work\darb.exe' "$@" >"$work/out" 2>"$work/err"; }
linux() { "$native" "$@" >"$work/out" 2>"$work/err"; }
said() { grep -qF -- "$1" "$work/out" "$work/err"; }
# same NAME FILE OTHER: bit by bit; a difference is told and is no failure, as the C libraries differ.
same() {
    if cmp -s "$2" "$3"; then ok "$1: the same bits"; else echo "note    $1: other bits"; fi
}
must() { # NAME COMMAND...
    local name=$1
    shift
    if "$@"; then ok "$name"; else bad "$name"; fi
}

must "--version" darb --version
must "devices lists lavapipe" eval 'darb devices && said llvmpipe'
must "info describes a data set" eval 'darb info scene && said "views"'
must "plan" darb plan scene

train=(--iterations 100 --seed 1 --no-report)
must "100 iterations" eval 'darb train scene -o out "${train[@]}"'
linux train scene -o out-linux "${train[@]}"
ply=point_cloud/iteration_100/point_cloud.ply
same "the scene of 100 iterations, beside Linux" "out/$ply" "out-linux/$ply"
must "request.json has no backslash" eval '! grep -q "\\\\\\\\" out/request.json'
must "cfg_args has no backslash" eval '! grep -q "\\\\\\\\" out/cfg_args'

for ending in spz splat sog compressed.ply; do
    must "convert to .$ending" darb convert "out/$ply" "scene.$ending"
    linux convert "out/$ply" "linux.$ending"
    same ".$ending, beside Linux" "scene.$ending" "linux.$ending"
done
must "render" darb render out --cameras scene -r 8 -o pictures
linux render out --cameras scene -r 8 -o pictures-linux
count=$(find pictures -name '*.png' | wc -l)
equal=0
for picture in pictures-linux/*.png; do cmp -s "$picture" "pictures/${picture##*/}" && equal=$((equal + 1)); done
must "as many pictures as on Linux" [ "$count" = "$(find pictures-linux -name '*.png' | wc -l)" ]
echo "note    $equal of $count pictures have the bits of Linux"
must "check" darb check

# A run that is killed goes on, and ends as if nothing had been.
long=(--iterations 120 --seed 1 --no-report --checkpoint-interval 40)
must "a run to its end" darb train scene -o whole "${long[@]}"
"$wine" 'C:\work\darb.exe' train scene -o killed "${long[@]}" >"$work/out" 2>"$work/err" &
for _ in $(seq 3000); do [[ -e killed/checkpoint.darb ]] && break; sleep 0.02; done
kill -KILL $! 2>/dev/null
wineserver_of -k
wait $! 2>/dev/null
must "a run that is killed leaves a checkpoint and no scene" [ -e killed/checkpoint.darb -a ! -e "killed/point_cloud/iteration_120" ]
cp -r killed killed-linux
must "Linux goes on with the run of Windows" linux train scene -o killed-linux "${long[@]}" --resume
same "what Linux made of it, beside the run to its end" {whole,killed-linux}/point_cloud/iteration_120/point_cloud.ply
must "it goes on" darb train scene -o killed "${long[@]}" --resume
must "and ends with the bits of one that was not killed" cmp -s {whole,killed}/point_cloud/iteration_120/point_cloud.ply
must "its lock is gone" [ ! -e killed/run.lock ]

# Names.
odd='Zürich 日本 📷'
must "a folder named $odd" eval 'darb convert "out/$ply" "$odd/szene ü.spz" && [ -s "$odd/szene ü.spz" ]'
must "it is read again" darb info "$odd\\szene ü.spz"
cp -r scene "$odd/fotos"
must "photos in it" eval 'darb train "$odd/fotos" -o "$odd/lauf" --iterations 20 --no-report && [ -s "$odd/lauf/point_cloud/iteration_20/point_cloud.ply" ]'
deep=deep
for letter in a b c d e f; do deep+=/$(printf "$letter%.0s" $(seq 50)); done
must "a path of ${#deep} characters" eval 'darb convert "out/$ply" "$deep/scene.spz" && cmp -s "$deep/scene.spz" scene.spz && darb info "$deep/scene.spz"'
for device in con.spz aux.ply 'prn.spz' 'folder/com1.spz'; do
    darb convert "out/$ply" "$device"
    must "$device is refused" eval "[ $? = 2 ] && said 'keeps for a device'"
done
darb train scene -o aux --iterations 5
must "a run in the folder aux is refused" eval "[ $? = 2 ] && said 'keeps for a device'"
darb convert "out/$ply" "out/$ply"
must "a file is not written over itself" eval "[ $? = 2 ] && said 'is what is read'"
cp scene.spz other.spz
must "another file of the same size is no obstacle" darb convert "out/$ply" scene.spz

# Without a driver.
WINEDLLOVERRIDES="$WINEDLLOVERRIDES;vulkan-1=" darb devices
must "without vulkan-1.dll it says what to install" eval "[ $? = 2 ] && said 'driver of your graphics card'"
must "and converts all the same" eval 'WINEDLLOVERRIDES="$WINEDLLOVERRIDES;vulkan-1=" darb convert "out/$ply" without.spz'

# The window.
"$wine" 'C:\work\darb.exe' view "out/$ply" --size 1000x700 >"$work/out" 2>"$work/err" &
window=$!
shot() { python3 - "$work/screen/Xvfb_screen0" "$screenshot" <<'PYTHON'
import struct, sys, zlib
data = open(sys.argv[1], "rb").read()
head = struct.unpack(">25I", data[:100])
size, width, height, row, colours = head[0], head[4], head[5], head[12], head[19]
pixels = data[size + 12 * colours:]
rows = [pixels[y * row:y * row + 4 * width] for y in range(height)]
rgb = b"".join(b"\0" + bytes(v for x in range(width) for v in (r[4 * x + 2], r[4 * x + 1], r[4 * x])) for r in rows)
def chunk(kind, body):
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
open(sys.argv[2], "wb").write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)) +
                              chunk(b"IDAT", zlib.compress(rgb)) + chunk(b"IEND", b""))
print(len(set(zip(rgb[0::97], rgb[1::97], rgb[2::97]))))
PYTHON
}
colours=0
for _ in $(seq 60); do
    sleep 1
    colours=$(shot)
    [[ $colours -lt 200 ]] || break
done
must "the window shows more than 200 colours ($colours): $screenshot" [ "$colours" -ge 200 ]
kill -KILL $window 2>/dev/null
exit $failed
