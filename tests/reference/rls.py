"""Recursive least squares with five ways of forgetting.

Recursion (Liu et al. 2023, eq. 20–22, for samples of noise variance r):
    e = y − hᵀχ,  K = P h / (λ r + hᵀ P h),  χ ← χ + K e,  P ← (P − K hᵀ P)/λ
Forgetting factors:
    none      λ = 1
    constant  λ = 0.97
    dynamic   λ = δ + (1 − δ) exp(−σ Δ), δ = 0.9, σ = 0.5 (Liu et al. 2023, eq. 19); Δ = |e| / (s √(r + hᵀ P h)), s the running
              deviation; λ = 0.98 for the first ten updates
    multiple  a factor for each parameter, (0.999, 0.95) (Vahidi, Stefanopoulou & Peng 2005, two parameters, their printed form)
    timelaw   λ = 1 − 0.05 · 0.98ᵏ at update k = 1, 2, … (patent CN 111507019 B)
Around it, as the crate's documentation has it:
    s² ← s² + (min(n², 25 s²) − s²)/m, n = e/√(r + hᵀ P h), m = min(50, k + 1), s² = 1 at the start
    correlation factor (1 + ρ)/(1 − ρ), ρ = c/s² in 0…0.9, c the like average of n n′ held within ±25 s²; 1 for ten updates
    no variance exceeds its prior: P ← D P D;  `remember` makes λ = 1;  `reopen` gives a parameter its prior variance back
"""

import numpy as np
from common import agree, names, upper, upper_names
from filterpy.kalman import KalmanFilter

POLICIES = ["none", "constant", "dynamic", "multiple", "timelaw"]
X0 = np.array([10.0, 1.0])
SD0 = np.array([8.0, 5.0])
LAMBDAS = np.array([0.999, 0.95])


def record(rng):
    """Force in kN over specific force and a one: mass in t, resistance in kN. The load changes, an outlier, stretches with next to
    no excitation (forgetting suspended in a part of them), a reopening."""
    rows = []
    for k in range(260):
        mass, resistance = (12.0 if k < 150 else 17.0), 2.0 + 0.5 * np.sin(0.05 * k)
        still = k < 12 or 60 <= k < 120 or 200 <= k < 215
        h = [0.003 * rng.standard_normal() if still else 1.5 * np.sin(0.13 * k) + 0.4 * rng.standard_normal(), 1.0]
        r = 0.04 if k % 3 else 0.16
        y = mass * h[0] + resistance + np.sqrt(r) * rng.standard_normal() + (6.0 if k == 40 else 0.0)
        rows.append([y, *h, r, 100 <= k < 120, k == 200])
    return ["y", "h1", "h2", "r", "remember", "reopen"], rows


def factor(policy, k, size):
    """Forgetting factor at update k = 1, 2, … for a residual of `size` running deviations."""
    if policy == "constant":
        return 0.97
    if policy == "dynamic":
        return 0.98 if k <= 10 else 0.9 + 0.1 * np.exp(-0.5 * size)
    if policy == "multiple":
        return min(LAMBDAS)
    if policy == "timelaw":
        return 1.0 - 0.05 * 0.98**k
    return 1.0


def recursion(x, P, e, h, r, lam):
    K = P @ h / (lam * r + h @ P @ h)
    return x + K * e, (P - np.outer(K, h @ P)) / lam


def information(x, P, y, h, r, lam):
    """The same by weighted least squares: old information times λ plus that of the sample."""
    old = lam * np.linalg.inv(P)
    P = np.linalg.inv(old + np.outer(h, h) / r)
    return P @ (old @ x + h * y / r), P


def vahidi(x, P, e, h, r, lams):
    """As printed, for unit noise: the sample is divided by its deviation first."""
    h, e, (p1, p2), (l1, l2) = h / np.sqrt(r), e / np.sqrt(r), np.diag(P), lams
    L1, L2 = p1 * h[0] / (l1 + p1 * h[0] ** 2), p2 * h[1] / (l2 + p2 * h[1] ** 2)
    share = 1.0 / (1.0 + p1 * h[0] ** 2 / l1 + p2 * h[1] ** 2 / l2)
    x = x + share * np.array([p1 * h[0] / l1, p2 * h[1] / l2]) * e
    return x, np.diag([(1.0 - L1 * h[0]) * p1 / l1, (1.0 - L2 * h[1]) * p2 / l2])


def run(policy, table, limit=True):
    x, P = X0.copy(), np.diag(SD0**2)
    variance, tie, last = 1.0, 0.0, 0.0
    for index, y in enumerate(table["y"]):
        k = index + 1
        h = np.array([table["h1"][index], table["h2"][index]])
        r, remember = table["r"][index], table["remember"][index]
        if table["reopen"][index]:
            P = np.diag([SD0[0] ** 2, P[1, 1]])
        e = y - h @ x
        n = e / np.sqrt(r + h @ P @ h)
        lam = 1.0 if remember else factor(policy, k, abs(n) / np.sqrt(variance))
        if policy == "multiple":
            x, P = vahidi(x, P, e, h, r, np.ones(2) if remember else LAMBDAS)
        else:
            other = information(x, P, y, h, r, lam)
            x, P = recursion(x, P, e, h, r, lam)
            agree(f"rls {policy} x", x, other[0])
            agree(f"rls {policy} P", P, other[1])
        shrink = np.minimum(1.0, SD0 / np.sqrt(np.diag(P)))
        limited = limit and bool(np.any(np.diag(P) > SD0**2))
        if limited:
            P = np.diag(shrink) @ P @ np.diag(shrink)
        m = min(50.0, k + 1.0)
        cap = 25.0 * variance
        tie += (np.clip(n * last, -cap, cap) - tie) / m
        variance += (min(n * n, cap) - variance) / m
        last = n
        rho = 0.0 if k < 10 else min(max(tie / variance, 0.0), 0.9)
        spread = np.sqrt(variance)
        yield [*x, *upper(P), e, n, lam, limited, spread, (1.0 + rho) / (1.0 - rho)]


def oracle(table):
    header = ["policy", *names("x", 2), *upper_names("P", 2), "residual", "normalised", "lambda", "limited", "spread", "correlation"]
    rows = [[number, *row] for number, policy in enumerate(POLICIES) for row in run(policy, table)]
    acted = {POLICIES[int(row[0])] for row in rows if row[9]}
    assert acted == set(POLICIES) - {"none"}, f"wind-up limit acted in {acted}"
    second_opinion(table)
    return header, rows


def second_opinion(table):
    """FilterPy's Kalman filter of a constant, its fading memory α² = 1/λ: none and constant without the wind-up limit."""
    free = {**table, "remember": 0 * table["remember"], "reopen": 0 * table["reopen"]}
    for policy, lam in [("none", 1.0), ("constant", 0.97)]:
        kalman = KalmanFilter(dim_x=2, dim_z=1)
        kalman.x, kalman.P, kalman.F, kalman.Q = X0.copy(), np.diag(SD0**2), np.eye(2), np.zeros((2, 2))
        kalman.alpha = 1.0 / np.sqrt(lam)
        ours = list(run(policy, free, limit=False))
        for index, y in enumerate(free["y"]):
            kalman.predict()
            h = np.array([[free["h1"][index], free["h2"][index]]])
            kalman.update(y, R=free["r"][index], H=h)
            agree(f"rls {policy} against FilterPy", ours[index][:2], kalman.x)
            agree(f"rls {policy} against FilterPy, P", ours[index][2:5], upper(kalman.P))
