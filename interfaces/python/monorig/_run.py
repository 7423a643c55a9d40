"""A run: of a scenario, of a recorded log, or step by step."""

from __future__ import annotations

import json
import os
import pathlib
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _html, _monorig, _viewer
from ._data import place
from ._monorig import Frame, Perception, Reference, Table, Vehicle
from ._types import Estimators, Path, Scenario, by_name

if TYPE_CHECKING:
    import pandas
    import polars


class Expectation(NamedTuple):
    """A bound that the scenario sets, judged."""

    what: str
    """Estimator, metric and window, such as ``dffrls_aekf mass_error_rel_max from 10 s``."""
    bound: str
    """The bound, such as ``≤ 0.03``."""
    value: float | None
    """The measured value; None if it could not be measured."""
    held: bool
    """True if it held."""
    known_failure: str | None
    """Why it is known not to hold, if it is."""


class Refusal(NamedTuple):
    """Steps that an estimator refused."""

    estimator: str
    steps: int
    reason: str
    """Why the first of them was."""


class Run:
    """What a run leaves: its channels, its metrics, and whether its scenario's expectations held.

    It is an Arrow table of its channels itself: ``pyarrow.record_batch(run)`` copies nothing.
    """

    def __init__(self, native: _monorig.NativeRun) -> None:
        self._native = native
        self.summary: dict[str, Any] = json.loads(native.summary_json)
        """Everything that stands in ``metrics.json``."""

    @property
    def scenario(self) -> str:
        """Name of the scenario."""
        return str(self.summary["scenario"])

    @property
    def seed(self) -> int:
        """Seed of the run."""
        return int(self.summary["seed"])

    @property
    def channels(self) -> Table:
        """All channels as a table of Arrow: ``time`` (s), then a column of float64 a channel.

        The unit of a column is in its metadata and in `Table.units`. A row without a value is null.
        """
        return self._native.channels

    @property
    def samples(self) -> Table | None:
        """Every sample with its own stamp, as `Estimator.run_samples` takes it; with ``keep_samples`` only."""
        return self._native.samples

    @property
    def metrics(self) -> dict[str, dict[str, float | None]]:
        """The metrics of each estimator, by name; None is one that could not be measured."""
        return dict(self.summary["estimators"])

    @property
    def run_metrics(self) -> dict[str, float | None]:
        """The metrics of train and controller."""
        return dict(self.summary["run"])

    @property
    def expectations(self) -> list[Expectation]:
        """The bounds that the scenario sets, judged."""
        return [_expectation(e) for e in self.summary["expectations"]]

    @property
    def passed(self) -> bool:
        """True if the run came to its end, every bound held or is known not to, and no estimator was misleading."""
        return self._native.good

    @property
    def finished(self) -> bool:
        """True if the run came to the end of its scenario."""
        return self._native.finished

    @property
    def events(self) -> list[tuple[float, str]]:
        """What happened: time (s) and text."""
        return self._native.events

    @property
    def refusals(self) -> list[Refusal]:
        """Steps that estimators refused."""
        return [Refusal(*r) for r in self._native.refusals]

    def __getitem__(self, channel: str) -> npt.NDArray[np.float64]:
        """A channel as an array, shape (rows,); NaN where a row has no value."""
        return self._native.channels[channel]

    def __arrow_c_array__(self, requested_schema: object | None = None) -> tuple[object, object]:
        return self._native.channels.__arrow_c_array__(requested_schema)

    def to_pandas(self) -> pandas.DataFrame:
        """The channels as a data frame of pandas, with time as its index; needs pandas and pyarrow."""
        import pyarrow

        frame: pandas.DataFrame = pyarrow.record_batch(self).to_pandas()
        return frame.set_index("time")

    def to_polars(self) -> polars.DataFrame:
        """The channels as a data frame of polars."""
        import polars

        return polars.DataFrame(self._native.channels)

    def save(self, out: Path = "runs") -> pathlib.Path:
        """Write ``channels.parquet``, ``metrics.json`` and ``manifest.json`` to ``out/<scenario>/<seed>/``."""
        return pathlib.Path(self._native.save(os.fspath(out)))

    def report(self, path: Path = "report.html") -> pathlib.Path:
        """Write the report of ``monorig report``, one HTML file, and return its path."""
        place = pathlib.Path(path)
        place.write_text(self._native.report_html(), encoding="utf-8")
        return place

    def show(self, path: Path | None = None) -> None:
        """Open the channels in the Rerun viewer, or write them to an ``.rrd`` file; needs ``monorig[viewer]``."""
        _viewer.show(self, path)

    def __repr__(self) -> str:
        verdict = "passed" if self.passed else "failed"
        return f"<Run of {self.scenario}, seed {self.seed}: {verdict}>"

    def _repr_html_(self) -> str:
        return _html.of_run(self)


