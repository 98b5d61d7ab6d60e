#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""tools/lab/window_pictures.py OUT RUN [--mesh FILE] [--only WORD]: pictures of the window, one for
each panel, menu, tool and dialog.

It drives `darb view` on a virtual display, as hands would, and writes about forty PNG files into
the folder OUT: at 1280x720, at 1920x1080 and at a scale of 1.5. Look at all of them before and
after a change of the window: text that is cut, things that overlap, columns that are not aligned.
RUN is the folder of a finished run with cameras, such as

    darb train assets/scene -o RUN -r 160 --iterations 300 --eval

Xvfb, xdotool and ImageMagick must be installed. It takes about five minutes.
"""

import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
TABS = ["Scene", "View", "Camera", "Splats", "Mesh", "Measure", "Film"]
MENUS = {"File": 22, "Edit": 62, "Select": 108, "View": 154, "Tools": 200, "Help": 246}
SIDE, MENU, TOOLBAR = 350, 23, 44  # px at scale 1, as in viewer/panels/panels.cpp


class Display:
    """Xvfb of this size."""

    def __init__(self, width, height, folder):
        self.folder = folder
        read, write = os.pipe()
        with open(folder / "xvfb.log", "w", encoding="utf-8") as log:
            self.process = subprocess.Popen(
                ["Xvfb", "-displayfd", str(write), "-screen", "0", f"{width}x{height}x24",
                 "-fbdir", str(folder), "-nocursor", "-nolisten", "tcp"], pass_fds=[write],
                stderr=log)
        os.close(write)
        with os.fdopen(read) as line:
            number = line.readline().strip()
        if not number:
            sys.exit("Xvfb did not start: " + (folder / "xvfb.log").read_text())
        self.env = dict(os.environ, DISPLAY=":" + number, XDG_STATE_HOME=str(folder / "state"))

    def close(self):
        self.process.terminate()
        self.process.wait()


class Window:
    """darb view with these arguments, on a display of its own."""

    def __init__(self, out, width, height, arguments, scale=1.0, only=""):
        self.width, self.height, self.scale, self.out, self.only = width, height, scale, out, only
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="darb_pictures_"))
        self.display = Display(width, height, self.folder)
        darb = os.environ.get("DARB", str(ROOT / "build" / "darb"))
        words = [darb, "view", *arguments, "--size", f"{width}x{height}"]
        if scale != 1:
            words += ["--gui-scale", str(scale)]
        with open(self.folder / "view.log", "w", encoding="utf-8") as log:
            self.process = subprocess.Popen(words, env=self.display.env, cwd=self.folder,
                                            stdout=log, stderr=log)
        self.rest(4.0)  # a scene is loaded meanwhile

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()
        self.display.close()

    def picture(self):
        """What the display shows, as a file of X11's xwd."""
        return (self.folder / "Xvfb_screen0").read_bytes()

    def rest(self, seconds=0.6):
        """Waits until the window has not changed for so long."""
        last, since, end = b"", time.monotonic(), time.monotonic() + 90
        while time.monotonic() < end:
            if self.process.poll() is not None:
                sys.exit("darb view ended: " + (self.folder / "view.log").read_text())
            now = self.picture()
            if now != last or len(set(now[100_000:200_000])) < 2:
                last, since = now, time.monotonic()
            elif time.monotonic() - since > seconds:
                return
            time.sleep(0.1)

    def xdo(self, *words):
        subprocess.run(["xdotool", *[str(w) for w in words]], env=self.display.env, check=True)
        time.sleep(0.15)

    def at(self, x, y):
        return round(x), round(y)

    def move(self, x, y):
        self.xdo("mousemove", *self.at(x, y))

    def click(self, x, y):
        self.move(x, y)
        self.xdo("click", 1)

    def drag(self, *points):
        self.move(*points[0])
        self.xdo("mousedown", 1)
        for point in points[1:]:
            self.move(*point)
        self.xdo("mouseup", 1)

    def key(self, *names):
        self.away()
        for name in names:
            self.xdo("key", name)

    def away(self):
        """The pointer where it explains nothing: the lower middle of the picture."""
        self.move(*self.middle(0.5, 0.9))

    def middle(self, x=0.5, y=0.5):
        """A place in the picture, in shares of the area between toolbar and properties."""
        left, right = TOOLBAR * self.scale, self.width - SIDE * self.scale
        return left + x * (right - left), MENU * self.scale + y * (self.height - MENU * self.scale)

    def tab(self, name):
        s, (row, column) = self.scale, divmod(TABS.index(name), 4)
        outliner = min(max(0.22 * (self.height - MENU * s), 92 * s), 220 * s)
        x = self.width - SIDE * s + 10 * s + column * 83 * s + 39 * s
        self.click(x, MENU * s + outliner + (23 + 10 + 12 + row * 29) * s)
        self.away()

    def menu(self, name):
        self.click(MENUS[name] * self.scale, 11 * self.scale)

    def properties(self, x, y):
        """A place below the tabs, px at scale 1 from the upper left corner of the properties."""
        s = self.scale
        outliner = min(max(0.22 * (self.height - MENU * s), 92 * s), 220 * s)
        return self.width - SIDE * s + (10 + x) * s, MENU * s + outliner + (33 + 60 + y) * s

    def shot(self, name, still=True):
        if self.only and self.only not in name:
            return
        if still:
            self.rest()
        file = self.out / f"{name}.png"
        subprocess.run(["convert", "xwd:-", str(file)], input=self.picture(), check=True)
        print(file, flush=True)


