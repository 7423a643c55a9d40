"""Native objects go to other processes: each is made again from what it was made from."""

from __future__ import annotations

import copyreg
import pathlib
import tempfile
from collections.abc import Callable
from typing import Any

from ._monorig import Command, Estimate, Estimator, Table, Vehicle


def files_of(write: Callable[[pathlib.Path], object]) -> dict[str, bytes]:
    """The content of the files that something writes into a folder, by their names."""
    with tempfile.TemporaryDirectory(prefix="monorig-") as folder:
        write(pathlib.Path(folder))
        all = pathlib.Path(folder).rglob("*")
        return {path.name: path.read_bytes() for path in all if path.is_file()}


def folder_of(files: dict[str, bytes]) -> tempfile.TemporaryDirectory[str]:
    """A folder with these files, which is there as long as the object is."""
    folder = tempfile.TemporaryDirectory(prefix="monorig-")
    for name, content in files.items():
        (pathlib.Path(folder.name) / name).write_bytes(content)
    return folder


def _again(kind: Callable[..., Any], fields: dict[str, object]) -> object:
    return kind(**fields)


def _by(*names: str) -> Callable[[Any], tuple[Any, ...]]:
    """Reduces an object to the arguments that make it."""
    return lambda object: (_again, (type(object), {name: getattr(object, name) for name in names}))


def _estimator(name: str, vehicle: Vehicle, parameters: dict[str, Any], state: bytes) -> Estimator:
    estimator = Estimator(name, vehicle, **parameters)
    estimator.restore(state)
    return estimator


def _table(files: dict[str, bytes]) -> Table:
    with folder_of(files) as folder:
        return Table.from_parquet(pathlib.Path(folder) / "table")


copyreg.pickle(Command, _by("motor_torque", "clamp_pressure", "brake"))
copyreg.pickle(
    Estimate,
    _by("t_ns", "total_mass", "grade", "effective_grade", "speed", "innovation", "nis", "flags", "protection"),
)
copyreg.pickle(Vehicle, lambda v: (Vehicle.from_json, (v.to_json(),)))
copyreg.pickle(Estimator, lambda e: (_estimator, (e.name, e.vehicle, e.parameters, e.snapshot())))
copyreg.pickle(Table, lambda t: (_table, (files_of(lambda folder: t.to_parquet(folder / "table")),)))
