# SPDX-License-Identifier: MIT
"""Headless Chromium over its debugging pipe, and what a page reports and requests. Needs only the standard library.

Used by tools/page_check.py; it does nothing by itself.
"""

import base64
import json
import os
import shutil
import subprocess
import tempfile

NAMES = ("chromium", "chromium-browser", "google-chrome")
FLAGS = ["--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync", "--mute-audio", "--hide-scrollbars", "--remote-debugging-pipe"]
WITH_WEBGL = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
WITHOUT_WEBGL = ["--disable-gpu", "--disable-3d-apis"]


def find():
    """The browser's path, or None."""
    return next((path for path in map(shutil.which, NAMES) if path), None)


class Browser:
    """One page. said: console messages and exceptions; requests: addresses that it asked for, without data: and blob:."""

    def __init__(self, width=1280, height=720, webgl=True):
        # The browser's helpers may still write there after it has ended.
        self.profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        read_end, self.write_to = os.pipe()
        self.read_from, write_end = os.pipe()

        def renumber():  # the browser reads from 3 and writes to 4
            reading, writing = os.dup(read_end), os.dup(write_end)
            os.dup2(reading, 3)
            os.dup2(writing, 4)

        self.process = subprocess.Popen([find(), *FLAGS, *(WITH_WEBGL if webgl else WITHOUT_WEBGL), f"--user-data-dir={self.profile.name}", "about:blank"],
                                        preexec_fn=renumber, close_fds=False, stdout=subprocess.DEVNULL,
                                        stderr=subprocess.DEVNULL)
        os.close(read_end)
        os.close(write_end)
        self.rest, self.number, self.session = b"", 0, None
        self.said, self.requests, self.waiting = [], [], []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(domain + ".enable")
        self.resize(width, height)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()
        os.close(self.write_to)
        os.close(self.read_from)
        self.profile.cleanup()

    def message(self):
        while b"\0" not in self.rest:
            block = os.read(self.read_from, 1 << 20)
            if not block:
                raise RuntimeError("the browser has ended")
            self.rest += block
        text, _, self.rest = self.rest.partition(b"\0")
        return json.loads(text)

    def note(self, event):
        method, params = event.get("method"), event.get("params", {})
        if method == "Runtime.consoleAPICalled":
            self.said.append(" ".join(str(a.get("value", a.get("description", ""))) for a in params["args"]))
        elif method == "Runtime.exceptionThrown":
            details = params["exceptionDetails"]
            self.said.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Log.entryAdded":
            self.said.append(params["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            url = params["request"]["url"]
            if not url.startswith(("data:", "blob:")):
                self.requests.append(url)
        self.waiting.append(method)

    def call(self, method, **params):
        self.number += 1
        message = {"id": self.number, "method": method, "params": params}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.write_to, json.dumps(message).encode() + b"\0")
        while True:
            answer = self.message()
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]
            self.note(answer)

    def resize(self, width, height, ratio=1, phone=False):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=ratio, mobile=phone)
        self.call("Emulation.setTouchEmulationEnabled", enabled=phone, maxTouchPoints=5)

    def open(self, address):
        self.said, self.requests = [], []
        self.waiting = []
        self.call("Page.navigate", url=address)
        while "Page.loadEventFired" not in self.waiting:
            self.note(self.message())

    def run(self, script):
        """The value of a JavaScript expression, awaited."""
        result = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in result:
            details = result["exceptionDetails"]
            raise RuntimeError(details.get("exception", {}).get("description", details["text"]))
        return result["result"].get("value")

    def screenshot(self, path):
        data = self.call("Page.captureScreenshot", format="png")["data"]
        with open(path, "wb") as file:
            file.write(base64.b64decode(data))

    def touch(self, steps):
        """steps: lists of (x, y) of the fingers. The first list puts them down, and they are lifted at the end."""
        for i, points in enumerate(steps):
            self.call("Input.dispatchTouchEvent", type="touchMove" if i else "touchStart",
                      touchPoints=[{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(points)])
        self.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def drag(self, steps, button="left"):
        for i, (x, y) in enumerate(steps):
            self.call("Input.dispatchMouseEvent", type="mouseMoved" if i else "mousePressed", x=x, y=y, button=button,
                      buttons={"left": 1, "right": 2}[button], clickCount=1)
        self.call("Input.dispatchMouseEvent", type="mouseReleased", x=steps[-1][0], y=steps[-1][1], button=button)

    def key(self, key, code=None, hold_s=0):
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, code=code or key)
        if hold_s:
            self.run(f"new Promise(done => setTimeout(done, {1000 * hold_s}))")
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key, code=code or key)


if __name__ == "__main__":
    print(__doc__)
