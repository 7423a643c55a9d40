#!/usr/bin/env python3
"""Write the parameter tables of the book, docs/src/methods/parameters.md, from the tables in estimators/src/crane and printed.

    python docs/tools/parameters.py            # write
    python docs/tools/parameters.py --check    # exit code 1 if the file is not what would be written
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CRANE = ROOT / "estimators" / "src" / "crane"
PRINTED = ROOT / "estimators" / "src" / "printed"
PAGE = ROOT / "docs" / "src" / "methods" / "parameters.md"
# name ["unit"] = default, low => high, "what it is";
PARAMETER = re.compile(r'(\w+) \["([^"]*)"\] = ([^,]+), (\S+) => (\S+), "((?:[^"\\]|\\.)*)";')
HEAD = """# Parameters of the estimators

Made by `docs/tools/parameters.py` from the tables in `estimators/src/crane/` and `estimators/src/printed/`. A scenario sets a parameter by its name:
`estimators: {dffrls_aekf_robust: {mass_sd: 0.2}}`. A value outside its range, or a name that is not there, is an error.
"""


def groups_of(file: Path) -> dict[str, tuple[str, list]]:
    """Groups declared in a file: struct name -> what it is, parameters."""
    found = {}
    for doc, name, body in re.findall(r"params! \{\s*/// (.*?)\n\s*(\w+) \{(.*?)\n    \}\n\}", file.read_text(), re.S):
        found[name] = (doc, PARAMETER.findall(body))
        if len(found[name][1]) != body.count('["'):
            sys.exit(f"{file}: a parameter of {name} is written in a way this script does not read")
    return found


def file_of(module: str) -> Path:
    """The file of a pipeline."""
    return next(folder / f"{module}.rs" for folder in (CRANE, PRINTED) if (folder / f"{module}.rs").exists())


def main() -> None:
    files = [*sorted(CRANE.glob("*.rs")), *sorted(PRINTED.glob("*.rs"))]
    shared = {name: group for file in files for name, group in groups_of(file).items() if name != "Own"}
    names = re.findall(r'^    "(\w+)" => (\w+)::', (CRANE / "mod.rs").read_text(), re.M)
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
        page += f"\n## {doc.rstrip('.')}\n\nOf {', '.join(f'`{u}`' for u in users[key])}.\n\n"
        page += "| parameter | unit | default | range | meaning |\n|---|---|---|---|---|\n"
        for name, unit, default, low, high, about in parameters:
            page += f"| `{name}` | {'1' if unit == '-' else unit} | {default.strip()} | {low} … {high} | {about.replace('|', chr(92) + '|')} |\n"
    if "--check" in sys.argv[1:]:
        sys.exit(0 if PAGE.read_text() == page else f"{PAGE} is not up to date: run docs/tools/parameters.py")
    PAGE.write_text(page)


main()
