#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Tries what a web page may have beside its splats, in headless Chromium: notes, ground to walk on, a picture all around.

    tools/page_parts_check.py [--darb DARB] [--out DIR]     on a small scene made here
    tools/page_parts_check.py --memory SPLATS               memory of a page of so many splats, on an emulated phone

Notes: by click, keys and address, markup in them, on a window and on a phone. Walking: a path over two steps and into
walls, along one, down a ledge and to the end of the ground, tick by tick, so that it does not depend on how fast the
machine is. The picture all around: while the page loads and in a browser without WebGL.
"""

import argparse
import base64
import gzip
import json
import math
import os
import random
import re
import struct
import sys
import tempfile
import time

import browser  # beside this file
import page_check

HOSTILE = "<img src=x onerror=hacked=1><b>bold</b>\u202e"
COLUMNS = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--darb", default=os.path.join(page_check.ROOT, "build/darb"), help="default: build/darb")
    parser.add_argument("--memory", type=int, default=0, metavar="SPLATS", help="measure the memory of a page of so many splats")
    parser.add_argument("--out", help="keep pages and pictures in this folder")
    return parser.parse_args()


def write_scene(path, log_scale=-2):
    """A ring of colours around the origin, at the height of eyes; y points down."""
    rows = []
    for i in range(400):
        angle, rise = i / 400 * 6.2831853, -0.4 - 1.2 * (i % 20) / 20
        rows.append([4 * math.sin(angle), rise, 4 * math.cos(angle), (i % 3) - 1, (i // 3 % 3) - 1, (i // 9 % 3) - 1, 3, *3 * [log_scale], 1, 0, 0, 0])
    with open(path, "wb") as file:
        head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}"] + ["property float " + c for c in COLUMNS] + ["end_header", ""]
        file.write("\n".join(head).encode() + b"".join(struct.pack("<14f", *row) for row in rows))


def write_room(path):
    """Ground of steps: level from x -5 to 1, 0.3 high to 2, 0.6 high to 5, 1 lower from -8 to -5; a wall at z 3, and one
    0.6 high at z -2."""
    vertices, faces = [], []

    def quad(*corners):
        first = len(vertices) + 1
        vertices.extend(corners)
        faces.extend([(first, first + 1, first + 2), (first, first + 2, first + 3)])

    def level(x0, x1, height):
        quad((x0, -height, -5), (x1, -height, -5), (x1, -height, 3), (x0, -height, 3))

    def riser(x, low, high):
        quad((x, -low, -5), (x, -low, 3), (x, -high, 3), (x, -high, -5))

    for x0, x1, height in [(-8, -5, -1), (-5, 1, 0), (1, 2, 0.3), (2, 5, 0.6)]:
        level(x0, x1, height)
    for x, low, high in [(-5, -1, 0), (1, 0, 0.3), (2, 0.3, 0.6)]:
        riser(x, low, high)
    quad((-8, 1, 3), (5, 1, 3), (5, -4, 3), (-8, -4, 3))
    quad((-5, 0, -2), (5, 0, -2), (5, -0.6, -2), (-5, -0.6, -2))
    with open(path, "w", encoding="utf-8") as file:
        file.writelines(f"v {x} {y} {z}\n" for x, y, z in vertices)
        file.writelines("f {} {} {}\n".format(*face) for face in faces)


def shown(page, seconds=120):
    page.run("darb.ready")
    for _ in range(20 * seconds):
        if page.run("darb.state.shown"):
            return True
        time.sleep(0.05)
    return False


def check_notes(page, url, failures, keep):
    check = lambda fine, text: page_check.check(failures, fine, "notes: " + text)
    page.open(url)
    check(shown(page), "no picture")
    pins = page.run("[...document.querySelectorAll('.pin')].map(pin => [pin.textContent, pin.ariaLabel, pin.className])")
    check([pin[0] for pin in pins] == ["1", "2"], f"pins {pins}")
    check(pins[0][1].startswith("Note 1: <img"), f"the label is {pins[0][1]!r}")
    page.run("document.getElementById('view').focus()")
    page.key("Tab")
    check(page.run("document.activeElement.textContent") == "1", "Tab leads from the picture to the first note")
    page.run("document.activeElement.click()")
    card = page.run("({title: document.getElementById('heading').textContent, text: document.querySelector('#card p').textContent, on: document.activeElement.id, hash: location.hash})")
    check(card["title"].startswith("1. <img src=x") and "\u202e" not in card["title"], f"the title is {card['title']!r}")
    check(card["text"].startswith("first\nsecond <img"), f"the text is {card['text']!r}")
    check(card["on"] == "heading" and card["hash"] == "#note=1", f"the card is {card}")
    check(page.run("typeof hacked") == "undefined" and page.run("document.images.length") == 1, "markup in a note is run")
    page.key("n")
    check(page.run("location.hash") == "#note=2", "N opens the next note")
    for _ in range(200):  # the flight takes half a second, and more where frames are slow
        where = page.run("darb.state.camera.eye")
        if max(abs(a - b) for a, b in zip(where, [0, -1, -1])) < 0.01:
            break
        time.sleep(0.05)
    check(max(abs(a - b) for a, b in zip(where, [0, -1, -1])) < 0.01, f"a note's camera is gone to: {where}")
    if keep:
        page.screenshot(os.path.join(keep, "notes.png"))
    page.key("Escape")
    check(page.run("document.getElementById('card').hidden && document.activeElement.textContent === '2'"), "Escape closes the card and goes back to its pin")
    page.resize(390, 844, 2, phone=True)
    page.open("about:blank")  # another fragment alone loads nothing
    page.open(url + "#note=2")
    check(shown(page), "no picture on a phone")
    check(page.run("document.getElementById('heading').textContent") == "2. Second", "#note=2 opens that note")
    check(page.run("(() => { const r = document.getElementById('card').getBoundingClientRect(); return r.left >= 0 && r.right <= innerWidth; })()"), "the card fits on a phone")
    if keep:
        page.screenshot(os.path.join(keep, "notes_phone.png"))
    page.resize(1280, 720)
    check(not page.said, f"the console is written to: {page.said[:3]}")


def moved(page):
    """Whether the camera leaves the place that `stood` remembers."""
    for _ in range(300):
        if page.run("String(darb.state.camera.eye) !== stood"):
            return True
        time.sleep(0.05)
    return False


def check_walk(page, url, failures, keep):
    """u is z, v is x, h is -y in this scene."""
    page.open(url)
    page_check.check(failures, shown(page), "walk: no picture")
    legs = [("up a step", [0, 1, 1.2], (0, 0.3, 1.8)), ("up another", [0, 1, 1], (0, 0.6, 3.3)), ("down both", [0, -1, 2.5], (0, 0, -0.45)),
            ("into a wall", [1, 0, 4], (2.75, 0, -0.45)), ("along it", [0.7071, -0.7071, 1], (2.75, 0, -1.51)),
            ("against a block of 0.6", [-1, 0, 6], (-1.75, 0, -1.51)), ("down a ledge", [0, -1, 3.5], (-1.75, -1, -6.76)),
            ("to the end of the ground", [0, -1, 5], (-1.75, -1, -8.15))]
    found = page.run(f"darb.walk([0, -1.6, 0], {json.dumps([leg for _, leg, _ in legs])})")
    page_check.check(failures, bool(found), "walk: there is no ground")
    for (what, _, wanted), got in zip(legs, (found or [None])[1:]):
        off = max(abs(a - b) for a, b in zip(got["feet"], wanted))
        page_check.check(failures, off < 0.12 and got["standing"], f"walk: {what}: at {got['feet']}, not {wanted}")
    again = page.run(f"darb.walk([0, -1.6, 0], {json.dumps([leg for _, leg, _ in legs])})")
    page_check.check(failures, again == found, "walk: a second walk ends elsewhere")
    page.open(url)
    shown(page)
    page.key("o")
    page.key("o")
    page_check.check(failures, page.run("document.getElementById('mode').textContent") == "Walk", "walk: O O walks")
    remember = "(window.stood = String(darb.state.camera.eye), 0)"
    page.run(remember)
    page.call("Input.dispatchKeyEvent", type="keyDown", key="w", code="KeyW")
    page_check.check(failures, moved(page), "walk: W walks")
    page.call("Input.dispatchKeyEvent", type="keyUp", key="w", code="KeyW")
    page.resize(390, 844, 2, phone=True)
    page.open(url)
    shown(page)
    for _ in range(2):
        page.run("document.getElementById('mode').click()")
    page.run(remember)
    box = page.run("(r => r.width ? [r.left + r.width / 2, r.top + r.height / 2] : null)(document.getElementById('stick').getBoundingClientRect())")
    page_check.check(failures, box is not None, "walk: no stick on a phone")
    if box:
        page.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": box[0], "y": box[1] - 40, "id": 1}])
        page_check.check(failures, moved(page), "walk: the stick walks")
        if keep:
            page.screenshot(os.path.join(keep, "walk_phone.png"))
        page.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    page.resize(1280, 720)
    page_check.check(failures, not page.said, f"walk: the console is written to: {page.said[:3]}")


def check_around(url, failures, keep):
    with browser.Browser(webgl=False) as page:
        page.open(url)
        page.run("darb.ready.catch(() => {})")
        said = page.run("document.getElementById('note').innerText")
        page_check.check(failures, "WebGL 2" in said and "look around" in said, f"around: without WebGL the page says {said!r}")
        page.run("darb.around().ready.then(() => new Promise(done => setTimeout(done, 300)))")
        colours = "(c => { const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; return new Set(Array.from({length: d.length / 4}, (_, i) => d[4 * i] >> 5)).size; })(document.getElementById('around'))"
        page_check.check(failures, page.run(colours) > 2, "around: the picture is empty")
        before = page.run("darb.around().camera.axes[2]")
        page.drag([(300, 300), (400, 320), (500, 330)])
        page_check.check(failures, page.run("darb.around().camera.axes[2]") != before, "around: a drag turns it")
        if keep:
            page.screenshot(os.path.join(keep, "around.png"))
        page_check.check(failures, not [t for t in page.said if "WebGL" not in t], f"around: the console is written to: {page.said[:3]}")


def check_parts(arguments, failures, folder):
    scene, room, notes, page_file = (os.path.join(folder, name) for name in ("ring.ply", "room.obj", "notes.json", "parts.html"))
    write_scene(scene)
    write_room(room)
    camera = {"position": [0, -1, -1], "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "fx": 300, "fy": 300, "width": 640, "height": 480}
    cameras = os.path.join(folder, "cameras.json")
    with open(cameras, "w", encoding="utf-8") as file:
        json.dump([dict(camera, id=0, img_name="middle", position=[0, -1.6, 0])], file)
    with open(notes, "w", encoding="utf-8") as file:
        json.dump({"version": 1, "notes": [{"at": [0, -1, 4], "title": HOSTILE, "text": "first\nsecond " + HOSTILE},
                                           {"at": [4, -1, 0], "title": "Second", "text": "x", "camera": camera}]}, file)
    page_check.darb(arguments, "convert", "--force", scene, page_file, "--cameras", cameras, "--notes", notes, "--collider", room, "--poster", "360")
    url, keep = "file://" + os.path.abspath(page_file), arguments.out and folder
    with browser.Browser() as page:
        check_notes(page, url, failures, keep)
        check_walk(page, url, failures, keep)
    check_around(url, failures, keep)


def memory_page(arguments, count, folder):
    """A page like that of a scene of so many splats without harmonics, at the coarsest level: its columns are drawn by chance."""
    scene, small, large = (os.path.join(folder, name) for name in ("ring.ply", "small.html", "large.html"))
    write_scene(scene, -5)
    page_check.darb(arguments, "convert", "--force", scene, small)
    with open(small, encoding="utf-8") as file:
        text = file.read()
    facts, rng, planes = page_check.scene_of_page(small), random.Random(1), []
    word, used = 2, 32
    for column in facts["columns"]:
        wide = column["attribute"] == "position"
        bits = 16 if wide else 2 if column["attribute"] == "rotation" and column["component"] == 3 else 8
        column.update(bytes=2 if wide else 1, bits=bits, difference=False, low=-2.0 if wide else column["low"], step=4 / 65536 if wide else column["step"] or 0.01)
        if column["attribute"] == "log_scale":
            column.update(low=-6.0, step=0.01)
        if column["attribute"] == "opacity_logit":
            column.update(low=0.0, step=1 / 255)
        if column["attribute"] == "rotation":
            column.update(low=0.0, step=1 if bits == 2 else 0.002)
        if not wide:
            if used + bits > 32:
                word, used = word + 1, 0
            column.update(word=word, shift=used)
            used += bits
        for _ in range(column["bytes"]):
            plane = rng.randbytes(count)
            planes.append(plane.translate(bytes(i & 3 for i in range(256))) if bits == 2 else plane)
    payload, size = gzip.compress(b"".join(planes), 1), 3 << 16
    facts.update(count=count, layers=(word + 4) // 4, parts=-(-len(payload) // size), megabytes=round(len(payload) * 4 / 3 / 1e6, 1))
    start = text.index('id="scene">') + len('id="scene">')
    text = text[:start] + json.dumps(facts) + text[text.index("</script>", start):]
    text = text[:text.index('<script type="text/plain" id="part0">')]
    with open(large, "w", encoding="utf-8") as file:
        file.write(text)
        for part in range(facts["parts"]):
            file.write(f'<script type="text/plain" id="part{part}">{base64.b64encode(payload[part * size:(part + 1) * size]).decode()}</script>\n')
        file.write("</body>\n</html>\n")
    return large, facts["layers"]


def resident(page):
    """MB of the browser's processes that hold the page and its graphics memory: renderer, GPU."""
    found = {}
    for name in os.listdir("/proc"):
        try:
            with open(f"/proc/{name}/cmdline", "rb") as file:
                line = file.read().decode(errors="replace")
            kind = re.search(r"--type=(renderer|gpu-process)", line)
            if page.profile.name not in line and not (kind and is_below(int(name), page.process.pid)):
                continue
            with open(f"/proc/{name}/status", encoding="utf-8") as file:
                status = file.read()
        except (OSError, ValueError):
            continue
        if kind:
            rss, peak = (int(re.search(key + r":\s+(\d+)", status).group(1)) / 1e3 for key in ("VmRSS", "VmHWM"))
            if rss > found.get(kind.group(1), (0, 0))[0]:
                found[kind.group(1)] = (rss, peak)
    return found


