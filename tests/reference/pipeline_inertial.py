"""`dffrls_aukf_robust` (DFFRLS-AUKF method) on the drive of `fusion.py`, in the core of `supervised_parts.py`.

Curvature: d(f − v̇)/dt = (g v cos θ) ρ, both sides adaptively smoothed, then twice through the low-pass; f without the core's bias.
Slope: x = [v, θ], v⁻ = v + dt (f − g sin θ), θ⁻ = θ + dt ρ v, z = v; sums over sigma points (`ukf.py`).
"""

import math

import numpy as np
from common import GRAVITY
from fusion import BX, DT, SHEET, TH, Train, clip
from pipeline_parts import LeastSquares, LowPass, SageHusa, dynamic
from supervised_parts import HEADER, STANDSTILL, Gate, Supervised, run

INPUT = "fusion"
ALPHA, BETA, KAPPA = 0.97, 2.0, 1.0
Q = np.diag([1e-6, 5e-6]) * DT
SD = SHEET["wheel"]
STEEPEST = math.pi / 3.0


class Curvature:
    def __init__(self, rls):
        self.f, self.v, self.excess, self.again = (LowPass(1.0, DT) for _ in range(4))
        self.rls, self.smooth, self.running, self.since = rls, None, 0.0, 0.0

    def step(self, f, v, theta):
        new = np.array([f, v])
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
        self.running = self.running + DT if abs(v) > STANDSTILL else 0.0
        self.since += DT
        if self.since * 10.0 >= 1.0 - 1e-9 and self.running >= 1.0:
            self.since = 0.0
            self.rls.update(self.excess.rate, [GRAVITY * math.cos(theta) * self.again.value], 0.1**2)

    def rho(self):
        if self.running < 1.0:
            return 0.0, 0.05
        return clip(self.rls.x[0], -0.25, 0.25), math.sqrt(self.rls.P[0, 0]) * self.rls.spread()


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


class CurvatureSlope:
    def __init__(self):
        self.curvature = Curvature(LeastSquares([0.0], [0.05], dynamic(0.98, 0.6, 3.0), True))
        self.x, self.P = np.zeros(2), np.diag([SD**2, math.radians(5.0) ** 2])
        self.noise, self.gate, self.started, self.saturated = SageHusa(SD**2, 0.998), Gate(), False, False

    def mass(self):
        return 0.5 * (Train.low + Train.high), (Train.high - Train.low) / math.sqrt(12.0)

    def sample(self, now):
        pass

    def pause(self):
        pass

    def limit(self):
        inside = clip(self.x[1], -STEEPEST, STEEPEST)
        self.saturated, self.x[1] = self.saturated or inside != self.x[1], inside

    def step(self, now):
        self.ahead, self.ahead_sd = math.sin(now.att.b.x[TH]) - math.sin(now.effective[0]), now.effective[1]
        self.bias_sd, v = now.bias_sd, now.z.v
        force = now.z.force[0] - now.att.b.x[BX]
        self.curvature.step(force, v, self.x[1])
        rho, _ = self.curvature.rho()
        f = lambda x: np.array([x[0] + DT * (force - GRAVITY * np.sin(x[1])), x[1] + DT * rho * x[0]])
        self.gate.since += DT
        _, away, self.x, W = through(f, self.x, self.P)
        self.P, self.saturated = away.T @ W @ away + Q, False
        self.limit()
        if not self.started:
            self.x[0], self.started = v, True
        y = v - self.x[0]
        passage = self.gate.judge(y**2 / (self.P[0, 0] + SD**2))
        if passage == "reject":
            return
        if passage == "reopen":
            self.P[0, 0] += y**2
        points, seen, expected, W = through(lambda x: x[:1], self.x, self.P)
        S = seen.T @ W @ seen + self.noise.R
        K = points.T @ W @ seen @ np.linalg.inv(S)
        self.x, self.P = self.x + K[:, 0] * (v - expected[0]), self.P - K @ S @ K.T
        self.limit()
        self.noise.see(v - self.x[0], self.P[0, 0])

    def found(self):
        sine = clip(math.sin(self.x[1]) - self.ahead, -math.sin(STEEPEST), math.sin(STEEPEST))
        sd = math.sqrt(self.P[1, 1] + (self.bias_sd / (GRAVITY * math.cos(self.x[1]))) ** 2 + self.ahead_sd**2)
        return math.asin(sine), sd

    def grade(self):
        return None if self.saturated else self.found()


def oracle(table):
    method = CurvatureSlope()
    own = lambda: [*method.curvature.rho(), method.curvature.rls.lam, math.sqrt(method.noise.R), *method.found()]
    rows = run(Supervised(method, 1.0, 10.0, 1.0), own, table, {"alone", "goes back blind"})
    assert method.gate.met["reject"] and method.gate.met["reopen"], f"gate {method.gate.met}"
    return [*HEADER, "curvature", "curvature_sd", "lambda", "wheel_speed_sd", "method_grade", "method_grade_sd"], rows
