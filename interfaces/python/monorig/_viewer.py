"""The recording of a run in the Rerun viewer, with the layout that the program gives it."""

from __future__ import annotations

import os
import pathlib
import subprocess
import sys
import tempfile
from typing import TYPE_CHECKING

from ._errors import InputError
from ._types import Path

if TYPE_CHECKING:
    from ._run import Run


def show(run: Run, path: Path | None) -> None:
    """Opens the viewer, or writes an ``.rrd`` file."""
    if path is None and not _has_viewer():
        raise ImportError('the viewer is not installed\n  help: pip install "monorig[viewer]"')
    place = pathlib.Path(path) if path is not None else pathlib.Path(tempfile.mkdtemp(prefix="monorig-")) / "run.rrd"
    if not run._native.record(os.fspath(place)):
        raise InputError(
            "there is no recording of this run",
            "a run made by a module with the feature `viewer`; or a folder that has run.rrd, as `monorig run` leaves it",
        )
    if path is None:
        subprocess.Popen([sys.executable, "-m", "rerun", os.fspath(place)])


def _has_viewer() -> bool:
    import importlib.util

    return importlib.util.find_spec("rerun") is not None
