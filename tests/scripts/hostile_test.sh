#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# tools/lab/hostile.sh: a case passes, and a command that spoils its input, writes an escape sequence or ends
# by a signal is found, with the line that repeats it.
set -uo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
darb=${DARB:-$root/build/darb}
[[ -x $darb ]] || { echo "skipped: no $darb"; exit 77; }
# shellcheck source=check.sh
source "$(dirname "$0")/check.sh"

check help 'tools/lab/hostile.sh .*HOURS|hours' "$("$root/tools/lab/hostile.sh" --help)"
check 'hours are asked for' 'give HOURS' "$("$root/tools/lab/hostile.sh" 2>&1)"

text=$(DARB=$darb "$root/tools/lab/hostile.sh" 0 --only mutations --seed 3 --out "$folder/whole" 2>&1)
check 'a case' '^1 executions in [0-9.]+ h, 0 findings' "$text"
check 'the summary in JSON' '"executions": 1' "$(cat "$folder/whole/hostile.json")"

cat >"$folder/darb" <<TEXT
#!/usr/bin/env bash
# Wrong with the scenes of a case alone, which lie below in/.
case "\$*" in
    *in/scenes*) find in/scenes -type f -exec sh -c 'echo >>"\$1"' _ {} \;; printf '\\033[2J'; kill -SEGV \$\$ ;;
esac
exec "$darb" "\$@"
TEXT
chmod +x "$folder/darb"
text=$(DARB=$folder/darb "$root/tools/lab/hostile.sh" 0 --seed 3 --only mutations --out "$folder/spoilt" 2>&1)
check 'a signal is found' 'mutations: signal SIGSEGV' "$text"
check 'a spoilt input is found' 'mutations: file changed' "$text"
check 'an escape sequence is found' 'mutations: control characters' "$text"
check 'the repeating line' 'tools/lab/hostile.sh --only mutations --seed 3 --case 0' "$text"
exit "$failed"
