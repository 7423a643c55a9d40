"""`dffrls_aukf`, `dffrls_ukf`, `dffrls_aekf_inclination`, `ffrls_aukf`, `rls_mff_aukf`: the DFFRLS-AUKF paper as published, errata corrected,
on a recorded drive.

Smoothing Y ← Y + m (ψ − Y) with m = 1 − exp(−mₙ fₛ dt), mₙ = 0.15, 0.35, 0.65 up to Γ = 0.06, 0.12 and beyond. Curvature by least squares,
d(f − v̇)/dt = (g v cos θ) ρ [+ c], a sample each step, P₀ 0.05 (0.01) over 0.1 m/s³. Slope: v⁻ = v + dt (f − g sin θ), θ⁻ = θ + dt ρ v, z = v,
f and v smoothed.
"""

import math

import numpy as np
from common import GRAVITY
from pipeline_parts import DT, LowPass, Rail, readings, record_rail
from published_parts import Kalman, Noise, by_residual, cut, regression

record = record_rail
Q, SD = np.diag([1e-4, 2e-5]) * DT, 0.005
STEEPEST = math.pi / 3.0
ALPHA, BETA, KAPPA = 0.97, 2.0, 1.0


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


class Smoother:
    def __init__(self):
        self.last, self.gains = None, set()

    def step(self, new):
        if self.last is None:
            self.last = new
            return new
        away = abs(new[0] - self.last[0])
        m = 0.15 if away <= 0.06 else 0.35 if away <= 0.12 else 0.65
        self.gains.add(m)
        self.last = self.last + (1.0 - math.exp(-m * 100.0 * DT)) * (new - self.last)
        return self.last


def run(zs, rls, unscented, b):
    smoother, low = Smoother(), [LowPass(1.0) for _ in range(4)]
    slope = Kalman([0.0, 0.0], [SD, math.radians(5.0)], Noise(SD**2, b))
    for z in zs:
        f, v = smoother.step(np.array([z.f, z.v]))
        low[0].step(f)
        low[1].step(v)
        low[2].step(low[0].value - low[1].rate)
        low[3].step(low[1].value)
        h = [GRAVITY * low[3].value * math.cos(slope.x[1]), 1.0][: len(rls.x)]
        rls.update(low[2].rate, h, 0.1**2)
        rho = rls.x[0]
        step = lambda x: np.array([x[0] + DT * (f - GRAVITY * np.sin(x[1])), x[1] + DT * rho * x[0]])
        if unscented:
            _, away, slope.x, W = through(step, slope.x, slope.P)
            slope.P = away.T @ W @ away + Q
        else:
            slope.predict(step, Q)
        if z.new:
            slope.start(v)
            if unscented:
                points, seen, expected, W = through(lambda x: x[:1], slope.x, slope.P)
                S = seen.T @ W @ seen + slope.noise.R
                K = points.T @ W @ seen @ np.linalg.inv(S)
                slope.y = v - expected[0]
                slope.nis = slope.y**2 / S[0, 0]
                slope.x, slope.P = slope.x + K[:, 0] * slope.y, slope.P - K @ S @ K.T
                slope.noise.see(v - slope.x[0], slope.P[0, 0])
            else:
                slope.update(v)
        grade = cut((slope.x[1], slope.sd(1)), -STEEPEST, STEEPEST)
        rho_sd = math.sqrt(rls.widened()[0])
        yield [*grade, slope.x[0], slope.y, slope.nis, rho, rho_sd, rls.lam, math.sqrt(slope.noise.R)]
    assert len(smoother.gains) == 3, smoother.gains


def oracle(table):
    zs = readings(table, Rail)
    dynamic = lambda: regression([0.0], [0.05], by_residual(0.98, 0.95, 5.0))
    multiple = regression([0.0, 0.0], [0.05, 0.01], lambda k, size: np.array([0.98, 0.999]))
    runs = [
        run(zs, dynamic(), True, 0.97),
        run(zs, dynamic(), True, None),
        run(zs, dynamic(), False, 0.97),
        run(zs, regression([0.0], [0.05], lambda k, size: 0.98), True, 0.97),
        run(zs, multiple, True, 0.97),
    ]
    header = ["pipeline", "grade", "grade_sd", "speed", "innovation", "nis", "curvature", "curvature_sd", "lambda", "r_sd"]
    return header, [[number, *row] for number, run in enumerate(runs) for row in list(run)[3::4]]
