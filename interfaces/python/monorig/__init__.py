"""Estimators of mass and slope for monorail cranes, and the rig that tests them.

>>> import monorig
>>> run = monorig.run("liu2023_section1", estimators=["rail_fusion"])
>>> print(run.verdict, run.metrics["rail_fusion"]["slope_rmse_deg"])

The chapter "In Python" of the book explains it: estimators over arrays, your own estimator in the loop, runs as
Arrow tables, studies over many seeds, tuning.
"""

from . import _pickle as _pickle
from ._ask import Budget, Calibration, Inspection, Stress, calibrate, explain, inspect, stress
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
from ._program import check
from ._run import Expectation, Fault, Refusal, Run, Simulation, load, replay, run
from ._study import Comparison, ScenarioVerdict, Study, compare, metrics, study, test
from ._tune import Objective, Score, Tuning, tune
from ._types import ControllerLike, EstimatorLike

__all__ = [
    "Budget",
    "Calibration",
    "Command",
    "Comparison",
    "ControllerLike",
    "ControllerSetup",
    "Estimate",
    "Estimator",
    "EstimatorLike",
    "Expectation",
    "Fault",
    "Frame",
    "InputError",
    "Inspection",
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
    "Stress",
    "Study",
    "Table",
    "Tuning",
    "Vehicle",
    "__version__",
    "calibrate",
    "check",
    "compare",
    "explain",
    "inspect",
    "load",
    "metrics",
    "names",
    "parameters",
    "replay",
    "run",
    "scenarios",
    "stress",
    "study",
    "test",
    "tune",
]
