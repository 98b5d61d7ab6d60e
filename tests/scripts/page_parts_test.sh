#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# What a web page may have beside its splats, in headless Chromium: notes, ground to walk on, a picture all around without
# WebGL; and what convert says of bad notes and grounds. The browser part skips without Chromium.
set -uo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
darb=${DARB:-$root/build/darb}
[[ -x $darb ]] || { echo "skipped: no $darb"; exit 77; }
# shellcheck source=check.sh
source "$(dirname "$0")/check.sh"

check help 'tools/page_parts_check.py \[--darb' "$("$root/tools/page_parts_check.py" --help)"
check 'parts of a page' '0 failures|skipped' "$("$root/tools/page_parts_check.py" --darb "$darb" --out "$folder/parts" 2>&1)"
[[ -f $folder/parts/ring.ply ]] || exit "$failed"

# refuses WHAT PATTERN ARGUMENT...: convert ends with 2, says so, and leaves no page.
refuses() {
    local what=$1 pattern=$2 text
    shift 2
    text=$("$darb" convert "$folder/parts/ring.ply" "$@" 2>&1)
    check "$what: exit code" '^2$' "$?"
    check "$what" "$pattern" "$text"
    [[ ! -e $folder/out.html && ! -e $folder/web/index.html ]] || { echo "$what: something was written"; failed=1; }
}
echo '{"notes": [{"at": [0, 0]}]}' >"$folder/bad.json"
refuses 'a bad note' 'bad.json, note 1: at is not 3 numbers' "$folder/out.html" --notes "$folder/bad.json"
refuses 'notes of something else' 'is an option of web pages' "$folder/out.spz" --notes "$folder/bad.json"
refuses 'ground without faces' 'can be walked on' "$folder/out.html" --collider "$folder/parts/ring.ply"
refuses 'a file for --web' 'is a file, and --web writes a folder' "$folder/out.html" --web
refuses '--exact with --web' 'is not for --web' "$folder/web" --web --exact
refuses '--max-size with --web' 'max-size: is not for --web' "$folder/web" --web --max-size 1MB
exit "$failed"