def empty_windows(a):
    for width, height, scale in ((1280, 720, 1.0), (1920, 1080, 1.0), (1280, 720, 1.5)):
        with Window(a.out, width, height, [], scale, a.only) as w:
            w.shot(f"empty_{width}x{height}_scale_{scale}")
            if width == 1920:
                w.key("ctrl+o")
                w.away()
                w.shot("dialog_open")
                w.key("Escape", "F1")
                w.shot("dialog_keys")


def panels(a, width, height, scale):
    size = f"{width}x{height}_scale_{scale}"
    more = ["--mesh", a.mesh] if a.mesh else []
    with Window(a.out, width, height, [a.run, *more], scale, a.only) as w:
        w.shot(f"opened_{size}")
        w.key("v")
        for tab in TABS:
            w.tab(tab)
            w.shot(f"tab_{tab.lower()}_{size}")
        w.tab("View")
        w.key("g", "c")
        w.shot(f"guides_{size}")
        for menu in MENUS:
            w.menu(menu)
            w.shot(f"menu_{menu.lower()}_{size}")
            w.key("Escape")


def tools(a):
    with Window(a.out, 1280, 720, [a.run], 1.0, a.only) as w:
        w.key("v")
        w.key("2")
        w.drag(w.middle(0.3, 0.35), w.middle(0.5, 0.5), w.middle(0.6, 0.7))
        w.away()
        w.shot("tool_rectangle")
        w.key("6")
        w.shot("tool_move")
        w.key("7")
        w.shot("tool_turn")
        w.key("ctrl+d", "5")
        w.move(*w.middle(0.45, 0.5))
        w.xdo("mousedown", 1)
        w.move(*w.middle(0.5, 0.6))
        w.move(*w.middle(0.55, 0.62))
        w.shot("tool_sphere_dragged")
        w.xdo("mouseup", 1)
        w.key("9")
        for place in ((0.3, 0.6), (0.6, 0.65), (0.5, 0.8)):
            w.click(*w.middle(*place))
        w.shot("tool_measure")
        w.move(22, 87)
        w.shot("toolbar_tip")
        w.key("1")
        w.tab("Splats")
        w.shot("splats_folded")
        w.key("2")
        w.drag(w.middle(0.3, 0.35), w.middle(0.5, 0.5), w.middle(0.6, 0.7))
        w.key("Delete", "ctrl+q")
        w.away()
        w.shot("dialog_not_saved")


