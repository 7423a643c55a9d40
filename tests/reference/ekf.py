"""Extended Kalman filter (Jazwinski 1970) on the crane model of common.py, in the plainest form:

    x⁻ = f(x, u), P⁻ = F P Fᵀ + Q;  y = z − h(x⁻), S = H P⁻ Hᵀ + R, K = P⁻ Hᵀ S⁻¹, x⁺ = x⁻ + K y, P⁺ = P⁻ − K S Kᵀ

Jacobians by the complex step. Second opinion: filterpy.kalman.ExtendedKalmanFilter.
"""

import numpy as np
from common import Crane, agree, jacobian, names, upper, upper_names
from filterpy.kalman import ExtendedKalmanFilter
from scipy.stats import multivariate_normal

HEADER = [*names("x", 3), *upper_names("P", 3), *names("y", 2), *upper_names("S", 2)]
HEADER += [f"K{i}{j}" for i in (1, 2, 3) for j in (1, 2)] + ["nis", "log_likelihood"]


def record(rng):
    return Crane.record(rng, 300)


def row(x, P, y, S, K):
    nis = y @ np.linalg.inv(S) @ y
    return [*x, *upper(P), *y, *upper(S), *K.flatten(), nis, multivariate_normal.logpdf(y, cov=S)]


def oracle(table):
    x, P = Crane.X0.copy(), np.diag(Crane.SD0**2)
    other = ExtendedKalmanFilter(dim_x=3, dim_z=2)
    other.x, other.P, other.Q, other.R = x.copy(), P.copy(), Crane.Q, Crane.R
    rows = []
    for u, z in zip(table["u"], np.column_stack([table["z1"], table["z2"]])):
        F = jacobian(lambda at: Crane.f(at, u), x)
        x, P = Crane.f(x, u), F @ P @ F.T + Crane.Q
        H = jacobian(lambda at: Crane.h(at, u), x)
        S = H @ P @ H.T + Crane.R
        K = P @ H.T @ np.linalg.inv(S)
        y = z - Crane.h(x, u)
        x, P = x + K @ y, P - K @ S @ K.T
        rows.append(row(x, P, y, S, K))

        other.F = jacobian(lambda at: Crane.f(at, u), other.x)
        other.predict_x = lambda _=0, u=u: setattr(other, "x", Crane.f(other.x, u))
        other.predict()
        other.update(z, lambda at: jacobian(lambda a: Crane.h(a, u), at), lambda at: Crane.h(at, u))
        agree("ekf x against FilterPy", x, other.x)
        agree("ekf P against FilterPy", P, other.P)
        agree("ekf likelihood against FilterPy", rows[-1][-1], other.log_likelihood)
    return HEADER, rows
