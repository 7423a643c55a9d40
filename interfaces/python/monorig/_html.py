"""A run as a notebook and a terminal show it: verdict, reasons, table, one plot."""

from __future__ import annotations

import html
import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from . import _monorig

if TYPE_CHECKING:
    from ._run import Run

_SHOWN = ("mass_error_rel_max", "mass_availability", "slope_rmse_deg", "slope_availability")
# those of the reports
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#b4568f", "#b98000", "#56b4e9")
_GRADES = {"FAILED": "#b3261e", "nothing was expected": "#5d666f", "held but": "#8a5a00", "held with": "#8a5a00"}
_WIDTH, _HEIGHT, _LEFT, _BELOW = 640, 220, 48, 22
_POINTS = 600


def colour_of(estimator: str) -> str:
    """The colour of an estimator, the same as in reports and in the viewer."""
    return _COLOURS[_monorig.colour_place(estimator) % len(_COLOURS)]


def of_run(run: Run) -> str:
    """Verdict and its reasons, table of the main metrics, slope over time."""
    grade = next((colour for word, colour in _GRADES.items() if run.verdict.startswith(word)), "#00795a")
    verdict = f"<b style='color:{grade}'>{html.escape(run.verdict)}</b>"
    title = f"<b>{html.escape(run.scenario)}</b>, seed {run.seed}: {verdict}"
    told = "".join(f"<li>{html.escape(failure)}</li>" for failure in run.failures)
    return f"<div>{title}<ul>{told}</ul>{table(run.metrics, _SHOWN)}{_plot(run)}</div>"


def as_text(run: Run) -> str:
    """Verdict, its reasons and the main metrics, a line each."""
    lines = [f"{run.scenario}, seed {run.seed}: {run.verdict}", *(f"  - {failure}" for failure in run.failures)]
    for name, of in run.metrics.items():
        lines.append(f"  {name}: " + ", ".join(f"{metric} {_number(of.get(metric))}" for metric in _SHOWN))
    return "\n".join(lines)


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
        colour = "#888888" if name == "truth" else colour_of(name)
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
