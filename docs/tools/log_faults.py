#!/usr/bin/env python3
"""Table of docs/notes/log_faults.md: faults planted in recorded logs, what `--check` says of each, and what estimators make of it.

    python3 docs/tools/log_faults.py PROGRAM > table.md        (from the project's folder; needs pyarrow)

The logs are a simulated train and a simulated car, exported as CSV; faults come from the map's `faults` or from the edited files.
"""
import csv
import glob
import math
import os
import shutil
import subprocess
import sys
import tempfile

import pyarrow.parquet as parquet

PROGRAM, HERE = os.path.abspath(sys.argv[1]), os.getcwd()
LOGS = {"train": ("scenarios/huainan_section1.yaml", []), "car": ("scenarios/guo2024_ramp_29_12.yaml", [])}
ESTIMATORS = {
    "train": ["attitude", "dffrls_aekf_robust", "rail_fusion"],
    "car": ["attitude", "dffrls_aekf_robust"],
}


def run(*words):
    return subprocess.run([PROGRAM, *words], capture_output=True, text=True)


def rows(name, change):
    """Edits a CSV file row by row, as lists of words; a row of None is left out."""
    with open(name, newline="") as file:
        head, *table = list(csv.reader(file))
    with open(name, "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(head)
        out.writerows(r for r in (change(head, r) for r in table) if r)


def late(ms):
    def change(head, row):
        return [str(int(x) + ms * 1_000_000) if h.endswith("_ns") else x for h, x in zip(head, row)]

    return change


def negative(head, row):
    return [x if h.endswith("_ns") else str(-float(x)) for h, x in zip(head, row)]


def gap(head, row):
    return None if 20 <= int(row[head.index("stamp_ns")]) * 1e-9 < 30 else row


def fault(channel, kind, from_s=20, to_s=40, **more):
    keys = {"from_s": from_s, "to_s": to_s, "channel": channel, "fault": kind, **more}
    return "faults=[{" + ", ".join(f"{k}: {v}" for k, v in keys.items() if v is not None) + "}]"


def whole(channel, kind, **more):
    return fault(channel, kind, 0, None, **more)


# name: changes to the map, and edited files
FAULTS = {
    "none": ([], []),
    "wheels frozen, 20 to 40 s": ([fault("wheel_speed", "stuck")], []),
    "specific force frozen, 20 to 40 s": ([fault("specific_force", "stuck")], []),
    "gyro frozen, 20 to 40 s": ([fault("angular_rate", "stuck")], []),
    "traction frozen, 20 to 40 s": ([fault("traction", "stuck")], []),
    "gyro axes x and y exchanged": ([whole("angular_rate", "axes_xy_swapped")], []),
    "gyro axes y and z exchanged": ([whole("angular_rate", "axes_yz_swapped")], []),
    "box pitched by 5°": (["channels.specific_force.mount_deg={pitch: 5}"], []),
    "box rolled by 8°": (["channels.specific_force.mount_deg={roll: 8}"], []),
    "forward axis drifts 0.01 m/s² a second": ([whole("specific_force", "drift", size=0.01)], []),
    "wheels 200 ms late": ([], [("wheel_speed.csv", late(200))]),
    "IMU 200 ms late": ([], [("specific_force.csv", late(200)), ("angular_rate.csv", late(200))]),
    "traction 200 ms late": ([], [("motor_torque.csv", late(200))]),
    "traction of the wrong sign": ([], [("motor_torque.csv", negative)]),
    "no IMU, 20 to 30 s": ([], [("specific_force.csv", gap), ("angular_rate.csv", gap)]),
    "gyro in deg/s": ([whole("angular_rate", "in_degrees")], []),
    "specific force in g": ([whole("specific_force", "in_g")], []),
    "speed in km/h": ([whole("wheel_speed", "km_per_h")], []),
}


def share(part, of):
    return "–" if not of else f"{100 * part / of:.0f}"


def figures(folder, name):
    """Of an estimator from 10 s after the start: shares valid, RMSE of the valid slope, error of the valid mass, misleading."""
    table = parquet.read_table(glob.glob(f"{folder}/*/1/channels.parquet")[0])
    of = lambda key: table[key].to_pylist()
    t, slope, mass = of("time"), of("truth/grade_at_imu"), of("truth/total_mass")
    at = lambda key: of(f"estimates/{name}/{key}")
    cells = []
    for key, truth, scale, alert in (("grade", slope, None, 1.0), ("total_mass", mass, 1.0, 10.0)):
        value, sd, valid = at(key), at(key + "_sd"), at(key + "_valid")
        n = good = wrong = 0
        squares = 0.0
        for i, time in enumerate(t):
            if time < t[0] + 10:
                continue
            n += 1
            if not valid[i] or truth[i] is None or math.isnan(truth[i]):
                continue
            good += 1
            unit = 180 / math.pi if scale is None else 100 / truth[i]
            error, doubt = abs(value[i] - truth[i]) * unit, (sd[i] or math.nan) * unit
            squares += error * error
            wrong += error > alert and not error <= 3 * doubt
        rms = "–" if not good else f"{math.sqrt(squares / good):.2f}"
        cells.append((share(good, n), rms, share(wrong, good)))
    return cells


def said(map_file, sets):
    """The first word of `--check` on the fault: BAD checks by their names."""
    out = run("log", "check", "--map", map_file, *sets).stdout
    bad = [line[6:].split(":")[0].split(" while")[0].replace("|", "¦") for line in out.splitlines() if line.startswith("BAD")]
    return bad


def main():
    base = tempfile.mkdtemp()
    os.chdir(base)
    for log, (scenario, sets) in LOGS.items():
        run("run", f"{HERE}/{scenario}", "--seed", "1", "--keep-samples", "--no-rerun", "-q", *sets)
        stem = os.path.basename(scenario)[:-5]
        run("log", "export", f"runs/{stem}/1", "--to", "csv", "-q")
        good = f"exports/{stem}/1/csv"
        sound = set()
        print(f"\n### {log}: `{scenario}`, seed 1\n")
        names = ESTIMATORS[log]
        print("| fault | `--check` says | " + " | ".join(names) + " |\n|" + "---|" * (len(names) + 2))
        for name, (changes, edits) in FAULTS.items():
            shutil.rmtree("log", ignore_errors=True)
            shutil.copytree(good, "log")
            for file, change in edits:
                rows("log/" + file, change)
            map_file = glob.glob("log/*.map.yaml")[0]
            sets = [w for c in changes for w in ("--set", c)]
            bad = said(map_file, sets)
            if name == "none":
                sound = set(bad)
            new = [b for b in bad if b not in sound]
            shutil.rmtree("out", ignore_errors=True)
            done = run("replay", "--map", map_file, "--no-rerun", "-q", "--out", "out", "--noise", "from-log", "--estimators", ",".join(names), *sets)
            cells = []
            for estimator in names:
                if done.returncode > 1:
                    cells.append("refused")
                    continue
                (a, b, c), (d, e, f) = figures("out", estimator)
                mass = f"; {d} %, {e} %, {f} %" if d != "0" else "; no mass"
                cells.append(f"{a} %, {b}°, {c} %{mass}")
            words = "; ".join(new[:3]) if new else ("(as sound)" if name != "none" else "; ".join(bad) or "nothing")
            print(f"| {name} | {words} | " + " | ".join(cells) + " |", flush=True)
            if done.returncode > 1:
                sys.stderr.write(f"{name}: {done.stderr[:300]}\n")
    shutil.rmtree(base)


main()
