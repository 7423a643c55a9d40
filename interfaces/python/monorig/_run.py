"""A run: of a scenario, of a recorded log, or step by step."""

from __future__ import annotations

import json
import os
import pathlib
import threading
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _html, _monorig, _plot, _viewer
from ._data import place
from ._monorig import Frame, Perception, Reference, Table, Vehicle
from ._pickle import files_of, folder_of
from ._types import Controller, Estimators, Log, Path, Scenario, by_name, log_file, seed_of

if TYPE_CHECKING:
    import pandas
    import polars
    from matplotlib.figure import Figure


class Expectation(NamedTuple):
    """An expectation is a bound of the scenario, judged."""

    what: str
    """Estimator, metric and window, such as ``dffrls_aekf mass_error_rel_max from 10 s``."""
    bound: str
    """The bound, such as ``≤ 0.03``."""
    value: float | None
    """The measured value; None if it could not be measured."""
    held: bool
    """True if the expectation held."""
    known_failure: str | None
    """Reason of its known failure, if it has one."""


class Fault(NamedTuple):
    """A fault of an instrument stands in the scenario."""

    sensor: str
    what: str
    """The kind of fault, such as ``stuck``."""
    from_s: float
    to_s: float
    """End; infinite if it lasts to the end of the run."""


class Refusal(NamedTuple):
    """A refusal counts the steps that an estimator refused."""

    estimator: str
    steps: int
    reason: str
    """Why the estimator refused the first of them."""


class Run:
    """A run has channels, metrics and a verdict.

    A run is an Arrow table of its channels, too: ``pyarrow.record_batch(run)`` copies nothing. It can be pickled.
    """

    def __init__(self, native: _monorig.NativeRun, folder: object | None = None) -> None:
        self._native = native
        self._folder = folder  # a temporary one is there as long as this
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
        """The metrics of each estimator, by name; None is a metric that could not be measured."""
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
    def verdict(self) -> str:
        """The verdict in the words of the program, such as ``held but for 1 known failure: 4 of 5 checks hold``."""
        return self._native.verdict

    @property
    def failures(self) -> list[str]:
        """Why the run did not pass: checks that failed, integrity among them, and steps that were refused."""
        if self.passed:
            return []
        refused = [f"{r.estimator} refused {r.steps} steps, the first because: {r.reason}" for r in self.refusals]
        return self._native.failures + refused

    @property
    def faults(self) -> list[Fault]:
        """Faults of instruments that the scenario puts into the run."""
        events = json.loads(self._native.resolved_json).get("events") or []
        return [
            Fault(e["sensor"], e["fault"], e["from_s"], float("inf") if e.get("to_s") is None else e["to_s"])
            for e in events
            if "fault" in e and "sensor" in e
        ]

    @property
    def finished(self) -> bool:
        """True if the run came to the end of its scenario."""
        return self._native.finished

    @property
    def events(self) -> list[tuple[float, str]]:
        """Events of the run: time (s) and text."""
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
        """The channels as a data frame of pandas, with time as its index and units in ``attrs["units"]``."""
        import pandas

        frame = pandas.DataFrame({name: self[name] for name in self.channels.names}).set_index("time")
        frame.attrs["units"] = self.channels.units
        return frame

    def to_polars(self) -> polars.DataFrame:
        """The channels as a data frame of polars."""
        import polars

        return polars.DataFrame(self._native.channels)

    def save(self, out: Path = "runs", *, recording: bool = True) -> pathlib.Path:
        """Writes the files of ``monorig run`` to ``out/<scenario>/<seed>/``, and returns this folder.

        Args:
            recording: Write ``run.rrd`` for the Rerun viewer, too, where this module can.
        """
        return pathlib.Path(self._native.save(os.fspath(out), recording))

    def plot(self, estimators: Sequence[str] | None = None) -> Figure:
        """Draws errors of mass and slope with ±2σ and the times of faults; needs ``monorig[plot]``.

        Args:
            estimators: The estimators to draw; None is all.
        """
        return _plot.errors(self, estimators)

    def report(self, path: Path = "report.html") -> pathlib.Path:
        """Writes the report of ``monorig report``, one HTML file, and returns its path."""
        place = pathlib.Path(path)
        place.write_text(self._native.report_html(), encoding="utf-8")
        return place

    def show(self, path: Path | None = None) -> None:
        """Opens the recording in the Rerun viewer (``monorig[viewer]``), or writes it to an ``.rrd`` file."""
        _viewer.show(self, path)

    def __repr__(self) -> str:
        return f"<Run of {self.scenario}, seed {self.seed}: {self.verdict}>"

    def __str__(self) -> str:
        """Verdict, reasons and main metrics as text."""
        return _html.as_text(self)

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpacked, (files_of(lambda folder: self.save(folder, recording=False)),)

    def _repr_html_(self) -> str:
        return _html.of_run(self)


