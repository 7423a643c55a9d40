"""Makes every recorded input and every oracle's output in data/, or compares with what is there: make.py [--check].

Seeds are fixed. An oracle reads its input back from the CSV, so that both sides start from the same bits.
--check changes nothing: it makes everything anew in a folder that is thrown away, prints the largest difference of each file
relative to its size, and ends with 1 if one exceeds 1e-10 (other processors and linear-algebra libraries round otherwise).
"""

import argparse
import importlib
import sys
import tempfile
from pathlib import Path

import numpy as np
from common import DATA, read, write

# Seed of each oracle's input.
SEEDS = {
    "rls": 1, "ekf": 2, "ukf": 3, "sage_husa": 4, "strong_tracking": 5, "imm": 6, "smoothing": 7, "conditioning": 8,
    "published_liu": 9, "published_inertial": 10, "published_guo": 11, "published_patent": 12, "rls_near_equal": 13,
    "pipeline_liu": 14, "allan": 18, "pipeline_baseline": 19, "fusion": 20,
}
ALLOWED = 1e-10


def make(name, folder):
    """An oracle records an input of its own, or has that of another in `INPUT`. The files written."""
    oracle = importlib.import_module(name)
    source = getattr(oracle, "INPUT", name)
    if source == name:
        write(folder / f"{name}_input.csv", *oracle.record(np.random.default_rng(SEEDS[name])))
    write(folder / f"{name}_output.csv", *oracle.oracle(read(folder / f"{source}_input.csv")))
    return [f"{name}_{part}.csv" for part in (["input"] if source == name else []) + ["output"]]


def difference(made, kept):
    """Largest difference of two tables, relative to the number itself or, near a zero, to the median of its column."""
    if not kept.exists():
        return np.inf
    made, kept = read(made), read(kept)
    if list(made) != list(kept) or any(made[name].shape != kept[name].shape for name in made):
        return np.inf
    scale = {n: np.maximum(np.abs(kept[n]), np.median(np.abs(kept[n])) + 1e-300) for n in kept}
    return max(np.max(np.abs(made[n] - kept[n]) / scale[n]) for n in made)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--check", action="store_true", help="compare with data/ instead of writing it")
    check = arguments.parse_args().check
    worst = 0.0
    with tempfile.TemporaryDirectory() as scratch:
        borrows = lambda name: hasattr(importlib.import_module(name), "INPUT")
        for name in sorted(SEEDS, key=borrows):
            folder = Path(scratch) if check else DATA
            made = make(name, folder)
            for file in made if check else ():
                off = difference(folder / file, DATA / file)
                worst = max(worst, off)
                print(f"{file:32} {off:.1e}{'' if off <= ALLOWED else '  DIFFERS'}")
            if not check:
                print(f"{name}: {len(read(DATA / f'{name}_output.csv'))} columns written")
    sys.exit(0 if worst <= ALLOWED else 1)


if __name__ == "__main__":
    main()
