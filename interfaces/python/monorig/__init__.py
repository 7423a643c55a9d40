"""Estimators of mass and slope for monorail cranes, and the rig that tests them.

>>> import monorig
>>> run = monorig.run("liu2023_section1", estimators=["rail_fusion"])
>>> run.passed, run.metrics["rail_fusion"]["slope_rmse_deg"]

The chapter "From Python" of the book explains it: estimators over arrays, your own estimator in the loop, runs as
Arrow tables, studies over many seeds, tuning.
"""

from ._data import scenarios
from ._errors import InputError, RunError
from ._monorig import (
    Command,
    ControllerSetup,
    Estimate,
    Estimator,
    Frame,
    Measurements,
    Perception,
    Reference,
    Table,
    Vehicle,
    __version__,
    names,
    parameters,
)
from ._run import Expectation, Refusal, Run, Simulation, replay, run
from ._study import Comparison, ScenarioVerdict, Study, compare, metrics, study, test
from ._tune import Objective, Score, Tuning, tune

__all__ = [
    "Command",
    "Comparison",
    "ControllerSetup",
    "Estimate",
    "Estimator",
    "Expectation",
    "Frame",
    "InputError",
    "Measurements",
    "Objective",
    "Perception",
    "Reference",
    "Refusal",
    "Run",
    "RunError",
    "ScenarioVerdict",
    "Score",
    "Simulation",
    "Study",
    "Table",
    "Tuning",
    "Vehicle",
    "__version__",
    "compare",
    "metrics",
    "names",
    "parameters",
    "replay",
    "run",
    "scenarios",
    "study",
    "test",
    "tune",
]
