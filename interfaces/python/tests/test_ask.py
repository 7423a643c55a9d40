"""Stress, explain, inspect, calibrate and check are those of the program; a data frame is as good a log as its file."""

from __future__ import annotations

import json
import os
import pathlib
import subprocess
from typing import Any

import numpy as np
import pandas
import polars
import pytest
from two_state import TwoState

import monorig

ROOT = pathlib.Path(__file__).resolve().parents[3]
HUSKY = ROOT / "tests/data/real/husky"
SHORTER = {"stop.after_s": 12.0}


def program_json(program: str, folder: pathlib.Path, *words: str, at: pathlib.Path | None = None) -> Any:
    file = folder / "theirs.json"
    subprocess.run([program, *words, "--json", str(file)], cwd=at or folder, capture_output=True, check=True)
    return json.loads(file.read_text())


def test_stress_is_that_of_the_program(program: str, scenarios: pathlib.Path, tmp_path: pathlib.Path) -> None:
    scenario, conditions = scenarios / "minimal.yaml", ROOT / "assets/conditions"
    only = ["accel_bias", "accel_sign"]
    ours = monorig.stress(scenario, ["rail_fusion"], conditions=conditions, only=only, set=dict(SHORTER), jobs=2)
    words = ["stress", str(scenario), "--estimators", "rail_fusion", "--only", ",".join(only), "--out", str(tmp_path)]
    # its own conditions are those of the checkout there
    theirs = program_json(program, tmp_path, *words, "--set", "stop.after_s=12.0", at=ROOT)
    assert ours.cells == theirs["cells"] and ours.rows == theirs["rows"]
    assert len(ours.to_pandas()) == len(ours.cells) == 3
    own = monorig.stress(scenario, {"mine": TwoState}, conditions=conditions, only=only, set=dict(SHORTER))
    assert {cell["estimator"] for cell in own.cells} == {"mine"}
    with pytest.raises(monorig.InputError, match="no scenario"):
        monorig.stress(tmp_path, conditions=conditions)


def test_explain_is_that_of_the_program(program: str, scenarios: pathlib.Path, tmp_path: pathlib.Path) -> None:
    scenario = scenarios / "minimal.yaml"
    budget = monorig.explain(scenario, [1, 2], set=dict(SHORTER), jobs=2)
    run = [program, "run", str(scenario), "--no-rerun", "--set", "stop.after_s=12.0", "--name", "short", "--out", "."]
    subprocess.run(run, cwd=tmp_path, capture_output=True, check=False)
    words = [program, "explain", "minimal@short/1", "--scenario", str(scenario), "--seeds", "1,2"]
    subprocess.run(words, cwd=tmp_path, capture_output=True, check=True)
    theirs = json.loads((tmp_path / "minimal@short/1/explain.json").read_text())
    assert (budget.errors, budget.sources) == (theirs["errors"], theirs["sources"])
    assert budget.estimator in str(budget)
    shares = budget.to_pandas()
    assert list(shares.columns) == [source["name"] for source in budget.sources] and (shares.stack() <= 1.0).all()


def test_a_data_frame_is_the_log_that_it_was_read_from() -> None:
    map, names = HUSKY / "husky.map.yaml", ["imu_flooring_03.csv", "wheels_flooring_03.csv"]
    of_files = monorig.replay(map)
    for read in (pandas.read_csv, polars.read_csv, lambda path: pandas.read_csv(path).to_dict("list")):
        of_frames = monorig.replay(map, {name: read(HUSKY / name) for name in names})
        assert of_frames.metrics == of_files.metrics
    frame = pandas.read_csv(HUSKY / names[0])
    for log in (frame, frame.set_index("time"), {name: frame[name].to_numpy() for name in frame}):
        assert monorig.inspect(log).tables == monorig.inspect(HUSKY / names[0]).tables
    with pytest.raises(monorig.InputError, match="int is no log"):
        monorig.inspect(3)


def test_a_log_is_inspected_and_calibrated(program: str, tmp_path: pathlib.Path) -> None:
    found = monorig.inspect(HUSKY / "imu_flooring_03.csv")
    (table,) = found.tables
    frame = pandas.read_csv(HUSKY / "imu_flooring_03.csv")
    assert table["rows"] == len(frame) and "specific_force" in found.map
    for column in table["columns"]:
        assert column["max"] == frame[column["name"]].max()
    with pytest.raises(monorig.InputError, match="unit=days"):
        monorig.inspect(HUSKY / "imu_flooring_03.csv", unit="days")
    map = HUSKY / "husky.map.yaml"
    ours = monorig.calibrate(map)
    theirs = program_json(program, tmp_path, "log", "calibrate", "--map", str(map), "--known", "slope")
    assert ours.parameters and all(parameter in theirs for parameter in ours.parameters)
    better = monorig.replay(map, set=ours.changes)
    slope = "slope_bias_deg"
    before, after = (run.metrics["attitude"][slope] for run in (monorig.replay(map), better))
    assert before is not None and after is not None and abs(after) < abs(before)
    with pytest.raises(monorig.InputError, match="mass"):
        monorig.calibrate(map, known=["mass", "slope"])


def test_files_are_checked(program: str, scenarios: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MONORIG", program)
    scenario, map = scenarios / "minimal.yaml", HUSKY / "husky.map.yaml"
    lines = monorig.check(scenario, map)
    assert ["scenario ok" in lines[0], "map ok" in lines[1]] == [True, True]
    with pytest.raises(monorig.InputError, match="nothing.yaml"):
        monorig.check(scenario.with_name("nothing.yaml"))
    monkeypatch.delenv("MONORIG")
    monkeypatch.setenv("PATH", os.devnull)
    monkeypatch.setattr("monorig._program.sysconfig.get_path", lambda _: os.devnull)
    with pytest.raises(FileNotFoundError, match="MONORIG="):
        monorig.check(scenario)


def test_arrays_may_be_lists_and_of_other_numbers(scenarios: pathlib.Path) -> None:
    vehicle = monorig.Vehicle.from_scenario(scenarios / "minimal.yaml")
    t, force = np.arange(1, 51) * 5_000_000, np.tile([0.25, 0.0, 9.75], (50, 1))
    force[7] = np.nan
    speed = np.full((50, vehicle.drives), 0.5)
    gap = [[None] * 3 if i == 7 else row for i, row in enumerate(force.tolist())]
    grades = []
    for times, f, v in (
        (t, force, speed),
        (t.tolist(), gap, speed.tolist()),
        (t.astype(np.uint32), force.astype(np.float32), np.asfortranarray(speed)),
    ):
        estimator = monorig.Estimator("complementary_filter", vehicle)
        grades.append(estimator.run(times, specific_force=f, wheel_speed=v)["grade"])
    assert all(grade.tobytes() == grades[0].tobytes() for grade in grades)
