"""`dffrls_aekf_robust`, `rls_ekf_robust`, `ffrls_robust`, `joint_ekf_robust` (Liu et al. 2023, eq. 16–30) on one recorded drive of a train that is a point.

Mass regression, both sides divided by the first mass m₀:
    (F − J v̇)/m₀ = [f + s μ g c, s g c, 1, s g c |κ|] · [M, r, a, q]/m₀,  s = sgn v, c = cos θ from sin θ = (f − v̇)/g
Slope filter: x = [v, θ], v⁻ = v + dt (F − M g (sin θ + s μ cos θ))/(M + J), z = v; R adapted (Sage & Husa) or not.
ffrls_robust: v̇ = [(F − J v̇)/m₀, −g √(1 + μ²)] · [m₀/M, sin(θ + s atan μ)].  joint_ekf_robust: x = [v, θ, 10⁴/M].
"""

import math
from copy import deepcopy

import numpy as np
from common import GRAVITY, jacobian
from pipeline_parts import DT, LeastSquares, LoadWatch, Rail, SageHusa, Samples, dynamic, lag, readings, record_rail

M0 = 15e3
Q_V, Q_THETA, Q_THETA_JOINT, SD = 1e-4, 1.5e-4, 3e-4, 0.005
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
    def __init__(self, factor, own):
        self.rls = LeastSquares([1.0, 0.0, 0.0, 0.0], [0.4, 0.3 * Rail.mu, 0.02, 0.05], factor, own)
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
    def __init__(self, noise):
        self.x, self.P = np.zeros(2), np.diag([SD**2, math.radians(5.0) ** 2])
        self.noise, self.started, self.y, self.nis = noise, False, 0.0, 0.0

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
        R = self.noise.R if self.noise else SD**2
        S = self.P[0, 0] + R
        self.y = z.v - self.x[0]
        self.nis = self.y**2 / S
        K = self.P[:, 0] / S
        self.x, self.P = self.x + K * self.y, self.P - np.outer(K, K) * S
        self.x[1] = min(max(self.x[1], -STEEPEST), STEEPEST)
        if self.noise and z.running:
            self.noise.see(z.v - self.x[0], self.P[0, 0])


def two_stages(zs, dffrls):
    factor = dynamic(0.98, 0.995, 1.0) if dffrls else lambda k, size: 1.0
    mass, slope = Mass(factor, dffrls), Slope(SageHusa(SD**2, 0.98) if dffrls else None)
    for z in zs:
        mass.step(z)
        slope.step(z, mass.value()[0], mass.mu())
        R = slope.noise.R if slope.noise else SD**2
        yield [*mass.value(), slope.x[1], slope.x[0], slope.y, slope.nis, mass.mu(), math.sqrt(R), math.sqrt(slope.P[1, 1])]
    assert mass.acted == {True, False} and mass.load.changes > 0, f"{mass.acted}, {mass.load.changes} load changes"


def coupled(zs):
    rls = LeastSquares([1.0, Rail.mu], [0.5, 0.1], lambda k, size: 0.98)
    samples, sign, mu = Samples(1.0, 10.0, 1.0), 1.0, Rail.mu
    root = math.sqrt(1.0 + mu * mu)
    for z in zs:
        if samples.step(z) is not None:
            a = samples.speed.rate
            sign = math.copysign(1.0, samples.speed.value)
            rls.update(a, [(samples.force.value - Rail.J * a) / M0, -GRAVITY * root], 0.02**2)
        chi1, chi2 = min(max(rls.x[0], M0 / Rail.high), M0 / Rail.low), min(max(rls.x[1], -0.85), 0.85)
        theta = math.asin(chi2) - sign * math.atan(mu)
        chi_sd = np.minimum(max(1.0, rls.spread()) * np.sqrt(np.diag(rls.P)), [0.5, 0.1])
        sd = M0 / chi1**2 * chi_sd[0]
        theta_sd = chi_sd[1] / max(math.cos(theta), 0.1)
        yield [M0 / chi1, sd, theta, z.v, rls.residual, rls.normalised**2, theta_sd, rls.x[0], rls.x[1]]


def joint(zs):
    w0 = 1e4 / M0
    x, P = np.array([0.0, 0.0, w0]), np.diag([SD**2, math.radians(5.0) ** 2, (0.4 * w0) ** 2])
    started, y, nis = False, 0.0, 0.0
    # What the mass is known by is earned while the speed changes, and nothing else counts.
    changing, earned = Deviation(), P[2, 2]
    for z in zs:
        changing.add(z.v, lag(DT, 5.0))
        if z.running:
            f = lambda x: np.array([x[0] + DT * speed_rate(z.net, 1e4 / x[2], x[1], z.sign * Rail.mu), x[1], x[2]])
            F = jacobian(f, x)
            x, P = f(x), F @ P @ F.T + np.diag([Q_V, Q_THETA_JOINT, 0.0]) * DT
        else:
            v = P[0, 0] + DT
            P[0, :] = P[:, 0] = 0.0
            P[0, 0] = v
        if z.new:
            if not started:
                x[0], started = z.v, True
            S = P[0, 0] + SD**2
            y = z.v - x[0]
            nis, K = y**2 / S, P[:, 0] / S
            before = P[2, 2]
            x, P = x + K * y, P - np.outer(K, K) * S
            if z.running and math.sqrt(changing.variance) > 0.05:
                earned *= P[2, 2] / before
            x = np.array([x[0], min(max(x[1], -STEEPEST), STEEPEST), min(max(x[2], 1e2 / Rail.high), 1e6 / Rail.low)])
        w = min(max(x[2], 1e4 / Rail.high), 1e4 / Rail.low)
        mass = 1e4 / w
        correlation = P[1, 2] / math.sqrt(P[1, 1] * P[2, 2])
        yield [mass, mass * math.sqrt(max(P[2, 2], earned)) / w, x[1], x[0], y, nis, math.sqrt(P[1, 1]), math.sqrt(P[2, 2]), correlation]


def oracle(table):
    zs = readings(table, Rail)
    header = ["pipeline", "mass", "mass_sd", "grade", "speed", "innovation", "nis", "own1", "own2", "own3"]
    runs = [two_stages(zs, True), two_stages(zs, False), coupled(zs), joint(zs)]
    return header, [[number, *row] for number, run in enumerate(runs) for row in list(run)[3::4]]