def training(a):
    """The form, what it says of photos and of mistakes, and the run."""
    for width, height, scale in ((1280, 720, 1.0), (1920, 1080, 1.0), (1280, 720, 1.5)):
        size = f"{width}x{height}_scale_{scale}"
        with Window(a.out, width, height, [], scale, a.only) as w:
            w.key("ctrl+t")
            w.away()
            w.shot(f"train_form_{size}")
            # the form is 640 x 620 at scale 1 and at most 0.9 of the height
            high = min(0.9 * height, 620 * scale)
            top, left = 0.53 * height - high / 2, (width - min(width, 640 * scale)) / 2

            def type_into(row, text):
                w.click(left + 300 * scale, top + (45 + 29 * row) * scale)
                w.rest()
                w.xdo("keydown", "ctrl", "keydown", "a", "sleep", 0.3, "keyup", "a", "keyup", "ctrl")
                w.xdo("type", "--delay", "5", text) if text else w.xdo("key", "BackSpace")
                w.xdo("key", "Tab")

            type_into(0, str(ROOT / "assets" / "scene"))
            type_into(1, str(w.folder / "run"))
            type_into(2, "preview")
            w.away()
            w.rest(30)  # until there is a forecast
            w.shot(f"train_form_forecast_{size}")
            type_into(7, "cube:1")  # from below, as complaints move what is below them
            type_into(3, "many")
            w.away()
            w.shot(f"train_form_mistakes_{size}")
            if scale != 1 or width != 1280:
                continue
            type_into(3, "400")
            type_into(7, "")
            w.away()
            w.rest(15)
            w.click(left + 60 * scale, top + high - 26 * scale)
            w.away()
            end = time.monotonic() + 120
            while not (w.folder / "run" / "run.jsonl").exists() and time.monotonic() < end:
                time.sleep(0.2)
            time.sleep(12)
            w.shot("train_run", still=False)
            w.key("ctrl+q")
            w.away()
            time.sleep(2)
            w.shot("dialog_run_goes_on", still=False)


def side_by_side(a):
    with Window(a.out, 1280, 720, [a.run, "--beside", "raised_cosine,sinc", "--difference"], 1.0,
                a.only) as w:
        w.key("v")
        w.shot("side_by_side")
    for show in ("depth", "work", "error"):
        more = ["--camera", "0"] if show == "error" else []
        with Window(a.out, 1280, 720, [a.run, "--show", show, *more], 1.0, a.only) as w:
            w.shot(f"show_{show}")
    with Window(a.out, 1280, 720, [a.run, a.run], 1.0, a.only) as w:
        w.rest(2)
        w.shot("layers")
    with Window(a.out, 1280, 720, [a.run, "-w"], 1.0, a.only) as w:
        w.key("v", "2")
        w.move(*w.middle(0.2, 0.1))
        w.xdo("mousedown", 1)
        w.move(*w.middle(0.4, 0.4))
        w.move(*w.middle(0.7, 0.7))
        w.shot("white_rectangle_dragged")
        w.xdo("mouseup", 1)
        w.shot("white_selected")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("run", type=lambda text: str(pathlib.Path(text).absolute()))
    parser.add_argument("--mesh", type=lambda text: str(pathlib.Path(text).absolute()))
    parser.add_argument("--only", default="", help="only those with this word in their name")
    a = parser.parse_args()
    a.out = a.out.absolute()
    a.out.mkdir(parents=True, exist_ok=True)
    if a.only.startswith("train"):
        return training(a)
    empty_windows(a)
    for size in ((1280, 720, 1.0), (1920, 1080, 1.0), (1280, 720, 1.5)):
        panels(a, *size)
    tools(a)
    side_by_side(a)
    training(a)


if __name__ == "__main__":
    main()
