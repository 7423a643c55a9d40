"""A run has the numbers that the program writes, to the last bit, and hands them on without a copy."""

from __future__ import annotations

import json
import pathlib
import subprocess

import numpy as np
import polars
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import monorig

MAP = pathlib.Path(__file__).resolve().parents[3] / "tests/data/real/husky/husky.map.yaml"


@pytest.mark.parametrize("name", ["liu2023_section1", "minimal", "load_sway"])
def test_channels_are_those_of_the_program(
    name: str, scenarios: pathlib.Path, program: str, tmp_path: pathlib.Path
) -> None:
    scenario = scenarios / f"{name}.yaml"
    command = [program, "run", str(scenario), "--no-rerun", "--out", str(tmp_path / "theirs")]
    assert subprocess.run(command, capture_output=True, check=False).returncode in (0, 1)
    theirs = tmp_path / f"theirs/{name}/1"
    run = monorig.run(scenario)
    ours = pa.record_batch(run)
    table = pq.read_table(theirs / "channels.parquet")
    assert ours.schema.names == table.column_names and ours.num_rows == table.num_rows > 500
    for column in ours.schema.names:
        here, there = ours.column(column), table[column].combine_chunks()
        assert here.is_null().equals(there.is_null()), column
        a, b = here.to_numpy(zero_copy_only=False), there.to_numpy(zero_copy_only=False)
        assert a[a == a].tobytes() == b[b == b].tobytes(), column
        assert ours.schema.field(column).metadata == table.schema.field(column).metadata
    saved = run.save(tmp_path / "ours", recording=False)
    assert (saved / "channels.parquet").read_bytes() == (theirs / "channels.parquet").read_bytes()
    assert (saved / "metrics.json").read_bytes() == (theirs / "metrics.json").read_bytes()
    # other program, same inputs
    here, there = (json.loads((at / "manifest.json").read_text()) for at in (saved, theirs))
    assert here["inputs"] == there["inputs"] and here["resolved"] == there["resolved"]
    assert here["monorig"]["program"] != there["monorig"]["program"]
    kept = monorig.load(theirs)
    assert kept.summary == run.summary and kept.events == run.events and kept.failures == run.failures
    assert pa.record_batch(kept).equals(ours) and kept.channels.units == run.channels.units
    again = kept.save(tmp_path / "again")
    assert all((again / file.name).read_bytes() == file.read_bytes() for file in theirs.iterdir())


def test_nothing_is_copied_on_the_way_to_arrow_and_numpy(scenarios: pathlib.Path) -> None:
    run = monorig.run(scenarios / "minimal.yaml")
    first, second = pa.record_batch(run), pa.record_batch(run.channels)
    for column in (0, first.schema.get_field_index("truth/speed")):
        buffer = first.column(column).buffers()[1]
        assert buffer.address == second.column(column).buffers()[1].address
        assert first.column(column).to_numpy(zero_copy_only=True).ctypes.data == buffer.address


def test_what_a_run_says(scenarios: pathlib.Path, tmp_path: pathlib.Path) -> None:
    run = monorig.run(scenarios / "liu2023_section1.yaml", seed=3, estimators=["rail_fusion"])
    assert (run.scenario, run.seed, run.finished) == ("liu2023_section1", 3, True)
    assert run.metrics["rail_fusion"]["slope_rmse_deg"] == run.summary["estimators"]["rail_fusion"]["slope_rmse_deg"]
    assert run.passed == all(e.held or e.known_failure for e in run.expectations)
    bounded = [e for e in run.expectations if e.bound.startswith("≤") and "and" not in e.bound]
    assert bounded and all(e.held == (e.value is not None and e.value <= float(e.bound[2:])) for e in bounded)
    frame = run.to_pandas()
    assert frame.index.name == "time" and len(frame) == len(run["time"])
    assert run.to_polars()["time"].to_list() == run["time"].tolist()
    speed = polars.DataFrame(run.channels)["truth/speed"]
    assert np.array_equal(run["truth/speed"], speed.to_numpy())
    assert not set(run.metrics["rail_fusion"]) & set(run.run_metrics)
    page = run.report(tmp_path / "report.html").read_text()
    assert "liu2023_section1, seed 3" in page and "</html>" in page
    shown = run._repr_html_()
    assert "<svg" in shown and "rail_fusion" in shown and run.verdict in shown and run.verdict in repr(run)
    units = frame.attrs["units"]
    assert units == run.channels.units and units["truth/speed"] == "m/s"
    assert pa.record_batch(run).schema.field("truth/speed").metadata[b"unit"] == b"m/s"
    assert pq.read_table(_kept(run, tmp_path)).schema.field("truth/speed").metadata[b"unit"] == b"m/s"


def _kept(run: monorig.Run, folder: pathlib.Path) -> pathlib.Path:
    run.channels.to_parquet(folder / "table.parquet")
    return folder / "table.parquet"


