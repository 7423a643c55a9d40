"""What a user may hand over, and how it becomes what the native module takes."""

from __future__ import annotations

import contextlib
import json
import operator
import os
import pathlib
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from ._errors import InputError
from ._monorig import Command, ControllerSetup, Estimate, Measurements, Perception, Reference, Vehicle

Path: TypeAlias = "str | os.PathLike[str]"
# a file, a name, a dict, or YAML text
Scenario: TypeAlias = "str | os.PathLike[str] | Mapping[str, object]"


class EstimatorLike(Protocol):
    """An estimator of your own is an object with ``step``; ``reset``, ``internals`` and ``internal_values`` may be there."""

    def step(self, z: Measurements, dt: float, /) -> Estimate | tuple[float, float] | None:
        """Makes a step of ``dt`` seconds with the samples that arrived. None refuses the step."""


class ControllerLike(Protocol):
    """A controller of your own is an object with ``control``."""

    def control(
        self, reference: Reference, perception: Perception, dt: float, /
    ) -> Command | float | Sequence[float]:
        """Returns the command of a step: a `Command`, one torque (N·m) for all drive units, or one for each."""


class _MakesEstimator(Protocol):
    def __call__(self, vehicle: Vehicle, /) -> EstimatorLike: ...


class _MakesController(Protocol):
    def __call__(self, vehicle: Vehicle, setup: ControllerSetup, /) -> ControllerLike: ...


# None: ours of that name; a text: the name of a type; a dict: settings as in a scenario; else one's own
_Estimator: TypeAlias = "EstimatorLike | _MakesEstimator | Mapping[str, object] | str | None"
Estimators: TypeAlias = "Mapping[str, _Estimator] | Sequence[str] | str"
Controller: TypeAlias = "ControllerLike | _MakesController"
# a file, a folder, a data frame, arrays by name, or several of these by file name
Log: TypeAlias = "Path | Any"


def by_name(estimators: Estimators | None) -> dict[str, object] | None:
    """The estimators as a dict; those of a list, or of one name, are ours."""
    if estimators is None:
        return None
    if isinstance(estimators, str):
        return {estimators: None}
    if isinstance(estimators, Mapping):
        return dict(estimators)
    return dict.fromkeys(estimators)


def is_own(estimator: object) -> bool:
    """True for an estimator in Python, which is not named but handed over."""
    return estimator is not None and not isinstance(estimator, (str, Mapping))


def seed_of(seed: object) -> int:
    """The seed as a whole number, if it can be one."""
    try:
        number = operator.index(seed)  # type: ignore[arg-type]
    except TypeError:
        number = -1
    if not 0 <= number < 2**64:
        raise InputError(f"{seed!r} is no seed", "a whole number from 0 to 2**64 - 1")
    return number


class Yaml(str):
    """A value as it stands in a file."""


def json_text(value: object) -> str:
    """A value as it would stand in a scenario."""
    if isinstance(value, Yaml):
        return str(value)

    def plain(value: object) -> object:
        if isinstance(value, (np.generic, np.ndarray)):
            return value.tolist()
        if isinstance(value, os.PathLike):
            return os.fspath(value)
        raise TypeError(type(value).__name__)

    try:
        return json.dumps(value, default=plain)
    except (TypeError, ValueError) as e:
        of = type(value).__name__
        help = "a number, True or False, a text, None, or a list or dict of these"
        raise InputError(f"{of} cannot stand in a scenario: {e}", help) from e


def numbers(name: str, values: object, kind: np.dtype[Any]) -> npt.NDArray[Any]:
    """Values as an array in one piece; None becomes NaN."""
    try:
        array = np.asarray(values)
        if kind == np.int64 and array.ndim != 1:
            raise ValueError(f"it has {array.ndim} axes, not one")
        if array.dtype == object:
            array = array.astype(float)
        if array.size == 0:
            array = array.astype(kind)
        return np.ascontiguousarray(array.astype(kind, casting="same_kind", copy=False))
    except (TypeError, ValueError) as e:
        help = "a row of whole numbers, nanoseconds" if kind == np.int64 else "numbers, NaN or None where there is no new sample"
        raise InputError(f"{name} cannot be an array of {kind}: {e}", help) from e


@contextlib.contextmanager
def log_file(log: Log | None) -> Iterator[str | None]:
    """The path of a log. A data frame, or arrays by name, become a file; several of them by file name a folder."""
    if log is None or isinstance(log, (str, os.PathLike)):
        yield None if log is None else os.fspath(log)
        return
    with tempfile.TemporaryDirectory(prefix="monorig-") as temporary:
        folder = pathlib.Path(temporary)
        if isinstance(log, Mapping) and any(_is_table(table) for table in log.values()):
            for name, table in log.items():
                if pathlib.Path(name).name != name or not name.endswith(".csv"):
                    raise InputError(f"`{name}` is no name for a table of a log", "the file's name in the map, such as imu.csv")
                _write(table, folder / name)
            yield temporary
        else:
            _write(log, folder / "log.csv")
            yield str(folder / "log.csv")


def _is_table(log: object) -> bool:
    return isinstance(log, Mapping) or hasattr(log, "to_csv") or hasattr(log, "write_csv")


def _write(table: Any, path: pathlib.Path) -> None:
    """Writes a table as CSV; every number is read back to the last bit."""
    if hasattr(table, "to_csv"):  # of pandas; an index that has a name is a column
        table.to_csv(path, index=table.index.name is not None)
    elif hasattr(table, "write_csv"):  # of polars
        table.write_csv(path)
    elif isinstance(table, Mapping) and table:
        columns = [np.asarray(values).tolist() for values in table.values()]
        rows = [",".join("" if x != x else repr(x) for x in row) for row in zip(*columns, strict=True)]
        path.write_text("\n".join([",".join(table), *rows]) + "\n", encoding="utf-8")
    else:
        raise InputError(f"{type(table).__name__} is no log", "a path, a data frame, or a dict of arrays")
