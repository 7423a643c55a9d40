"""Over arrays, step by step and in the loop an estimator gives the same bits."""

from __future__ import annotations

import math
import pathlib
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pytest

import monorig

QUANTITIES = ("total_mass", "grade", "effective_grade", "speed")
Floats = npt.NDArray[np.float64]


@pytest.fixture(scope="module")
def vehicle(scenarios: pathlib.Path) -> monorig.Vehicle:
    return monorig.Vehicle.from_scenario(scenarios / "liu2023_section1.yaml")


def drive(vehicle: monorig.Vehicle, n: int) -> tuple[npt.NDArray[np.int64], dict[str, Any]]:
    """A drive to and fro on a level track, with gaps in the samples."""
    k, rng = np.arange(1, n + 1), np.random.default_rng(1)
    accel = 0.3 * np.sin(0.002 * k)
    force = np.c_[accel + 0.02 * rng.standard_normal(n), np.zeros(n), np.full(n, 9.81)]
    speed = np.repeat((1.0 + np.cumsum(accel * 0.005))[:, None], vehicle.drives, axis=1)
    torque = np.repeat((40 + 30 * np.sin(0.002 * k))[:, None], vehicle.drives, axis=1)
    force[::7] = np.nan
    speed[::3, 0] = np.nan
    return k.astype(np.int64) * 5_000_000, {
        "specific_force": force,
        "angular_rate": np.zeros((n, 3)),
        "motor_torque": torque,
        "wheel_speed": speed,
    }


def per_row(inputs: dict[str, Floats], row: int) -> dict[str, Any]:
    """The samples of a row as `Measurements` takes them."""
    z: dict[str, Any] = {}
    for name, values in inputs.items():
        if name in ("specific_force", "angular_rate"):
            z[name] = None if np.isnan(values[row]).any() else tuple(values[row])
        else:
            z[name] = [None if math.isnan(x) else float(x) for x in values[row]]
    return z


@pytest.mark.parametrize("name", monorig.names())
def test_arrays_are_steps(name: str, vehicle: monorig.Vehicle) -> None:
    t_ns, inputs = drive(vehicle, 1500)
    estimator = monorig.Estimator(name, vehicle)
    batch = pa.record_batch(estimator.run(t_ns, **inputs))
    estimator.reset()
    for row in range(len(t_ns)):
        z = monorig.Measurements(int(t_ns[row]), **per_row(inputs, row))
        estimate = estimator.step(z, 0.005)
        for quantity in QUANTITIES:
            value, sd, valid = getattr(estimate, quantity)
            there = [batch.column(quantity + end)[row].as_py() for end in ("", "_sd", "_valid")]
            assert [value, sd, valid] == there, (row, quantity)
        levels = [batch.column(f"{quantity}_protection")[row].as_py() for quantity in QUANTITIES[:3]]
        assert list(estimate.protection) == levels, row


@pytest.mark.parametrize("name", ["liu2023_section1", "minimal", "load_sway"])
def test_kept_samples_give_what_the_run_gave(name: str, scenarios: pathlib.Path) -> None:
    ours = ["rail_fusion", "dffrls_aekf", "attitude"]
    scenario = scenarios / f"{name}.yaml"
    changes: dict[str, object] = {f"estimators.{n}": {} for n in ours}
    simulation = monorig.Simulation(scenario, set=changes)
    vehicle = simulation.vehicle
    in_loop: dict[str, list[tuple[float, float, float, float]]] = {n: [] for n in ours}
    for frame in simulation:
        if frame.sampled:
            for n in ours:
                e = frame.estimates[n]
                in_loop[n].append((e.grade[0], e.grade[1], e.total_mass[0], e.speed[0]))
    run = monorig.run(scenario, set=changes, keep_samples=True)
    assert run.samples is not None
    for n in ours:
        batch = pa.record_batch(monorig.Estimator(n, vehicle).run_samples(run.samples))
        names = ("grade", "grade_sd", "total_mass", "speed")
        arrays = np.array([batch.column(c).to_numpy() for c in names]).T
        assert arrays.tobytes() == np.array(in_loop[n]).tobytes(), n


def test_a_snapshot_goes_on_where_it_was_taken(vehicle: monorig.Vehicle) -> None:
    t_ns, inputs = drive(vehicle, 2000)
    first = {k: v[:1000].copy() for k, v in inputs.items()}
    rest = {k: v[1000:].copy() for k, v in inputs.items()}
    a, b = (monorig.Estimator("rail_fusion", vehicle) for _ in range(2))
    a.run(t_ns[:1000], **first)
    b.restore(a.snapshot())
    on_a = pa.record_batch(a.run(t_ns[1000:], dt_s=0.005, **rest))
    on_b = pa.record_batch(b.run(t_ns[1000:], dt_s=0.005, **rest))
    assert on_a.equals(on_b) and a.internal_values() == b.internal_values()
    with pytest.raises(monorig.InputError, match="snapshot"):
        monorig.Estimator("dffrls_aekf", vehicle).restore(a.snapshot())


def test_a_refused_row_is_null_and_told(vehicle: monorig.Vehicle) -> None:
    t_ns, inputs = drive(vehicle, 100)
    t_ns[50] = t_ns[10]
    with pytest.warns(UserWarning, match="steps were refused, the first in row 50"):
        batch = pa.record_batch(monorig.Estimator("dffrls_aekf", vehicle).run(t_ns, **inputs))
    assert not batch.column("grade")[50].is_valid and batch.column("grade")[49].is_valid
    assert batch.column("grade_valid")[50].as_py() is False


def test_names_and_parameters() -> None:
    assert "rail_fusion" in monorig.names() and "dffrls_aekf_printed" in monorig.names()
    for parameter in monorig.parameters("dffrls_aekf_robust"):
        assert parameter["doc"].endswith(".")
        if "range" in parameter and parameter["default"] is not None:
            low, high = parameter["range"]
            assert low <= parameter["default"] <= high
