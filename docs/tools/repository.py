"""Writes the address of the repository into the manifests of a release, which know none before.

usage: repository.py https://… [wheel]   for the crates, of which binstall finds the archives by it; or for PyPI alone, so that the
                                         revision of a program that is built then is not a changed one
"""

import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
LICENCE = 'license = "MIT OR Apache-2.0"\n'


def replace(file: pathlib.Path, old: str, new: str) -> None:
    text = file.read_text(encoding="utf-8")
    if old in text and new not in text:
        file.write_text(text.replace(old, new, 1), encoding="utf-8")


def main() -> None:
    address, *wheel = sys.argv[1:]
    project = "[project.optional-dependencies]\n"
    replace(ROOT / "interfaces/python/pyproject.toml", project, f'[project.urls]\nRepository = "{address}"\n\n{project}')
    if wheel:
        return
    replace(ROOT / "Cargo.toml", LICENCE, f'{LICENCE}repository = "{address}"\n')
    for folder in ("cli", "estimators", "estimators/f32", "interfaces", "lab", "sim"):
        for file in (ROOT / folder).rglob("Cargo.toml"):
            replace(file, "license.workspace = true\n", "license.workspace = true\nrepository.workspace = true\n")


main()
