"""A gymnasium environment: an agent drives the train. It needs ``monorig[gym]``.

>>> from monorig.gym import DriveEnv
>>> env = DriveEnv("scenarios/minimal.yaml")
>>> observation, info = env.reset(seed=1)
>>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from ._monorig import Frame, Perception, Reference
from ._run import Simulation
from ._types import Estimators, Path

Array = npt.NDArray[np.float32]


def speed_error(frame: Frame, reference: Reference) -> float:
    """Returns minus the square of the speed error, (m/s)²: the reward unless another one is given."""
    return -((reference.speed_mps - frame.truth["speed_mps"]) ** 2)


class DriveEnv(gymnasium.Env[Array, Array]):
    """An environment in which an agent sets the torque of the motors of a scenario.

    An action is the share of the largest torque, −1…1, the same for all motors. An observation has wanted speed (m/s),
    wanted acceleration (m/s²), speed by the wheels (m/s), grade (rad), total mass (t) and largest slip (m/s), as the
    controller of the scenario knows them. An episode ends with the scenario; ``info["run"]`` is then the `Run`.

    Args:
        path: The scenario file.
        hold_s: Time for which an action holds, s.
        reward: Function of the `Frame` and the `Reference` after an action.
        estimators: Estimators beside those of the scenario, as for `run`.
        in_loop: The estimator whose grade and mass are observed.
        set: Changes to the scenario.
    """

    def __init__(
        self,
        path: Path,
        *,
        hold_s: float = 0.1,
        reward: Callable[[Frame, Reference], float] = speed_error,
        estimators: Estimators | None = None,
        in_loop: str | None = None,
        set: Mapping[str, object] | None = None,
    ) -> None:
        self._make: Callable[[int], Simulation] = lambda seed: Simulation(
            path, seed=seed, set=set, estimators=estimators, in_loop=in_loop
        )
        self._hold_s, self._reward = hold_s, reward
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), np.float32)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (6,), np.float32)
        self.simulation: Simulation | None = None
        self._actions = 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Begins the scenario anew, with a seed drawn from the environment's."""
        super().reset(seed=seed)
        self.simulation = self._make(int(self.np_random.integers(2**32)))
        self._actions = 0
        return self._observation(self.simulation.reference, self.simulation.perception), {}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Holds a torque for a while."""
        simulation = self.simulation
        if simulation is None or simulation.over:
            raise gymnasium.error.ResetNeeded("the episode is over, or has not begun: call reset")
        torque = float(np.clip(action[0], -1.0, 1.0)) * simulation.motor_torque_max_nm
        # a hold that is no multiple of the step ends with the nearest one
        self._actions += 1
        until = self._actions * self._hold_s - 0.5 * simulation.dt_s
        frame = simulation.step(torque)
        while simulation.time_s < until and not simulation.over:
            frame = simulation.step(torque)
        reference, over = simulation.reference, simulation.over
        info: dict[str, Any] = {"time_s": frame.time_s, "truth": frame.truth}
        if over:
            info["run"] = simulation.result()
        return self._observation(reference, simulation.perception), self._reward(frame, reference), over, False, info

    @staticmethod
    def _observation(reference: Reference, seen: Perception) -> Array:
        slip = max(seen.slip_mps, key=abs, default=0.0)
        values = [reference.speed_mps, reference.accel_mps2, seen.speed_mps, seen.grade_rad, 1e-3 * seen.total_mass_kg, slip]
        return np.array(values, dtype=np.float32)
