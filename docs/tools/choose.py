"""The two tables of docs/src/choose.md: `python3 docs/tools/choose.py target/release/monorig` prints them (3 minutes)."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

SCENARIOS = {
    "liu2023_section1": "",
    "liu2023_vehicle_test": "",
    "huainan_section2": "",
    "winding": ": bends of 4 m, crests of 10 m",
    "rail_joints": ": kinks and steps every 3 m",
    "loading_station": ": 12 t loaded at a standstill",
    "fault_off": ": instruments without samples",
    "harsh/mems_liu2023_vehicle_test": ": not calibrated",
    "harsh/harsh_liu2023_vehicle_test": ": not calibrated, shaken",
}
ESTIMATORS = ["rail_fusion", "no_gyro", "dffrls_aekf", "dffrls_aekf_robust", "ekf_v_theta_biases"]
METRICS = "slope_rmse_deg,slope_availability,mass_error_rel_end"


def compare(program: str, scenario: str) -> dict[tuple[str, str], float | None]:
    """Means over seeds 1 to 5 by estimator and metric; None where the metric has no value in some run."""
    root = Path(__file__).resolve().parents[2]
    with tempfile.NamedTemporaryFile(suffix=".json") as out:
        arguments = [
            program, "compare", str(root / "scenarios" / f"{scenario}.yaml"), "--seeds", "1..5", "--metrics", METRICS,
            "--set", "estimators.no_gyro.is=rail_fusion", "--set", "estimators.no_gyro.gyro=false",
            "--estimators", ",".join(ESTIMATORS), "--json", out.name,
        ]  # fmt: skip
        done = subprocess.run(arguments, capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{scenario}: {done.stderr}")
        table = json.load(open(out.name))["table"]
    whole = lambda row: row["mean"]["mean"] if row.get("mean") and row["measured"] == row["runs"] else None
    return {(row["estimator"], row["metric"]): whole(row) for row in table}


def two(value: float) -> str:
    """Two digits, the zeros too."""
    return f"{value:#.2g}".rstrip(".")


def main() -> None:
    slopes, masses = [], []
    for scenario, what in SCENARIOS.items():
        found = compare(sys.argv[1], scenario)
        name = f"| `{scenario.removeprefix('harsh/')}`{what} |"
        values = [found.get((e, "slope_rmse_deg")) for e in ESTIMATORS]
        best = min(float(f"{v:.2g}") for v in values if v is not None)
        for e, v in zip(ESTIMATORS, values):
            bold = "**" if v is not None and float(f"{v:.2g}") == best else ""
            share = found.get((e, "slope_availability"))
            name += " – |" if v is None else f" {bold}{two(v)}{bold} ({share:.0%}) |".replace("%", " %")
        slopes.append(name)
        name = f"| `{scenario.removeprefix('harsh/')}`{what} |"
        for e in ("rail_fusion", "dffrls_aekf_robust"):
            end = found.get((e, "mass_error_rel_end"))
            shown = "never valid" if end is None else f"{100 * end:.2g} %"
            name += f" {shown} |"
        masses.append(name)
    print("\n".join(slopes), "\n\n", "\n".join(masses), sep="")


main()
