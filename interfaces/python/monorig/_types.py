"""What a user may hand over."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Protocol, TypeAlias

from ._monorig import Command, Estimate, Measurements, Perception, Reference

Path: TypeAlias = "str | os.PathLike[str]"
# a file, a name, a dict, or YAML text
Scenario: TypeAlias = "str | os.PathLike[str] | Mapping[str, object]"


class EstimatorLike(Protocol):
    """An estimator: an object with ``step``. ``reset``, ``internals`` and ``internal_values`` may be there, too."""

    def step(self, z: Measurements, dt: float, /) -> Estimate | tuple[float, float] | None:
        """One step of ``dt`` seconds with the samples that arrived. None refuses the step."""


class ControllerLike(Protocol):
    """A controller: an object with ``control``."""

    def control(
        self, reference: Reference, perception: Perception, dt: float, /
    ) -> Command | float | Sequence[float]:
        """The command of a step: a `Command`, one torque (N·m) for all drive units, or one for each."""


# By name: None (ours of that name), the name of a type, a dict of settings as in a scenario, or an object, a class or a
# function that makes one from the vehicle. A list names ours.
Estimators: TypeAlias = "Mapping[str, object] | Sequence[str]"


def by_name(estimators: Estimators | None) -> dict[str, object] | None:
    """The estimators as a dict; those of a list are ours."""
    if estimators is None:
        return None
    if isinstance(estimators, Mapping):
        return dict(estimators)
    return dict.fromkeys(estimators)


def is_own(estimator: object) -> bool:
    """True for an estimator in Python, which is not named but handed over."""
    return estimator is not None and not isinstance(estimator, (str, Mapping))
