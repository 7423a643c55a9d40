"""The tables of docs/src/speed.md: `python3 docs/tools/speed.py target/release/monorig` prints them (some minutes).

All times are processor time of one core, as differences of a long and a short run, so that reading files and putting a train on
its rail are not counted. On a busy machine they grow all the same: compare figures of one call.
"""

import resource
import subprocess
import sys
import tempfile
from pathlib import Path

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"
ALONE = ["--set", "expect=[]", "--set", "known_failures=[]", "--set", "published=[]"]
BESIDE = ["--set", "drive.controller.feedforward=none", "--set", "estimators.complementary_filter={}", "--set", "in_loop=complementary_filter"]  # fmt: skip
RUNS = {
    "liu2023_section1": ("one drive unit, four of its six estimators", 60),
    "liu2023_vehicle_test": ("whole train, four estimators", 110),
    "winding": ("whole train, two estimators, bends of 4 m", 300),
}
KINDS = {"with `run.rrd`": [], "`--no-rerun`": ["--no-rerun"], "`--no-rerun --plant point-mass`": ["--no-rerun", "--plant", "point-mass"]}  # fmt: skip
TUNED = {
    "dffrls_aekf": ("delta: {from: 0.9, to: 0.9999}, sigma: {from: 0.05, to: 20, scale: log}", ""),
    "dffrls_aukf": ("delta: {from: 0.9, to: 0.9999}, sigma: {from: 0.05, to: 20, scale: log}", ""),
    "dffrls_aekf_robust": ("delta: {from: 0.9, to: 0.9999}, sigma: {from: 0.05, to: 20, scale: log}", ""),
    "rail_fusion": ("model_sd_mps2: {from: 0.0005, to: 0.01, scale: log}", ", parameters of the mass"),
}
TRIALS = (100, 300)


def cpu_s(*arguments: str) -> float:
    """Processor time of a command of the program."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([sys.argv[1], *arguments], capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode not in (0, 1):
        sys.exit(f"{' '.join(arguments)}: {done.stderr}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def second_s(scenario: str, length_s: float, out: str, more: list[str]) -> float:
    """Processor time of a simulated second of a run."""
    run = ["run", str(SCENARIOS / f"{scenario}.yaml"), "--out", out, *ALONE, *more]
    long, short = (cpu_s(*run, "--set", f"stop={{after_s: {length}}}") for length in (length_s, 0.3 * length_s))
    return (long - short) / (0.7 * length_s)


def trials_per_s(estimator: str, parameters: str, out: str) -> float:
    """Trials a second of a search over one run of the vehicle test."""
    runs = f"[{{scenario: {SCENARIOS}/liu2023_vehicle_test.yaml, set: {{drive.controller.feedforward: none}}, seeds: [%d]}}]"
    study = (
        f"version: 1\nwhy: How fast is a trial?\nestimator: {estimator}\nparameters: {{{parameters}}}\noptimiser: random\n"
        f"tuning: {runs % 1}\nvalidation: {runs % 2}\n"
        "objective: {metrics: [{metric: slope_rmse_deg, after_s: 10}, {metric: mass_rmse_kg, after_s: 10}]}\n"
    )
    took = []
    for budget in (*TRIALS[:1], *TRIALS):  # the first makes the recordings
        file = Path(out) / "study.yaml"
        file.write_text(study + f"budget: {budget}\n")
        took.append(cpu_s("tune", str(file), "--jobs", "1", "--restart", "--out", out, "--cache", f"{out}/cache"))
    return (TRIALS[1] - TRIALS[0]) / (took[2] - took[1])


def main() -> None:
    with tempfile.TemporaryDirectory() as out:
        print("| times real time |", " | ".join(KINDS), "|\n|---|" + "---|" * len(KINDS))
        for scenario, (what, length_s) in RUNS.items():
            row = [f"{1 / second_s(scenario, length_s, out, kind):.0f}" for kind in KINDS.values()]
            print(f"| `{scenario}`: {what} |", " | ".join(row), "|", flush=True)
        print("\n| what | of a run of the vehicle test without it |\n|---|---|")
        vehicle_test = lambda more: second_s("liu2023_vehicle_test", 110, out, ["--no-rerun", *BESIDE, *more])
        base = vehicle_test([])
        grown = {"steps of 2 ms in place of 4": ["--set", "physics.dt_ms=2"]}
        grown |= {f"`{e}` beside": ["--set", f"estimators.second={{is: {e}}}"] for e in ("dffrls_aekf", "dffrls_aekf_robust", "rail_fusion")}  # fmt: skip
        for what, more in grown.items():
            print(f"| {what} | {vehicle_test(more) / base:.2f} |", flush=True)
        print("\n| trials a second of a search, one run of 110 s | |\n|---|---|")
        for estimator, (parameters, which) in TUNED.items():
            print(f"| `{estimator}`{which} | {trials_per_s(estimator, parameters, out):.0f} |", flush=True)


if __name__ == "__main__":
    main()
