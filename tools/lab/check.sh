#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Whether what the laboratory changes in copies of the sources is still there: the guards of the hard cases, the sums of
# the price of determinism, and the attribute that is added to measure how many files that takes.
set -uo pipefail
case ${1:-} in -h | --help) sed -n '3,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 0 ;; esac
cd "$(dirname "$0")/../.." || exit 2
failed=0
tools/lab/guards.py check || failed=1
tools/lab/price_of_determinism.py --check || failed=1
tools/lab/new_attribute.py --check || failed=1
exit "$failed"
