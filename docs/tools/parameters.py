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


def file_of(module: str) -> Path:
    """The file of a pipeline."""
    return next(file for file in FILES if file.stem == module)


def main() -> None:
    shared = {name: group for file in FILES for name, group in groups_of(file).items() if name != "Own"}
    names = re.findall(r'^    "(\w+)" => (\w+)::', (SOURCE / "registry.rs").read_text(), re.M)
    users: dict[str, list[str]] = {}
    page, order = HEAD, []
    for name, module in names:
        file = file_of(module)
        groups = re.search(r"Params \{ (.*?) \}", file.read_text()).group(1)
        for group in (g.split(": ")[1] for g in groups.split(", ")):
            key = f"{module}.Own" if group == "Own" else group
            users.setdefault(key, []).append(name)
            if key not in order:
                order.append(key)
    for key in order:
        doc, parameters = groups_of(file_of(key.split(".")[0]))["Own"] if key.endswith(".Own") else shared[key]
        # The first sentence is the heading, the rest a paragraph.
        title, _, rest = re.sub(r"\s*\n\s*///\s*", " ", doc).partition(". ")
        page += f"\n## {title.rstrip('.')}\n\n" + (f"{rest}\n\n" if rest else "")
        page += f"Of {', '.join(f'`{u}`' for u in users[key])}.\n\n"
        page += "| parameter | unit | default | range | meaning |\n|---|---|---|---|---|\n"
        for name, unit, default, range_, about in parameters:
            page += f"| `{name}` | {unit} | {default} | {range_} | {about.replace('|', chr(92) + '|')} |\n"
    if "--check" in sys.argv[1:]:
        sys.exit(0 if PAGE.read_text() == page else f"{PAGE} is not up to date: run docs/tools/parameters.py")
    PAGE.write_text(page)


main()
