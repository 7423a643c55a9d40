"""Interacting multiple models (Blom & Bar-Shalom 1988) over three models of [speed, grade], fixed and time-varying transitions.

    c_j = Σ_i π_ij μ_i;  μ_i|j = π_ij μ_i/c_j;  x⁰_j = Σ_i μ_i|j x_i;  P⁰_j = Σ_i μ_i|j (P_i + (x_i − x⁰_j)(·)ᵀ)
    Kalman filter j;  μ_j ∝ c_j N(y_j; 0, S_j);  none below 1e-4, normalised again
    x = Σ μ_j x_j;  P = Σ μ_j (P_j + (x_j − x)(·)ᵀ)
    time-varying (Guo et al. 2024, eq. 36–38, step by step as printed): λ_j = exp(μ_j(k) − μ_j(k−1)), π_ij ← π_ij λ_j / Σ_l π_il λ_l

Second opinion, fixed transitions without the floor: filterpy.kalman.IMMEstimator.
"""

import numpy as np
from common import GRAVITY, agree, names, upper, upper_names
from filterpy.kalman import IMMEstimator, KalmanFilter
from scipy.stats import multivariate_normal

DT = 0.05
STAY = 0.96
X0 = np.array([0.0, 0.0])
P0 = np.diag([0.04, 0.0025])
FS = [
    np.array([[1.0, -GRAVITY * DT], [0.0, 1.0]]),
    np.array([[1.0, -GRAVITY * DT], [0.0, 1.0]]),
    np.array([[0.9, 0.0], [0.0, 0.95]]),
]
QS = [np.diag([1e-6, 1e-8]), np.diag([1e-4, 4e-4]), np.diag([1e-2, 1e-5])]
H = np.array([[1.0, 0.0], [0.0, GRAVITY]])
R = np.array([[1e-3, 2e-4], [2e-4, 4e-2]])
FLOOR = 1e-4


def record(rng):
    """In turn as each model has it: rolling on a still grade, a wandering grade, drawn to standstill."""
    x, spread, rows = np.array([0.5, 0.01]), np.linalg.cholesky(R), []
    for k in range(300):
        model = [0, 1, 2, 0, 2, 1][k // 50]
        x = FS[model] @ x + np.sqrt(np.diag(QS[model])) * rng.standard_normal(2)
        rows.append(H @ x + spread @ rng.standard_normal(2))
    return ["z1", "z2"], rows


def mixture(weights, xs, Ps):
    x = sum(w * x for w, x in zip(weights, xs))
    return x, sum(w * (P + np.outer(xi - x, xi - x)) for w, xi, P in zip(weights, xs, Ps))


def run(table, varying, floor):
    pi = np.full((3, 3), (1.0 - STAY) / 2.0)
    np.fill_diagonal(pi, STAY)
    mu = np.full(3, 1.0 / 3.0)
    xs, Ps = [X0.copy()] * 3, [P0.copy()] * 3
    for z in np.column_stack([table["z1"], table["z2"]]):
        c = mu @ pi
        mixed = [mixture(pi[:, j] * mu / c[j], xs, Ps) for j in range(3)]
        densities = []
        for j, (x, P) in enumerate(mixed):
            x, P = FS[j] @ x, FS[j] @ P @ FS[j].T + QS[j]
            S = H @ P @ H.T + R
            K = P @ H.T @ np.linalg.inv(S)
            densities.append(multivariate_normal.pdf(z - H @ x, cov=S))
            xs[j], Ps[j] = x + K @ (z - H @ x), P - K @ S @ K.T
        before = mu
        mu = np.maximum(c * densities / np.sum(c * densities), floor)
        mu = mu / np.sum(mu)
        if varying:
            pi = pi * np.exp(mu - before)
            pi = pi / pi.sum(axis=1, keepdims=True)
        x, P = mixture(mu, xs, Ps)
        yield [varying, *mu, *x, *upper(P), *pi.flatten()]


def oracle(table):
    rows = [row for varying in (False, True) for row in run(table, varying, FLOOR)]
    likeliest = {int(np.argmax(row[1:4])) for row in rows}
    assert likeliest == {0, 1, 2}, f"only models {likeliest} ever lead"
    assert min(min(row[1:4]) for row in rows) < 1.001 * FLOOR, "the floor never acts"

    filters = []
    for j in range(3):
        kalman = KalmanFilter(dim_x=2, dim_z=2)
        kalman.x, kalman.P, kalman.F, kalman.Q, kalman.H, kalman.R = X0.copy(), P0.copy(), FS[j], QS[j], H, R
        filters.append(kalman)
    pi = np.full((3, 3), (1.0 - STAY) / 2.0)
    np.fill_diagonal(pi, STAY)
    other = IMMEstimator(filters, np.full(3, 1.0 / 3.0), pi)
    for row, z in zip(run(table, False, 0.0), np.column_stack([table["z1"], table["z2"]])):
        other.predict()
        other.update(z)
        agree("imm probabilities against FilterPy", row[1:4], other.mu)
        agree("imm x against FilterPy", row[4:6], other.x)
        agree("imm P against FilterPy", row[6:9], upper(other.P))
    header = ["varying", *names("mu", 3), *names("x", 2), *upper_names("P", 2)]
    return header + [f"pi{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)], rows
