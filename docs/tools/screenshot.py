#!/usr/bin/env python3
"""A picture of a recording, without a screen.

    pip install rerun-sdk==0.36.3            # the version in Cargo.toml
    apt-get install mesa-vulkan-drivers      # a graphics driver that draws on the processor
    python docs/tools/screenshot.py runs/hill/1/run.rrd docs/picture.png [--size 1600x1000]

--only-train takes the picture of the 3-D view alone. The viewer plays the recording from its start while it
loads: --wait (seconds) decides how far it gets.
"""

import argparse
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

# The 3-D view: FIRST_ID in interfaces/viz/src/views.rs.
TRAIN_VIEW = "6d6f6e6f-7269-6700-0000-000000000001"


def free_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--size", default="1600x1000")
    parser.add_argument("--only-train", action="store_true")
    parser.add_argument("--wait", type=float, default=12.0, help="seconds to let the viewer load and draw")
    args = parser.parse_args()
    if not args.recording.is_file():
        parser.error(f"no such file: {args.recording}")
    viewer = shutil.which("rerun")
    if viewer is None:
        parser.error("no `rerun` program: pip install rerun-sdk==0.36.3")

    from rerun.experimental import ViewerClient

    port = free_port()
    # `rerun` is a wrapper that starts the viewer proper: a group of their own, so that both end.
    process = subprocess.Popen(
        [viewer, "--headless", "--port", str(port), "--window-size", args.size, str(args.recording)],
        start_new_session=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    args.picture.unlink(missing_ok=True)
    try:
        time.sleep(args.wait)
        client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
        view = TRAIN_VIEW if args.only_train else None
        client.save_screenshot(str(args.picture.resolve()), view_id=view)
        # The viewer writes it when it next draws: wait for the last chunk of the PNG.
        for _ in range(300):
            if args.picture.is_file() and args.picture.read_bytes()[-8:-4] == b"IEND":
                return 0
            time.sleep(0.1)
        print("the viewer made no picture", file=sys.stderr)
        return 1
    finally:
        os.killpg(process.pid, signal.SIGTERM)
        try:
            process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)


if __name__ == "__main__":
    sys.exit(main())
