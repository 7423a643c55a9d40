"""A mistake has a message with its place and its cure."""

from __future__ import annotations

import pathlib
import pickle

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
        monorig.run(minimal, estimators={"mine": NoStep})
    assert "class" in e.value.help


def test_a_step_that_returns_something_else(minimal: pathlib.Path) -> None:
    with pytest.raises(TypeError, match="step of WrongReturn returned str; a step returns an Estimate"):
        monorig.run(minimal, estimators={"mine": WrongReturn})


def test_names_that_are_none_or_unknown(minimal: pathlib.Path, ours: monorig.Estimator) -> None:
    with pytest.raises(monorig.InputError, match="`a/b` is not a name"):
        monorig.run(minimal, estimators={"a/b": WrongReturn})
    with pytest.raises(monorig.InputError, match="did you mean `dffrls_aekf`"):
        monorig.Estimator("dffrls_aekff", monorig.Vehicle.from_scenario(minimal))
    with pytest.raises(monorig.InputError, match="an estimator called `rail_fusion` exists already"):
        monorig.run(minimal, estimators={"rail_fusion": WrongReturn})
    with pytest.raises(monorig.InputError, match="there is no estimator `nobody`"):
        monorig.run(minimal, estimators=["nobody"])
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


def test_arrays_of_another_shape_order_or_kind(ours: monorig.Estimator, minimal: pathlib.Path) -> None:
    with pytest.raises(monorig.InputError, match=r"wheel_speed has the shape \[5\]") as e:
        ours.run(T, wheel_speed=np.zeros(5))
    assert "NaN without a new sample" in e.value.help
    with pytest.raises(monorig.InputError, match="specific_force is not contiguous") as e:
        ours.run(T, specific_force=np.zeros((3, 10)).T)
    assert "numpy.ascontiguousarray(specific_force)" in e.value.help
    with pytest.raises(monorig.InputError, match="not an array of float64"):
        ours.run(T, inclination=np.zeros(10, dtype=np.float32))
    with pytest.raises(monorig.InputError, match="t_ns is ndarray, not an array of int64"):
        ours.run(T.astype(float))
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
        monorig.study(minimal, [1, 2], estimators={"mine": WrongReturn()})


def test_an_error_goes_from_process_to_process() -> None:
    e = monorig.InputError("wrong", "right", "a.yaml", 3, "load.mass_kg")
    again = pickle.loads(pickle.dumps(e))
    assert str(again) == str(e) == "a.yaml:3:load.mass_kg: wrong\n  help: right"
    assert (again.line, again.key) == (3, "load.mass_kg") and isinstance(e, ValueError)
