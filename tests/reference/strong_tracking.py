"""Strong tracking (Zhou & Frank 1996) inside a constant-velocity Kalman filter [position, speed] that sees both.

    V = y yᵀ at first, then (ρ V + y yᵀ)/(1 + ρ);  N = V − H Q Hᵀ − β R;  M = H F P Fᵀ Hᵀ
    λ = tr(S⁻¹ N)/tr(S⁻¹ M) held in 1…λ_max, S = M + H Q Hᵀ + R (whitened: the two measurements differ in units)
    only the speed fades: P₂₂ ← λ P₂₂ before the prediction
ρ = 0.95, β = 1.5, λ_max = 20.

The alarm: a ← 0.95 a + 0.05 min(yᵀ S⁻¹ y/2, 10 l), b the like average of yᵀ S⁻¹ y′/2 held within ±10 l, y′ the innovation before;
rings when a > l and b > a/2; stops when a < 1.3 for twenty samples, or b < 0. l = 2.

`mode` 0 always fades, 1 fades while the alarm rings. The scalar filter without whitening, λ = N/M, is the second opinion.
"""

import numpy as np
from common import agree, upper, upper_names

RHO, BETA, MOST, LEVEL = 0.95, 1.5, 20.0, 2.0
DT = 0.05
F = np.array([[1.0, DT], [0.0, 1.0]])
H = np.array([[1.0, 0.0], [0.2, 1.0]])
Q = np.array([[1e-6, 0.0], [0.0, 1e-5]])
R = np.array([[4e-4, 0.0], [0.0, 0.04]])


def record(rng):
    """Speed jumps at 100 and 200; at 300 the noise grows instead, which must not ring; an outlier at 50."""
    position, rows = 0.0, []
    for k in range(400):
        speed = 0.0 if k < 100 else 1.5 if k < 200 else -0.5
        position += DT * speed
        noise = np.sqrt(np.diag(R)) * rng.standard_normal(2) * (2.0 if k >= 300 else 1.0)
        rows.append(H @ [position, speed] + noise + (np.array([0.3, 3.0]) if k == 50 else 0.0))
    return ["z1", "z2"], rows


def trace_of(S, A):
    return np.trace(np.linalg.inv(S) @ A)


def fading(V, y, M, q, r):
    square = np.outer(y, y)
    V = square if V is None else (RHO * V + square) / (1.0 + RHO)
    S = M + q + r
    return V, float(np.clip(trace_of(S, V - q - BETA * r) / trace_of(S, M), 1.0, MOST))


class Alarm:
    def __init__(self):
        self.size, self.tie, self.last, self.calm, self.on = 1.0, 0.0, None, 0, False

    def step(self, y, S):
        inverse = np.linalg.inv(S) / len(y)
        tie = 0.0 if self.last is None else self.last @ inverse @ y
        self.size = 0.95 * self.size + 0.05 * min(y @ inverse @ y, 10.0 * LEVEL)
        self.tie = 0.95 * self.tie + 0.05 * np.clip(tie, -10.0 * LEVEL, 10.0 * LEVEL)
        self.last, self.calm = y, self.calm + 1 if self.size < 1.3 else 0
        if self.size > LEVEL and self.tie > 0.5 * self.size:
            self.on = True
        elif self.calm >= 20 or self.tie < 0.0:
            self.on = False
        return self.on


def run(mode, table):
    x, P, V, alarm = np.zeros(2), np.diag([0.01, 0.04]), None, Alarm()
    for z in np.column_stack([table["z1"], table["z2"]]):
        x = F @ x
        y = z - H @ x
        M, q = H @ F @ P @ F.T @ H.T, H @ Q @ H.T
        V, lam = fading(V, y, M, q, R)
        ringing = alarm.step(y, M + q + R)
        if mode == 0 or ringing:
            P = P + np.diag([0.0, (lam - 1.0) * P[1, 1]])
        P = F @ P @ F.T + Q
        S = H @ P @ H.T + R
        K = P @ H.T @ np.linalg.inv(S)
        x, P = x + K @ y, P - K @ S @ K.T
        yield [mode, lam, ringing, *x, *upper(P)]


def oracle(table):
    rows = [row for mode in (0, 1) for row in run(mode, table)]
    lams = np.array([row[1] for row in rows])
    assert np.any(lams == 1.0) and np.any(lams == MOST) and np.any((lams > 1.0) & (lams < MOST)), "λ does not reach all its cases"
    rings = [row[2] for row in rows if row[0] == 1]
    assert 0 < sum(rings) < len(rings) / 2 and not any(rings[:100]), f"alarm rings {sum(rings)} times"

    V, plain = None, None
    for y in table["z1"][:100]:
        V, lam = fading(V, np.array([y]), np.array([[2e-4]]), np.array([[1e-5]]), np.array([[1e-4]]))
        plain = y * y if plain is None else (RHO * plain + y * y) / (1.0 + RHO)
        agree("scalar fading factor", lam, min(max((plain - 1e-5 - BETA * 1e-4) / 2e-4, 1.0), MOST))
    return ["mode", "lambda", "rings", "x1", "x2", *upper_names("P", 2)], rows
