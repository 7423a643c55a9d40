"""Collects what comes with the program: scenarios and what they name, templates, header and libraries, licences.

usage: share.py TO LIBRARIES [static]   new folder; folder with the libraries that cargo has built, such as target/release;
                                      with the static library, which is large

An archive has these files beside the program, a wheel and a package in PREFIX/share/monorig.
"""

import pathlib
import shutil
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
FILES = [
    "assets",
    "scenarios",
    "docs/schema",
    "examples/ecu",
    "examples/firmware_c",
    "examples/fmu",
    "examples/own_estimator",
    "examples/own_estimator_c",
    "examples/own_estimator_simulink",
    "interfaces/c/Makefile",
    "interfaces/c/include",
    "interfaces/python/examples",
    "LICENSE-APACHE",
    "LICENSE-MIT",
]
# what was made in these folders
MADE = shutil.ignore_patterns("target", "runs", "__pycache__", "*.so", "*.elf", "*.fmu", ".*_cache", "vehicle.h", "meshes.py")
C, FMU = "monorig_c", "monorig_fmu"
LIBRARIES = [f"lib{C}.so", f"lib{C}.dylib", f"{C}.dll", f"{C}.dll.lib", f"lib{FMU}.so", f"lib{FMU}.dylib", f"{FMU}.dll"]
STATIC = [f"lib{C}.a", f"{C}.lib"]


def main() -> None:
    to, libraries, *static = sys.argv[1:]
    for name in FILES:
        at = pathlib.Path(to, name)
        at.parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, at, ignore=MADE)
        else:
            shutil.copy(ROOT / name, at)
    lib = pathlib.Path(to, "lib")
    lib.mkdir()
    for name in LIBRARIES + (STATIC if static else []):
        file = pathlib.Path(libraries, name)
        if file.exists():
            shutil.copy(file, lib)
    # a program that was linked with the shared library looks for it by the number of the header
    shared = lib / f"lib{C}.so"
    if shared.exists():
        header = (ROOT / "interfaces/c/include/monorig_estimator.h").read_text(encoding="utf-8")
        number = header.split("#define MONORIG_ABI ")[1].split("u")[0]
        shutil.copy(shared, lib / f"{shared.name}.{number}")


main()
