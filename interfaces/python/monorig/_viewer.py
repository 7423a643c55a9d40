"""The channels of a run in the Rerun viewer."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from ._types import Path

if TYPE_CHECKING:
    from ._run import Run


def show(run: Run, path: Path | None) -> None:
    """Open the viewer, or write an ``.rrd`` file."""
    try:
        import rerun
    except ImportError as e:
        raise ImportError("the viewer is not installed\n  help: pip install 'monorig[viewer]'") from e
    recording = rerun.RecordingStream(f"monorig {run.scenario}", recording_id=f"seed {run.seed}")
    if path is None:
        recording.spawn()
    else:
        recording.save(os.fspath(path))
    time = run["time"]
    for name in run.channels.names:
        if name == "time":
            continue
        values = run[name]
        there = values == values
        if there.any():
            index = rerun.TimeColumn("time", duration=time[there])
            recording.send_columns(name, [index], rerun.Scalars.columns(scalars=values[there]))
    for at, text in run.events:
        recording.set_time("time", duration=at)
        recording.log("events", rerun.TextLog(text))
    recording.flush()
