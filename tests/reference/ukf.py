"""Unscented Kalman filter, scaled transform (Wan & van der Merwe 2000), on the crane model of common.py, sum by sum:

    φ = α²(n + κ) − n; points x, x ± columns of chol((n + φ) P); W₀ᵐ = φ/(n + φ), W₀ᶜ = W₀ᵐ + 1 − α² + β, Wᵢ = 1/(2(n + φ))
    x⁻ = Σ Wᵐ f(X), P⁻ = Σ Wᶜ (f(X) − x⁻)(·)ᵀ + Q; points drawn anew;
    ẑ = Σ Wᵐ h(X), S = Σ Wᶜ (h(X) − ẑ)(·)ᵀ + R, P_xz = Σ Wᶜ (X − x⁻)(h(X) − ẑ)ᵀ, K = P_xz S⁻¹, P⁺ = P⁻ − K S Kᵀ

α = 0.97, β = 2, κ = 0. Second opinion: filterpy.kalman.UnscentedKalmanFilter with MerweScaledSigmaPoints.
"""

import numpy as np
from common import Crane, agree
from ekf import HEADER, row
from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

ALPHA, BETA, KAPPA, N = 0.97, 2.0, 0.0, 3


def record(rng):
    return Crane.record(rng, 300)


def points(x, P):
    phi = ALPHA**2 * (N + KAPPA) - N
    L = np.linalg.cholesky((N + phi) * P)
    mean_weights = np.full(2 * N + 1, 1.0 / (2.0 * (N + phi)))
    covariance_weights = mean_weights.copy()
    mean_weights[0] = phi / (N + phi)
    covariance_weights[0] = mean_weights[0] + 1.0 - ALPHA**2 + BETA
    return np.array([x, *(x + L.T), *(x - L.T)]), mean_weights, covariance_weights


def oracle(table):
    x, P = Crane.X0.copy(), np.diag(Crane.SD0**2)
    other = UnscentedKalmanFilter(
        3, 2, Crane.DT, lambda x, u: Crane.h(x, u), lambda x, dt, u: Crane.f(x, u), MerweScaledSigmaPoints(N, ALPHA, BETA, KAPPA)
    )
    other.x, other.P, other.Q, other.R = x.copy(), P.copy(), Crane.Q, Crane.R
    rows = []
    for u, z in zip(table["u"], np.column_stack([table["z1"], table["z2"]])):
        X, Wm, Wc = points(x, P)
        image = np.array([Crane.f(point, u) for point in X])
        x = Wm @ image
        P = (image - x).T @ np.diag(Wc) @ (image - x) + Crane.Q
        X, Wm, Wc = points(x, P)
        seen = np.array([Crane.h(point, u) for point in X])
        z_predicted = Wm @ seen
        S = (seen - z_predicted).T @ np.diag(Wc) @ (seen - z_predicted) + Crane.R
        K = (X - x).T @ np.diag(Wc) @ (seen - z_predicted) @ np.linalg.inv(S)
        y = z - z_predicted
        x, P = x + K @ y, P - K @ S @ K.T
        rows.append(row(x, P, y, S, K))

        other.predict(u=u)
        other.update(z, u=u)
        agree("ukf x against FilterPy", x, other.x)
        agree("ukf P against FilterPy", P, other.P)
        agree("ukf K against FilterPy", K, other.K)
    return HEADER, rows
