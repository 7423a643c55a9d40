"""Sage-Husa estimation of R and of Q with fading memory, in the two forms that cannot lose positive definiteness, inside a
constant-velocity Kalman filter [position, speed] that sees both.

    d = (1 − b)/(1 − bʲ), j = 1/(1 − b), 1/(1 − b) + 1, …  (the start counts as one memory length)
    R ← (1 − d) R + d (ε εᵀ + H P⁺ Hᵀ), ε = z − H x⁺      (Akhlaghi, Zhou & Huang 2017)
    Q ← (1 − d) Q + d diag(K y yᵀ Kᵀ)                       (Liu et al. 2023, eq. 30, without P⁺ − A P Aᵀ)
then, in this order: rows and columns of a variance above its upper limit shrink, correlations shrink by 1e-6, variances below
their lower limit are raised. b = 0.95, limits 0.4 and 10 times the start.
"""

import numpy as np
from common import upper, upper_names

B, LOW, HIGH = 0.95, 0.4, 10.0
DT = 0.1
F = np.array([[1.0, DT], [0.0, 1.0]])
Q = np.array([[1e-4, 0.0], [0.0, 4e-3]])
R = np.array([[0.04, 0.01], [0.01, 0.09]])


def record(rng):
    """Measurement noise as believed, then three times and ten times as large, then next to none; the speed wanders, once wildly."""
    spread = np.linalg.cholesky(R)
    position, speed, rows = 0.0, 1.0, []
    for k in range(400):
        speed += 0.06 * rng.standard_normal() * (30.0 if 210 <= k < 230 else 1.0)
        position += DT * speed
        size = [1.0, 3.0, 10.0, 0.02, 0.02][k // 80]
        rows.append(np.array([position, speed]) + size * (spread @ rng.standard_normal(2)))
    return ["z1", "z2"], rows


def adapt(start, covariance, k, seen):
    """One blend of `covariance` with what was `seen`, at observation k = 0, 1, …"""
    d = (1.0 - B) / (1.0 - B ** (1.0 / (1.0 - B) + k))
    C = (1.0 - d) * covariance + d * seen
    over = np.sqrt(np.minimum(1.0, HIGH * np.diag(start) / np.diag(C)))
    C = over[:, None] * C * over[None, :]
    C = (1.0 - 1e-6) * C + 1e-6 * np.diag(np.diag(C))
    lacking = np.maximum(0.0, LOW * np.diag(start) - np.diag(C))
    return C + np.diag(lacking), bool(np.any(over < 1.0)), bool(np.any(lacking > 0.0))


def oracle(table):
    rows, hits = [], []
    for adapted in ("R", "Q"):
        x, P, q, r = np.zeros(2), np.diag([1.0, 4.0]), Q.copy(), R.copy()
        for k, z in enumerate(np.column_stack([table["z1"], table["z2"]])):
            x, P = F @ x, F @ P @ F.T + q
            K = P @ np.linalg.inv(P + r)
            y = z - x
            x, P = x + K @ y, P - K @ P
            if adapted == "R":
                e = z - x
                r, above, below = adapt(R, r, k, np.outer(e, e) + P)
                current = r
            else:
                q, above, below = adapt(Q, q, k, np.diag((K @ y) ** 2))
                current = q
            hits.append((adapted, above, below))
            rows.append([adapted == "Q", *x, *upper(P), *upper(current), above or below])
    for adapted in ("R", "Q"):
        counts = np.sum([hit[1:] for hit in hits if hit[0] == adapted], axis=0)
        assert all(counts > 10), f"{adapted}: limits act {counts} times"
    return ["adapts_q", "x1", "x2", *upper_names("P", 2), *upper_names("C", 2), "limited"], rows
