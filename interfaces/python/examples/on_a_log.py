"""The filter of two_state.py on a recorded log: a field robot on a slope.

    python on_a_log.py [MAP]
"""

import pathlib
import sys

from two_state import TwoState

import monorig

HUSKY = pathlib.Path(__file__).resolve().parents[3] / "tests/data/real/husky/husky.map.yaml"


def main() -> None:
    run = monorig.replay(sys.argv[1] if len(sys.argv) > 1 else HUSKY, estimators={"mine": TwoState})
    print(f"{run.scenario}: {len(run['time'])} rows, {run.refusals or 'no step refused'}")
    for name, value in run.metrics["mine"].items():
        if name.startswith("slope_") and value is not None:
            print(f"  {name:<32} {value:.4g}")


if __name__ == "__main__":
    main()
