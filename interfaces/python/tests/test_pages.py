"""The Python code of the pages runs as it stands, block after block; the page of the interface is that of the docstrings."""

from __future__ import annotations

import os
import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[3]
# those of the tutorial and of `outputs.md` belong to commands of the program, whose tests run them
PAGES = ["docs/src/python.md", "interfaces/python/README.md"]
WITH_COMMANDS = ["docs/src/outputs.md", "docs/src/tutorial.md"]


def blocks(page: pathlib.Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("page", PAGES)
def test_a_page_runs(page: str, tmp_path: pathlib.Path) -> None:
    code = "\n".join(blocks(ROOT / page))
    assert code
    for name in ("assets", "scenarios", "tests"):
        (tmp_path / name).symlink_to(ROOT / name)
    script = tmp_path / "page.py"
    # processes of a study read the page as a module
    script.write_text("if __name__ == '__main__':\n" + "".join(f"    {line}\n" for line in code.splitlines()))
    environment = {**os.environ, "MPLBACKEND": "agg"}
    done = subprocess.run(
        [sys.executable, script.name], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_no_page_has_code_that_is_not_run() -> None:
    pages = [*ROOT.glob("docs/src/**/*.md"), *ROOT.glob("*.md"), *ROOT.glob("interfaces/*/README.md")]
    with_code = {page.relative_to(ROOT).as_posix() for page in pages if blocks(page)}
    assert with_code == {*PAGES, *WITH_COMMANDS}


def test_the_page_of_the_interface_is_up_to_date() -> None:
    script = ROOT / "interfaces/python/tools/api_page.py"
    done = subprocess.run([sys.executable, script, "--check"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
