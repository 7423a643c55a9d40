"""Errors of a run, drawn by matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ._errors import InputError
from ._html import colour_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ._run import Run

# quantity, its truth, its unit in the plot, and the factor to this unit
_DRAWN = (
    ("total_mass", "truth/total_mass", "error of the mass, t", 1e-3),
    ("grade", "truth/grade_at_imu", "error of the slope, °", 180.0 / np.pi),
)


def errors(run: Run, estimators: Sequence[str] | None) -> Figure:
    """A plot for mass and one for slope: valid errors strong, others faint, ±2σ as a band, faults as grey stretches."""
    try:
        import matplotlib.pyplot as plt
    except ImportError as e:
        raise ImportError('matplotlib is not installed\n  help: pip install "monorig[plot]"') from e
    names = list(run.metrics) if estimators is None else list(estimators)
    for name in names:
        if name not in run.metrics:
            raise InputError(f"the run has no estimator `{name}`", f"one of: {', '.join(run.metrics)}")
    figure: Figure
    figure, axes = plt.subplots(len(_DRAWN), 1, sharex=True, figsize=(9, 6), layout="constrained")
    time = run["time"]
    for ax, (quantity, truth, label, factor) in zip(axes, _DRAWN):
        largest = 0.0
        for name in names:
            path = f"estimates/{name}/{quantity}"
            if path not in run.channels or truth not in run.channels:
                continue
            error, sd = factor * (run[path] - run[truth]), factor * run[f"{path}_sd"]
            valid, colour = run[f"{path}_valid"] == 1.0, colour_of(name)
            ax.plot(time, error, color=colour, alpha=0.3, linewidth=0.8)
            ax.plot(time, np.where(valid, error, np.nan), color=colour, label=name)
            band = np.where(valid, 2.0 * sd, np.nan)
            ax.fill_between(time, -band, band, color=colour, alpha=0.12, linewidth=0, label=f"±2σ of {name}")
            largest = max(largest, np.nanmax(np.abs(np.r_[error[valid], 0.0])), np.median(np.r_[band[valid], 0.0]))
        for fault in run.faults:
            ax.axvspan(fault.from_s, min(fault.to_s, time[-1]), color="0.5", alpha=0.2)
            ax.annotate(f"{fault.sensor}: {fault.what}", (fault.from_s, 1.0), xycoords=("data", "axes fraction"), va="top", fontsize=7)
        if largest > 0.0:  # what is not valid would hide what is
            ax.set_ylim(-1.2 * largest, 1.2 * largest)
        ax.set_ylabel(label)
        ax.axhline(0.0, color="0.3", linewidth=0.6)
        ax.grid(alpha=0.3)
    if names:
        axes[0].legend(fontsize=7)
    axes[-1].set_xlabel("time, s")
    figure.suptitle(f"{run.scenario}, seed {run.seed}: {run.verdict}", fontsize=10)
    return figure
