"""Many runs of a scenario: studies, comparisons, verdicts."""

from __future__ import annotations

import json
import os
import pathlib
import pickle
import sys
import sysconfig
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _data, _html, _monorig
from ._errors import InputError
from ._progress import Bar
from ._types import Controller, Estimators, Path, Scenario, by_name, is_own, seed_of

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
    """A study holds the results of many runs of a scenario, in the order of their seeds.

    Attributes:
        scenario: Name of the scenario.
        runs: Of each run its seed, its summary (as `Run.summary`), and the error of one that broke down.
        shard: Which part of how many this is; ``(1, 1)`` is all.
    """

    def __init__(self, scenario: str, lines: list[str], shard: tuple[int, int] = (1, 1)) -> None:
        self.scenario = scenario
        self.shard = shard
        self._lines = lines
        self.runs: list[dict[str, Any]] = [json.loads(line) for line in lines]

    @staticmethod
    def joined(shards: Iterable[Study]) -> Study:
        """Joins all shards of a study, in any order, to the whole."""
        parts = sorted(shards, key=lambda study: study.shard)
        of = len(parts)
        if not parts or [p.shard for p in parts] != [(k, of) for k in range(1, of + 1)] or len({p.scenario for p in parts}) > 1:
            raise InputError("these are not all shards of one study", "one study for each k of shard=(k, n)")
        lines = [parts[i % of]._lines[i // of] for i in range(sum(map(len, parts)))]
        return Study(parts[0].scenario, lines)

    def values(self, estimator: str, metric: str) -> npt.NDArray[np.float64]:
        """Returns a metric of an estimator as an array, shape (runs,); NaN where it could not be measured."""
        summaries = (run.get("summary") or {} for run in self.runs)
        values = [s.get("estimators", {}).get(estimator, {}).get(metric) for s in summaries]
        return np.array(values, dtype=float)

    @property
    def errors(self) -> list[tuple[int, str]]:
        """Seed and reason of each run that broke down."""
        return [(run["seed"], run["error"]) for run in self.runs if run.get("error")]

    def rows(self) -> Iterator[tuple[int, str, str, float | None]]:
        """Yields seed, estimator, metric and value of everything that was measured of estimators."""
        for run in self.runs:
            of_run: dict[str, dict[str, float | None]] = (run.get("summary") or {}).get("estimators", {})
            for estimator, of in of_run.items():
                for metric, value in of.items():
                    yield run["seed"], estimator, metric, value

    def to_pandas(self) -> pandas.DataFrame:
        """Returns a row for each seed and estimator, a column for each metric; units are in ``attrs["units"]``."""
        import pandas

        long = pandas.DataFrame(self.rows(), columns=["seed", "estimator", "metric", "value"])
        table = long.pivot(index=["seed", "estimator"], columns="metric", values="value")
        table.attrs["units"] = {name: unit for name, unit in metrics().items() if name in table.columns}
        return table

    def __len__(self) -> int:
        return len(self.runs)

    def __repr__(self) -> str:
        return f"<Study of {self.scenario}: {len(self)} runs, {len(self.errors)} broke down>"


class Comparison:
    """A comparison holds estimators against each other on the same runs.

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
        """Returns the mean of a metric over the runs in which it could be measured."""
        for row in self.table:
            if row["estimator"] == estimator and row["metric"] == metric:
                return None if row["mean"] is None else float(row["mean"]["mean"])
        raise InputError(f"{metric} of {estimator} was not compared", "a row of `table`")

    def to_pandas(self) -> pandas.DataFrame:
        """Returns a row for each metric and estimator."""
        import pandas

        return pandas.json_normalize(self.table).set_index(["metric", "estimator"])

    def _by_estimator(self) -> tuple[dict[str, dict[str, float | None]], tuple[str, ...]]:
        all: dict[str, dict[str, float | None]] = {}
        for row in self.table:
            mean = None if row["mean"] is None else row["mean"]["mean"]
            all.setdefault(row["estimator"], {})[row["metric"]] = mean
        return all, tuple(dict.fromkeys(row["metric"] for row in self.table))

    def __str__(self) -> str:
        wide = max((len(row["estimator"]) for row in self.table), default=0)
        lines, metric = [], None
        for row in self.table:
            if row["metric"] != metric:
                metric = row["metric"]
                lines.append(f"{metric} (mean of {len(self.study)} runs, 95 % interval)")
            mean = row["mean"]
            told = "-" if mean is None else f"{mean['mean']:.4g} ({mean['low']:.4g} … {mean['high']:.4g})"
            lines.append(f"  {row['estimator']:<{wide}}  {told}")
        return "\n".join(lines)

    def __repr__(self) -> str:
        names = list(dict.fromkeys(row["estimator"] for row in self.table))
        return f"<Comparison of {', '.join(names)} over {len(self.study)} runs>"

    def _repr_html_(self) -> str:
        return _html.table(*self._by_estimator())


class ScenarioVerdict(NamedTuple):
    """A verdict judges a scenario over its seeds."""

    scenario: str
    held: bool
    """True if everything that was asked of it held."""
    verdict: str
    """The verdict in the words of the program, such as ``held but for 1 known failure: 4 of 5 checks hold``."""
    failures: list[str]
    """What did not hold, in words."""
    checks: list[dict[str, Any]]
    """Everything that was asked."""
    study: Study

    def __str__(self) -> str:
        return "\n".join([f"{self.scenario}: {self.verdict}", *(f"  - {failure}" for failure in self.failures)])


def metrics() -> dict[str, str]:
    """Returns the metrics there are, each with its unit."""
    return dict(_monorig.metrics())


def study(
    path: Scenario,
    seeds: Iterable[int] | None = None,
    *,
    set: Mapping[str, object] | None = None,
    estimators: Estimators | None = None,
    controller: Controller | None = None,
    in_loop: str | None = None,
    shard: tuple[int, int] = (1, 1),
    jobs: int | None = None,
    progress: bool = True,
) -> Study:
    """Runs a scenario with many seeds, side by side.

    Runs of our estimators share this process. Estimators in Python get processes of their own (they would wait for each
    other), which stay for the next study. A class goes there by its name: define it in a module, or install
    ``cloudpickle`` for one of a notebook; otherwise the runs are made here, one after the other, and a warning says so.
    Hand over a class or a function, so that each run has its own.

    Args:
        seeds: The seeds; None takes those of the scenario.
        shard: ``(k, n)`` makes every n-th run from the k-th on, for one of n machines; `Study.joined` joins them.
        jobs: Runs at the same time; None is one for each processor.
        progress: Show a bar on the terminal and in notebooks.
    """
    return _study(path, seeds, set, estimators, controller, in_loop, None, jobs, progress, shard)


def _study(
    path: Scenario,
    seeds: Iterable[int] | None,
    set: Mapping[str, object] | None,
    estimators: Estimators | None,
    controller: Controller | None,
    in_loop: str | None,
    reference: str | None,
    jobs: int | None,
    progress: bool,
    shard: tuple[int, int] = (1, 1),
) -> Study:
    part, parts = shard
    if not 1 <= part <= parts:
        raise InputError(f"shard={shard!r}", "(k, n) with k from 1 to n")
    changes = None if set is None else dict(set)
    named = by_name(estimators)
    place = _data.place(path)
    name, of_scenario, _ = _monorig.outline(place, changes, named, controller, in_loop)
    tasks = [
        _Task(place, seed_of(seed), changes, named, controller, in_loop, reference)
        for seed in (of_scenario if seeds is None else seeds)
    ][part - 1 :: parts]
    own = [e for e in (named or {}).values() if is_own(e)]
    if controller is not None:
        own.append(controller)
    for mine in own:
        if len(tasks) > 1 and not callable(mine):
            raise InputError(
                f"{type(mine).__name__} is one object for many runs",
                "a class, or a function that makes one, so that each run has its own",
            )
    jobs = jobs or processors()
    packed = _packed(tasks) if own and jobs > 1 and len(tasks) > 1 else None
    if packed is not None:
        with Bar(name, len(tasks), progress) as bar:
            return Study(name, _in_processes(packed, jobs, bar), shard)
    return Study(name, in_threads(_make, tasks, 1 if own else jobs, progress, name), shard)


def processors() -> int:
    """The processors that this process may use: by affinity, the quota of its container, and Slurm."""
    slurm = os.environ.get("SLURM_CPUS_PER_TASK", "")
    return min(_monorig.PROCESSORS, max(1, int(slurm))) if slurm.isdigit() else _monorig.PROCESSORS


def in_threads(
    work: Callable[[Any], str], tasks: Sequence[Any], jobs: int | None, progress: bool, name: str
) -> list[str]:
    """The results of work that lets other threads go on, in the order of the tasks."""
    workers = min(jobs or processors(), len(tasks))
    with Bar(name, len(tasks), progress) as bar:
        if workers <= 1:
            return [bar.after(work(task)) for task in tasks]
        with ThreadPoolExecutor(workers) as threads:
            return _gather(threads, work, tasks, bar)


# the processes of the last study, and what they were made for
_kept: tuple[tuple[object, ...], ProcessPoolExecutor] | None = None


def _in_processes(packed: list[bytes], jobs: int, bar: Bar) -> list[str]:
    """The results of work in other processes, which stay for the next study of the same sources."""
    global _kept
    wanted = (jobs, os.getcwd(), tuple(sys.path), tuple(sorted(_sources())))
    if _kept is None or _kept[0] != wanted:
        if _kept is not None:
            _kept[1].shutdown()
        _kept = (wanted, ProcessPoolExecutor(jobs, mp_context=get_context("spawn")))
    processes, _kept = _kept[1], None  # whatever goes wrong, they are not used again
    results = _gather(processes, _unpack, packed, bar)
    _kept = (wanted, processes)
    return results


def _sources() -> Iterator[tuple[str, int]]:
    """The files of modules that are not installed, each with the time of its last change: a process has read them once."""
    installed = tuple({sysconfig.get_path("stdlib"), sysconfig.get_path("purelib"), sysconfig.get_path("platlib")})
    for module in list(sys.modules.values()):
        file = getattr(module, "__file__", None)
        if file and not file.startswith(installed) and os.path.exists(file):
            yield file, os.stat(file).st_mtime_ns


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
        # what stands in a notebook or at a prompt is in no file that another process could read
        if hasattr(sys.modules["__main__"], "__file__") or not any(b"__main__" in task for task in packed):
            return packed
    except (pickle.PicklingError, AttributeError, TypeError):
        pass
    warnings.warn(
        "the runs are made one after the other: a class or function of yours cannot go to another process; "
        "define it in a module, or install cloudpickle",
        stacklevel=4,
    )
    return None


def compare(
    path: Scenario,
    estimators: Estimators | None = None,
    seeds: Iterable[int] | None = None,
    *,
    metrics: Sequence[str] = (),
    reference: str | None = None,
    set: Mapping[str, object] | None = None,
    controller: Controller | None = None,
    in_loop: str | None = None,
    jobs: int | None = None,
    progress: bool = True,
) -> Comparison:
    """Compares estimators on the same runs, as ``monorig compare`` does.

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
    controller: Controller | None = None,
    in_loop: str | None = None,
    jobs: int | None = None,
    progress: bool = True,
) -> list[ScenarioVerdict]:
    """Judges scenarios over their seeds, as ``monorig test`` does.

    Args:
        paths: Scenario files, or folders; a folder stands for the scenarios in it and in the folders in it.
    """
    some = None if seeds is None else list(seeds)
    judged = []
    for file in scenario_files(paths):
        made = _study(file, some, set, estimators, controller, in_loop, None, jobs, progress)
        told = json.loads(_monorig.judge(made.scenario, made._lines))
        judged.append(ScenarioVerdict(made.scenario, study=made, **told))
    return judged


def scenario_files(paths: Scenario | Iterable[Scenario]) -> list[pathlib.Path]:
    """The files, and the scenarios in the folders, each once; other files of ours in a folder are left out."""
    given = [paths] if isinstance(paths, (str, os.PathLike, Mapping)) else list(paths)
    files: dict[pathlib.Path, pathlib.Path] = {}
    for path in map(pathlib.Path, map(_data.place, given)):
        inside = [path] if not path.is_dir() else sorted(_scenarios_in(path))
        if not inside:
            raise InputError(f"{path}: there is no scenario in this folder", "a folder with scenario files (*.yaml)")
        for file in inside:
            files.setdefault(file.resolve(), file)
    return list(files.values())


def _scenarios_in(folder: pathlib.Path) -> Iterator[pathlib.Path]:
    for file in folder.rglob("*"):
        hidden = any(part.startswith(".") for part in file.relative_to(folder).parts)
        if not hidden and file.suffix.lower() in (".yaml", ".yml") and file.is_file():
            if _monorig.kind(os.fspath(file)) in ("scenario", None):
                yield file


# pytest collects what is called `test…`; this is no test
test.__test__ = False  # type: ignore[attr-defined]
