"""The search for parameters: ours, or one of your own over the same objective."""

from __future__ import annotations

import json
import math
import os
import pathlib
from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple, Protocol

from . import _monorig
from ._progress import Bar
from ._study import processors
from ._types import Path

Value = float | bool | str


class Tuning(NamedTuple):
    """A tuning is the result of a search for parameters."""

    folder: pathlib.Path
    """The folder of the results, with a report."""
    best: dict[str, Value] | None
    """The parameters of the winner; None if no trial was good."""
    loss: float | None
    """Its loss over the tuning runs; the defaults have 1."""
    validation: dict[str, Any] | None
    """The winner on runs that the search never saw, against the defaults and the published constants."""
    trials: list[dict[str, Any]]


def tune(
    file: Path,
    *,
    out: Path = "runs",
    jobs: int | None = None,
    begin: Literal["new", "resume", "restart"] = "new",
    progress: bool = True,
) -> Tuning:
    """Searches for the best parameters of one of our estimators, as ``monorig tune`` does.

    Args:
        file: The study file.
        out: The results go to ``out/tune/<study>/``.
        jobs: Runs at the same time; None is one for each processor.
        begin: What to do with trials that are there: refuse (``new``), go on, or drop them.
    """
    folder = pathlib.Path(out) / "tune"
    with Bar(pathlib.Path(file).stem, 1, progress) as bar:
        found = json.loads(
            _monorig.tune(
                os.fspath(file),
                os.fspath(folder),
                os.fspath(folder / ".cache"),
                jobs or processors(),
                begin,
                lambda what, share: bar.at(share, what),
            )
        )
    best = found["best"] or {"parameters": None, "loss": None}
    place = pathlib.Path(found["folder"])
    return Tuning(place, best["parameters"], best["loss"], found["validation"], found["trials"])


class Score(NamedTuple):
    """A score judges parameters."""

    losses: list[float]
    """One loss, or one a metric for a front; the defaults have 1. Empty if a run failed."""
    violation: float
    """How far constraints are broken, in shares of their bounds; 0 if all hold."""
    failed: str | None
    """Reason why there is no loss."""

    @property
    def loss(self) -> float:
        """The mean loss; infinite if a run failed or a constraint is broken."""
        good = self.losses and self.violation == 0.0
        return sum(self.losses) / len(self.losses) if good else math.inf


class _Trial(Protocol):
    """The part of a trial of Optuna that is used."""

    def suggest_float(self, name: str, low: float, high: float, *, log: bool = ...) -> float: ...
    def suggest_int(self, name: str, low: int, high: int) -> int: ...
    def suggest_categorical(self, name: str, choices: Sequence[Any]) -> Any: ...


class _Study(Protocol):
    """The part of a study of Optuna that is used."""

    @property
    def best_params(self) -> dict[str, Any]: ...


class _Fixed(NamedTuple):
    """A trial with the values that a study of Optuna has found."""

    params: Mapping[str, Any]

    def suggest_float(self, name: str, low: float, high: float, *, log: bool = False) -> float:
        return float(self.params[name])

    def suggest_int(self, name: str, low: int, high: int) -> int:
        return int(self.params[name])

    def suggest_categorical(self, name: str, choices: Sequence[Any]) -> Any:
        return self.params[name]


class Objective:
    """An objective is a study file as a function of its parameters.

    >>> objective = monorig.Objective("scenarios/tuning/quick.yaml")
    >>> objective({"delta": 0.9})

    Its runs are recorded when it is made, and replayed for every call. A call gives one number, the smaller the
    better, and 1 for the defaults.
    """

    def __init__(self, file: Path, *, cache: Path | None = None, jobs: int | None = None, progress: bool = True) -> None:
        recordings = pathlib.Path("runs/tune/.cache") if cache is None else pathlib.Path(cache)
        with Bar(pathlib.Path(file).stem, 1, progress) as bar:
            self._native = _monorig.NativeObjective(
                os.fspath(file),
                os.fspath(recordings),
                jobs or processors(),
                lambda what, share: bar.at(share, what),
            )
        self.space: dict[str, dict[str, Any]] = json.loads(self._native.space_json)
        """The ranges of the parameters, as they stand in the file."""
        self.defaults: dict[str, Value] = json.loads(self._native.defaults_json)
        """The defaults of the parameters."""

    def score(self, parameters: Mapping[str, Value]) -> Score:
        """Returns losses and broken constraints of these parameters; the others have their defaults."""
        trial = json.loads(self._native.score(json.dumps(dict(parameters))))
        return Score(trial["losses"], trial["violation"], trial.get("failed"))

    def __call__(self, parameters: Mapping[str, Value]) -> float:
        """Returns the loss of these parameters: `Score.loss`."""
        return self.score(parameters).loss

    def suggest(self, trial: _Trial) -> dict[str, Value]:
        """Takes parameters out of the ranges of the file, as a trial of Optuna proposes them."""
        return {name: _suggested(trial, name, of) for name, of in self.space.items()}

    def best(self, study: _Study) -> dict[str, Value]:
        """Returns the parameters of the best trial of a study of Optuna, under the names that the estimator has."""
        return self.suggest(_Fixed(study.best_params))


def _suggested(trial: _Trial, name: str, of: Mapping[str, Any]) -> Value:
    if of["choices"] is not None:
        choice: Value = trial.suggest_categorical(name, of["choices"])
        return choice
    low, high = of["from"], of["to"]
    if of["integer"]:
        return trial.suggest_int(name, int(low), int(high))
    if of["scale"] == "memory":
        # evenly in the logarithm of the memory of a forgetting factor
        memory = trial.suggest_float(f"memory of {name}", 1.0 / (1.0 - low), 1.0 / (1.0 - high), log=True)
        return 1.0 - 1.0 / memory
    return trial.suggest_float(name, low, high, log=of["scale"] == "log")
