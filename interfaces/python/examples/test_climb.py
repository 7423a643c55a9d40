"""Does what the scenario expects of the estimator hold? `python test_climb.py`, or pytest."""

import pathlib

try:
    import monorig
except ModuleNotFoundError as e:
    help = "pip install ./interfaces/python in a checkout of monorig"
    raise ModuleNotFoundError(f"{e}\n  help: {help}", name=e.name) from None
from two_state import TwoState

SCENARIO = pathlib.Path(__file__).with_name("climb.yaml")


def test_climb() -> None:
    (verdict,) = monorig.test(SCENARIO, estimators={"mine": TwoState})
    assert verdict.held, verdict


if __name__ == "__main__":
    test_climb()
    print("held")
