"""A mistake has a message with its place and its cure."""

from __future__ import annotations

import pathlib
import pickle
from typing import Any

import numpy as np
import pytest

import monorig


class NoStep:
    def __init__(self, vehicle: monorig.Vehicle) -> None:
        pass


class WrongReturn:
    def __init__(self, vehicle: monorig.Vehicle | None = None) -> None:
        pass

    def step(self, z: object, dt: float) -> str:
        return "7"


@pytest.fixture(scope="module")
def minimal(scenarios: pathlib.Path) -> pathlib.Path:
    return scenarios / "minimal.yaml"


@pytest.fixture(scope="module")
def ours(minimal: pathlib.Path) -> monorig.Estimator:
    return monorig.Estimator("dffrls_aekf", monorig.Vehicle.from_scenario(minimal))


T = np.arange(1, 11, dtype=np.int64) * 5_000_000


def test_a_key_that_is_not_there(minimal: pathlib.Path) -> None:
    with pytest.raises(monorig.InputError, match="mas_kg") as e:
        monorig.run(minimal, set={"load.mas_kg": 1})
    assert e.value.file == str(minimal) and "mass_kg" in str(e.value) and "the call" in str(e.value)


def test_a_value_out_of_its_range(tmp_path: pathlib.Path, minimal: pathlib.Path) -> None:
    text = minimal.read_text().replace("../", f"{minimal.parents[1]}/")
    assert "mass_kg: 10000" in text
    bad = tmp_path / "bad.yaml"
    bad.write_text(text.replace("mass_kg: 10000", "mass_kg: -5"))
    with pytest.raises(monorig.InputError) as e:
        monorig.run(bad)
    line = next(i for i, t in enumerate(bad.read_text().splitlines(), 1) if "mass_kg: -5" in t)
    assert (e.value.file, e.value.line, e.value.key) == (str(bad), line, "load.mass_kg") and e.value.help


def test_a_file_that_is_not_there(minimal: pathlib.Path) -> None:
    with pytest.raises((monorig.InputError, FileNotFoundError), match="nothing.yaml"):
        monorig.run(minimal.with_name("nothing.yaml"))


def test_an_estimator_without_a_step(minimal: pathlib.Path) -> None:
    with pytest.raises(monorig.InputError, match="NoStep has no method `step`") as e:
        monorig.run(minimal, estimators={"mine": NoStep})  # type: ignore[dict-item]
    assert "class" in e.value.help


def test_a_step_that_returns_something_else(minimal: pathlib.Path) -> None:
    with pytest.raises(TypeError, match="step of WrongReturn returned str; a step returns an Estimate"):
        monorig.run(minimal, estimators={"mine": WrongReturn})  # type: ignore[dict-item]


def test_names_that_are_none_or_unknown(minimal: pathlib.Path, ours: monorig.Estimator) -> None:
    with pytest.raises(monorig.InputError, match="`a/b` is not a name"):
        monorig.run(minimal, estimators={"a/b": WrongReturn})  # type: ignore[dict-item]
    with pytest.raises(monorig.InputError, match="did you mean `dffrls_aekf`"):
        monorig.Estimator("dffrls_aekff", monorig.Vehicle.from_scenario(minimal))
    with pytest.raises(monorig.InputError, match="an estimator called `rail_fusion` exists already"):
        monorig.run(minimal, estimators={"rail_fusion": WrongReturn})  # type: ignore[dict-item]
    for nobody in (["nobody"], "nobody"):
        with pytest.raises(monorig.InputError, match="there is no estimator `nobody`"):
            monorig.run(minimal, estimators=nobody)
    with pytest.raises(monorig.InputError, match="the table has no channel `truth/sped`.*\n.*truth/speed"):
        monorig.run(minimal)["truth/sped"]


def test_parameters(minimal: pathlib.Path) -> None:
    vehicle = monorig.Vehicle.from_scenario(minimal)
    with pytest.raises(monorig.InputError, match="dffrls_aekf has no parameter `lamda0`"):
        monorig.Estimator("dffrls_aekf", vehicle, lamda0=1.0)
    number = next(p for p in monorig.parameters("dffrls_aekf") if "range" in p)
    with pytest.raises(monorig.InputError, match="is not a number in"):
        monorig.Estimator("dffrls_aekf", vehicle, **{number["name"]: number["range"][1] + 1e9})


