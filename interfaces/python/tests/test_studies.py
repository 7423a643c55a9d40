"""Many runs are single runs, whoever makes them; what follows from them is what the program says."""

from __future__ import annotations

import json
import pathlib
import subprocess

import numpy as np
import pytest
from two_state import TwoState

import monorig


@pytest.fixture(scope="module")
def minimal(scenarios: pathlib.Path) -> pathlib.Path:
    return scenarios / "minimal.yaml"


class Breaks(TwoState):
    def step(self, z: monorig.Measurements, dt: float) -> monorig.Estimate:
        raise ArithmeticError("in a process of its own")


def test_a_study_is_its_runs_in_processes_and_threads(minimal: pathlib.Path) -> None:
    seeds, shorter = [3, 1, 2], {"stop.after_s": 10.0}
    own = monorig.study(minimal, seeds, set=shorter, estimators={"mine": TwoState}, jobs=2)
    here = monorig.study(minimal, seeds, set=shorter, estimators={"mine": TwoState}, jobs=1)
    ours = monorig.study(minimal, seeds, set=shorter, jobs=2)
    assert own.runs == here.runs and [r["seed"] for r in own.runs] == seeds and not own.errors
    for at, seed in enumerate(seeds):
        single = monorig.run(minimal, seed=seed, set=shorter, estimators={"mine": TwoState})
        assert own.values("mine", "slope_rmse_deg")[at] == single.metrics["mine"]["slope_rmse_deg"]
        (name, *_) = ours.runs[at]["summary"]["estimators"]
        assert ours.values(name, "slope_rmse_deg")[at] == single.metrics[name]["slope_rmse_deg"]
    twice = monorig.study(minimal, seeds, set=shorter, estimators={"mine": TwoState}, jobs=2)
    assert twice.runs == own.runs
    shards = [monorig.study(minimal, seeds, set=shorter, shard=(k, 2), jobs=1) for k in (2, 1)]
    assert monorig.Study.joined(shards).runs == ours.runs and len(shards[0]) == 1
    with pytest.raises(monorig.InputError, match="not all shards"):
        monorig.Study.joined(shards[:1])
    with pytest.raises(monorig.InputError, match="shard"):
        monorig.study(minimal, seeds, shard=(3, 2))
    table = own.to_pandas()
    assert table.loc[(1, "mine"), "slope_rmse_deg"] == own.values("mine", "slope_rmse_deg")[1]


def test_an_exception_comes_out_of_its_process(minimal: pathlib.Path) -> None:
    with pytest.raises(ArithmeticError, match="in a process of its own"):
        monorig.study(minimal, [1, 2], estimators={"mine": Breaks}, jobs=2)


def test_a_comparison_is_that_of_the_program(minimal: pathlib.Path, program: str, tmp_path: pathlib.Path) -> None:
    names = ["dffrls_aekf_robust", "rls_ekf"]
    json_file = tmp_path / "compared.json"
    command = [program, "compare", str(minimal), "--estimators", ",".join(names), "--seeds", "1..3"]
    subprocess.run([*command, "--json", str(json_file)], check=True, capture_output=True)
    theirs = json.loads(json_file.read_text())
    ours = monorig.compare(minimal, names, [1, 2, 3])
    assert ours.table == theirs["table"] and ours.reference == theirs["reference"]
    shown = ours.mean("rls_ekf", "slope_rmse_deg")
    assert shown is not None and f"{shown:.4g}" in str(ours)
    with pytest.raises(monorig.InputError, match="did you mean `slope_rmse_deg`"):
        monorig.compare(minimal, names, [1], metrics=["slope_rms_deg"])


def test_a_verdict_is_that_of_the_program(minimal: pathlib.Path, program: str, tmp_path: pathlib.Path) -> None:
    json_file = tmp_path / "tested.json"
    subprocess.run([program, "test", str(minimal), "--json", str(json_file)], check=False, capture_output=True)
    (theirs,) = json.loads(json_file.read_text())["scenarios"]
    (ours,) = monorig.test(minimal)
    assert (ours.held, ours.checks) == (theirs["held"], theirs["checks"])
    assert ours.verdict in str(ours) and ours.held != ours.verdict.startswith("FAILED")
    (strict,) = monorig.test(
        minimal,
        set={"expect": [{"metric": "slope_rmse_deg", "estimator": "rail_fusion", "at_most": 1e-6, "availability": 0.01}]},
        estimators={"rail_fusion": {}},
        seeds=[1],
    )
    assert not strict.held and any("slope_rmse_deg" in failure for failure in strict.failures)


def test_processes_stay_for_the_next_study(minimal: pathlib.Path) -> None:
    from monorig import _study

    def made() -> object:
        monorig.study(minimal, [1, 2], set={"stop.after_s": 3.0}, estimators={"mine": TwoState}, jobs=2)
        return _study._kept

    first = made()
    assert first is not None and made()[1] is first[1]  # type: ignore[index]


def test_what_cannot_be_measured_is_nan(minimal: pathlib.Path) -> None:
    study = monorig.study(minimal, [1, 2], set={"stop.after_s": 3.0}, jobs=1)
    name = next(iter(study.runs[0]["summary"]["estimators"]))
    values = study.values(name, "slope_rmse_deg")
    assert values.shape == (2,) and np.isnan(values).all()
    assert np.isnan(study.values("nobody", "slope_rmse_deg")).all()


def test_scenarios_are_found_as_the_program_finds_them(
    minimal: pathlib.Path, program: str, tmp_path: pathlib.Path
) -> None:
    text = minimal.read_text().replace("../", f"{minimal.parents[1]}/").replace("after_s: 60", "after_s: 6")
    for name in ("b.yaml", "deeper/a.yml", ".hidden/c.yaml", "deeper/.c.yaml", "deeper/still/d.YAML"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / "deeper/link.yaml").symlink_to(tmp_path / "b.yaml")
    (tmp_path / "no_scenario.yaml").symlink_to(minimal.parents[1] / "assets/tracks/liu2023_section1.yaml")
    json_file = tmp_path / "tested.json"
    words = [program, "test", str(tmp_path), str(tmp_path / "b.yaml"), "--seeds", "1", "--json", str(json_file)]
    subprocess.run(words, check=False, capture_output=True)
    theirs = [s["scenario"] for s in json.loads(json_file.read_text())["scenarios"]]
    ours = monorig.test([tmp_path, tmp_path / "b.yaml"], seeds=[1])
    assert [verdict.scenario for verdict in ours] == theirs == ["b", "a", "d"]


def test_metrics_have_units() -> None:
    assert monorig.metrics()["slope_rmse_deg"] == "deg" or monorig.metrics()["slope_rmse_deg"] == "°"