@pytest.mark.parametrize("name", ["minimal", "liu2023_section1", "fault_off"])
def test_a_verdict_has_the_words_of_the_program(
    name: str, scenarios: pathlib.Path, program: str, tmp_path: pathlib.Path
) -> None:
    scenario = scenarios / f"{name}.yaml"
    words = [program, "run", str(scenario), "--no-rerun", "--seed", "1", "--out", str(tmp_path), "--json", "-"]
    (theirs,) = json.loads(subprocess.run(words, capture_output=True, check=False).stdout)["runs"]
    run = monorig.run(scenario, seed=1)
    assert (run.verdict, run.passed) == (theirs["verdict"], theirs["held"])


def test_a_run_that_fails_says_why(scenarios: pathlib.Path) -> None:
    class Wrong:
        def step(self, z: monorig.Measurements, dt: float) -> monorig.Estimate:
            return monorig.Estimate(grade=(0.5, 1e-6, True))

    class Never:
        def step(self, z: monorig.Measurements, dt: float) -> None:
            return None

    run = monorig.run(scenarios / "minimal.yaml", estimators={"wrong": Wrong(), "never": Never()})
    assert not run.passed and run.verdict.startswith("FAILED")
    for words in ("wrong slope_misleading_share", "never: all its estimates were invalid", "never refused"):
        assert any(words in failure for failure in run.failures), (words, run.failures)
        assert words in run._repr_html_() and words in str(run)
    bound = {"metric": "slope_rmse_deg", "estimator": "dffrls_aekf_robust", "at_most": 1e-6, "availability": 0.1}
    failures = monorig.run(scenarios / "minimal.yaml", set={"expect": [bound]}).failures
    assert any("slope_rmse_deg" in failure and "is not ≤ 0.000001" in failure for failure in failures)
    good = monorig.run(scenarios / "minimal.yaml", set={"expect": []})
    assert good.passed and good.failures == [] and "nothing was expected" in good.verdict


def test_a_run_is_drawn(scenarios: pathlib.Path) -> None:
    import matplotlib

    matplotlib.use("agg")
    run = monorig.run(scenarios / "fault_stuck.yaml", estimators=["rail_fusion"])
    assert run.faults and all(fault.from_s < fault.to_s for fault in run.faults)
    figure = run.plot(["rail_fusion"])
    mass, slope = figure.axes
    labels = slope.get_legend_handles_labels()[1]
    assert labels == ["rail_fusion", "±2σ of rail_fusion"]
    error = np.degrees(run["estimates/rail_fusion/grade"] - run["truth/grade_at_imu"])
    drawn = next(line for line in slope.lines if line.get_label() == "rail_fusion")
    valid = run["estimates/rail_fusion/grade_valid"] == 1.0
    np.testing.assert_allclose(np.asarray(drawn.get_ydata(), dtype=float)[valid], error[valid])
    texts = [text.get_text() for text in mass.texts]
    assert texts == [f"{fault.sensor}: {fault.what}" for fault in run.faults]
    with pytest.raises(monorig.InputError, match="the run has no estimator `nobody`"):
        run.plot(["nobody"])


def test_changes_reach_the_scenario_and_the_files_that_it_names(scenarios: pathlib.Path) -> None:
    light = monorig.run(scenarios / "minimal.yaml", set={"load.mass_kg": 1000, "stop.after_s": 5.0})
    heavy = monorig.run(scenarios / "minimal.yaml", set={"load.mass_kg": 9000, "stop.after_s": 5.0})
    assert heavy["truth/total_mass"][0] - light["truth/total_mass"][0] == pytest.approx(8000)
    assert heavy["time"][-1] == pytest.approx(5.0, abs=0.05)


def test_a_log_is_played(tmp_path: pathlib.Path) -> None:
    from two_state import TwoState

    run = monorig.replay(MAP, estimators={"mine": TwoState, "complementary_filter": None})
    assert set(run.metrics) == {"mine", "complementary_filter"}
    assert not run.refusals and np.isfinite(run["estimates/mine/grade"]).any()


@pytest.mark.parametrize("name", ["minimal", "fault_stuck"])
def test_the_viewer_gets_the_recording_of_the_program(
    name: str, scenarios: pathlib.Path, program: str, tmp_path: pathlib.Path
) -> None:
    scenario = scenarios / f"{name}.yaml"
    run = monorig.run(scenario)
    shown, saved = tmp_path / "shown.rrd", run.save(tmp_path / "ours") / "run.rrd"
    if not saved.exists():
        pytest.skip("this module was built without the viewer")
    run.show(shown)
    words = [program, "run", str(scenario), "--seed", str(run.seed), "--out", str(tmp_path / "theirs")]
    subprocess.run(words, capture_output=True, check=False)
    theirs = tmp_path / f"theirs/{name}/{run.seed}"
    assert shown.read_bytes() == saved.read_bytes() == (theirs / "run.rrd").read_bytes()
    monorig.load(theirs).show(tmp_path / "again.rrd")
    assert (tmp_path / "again.rrd").read_bytes() == saved.read_bytes()


def test_a_run_without_a_recording_says_so(scenarios: pathlib.Path, tmp_path: pathlib.Path) -> None:
    run = monorig.run(scenarios / "minimal.yaml", set={"stop.after_s": 3.0})
    kept = monorig.load(run.save(tmp_path, recording=False))
    with pytest.raises(monorig.InputError, match="no recording"):
        kept.show(tmp_path / "run.rrd")