def _expectation(e: Mapping[str, Any]) -> Expectation:
    name = f"{e['estimator']} " if e["estimator"] else ""
    most = [f"≤ {e['at_most']}"] if e["at_most"] is not None else []
    least = [f"≥ {e['at_least']}"] if e["at_least"] is not None else []
    what = f"{name}{e['metric']}{e['window']}"
    return Expectation(what, " and ".join(most + least), e["value"], e["held"], e.get("known_failure"))


def run(
    path: Scenario,
    *,
    seed: int | None = None,
    set: Mapping[str, object] | None = None,
    estimators: Estimators | None = None,
    controller: object | None = None,
    in_loop: str | None = None,
    keep_samples: bool = False,
) -> Run:
    """Run a scenario.

    Args:
        path: The scenario: a file, the name of one that comes with monorig (`scenarios`), a dict, or YAML text.
        seed: The seed; None is the first of the scenario.
        set: Changes to the scenario, such as ``{"load.mass_kg": 5000}``.
        estimators: Estimators beside those of the scenario, by name: an object with ``step``, a class or a function
            that makes one from the `Vehicle`, the name of one of ours, or a dict of settings. A list names ours.
        controller: A controller instead of the scenario's: an object with ``control``, or a class or a function that
            makes one from the `Vehicle` and a `ControllerSetup`.
        in_loop: The estimator whose estimates the controller uses.
        keep_samples: Keep every sample with its stamp, in `Run.samples`.

    Raises:
        InputError: Something is wrong with the scenario or the arguments.
        RunError: The simulation broke down.
        Exception: Whatever an estimator or a controller of yours raises, at the step in which it does.
    """
    changes = None if set is None else dict(set)
    return Run(
        _monorig.run(
            place(path), seed, changes, by_name(estimators), controller, in_loop, keep_samples
        )
    )


def replay(
    map: Path,
    log: Path | None = None,
    *,
    estimators: Estimators | None = None,
    set: Mapping[str, object] | None = None,
) -> Run:
    """Play a recorded log to estimators, and judge them.

    Args:
        map: The map file, which says what is in the log.
        log: The log, instead of the one that the map names.
        estimators: The estimators instead of those of the map, as for `run`.
        set: Changes to the map.
    """
    changes = None if set is None else dict(set)
    place = None if log is None else os.fspath(log)
    return Run(_monorig.replay(place, os.fspath(map), by_name(estimators), changes))


class Simulation:
    """A run that you step: command in, state out.

    >>> sim = monorig.Simulation("scenarios/minimal.yaml")
    >>> while not sim.over:
    ...     frame = sim.step(20.0 * (sim.reference.speed_mps - sim.perception.speed_mps))
    >>> sim.result().metrics

    As an iterator it steps under the controller of the scenario. It belongs to the thread that made it.
    """

    def __init__(
        self,
        path: Scenario,
        *,
        seed: int | None = None,
        set: Mapping[str, object] | None = None,
        estimators: Estimators | None = None,
        controller: object | None = None,
        in_loop: str | None = None,
    ) -> None:
        changes = None if set is None else dict(set)
        self._native = _monorig.NativeSimulation(
            place(path), seed, changes, by_name(estimators), controller, in_loop
        )

    @property
    def over(self) -> bool:
        """True once the run is over."""
        return self._native.over

    @property
    def time_s(self) -> float:
        """Simulated time, s."""
        return self._native.time_s

    @property
    def dt_s(self) -> float:
        """Length of a step, s."""
        return self._native.dt_s

    @property
    def vehicle(self) -> Vehicle:
        """The nominal vehicle, as estimators are given it."""
        return self._native.vehicle

    @property
    def reference(self) -> Reference:
        """What the controller is to do in the step to come."""
        return self._native.reference

    @property
    def perception(self) -> Perception:
        """What the controller knows for the step to come."""
        return self._native.perception

    def step(self, command: object | None = None) -> Frame:
        """Make a step under a `Command`, a torque (N·m) or a list of torques; None asks the scenario's controller."""
        return self._native.step(command)

    def __iter__(self) -> Iterator[Frame]:
        while not self.over:
            yield self.step()

    def result(self) -> Run:
        """What the run leaves, once it is over; it can be taken once."""
        return Run(self._native.result())