def load(folder: Path) -> Run:
    """Reads a run back from its folder: one of ``monorig run``, ``monorig replay`` or `Run.save`.

    Raises:
        InputError: A file is missing, or is not as the run left it.
    """
    return Run(_monorig.load(os.fspath(folder)))


def _unpacked(files: dict[str, bytes]) -> Run:
    folder = folder_of(files)
    return Run(_monorig.load(folder.name), folder)


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
    controller: Controller | None = None,
    in_loop: str | None = None,
    keep_samples: bool = False,
) -> Run:
    """Runs a scenario.

    Args:
        path: The scenario: a file, the name of one that comes with monorig (`scenarios`), a dict, or YAML text.
        seed: The seed; None is the first of the scenario.
        set: Changes to the scenario, such as ``{"load.mass_kg": 5000}``.
        estimators: Estimators beside those of the scenario, by name: an object with ``step``, a class or a function
            that makes one from the `Vehicle`, the name of an estimator of monorig, or a dict of settings. A list names
            estimators of monorig.
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
    number = None if seed is None else seed_of(seed)
    return Run(
        _monorig.run(
            place(path), number, changes, by_name(estimators), controller, in_loop, keep_samples
        )
    )


def replay(
    map: Path,
    log: Log | None = None,
    *,
    estimators: Estimators | None = None,
    set: Mapping[str, object] | None = None,
) -> Run:
    """Plays a recorded log to estimators, and judges them.

    Args:
        map: The map file, which says what is in the log.
        log: The log, instead of the one that the map names: a path, a data frame of pandas or polars, a dict of arrays,
            or a dict of such tables by the names of their files in the map.
        estimators: The estimators instead of those of the map, as for `run`.
        set: Changes to the map.
    """
    changes = None if set is None else dict(set)
    with log_file(log) as file:
        return Run(_monorig.replay(file, os.fspath(map), by_name(estimators), changes))


class Simulation:
    """A simulation makes a run step by step: command in, state out.

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
        controller: Controller | None = None,
        in_loop: str | None = None,
    ) -> None:
        changes = None if set is None else dict(set)
        number = None if seed is None else seed_of(seed)
        self._thread = threading.get_ident()
        self._own = _monorig.NativeSimulation(
            place(path), number, changes, by_name(estimators), controller, in_loop
        )

    @property
    def _native(self) -> _monorig.NativeSimulation:
        if threading.get_ident() != self._thread:
            raise RuntimeError("a Simulation belongs to the thread that made it\n  help: make one in each thread")
        return self._own

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
        """The nominal vehicle, which estimators are given."""
        return self._native.vehicle

    @property
    def motor_torque_max_nm(self) -> float:
        """Largest torque of a motor, N·m."""
        return self._native.motor_torque_max_nm

    @property
    def reference(self) -> Reference:
        """The task of the controller in the step to come."""
        return self._native.reference

    @property
    def perception(self) -> Perception:
        """The knowledge of the controller for the step to come."""
        return self._native.perception

    def step(self, command: object | None = None) -> Frame:
        """Makes a step under a `Command`, a torque (N·m) or a list of torques; None asks the scenario's controller."""
        return self._native.step(command)

    def __iter__(self) -> Iterator[Frame]:
        while not self.over:
            yield self.step()

    def result(self) -> Run:
        """Returns the run, once it is over; it can be taken once."""
        return Run(self._native.result())
