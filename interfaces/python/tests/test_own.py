"""Estimators and controllers in Python: in the loop, with their own exceptions."""

from __future__ import annotations

import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import threading
import time
import traceback
from typing import Any

import numpy as np
import pyarrow.parquet
import pytest
from two_state import TwoState

import monorig


@pytest.fixture(scope="module")
def minimal(scenarios: pathlib.Path) -> pathlib.Path:
    return scenarios / "minimal.yaml"


class Ours:
    """One of ours, handed over as if it were of the user's own."""

    def __init__(self, vehicle: monorig.Vehicle) -> None:
        self.inner = monorig.Estimator("dffrls_aekf_robust", vehicle)

    def step(self, z: monorig.Measurements, dt: float) -> monorig.Estimate:
        return self.inner.step(z, dt)


def test_ours_through_python_is_ours(minimal: pathlib.Path) -> None:
    """Every sample with its stamp, the command and the step reach Python and come back to the last bit."""
    run = monorig.run(minimal, estimators={"through": Ours})
    for quantity in ("total_mass", "total_mass_sd", "grade", "grade_sd", "speed"):
        through = run[f"estimates/through/{quantity}"]
        assert through.tobytes() == run[f"estimates/dffrls_aekf_robust/{quantity}"].tobytes()


def test_a_filter_in_the_loop(scenarios: pathlib.Path) -> None:
    scenario = scenarios / "liu2023_section1.yaml"
    run = monorig.run(scenario, estimators={"mine": TwoState}, in_loop="mine")
    slope = np.degrees(run["estimates/mine/grade"] - run["truth/grade_at_imu"])[500:]
    assert np.sqrt(np.nanmean(slope**2)) < 1.0
    beside = monorig.run(scenario, estimators={"mine": TwoState})
    assert beside["truth/speed"].tobytes() != run["truth/speed"].tobytes()
    assert np.isfinite(run["internals/mine/innovation"]).any()
    assert run.expectations and run.metrics["mine"]["slope_rmse_deg"] is not None


def test_the_filter_is_that_in_c(program: str, tmp_path: pathlib.Path) -> None:
    """Speed and slope of the example in C, to the last bit, and its verdict. (That in C finds the mass, too.)"""
    root = pathlib.Path(__file__).resolve().parents[3]
    compiler = shutil.which(os.environ.get("CC", "cc"))
    if compiler is None:
        pytest.skip("no C compiler here")
    library = tmp_path / "two_state.so"
    flags = ["-shared", "-fPIC", "-O2", "-std=c99", f"-I{root / 'interfaces/c/include'}", "-o", str(library)]
    subprocess.run([compiler, *flags, root / "examples/own_estimator_c/two_state.c", "-lm"], check=True)
    scenario = root / "interfaces/python/examples/climb.yaml"
    for seed in (1, 2):
        mine = f"estimators.mine={{library: {library}, grade_noise: 0.03}}"
        words = ["run", str(scenario), "--no-rerun", "--seed", str(seed), "--set", mine, "--name", "c", "--out", str(tmp_path)]
        subprocess.run([program, *words], check=True)
        in_c = pyarrow.parquet.read_table(tmp_path / f"climb@c/{seed}/channels.parquet")
        run = monorig.run(scenario, seed=seed, estimators={"mine": lambda vehicle: TwoState(vehicle, 0.03 * 0.03)})
        for quantity in ("grade", "grade_sd", "speed", "speed_sd"):
            ours, theirs = run[f"estimates/mine/{quantity}"], in_c[f"estimates/mine/{quantity}"].to_numpy()
            if sys.version_info < (3, 12):
                assert ours.tobytes() == theirs.tobytes(), quantity
            else:  # the sum of the wheels is then one that compensates its rounding
                np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-12)
        # the program has ended with 0: all of them held
        assert run.passed
        judged = json.loads((tmp_path / f"climb@c/{seed}/metrics.json").read_text())["expectations"]
        if sys.version_info < (3, 12):
            assert [e.value for e in run.expectations] == [e["value"] for e in judged]


@pytest.mark.parametrize("how", ["class", "function", "object"])
def test_ways_to_hand_an_estimator_over(how: str, minimal: pathlib.Path) -> None:
    vehicle = monorig.Vehicle.from_scenario(minimal)
    ways: dict[str, Any] = {"class": TwoState, "function": lambda v: TwoState(v, 4e-4), "object": TwoState(vehicle)}
    exact = {"vehicle.exact.all": "a test"}
    run = monorig.run(minimal, set=exact, estimators={"mine": ways[how]})
    same = monorig.run(minimal, set=exact, estimators={"mine": TwoState})
    assert run["estimates/mine/grade"].tobytes() == same["estimates/mine/grade"].tobytes()


def test_what_a_step_may_return(minimal: pathlib.Path) -> None:
    class Pair:
        def step(self, z: monorig.Measurements, dt: float) -> tuple[float, float] | None:
            return (20e3, 0.1) if z.t_s > 1.0 else None

    run = monorig.run(minimal, estimators={"mine": Pair()})
    assert run["estimates/mine/grade"][-1] == 0.1 and run["estimates/mine/total_mass"][-1] == 20e3
    (refusal,) = run.refusals
    assert (refusal.estimator, refusal.reason) == ("mine", "step returned None") and refusal.steps > 100


