"""A two-state Kalman filter for speed and slope, in thirty lines, and a run with it in the loop.

    python two_state.py [SCENARIO]
"""

import math
import pathlib
import sys

try:
    import monorig
except ModuleNotFoundError as e:
    help = "pip install ./interfaces/python in a checkout of monorig"
    raise ModuleNotFoundError(f"{e}\n  help: {help}", name=e.name) from None

SCENARIO = pathlib.Path(__file__).with_name("climb.yaml")
G = 9.81


class TwoState:
    """State: speed (m/s) and slope (rad). The accelerometer drives it, the wheels correct it. It finds no mass."""

    internals = {"innovation": "m/s"}

    def __init__(self, vehicle: monorig.Vehicle, slope_noise: float = 4e-4) -> None:
        self.mass_kg = vehicle.tare_kg
        self.slope_noise = slope_noise
        self.reset()

    def reset(self) -> None:
        self.v, self.slope, self.accel, self.innovation = 0.0, 0.0, 0.0, 0.0
        self.p_vv, self.p_vs, self.p_ss = 0.01, 0.0, 0.03

    def step(self, z: monorig.Measurements, dt: float) -> monorig.Estimate:
        force = z.specific_force
        if force is not None:
            self.accel = force[0]
        self.v += dt * (self.accel - G * math.sin(self.slope))
        f = -dt * G * math.cos(self.slope)
        self.p_vv += 2 * f * self.p_vs + f * f * self.p_ss + 1e-4 * dt
        self.p_vs += f * self.p_ss
        self.p_ss += self.slope_noise * dt
        speeds = [v for v in z.wheel_speed if v is not None]
        if speeds:
            self.innovation = sum(speeds) / len(speeds) - self.v
            s = self.p_vv + 4e-4 / len(speeds)
            k_v, k_s = self.p_vv / s, self.p_vs / s
            self.v += k_v * self.innovation
            self.slope += k_s * self.innovation
            self.p_ss -= k_s * self.p_vs
            self.p_vs *= 1 - k_v
            self.p_vv *= 1 - k_v
        return monorig.Estimate(
            total_mass=(self.mass_kg, 1000.0, False),
            grade=(self.slope, math.sqrt(self.p_ss), True),
            # that of the whole train is another while only a part of it is on the climb
            effective_grade=(self.slope, math.sqrt(self.p_ss), False),
            speed=(self.v, math.sqrt(self.p_vv), True),
        )

    def internal_values(self) -> list[float]:
        return [self.innovation]


def main() -> None:
    scenario = sys.argv[1] if len(sys.argv) > 1 else SCENARIO
    run = monorig.run(scenario, estimators={"mine": TwoState}, in_loop="mine")
    for name, of in run.metrics.items():
        print(f"{name:<24} slope RMSE {of['slope_rmse_deg']:.3f}°")
    print(run.report("two_state.html"))


if __name__ == "__main__":
    main()
