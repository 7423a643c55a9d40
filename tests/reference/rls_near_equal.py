"""Recursive least squares with near-equal regressors, in 60 decimal digits.

Three parameters, regressors 1 + ε n with n of unit variance and ε = 1e-3 … 1e-5, residuals of 1e-6: what sets the parameters apart is the
small part of the regressors alone, so that the eigenvalues of P are up to 1e12 apart at first and the covariance in double precision keeps few
digits of it. The recursion is that of `rls.py` without wind-up limit,
    e = y − hᵀχ,  K = P h / (λ r + hᵀ P h),  χ ← χ + K e,  P ← (P − K hᵀ P)/λ
and the same by information, P⁻¹ ← λ P⁻¹ + h hᵀ/r, agrees with it to 25 digits. Every tenth update is kept.
"""

from decimal import Decimal, getcontext

import numpy as np
from common import names, upper_names

getcontext().prec = 60
EPSILONS = [1e-3, 1e-4, 1e-5]
LAMBDAS = [1.0, 0.999]
NOISE = 1e-6
TRUE = [1.0, 0.7, -0.4]
PRIOR_SD = 1.0
STEPS = 400


def record(rng):
    """A number of the case and its regressors and measurement."""
    rows = []
    for case, epsilon in enumerate(EPSILONS):
        for _ in range(STEPS):
            h = 1.0 + epsilon * rng.standard_normal(3)
            rows.append([case, float(h @ TRUE + NOISE * rng.standard_normal()), *h])
    return ["case", "y", "h1", "h2", "h3"], rows


def exact(numbers):
    """Floats as the decimal numbers that they are."""
    return [Decimal(float(x)) for x in numbers]


def solve(A, b):
    """A x = b by elimination with pivots."""
    n = len(b)
    rows = [list(A[i]) + [b[i]] for i in range(n)]
    for j in range(n):
        pivot = max(range(j, n), key=lambda i: abs(rows[i][j]))
        rows[j], rows[pivot] = rows[pivot], rows[j]
        for i in range(n):
            if i != j:
                share = rows[i][j] / rows[j][j]
                rows[i] = [a - share * b for a, b in zip(rows[i], rows[j])]
    return [rows[i][n] / rows[i][i] for i in range(n)]


def run(samples, forgetting):
    lam, r = Decimal(forgetting), Decimal(NOISE) * Decimal(NOISE)
    one, n = Decimal(1), range(3)
    x = [Decimal(0)] * 3
    P = [[Decimal(PRIOR_SD) ** 2 if i == j else Decimal(0) for j in n] for i in n]
    information = [[one / P[i][i] if i == j else Decimal(0) for j in n] for i in n]
    weighted = [Decimal(0)] * 3
    for k, (y, *h) in enumerate(samples, 1):
        Ph = [sum(P[i][j] * h[j] for j in n) for i in n]
        S = lam * r + sum(h[i] * Ph[i] for i in n)
        e = y - sum(h[i] * x[i] for i in n)
        x = [x[i] + Ph[i] / S * e for i in n]
        P = [[(P[i][j] - Ph[i] * Ph[j] / S) / lam for j in n] for i in n]
        information = [[lam * information[i][j] + h[i] * h[j] / r for j in n] for i in n]
        weighted = [lam * weighted[i] + h[i] * y / r for i in n]
        if k % 10 == 0:
            other = solve(information, weighted)
            assert all(abs(a - b) < Decimal("1e-25") for a, b in zip(x, other)), (x, other)
            yield [k, *map(float, x), *(float(P[i][j]) for i in n for j in n if i <= j)]


def oracle(table):
    header = ["case", "lambda", "k", *names("x", 3), *upper_names("P", 3)]
    rows = []
    for case in range(len(EPSILONS)):
        mine = table["case"] == case
        samples = [exact(s) for s in np.column_stack([table[c][mine] for c in ("y", "h1", "h2", "h3")])]
        for lam in LAMBDAS:
            rows += [[case, lam, *row] for row in run(samples, lam)]
    return header, rows
