"""Makes data/: drives the MuJoCo train and records torque, brake and what it does; or compares with what is there: make.py [--check].

Each case in CASES is a track, a load and a drive of its own. Without --check a speed controller of this file drives and its torques are
recorded, so that they come from no run of monorig; with --check the recorded torques drive. Torque and brake are linear between rows.
"""

import argparse
import csv
import sys
from multiprocessing import Pool
from pathlib import Path

import numpy as np

from model import Train
from rail import Rail

HERE = Path(__file__).resolve().parent
TRAIN = HERE / "../../../assets/trains/dx80_176y.yaml"
DT, ROW = 1e-3, 0.05
COLUMNS = ["time_s", "motor_torque_nm", "brake", "speed_mps", "chainage_m", "traction_n", "resistance_n", "brake_n", "sway_longitudinal_rad", "sway_lateral_rad"]
FRONT = 20.5
MAX_TORQUE, GAIN, INTEGRAL = 85.0, 25.0, 12.0
# name: track, load kg, seconds, speed reference (time, m/s), brake (time, command)
CASES = {
    "climb": ("climb", 10_000.0, 30.0, [(2, 0), (7, 0.7), (30, 0.7)], [(0, 1), (1, 1), (1.5, 0)]),
    "bends": ("bends", 10_000.0, 46.0, [(2, 0), (5, 0.9), (46, 0.9)], [(0, 1), (1, 1), (1.5, 0)]),
    "crest": ("crest", 5_000.0, 40.0, [(2, 0), (7, 0.8), (40, 0.8)], [(0, 1), (1, 1), (1.5, 0)]),
    "swing": ("level", 15_000.0, 25.0, [(2, 0), (3, 0.8), (4, 0.4), (5, 1.0), (6, 0.5), (7, 1.0), (25, 1.0)], [(0, 1), (1, 1), (1.5, 0)]),
    "parking": ("parking", 10_000.0, 30.0, [(2, 0), (6, 0.5), (15, 0.5), (18, 0)], [(0, 1), (1, 1), (1.5, 0), (14, 0), (15, 0.6), (30, 0.6)]),
}
# torque without control, by time: on a slope the motors hold the train while the brake comes off
HOLD = {"climb": 30.5, "crest": 28.0, "parking": 56.7}
# no torque from here on, s
OFF = {"parking": 15.0}
# Largest difference of a new run: other processors round otherwise, and stiff springs make more of it.
ALLOWED = 1e-4


def control(name, t, speed, integral):
    """Torque for the next row, and the integral of the speed error."""
    reference = np.interp(t, *zip(*CASES[name][3]))
    hold = HOLD.get(name, 0.0) * np.interp(t, [0.8, 1.2], [0.0, 1.0])
    if t < 1.5:
        return hold, 0.0
    if t >= OFF.get(name, np.inf):
        return 0.0, 0.0
    error = reference - speed
    integral += error * ROW
    return float(np.clip(hold + GAIN * error + INTEGRAL * integral, -MAX_TORQUE, MAX_TORQUE)), integral


def run(name, recorded=None):
    """Rows of a case, driven by the recorded torques or, without, by the controller."""
    track, load, seconds, _, brake = CASES[name]
    train = Train(TRAIN, Rail(HERE / "tracks" / f"{track}.yaml"), load, FRONT, DT)
    train.settle()
    rows, sums = [], np.zeros(3)
    torque, integral, per_row = 0.0, 0.0, round(ROW / DT)
    for k in range(round(seconds / ROW) + 1):
        t = k * ROW
        speed, s, along, across = train.state()
        command = float(np.interp(t, *zip(*brake)))
        rows.append([t, torque, command, speed, s, *(sums / per_row), along, across])
        after = recorded[min(k + 1, len(recorded) - 1)] if recorded is not None else None
        if after is None:
            following, integral = control(name, t, speed, integral)
            following = round(following, 3)
            then = round(float(np.interp(t + ROW, *zip(*brake))), 4)
        else:
            following, then = after[1], after[2]
        sums = np.zeros(3)
        for j in range(per_row):
            share = (j + 0.5) / per_row
            sums += train.step(torque + share * (following - torque), command + share * (then - command))
        torque = following
    return rows


def read(path):
    with path.open() as file:
        return np.array([[float(x) for x in row] for row in list(csv.reader(file))[1:]])


def write(path, rows):
    formats = ["{:.2f}", "{:.3f}", "{:.4f}", "{:.6f}", "{:.6f}", "{:.1f}", "{:.1f}", "{:.1f}", "{:.6f}", "{:.6f}"]
    lines = [",".join(COLUMNS)] + [",".join(f.format(x) for f, x in zip(formats, row)) for row in rows]
    path.write_text("\n".join(lines) + "\n")


def check(name):
    kept = read(HERE / "data" / f"{name}.csv")
    made = np.array(run(name, kept))
    scale = np.maximum(np.abs(kept).max(0), 1e-3)
    return name, float((np.abs(made - kept).max(0) / scale).max()) if made.shape == kept.shape else np.inf


def make(name):
    write(HERE / "data" / f"{name}.csv", run(name))
    return name, 0.0


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--check", action="store_true", help="compare with data/ instead of writing it")
    arguments.add_argument("--case", choices=list(CASES), help="this case only")
    given = arguments.parse_args()
    names = [given.case] if given.case else list(CASES)
    worst = 0.0
    with Pool() as pool:
        for name, off in pool.imap(check if given.check else make, names):
            worst = max(worst, off)
            print(f"{name:10} {f'{off:.1e}' if given.check else 'written'}{'' if off <= ALLOWED else '  DIFFERS'}", flush=True)
    sys.exit(0 if worst <= ALLOWED else 1)


if __name__ == "__main__":
    main()
