"""`dffrls_aekf_robust` (Liu et al. 2023, eq. 16–30) on one recorded drive of a train that is a point.

Mass regression, both sides divided by the first mass m₀:
    (F − J v̇)/m₀ = [f + s μ g c, s g c, 1, s g c |κ|] · [M, r, a, q]/m₀,  s = sgn v, c = cos θ from sin θ = (f − v̇)/g
Slope filter: x = [v, θ], v⁻ = v + dt (F − M g (sin θ + s μ cos θ))/(M + J), z = v; R adapted (Sage & Husa).
"""

import math
from copy import deepcopy

import numpy as np
from common import GRAVITY, jacobian
from pipeline_parts import DT, LeastSquares, LoadWatch, Rail, SageHusa, Samples, dynamic, lag, readings, record_rail

M0 = 15e3
Q_V, Q_THETA, SD = 1e-4, 1.5e-4, 0.005
STEEPEST = math.pi / 3.0


def record(rng):
    return record_rail(rng)


class Deviation:
    def __init__(self):
        self.mean, self.variance = None, 0.0

    def add(self, value, share):
        if self.mean is None:
            self.mean = value
            return
        away = value - self.mean
        self.mean += share * away
        self.variance = (1.0 - share) * (self.variance + share * away**2)


class Mass:
    def __init__(self):
        self.rls = LeastSquares([1.0, 0.0, 0.0, 0.0], [0.4, 0.3 * Rail.mu, 0.02, 0.05], dynamic(0.98, 0.995, 1.0), True)
        self.before = deepcopy(self.rls)
        self.samples, self.curve = Samples(1.0, 2.0, 1.5), 0.0
        self.regressor, self.jolts, self.load, self.acted = Deviation(), Deviation(), LoadWatch(), set()

    def step(self, z):
        s = self.samples
        period = s.step(z)
        if abs(z.v) > Rail.standstill:
            self.curve = s.curve.value
        if period is None:
            return
        a, f = s.speed.rate, s.f.value
        self.regressor.add(f, lag(period, 5.0))
        excited = math.sqrt(self.regressor.variance) > 0.06
        self.acted.add(excited)
        sine = min(max((f - a) / GRAVITY, -0.7), 0.7)
        against = math.copysign(GRAVITY, s.speed.value) * math.sqrt(1.0 - sine**2)
        self.jolts.add(a, lag(period, 3.0))
        r = (0.02**2 + 0.3**2 * self.jolts.variance) / (1.0 if excited else 0.02)
        y = (s.force.value - Rail.J * a) / M0
        self.rls.update(y, [f + against * Rail.mu, against, 1.0, against * s.curve.value], r, not excited)
        if excited and self.load.changed(self.rls.normalised / max(1.0, self.rls.spread())):
            self.rls = deepcopy(self.before)
            self.rls.other_load(0.05)
        if self.load.up == self.load.down == 0.0:
            self.before = deepcopy(self.rls)

    def value(self):
        return M0 * self.found(), M0 * math.sqrt(self.rls.widened()[0])

    def found(self):
        return min(max(self.rls.x[0], Rail.low / M0), Rail.high / M0)

    def mu(self):
        x = self.rls.x
        return min(max(Rail.mu + (x[1] + x[3] * self.curve) / self.found(), 0.0), 1.0)


def speed_rate(F, mass, theta, resistance):
    return (F - mass * GRAVITY * (np.sin(theta) + resistance * np.cos(theta))) / (mass + Rail.J)


class Slope:
    def __init__(self):
        self.x, self.P = np.zeros(2), np.diag([SD**2, math.radians(5.0) ** 2])
        self.noise, self.started, self.y, self.nis = SageHusa(SD**2, 0.98), False, 0.0, 0.0

    def step(self, z, mass, mu):
        if z.running:
            f = lambda x: np.array([x[0] + DT * speed_rate(z.net, mass, x[1], z.sign * mu), x[1]])
            F = jacobian(f, self.x)
            self.x, self.P = f(self.x), F @ self.P @ F.T + np.diag([Q_V, Q_THETA]) * DT
        else:
            self.P = np.diag(np.diag(self.P) + [DT, 0.0])
            if z.moving:
                self.P[1, 1] = min(self.P[1, 1] + 3e-3 * DT, STEEPEST**2)
        if z.new:
            self.update(z)

    def update(self, z):
        if not self.started:
            self.x[0], self.started = z.v, True
        S = self.P[0, 0] + self.noise.R
        self.y = z.v - self.x[0]
        self.nis = self.y**2 / S
        K = self.P[:, 0] / S
        self.x, self.P = self.x + K * self.y, self.P - np.outer(K, K) * S
        self.x[1] = min(max(self.x[1], -STEEPEST), STEEPEST)
        if z.running:
            self.noise.see(z.v - self.x[0], self.P[0, 0])


def two_stages(zs):
    mass, slope = Mass(), Slope()
    for z in zs:
        mass.step(z)
        slope.step(z, mass.value()[0], mass.mu())
        yield [*mass.value(), slope.x[1], slope.x[0], slope.y, slope.nis, mass.mu(), math.sqrt(slope.noise.R), math.sqrt(slope.P[1, 1])]
    assert mass.acted == {True, False} and mass.load.changes > 0, f"{mass.acted}, {mass.load.changes} load changes"


def oracle(table):
    zs = readings(table, Rail)
    header = ["mass", "mass_sd", "grade", "speed", "innovation", "nis", "running_resistance", "wheel_speed_sd", "slope_filter_sd"]
    return header, list(two_stages(zs))[3::4]
