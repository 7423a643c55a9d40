#!/usr/bin/env python3
"""Measure what an estimator takes on a Cortex-M4F and write docs/notes/firmware.md: flash, RAM, stack, instructions per step.

    python docs/tools/firmware.py            # measure and write
    python docs/tools/firmware.py --print    # measure and print

Needs Rust's target thumbv7em-none-eabihf, QEMU (`apt-get install qemu-system-arm`) and llvm-size or size; says "skipped" where one is missing.
"""

import os
import re
import shutil
import subprocess
import sys
from datetime import date
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CRATE = ROOT / "docs" / "tools" / "firmware"
PAGE = ROOT / "docs" / "notes" / "firmware.md"
TARGET = "thumbv7em-none-eabihf"
REGISTRY = ROOT / "estimators" / "src" / "registry.rs"
QEMU = "qemu-system-arm -M mps2-an386 -nographic -monitor none -serial none -semihosting-config enable=on,target=native -icount shift=0"


def revision() -> str:
    """The revision that is measured."""
    return subprocess.run(["git", "rev-parse", "--short=8", "HEAD"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()


HEAD = f"""# On a controller

Here you find how much flash, memory and time each estimator takes on a Cortex-M4F (one unit for single precision, none
for double): a train of 8 drive units and 18 m over a rail of changing grade, a minute of starts and stops, a step every
10 ms with a new sample on every channel. Made by `python docs/tools/firmware.py`: link-time optimisation,
`opt-level = "s"`, QEMU (`mps2-an386`, one instruction a nanosecond), {date.today()}, revision {revision()}.

- *Flash*: code and constants beyond a program without an estimator, with the used parts of `libm` and of software floating point.
- *RAM*: the estimator itself; there is no heap. *Stack*: the deepest of all steps.
- *By name*: `dffrls_aekf_robust` through the registry, with all sources.
- The methods as printed are left out: no controller should run them.
- In single precision the estimators calculate nothing in double precision, but `sinf` and `cosf` of `libm` do.

"""


def estimators() -> dict[str, str]:
    """Names of all estimators but the printed ones, with the paths of their pipelines: as the registry has them, ours and supervised first."""
    text = REGISTRY.read_text()
    paths = {}
    for root, many, one in re.findall(r"^use crate::([\w:]+)::(?:\{([^}]*)\}|(\w+(?: as \w+)?));", text, re.M):
        for item in (many or one).split(","):
            name, _, alias = item.strip().partition(" as ")
            paths[alias or name] = f"{root}::{name}"
    rows = re.findall(r'"(\w+)" in "\w+" as (\w+) => (\w+)::', text)
    rows.sort(key=lambda row: row[1] != "Supervised")
    return {name: paths[module] for name, _, module in rows} | {"by name": "by name"}


def size_tool() -> str | None:
    """A program that tells the size of sections."""
    return next((tool for tool in ("llvm-size", "rust-size", "arm-none-eabi-size", "size") if shutil.which(tool)), None)


def target_there() -> bool:
    """Whether Rust can build for the target, which is added if that can be."""
    add = ["rustup", "target", "add", TARGET]
    return shutil.which("rustup") is not None and subprocess.run(add, capture_output=True).returncode == 0


def build(precision: str, pipeline: str | None) -> Path:
    command = ["cargo", "build", "--quiet", "--release", "--features", precision, "--message-format", "json-render-diagnostics"]
    env = os.environ | ({"MONORIG_PIPELINE": pipeline} if pipeline else {})
    out = subprocess.run(command, cwd=CRATE, env=env, check=True, stdout=subprocess.PIPE, text=True).stdout
    return Path(re.findall(r'"executable":"([^"]+)"', out)[-1])


def flash(tool: str, program: Path) -> int:
    out = subprocess.run([tool, str(program)], check=True, capture_output=True, text=True).stdout
    text, data = out.splitlines()[1].split()[:2]
    return int(text) + int(data)


def run(program: Path) -> dict[str, int]:
    out = subprocess.run([*QEMU.split(), "-kernel", str(program)], check=True, capture_output=True, text=True, timeout=600)
    return {name: int(value) for name, value in re.findall(r"(\w+) (\d+)", out.stdout)}


def main() -> None:
    tool = size_tool()
    for there, what in [(shutil.which("qemu-system-arm"), "qemu-system-arm"), (tool, "llvm-size"), (target_there(), TARGET)]:
        if not there:
            sys.exit(f"skipped: {what} is not here")
    page = HEAD
    for precision, title in [("single", "Single precision"), ("double", "Double precision, in software")]:
        empty = flash(tool, build(precision, None))
        page += f"## {title}\n\n| estimator | flash, kB | RAM, B | stack, B | instructions per step, mean | worst |\n|---|---|---|---|---|---|\n"
        for name, pipeline in estimators().items():
            program = build(precision, pipeline)
            kb = (flash(tool, program) - empty) / 1000
            found = run(program)
            print(precision, name, f"{kb:.0f} kB", found, file=sys.stderr, flush=True)
            if found["refused"]:
                sys.exit(f"{name} refuses {found['refused']} of the steps")
            name = name if name == pipeline else f"`{name}`"
            page += f"| {name} | {kb:.0f} | {found['ram']} | {found['stack']} | {found['mean'] / 1000:.0f} k | {found['worst'] / 1000:.0f} k |\n"
        page += "\n"
    page += "At 100 MHz and a step every 10 ms there are a million cycles for a step; an M4F takes one to two for an instruction.\n"
    print(page)
    if "--print" not in sys.argv[1:]:
        PAGE.write_text(page)


main()
