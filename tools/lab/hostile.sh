#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# A hostile day as one command: mutated inputs, failing writes, kills, odd flags, odd folders and hostile names, against
# build/darb (or $DARB) for HOURS hours, fractions allowed.
#   tools/lab/hostile.sh HOURS [--seed N] [--out DIR] [--only PART] [--case N]; --help says more
exec python3 -B "$(dirname "$0")/hostile/main.py" "$@"
