#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Records the pace of training runs, from their output folders, for the test of the time left.

  tools/lab/record_pace.py OUT NAME...    writes tests/unit/trainer/pace/NAME.json from OUT/NAME/run.jsonl

Run it on runs that darb train made on one device, with a forecast (200 iterations or more, not -q), such as

  for s in adc mcmc budget; do chrt -f 1 darb train assets/scene -o OUT/$s --strategy $s --iterations 1000; done

where chrt keeps other programs of the machine away. A sample is an iteration, the seconds until then, the splats, and the
milliseconds of the passes of one of its iterations.
"""
import json
import os
import sys


def recorded(path):
    start, samples, kinds = None, [], set()
    with open(path, encoding="utf-8") as file:
        for line in file:
            event = json.loads(line)
            kinds.add(event["event"])
            if event["event"] == "start":
                start = event
            if event["event"] == "iteration":
                passes = sum(event["passes_ms"].values())
                samples.append([event["iteration"], round(event["seconds"], 3), event["splats"], round(passes, 2)])
    if start is None or "forecast" not in start:
        sys.exit(f"record_pace.py: {path} holds no forecast")
    return {"device": start["device"], "strategy": start["strategy"], "iterations": start["settings"]["iterations"],
            "max_splats": start["settings"].get("max_splats"),
            "probe_sh": "probe" in kinds, "forecast": start["forecast"], "samples": samples}


def main():
    if len(sys.argv) < 3 or sys.argv[1] in ("-h", "--help"):
        print(__doc__.strip())
        return 0 if "--help" in sys.argv or "-h" in sys.argv else 2
    folder = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tests", "unit", "trainer", "pace")
    os.makedirs(folder, exist_ok=True)
    for name in sys.argv[2:]:
        with open(os.path.join(folder, name + ".json"), "w", encoding="utf-8") as file:
            json.dump(recorded(os.path.join(sys.argv[1], name, "run.jsonl")), file)
            file.write("\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
