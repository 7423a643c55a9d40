"""Texts of the licences of all packages that are linked into a program or a library of ours.

usage: licences.py TO PACKAGE ...   file to write; packages such as monorig, monorig-python, monorig-c

The packages are those of Cargo.lock on this machine's target, without what only builds or tests. The same text is written once.
"""

import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
NAMES = re.compile(r"(?i)^(licen[cs]e|copying|copyright|notice|unlicense)")


def linked(metadata: dict, names: list[str]) -> list[dict]:
    """The packages below those of these names, without macros, which run in the compiler alone."""
    packages = {p["id"]: p for p in metadata["packages"]}
    nodes = {n["id"]: n for n in metadata["resolve"]["nodes"]}
    open_, seen = [i for i, p in packages.items() if p["name"] in names], set()
    if len(open_) != len(names):
        sys.exit(f"licences.py: not all of {', '.join(names)} are packages of this workspace")
    while open_:
        at = open_.pop()
        macro = any("proc-macro" in t["kind"] for t in packages[at]["targets"])
        if at in seen or macro:
            continue
        seen.add(at)
        deps = nodes[at]["deps"]
        open_ += [d["pkg"] for d in deps if any(k["kind"] is None for k in d["dep_kinds"])]
    found = (packages[i] for i in seen)
    return sorted((p for p in found if p["source"]), key=lambda p: (p["name"], p["version"]))


def texts(package: dict) -> list[str]:
    folder = pathlib.Path(package["manifest_path"]).parent
    files = sorted(f for f in folder.iterdir() if f.is_file() and NAMES.match(f.name) and f.suffix not in (".rs", ".toml"))
    return [f.read_text(encoding="utf-8", errors="replace").strip() for f in files]


def standard(package: dict) -> str:
    """The text of a licence that a package names and does not bring."""
    licence = package["license"] or ""
    if "Apache-2.0" in licence:
        return (ROOT / "LICENSE-APACHE").read_text(encoding="utf-8").strip()
    if "MIT" not in licence:
        sys.exit(f"licences.py: {package['name']} names {licence} and brings no text: add the text to this script")
    mit = (ROOT / "LICENSE-MIT").read_text(encoding="utf-8").strip().splitlines()
    mine = [f"Copyright (c) the authors of {package['name']}" if "Copyright (c)" in line else line for line in mit]
    return "\n".join(mine)


def main() -> None:
    to, *names = sys.argv[1:]
    host = subprocess.run(["rustc", "-vV"], capture_output=True, text=True, check=True).stdout
    target = re.search(r"host: (\S+)", host)
    done = subprocess.run(
        ["cargo", "metadata", "--format-version", "1", "--locked", "--filter-platform", target[1] if target else ""],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        check=True,
    )
    packages = linked(json.loads(done.stdout), names)
    by_text: dict[str, list[str]] = {}
    for p in packages:
        name = f"{p['name']} {p['version']} ({p['license'] or 'see its text'}; {p['repository'] or 'crates.io'})"
        for text in texts(p) or [standard(p)]:
            by_text.setdefault(text, []).append(name)
    rule = "=" * 100
    parts = [f"monorig is linked with the {len(packages)} packages below. Each text is that of the packages above it.\n"]
    for text, of in by_text.items():
        parts.append("\n".join([rule, *of, "", text, ""]))
    place = pathlib.Path(to)
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_text("\n".join(parts), encoding="utf-8")
    without = [p["name"] for p in packages if not texts(p)]
    print(f"{place}: {len(packages)} packages, {len(by_text)} texts, {place.stat().st_size / 1e6:.2f} MB; without a text: {', '.join(without)}")


main()
