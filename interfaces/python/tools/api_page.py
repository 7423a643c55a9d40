"""Writes docs/src/python_api.md from the docstrings of the package, or checks that it is as they are.

    python tools/api_page.py [--check]

It reads the sources and stubs, and needs no built module.
"""

from __future__ import annotations

import ast
import pathlib
import re
import sys
from collections.abc import Iterator

PACKAGE = pathlib.Path(__file__).resolve().parents[1] / "monorig"
PAGE = PACKAGE.parents[2] / "docs/src/python_api.md"
CHAPTERS = [
    ("Runs", "_run.py"),
    ("Scenarios", "_data.py"),
    ("Many runs", "_study.py"),
    ("Questions", "_ask.py"),
    ("Files", "_program.py"),
    ("Tuning", "_tune.py"),
    ("Estimators and their signals", "_monorig.pyi"),
    ("Parts of your own", "_types.py"),
    ("Mistakes", "_errors.py"),
    ("Reinforcement learning: `monorig.gym`", "gym.py"),
]
HEAD = """# Python: every function and class

Here you find the docstrings of the package (by `interfaces/python/tools/api_page.py`). [In Python](python.md) shows them at work.
A mistake in a file or an argument raises `InputError`. These arguments mean the same everywhere:

- `seeds`: None takes those of the scenario.
- `jobs`: Runs at the same time; None is one for each processor.
- `progress`: Show a bar on the terminal and in notebooks.
"""
# what the head of the page says once
COMMON = re.compile(
    r"^- `(seeds`: The seeds; None takes those of the scenario\.|jobs`: .*|progress`: .*|InputError`: .*)\n", re.M
)
Item = ast.FunctionDef | ast.ClassDef


def exported() -> set[str]:
    """The names of the package, and those of its module for reinforcement learning."""
    tree = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8"))
    imported = [a.name for node in tree.body if isinstance(node, ast.ImportFrom) for a in node.names]
    return {name for name in imported if not name.startswith("_")} | {"DriveEnv", "speed_error"}


def text_of(docstring: str) -> str:
    """A docstring as Markdown: sections become lists."""
    lines: list[str] = []
    for line in docstring.splitlines():
        if line.startswith((">>> ", "... ")):
            line = f"    {line[4:]}"
        elif section := re.fullmatch(r"(Args|Attributes|Returns|Raises):", line):
            line = {"Args": "Arguments:", "Raises": "Raises:", "Returns": "Returns:"}.get(section[1], f"{section[1]}:") + "\n"
        elif item := re.fullmatch(r" {4}(\w+): (.*)", line):
            line = f"- `{item[1]}`: {item[2]}"
        elif re.match(r" {8}\S", line):
            line = f"  {line.strip()}"
        elif re.match(r" {4}\S", line):
            line = line.strip()
        lines.append(line)
    text = COMMON.sub("", "\n".join(lines) + "\n")
    # a title without a list, as the list was said before
    text = re.sub(r"^(Arguments|Raises):\n\n(?!-)", "", text, flags=re.M)
    return re.sub(r"``([^`]+)``", r"`\1`", text).strip()


def signature(of: ast.FunctionDef) -> str:
    """Names and defaults; the types are in the stubs, which editors show."""
    for argument in [*of.args.args, *of.args.kwonlyargs]:
        argument.annotation = None
    return f"{of.name}({ast.unparse(of.args)})"


def members(of: ast.ClassDef) -> Iterator[tuple[str, str]]:
    """Fields, properties and methods with the first sentence about each."""
    for node, after in zip(of.body, [*of.body[1:], None]):
        if isinstance(node, ast.FunctionDef) and (not node.name.startswith("_") or node.name == "__call__"):
            about = ast.get_docstring(node)
            is_field = any(isinstance(d, ast.Name) and d.id == "property" for d in node.decorator_list)
            arguments = ", ".join(a.arg for a in node.args.args[1:] + node.args.kwonlyargs)
            name = node.name if is_field else f"{node.name}({arguments})".removeprefix("__call__")
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            is_text = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
            about, name = (str(after.value.value) if is_text else None), node.target.id  # type: ignore[union-attr]
        else:
            continue
        yield name, text_of((about or "").split("\n\n")[0])


def entry(of: Item) -> str:
    about = text_of(ast.get_docstring(of) or "")
    if isinstance(of, ast.FunctionDef):
        return f"### {of.name}\n\n`{signature(of)}`\n\n{about}\n"
    listed = "\n".join(f"- `{name}`: {told}" for name, told in members(of) if told)
    # what has no words has them among the arguments, or needs none
    bare = ", ".join(f"`{name}`" for name, told in members(of) if not told and f"`{name}`:" not in about)
    parts = [about, f"Members:\n\n{listed}" if listed and "\n- " in about else listed, f"Also {bare}." if bare else ""]
    return f"### {of.name}\n\n" + "\n\n".join(filter(None, parts)) + "\n"


def page() -> str:
    wanted, parts = exported(), [HEAD]
    for title, file in CHAPTERS:
        tree = ast.parse((PACKAGE / file).read_text(encoding="utf-8"))
        items = [n for n in tree.body if isinstance(n, (ast.FunctionDef, ast.ClassDef)) and n.name in wanted]
        wanted -= {item.name for item in items}
        items.sort(key=lambda item: (isinstance(item, ast.ClassDef), item.name))
        parts.append("\n".join([f"## {title}\n", *map(entry, items)]))
    assert not wanted, f"in no chapter: {wanted}"
    return "\n".join(parts)


def main() -> None:
    made = page()
    if "--check" not in sys.argv:
        PAGE.write_text(made, encoding="utf-8")
    elif not PAGE.exists() or PAGE.read_text(encoding="utf-8") != made:
        sys.exit(f"{PAGE} is not as the docstrings are\n  help: python interfaces/python/tools/api_page.py")


if __name__ == "__main__":
    main()
