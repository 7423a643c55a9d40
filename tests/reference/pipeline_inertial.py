"""`dffrls_aukf_robust` (DFFRLS-AUKF method) on one recorded drive.

Curvature: d(f − v̇)/dt = (g v cos θ) ρ, both sides adaptively smoothed, then twice through the low-pass.
Slope: x = [v, θ], v⁻ = v + dt (f − g sin θ), θ⁻ = θ + dt ρ v, z = v; sums over sigma points (`ukf.py`).
"""

import math

import numpy as np
from common import GRAVITY
from pipeline_parts import DT, LeastSquares, LowPass, Rail, SageHusa, dynamic, readings, record_rail

ALPHA, BETA, KAPPA = 0.97, 2.0, 1.0
Q = np.diag([1e-6, 5e-6]) * DT
SD = 0.005
STEEPEST = math.pi / 3.0


def record(rng):
    return record_rail(rng)


class Curvature:
    def __init__(self, rls):
        self.f, self.v, self.excess, self.again = (LowPass(1.0) for _ in range(4))
        self.rls, self.smooth, self.running, self.since = rls, None, 0.0, 0.0

    def step(self, z, theta):
        new = np.array([z.f, z.v])
        if self.smooth is None:
            self.smooth = new
        else:
            away = abs(new[0] - self.smooth[0]) / 0.02
            corner = 3.0 if away <= 3.0 else 9.0 if away <= 6.0 else 30.0
            self.smooth = self.smooth + (1.0 - math.exp(-2.0 * math.pi * corner * DT)) * (new - self.smooth)
        f, v = self.smooth
        self.f.step(f)
        self.v.step(v)
        self.excess.step(self.f.value - self.v.rate)
        self.again.step(self.v.value)
        self.running = self.running + DT if abs(v) > Rail.standstill else 0.0
        self.since += DT
        if self.since * 10.0 >= 1.0 - 1e-9 and self.running >= 1.0:
            self.since = 0.0
            self.rls.update(self.excess.rate, [GRAVITY * math.cos(theta) * self.again.value], 0.1**2)

    def rho(self):
        return min(max(self.rls.x[0], -0.25), 0.25) if self.running >= 1.0 else 0.0


def weights(P):
    phi = ALPHA**2 * (2.0 + KAPPA) - 2.0
    mean = np.array([phi, 0.5, 0.5, 0.5, 0.5]) / (2.0 + phi)
    covariance = mean + np.array([1.0 - ALPHA**2 + BETA, 0, 0, 0, 0])
    return np.linalg.cholesky((2.0 + phi) * P), mean, covariance


def through(f, x, P):
    """Points, their images, the mean of the images, the weights of covariances."""
    L, mean, covariance = weights(P)
    points = np.array([x, *(x + L.T), *(x - L.T)])
    images = np.array([f(point) for point in points])
    return points - x, images - mean @ images, mean @ images, np.diag(covariance)


def slope(zs):
    curvature = Curvature(LeastSquares([0.0], [0.05], dynamic(0.98, 0.6, 3.0), True))
    x, P = np.zeros(2), np.diag([SD**2, math.radians(5.0) ** 2])
    noise, started, y, nis = SageHusa(SD**2, 0.998), False, 0.0, 0.0
    inside = lambda theta: min(max(theta, -STEEPEST), STEEPEST)
    for z in zs:
        curvature.step(z, x[1])
        rho = curvature.rho()
        f = lambda x: np.array([x[0] + DT * (z.f - GRAVITY * np.sin(x[1])), x[1] + DT * rho * x[0]])
        _, away, x, W = through(f, x, P)
        P = away.T @ W @ away + Q
        x[1] = inside(x[1])
        if z.new:
            if not started:
                x[0], started = z.v, True
            points, seen, expected, W = through(lambda x: x[:1], x, P)
            S = seen.T @ W @ seen + noise.R
            K = points.T @ W @ seen @ np.linalg.inv(S)
            y = z.v - expected[0]
            nis = y**2 / S[0, 0]
            x, P = x + K[:, 0] * y, P - K @ S @ K.T
            x[1] = inside(x[1])
            noise.see(z.v - x[0], P[0, 0])
        yield [x[1], x[0], y, nis, rho, curvature.rls.lam, math.sqrt(noise.R), math.sqrt(P[1, 1])]


def oracle(table):
    header = ["grade", "speed", "innovation", "nis", "curvature", "lambda", "wheel_speed_sd", "slope_filter_sd"]
    return header, list(slope(readings(table, Rail)))[3::4]
