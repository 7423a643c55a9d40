#!/usr/bin/env python3
"""Write the parameter tables of the book, docs/src/methods/parameters.md, from the `params!` lists in estimators/src.

    python docs/tools/parameters.py            # write
    python docs/tools/parameters.py --check    # exit code 1 if the file is not what would be written
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "estimators" / "src"
PAGE = ROOT / "docs" / "src" / "methods" / "parameters.md"
TEXT = r'"((?:[^"\\]|\\.)*)";'
# name ["unit"] = default, low => high, "what it is";
NUMBER = re.compile(r'(\w+) \["([^"]*)"\] = ([^,]+), (\S+) => (\S+), ' + TEXT)
# name [flag] = default, "what it is";
FLAG = re.compile(r"(\w+) \[flag\] = (\w+), " + TEXT)
# name [choice Type] = Type::Default, "what it is";
CHOICE = re.compile(r"(\w+) \[choice (\w+)\] = \w+::(\w+), " + TEXT)
# Files of the published equations, and their sources.
PUBLISHED = {"liu_2023": "Liu et al. 2023", "liu_2023_resistance": "Liu et al. 2023", "huainan": "DFFRLS-AUKF paper", "guo_2024": "Guo et al. 2024",
             "patent": "Patent CN 111507019 B"}
HEAD = """# Parameters of the estimators

Made by `docs/tools/parameters.py` from the `params!` lists in `estimators/src/`. A scenario sets a parameter by its name:
`estimators: {dffrls_aekf_robust: {mass_sd: 0.2, square_root: true, acceleration: kinematic}}`. A value outside its range, of another kind, or a name
that is not there, is an error. A dash for a default: not set, what the estimator then takes stands beside it.
"""

FILES = sorted(f for f in SOURCE.rglob("*.rs") if f.relative_to(SOURCE).parts[0] not in ("api", "testing", "behaviour"))


def choices() -> dict[str, dict[str, str]]:
    """Choices declared anywhere: enum name -> variant -> word."""
    found = {}
    for file in FILES:
        for body in re.findall(r"choices! \{\n(.*?)\n\}\n", file.read_text(), re.S):
            name = re.search(r"^    (\w+) \{$", body, re.M).group(1)
            found[name] = dict(re.findall(r'(\w+) = "(\w+)",', body))
    return found


CHOICES = choices()


def rows(body: str) -> list:
    """The parameters of a group in their order: name, unit, default, range, what it is."""
    found = []
    for m in NUMBER.finditer(body):
        name, unit, default, low, high, about = m.groups()
        default = "–" if default == "none" else default.strip()
        found.append((m.start(), name, "1" if unit == "-" else unit, default, f"{low} … {high}", about))
    for m in FLAG.finditer(body):
        name, default, about = m.groups()
        found.append((m.start(), name, "", default, "true, false", about))
    for m in CHOICE.finditer(body):
        name, kind, default, about = m.groups()
        words = CHOICES[kind]
        found.append((m.start(), name, "", words[default], ", ".join(words.values()), about))
    return [row[1:] for row in sorted(found)]


def groups_of(file: Path) -> dict[str, tuple[str, list]]:
    """Groups declared in a file: struct name -> what it is, parameters."""
    found = {}
    for doc, name, body in re.findall(r"params! \{\s*/// (.*?)\n\s*(\w+) \{(.*?)\n    \}\n\}", file.read_text(), re.S):
        found[name] = (doc, rows(body))
        if len(found[name][1]) != body.count("] = "):
            sys.exit(f"{file}: a parameter of {name} is written in a way this script does not read")
    return found


def declared() -> dict[str, tuple[Path, list[str]]]:
    """Pipelines: `folder/module` -> its file and the structs of its groups, in order.

    Three ways to declare one: `param_groups!` in a file of its own, a row of `variants!` or of `methods!` in the file of a source."""
    found = {}
    fields = lambda text: re.findall(r"\w+: (\w+)", text)
    for file in FILES:
        folder, text = file.parent.name, file.read_text()
        for module, groups in re.findall(r"^    (\w+): \w+ = [^;]*?,\s*\{ (.*?) \},", text, re.M | re.S):
            found[f"{folder}/{module}"] = (file, fields(groups))
        for module, groups in re.findall(r"^    (\w+)::\w+\(([^)]*)\)\s*= \|", text, re.M):
            found[f"{folder}/{module}"] = (file, fields(groups))
        own = re.search(r"param_groups! \{\s*/// [^\n]*\n    Params \{ (\w+: \w+(?:, \w+: \w+)*),? \}", text)
        if own:
            found[f"{folder}/{file.stem}"] = (file, fields(own.group(1)))
    return found


def home(file: Path, struct: str, groups: dict) -> Path:
    """The file that declares a group that a pipeline uses: its own, or the one it imports the group from."""
    if struct in groups[file]:
        return file
    imported = re.search(rf"use crate::([\w:]+)::(?:\{{[^}}]*\b{struct}\b[^}}]*\}}|{struct});", file.read_text())
    module = SOURCE / imported.group(1).replace("::", "/") if imported else file
    for path in (module.with_suffix(".rs"), module / "mod.rs"):
        if struct in groups.get(path, {}):
            return path
    sys.exit(f"{file}: the group {struct} is not declared in {module}")


def main() -> None:
    groups = {file: groups_of(file) for file in FILES}
    pipelines = declared()
    registry = re.findall(r'^    "(\w+)"(?: in "\w+")?(?: as \w+)? => (\w+)::', (SOURCE / "registry.rs").read_text(), re.M)
    users: dict[tuple[Path, str], list[str]] = {}
    for name, module in registry:
        folder = "published" if name.endswith("_printed") else "pipelines"
        file, structs = pipelines.get(f"{folder}/{module}") or sys.exit(f"{name}: no parameters of {folder}/{module} found")
        for struct in structs:
            users.setdefault((home(file, struct, groups), struct), []).append(name)
    page = HEAD
    for (file, struct), names in users.items():
        doc, parameters = groups[file][struct]
        # The first sentence is the heading, the rest a paragraph.
        title, *rest = re.split(r"(?<!eq)\. (?=[A-Z])", re.sub(r"\s*\n\s*///\s*", " ", doc), maxsplit=1)
        title = title.rstrip(".")
        if file.parent.name == "pipelines" and file.stem in PUBLISHED:
            title = f"{PUBLISHED[file.stem]}: {title[0].lower()}{title[1:]}"
        page += f"\n## {title}\n\n" + "".join(f"{text}\n\n" for text in rest)
        page += f"Of {', '.join(f'`{name}`' for name in names)}.\n\n"
        page += "| parameter | unit | default | range | meaning |\n|---|---|---|---|---|\n"
        for name, unit, default, range_, about in parameters:
            page += f"| `{name}` | {unit} | {default} | {range_} | {about.replace('|', chr(92) + '|')} |\n"
    if "--check" in sys.argv[1:]:
        sys.exit(0 if PAGE.read_text() == page else f"{PAGE} is not up to date: run docs/tools/parameters.py")
    PAGE.write_text(page)


main()
