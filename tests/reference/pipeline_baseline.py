"""`ekf_v_theta_biases` on a recorded drive: the textbook filter with both biases as states, and its gate.

x = [v, θ, b_g, b_a]: v⁻ = v + dt (f − b_a − g sin θ), θ⁻ = θ + dt (ω − b_g), b⁻ = b; z = v.
Gate: y²/S over 9 s², s² = max(1, running mean of min(y²/S, 4 s²) over 64 samples); beyond 1 a sample is rejected; after 0.5 s and three
samples of nothing else P of the speed grows by y² and the sample enters.
"""

import math

import numpy as np
from common import GRAVITY, jacobian

DT = 0.02
COLUMNS = ["fresh", "t", "f", "pitch", "speed"]
Q = np.diag([1e-4, 1e-6, 1e-11, 1e-8])
R = 0.02**2


def record(rng):
    """A start, a wavy track, bumps of one and two samples, and a shift of the speed that stays for two seconds."""
    rows, v, s = [], 0.0, 0.0
    for k in range(3000):
        t = DT * (k + 1)
        wanted = np.interp(t, [2, 6, 40, 44, 48, 52], [0, 1.2, 1.2, 0, 0, -0.8])
        a = (wanted - v) / DT
        v, s = wanted, s + wanted * DT
        theta, rate = 0.1 * math.sin(s / 5.0), 0.02 * math.cos(s / 5.0) * v
        f = a + GRAVITY * math.sin(theta) + 0.06 + 0.03 * rng.standard_normal()
        bump = 1.1 if k % 300 in (150, 220, 221) else 0.7 if 1500 <= k < 1600 else 0.0
        speed = v + bump + 0.015 * rng.standard_normal()
        pitch = rate - 0.012 + 0.002 * rng.standard_normal()
        rows.append([k % 2 == 0, *np.round([t, f, pitch, speed], 6)])
    return COLUMNS, rows


def oracle(table):
    x, P = np.zeros(4), np.diag([0.02, math.radians(5.0), 0.01, 0.05]) ** 2
    scale, rejected, rejecting, since, started = 1.0, 0, 0.0, 0.0, False
    y = nis = 0.0
    rows, seen = [], {"rejected": 0, "reopened": 0}
    for k, (fresh, _, f, pitch, speed) in enumerate(np.column_stack([table[name] for name in COLUMNS])):
        step = lambda x: np.array([x[0] + DT * (f - x[3] - GRAVITY * np.sin(x[1])), x[1] + DT * (pitch - x[2]), x[2], x[3]])
        F = jacobian(step, x)
        x, P = step(x), F @ P @ F.T + Q * DT
        since += DT
        if fresh:
            if not started:
                x[0], started = speed, True
            y = speed - x[0]
            nis = y**2 / (P[0, 0] + R)
            ratio = nis / (9.0 * max(scale, 1.0))
            scale = max(scale + (min(nis, 4.0 * scale) - scale) / 64.0, 1e-3)
            enters = ratio <= 1.0
            if enters:
                rejected, rejecting = 0, 0.0
            else:
                rejected, rejecting = rejected + 1, rejecting + since
                seen["rejected"] += 1
                if rejecting > 0.5 and rejected >= 3:
                    rejected, rejecting, enters = 0, 0.0, True
                    P[0, 0] += y**2
                    seen["reopened"] += 1
            since = 0.0
            if enters:
                S = P[0, 0] + R
                K = P[:, 0] / S
                x, P = x + K * y, P - np.outer(K, K) * S
        if k % 4 == 3:
            rows.append([x[1], math.sqrt(P[1, 1]), x[0], math.sqrt(P[0, 0]), y, nis, x[2], x[3], math.sqrt(P[3, 3])])
    assert seen["rejected"] > 30 and seen["reopened"] > 0, seen
    return ["grade", "grade_sd", "speed", "speed_sd", "innovation", "nis", "gyro_bias", "accel_bias", "accel_bias_sd"], rows
