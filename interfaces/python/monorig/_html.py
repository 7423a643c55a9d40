"""A run as a notebook shows it: verdict, table, one plot."""

from __future__ import annotations

import html
import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from ._run import Run

_SHOWN = ("mass_error_rel_max", "mass_availability", "slope_rmse_deg", "slope_availability")
_COLOURS = ("#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377")
_WIDTH, _HEIGHT, _LEFT, _BELOW = 640, 220, 48, 22
_POINTS = 600


def of_run(run: Run) -> str:
    """Verdict, table of the main metrics, slope over time."""
    passed = run.passed
    colour = "#228833" if passed else "#cc3311"
    word = "passed" if passed else "failed"
    title = f"<b>{html.escape(run.scenario)}</b>, seed {run.seed}: <b style='color:{colour}'>{word}</b>"
    broken = [e for e in run.expectations if not e.held and e.known_failure is None]
    told = "".join(f"<li>{html.escape(f'{e.what} is {_number(e.value)}, bound {e.bound}')}</li>" for e in broken)
    return f"<div>{title}<ul>{told}</ul>{table(run.metrics, _SHOWN)}{_plot(run)}</div>"


def table(metrics: dict[str, dict[str, float | None]], shown: tuple[str, ...]) -> str:
    """A row an estimator, a column a metric."""
    head = "".join(f"<th>{html.escape(name)}</th>" for name in shown)
    rows = "".join(
        f"<tr><td>{html.escape(name)}</td>"
        + "".join(f"<td>{_number(of.get(metric))}</td>" for metric in shown)
        + "</tr>"
        for name, of in metrics.items()
    )
    return f"<table><tr><th></th>{head}</tr>{rows}</table>"


def _number(x: float | None) -> str:
    return "–" if x is None else f"{x:.3g}"


def _plot(run: Run) -> str:
    """The slope and its estimates, degrees over seconds."""
    lines = {"truth": run["truth/grade_at_imu"]}
    names = run.channels.names
    for name in run.metrics:
        if f"estimates/{name}/grade" in names:
            lines[name] = run[f"estimates/{name}/grade"]
    time = run["time"]
    # what the estimates do before they have started would hide the rest
    truth = np.degrees(lines["truth"])
    known = truth[np.isfinite(truth)]
    if time.size < 2 or known.size == 0:
        return ""
    low, high = float(known.min()) - 2.0, float(known.max()) + 2.0
    parts = [_axes(float(time[0]), float(time[-1]), low, high)]
    for i, (name, values) in enumerate(lines.items()):
        colour = "#888888" if name == "truth" else _COLOURS[(i - 1) % len(_COLOURS)]
        path = _path(time, np.degrees(values), low, high)
        parts.append(f"<path d='{path}' fill='none' stroke='{colour}' stroke-width='1.2'/>")
        x = _LEFT + 8 + 150 * (i % 4)
        y = 12 + 13 * (i // 4)
        parts.append(f"<text x='{x}' y='{y}' font-size='11' fill='{colour}'>{html.escape(name)}</text>")
    size = f"width='{_WIDTH}' height='{_HEIGHT}' viewBox='0 0 {_WIDTH} {_HEIGHT}'"
    return f"<svg xmlns='http://www.w3.org/2000/svg' {size}>{''.join(parts)}</svg>"


def _path(time: npt.NDArray[np.float64], values: npt.NDArray[np.float64], low: float, high: float) -> str:
    """A line through about so many points; gaps where there is no value."""
    step = max(1, time.size // _POINTS)
    x = _LEFT + (time - time[0]) / (time[-1] - time[0]) * (_WIDTH - _LEFT)
    y = (high - np.clip(values, low, high)) / (high - low) * (_HEIGHT - _BELOW)
    parts, pen = [], "M"
    for px, py in zip(x[::step], y[::step]):
        if math.isfinite(py):
            parts.append(f"{pen}{px:.1f},{py:.1f}")
            pen = "L"
        else:
            pen = "M"
    return "".join(parts)


def _axes(start: float, end: float, low: float, high: float) -> str:
    base = _HEIGHT - _BELOW
    frame = f"<rect x='{_LEFT}' y='0' width='{_WIDTH - _LEFT}' height='{base}' fill='none' stroke='#bbbbbb'/>"
    label = "<text font-size='11' fill='#888888' x='{x}' y='{y}'>{text}</text>"
    texts = [
        label.format(x=_LEFT, y=_HEIGHT - 6, text=f"{start:g} s"),
        label.format(x=_WIDTH - 40, y=_HEIGHT - 6, text=f"{end:g} s"),
        label.format(x=2, y=12, text=f"{high:.1f}°"),
        label.format(x=2, y=base, text=f"{low:.1f}°"),
    ]
    return frame + "".join(texts)
