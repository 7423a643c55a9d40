"""Where things are, and the program that the module is compared with."""

from __future__ import annotations

import os
import pathlib
import shutil
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[3]
EXAMPLES = ROOT / "interfaces/python/examples"
sys.path.insert(0, str(EXAMPLES))
# processes that a study starts find it, too
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(EXAMPLES), os.environ.get("PYTHONPATH")]))


@pytest.fixture(scope="session")
def scenarios() -> pathlib.Path:
    return ROOT / "scenarios"


@pytest.fixture(scope="session")
def program() -> str:
    """The program of the wheel, or the one that MONORIG names."""
    beside = pathlib.Path(sys.executable).with_name("monorig")
    found = os.environ.get("MONORIG") or shutil.which("monorig") or (str(beside) if beside.exists() else None)
    if found is None:
        pytest.skip("this wheel is without the program; MONORIG=…/target/release/monorig names one")
    return found
