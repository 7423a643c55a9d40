"""Optuna searches over the objective of a study file, with a journal that several processes can share.

    python tune_with_optuna.py [STUDY] [TRIALS]

Start it again and it goes on; start it twice at once and both search.
"""

import pathlib
import sys

import optuna
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend

import monorig

QUICK = pathlib.Path(__file__).resolve().parents[3] / "scenarios/tuning/quick.yaml"


def main() -> None:
    file = sys.argv[1] if len(sys.argv) > 1 else QUICK
    trials = int(sys.argv[2]) if len(sys.argv) > 2 else 20
    objective = monorig.Objective(file)
    study = optuna.create_study(
        study_name=pathlib.Path(file).stem,
        storage=JournalStorage(JournalFileBackend("optuna.journal")),
        sampler=optuna.samplers.TPESampler(seed=1),
        load_if_exists=True,
    )
    study.optimize(lambda trial: objective(objective.suggest(trial)), n_trials=trials)
    print(f"loss {study.best_value:.4f} (the defaults have 1) with {objective.best(study)}")


if __name__ == "__main__":
    main()
