"""Scenarios: a path, the name of one that comes with monorig, a dict, or YAML text."""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import json
import os
import pathlib
import re
import tempfile
from collections.abc import Mapping

from ._types import Scenario

# a file that every folder with what comes with monorig has
_ONE = pathlib.Path("scenarios", "minimal.yaml")
# what is the name of a file in a scenario
_FILE = re.compile(r"""(?<![^\s:\[{,"'])[\w./@~-]+\.(?:ya?ml|csv|so|dylib|dll|fmu)(?![^\s\]},"'])""")


@functools.cache
def _installed() -> pathlib.Path | None:
    """The folder of a wheel, wherever pip has put it; of a checkout, the checkout."""
    try:
        files = importlib.metadata.files("monorig") or []
    except importlib.metadata.PackageNotFoundError:
        files = []
    for file in files:
        if file.parts[-2:] == _ONE.parts:
            return pathlib.Path(str(file.locate())).resolve().parents[1]
    here = pathlib.Path(__file__).resolve()
    return next((folder for folder in here.parents if (folder / _ONE).is_file()), None)


def share() -> pathlib.Path | None:
    """The folder with scenarios, tracks, trains, templates and libraries; None where nothing of it is there."""
    here = pathlib.Path.cwd()
    above = next((folder for folder in (here, *here.parents) if (folder / _ONE).is_file()), None)
    return above or _installed()


def scenarios() -> list[str]:
    """The names of the scenarios that come with monorig, as `run` takes them."""
    folder = share()
    if folder is None:
        return []
    files = (folder / "scenarios").rglob("*.yaml")
    names = (file.relative_to(folder / "scenarios").with_suffix("").as_posix() for file in files)
    return sorted(name for name in names if not name.startswith(("studies/", "tuning/")))


def _found(name: str) -> pathlib.Path | None:
    """A file of this path, or one that comes with monorig."""
    folder = share()
    places = [pathlib.Path(name)]
    if folder is not None and not places[0].is_absolute():
        # names in a scenario are from its folder
        in_scenarios = folder / "scenarios" / name
        places += [folder / name, in_scenarios, in_scenarios.with_suffix(".yaml")]
    return next((place.absolute() for place in places if place.exists()), None)


@functools.cache
def _folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="monorig-")


def _written(text: str) -> str:
    """A file with this text, whose names are from the current folder or of what comes with monorig."""

    def whole(match: re.Match[str]) -> str:
        name = match.group()
        found = _found(name) or (pathlib.Path(name).absolute() if "/" in name else None)
        return name if found is None else found.as_posix()

    text = _FILE.sub(whole, text)
    folder = pathlib.Path(_folder().name, hashlib.sha256(text.encode()).hexdigest()[:16])
    folder.mkdir(exist_ok=True)
    file = folder / "scenario.yaml"
    file.write_text(text, encoding="utf-8")
    return os.fspath(file)


def place(scenario: Scenario) -> str:
    """The path of a scenario, however it is given. A text of one line is a path or a name."""
    if isinstance(scenario, Mapping):
        return _written(json.dumps(dict(scenario), indent=1, default=lambda x: x.item()))
    name = os.fspath(scenario)
    if "\n" in name:
        return _written(name)
    found = None if os.path.lexists(name) else _found(name)
    return name if found is None else os.fspath(found)
