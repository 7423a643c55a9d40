#!/usr/bin/env python3
"""A picture of another tab of a recording, in the web viewer of a browser without a screen.

    pip install rerun-sdk==0.36.3 websocket-client            # the version in Cargo.toml
    apt-get install chromium
    python docs/tools/tab_picture.py runs/hill/1/run.rrd docs/picture.png Filters [--tabs Overview,Values,Forces,Sensors,Estimators,Filters]

The tabs stand in the order of --tabs. The native viewer (screenshot.py) draws only the tab that is open at first.
"""

import argparse
import base64
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

import websocket

SIZE = (1400, 900)
# pixels: the first tab begins at LEFT; a letter and what is around a name
LEFT, LETTER, AROUND, HEIGHT = 8, 8.0, 25, 41


def free_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def middle(tabs: list[str], wanted: str) -> float:
    """Where the middle of a tab is, about."""
    before = tabs[: tabs.index(wanted)]
    return LEFT + sum(LETTER * len(t) + AROUND for t in before) + (LETTER * len(wanted) + AROUND) / 2


class Page:
    """A page of a browser, driven by the DevTools protocol."""

    def __init__(self, port: int):
        for _ in range(120):
            try:
                pages = json.load(urllib.request.urlopen(f"http://127.0.0.1:{port}/json"))
                break
            except OSError:
                time.sleep(0.5)
        address = next(p for p in pages if p["type"] == "page")["webSocketDebuggerUrl"]
        self.socket = websocket.create_connection(address, timeout=300)
        self.last = 0

    def send(self, method: str, **parameters):
        self.last += 1
        self.socket.send(json.dumps({"id": self.last, "method": method, "params": parameters}))

    def call(self, method: str, **parameters):
        self.send(method, **parameters)
        while (answer := json.loads(self.socket.recv())).get("id") != self.last:
            pass
        return answer.get("result", answer)

    def click(self, x: float, y: float):
        at = {"x": x, "y": y, "button": "left", "clickCount": 1}
        self.call("Input.dispatchMouseEvent", type="mouseMoved", **at)
        time.sleep(3)  # a frame of the viewer at least, also on a busy machine
        # in one go: what is held down for 0.8 s is no click
        self.send("Input.dispatchMouseEvent", type="mousePressed", **at)
        self.call("Input.dispatchMouseEvent", type="mouseReleased", **at)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("tab")
    parser.add_argument("--tabs", default="Overview,Values,Forces,Sensors,Estimators,Filters")
    parser.add_argument("--wait", type=float, default=110.0, help="seconds to let the page load and draw")
    args = parser.parse_args()
    viewer, browser = shutil.which("rerun"), shutil.which("chromium")
    if viewer is None or browser is None:
        parser.error("needs `rerun` (pip install rerun-sdk==0.36.3) and `chromium`")
    ports = [free_port() for _ in range(3)]
    quiet = {"start_new_session": True, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    serve = [viewer, "--serve-web", "--web-viewer-port", str(ports[0]), "--port", str(ports[1]), str(args.recording)]
    started = [subprocess.Popen(serve, **quiet)]
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        try:
            options = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-gl=angle", "--use-angle=swiftshader",
                       "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", f"--window-size={SIZE[0]},{SIZE[1]}",
                       f"--remote-debugging-port={ports[2]}", "--remote-allow-origins=*", f"--user-data-dir={profile}", "about:blank"]
            started.append(subprocess.Popen([browser, *options], **quiet))
            page = Page(ports[2])
            page.call("Emulation.setDeviceMetricsOverride", width=SIZE[0], height=SIZE[1], deviceScaleFactor=1, mobile=False)
            dark = [{"name": "prefers-color-scheme", "value": "dark"}]
            page.call("Emulation.setEmulatedMedia", features=dark)
            source = f"rerun%2Bhttp%3A%2F%2F127.0.0.1%3A{ports[1]}%2Fproxy"
            page.call("Page.navigate", url=f"http://127.0.0.1:{ports[0]}/?url={source}&renderer=webgl&hide_welcome_screen")
            time.sleep(args.wait)
            page.click(middle(args.tabs.split(","), args.tab), HEIGHT)
            time.sleep(30)  # a busy machine takes its time to draw the tab
            picture = page.call("Page.captureScreenshot", format="png")
            args.picture.write_bytes(base64.b64decode(picture["data"]))
        finally:
            for process in started:
                os.killpg(process.pid, signal.SIGTERM)
    return 0


if __name__ == "__main__":
    sys.exit(main())
