"""Many runs of a scenario: studies, comparisons, verdicts."""

from __future__ import annotations

import json
import os
import pathlib
import pickle
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any, NamedTuple

from . import _data, _html, _monorig
from ._errors import InputError
from ._progress import Bar
from ._types import Estimators, Scenario, by_name, is_own

if TYPE_CHECKING:
    import pandas


class _Task(NamedTuple):
    """A run to make; goes from process to process."""

    path: str
    seed: int
    set: dict[str, object] | None
    estimators: dict[str, object] | None
    controller: object | None
    in_loop: str | None
    reference: str | None


def _make(task: _Task) -> str:
    return _monorig.run_one(*task)


def _unpack(packed: bytes) -> str:
    task: _Task = pickle.loads(packed)
    return _make(task)


class Study:
    """The runs of a study, in the order of their seeds.

    Attributes:
        scenario: Name of the scenario.
        runs: Of each run its seed, its summary (as `Run.summary`), and the error of one that broke down.
    """

    def __init__(self, scenario: str, lines: list[str]) -> None:
        self.scenario = scenario
        self._lines = lines
        self.runs: list[dict[str, Any]] = [json.loads(line) for line in lines]

    def values(self, estimator: str, metric: str) -> list[float | None]:
        """A metric of an estimator, run by run; None where it could not be measured."""
        summaries = (run.get("summary") or {} for run in self.runs)
        return [s.get("estimators", {}).get(estimator, {}).get(metric) for s in summaries]

    @property
    def errors(self) -> list[tuple[int, str]]:
        """Seed and reason of each run that broke down."""
        return [(run["seed"], run["error"]) for run in self.runs if run.get("error")]

    def rows(self) -> Iterator[tuple[int, str, str, float | None]]:
        """Seed, estimator, metric and value of everything that was measured of estimators."""
        for run in self.runs:
            of_run: dict[str, dict[str, float | None]] = (run.get("summary") or {}).get("estimators", {})
            for estimator, of in of_run.items():
                for metric, value in of.items():
                    yield run["seed"], estimator, metric, value

    def to_pandas(self) -> pandas.DataFrame:
        """A row for each seed and estimator, a column for each metric."""
        import pandas

        long = pandas.DataFrame(self.rows(), columns=["seed", "estimator", "metric", "value"])
        return long.pivot(index=["seed", "estimator"], columns="metric", values="value")

    def __len__(self) -> int:
        return len(self.runs)

    def __repr__(self) -> str:
        return f"<Study of {self.scenario}: {len(self)} runs, {len(self.errors)} broke down>"


class Comparison:
    """Estimators against each other on the same runs.

    Attributes:
        table: Of each metric and estimator: ``mean`` with its 95 % interval, ``median``, the same over ``valid`` and
            over ``common`` samples, and ``difference`` from the reference, run by run.
        reference: The estimator that the others are held against.
        study: The runs.
    """

    def __init__(self, table: list[dict[str, Any]], reference: str, study: Study) -> None:
        self.table = table
        self.reference = reference
        self.study = study

    def mean(self, estimator: str, metric: str) -> float | None:
        """The mean of a metric over the runs in which it could be measured."""
        for row in self.table:
            if row["estimator"] == estimator and row["metric"] == metric:
                return None if row["mean"] is None else float(row["mean"]["mean"])
        raise InputError(f"{metric} of {estimator} was not compared", "a row of `table`")

    def to_pandas(self) -> pandas.DataFrame:
        """A row for each metric and estimator."""
        import pandas

        return pandas.json_normalize(self.table).set_index(["metric", "estimator"])

    def _by_estimator(self) -> tuple[dict[str, dict[str, float | None]], tuple[str, ...]]:
        all: dict[str, dict[str, float | None]] = {}
        for row in self.table:
            mean = None if row["mean"] is None else row["mean"]["mean"]
            all.setdefault(row["estimator"], {})[row["metric"]] = mean
        return all, tuple(dict.fromkeys(row["metric"] for row in self.table))

    def __str__(self) -> str:
        means, metrics = self._by_estimator()
        wide = max(len(name) for name in means)
        lines = []
        for metric in metrics:
            lines.append(f"{metric} (mean of {len(self.study)} runs)")
            for name, of in means.items():
                value = of.get(metric)
                lines.append(f"  {name:<{wide}}  {'-' if value is None else f'{value:.4g}'}")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return _html.table(*self._by_estimator())


class ScenarioVerdict(NamedTuple):
    """A scenario over its seeds, judged."""

    scenario: str
    held: bool
    """True if everything that was asked of it held."""
    failures: list[str]
    """What did not, in words."""
    checks: list[dict[str, Any]]
    """Everything that was asked."""
    study: Study


def metrics() -> dict[str, str]:
    """The metrics there are, each with its unit."""
    return dict(_monorig.metrics())


def study(
    path: Scenario,
    seeds: Iterable[int] | None = None,
    *,
    set: Mapping[str, object] | None = None,
    estimators: Estimators | None = None,
    controller: object | None = None,
    in_loop: str | None = None,
    jobs: int | None = None,
    progress: bool = True,
) -> Study:
    """Run a scenario with many seeds, side by side.

    Runs of our estimators share this process. Estimators in Python get processes of their own (they would wait for each
    other), to which a class goes by its name: define it in a module, or install ``cloudpickle`` for one of a notebook;
    otherwise the runs are made here, one after the other. Hand over a class or a function, so that each run has its own.

    Args:
        seeds: The seeds; None takes those of the scenario.
        jobs: Runs at the same time; None is one for each processor.
        progress: Show a bar on the terminal.
    """
    return _study(path, seeds, set, estimators, controller, in_loop, None, jobs, progress)