def test_a_vehicle_that_cannot_be() -> None:
    with pytest.raises(monorig.InputError, match="tare_kg of the vehicle"):
        monorig.Vehicle(tare_kg=-1.0, wheel_radius_m=0.1, mass_range_kg=(1.0, 2.0))
    with pytest.raises(monorig.InputError, match="begins at 40000 and ends at 9000\n.*smallest"):
        monorig.Vehicle(tare_kg=9e3, wheel_radius_m=0.1, mass_range_kg=(40e3, 9e3))


@pytest.mark.parametrize("seed", [-1, 2**64, 1.5, "7"])
def test_a_seed_that_cannot_be(seed: Any, minimal: pathlib.Path) -> None:
    for make in (monorig.run, monorig.Simulation):
        with pytest.raises(monorig.InputError, match="is no seed"):
            make(minimal, seed=seed)
    with pytest.raises(monorig.InputError, match="is no seed"):
        monorig.study(minimal, [seed])


def test_numbers_of_numpy_are_numbers(minimal: pathlib.Path) -> None:
    shorter: dict[str, object] = {"stop.after_s": np.float32(6.0), "load.mass_kg": np.int64(2000)}
    of_numpy = monorig.run(minimal, seed=np.int64(2), set=shorter)  # type: ignore[arg-type]
    plain = monorig.run(minimal, seed=2, set={"stop.after_s": 6.0, "load.mass_kg": 2000})
    assert of_numpy.summary == plain.summary
    with pytest.raises(monorig.InputError, match="cannot stand in a scenario"):
        monorig.run(minimal, set={"load.mass_kg": object()})


def test_arrays_of_another_shape_order_or_kind(ours: monorig.Estimator, minimal: pathlib.Path) -> None:
    with pytest.raises(monorig.InputError, match=r"wheel_speed has the shape \[5\]") as e:
        ours.run(T, wheel_speed=np.zeros(5))
    assert "NaN without a new sample" in e.value.help
    for bad in (["a"] * 10, [[1.0], [1.0, 2.0]], 1j * np.ones(10)):
        with pytest.raises(monorig.InputError, match="inclination cannot be an array of float64"):
            ours.run(T, inclination=bad)
    with pytest.raises(monorig.InputError, match="t_ns cannot be an array of int64") as e:
        ours.run(T.astype(float))
    with pytest.raises(monorig.InputError, match="2 axes"):
        ours.run(T.reshape(5, 2))
    assert "whole numbers" in e.value.help
    with pytest.raises(monorig.InputError, match="no measurement is called `speed`"):
        ours.run(T, speed=np.zeros(10))  # type: ignore[call-arg]
    with pytest.raises(monorig.InputError, match="the samples have no column `arrival_ns`"):
        ours.run_samples(monorig.run(minimal, set={"stop.after_s": 1.0}))


def test_a_command_that_is_none(minimal: pathlib.Path) -> None:
    simulation = monorig.Simulation(minimal)
    for bad in ("fast", [1.0] * 15, float("nan")):
        with pytest.raises(monorig.InputError):
            simulation.step(bad)
    with pytest.raises(monorig.InputError, match="the run is not over"):
        simulation.result()


def test_one_object_for_many_runs(minimal: pathlib.Path) -> None:
    with pytest.raises(monorig.InputError, match="one object for many runs"):
        monorig.study(minimal, [1, 2], estimators={"mine": WrongReturn()})  # type: ignore[dict-item]


def test_a_folder_that_is_no_run(tmp_path: pathlib.Path, minimal: pathlib.Path) -> None:
    with pytest.raises((monorig.InputError, FileNotFoundError), match="manifest.json"):
        monorig.load(tmp_path)
    folder = monorig.run(minimal, set={"stop.after_s": 3.0}).save(tmp_path, recording=False)
    channels = folder / "channels.parquet"
    channels.write_bytes(channels.read_bytes()[:-100])
    with pytest.raises(monorig.InputError, match="was changed after the run"):
        monorig.load(folder)
    (tmp_path / "none.parquet").write_bytes(b"PAR1 but no more")
    with pytest.raises(monorig.InputError, match="none.parquet"):
        monorig.Table.from_parquet(tmp_path / "none.parquet")


def test_an_error_goes_from_process_to_process() -> None:
    e = monorig.InputError("wrong", "right", "a.yaml", 3, "load.mass_kg")
    again = pickle.loads(pickle.dumps(e))
    assert str(again) == str(e) == "a.yaml:3:load.mass_kg: wrong\n  help: right"
    assert (again.line, again.key) == (3, "load.mass_kg") and isinstance(e, ValueError)
