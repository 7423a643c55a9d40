#!/usr/bin/env python3
"""Prints the yardstick of two estimators: named scenarios, drawn courses, drawn faults on drawn courses.

    docs/tools/yardstick.py PROGRAM [--out out/yardstick] [--seeds 1001..1020] [--courses 200] [--faults 1000]

An hour and a half on two cores. A result that is in the folder is read and not made again. Errors, deviations and
shares of what misleads are those of valid samples from 5 s on: means over runs, and of drawn faults over all samples.
"""

import argparse
import json
import statistics
import subprocess
from pathlib import Path

ESTIMATORS = ["rail_fusion", "dffrls_aekf_robust"]
FIRST_COURSE = 8001
QUANTITIES = {
    "slope": ("slope_rmse_deg_valid", "slope_sd_mean_deg_valid", 1, "°"),
    "effective slope": ("effective_slope_rmse_deg_valid", "effective_slope_sd_mean_deg_valid", 1, "°"),
    "mass": ("mass_rmse_rel_valid", "mass_sd_rel_mean_valid", 100, " %"),
}


def made(path, *command):
    """What a command writes into this file, made only once; exit code 1 is a verdict."""
    if not path.exists():
        done = subprocess.run([*map(str, command), "--json", str(path)], stdout=subprocess.DEVNULL)
        if done.returncode not in (0, 1):
            raise SystemExit(f"exit code {done.returncode}: {' '.join(map(str, command))}")
    return json.loads(path.read_text())


def of_suite(suite):
    summaries = (run.get("summary") or {} for scenario in suite["scenarios"] for run in scenario["runs"])
    return [summary.get("estimators", {}) for summary in summaries]


def mean(runs, metric):
    values = [run[metric] for run in runs if run.get(metric) is not None]
    return statistics.mean(values) if values else None


def row(runs, quantity, estimator, figures, factor, unit):
    """A row of the table; figures: error, deviation, NEES, and three shares."""
    scales = [(factor, 2, unit), (factor, 2, unit), (1, 2, ""), *[(100, 2, " %")] * 3]
    cells = ["–" if x is None else f"{scale * x:.{digits}f}{of}" for x, (scale, digits, of) in zip(figures, scales)]
    print(f"| {runs} | {quantity} | `{estimator}` | " + " | ".join(cells) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--out", type=Path, default=Path("out/yardstick"))
    parser.add_argument("--seeds", default="1001..1020")
    parser.add_argument("--courses", type=int, default=200)
    parser.add_argument("--faults", type=int, default=1000)
    given = parser.parse_args()
    program, out = given.program.resolve(), given.out
    out.mkdir(parents=True, exist_ok=True)
    named = of_suite(made(out / "named.json", program, "test", "scenarios", "--seeds", given.seeds))
    courses = out / "courses"
    if not courses.exists():
        draw = ["new", "courses", "--seed", FIRST_COURSE, "--count", given.courses, "--out", courses]
        subprocess.run([program, *map(str, draw)], check=True, stdout=subprocess.DEVNULL)
    drawn = of_suite(made(out / "courses.json", program, "test", courses))
    stress = ["stress", "--drawn", given.faults, "--estimators", ",".join(ESTIMATORS), "--out", out / "faults"]
    faults = made(out / "faults.json", program, *stress)

    print("| runs | quantity | estimator | error | told σ | NEES | valid | misleading | beyond the alert limit |")
    print("|---|---|---|---|---|---|---|---|---|")
    for words, runs in [("named scenarios", named), ("drawn courses", drawn)]:
        for quantity, (error, sd, factor, unit) in QUANTITIES.items():
            name = quantity.replace(" ", "_")
            for estimator in ESTIMATORS:
                of = [run[estimator] for run in runs if estimator in run]
                figures = [mean(of, m) for m in (error, sd, f"{name}_nees_mean_valid", f"{name}_availability")]
                figures += [mean(of, f"{name}_{share}") for share in ("misleading_share", "beyond_limit_share")]
                row(f"{len(of)} {words}", quantity, estimator, figures, factor, unit)
    for quantity, (_, _, factor, unit) in QUANTITIES.items():
        for of in faults["summary"]["estimators"]:
            found = of["all"][quantity.replace(" ", "_")]
            figures = [found["error"], found["sd"], None, *(found[k] for k in ("valid", "misleading", "beyond"))]
            row(f"{of['all']['runs']} drawn faults", quantity, of["all"]["estimator"], figures, factor, unit)


if __name__ == "__main__":
    main()
