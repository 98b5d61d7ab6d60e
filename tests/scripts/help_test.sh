#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Every script of tools/ says what it is for with --help, does nothing else then, and ends with 0.
set -euo pipefail
cd "$(dirname "$0")/../.."

failed=0
before=$(git status --porcelain 2>/dev/null || true)
for script in tools/*.sh tools/*.py tools/lab/*.sh tools/lab/*.py; do
    if [[ $script == *.py ]]; then run=(python3 -B "$script"); else run=("$script"); fi
    text=$("${run[@]}" --help 2>/dev/null </dev/null) && code=0 || code=$?
    if [[ $code != 0 || ${#text} -lt 40 ]]; then
        echo "$script --help: code $code, '${text:0:60}'"
        failed=1
    fi
done
[[ $(git status --porcelain 2>/dev/null || true) == "$before" ]] || { echo "--help changed files"; failed=1; }
exit $failed
