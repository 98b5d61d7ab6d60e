#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Plants one violation of each kind in a tiny tree: check_style.sh must name it, and must pass the
# tree without it. Prints one line per case.
set -uo pipefail
tools=$(cd "$(dirname "$0")/../../tools" && pwd)
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
failed=0

fresh_tree() {
    rm -rf "${root:?}"/*
    mkdir -p "$root"/engine/{core,gpu} "$root"/shaders/{forward,shared} "$root"/tools/darb
    # shellcheck disable=SC2016
    printf '```arrows\n%s\n%s\n%s\n%s\n%s\n```\n' 'engine/core ->' 'engine/gpu -> engine/core <vulkan>' \
        'shaders/shared ->' 'shaders -> shaders/shared' 'tools -> engine/core engine/gpu' \
        >"$root/ARCHITECTURE.md"
    printf '#pragma once\n' | tee "$root"/engine/{core,gpu}/a.h "$root"/shaders/shared/args.h >/dev/null
    printf '#include <vulkan/vulkan.h>\n\n#include "engine/core/a.h"\n' >"$root/engine/gpu/a.cpp"
    printf '#include "shared/args.h"\n' >"$root/shaders/forward/a.comp"
    printf '#include "engine/core/a.h"\n#include "engine/gpu/a.h"\n' >"$root/tools/darb/a.cpp"
}

# expect NAME STATUS PATTERN: the check ends with STATUS and prints a line that matches PATTERN.
expect() {
    local output status
    output=$("$tools/check_style.sh" "$root" 2>&1)
    status=$?
    if [[ $status == "$2" ]] && grep -qE "$3" <<<"$output"; then
        echo "ok      $1"
    else
        printf 'FAILED  %s: status %s, expected %s and a line with /%s/\n%s\n' \
            "$1" "$status" "$2" "$3" "$output"
        failed=1
    fi
}

fresh_tree
expect "clean tree passes" 0 '^includes: 6 files, 0 violations'

fresh_tree
printf '#include "engine/gpu/a.h"\n' >"$root/engine/core/bad.cpp"
expect "arrow against the direction" 1 'engine/core/bad.cpp:1: engine/core may not include engine/gpu/a.h'

fresh_tree
printf '\n#  include "../gpu/a.h"\n' >"$root/engine/core/bad.cpp"
expect "the same by a relative path" 1 'engine/core/bad.cpp:2: engine/core may not include engine/gpu/a.h'

fresh_tree
printf '#include <vulkan/vulkan.h>\n' >"$root/engine/core/bad.cpp"
expect "outside library in the wrong part" 1 'bad.cpp:1: engine/core may not include <vulkan/vulkan.h>'

fresh_tree
printf '#include "engine/core/a.h"\n' >"$root/shaders/shared/bad.h"
expect "shader including host code" 1 'shaders/shared/bad.h:1: shaders/shared may not include'

fresh_tree
printf '#include "nowhere.h"\n' >"$root/engine/core/bad.cpp"
expect "include that resolves to nothing" 1 'bad.cpp:1: "nowhere.h" is neither'

fresh_tree
sed -i 's/^tools -> .*/& shaders\/shared/' "$root/ARCHITECTURE.md"
expect "arrow that no include uses" 1 'no include uses tools -> shaders/shared'

fresh_tree
mkdir "$root/engine/new" && printf '#pragma once\n' >"$root/engine/new/bad.h"
expect "folder without arrows" 1 'engine/new/bad.h:1: in no part'

fresh_tree
printf 'int  x ;\n' >"$root/engine/core/bad.cpp"
cp "$tools/../.clang-format" "$root/"
expect "layout" 1 'bad.cpp:1:.*clang-format'

fresh_tree
mkdir "$root/docs"
printf '# A page: one\n\n[Good](b.md#a-page-one), [good](#a-page-one), `[no](link.md)`.\n\n    [no](link.md)\n' >"$root/docs/b.md"
expect "links that lead somewhere" 0 '^links: 2 pages, 0 dead links'

printf '\n[Bad](../docs/nowhere.md)\n' >>"$root/docs/b.md"
expect "link to no file" 1 'docs/b.md:7: a link to ../docs/nowhere.md, which does not exist'

printf '# A\n\n[Bad](#b)\n' >"$root/docs/b.md"
expect "link to no heading" 1 'docs/b.md:3: a link to #b, which does not exist'

printf '# A\n\n[Releases](../../releases/latest), [bad](../../release)\n' >"$root/docs/b.md"
expect "link to the releases beside the files" 1 '^docs/b.md:3: a link to ../../release, which does not exist'
expect "no more than that one" 1 '^links: 2 pages, 1 dead links'

fresh_tree
rm "$root/ARCHITECTURE.md" && printf 'no arrows\n' >"$root/ARCHITECTURE.md"
expect "architecture without arrows" 1 'no block fenced'

exit "$failed"
