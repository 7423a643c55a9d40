"""Scenarios by name, as a dict and as text: each gives the bits of its file."""

import pathlib

import monorig
import numpy
import pytest
from conftest import ROOT

CHANGES = {"stop.after_s": 2}
TEXT = (ROOT / "scenarios" / "minimal.yaml").read_text(encoding="utf-8")


def speeds(scenario: str | pathlib.Path) -> bytes:
    return monorig.run(scenario, set=CHANGES)["truth/speed"].tobytes()


def test_every_way_to_name_a_scenario_gives_the_same_bits(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    of_file = speeds(ROOT / "scenarios" / "minimal.yaml")
    monkeypatch.chdir(tmp_path)
    assert speeds("minimal") == of_file
    assert speeds("scenarios/minimal.yaml") == of_file
    # the errors of instruments and vehicle are drawn by the name, too: a text is called `scenario`
    same = tmp_path / "scenario.yaml"
    same.write_text(TEXT.replace("../assets", (ROOT / "assets").as_posix()), encoding="utf-8")
    assert speeds(TEXT) == speeds(same)
    as_dict: dict[str, object] = {
        "version": 1,
        "why": "As a dict.",
        "track": "assets/tracks/liu2023_section1.yaml",
        "train": "../assets/trains/dx80_176y.yaml",
        "load": {"mass_kg": numpy.float64(10_000)},
        "sensors": "assets/sensors/liu2023.yaml",
        "drive": {"speed": [{"at_s": 0, "mps": 0}, {"at_s": 4, "mps": 1.0}]},
        "stop": {"after_s": 2},
    }
    run = monorig.run(as_dict)
    assert run.scenario == "scenario" and run.finished
    (verdict,) = monorig.test(as_dict, progress=False)
    assert verdict.held == run.passed


def test_names_are_those_that_there_are() -> None:
    names = monorig.scenarios()
    assert {"minimal", "liu2023_section1", "stress/no_stop", "harsh/lean"} <= set(names)
    assert not any("quick" in name for name in names)
    with pytest.raises(monorig.InputError, match="minimum"):
        monorig.run("minimum")


def test_mistakes_in_a_text_have_their_line() -> None:
    text = TEXT.replace("version: 1", "version: 1\nnothing: 2")
    with pytest.raises(monorig.InputError, match="nothing"):
        monorig.run(text)
    with pytest.raises(monorig.InputError, match="no_such_track"):
        monorig.run(TEXT.replace("../assets/tracks/", "./no_such_track/"))
