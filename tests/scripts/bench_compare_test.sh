#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# tools/lab/bench_compare.py on made-up results: what it calls faster, slower and noise.
set -uo pipefail
script=$(cd "$(dirname "$0")/../../tools/lab" && pwd)/bench_compare.py
# shellcheck source=check.sh
source "$(dirname "$0")/check.sh"

# A case of eight samples around MS, +- 1 %.
case_json() { # NAME MS BESIDE PAIRS
    python3 - "$@" <<'TEXT'
import json, sys
name, ms, beside, pairs = sys.argv[1], float(sys.argv[2]), float(sys.argv[3]), int(sys.argv[4])
samples = [ms * (1 + 0.01 * k / 3.5) for k in (-3.5, -2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 3.5)]
spread = {"median": ms, "quartile_low": 0.995 * ms, "quartile_high": 1.005 * ms}
print(json.dumps({"name": name, "real_time": ms, "quartile_low": 0.995 * ms, "quartile_high": 1.005 * ms,
                  "samples": samples, "beside_cores": beside, "splats": 1, "pairs": pairs, "pixels": 1,
                  "passes": {"blend": spread}, "yardsticks": {"blend": {"native_ms": spread}}}))
TEXT
}
result() { # FILE DEVICE CASE...
    local file=$1 device=$2 cases
    shift 2
    cases=$(IFS=,; echo "$*")
    echo "{\"context\": {\"device\": \"$device\", \"commit\": \"c\"}, \"benchmarks\": [$cases]}" >"$folder/$file"
}
result a.json one "$(case_json same 10 0 5)" "$(case_json quick 10 0 5)" "$(case_json slow 10 0 5)" \
    "$(case_json little 10 0 5)" "$(case_json loaded 10 0 5)" "$(case_json work 10 0 5)" "$(case_json gone 10 0 5)"
result b.json two "$(case_json same 10.05 0 5)" "$(case_json quick 8 0 5)" "$(case_json slow 12 0 5)" \
    "$(case_json little 10.15 0 5)" "$(case_json loaded 12 0.5 5)" "$(case_json work 10 0 6)"
output=$("$script" "$folder/a.json" "$folder/b.json" --passes --json "$folder/out.json" 2>&1)
check "overlap is noise" "^same .* noise$" "$output"
check "faster" "^quick .* -20\.0 %  faster$" "$output"
check "slower" "^slow .* \+20\.0 %  slower$" "$output"
check "below the least change" "^little .* noise$" "$output"
check "busy machine" "^loaded .* slower, busy$" "$output"
check "other work" "^work .* noise, other work" "$output"
check "missing case" "^gone .* only in" "$output"
check "other device" "^note: device differs: one and two" "$output"
check "passes" "^  blend .* faster$" "$output"
check "yardsticks" "^  native blend .* slower$" "$output"
check "counts" "^1 faster, 2 slower, 3 noise$" "$output"
check "json" '"verdict": "faster"' "$(cat "$folder/out.json")"
echo "{}" >"$folder/empty.json"
output=$("$script" "$folder/a.json" "$folder/empty.json" 2>&1)
check "no result" "empty.json: no result of darb bench" "$output"
exit "$failed"
