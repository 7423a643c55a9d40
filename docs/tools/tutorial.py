#!/usr/bin/env python3
"""Run every `monorig` command and every Python snippet of docs/src/tutorial.md, in order, and show what they print.

    python docs/tools/tutorial.py [--monorig target/release/monorig] [--out /tmp/tutorial]

From the root of the repository; needs pyarrow and pandas. Exit code 1 if a command cannot run (exit code 2 of monorig) where
the page does not show an error. For bringing the outputs in the page up to date by hand.
"""

import argparse
import re
import subprocess
import sys
from pathlib import Path

PAGE = Path("docs/src/tutorial.md")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--monorig", default="target/release/monorig")
    parser.add_argument("--out", default="/tmp/tutorial")
    args = parser.parse_args()
    text = PAGE.read_text()
    failed = 0
    snippets: dict = {}
    for part in re.finditer(r"^    (monorig (?:run|check|schema) [^\n]*)$|^```python\n(.*?)^```", text, re.M | re.S):
        command, code = part.group(1), part.group(2)
        if code:
            print(f"\n>>> {code.strip()}")
            exec(code.replace('"runs/', f'"{args.out}/'), snippets)
            continue
        print(f"\n$ {command}")
        full = command.replace("monorig", args.monorig, 1)
        if command.startswith("monorig run"):
            full += f" --out {args.out}"
        code = subprocess.run(full, shell=True).returncode
        meant = re.match(r"\s*```text\nerror:", text[part.end() :]) is not None
        if (code == 2) != meant:
            print(f"exit code {code}, which the page does not show")
            failed += 1
    return 1 if failed else 0


sys.exit(main())
