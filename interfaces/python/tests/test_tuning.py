"""The objective as a function is what the search of the study measures."""

from __future__ import annotations

import math
import pathlib

import optuna
import pytest

import monorig


@pytest.fixture(scope="module")
def quick(scenarios: pathlib.Path) -> pathlib.Path:
    return scenarios / "tuning/quick.yaml"


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    return tmp_path_factory.mktemp("tuning")


@pytest.fixture(scope="module")
def objective(quick: pathlib.Path, cache: pathlib.Path) -> monorig.Objective:
    return monorig.Objective(quick, cache=cache / "tune/.cache")


def test_the_objective_is_that_of_the_search(
    quick: pathlib.Path, cache: pathlib.Path, objective: monorig.Objective
) -> None:
    found = monorig.tune(quick, out=cache, progress=False)
    assert found.best is not None and (found.folder / "report.html").exists()
    assert objective(found.best) == found.loss
    for trial in found.trials[:5]:
        score = objective.score(trial["parameters"])
        assert (score.losses, score.violation) == (trial["losses"], trial["violation"])
    with pytest.raises(monorig.InputError, match="resume"):
        monorig.tune(quick, out=cache)


def test_the_defaults_have_a_loss_of_one_and_mistakes_are_told(objective: monorig.Objective) -> None:
    assert objective.score(objective.defaults).losses == [pytest.approx(1.0)]
    with pytest.raises(monorig.InputError, match="has no parameter `nothing`"):
        objective({"nothing": 1.0})


def test_optuna_proposes_within_the_ranges(objective: monorig.Objective) -> None:
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study(sampler=optuna.samplers.RandomSampler(seed=1))
    losses = []
    for _ in range(5):
        proposed = objective.suggest(study.ask())
        for name, value in proposed.items():
            of = objective.space[name]
            if of["choices"] is not None:
                assert value in of["choices"]
            else:
                assert of["from"] - 1e-12 <= value <= of["to"] + 1e-12
        losses.append(objective(proposed))
        study.tell(study.trials[-1].number, losses[-1])
    best = objective.best(study)
    assert set(best) == set(objective.defaults) and objective(best) == study.best_value == min(losses)
    assert len(set(losses)) > 1 and all(x > 0.0 for x in losses) and not all(map(math.isinf, losses))