@pytest.mark.parametrize("bad", [(float("nan"), 1.0, True), (0.1, -1.0, True), (float("inf"), 1.0, True)])
def test_an_estimate_that_cannot_be_is_refused(bad: tuple[float, float, bool], minimal: pathlib.Path) -> None:
    class Bad:
        def step(self, z: monorig.Measurements, dt: float) -> monorig.Estimate:
            return monorig.Estimate(grade=bad)

    (refusal,) = monorig.run(minimal, estimators={"mine": Bad()}).refusals
    assert "of grade is" in refusal.reason


def test_an_exception_ends_the_run_at_its_step_with_its_traceback(minimal: pathlib.Path) -> None:
    class Raises:
        calls = 0

        def step(self, z: monorig.Measurements, dt: float) -> tuple[float, float]:
            self.calls += 1
            if self.calls == 100:
                raise KeyError("my own mistake")
            return 1.0, 0.0

    mine = Raises()
    with pytest.raises(KeyError, match="my own mistake") as caught:
        monorig.run(minimal, estimators={"mine": mine})
    assert mine.calls == 100
    assert traceback.extract_tb(caught.value.__traceback__)[-1].name == "step"


def test_an_exception_of_a_constructor_and_of_a_controller(minimal: pathlib.Path) -> None:
    class NoConstructor:
        def __init__(self, vehicle: monorig.Vehicle) -> None:
            raise ZeroDivisionError("no drives")

    with pytest.raises(ZeroDivisionError, match="no drives"):
        monorig.run(minimal, estimators={"mine": NoConstructor})  # type: ignore[dict-item]

    class Stops:
        calls = 0

        def control(self, reference: object, perception: object, dt: float) -> float:
            self.calls += 1
            if self.calls == 50:
                raise StopAsyncIteration("enough")
            return 0.0

    mine = Stops()
    with pytest.raises(StopAsyncIteration):
        monorig.run(minimal, controller=mine)
    assert mine.calls == 50


LIMIT_NM = 30.0


class Proportional:
    """Torque in proportion to the error of the speed, within a limit."""

    def __init__(self, vehicle: monorig.Vehicle, setup: monorig.ControllerSetup) -> None:
        assert setup.motor_torque_max_nm > 0.0 and vehicle.drives >= 1

    def control(self, reference: monorig.Reference, perception: monorig.Perception, dt: float) -> float:
        return max(-LIMIT_NM, min(LIMIT_NM, 200.0 * (reference.speed_mps - perception.speed_mps)))


def test_a_controller_drives_as_single_steps_with_its_commands_do(minimal: pathlib.Path) -> None:
    run = monorig.run(minimal, controller=Proportional)
    assert run["truth/speed"].max() > 0.3
    single = monorig.Simulation(minimal)
    while not single.over:
        error = single.reference.speed_mps - single.perception.speed_mps
        frame = single.step(max(-LIMIT_NM, min(LIMIT_NM, 200.0 * error)))
        assert all(abs(t) <= LIMIT_NM for t in frame.measurements.command.motor_torque)
    assert single.result()["truth/speed"].tobytes() == run["truth/speed"].tobytes()


def test_single_steps_under_the_scenarios_controller_are_the_run(minimal: pathlib.Path) -> None:
    single = monorig.Simulation(minimal, seed=2)
    frames = sum(1 for _ in single)
    result, run = single.result(), monorig.run(minimal, seed=2)
    assert frames == run.summary["steps"] and result.summary == run.summary
    for name in run.channels.names:
        assert result[name].tobytes() == run[name].tobytes(), name
    with pytest.raises(monorig.InputError, match="the run is over"):
        single.step()


def test_ctrl_c_ends_a_run(scenarios: pathlib.Path) -> None:
    started = threading.Event()

    class Slow:
        def step(self, z: monorig.Measurements, dt: float) -> tuple[float, float]:
            started.set()
            return 1.0, 0.0

    def interrupt() -> None:
        started.wait(30)
        time.sleep(0.05)
        os.kill(os.getpid(), signal.SIGINT)

    # a shell starts what it puts in the background with the signal ignored
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    threading.Thread(target=interrupt).start()
    try:
        with pytest.raises(KeyboardInterrupt):
            monorig.run(scenarios / "shift_24h.yaml", estimators={"mine": Slow()})
    finally:
        signal.signal(signal.SIGINT, before)


def test_other_threads_work_meanwhile(minimal: pathlib.Path) -> None:
    """A thread counts while a run without Python in it goes on: the lock of the interpreter is let go of."""
    count, over = 0, threading.Event()

    def counts() -> None:
        nonlocal count
        while not over.is_set():
            count += 1
            time.sleep(0.001)

    thread = threading.Thread(target=counts)
    thread.start()
    before = count
    monorig.run(minimal)
    during = count - before
    over.set()
    thread.join()
    assert during > 5
