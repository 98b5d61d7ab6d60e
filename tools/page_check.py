#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Compares web pages in headless Chromium (software GL) with `darb render`.

    tools/page_check.py SCENE... [options]      a table: bytes, seconds to the first picture, frames a second, dB

For each scene and kernel it writes a page (the scene is relabelled, not trained again), draws cameras around the scene in
the page and with darb, and compares the pictures. It fails where a page's worst camera is below --least or --least-exact
dB, or where it writes to the console or fetches anything; where the first page of a scene does not answer mouse, keys and
touch; and where a damaged page does not say so. Frames a second are those of a turn in a window of 1280x720 px, once the
page has found its pace; dB of merged splats are those of the two levels that slow devices draw in motion.
"""

import argparse
import base64
import json
import math
import os
import subprocess
import sys
import tempfile
import time

import browser  # beside this file

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PAPER = ["gaussian", "raised_cosine", "half_cosine_squared", "sinc", "inverse_quadratic"]
HOSTILE = "</script><img src=x onerror=hacked=1>\"'&{{scene}}\n\u202eab\u2028<!--"

# PSNR in dB between two pictures as data URLs, decoded by the browser itself.
COMPARE = """(async (one, other) => {
  const pixels = async url => {
    const image = new Image();
    image.src = url;
    await image.decode();
    const canvas = new OffscreenCanvas(image.width, image.height), context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    return context.getImageData(0, 0, image.width, image.height);
  };
  const a = await pixels(one), b = await pixels(other);
  if (a.width !== b.width || a.height !== b.height) throw Error("sizes differ");
  let sum = 0;
  for (let i = 0; i < a.data.length; ++i) if (i % 4 < 3) sum += (a.data[i] - b.data[i]) ** 2;
  return sum ? 10 * Math.log10(255 * 255 / (sum / (a.width * a.height * 3))) : 100;
})"""


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", metavar="NAME=SCENE", help="splat files or output folders, named or not")
    parser.add_argument("--darb", default=os.path.join(ROOT, "build/darb"), help="default: build/darb")
    parser.add_argument("--kernels", default=",".join(PAPER), help="default: the five of the paper; `own`: as the file is")
    parser.add_argument("--footprint", choices=["psi", "exact"], default="psi")
    parser.add_argument("--antialias", action="store_true", help="label the scenes with render mode mip")
    parser.add_argument("--views", type=int, default=10)
    parser.add_argument("--size", default="640x480", help="of the pictures compared, px")
    parser.add_argument("--least", type=float, default=45, help="dB, rounded values (default 45)")
    parser.add_argument("--least-exact", type=float, default=55, help="dB, float32 values (default 55)")
    parser.add_argument("--stop", default="1e-4", help="transmittance at which a pixel of darb ends; a page blends all splats (default 1e-4)")
    parser.add_argument("--only", choices=["rounded", "exact"], help="one kind of page alone")
    parser.add_argument("--cuts", type=int, default=10, help="lengths that a page is cut off at (default 10)")
    parser.add_argument("--turn", type=int, default=4, metavar="S", help="seconds of each of two turns; 0: none")
    parser.add_argument("--least-merged", type=float, default=0, help="dB, merged splats (default 0)")
    parser.add_argument("--out", help="keep pages, pictures and page_check.json in this folder")
    return parser.parse_args()


def darb(arguments, *rest):
    done = subprocess.run([arguments.darb, *map(str, rest)], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"darb {' '.join(map(str, rest))}\n{done.stdout}{done.stderr}")
    return done.stdout


def relabelled(path, kernel, arguments, folder):
    """The PLY with other header comments."""
    with open(path, "rb") as file:
        data = file.read()
    head, mark, body = data.partition(b"end_header\n")
    lines = [line for line in head.split(b"\n") if line and not line.lower().startswith(b"comment splat")]
    lines[2:2] = [b"comment SplatKernel: " + kernel.encode(), b"comment SplatFootprint: " + arguments.footprint.encode()]
    if arguments.antialias:
        lines[2:2] = [b"comment SplatRenderMode: mip"]
    out = os.path.join(folder, "labelled.ply")
    with open(out, "wb") as file:
        file.write(b"\n".join(lines) + b"\n" + mark + body)
    return out


def camera_list(scene, views, width, height):
    """Cameras around the focus, far and near, high and low, some off the centre, in the form of cameras.json."""
    cameras, focus, radius = [], scene["focus"], scene["radius"]
    for i in range(views):
        turn, rise = 2 * math.pi * i / views, math.radians([20, -5, 45][i % 3])
        away = radius * [2.6, 1.7, 3.2, 1.2][i % 4]
        eye = [focus[0] + away * math.cos(rise) * math.sin(turn), focus[1] - away * math.sin(rise),
               focus[2] - away * math.cos(rise) * math.cos(turn)]
        forward = [(f - e) / away for f, e in zip(focus, eye)]
        flat = math.hypot(forward[0], forward[2])
        right = [forward[2] / flat, 0, -forward[0] / flat]
        down = [forward[1] * right[2] - forward[2] * right[1], forward[2] * right[0] - forward[0] * right[2],
                forward[0] * right[1] - forward[1] * right[0]]
        focal = width * [1.0, 0.8, 1.4][i % 3]
        camera = {"id": i, "img_name": f"view {i + 1}", "width": width, "height": height, "position": eye,
                  "rotation": [[right[k], down[k], forward[k]] for k in range(3)], "fx": focal, "fy": focal}
        if i % 5 == 4:
            camera.update(cx=0.55 * width, cy=0.42 * height)
        cameras.append(camera)
    return cameras


def scene_of_page(path):
    with open(path, encoding="utf-8") as file:
        text = file.read()
    start = text.index('id="scene">') + len('id="scene">')
    return json.loads(text[start:text.index("</script>", start)])


def data_url(path):
    with open(path, "rb") as file:
        return "data:image/png;base64," + base64.b64encode(file.read()).decode()


def check(failures, fine, text):
    if not fine:
        failures.append(text)
        print("FAILED  " + text, flush=True)


def worst_of_page(page, truths, keep):
    """-> dB of each camera."""
    found = []
    page.resize(160, 120)  # what the page draws for itself between them takes time
    for i, truth in enumerate(truths):
        picture = page.run(f"darb.picture({i})")
        if keep:
            with open(f"{keep}_{i + 1}.png", "wb") as file:
                file.write(base64.b64decode(picture.partition(",")[2]))
        found.append(page.run(f"{COMPARE}({json.dumps(picture)}, {json.dumps(data_url(truth))})"))
    page.resize(1280, 720)
    return found


def merged_splats(page, truths):
    """-> dB of the levels that are drawn in motion, at the first camera; empty for a scene of few splats."""
    for _ in range(400):
        levels = page.run("darb.state.levels")
        if levels > 2 or page.run("darb.scene.count") < page.run("darb.fewSplats"):
            break
        time.sleep(0.05)
    page.resize(160, 120)
    found = []
    for level in range(1, levels):
        picture = page.run(f"darb.picture(0, true, {level})")
        found.append(page.run(f"{COMPARE}({json.dumps(picture)}, {json.dumps(data_url(truths[0]))})"))
    page.resize(1280, 720)
    return found


def answers(page, name, failures):
    """Mouse, keys and touch move the camera, on a window and on a phone."""
    state = lambda: page.run("({eye: darb.state.camera.eye, ahead: darb.state.camera.axes[2], far: darb.state.distance, place: darb.state.place})")
    wait = lambda ms: page.run(f"new Promise(done => setTimeout(done, {ms}))")

    def moves(what, act, key, pause=50):
        before = state()
        act()
        wait(pause)
        check(failures, state()[key] != before[key], f"{name}: {what} changes {key}")

    moves("drag", lambda: page.drag([(300, 300), (340, 310), (380, 330)]), "ahead")
    moves("right drag", lambda: page.drag([(300, 300), (340, 310)], "right"), "eye")
    moves("wheel", lambda: page.call("Input.dispatchMouseEvent", type="mouseWheel", x=300, y=300, deltaX=0, deltaY=120), "far")
    moves("W", lambda: page.key("w", "KeyW", 0.3), "eye")
    if page.run("darb.scene.cameras.length") > 1:
        moves("right arrow", lambda: page.key("ArrowRight"), "place", 700)
    page.key("?")
    check(failures, page.run("document.getElementById('help').open"), f"{name}: ? opens the help")
    page.run("document.getElementById('help').close()")
    page.resize(390, 844, 2, phone=True)
    wait(100)
    moves("one finger", lambda: page.touch([[(200, 400)], [(230, 410)], [(260, 430)]]), "ahead")
    moves("two fingers", lambda: page.touch([[(150, 400), (250, 400)], [(120, 400), (280, 400)], [(100, 400), (300, 400)]]), "far")
    check(failures, page.run("document.documentElement.scrollWidth <= innerWidth && [...document.querySelectorAll('nav button')]"
                             ".every(b => { const r = b.getBoundingClientRect(); return b.hidden || !r.width || (r.left >= 0 && r.right <= innerWidth && r.bottom <= innerHeight); })"),
          f"{name}: the panel fits on a phone")
    page.resize(1280, 720)


def check_page(page, path, truths, least, name, arguments, failures, folder, checks_answers):
    begun = time.time()
    page.open("file://" + os.path.abspath(path))
    page.run("darb.ready.then(() => new Promise(done => { const wait = () => darb.state.shown ? done() : setTimeout(wait, 5); wait(); }))")
    row = {"name": name, "bytes": os.path.getsize(path), "load_s": page.run("darb.state.loadedAfter") / 1000,
           "open_s": time.time() - begun, "splats": page.run("darb.scene.count")}
    if checks_answers:
        answers(page, name, failures)
    found = worst_of_page(page, truths, arguments.out and os.path.join(folder, name.replace(" ", "_")))
    row.update(db=found, worst_db=min(found), mean_db=sum(found) / len(found), blended=page.run("darb.state.format"))
    row["merged_db"] = merged_splats(page, truths)
    merges = 2 if row["splats"] >= page.run("darb.fewSplats") else 0
    check(failures, len(row["merged_db"]) == merges, f"{name}: {len(row['merged_db'])} levels of merged splats, {merges} are wanted")
    check(failures, all(db >= arguments.least_merged for db in row["merged_db"]), f"{name}: merged splats: {row['merged_db']}")
    if arguments.turn:
        page.run(f"darb.turn({arguments.turn})")
        row["turn"] = page.run(f"darb.turn({arguments.turn})")
    check(failures, row["worst_db"] >= least, f"{name}: {row['worst_db']:.2f} dB at worst, {least} are wanted: "
          + " ".join(f"{db:.1f}" for db in found))
    check(failures, not page.said, f"{name}: the console is written to: {page.said[:3]}")
    check(failures, [u for u in page.requests if not u.startswith("file:")] == [] and len(page.requests) == 1,
          f"{name}: asks for {page.requests}")
    return row


def check_hostile(page, scene, arguments, failures, folder):
    out = os.path.join(folder, "hostile.html")
    cameras = os.path.join(folder, "hostile.json")
    with open(cameras, "w", encoding="utf-8") as file:
        json.dump([dict(c, img_name=HOSTILE + str(i)) for i, c in enumerate(camera_list({"focus": [0, 0, 0], "radius": 1}, 2, 64, 48))], file)
    darb(arguments, "convert", "--force", scene, out, "--title", HOSTILE, "--cameras", cameras)
    page.open("file://" + os.path.abspath(out))
    page.run("darb.ready")
    check(failures, page.run("typeof hacked") == "undefined" and page.run("document.images.length") == 1,
          "hostile names: markup in a title or a camera's name is run")
    title = page.run("document.querySelector('h1').textContent")
    check(failures, title.startswith("</script><img src=x onerror=hacked=1>\"'&{{scene}}") and "\u202e" not in title,
          f"hostile names: the title is {title!r}")
    check(failures, page.run("document.getElementById('camera').textContent").startswith("</script><img"),
          "hostile names: the camera's name is not shown")
    page.resize(390, 844, 2, phone=True)
    check(failures, page.run("""[...document.querySelectorAll('nav > button')].every(b => {
      const text = document.createRange(), box = b.getBoundingClientRect();
      text.selectNodeContents(b);
      return text.getBoundingClientRect().right <= box.right - 8;
    })"""),
          "hostile names: a long name squeezes the buttons on a phone")
    page.resize(1280, 720)
    check(failures, not page.said, f"hostile names: the console is written to: {page.said[:3]}")


def check_damaged(page, path, arguments, failures, folder):
    """A page that is cut off anywhere, or has a changed letter in its splats, must say so."""
    with open(path, "rb") as file:
        whole = file.read()
    head, payload = whole.index(b"</script>"), whole.index(b'id="part0">') + 11
    last = whole.rindex(b"</script>")
    cuts = [head + 9 + (last - head - 20) * i // arguments.cuts for i in range(arguments.cuts + 1)]
    damaged = [(f"cut off at byte {cut}", whole[:cut]) for cut in cuts]
    for at in (payload + 40, (payload + last) // 2, last - 8):
        damaged.append((f"letter {at} changed", whole[:at] + (b"A" if whole[at:at + 1] != b"A" else b"B") + whole[at + 1:]))
    out = os.path.join(folder, "damaged.html")
    for what, data in damaged:
        with open(out, "wb") as file:
            file.write(data)
        page.open("file://" + os.path.abspath(out))
        for _ in range(100):
            said = page.run("document.body.innerText")
            if "not whole" in said or "Cannot show this scene" in said:
                break
            time.sleep(0.05)
        else:
            check(failures, False, f"damaged page, {what}: it says {said!r}")


def check_scene(page, name, path, arguments, failures, folder):
    width, height = map(int, arguments.size.split("x"))
    plain = os.path.join(folder, "plain.ply")
    darb(arguments, "convert", "--force", path, plain)
    first = os.path.join(folder, "first.html")
    darb(arguments, "convert", "--force", plain, first)
    cameras = os.path.join(folder, "cameras.json")
    with open(cameras, "w", encoding="utf-8") as file:
        json.dump(camera_list(scene_of_page(first), arguments.views, width, height), file)
    rows = []
    for kernel in arguments.kernels.split(","):
        scene = plain if kernel == "own" else relabelled(plain, kernel, arguments, folder)
        frames = os.path.join(folder, "frames")
        darb(arguments, "render", scene, "--cameras", cameras, "-o", frames, "--transmittance-stop", arguments.stop)
        truths = [os.path.join(frames, f"view {i + 1}.png") for i in range(arguments.views)]
        for kind in [arguments.only] if arguments.only else ["rounded", "exact"]:
            out = os.path.join(folder, f"{name}_{kernel}_{kind}.html")
            said = darb(arguments, "convert", "--force", scene, out, "--cameras", cameras, *(["--exact"] if kind == "exact" else []))
            least = arguments.least_exact if kind == "exact" else arguments.least
            row = check_page(page, out, truths, least, f"{name} {kernel} {kind}", arguments, failures, folder, not rows)
            row["stated"] = said.strip().rpartition("\n")[2].partition(": ")[2]
            rows.append(row)
            print(f"| {name} | {kernel} | {kind} | {row['splats']:,} | {row['bytes'] / 1e6:.2f} MB | {row['load_s']:.2f} s | "
                  + (f"{row['turn']['rate']:.1f}" if arguments.turn else "-")
                  + " | " + " ".join(f"{db:.1f}" for db in row["merged_db"]) + f" | {row['worst_db']:.1f} | {row['mean_db']:.1f} |", flush=True)
    return rows


def main():
    arguments = parse_arguments()
    if not browser.find():
        print("skipped: no chromium")
        return 0
    failures, rows = [], []
    with tempfile.TemporaryDirectory() as scratch, browser.Browser() as page:
        folder = arguments.out or scratch
        os.makedirs(folder, exist_ok=True)
        print("| scene | kernel | values | splats | file | first picture | frames/s | dB merged | dB at worst | dB mean |")
        print("|---|---|---|---|---|---|---|---|---|---|")
        for named in arguments.scenes:
            name, equals, path = named.partition("=")
            if not equals:
                path, name = named, os.path.basename(named.rstrip("/")).partition(".")[0]
            rows += check_scene(page, name, path, arguments, failures, folder)
        check_hostile(page, os.path.join(folder, "plain.ply"), arguments, failures, folder)
        check_damaged(page, os.path.join(folder, "hostile.html"), arguments, failures, folder)
        if arguments.out:
            with open(os.path.join(folder, "page_check.json"), "w", encoding="utf-8") as file:
                json.dump({"rows": rows, "failures": failures}, file, indent=1)
    print(f"{len(rows)} pages, {len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
