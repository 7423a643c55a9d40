"""The program `monorig`, which a wheel has beside the module."""

from __future__ import annotations

import os
import pathlib
import shutil
import subprocess
import sysconfig

from ._errors import InputError
from ._types import Path


def check(*files: Path) -> list[str]:
    """Checks files without running anything, as ``monorig check`` does: scenarios, tracks, maps, results.

    Returns:
        Of each file what it is.

    Raises:
        InputError: Something is wrong with one of them; the message has every mistake.
        FileNotFoundError: The program ``monorig`` is not installed.
    """
    words = [_program(), "--color", "never", "check", "--", *[os.fspath(file) for file in files]]
    done = subprocess.run(words, capture_output=True, text=True, encoding="utf-8", check=False)
    if done.returncode != 0:
        # the last line counts the files
        told = [line for line in done.stderr.splitlines() if not line.endswith("files cannot be used")]
        message, _, help = "\n".join(told).removeprefix("error: ").partition("\n  help: ")
        raise InputError(message, help)
    return done.stdout.splitlines()


def _program() -> str:
    """The program that MONORIG names, that of the wheel, or the one on the path."""
    of_wheel = pathlib.Path(sysconfig.get_path("scripts")) / ("monorig.exe" if os.name == "nt" else "monorig")
    found = os.environ.get("MONORIG") or (str(of_wheel) if of_wheel.is_file() else shutil.which("monorig"))
    if found is None:
        raise FileNotFoundError(
            "the program `monorig` is not here\n  help: `cargo install --path cli` in a checkout; MONORIG=PATH names one"
        )
    return found