def is_below(process, ancestor):
    while process > 1:
        with open(f"/proc/{process}/stat", encoding="utf-8") as file:
            process = int(file.read().rpartition(")")[2].split()[1])
        if process == ancestor:
            return True
    return False


def measure_memory(arguments, folder):
    path, layers = memory_page(arguments, arguments.memory, folder)
    with browser.Browser(390, 844) as page:
        page.resize(390, 844, 2, phone=True)
        page.open("file://" + os.path.abspath(path))
        most, begun = 0, time.time()
        while not page.run("darb.state.shown || !document.getElementById('note').hidden") and time.time() - begun < 900:
            heap = page.call("Runtime.getHeapUsage")
            most = max(most, heap["usedSize"] + heap.get("backingStorageSize", 0) + heap.get("embedderHeapUsedSize", 0))
            time.sleep(0.2)
        said, first = page.run("document.getElementById('note').innerText"), time.time() - begun
        at_first = resident(page)
        while page.run("darb.state.levels") < 3 and time.time() - begun < 900:
            time.sleep(1)
        merged = time.time() - begun
        time.sleep(5)
        page.call("HeapProfiler.collectGarbage")
        heap = page.call("Runtime.getHeapUsage")
        later = resident(page)
    textures = arguments.memory * (16 * layers + 32 + 4) / 1e6
    print(json.dumps({"splats": arguments.memory, "file_MB": os.path.getsize(path) / 1e6, "words": 4 * layers, "textures_MB": textures, "said": said,
                      "first_picture_s": first, "merged_s": merged, "most_heap_and_buffers_MB": most / 1e6, "heap_later_MB": heap["usedSize"] / 1e6,
                      "buffers_later_MB": heap.get("backingStorageSize", 0) / 1e6, "resident_peak_MB": at_first, "resident_later_MB": later}, indent=1))


def main():
    arguments = parse_arguments()
    if not browser.find():
        print("skipped: no chromium")
        return 0
    failures = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = arguments.out or scratch
        os.makedirs(folder, exist_ok=True)
        if arguments.memory:
            measure_memory(arguments, folder)
            return 0
        check_parts(arguments, failures, folder)
    print(f"parts of a page: {len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
