#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# tools/lab/real_scale.py with a made-up command in place of darb: rows, failures, missing sets, time limits, pages.
set -uo pipefail
script=$(cd "$(dirname "$0")/../../tools/lab" && pwd)/real_scale.py
# shellcheck source=check.sh
source "$(dirname "$0")/check.sh"

# Trains at once; of the set "broken" it fails, of "long" it waits for Ctrl-C and goes on when it is resumed.
cat >"$folder/darb" <<'TEXT'
#!/usr/bin/env python3
import json, pathlib, signal, sys, time
words = sys.argv[1:]
if words[0] == "info":
    print(json.dumps({"splats": 900, "invisible": 100}))
    sys.exit()
value = lambda name, default=None: words[words.index(name) + 1] if name in words else default
out = pathlib.Path(value("-o"))
out.mkdir(parents=True, exist_ok=True)
with open(out.parent / "calls", "a") as file:
    file.write(" ".join(words) + "\n")
if "broken" in words[1]:
    print("darb: the photos are broken", file=sys.stderr)
    sys.exit(2)
if "long" in words[1]:
    def stop(*_):
        (out / "checkpoint.darb").write_text("state")
        sys.exit(0)
    signal.signal(signal.SIGINT, stop)
    time.sleep(100)
iterations = int(value("--iterations", 8))
json.dump({"seconds": 2.0, "splats": 1000, "iteration": iterations, "peak_device_bytes": 5e6, "peak_host_bytes": 7e6,
           "start": {"device": "chip", "driver": "one"}, "evaluations": [{"psnr_db": 25.5, "ssim": 0.9}]},
          open(out / "metrics.json", "w"))
TEXT
chmod +x "$folder/darb"
mkdir -p "$folder"/data/{one,broken}
table() { # options of run...
    "$script" run --darb "$folder/darb" --data "$folder/data" --out "$folder/out" --commit c1 "$@" 2>&1
}

output=$(table --sets broken one absent --iterations 8 16 --strategies adc mcmc)
check "a failed run ends with 1" "^1$" "$?"
check "a set that is missing" "^absent: skipped, as $folder/data/absent is not there$" "$output"
check "a failed run says why" "^broken-adc-8-seed0: failed, exit code 2: darb: the photos are broken$" "$output"
check "and others follow it" "^one-mcmc-16-seed0: 25.50 dB, SSIM 0.9000, 1,000 splats, 2.0 s" "$output"
check "the whole table" "^the table is whole: $folder/out/real_scale.json$" "$output"
check "mcmc gets adc's number" "one-mcmc-8.*--budget 1000$" "$(cat "$folder/out/runs/calls")"
row=$(grep '"one"' "$folder/out/real_scale.json" | grep '"iterations": 16' | grep adc)
for part in '"drawn_splats": 800' '"psnr_db": 25.5' '"ssim": 0.9' '"seconds": 2.0' '"peak_device_mb": 5.0' '"device": "chip"' '"commit": "c1"'; do
    check "a row has $part" "$part" "$row"
done
check "rows" "^8$" "$(grep -c '"set"' "$folder/out/real_scale.json")"
calls=$(wc -l <"$folder/out/runs/calls")
table --sets broken one --iterations 8 16 --strategies adc mcmc >/dev/null
check "nothing is measured twice" "^$calls$" "$(wc -l <"$folder/out/runs/calls")"
table --sets broken --iterations 8 --strategies adc --again-failed >/dev/null
check "but what failed, where it is asked for" "^$((calls + 1))$" "$(wc -l <"$folder/out/runs/calls")"
output=$("$script" run --darb "$folder/darb" --data "$folder/data" --out "$folder/out" --commit c2 2>&1)
check "rows of another commit" "holds rows of the commit c1, this is c2; .*another --out" "$output"

mkdir "$folder/data/long"
begun=$SECONDS
output=$(table --sets long --iterations 8 --strategies adc mcmc --limit 6)
check "the time ends a run" "^long-adc-8-seed0: stopped, as the time is over; the same command goes on$" "$output"
check "and says what is left" "^2 of 2 runs are left" "$output"
check "in time" "^ok$" "$([[ $((SECONDS - begun)) -lt 40 ]] && echo ok)"
rmdir "$folder/data/long"
mkdir "$folder/data/long"
output=$(table --sets long --iterations 8 --strategies adc)
check "a stopped run is resumed" "train --resume -o $folder/out/runs/long-adc-8-seed0 -q$" "$(tail -1 "$folder/out/runs/calls")"
check "and ends" "^long-adc-8-seed0: 25.50 dB" "$output"
check "its checkpoint goes" "^gone$" "$([[ ! -e $folder/out/runs/long-adc-8-seed0/checkpoint.darb ]] && echo gone)"

output=$(table --sets town_1200 --iterations 8 --strategies adc --make-scene "$folder/none")
check "what makes a set is not built" "^town_1200: skipped, as $folder/out/sets/town_1200 is not there, which $folder/none" "$output"
printf '#!/bin/sh\nsleep 100\n' >"$folder/slow"
chmod +x "$folder/slow"
output=$(table --sets town_1200 --iterations 8 --strategies adc --make-scene "$folder/slow" --limit 6)
check "the time may end while it is made" "^town_1200: the time was over before its photos were made; a larger" "$output"
check "and nothing is trained" "^1 of 1 runs are left" "$output"
cat >"$folder/make_scene" <<'TEXT'
#!/bin/sh
echo "$@" >>"${0%/*}/made"
mkdir "$2"
TEXT
chmod +x "$folder/make_scene"
output=$(table --sets town_1200 --iterations 8 16 --strategies adc --make-scene "$folder/make_scene")
check "a set is made" "^town_1200: made in 0 s$" "$output"
check "and trained" "^town_1200-adc-16-seed0: 25.50 dB" "$output"
check "from where it is" "^train $folder/out/sets/town_1200 -o" "$(tail -1 "$folder/out/runs/calls")"
check "once, and kept when it is whole" "^town $folder/out/sets/town_1200.tmp 6 6$" "$(cat "$folder/made")"

sed 's/25.5/25.75/; s/"seconds": 2.0/"seconds": 1.0/; s/c1/c2/' "$folder/out/real_scale.json" >"$folder/after.json"
output=$("$script" page "$folder/after.json" "$folder/out/real_scale.json")
check "a page of both" "^\| one \| 8 \| adc \| before \| 2.0 \| 1,000 \| 800 \| 25.50 \| 0.9000 \| 5 \|$" "$output"
check "and what changed" "^\|  \|  \|  \| change \| x 0.50 \| x 1.00 \| x 1.00 \| \+0.25 \| \+0.0000 \| x 1.00 \|$" "$output"
check "a failed row" "failed: exit code 2: darb: the photos are broken" "$output"
check "the conditions" "^Device: chip \(one\). Commit: c2, before it c1 on chip\." "$output"
echo "{}" >"$folder/empty.json"
check "no result" "empty.json: is no result of real_scale.py run" "$("$script" page "$folder/empty.json" 2>&1)"
check "no such strategy" "--strategies adcc: is none of adc, budget, mcmc" "$(table --strategies adcc)"
exit "$failed"
