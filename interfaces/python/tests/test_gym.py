"""The environment is one of gymnasium's, and its episodes are runs."""

from __future__ import annotations

import pathlib
import warnings

import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

import monorig
from monorig.gym import DriveEnv


@pytest.fixture
def env(scenarios: pathlib.Path) -> DriveEnv:
    return DriveEnv(scenarios / "minimal.yaml", set={"stop.after_s": 5.0}, hold_s=0.25)


def test_gymnasium_finds_nothing_wrong(env: DriveEnv) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of speeds without a limit
        check_env(env, skip_render_check=True)


def test_an_episode_is_a_run(env: DriveEnv) -> None:
    with pytest.raises(ResetNeeded):
        env.step(np.zeros(1, dtype=np.float32))
    env.reset(seed=7)
    rewards, over = [], False
    while not over:
        observation, reward, over, truncated, info = env.step(np.array([0.4], dtype=np.float32))
        assert env.observation_space.contains(observation) and not truncated
        rewards.append(reward)
    run = info["run"]
    assert isinstance(run, monorig.Run) and run.finished and len(rewards) == 20
    assert run["truth/speed"].max() > 0.0 and max(rewards) <= 0.0
    env.reset(seed=7)
    for expected in rewards:
        assert env.step(np.array([0.4], dtype=np.float32))[1] == expected
