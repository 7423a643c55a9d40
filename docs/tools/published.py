"""Makes docs/src/published.md: every published table beside ours.

    python3 docs/tools/published.py path/to/monorig

Runs `monorig compare` over the scenarios below (some minutes on two cores) and writes their tables, published figures beside ours as
the scenarios name them (`published`). The text above the tables is in published.md beside this program.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ALL = ("dffrls_aekf_robust,rls_ekf_robust,ffrls_robust,joint_ekf_robust,dffrls_aukf_robust,dffrls_ukf_robust,dffrls_aekf_inclination_robust,ffrls_aukf_robust,rls_mff_aukf_robust,"
       "imm_stf_robust,imm_stf_fixed_robust,imm_ekf_robust,kinematic_stf_robust,dynamic_stf_robust,mmrls_sh_stf_robust")
LIU = ["mass_rmse_kg", "slope_rmse_deg", "slope_valid_share"]
HUAINAN = ["slope_mae_deg", "slope_rmse_deg"]
GUO = ["slope_rmse_percent", "slope_error_max_percent", "mass_rmse_kg", "mass_error_converged_max_kg"]
CASES = ["ramp_8", "ramp_12", "ramp_20", "ramp_29", "ramp_20_8", "ramp_29_12", "5_turning", "flat_turning"]
SETS = [
    ("Liu et al. 2023, table 1 (section 1)", "liu2023_section1", ALL, "1..50", LIU),
    ("Liu et al. 2023, table 2 (section 2)", "liu2023_section2", ALL, "1..50", LIU),
    ("Liu et al. 2023, table 4 (vehicle test)", "liu2023_vehicle_test", ALL, "1..50", LIU),
    ("DFFRLS-AUKF paper, table 2 (section 1)", "huainan_section1", None, "1..50", HUAINAN),
    ("DFFRLS-AUKF paper, table 3 (section 2)", "huainan_section2", None, "1..50", HUAINAN),
] + [(f"Guo et al. 2024, table 2 ({case.replace('_', ' ')})", f"guo2024_{case}", None, "1..50", GUO) for case in CASES]


def compare(program, scenario, estimators, seeds, metrics, folder):
    out = Path(folder) / f"{scenario}.json"
    command = [program, "compare", str(ROOT / "scenarios" / f"{scenario}.yaml"), "--seeds", seeds,
               "--metrics", ",".join(metrics), "--json", str(out)]
    if estimators:
        command += ["--estimators", estimators]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return json.loads(out.read_text())["table"]


def number(x):
    return "–" if x is None else f"{x:.3g}" if abs(x) < 1000 else f"{x:.0f}"


def table(cells, metrics):
    rows = {}
    for cell in cells:
        rows.setdefault(cell["estimator"], {})[cell["metric"]] = cell
    yield "| estimator | " + " | ".join(f"`{m}`" for m in metrics) + " |"
    yield "|---" * (len(metrics) + 1) + "|"
    for name, row in rows.items():
        columns = []
        for metric in metrics:
            cell = row[metric]
            mean, published = cell["mean"], (cell.get("published") or {}).get("value")
            text = "–"
            if mean and cell["measured"]:
                text = f"{number(mean['mean'])} ({number(mean['low'])} … {number(mean['high'])})"
                if cell["measured"] < cell["runs"]:
                    text += f", {cell['measured']}/{cell['runs']} runs"
            if published is not None:
                text += f"; published **{number(published)}**"
            columns.append(text)
        yield f"| `{name}` | " + " | ".join(columns) + " |"


def main():
    text = (Path(__file__).with_name("published.md")).read_text()
    with tempfile.TemporaryDirectory() as folder:
        for title, scenario, estimators, seeds, metrics in SETS:
            cells = compare(sys.argv[1], scenario, estimators, seeds, metrics, folder)
            text += f"\n## {title}\n\n`scenarios/{scenario}.yaml`, seeds {seeds}.\n\n" + "\n".join(table(cells, metrics)) + "\n"
    (ROOT / "docs/src/published.md").write_text(text)


main()
