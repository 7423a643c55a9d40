#!/usr/bin/env python3
"""A picture of what commands print on a terminal of 80 columns: terminal_picture.py PICTURE COMMAND…

    python docs/tools/terminal_picture.py docs/src/images/terminal.png 'monorig run scenarios/minimal.yaml --color always'

A longer line is broken where the terminal would break it. Needs chromium (apt-get install chromium).
"""

import html
import re
import subprocess
import sys
import tempfile
from pathlib import Path

COLUMNS = 80
COLOURS = {"31": "#ff6b6b", "32": "#5fd38d", "33": "#e5c07b", "36": "#56b6c2"}
STYLE = "body{margin:0;background:#14161a;color:#d7dae0;font:15px/1.35 'DejaVu Sans Mono',monospace;padding:14px;white-space:pre}b{font-weight:400;color:#7aa2f7}"


def folded(text: str) -> str:
    """Lines broken after 80 columns; sequences for colour have no width."""
    out, column = [], 0
    for part in re.split(r"(\x1b\[[0-9;]*m|\n)", text):
        if part == "\n":
            out.append(part)
            column = 0
        elif part.startswith("\x1b"):
            out.append(part)
        else:
            for letter in part:
                if column == COLUMNS:
                    out.append("\n")
                    column = 0
                out.append(letter)
                column += 1
    return "".join(out)


def coloured(text: str) -> str:
    """HTML with the terminal's colours."""
    text = html.escape(folded(text), quote=False)

    def span(match):
        codes = [c for c in match[1].split(";") if c in COLOURS]
        return f'<span style="color:{COLOURS[codes[0]]}">' if codes else ""

    text = re.sub(r"\x1b\[0?m", "</span>", text)
    text = re.sub(r"\x1b\[([0-9;]+)m", span, text)
    return re.sub(r"(</span>)+", "</span>", text)


def main() -> int:
    picture, *commands = sys.argv[1:]
    parts, lines = [], 0
    for command in commands:
        done = subprocess.run(command, shell=True, capture_output=True, text=True)
        text = done.stdout.rstrip("\n") + "\n"
        lines += folded(text).count("\n") + 2
        parts.append(f"<b>$ {html.escape(command.replace(' --color always', ''))}</b>\n{coloured(text)}")
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "terminal.html"
        page.write_text(f"<!doctype html><meta charset=utf-8><style>{STYLE}</style><body>" + "\n".join(parts))
        size = f"{COLUMNS * 9 + 40},{int(lines * 20.25) + 34}"
        subprocess.run(["chromium", "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", f"--window-size={size}",
                        f"--screenshot={Path(picture).resolve()}", f"file://{page}"], check=True, stderr=subprocess.DEVNULL)
    return 0


if __name__ == "__main__":
    sys.exit(main())
