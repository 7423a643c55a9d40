"""Makes docs/notes/published.md: every published table beside ours. Its summary in the book is docs/src/published.md.

    python3 docs/tools/published.py path/to/monorig

Runs `monorig compare` over the scenarios below (some minutes on two cores), with every method as published and, of one, supervised, and
writes the rows with a published figure, as the scenarios name them (`published`). The text above the tables is in
published.md beside this program. Needs PyYAML.
"""

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[2]
# The methods compared in every scenario of Liu et al. 2023; elsewhere those of the scenario.
ALL = ("dffrls_aekf,rls_ekf,ffrls,joint_ekf,dffrls_aukf,dffrls_ukf,dffrls_aekf_inclination,ffrls_aukf,rls_mff_aukf,"
       "imm_stf,imm_stf_fixed,imm_ekf,kinematic_stf,dynamic_stf,mmrls_sh_stf").split(",")
LIU = ["mass_rmse_kg", "slope_rmse_deg"]
HUAINAN = ["slope_mae_deg", "slope_rmse_deg"]
GUO = ["slope_rmse_percent", "slope_error_max_percent", "mass_rmse_kg", "mass_error_converged_max_kg"]
CASES = ["ramp_8", "ramp_12", "ramp_20", "ramp_29", "ramp_20_8", "ramp_29_12", "5_turning", "flat_turning"]
SETS = [
    ("Liu et al. 2023, table 1 (section 1)", "liu2023_section1", ALL, "1..20", LIU),
    ("Liu et al. 2023, table 2 (section 2)", "liu2023_section2", ALL, "1..20", LIU),
    ("Liu et al. 2023, table 4 (vehicle test)", "liu2023_vehicle_test", ALL, "1..20", LIU),
    ("DFFRLS-AUKF paper, table 2 (section 1)", "huainan_section1", None, "1..20", HUAINAN),
    ("DFFRLS-AUKF paper, table 3 (section 2)", "huainan_section2", None, "1..20", HUAINAN),
] + [(f"Guo et al. 2024, table 2 ({case.replace('_', ' ')})", f"guo2024_{case}", None, "1..20", GUO) for case in CASES]


def parameters(program, name):
    """Names of the parameters of an estimator, as the program prints them."""
    listed = subprocess.run([program, "list", "parameters", name], check=True, capture_output=True, text=True).stdout
    return set(re.findall(r"^(\w+)", listed, re.M))


def forms(method):
    """The names of a method: as published and, of one, supervised."""
    return [method, *([f"{method}_robust"] if method == "dffrls_aekf" else [])]


def numbers(value):
    """Floats that YAML 1.1 takes for text, such as 1e-4, as numbers."""
    if isinstance(value, dict):
        return {key: numbers(v) for key, v in value.items()}
    if isinstance(value, list):
        return [numbers(v) for v in value]
    if isinstance(value, str) and re.fullmatch(r"[-+]?[\d.]+e[-+]?\d+", value):
        return float(value)
    return value


def with_all_forms(program, scenario, methods, folder):
    """The scenario with every form of its methods, in a file of its own; and their names."""
    file = numbers(yaml.safe_load((ROOT / "scenarios" / f"{scenario}.yaml").read_text()))
    for key in ("track", "train", "car", "sensors"):
        if key in file:
            file[key] = str((ROOT / "scenarios" / file[key]).resolve())
    given = file["estimators"]
    methods = methods or [name.removesuffix("_robust") for name in given]
    names = []
    for method in dict.fromkeys(methods):
        settings = given.get(f"{method}_robust", given.get(method, {}))
        for name in forms(method):
            names.append(name)
            given.setdefault(name, {k: v for k, v in settings.items() if k in parameters(program, name)})
    # What was published is of the method, in whatever form.
    for entry in list(file.get("published", [])):
        method = entry["estimator"].removesuffix("_robust")
        entries = [{**entry, "estimator": name} for name in forms(method) if name in names]
        file["published"] = [e for e in file["published"] if e is not entry] + entries
    for judged in ("expect", "known_failures", "availability"):
        file.pop(judged, None)
    path = Path(folder) / f"{scenario}.yaml"
    path.write_text(json.dumps(file))
    return path, names


def compare(program, scenario, methods, seeds, metrics, folder):
    file, names = with_all_forms(program, scenario, methods, folder)
    out = Path(folder) / f"{scenario}.json"
    command = [program, "compare", str(file), "--set", "vehicle.exact.all=as in the papers", "--seeds", seeds, "--metrics", ",".join(metrics), "--json", str(out),
               "--estimators", ",".join(names)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return json.loads(out.read_text())["table"]


def number(x):
    return "–" if x is None else f"{x:.3g}" if abs(x) < 1000 else f"{x:.0f}"


def on_valid(valid, runs):
    """The error on the samples marked valid, and how many of all these are."""
    share = valid["share"] or 0
    if not valid["mean"]:
        return f"valid {share:.0%}"
    some = f", {valid['measured']}/{runs} runs" if valid["measured"] < runs else ""
    return f"valid {share:.0%}: {number(valid['mean']['mean'])}{some}"


def table(cells, metrics):
    rows = {}
    for cell in cells:
        rows.setdefault(cell["estimator"], {})[cell["metric"]] = cell
    yield "| estimator | " + " | ".join(f"`{m}`" for m in metrics) + " |"
    yield "|---" * (len(metrics) + 1) + "|"
    for name, row in rows.items():
        if not any(cell.get("published") for cell in row.values()):
            continue
        columns = []
        for metric in metrics:
            cell = row[metric]
            mean, published = cell["mean"], (cell.get("published") or {}).get("value")
            text = "–"
            if mean and cell["measured"]:
                text = f"{number(mean['mean'])} ({number(mean['low'])} … {number(mean['high'])})"
                if cell["measured"] < cell["runs"]:
                    text += f", {cell['measured']}/{cell['runs']} runs"
            if cell["valid"]:
                text += "; " + on_valid(cell["valid"], cell["runs"])
            if published is not None:
                text += f"; published **{number(published)}**"
            columns.append(text)
        yield f"| `{name}` | " + " | ".join(columns) + " |"


def main():
    text = (Path(__file__).with_name("published.md")).read_text()
    with tempfile.TemporaryDirectory() as folder:
        for title, scenario, methods, seeds, metrics in SETS:
            cells = compare(sys.argv[1], scenario, methods, seeds, metrics, folder)
            text += f"\n## {title}\n\n`scenarios/{scenario}.yaml`, seeds {seeds}.\n\n" + "\n".join(table(cells, metrics)) + "\n"
    (ROOT / "docs/notes/published.md").write_text(text)


main()
