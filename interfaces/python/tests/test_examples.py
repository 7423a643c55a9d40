"""The examples run as they stand."""

from __future__ import annotations

import os
import pathlib
import subprocess
import sys

import pytest

EXAMPLES = pathlib.Path(__file__).resolve().parents[1] / "examples"


def run(folder: pathlib.Path, *words: str) -> str:
    done = subprocess.run([sys.executable, *words], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(
    ("name", "arguments", "said"),
    [
        ("two_state.py", [], "mine"),
        ("test_climb.py", [], "held"),
        ("on_a_log.py", [], "slope_rmse_deg"),
        ("tune_with_optuna.py", [os.fspath(EXAMPLES.parents[2] / "scenarios/tuning/quick.yaml"), "8"], "loss"),
    ],
)
def test_an_example(name: str, arguments: list[str], said: str, tmp_path: pathlib.Path) -> None:
    assert said in run(tmp_path, str(EXAMPLES / name), *arguments)


def test_the_notebook(tmp_path: pathlib.Path) -> None:
    pytest.importorskip("nbconvert")
    words = ["-m", "nbconvert", "--execute", "--to", "notebook", "--output-dir", str(tmp_path)]
    run(EXAMPLES, *words, str(EXAMPLES / "first_steps.ipynb"))
    assert (tmp_path / "first_steps.ipynb").read_text().count("image/png") == 1


def test_what_is_made_in_python_runs(program: str, tmp_path: pathlib.Path) -> None:
    root = os.fspath(EXAMPLES.parents[2])
    subprocess.run([program, "new", "estimator", "python", "mine", "--monorig", root], cwd=tmp_path, check=True)
    assert "held" in run(tmp_path / "mine", "test_climb.py")
