"""The examples run as they stand."""

from __future__ import annotations

import json
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
    made = (tmp_path / "first_steps.ipynb").read_text()
    # what is committed has been run, too
    kept = (EXAMPLES / "first_steps.ipynb").read_text()
    assert made.count("image/png") == kept.count("image/png") >= 1
    cells = [cell for cell in json.loads(kept)["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))


def test_what_is_made_in_python_runs(program: str, tmp_path: pathlib.Path) -> None:
    root = os.fspath(EXAMPLES.parents[2])
    words = [program, "new", "estimator", "python", "mine", "--monorig", root]
    told = subprocess.run(words, cwd=tmp_path, check=True, capture_output=True, text=True).stdout
    assert "held" in run(tmp_path / "mine", "test_climb.py")
    # without the package it says what is missing
    bare = [sys.executable, "-I", "-c", "import sys; sys.path.insert(0, '.'); sys.modules['monorig'] = None; import two_state"]
    done = subprocess.run(bare, cwd=tmp_path / "mine", capture_output=True, text=True, check=False)
    assert done.returncode != 0 and "pip install" in done.stderr.splitlines()[-1]
    assert "pip install" in told
