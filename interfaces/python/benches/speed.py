"""What the way through Python costs, in CPU time, the best of several.

    python benches/speed.py

Of estimators over arrays µs a step; of estimators in Python µs a callback, over a run without them.
"""

import pathlib
import sys
import time
from collections.abc import Callable

import numpy as np

import monorig

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "interfaces/python/examples"))
from two_state import TwoState  # noqa: E402


def best(work: Callable[[], object], times: int) -> float:
    """CPU time of the fastest of so many, s."""
    took = []
    for _ in range(times):
        began = time.process_time()
        work()
        took.append(time.process_time() - began)
    return min(took)


class Empty:
    def step(self, z: monorig.Measurements, dt: float) -> None:
        return None


class Reads:
    def step(self, z: monorig.Measurements, dt: float) -> tuple[float, float]:
        z.specific_force, z.angular_rate, z.wheel_speed, z.motor_torque
        return 20000.0, 0.0


def arrays() -> None:
    vehicle = monorig.Vehicle.from_scenario(ROOT / "scenarios/liu2023_section1.yaml")
    n, rng = 100_000, np.random.default_rng(1)
    k = np.arange(1, n + 1)
    accel = 0.3 * np.sin(0.002 * k)
    inputs = {
        "specific_force": np.c_[accel + 0.02 * rng.standard_normal(n), np.zeros(n), np.full(n, 9.81)],
        "angular_rate": np.zeros((n, 3)),
        "motor_torque": np.repeat((40 + 30 * np.sin(0.002 * k))[:, None], vehicle.drives, axis=1),
        "wheel_speed": np.repeat((1.0 + np.cumsum(accel * 0.005))[:, None], vehicle.drives, axis=1),
    }
    t_ns = k.astype(np.int64) * 5_000_000
    for name in ("dffrls_aekf", "rail_fusion"):
        estimator = monorig.Estimator(name, vehicle)

        def all_at_once() -> None:
            estimator.reset()
            estimator.run(t_ns, **inputs)

        def one_by_one() -> None:
            estimator.reset()
            for row in range(20_000):
                values = {name: of[row].tolist() for name, of in inputs.items()}
                estimator.step(monorig.Measurements(int(t_ns[row]), **values), 0.005)

        whole, single = best(all_at_once, 5) / n, best(one_by_one, 2) / 20_000
        print(f"{name}: arrays {whole * 1e6:.2f} µs a step, one by one {single * 1e6:.2f} µs")


def callbacks() -> None:
    for name in ("liu2023_section1", "minimal"):
        scenario = ROOT / f"scenarios/{name}.yaml"
        calls = 0

        class Counts:
            def step(self, z: monorig.Measurements, dt: float) -> None:
                nonlocal calls
                calls += 1

        monorig.run(scenario, estimators={"mine": Counts()})
        alone = best(lambda: monorig.run(scenario), 5)
        own: dict[str, monorig.EstimatorLike | type[TwoState]] = {"empty": Empty(), "reads four": Reads(), "two-state": TwoState}
        for what, mine in own.items():
            with_it = best(lambda: monorig.run(scenario, estimators={"mine": mine}), 5)
            print(f"{name}: {what:<10} {(with_it - alone) / calls * 1e6:.2f} µs a callback")


if __name__ == "__main__":
    arrays()
    callbacks()
