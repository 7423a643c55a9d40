#!/usr/bin/env python3
"""Writes an estimator's calibrated bounds into the scenarios, from runs over seeds that no verdict uses; or the floors of
known failures anew, from the seeds that the scenarios have.

    monorig test scenarios --seeds 1001..1020 --json calibration.json
    docs/tools/bounds.py rail_fusion calibration.json [MORE.json ...] -- scenarios/*.yaml scenarios/harsh/*.yaml
    monorig test scenarios --json today.json
    docs/tools/bounds.py floors today.json -- scenarios/*.yaml scenarios/harsh/*.yaml

A floor (`no_worse_than`) is 1.25 times the worst value of today, an availability that divided by it. A known failure that
no run shows any more is named, and stays for you to delete.

Every error and every scatter is bounded by 1.5 times its 80 % quantile over the calibration runs, every mean standard
deviation of valid samples by 1.25 times. Of the share of valid samples the 20 %
quantile is taken, and a fifth off, or a quarter more of what it lacks if that is stricter. Errors are root mean squares
from 5 s on: of all slopes, of valid masses, and of valid slopes only where fewer than half are valid. A quantity that is
valid in less than a twentieth of the time has no bound. The rule by which bounds are judged: docs/src/ci.md.
"""

import json
import math
import re
import sys
from pathlib import Path

MARGIN = 1.5
MARGIN_OF_SD = 1.25
QUANTILE = 0.8
LEAST_AVAILABILITY = 0.05
MOST_AVAILABILITY = 0.99
QUANTITIES = [
    ("mass_rmse_rel_valid", "mass_scatter_rel_valid", "mass_sd_rel_mean_valid", "mass_availability"),
    ("slope_rmse_deg", "slope_scatter_deg", "slope_sd_mean_deg_valid", "slope_availability"),
    (
        "effective_slope_rmse_deg",
        "effective_slope_scatter_deg",
        "effective_slope_sd_mean_deg_valid",
        "effective_slope_availability",
    ),
]
MARK = "  # Calibrated"


def quantile(values, share):
    """The least of the values that this share of them does not exceed; none if too many could not be measured."""
    ordered = sorted(math.inf if x is None else x for x in values)
    found = ordered[max(math.ceil(share * len(ordered) - 1e-9), 1) - 1]
    return found if math.isfinite(found) else None


def rounded_up(x):
    """With two significant digits."""
    if x == 0:
        return 0.0
    step = 10.0 ** (math.floor(math.log10(x)) - 1)
    return float(f"{math.ceil(x / step - 1e-9) * step:.12g}")


def bounds(estimator, runs):
    """Lines of the bounds over these runs."""
    of = lambda metric: [run["estimators"][estimator].get(metric) for run in runs]
    lines = []
    for error, scatter, sd, availability in QUANTITIES:
        valid = 1 - quantile([1 - (x or 0.0) for x in of(availability)], QUANTILE)
        least = max(valid / MARGIN_OF_SD, 1 - MARGIN_OF_SD * (1 - valid))
        share = min(math.floor(100 * least + 1e-9) / 100, MOST_AVAILABILITY)
        if share < 0.5 and not error.endswith("_valid"):
            error, scatter = f"{error}_valid", f"{scatter}_valid"
        for metric, margin in ((error, MARGIN), (scatter, MARGIN), (sd, MARGIN_OF_SD)):
            largest = quantile(of(metric), QUANTILE)
            if share >= LEAST_AVAILABILITY and largest is not None:
                bound = rounded_up(margin * largest)
                lines.append(
                    f"  - {{estimator: {estimator}, metric: {metric}, after_s: 5, at_most: {bound:g}, availability: {share:g}}}"
                )
    return lines


def ranges(seeds):
    """Seeds in words, such as `1001..1004, 2001`."""
    groups = []
    for seed in sorted(seeds):
        if groups and seed == groups[-1][1] + 1:
            groups[-1][1] = seed
        else:
            groups.append([seed, seed])
    return ", ".join(f"{a}" if a == b else f"{a}..{b}" for a, b in groups)


def written(text, estimator, runs):
    """The scenario with the bounds in it: the first lines of `expect`."""
    lines = text.splitlines()
    mark = f"{MARK}: {estimator}"
    kept, skipping = [], False
    for line in lines:
        if line.startswith(mark):
            skipping = True
        elif not (skipping and line.startswith(f"  - {{estimator: {estimator},")):
            skipping = False
            kept.append(line)
    new = bounds(estimator, runs)
    if not new:
        return "\n".join(kept) + "\n"
    seeds = ranges({run["seed"] for run in runs})
    words = f"{MARGIN} times the {100 * QUANTILE:.0f} % quantile, {MARGIN_OF_SD} times that of a standard deviation."
    new.insert(0, f"{mark} over seeds {seeds}, {words}")
    if "expect:" in kept:
        at = kept.index("expect:") + 1
    else:
        at = next((i for i, line in enumerate(kept) if re.match("known_failures:|published:", line)), len(kept))
        new.insert(0, "expect:")
    return "\n".join(kept[:at] + new + kept[at:]) + "\n"


def worst_of(runs, estimator, metric):
    """The worst value of a known failure over the runs, and whether it is bounded from above; none where nothing fails."""
    same = lambda e: e.get("known_failure") and e["estimator"] == estimator
    found = [e for run in runs for e in run["expectations"] if same(e) and e["metric"] == metric]
    above = all(e["at_most"] is not None for e in found)
    values = [e["value"] for e in found if not e["held"] and e["value"] is not None]
    shares = [e for run in runs for e in run["integrity"] if same(e) and f"{e['quantity']}_misleading_share" == metric]
    if sum(e["misleading"] for e in shares):
        share = sum(e["misleading"] for e in shares) / sum(e["judged"] for e in shares)
        values.append(max(share, shares[0]["at_most"]))
    return (max(values) if above else min(values), above) if values else None


def with_floors(path, runs):
    """The scenario with the floors of its known failures measured anew."""
    head, known, entries = path.read_text().partition("\nknown_failures:\n")
    entry = re.compile(r"(- estimator: (\S+)\n    metric: (\S+)\n(?:    \w+: [^\n]*\n)*?    no_worse_than: )(\S+)")

    def floor(match):
        worst = worst_of(runs, match[2], match[3])
        if worst is None:
            print(f"{path}: {match[2]}: {match[3]}: no run shows this known failure", file=sys.stderr)
            return match[0]
        value, above = worst
        return f"{match[1]}{rounded_up(value * MARGIN_OF_SD if above else value / MARGIN_OF_SD):g}"

    return head + known + entry.sub(floor, entries)


def main():
    files = sys.argv[2:]
    if "--" not in files or len(files) < 3:
        sys.exit(__doc__)
    estimator = sys.argv[1]
    at = files.index("--")
    runs = {}
    for path in files[:at]:
        for scenario in json.loads(Path(path).read_text())["scenarios"]:
            found = [run["summary"] for run in scenario["runs"] if run.get("summary")]
            has = lambda run: estimator == "floors" or estimator in run["estimators"]
            runs.setdefault(scenario["scenario"], []).extend(filter(has, found))
    for path in map(Path, files[at + 1 :]):
        of = runs.get(path.stem, [])
        if of:
            text = with_floors(path, of) if estimator == "floors" else written(path.read_text(), estimator, of)
            path.write_text(text)


if __name__ == "__main__":
    main()
