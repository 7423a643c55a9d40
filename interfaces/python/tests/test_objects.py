"""Objects travel: a copy, and what another process gets, is the same object; a simulation stays in its thread."""

from __future__ import annotations

import copy
import multiprocessing
import pathlib
import pickle
import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

import monorig

WAYS: list[Callable[[Any], Any]] = [copy.copy, copy.deepcopy, lambda it: pickle.loads(pickle.dumps(it))]


@pytest.fixture(scope="module")
def minimal(scenarios: pathlib.Path) -> pathlib.Path:
    return scenarios / "minimal.yaml"


@pytest.fixture(scope="module")
def run(minimal: pathlib.Path) -> monorig.Run:
    return monorig.run(minimal, set={"stop.after_s": 8.0}, keep_samples=True)


@pytest.mark.parametrize("way", WAYS)
def test_values_are_the_same_values(way: Callable[[Any], Any], minimal: pathlib.Path) -> None:
    command = monorig.Command([1.0, -2.5], brake=0.5)
    estimate = monorig.Estimate(grade=(0.1, 0.01, True), nis=0.7, flags=(True, False, True), t_ns=5)
    vehicle = monorig.Vehicle.from_scenario(minimal)
    for it in (command, estimate, vehicle):
        assert way(it) == it
    other = monorig.Vehicle(tare_kg=1e4 / 3, wheel_radius_m=0.17, mass_range_kg=(1e4 / 3, 4e4))
    assert way(other) == other != vehicle


@pytest.mark.parametrize("way", WAYS)
def test_an_estimator_goes_on_where_it_was(way: Callable[[Any], Any], run: monorig.Run, minimal: pathlib.Path) -> None:
    vehicle = monorig.Vehicle.from_scenario(minimal)
    gain = next(p for p in monorig.parameters("dffrls_aekf_robust") if "range" in p and p["default"])
    here = monorig.Estimator("dffrls_aekf_robust", vehicle, **{gain["name"]: gain["default"]})
    assert run.samples is not None
    here.run_samples(run.samples)
    there = way(here)
    assert there.internal_values() == here.internal_values() and there.parameters == here.parameters
    z = monorig.Measurements(9_000_000_000, specific_force=(0.1, 0.0, 9.8), wheel_speed=[0.5] * vehicle.drives)
    assert there.step(z, 1.0) == here.step(z, 1.0)


def same(a: monorig.Table, b: monorig.Table) -> bool:
    """The same values, gaps and units to the last bit."""
    here, there = pa.record_batch(a), pa.record_batch(b)
    return here.equals(there) and [f.metadata for f in here.schema] == [f.metadata for f in there.schema]


@pytest.mark.parametrize("way", WAYS)
def test_a_run_and_its_tables_are_the_same(
    way: Callable[[Any], Any], run: monorig.Run, tmp_path: pathlib.Path
) -> None:
    there = way(run)
    assert there.summary == run.summary and there.events == run.events and there.verdict == run.verdict
    assert same(there.channels, run.channels) and same(way(run.channels), run.channels)
    assert run.samples is not None and there.samples is not None and same(there.samples, run.samples)
    here, again = run.save(tmp_path / "a", recording=False), there.save(tmp_path / "b", recording=False)
    for file in here.iterdir():
        assert file.read_bytes() == (again / file.name).read_bytes(), file.name


def test_runs_come_back_from_processes(minimal: pathlib.Path) -> None:
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as processes:
        there = processes.submit(monorig.run, minimal, seed=2, set={"stop.after_s": 6.0}).result()
    here = monorig.run(minimal, seed=2, set={"stop.after_s": 6.0})
    assert there.summary == here.summary and same(there.channels, here.channels)


def test_a_simulation_in_another_thread_is_an_exception(minimal: pathlib.Path) -> None:
    simulation = monorig.Simulation(minimal)
    caught: list[Exception] = []

    def steps() -> None:
        try:
            simulation.step()
        except Exception as e:
            caught.append(e)

    thread = threading.Thread(target=steps)
    thread.start()
    thread.join()
    assert isinstance(caught[0], RuntimeError) and "thread" in str(caught[0])
    assert np.isfinite(simulation.step().time_s)
