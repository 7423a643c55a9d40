"""Questions to many runs, and to a log: what breaks an estimator, where its errors come from, what a log shows."""

from __future__ import annotations

import json
import os
import pathlib
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from . import _monorig
from ._data import place
from ._study import in_threads, scenario_files
from ._types import Controller, Estimators, Log, Path, Scenario, Yaml, by_name, log_file, seed_of

if TYPE_CHECKING:
    import pandas


class Stress(NamedTuple):
    """A stress matrix has figures of estimators under each condition of a battery."""

    cells: list[dict[str, Any]]
    """Figures of each estimator under each condition, worst first."""
    rows: list[dict[str, Any]]
    """The conditions, with a line about each."""
    left_out: list[str]
    """Conditions that a scenario cannot have, with the reason."""
    json: str
    """The file that ``monorig stress --json`` writes; ``--against`` compares with it."""

    def to_pandas(self) -> pandas.DataFrame:
        """Returns a row for each condition and estimator, a column for each figure."""
        import pandas

        return pandas.json_normalize(self.cells).set_index(["condition", "estimator"])


def stress(
    paths: Scenario | Iterable[Scenario] = "scenarios/stress",
    estimators: Estimators | None = None,
    *,
    conditions: Path | Iterable[Path] = "assets/conditions",
    only: Sequence[str] = (),
    set: Mapping[str, object] | None = None,
    jobs: int | None = None,
    progress: bool = True,
) -> Stress:
    """Tries estimators under a battery of conditions, one at a time, as ``monorig stress`` does.

    Args:
        paths: Scenario files, or folders of them.
        estimators: The estimators to try, as for `run`; None takes those of the scenarios.
        conditions: Folders of condition files.
        only: Only conditions with one of these texts in the name, or of a group of this name.
        jobs: Runs at the same time; None is one for each processor.
    """
    changes = None if set is None else dict(set)
    files = [os.fspath(file) for file in scenario_files(paths)]
    given = [conditions] if isinstance(conditions, (str, os.PathLike)) else conditions
    folders = [place(folder) for folder in given]
    series, left_out = _monorig.stress(files, folders, list(only), changes, by_name(estimators))
    text = series.result(in_threads(series.run, range(series.count), jobs, progress, "stress"))
    matrix = json.loads(text)
    return Stress(matrix["cells"], matrix["rows"], left_out, text)


class Budget(NamedTuple):
    """An error budget has the share of each source in the errors of the estimators."""

    sentence: str
    """The greatest sources of one estimator: of the one in the loop, else of the first."""
    estimator: str
    """The estimator that the sentence is about."""
    sources: list[dict[str, Any]]
    """The sources that were switched off."""
    errors: list[dict[str, Any]]
    """Of each estimator and metric the error with all sources, and without each of them."""

    def to_pandas(self) -> pandas.DataFrame:
        """Returns the shares: a row for each estimator and metric, a column for each source; 1 is all of the mean square."""
        import pandas

        names = [source["name"] for source in self.sources]
        rows = {}
        for of in self.errors:
            shares = [None if x is None else 1.0 - (x / of["with_all"]) ** 2 for x in of["without"]]
            rows[of["estimator"], of["metric"]] = dict(zip(names, shares))
        return pandas.DataFrame.from_dict(rows, orient="index").rename_axis(["estimator", "metric"])

    def __str__(self) -> str:
        return self.sentence


def explain(
    path: Scenario,
    seeds: Iterable[int] | None = None,
    *,
    set: Mapping[str, object] | None = None,
    estimators: Estimators | None = None,
    controller: Controller | None = None,
    in_loop: str | None = None,
    jobs: int | None = None,
    progress: bool = True,
) -> Budget:
    """Shows how much of the errors each source of error makes, as ``monorig explain`` does.

    The scenario runs as it is, and without noise, biases, errors of scale, late and lost samples, and errors of the
    model, one at a time.

    Args:
        seeds: The seeds; None takes five from the first of the scenario on.
        jobs: Runs at the same time; None is one for each processor.
    """
    changes = None if set is None else dict(set)
    numbers = None if seeds is None else [seed_of(seed) for seed in seeds]
    file = place(path)
    series = _monorig.explain(file, numbers, changes, by_name(estimators), controller, in_loop)
    lines = in_threads(series.run, range(series.count), jobs, progress, f"explain {pathlib.Path(file).stem}")
    told = json.loads(series.result(lines))
    return Budget(told["sentence"], told["estimator"], told["budget"]["sources"], told["budget"]["errors"])


class Inspection(NamedTuple):
    """An inspection lists the contents of a log."""

    format: str
    tables: list[dict[str, Any]]
    """Of each table its rows, times (ns), gaps and jitter, and of each column unit, least, mean and largest value."""
    map: str
    """A map to begin with, guessed from the names of the columns, and the axes from their values."""


def inspect(
    log: Log, *, time: str | None = None, unit: str | None = None, dbc: Path | None = None
) -> Inspection:
    """Shows what is in a recorded log, and proposes a map file, as ``monorig log info`` does.

    Args:
        log: The log, as for `replay`.
        time: Column of the time, if it is not called like one.
        unit: Unit of this column: s, ms, us, ns or iso8601.
        dbc: Database of the messages of a CAN log.
    """
    database = None if dbc is None else os.fspath(dbc)
    with log_file(log) as place:
        told = json.loads(_monorig.inspect(place or "", time, unit, database))
    return Inspection(told["found"]["format"], told["found"]["tables"], told["map"])


class Calibration(NamedTuple):
    """A calibration has the parameters of vehicle and instruments that a log shows."""

    parameters: list[dict[str, Any]]
    """Name, value, standard deviation, unit and meaning of each."""
    changes: dict[str, str]
    """Keys of the map and the values that they get, as `replay` takes them in ``set``."""
    not_found: list[str]
    """What the log does not show, and why."""


def calibrate(
    map: Path,
    log: Log | None = None,
    *,
    known: Sequence[Literal["mass", "slope"]] = ("slope",),
    set: Mapping[str, object] | None = None,
    apply: bool = False,
) -> Calibration:
    """Finds parameters of vehicle and instruments from a log, as ``monorig log calibrate`` does.

    Args:
        map: The map file; mass and slope are those under its ``reference``.
        log: The log, as for `replay`.
        known: What is known of the drive: ``["slope"]``, or ``["mass", "slope"]``.
        set: Changes to the map, such as ``{"trim.until_s": 60}``.
        apply: Write what was found into the map file, with standard deviations as comments.
    """
    changes = None if set is None else dict(set)
    with log_file(log) as place:
        told = json.loads(_monorig.calibrate(os.fspath(map), place, "mass" in known, changes, apply))
    keys: dict[str, str] = {change["key"]: Yaml(change["value"]) for change in told["changes"]}
    return Calibration(told["parameters"], keys, told["not_found"])
