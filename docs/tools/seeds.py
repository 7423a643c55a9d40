#!/usr/bin/env python3
"""Says how many seeds the verdict of each scenario needs, from runs over seeds that no verdict uses, and writes fewer.

    monorig test scenarios --seeds 1001..1006 --json calibration.json
    docs/tools/seeds.py calibration.json [MORE.json ...] -- scenarios/*.yaml scenarios/harsh/*.yaml

One seed, if every run by itself gives every check the verdict of all runs, and every figure is two standard deviations
of the runs or more away from its bound. Two, if pairs of runs give another verdict in at most 1 % of the checks. Else as
many as the scenario has. `-n` in place of `--` writes nothing. Measured: docs/notes/verdicts.md.
"""

import itertools
import json
import math
import re
import statistics
import sys
from collections import defaultdict
from pathlib import Path

WIDTHS = 2.0
LEAST_RUNS = 4
DISAGREE = 0.01


class Check:
    """One check of a scenario: a figure of each run, its bound, and how they are judged over several runs."""

    def __init__(self, bound, sign, share):
        self.bound, self.sign, self.share = bound, sign, share
        self.runs = []  # (figure over weight, weight); figure None where it could not be measured

    def holds(self, chosen):
        if self.share is None:  # misleading samples are pooled
            weight = sum(self.runs[i][1] for i in chosen)
            return weight == 0 or sum(self.runs[i][0] or 0 for i in chosen) <= self.bound * weight
        good = [self.runs[i][0] is not None and self.sign * (self.bound - self.runs[i][0]) >= 0 for i in chosen]
        return sum(good) >= max(self.share * len(good) - 1e-9, 1)

    def widths(self):
        """Distance of the bound from the mean of the runs, in standard deviations of the runs."""
        figures = [None if x is None else x / weight for x, weight in self.runs if weight]
        if len(set(figures)) < 2:
            return math.inf
        if None in figures:
            return 0.0
        return abs(self.bound - statistics.mean(figures)) / statistics.stdev(figures)


def checks(runs):
    """The checks of a scenario over these summaries. A known failure is judged by how bad it is known to be."""
    found = {}
    for run in runs:
        for i, e in enumerate(run["expectations"]):
            sign = 1 if e["at_most"] is not None else -1
            bound = e["at_most"] if sign > 0 else e["at_least"]
            if e.get("known_failure"):
                bound = e["no_worse_than"]
            share = 1.0 if e["quantile"] is None else e["quantile"]
            found.setdefault(i, Check(bound, sign, share)).runs.append((e["value"], 1))
        for g in run["integrity"]:
            if g["at_most"] is not None:
                known = 1.0 if g.get("no_worse_than") is None else g["no_worse_than"]
                bound = known if g.get("known_failure") else g["at_most"]
                key = (g["estimator"], g["quantity"])
                found.setdefault(key, Check(bound, 1, None)).runs.append((g["misleading"], g["judged"]))
    return [c for c in found.values() if len(c.runs) == len(runs)]


def disagreement(all_checks, runs, seeds):
    """Share of the checks to which so many seeds give another verdict than all runs, over all choices of them."""
    choices = list(itertools.combinations(range(runs), seeds))
    other = sum(c.holds(chosen) != c.holds(range(runs)) for c in all_checks for chosen in choices)
    return other / (len(choices) * len(all_checks))


def needed(all_checks, runs, has):
    """Seeds that the verdict needs, at most those that the scenario has."""
    if runs < LEAST_RUNS or not all_checks:
        return has
    if disagreement(all_checks, runs, 1) == 0 and min(c.widths() for c in all_checks) >= WIDTHS:
        return 1
    return min(has, 2) if disagreement(all_checks, runs, 2) <= DISAGREE else has


def main():
    arguments = sys.argv[1:]
    at = next((i for i, x in enumerate(arguments) if x in ("--", "-n")), None)
    if not at:
        sys.exit(__doc__)
    runs = defaultdict(dict)
    for path in arguments[:at]:
        for scenario in json.loads(Path(path).read_text())["scenarios"]:
            for run in scenario["runs"]:
                if run.get("summary"):
                    runs[scenario["scenario"]][run["seed"]] = run["summary"]
    for path in map(Path, arguments[at + 1 :]):
        of = list(runs.get(path.stem, {}).values())
        text = path.read_text()
        line = re.search(r"^seeds: 1(?:\.\.(\d+))?$", text, re.M)
        if not line or not of:
            continue
        has = int(line[1] or 1)
        found = checks(of)
        seeds = needed(found, len(of), has)
        single, pairs = (100 * disagreement(found, len(of), n) for n in (1, 2))
        least = min(c.widths() for c in found)
        print(
            f"{path.stem:28} {len(of):2} runs, {len(found):2} checks: one differs in {single:4.1f} %, two in {pairs:4.1f} %,"
            f" {least:4.1f} widths; seeds {has} -> {seeds}"
        )
        if arguments[at] == "--" and seeds != has:
            new = "seeds: 1" if seeds == 1 else f"seeds: 1..{seeds}"
            path.write_text(text[: line.start()] + new + text[line.end() :])


if __name__ == "__main__":
    main()
