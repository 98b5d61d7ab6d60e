#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Streams a scene into headless Chromium (software GL) over slow and broken lines, and compares it with `darb render`.

    tools/stream_check.py SCENE... [options]      seconds to the first picture and to the last part, requests, dB

Writes each scene with `darb convert --web`, serves its folder, and looks at 10 cameras around it: without limits, with a
budget too small for the scene, over a slow line, and over one that is cut and comes back. It fails where the picture of a
camera is below --least dB, where more splats are held than the budget allows, where the first picture takes longer than
--first seconds on the slow line, and where the page does not say that the line is cut, or does not go on afterwards.
"""

import argparse
import functools
import http.server
import json
import os
import sys
import tempfile
import threading
import time

import browser  # beside this file
import page_check

SLOW = {"latency": 150, "downloadThroughput": 200e3, "uploadThroughput": 90e3}  # ms, bytes/s: "fast 3G"


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", metavar="SCENE", help="splat files or output folders")
    parser.add_argument("--darb", default=os.path.join(page_check.ROOT, "build/darb"), help="default: build/darb")
    parser.add_argument("--views", type=int, default=10)
    parser.add_argument("--size", default="320x240", help="of the pictures compared, px")
    parser.add_argument("--least", type=float, default=45, help="dB (default 45)")
    parser.add_argument("--first", type=float, default=10, metavar="S", help="to the first picture on the slow line (default 10)")
    parser.add_argument("--stop", default="1e-4", help="transmittance at which a pixel of darb ends (default 1e-4)")
    parser.add_argument("--out", help="keep folders and pictures in this folder")
    return parser.parse_args()


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


def serve(folder):
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=folder))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server, f"http://127.0.0.1:{server.server_port}/"


def wait_for(page, condition, seconds):
    """-> seconds until a JavaScript expression is true, or None."""
    begun = time.time()
    while time.time() - begun < seconds:
        if page.run(condition):
            return time.time() - begun
        time.sleep(0.05)
    return None


def line(page, offline=False, slow=False):
    limits = SLOW if slow else {"latency": 0, "downloadThroughput": -1, "uploadThroughput": -1}
    page.call("Network.emulateNetworkConditions", offline=offline, **limits)


def check_whole(page, url, truths, arguments, name, failures):
    page.open(url)
    page.run("darb.ready")
    found = page_check.worst_of_page(page, truths, arguments.out and os.path.join(arguments.out, name))
    state = page.run("darb.state")
    page_check.check(failures, min(found) >= arguments.least, f"{name}: {min(found):.2f} dB at worst, {arguments.least} are wanted: "
                     + " ".join(f"{db:.1f}" for db in found))
    page_check.check(failures, not page.said, f"{name}: the console is written to: {page.said[:3]}")
    page_check.check(failures, all(u.startswith(url) for u in page.requests), f"{name}: asks for {page.requests}")
    page_check.check(failures, len(set(page.requests)) == len(page.requests), f"{name}: asks twice for a file")
    return found, state


# From inside the scene along its axes, where other files are near each time.
WITHIN = """[0, 1, 2].flatMap(k => [-1, 1].map(sign => {
  const ahead = [0, 0, 0], right = [0, 0, 0], down = [0, 0, 0];
  [ahead[k], right[(k + 1) % 3], down[(k + 2) % 3]] = [sign, sign, 1];
  return {width: 160, height: 120, fx: 150, fy: 150, cx: 80, cy: 60, axes: [right, down, ahead], eye: darb.scene.focus.map((x, i) => x + 0.4 * darb.scene.radius * ahead[i])};
}))"""


def check_budget(page, url, total, arguments, name, failures):
    """Three quarters of the splats: never more are held, whatever comes and goes from camera to camera, and a picture does
    not depend on what was there before."""
    budget = 3 * total // 4
    page.open(f"{url}?budget={budget}")
    page.run("darb.ready")
    page.resize(160, 120)
    page.run(f"window.within = {WITHIN}, 0")
    sets, pictures = set(), {}
    for view in [*range(6), *range(6)]:
        picture = page.run(f"darb.picture(within[{view}])")
        state = page.run("darb.state")
        parts = tuple(sorted(state["parts"]))
        rows = 2048 * -(-budget // 2048)
        page_check.check(failures, state["rows"] * 2048 <= rows and state["splats"] <= rows, f"{name}: {state['splats']} splats with a budget of {budget}")
        page_check.check(failures, state["missing"] == 0 and state["drawn"] > 0, f"{name}: {state['missing']} parts are missing")
        page_check.check(failures, pictures.setdefault((view, parts), picture) == picture, f"{name}: view {view} differs with the same files, which came and went")
        sets.add(parts)
    page.resize(1280, 720)
    files = page.run("fetch('lod-meta.json').then(answer => answer.json()).then(meta => meta.filenames.filter(f => f.startsWith('0_')).length)")
    page_check.check(failures, len(sets) > 1 or files < 2, f"{name}: all views have the same files with a budget of {budget}")
    page_check.check(failures, not page.said, f"{name}, small budget: the console is written to: {page.said[:3]}")
    return len(sets)


def check_slow(page, url, arguments, name, failures):
    page.call("Network.clearBrowserCache")
    line(page, slow=True)
    begun = time.time()
    page.open(url)
    shown = wait_for(page, "darb.state.shown", 60)
    first = time.time() - begun if shown is not None else None
    early = page.run("darb.state")
    whole = wait_for(page, "darb.state.missing === 0", 300)
    page_check.check(failures, first is not None and first <= arguments.first, f"{name}: the first picture after {first} s on a slow line")
    page_check.check(failures, whole is not None, f"{name}: not all parts come over a slow line")
    line(page)
    return first, time.time() - begun, early


def check_cut(page, url, name, failures):
    """The line fails for the finest level: the page shows what it has and says so, asks again ever more seldom, and goes on
    when the line is back."""
    page.call("Network.clearBrowserCache")
    page.call("Network.setBlockedURLs", urls=["*/0_*/*"])
    page.open(url)
    page_check.check(failures, wait_for(page, "darb.state.shown", 120) is not None, f"{name}: nothing is shown while the line fails for the finest level")
    said = wait_for(page, "darb.state.cut && document.getElementById('note').innerText.includes('network does not answer')", 30)
    page_check.check(failures, said is not None, f"{name}: nothing is said while the line is cut")
    before = page.run("darb.state")
    time.sleep(4)
    after = page.run("darb.state")
    page_check.check(failures, after["missing"] > 0, f"{name}: nothing was missing when the line was cut")
    page_check.check(failures, 0 < after["requests"] - before["requests"] <= 30, f"{name}: {after['requests'] - before['requests']} requests in 4 s over a cut line")
    page.call("Network.setBlockedURLs", urls=[])
    whole = wait_for(page, "darb.state.missing === 0 && !darb.state.cut && document.getElementById('note').hidden", 60)
    page_check.check(failures, whole is not None, f"{name}: it does not go on when the line is back: {page.run('darb.state')}")
    return whole


def check_scene(page, path, arguments, failures, folder):
    name = os.path.basename(path.rstrip("/")).partition(".")[0]
    width, height = map(int, arguments.size.split("x"))
    out, cameras = os.path.join(folder, name + "_web"), os.path.join(folder, "cameras.json")
    page_check.darb(arguments, "convert", "--force", path, out, "--web")
    with open(cameras, "w", encoding="utf-8") as file:
        json.dump(page_check.camera_list(page_check.scene_of_page(os.path.join(out, "index.html")), arguments.views, width, height), file)
    said = page_check.darb(arguments, "convert", "--force", path, out, "--web", "--cameras", cameras)
    frames, stored = os.path.join(folder, "frames"), os.path.join(folder, "stored.ply")
    page_check.darb(arguments, "convert", "--force", "-q", "--no-measure", os.path.join(out, "lod-meta.json"), stored)
    facts = json.loads(page_check.darb(arguments, "info", path, "--json", "-"))
    arguments.footprint, arguments.antialias = facts["footprint"], facts["render_mode"] == "mip"
    labelled = page_check.relabelled(stored, facts["kernel"], arguments, folder)
    page_check.darb(arguments, "render", labelled, "--cameras", cameras, "-o", frames, "--transmittance-stop", arguments.stop)
    truths = [os.path.join(frames, f"view {i + 1}.png") for i in range(arguments.views)]
    server, url = serve(out)
    db, state = check_whole(page, url, truths, arguments, name, failures)
    row = {"name": name, "stated": said.strip(), "db": db, "splats": state["drawn"]}
    row["sets"] = check_budget(page, url, state["drawn"], arguments, name, failures)
    row["first_s"], row["whole_s"], early = check_slow(page, url, arguments, name, failures)
    row["early"] = early["drawn"]
    row["back_s"] = check_cut(page, url, name, failures)
    server.shutdown()
    print(f"| {name} | {row['splats']:,} | {row['first_s']:.1f} s ({row['early']:,} splats) | {row['whole_s']:.1f} s | {state['requests']} | "
          f"{row['sets']} | {min(db):.1f} | {sum(db) / len(db):.1f} |", flush=True)
    return row


def main():
    arguments = parse_arguments()
    if not browser.find():
        print("skipped: no chromium")
        return 0
    failures, rows = [], []
    with tempfile.TemporaryDirectory() as scratch, browser.Browser() as page:
        folder = arguments.out or scratch
        os.makedirs(folder, exist_ok=True)
        print("| scene | splats | first picture, slow line | all | requests | sets of files | dB at worst | dB mean |")
        print("|---|---|---|---|---|---|---|---|")
        for path in arguments.scenes:
            rows.append(check_scene(page, path, arguments, failures, folder))
        if arguments.out:
            with open(os.path.join(folder, "stream_check.json"), "w", encoding="utf-8") as file:
                json.dump({"rows": rows, "failures": failures}, file, indent=1)
    print(f"{len(rows)} scenes, {len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
