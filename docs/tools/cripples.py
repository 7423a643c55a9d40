#!/usr/bin/env python3
"""Says which inputs notice that a part of an estimator is switched off, or that it is told a wrong deviation.

    docs/tools/cripples.py PROGRAM [--seeds 1..5] [--courses 60] [--faults 100] [--from 1] [--out FOLDER]

Each change of VARIANTS runs as an estimator of its own beside `rail_fusion`, in the same runs: of the named scenarios with
their expectations, of drawn courses, of drawn faults on drawn courses. Printed, per change:

    worse   runs in which an error of valid samples is 5 % larger, an availability a point lower, or a tenth of a percent
            more of the valid samples mislead
    better  runs in which one of these is better by as much and none is worse
    fail    named scenarios with a check that fails for the change and holds without it

A part whose switching-off is never worse and never fails is noticed by nothing, and exit code 1 says so. Without a
fault in it an input cannot notice that a monitor is off; all three kinds of input together should.
"""

import argparse
import json
import re
import shutil
import subprocess
import sys
from collections import Counter, defaultdict
from pathlib import Path

ESTIMATOR = "rail_fusion"
FLAGS = (
    "gyro vertical_force force_fusion swing depth wait_for_rail noise_learning validity_gate nis_monitor "
    "plausibility slip_gate spike_gate accelerometer_gate separation torque_monitor"
).split()
VARIANTS = {f"{flag}_off": {flag: "false"} for flag in FLAGS} | {
    "lag_share_0": {"lag_share": "0"},
    "standing_load_s_off": {"standing_load_s": "1000000"},
    "length_sd_5_times": {"length_sd": "0.5"},
    "model_sd_10_times": {"model_sd_mps2": "0.016"},
    "resistance_sd_20th": {"resistance_sd": "0.02"},
    "mount_sd_twice": {"mount_sd_deg": "0.4"},
    "mount_sd_0": {"mount_sd_deg": "0"},
    "efficiency_sd_twice": {"efficiency_sd": "0.07"},
    "efficiency_sd_0": {"efficiency_sd": "0"},
    "radius_sd_0": {"radius_sd": "0"},
}
QUANTITIES = {"slope": "slope_rmse_deg_valid", "effective_slope": "effective_slope_rmse_deg_valid", "mass": "mass_rmse_rel_valid"}


def run(*command, **more):
    """Runs a command of the program; exit code 1 is a verdict, not a fault."""
    print("$", *command, file=sys.stderr)
    done = subprocess.run(command, **more)
    if done.returncode not in (0, 1):
        sys.exit(f"exit code {done.returncode}: {' '.join(map(str, command))}")


def with_variants(text):
    """A scenario with the changes beside the estimator, each with its expectations and known failures."""
    lines = []
    for line in text.splitlines():
        lines.append(line)
        if re.match(rf"  {ESTIMATOR}: \{{", line):
            for name, keys in VARIANTS.items():
                rest = line.split("{", 1)[1].rstrip("}")
                changed = ", ".join([f"is: {ESTIMATOR}"] + ([rest] if rest else []) + [f"{k}: {v}" for k, v in keys.items()])
                lines.append(f"  {name}: {{{changed}}}")
        elif re.search(rf"estimator: {ESTIMATOR}[,}}]", line) and line.rstrip().endswith("}"):
            lines += [line.replace(f"estimator: {ESTIMATOR}", f"estimator: {name}") for name in VARIANTS]
    return "\n".join(lines) + "\n"


def changed(whole, part):
    """Whether a run is worse (1), better (-1) or the same (0) with a part changed."""
    signs = set()
    for quantity, error in QUANTITIES.items():
        pair = lambda metric: (whole.get(metric), part.get(metric))
        for metric, gap in [(error, None), (f"{quantity}_availability", -0.01), (f"{quantity}_misleading_share", 0.001)]:
            a, b = pair(metric)
            if a is None or b is None:
                continue
            if gap is None:
                signs.add((b > 1.05 * a) - (a > 1.05 * b))
            else:
                more = (b - a) / gap
                signs.add((more > 1) - (more < -1))
    return 1 if 1 in signs else -1 if -1 in signs else 0


def runs_of_suite(path):
    for scenario in json.loads(path.read_text())["scenarios"]:
        for run in scenario["runs"]:
            yield (run.get("summary") or {}).get("estimators", {})


def failed_checks(path):
    """Scenarios in which a check holds for the estimator and fails for a change, by the change."""
    failing = defaultdict(set)
    for scenario in json.loads(path.read_text())["scenarios"]:
        held = {check["what"] + check["bound"]: check["held"] and "known_failure" not in check for check in scenario["checks"]}
        for what, good in held.items():
            first, _, rest = what.partition(" ")
            if first in VARIANTS and not good and held.get(f"{ESTIMATOR} {rest}"):
                failing[first].add(scenario["scenario"])
    return failing


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--seeds", default="1..5")
    parser.add_argument("--courses", type=int, default=60)
    parser.add_argument("--faults", type=int, default=100)
    parser.add_argument("--from", dest="first", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("out/cripples"))
    given = parser.parse_args()
    program, out = given.program.resolve(), given.out.resolve()
    shutil.rmtree(out, ignore_errors=True)
    for folder in ["scenarios", "assets"]:
        shutil.copytree(folder, out / folder)
    for path in (out / "scenarios").rglob("*.yaml"):
        text = path.read_text()
        if "/stress/" not in str(path) and re.search(rf"^  {ESTIMATOR}: \{{", text, re.M):
            path.write_text(with_variants(text))
        else:
            path.unlink()
    quiet = {"stdout": subprocess.DEVNULL, "cwd": out}
    named, drawn, faulty = out / "named.json", out / "drawn.json", out / "faulty.json"
    run(program, "test", "scenarios", "--seeds", given.seeds, "--json", named, **quiet)
    run(program, "new", "courses", "--seed", str(given.first), "--count", str(given.courses), "--out", out / "courses", **quiet)
    sets = [f"estimators.{name}={{is: {ESTIMATOR}, {', '.join(f'{k}: {v}' for k, v in keys.items())}}}" for name, keys in VARIANTS.items()]
    run(program, "test", out / "courses", *[x for s in sets for x in ("--set", s)], "--json", drawn, **quiet)
    names = ",".join([ESTIMATOR, *VARIANTS])
    run(program, "stress", "--drawn", str(given.faults), "--seed", str(given.first), "--estimators", names,
        *[x for s in sets for x in ("--set", s)], "--out", out / "faults", "--json", faulty, **quiet)

    inputs = {
        "named": list(runs_of_suite(named)),
        "courses": list(runs_of_suite(drawn)),
        "faults": [row["estimators"] for row in json.loads(faulty.read_text())["runs"]],
    }
    failing = failed_checks(named)
    print("| change | " + " | ".join(f"{k}: worse / better of {len(v)}" for k, v in inputs.items()) + " | fail |")
    print("|---" * (len(inputs) + 2) + "|")
    unnoticed = []
    for name in VARIANTS:
        cells, noticed = [], bool(failing[name])
        for runs in inputs.values():
            counts = Counter(changed(r[ESTIMATOR], r[name]) for r in runs if ESTIMATOR in r and name in r)
            noticed |= counts[1] > 0
            cells.append(f"{counts[1]} / {counts[-1]}")
        print(f"| {name} | " + " | ".join(cells) + f" | {len(failing[name])} |")
        if not noticed and name.endswith("_off"):
            unnoticed.append(name)
    if unnoticed:
        sys.exit("noticed by nothing: " + ", ".join(unnoticed))


if __name__ == "__main__":
    main()