def _study(
    path: Scenario,
    seeds: Iterable[int] | None,
    set: Mapping[str, object] | None,
    estimators: Estimators | None,
    controller: object | None,
    in_loop: str | None,
    reference: str | None,
    jobs: int | None,
    progress: bool,
) -> Study:
    changes = None if set is None else dict(set)
    named = by_name(estimators)
    place = _data.place(path)
    name, of_scenario, _ = _monorig.outline(place, changes, named, controller, in_loop)
    tasks = [
        _Task(place, seed, changes, named, controller, in_loop, reference)
        for seed in (of_scenario if seeds is None else seeds)
    ]
    own = [e for e in (named or {}).values() if is_own(e)]
    if controller is not None:
        own.append(controller)
    for part in own:
        if len(tasks) > 1 and not callable(part):
            raise InputError(
                f"{type(part).__name__} is one object for many runs",
                "a class, or a function that makes one, so that each run has its own",
            )
    jobs = jobs or os.cpu_count() or 1
    return Study(name, _all(tasks, bool(own), jobs, progress, name))


def _all(tasks: list[_Task], has_own: bool, jobs: int, progress: bool, name: str) -> list[str]:
    packed = _packed(tasks) if has_own and jobs > 1 else None
    with Bar(name, len(tasks), progress) as bar:
        if jobs == 1 or len(tasks) == 1 or (has_own and packed is None):
            return [bar.after(_make(task)) for task in tasks]
        workers = min(jobs, len(tasks))
        if packed is not None:
            with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as processes:
                return _gather(processes, _unpack, packed, bar)
        with ThreadPoolExecutor(workers) as threads:
            return _gather(threads, _make, tasks, bar)


def _gather(executor: Executor, work: Callable[[Any], str], tasks: Sequence[Any], bar: Bar) -> list[str]:
    """The results in the order of the tasks; the first exception ends all."""
    futures = [executor.submit(work, task) for task in tasks]
    try:
        for future in as_completed(futures):
            bar.after(future.result())
    except BaseException:
        executor.shutdown(wait=True, cancel_futures=True)
        raise
    return [future.result() for future in futures]


def _packed(tasks: list[_Task]) -> list[bytes] | None:
    """The tasks as another process can read them; None if it cannot."""
    try:
        import cloudpickle

        return [cloudpickle.dumps(task) for task in tasks]
    except ImportError:
        pass
    try:
        packed = [pickle.dumps(task) for task in tasks]
    except (pickle.PicklingError, AttributeError, TypeError):
        return None
    # what stands in a notebook or at a prompt is in no file that another process could read
    in_no_file = not hasattr(sys.modules["__main__"], "__file__")
    return None if in_no_file and any(b"__main__" in task for task in packed) else packed


def compare(
    path: Scenario,
    estimators: Estimators | None = None,
    seeds: Iterable[int] | None = None,
    *,
    metrics: Sequence[str] = (),
    reference: str | None = None,
    set: Mapping[str, object] | None = None,
    controller: object | None = None,
    in_loop: str | None = None,
    jobs: int | None = None,
    progress: bool = True,
) -> Comparison:
    """Compare estimators on the same runs, as ``monorig compare`` does.

    Args:
        estimators: Those to compare, as for `run`; None takes those of the scenario.
        seeds: The seeds; None takes those of the scenario.
        metrics: The metrics; none are the usual ones.
        reference: The estimator that the others are held against; None is the first.
    """
    changes = None if set is None else dict(set)
    named = by_name(estimators)
    place = _data.place(path)
    _, _, there = _monorig.outline(place, changes, named, controller, in_loop)
    shown = there if named is None else list(named)
    against = shown[0] if reference is None and shown else reference
    if against is None or against not in shown:
        raise InputError(f"`{against}` is not compared", f"a reference out of: {', '.join(shown)}")
    made = _study(path, seeds, set, estimators, controller, in_loop, against, jobs, progress)
    table = _monorig.compare(made._lines, shown, list(metrics), against, place)
    return Comparison(json.loads(table), against, made)


def test(
    paths: Scenario | Iterable[Scenario],
    *,
    seeds: Iterable[int] | None = None,
    set: Mapping[str, object] | None = None,
    estimators: Estimators | None = None,
    controller: object | None = None,
    in_loop: str | None = None,
    jobs: int | None = None,
    progress: bool = True,
) -> list[ScenarioVerdict]:
    """Judge scenarios over their seeds, as ``monorig test`` does. A folder stands for the scenarios in it."""
    given = [paths] if isinstance(paths, (str, os.PathLike, Mapping)) else list(paths)
    files: list[pathlib.Path] = []
    for path in map(pathlib.Path, map(_data.place, given)):
        files += sorted(path.glob("*.yaml")) if path.is_dir() else [path]
    some = None if seeds is None else list(seeds)
    judged = []
    for file in files:
        made = _study(file, some, set, estimators, controller, in_loop, None, jobs, progress)
        told = json.loads(_monorig.judge(made.scenario, made._lines))
        verdict = told["verdict"]
        judged.append(
            ScenarioVerdict(made.scenario, verdict["held"], told["failures"], verdict["checks"], made)
        )
    return judged


# pytest collects what is called `test…`; this is no test
test.__test__ = False  # type: ignore[attr-defined]
