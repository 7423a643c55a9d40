"""`mmrls_sh_stf_robust` (patent CN 111507019 B) on one recorded drive of a road vehicle with bends.

    straight  (F − J v̇)/m₀ = a M/m₀, a = f + s μ g c;  turning  (F + gained − J v̇)/m₀ = (a + taken + drift) M/m₀, above 1° and 0.3 m/s²
    λ(k) = 1 − 0.05 · 0.98ᵏ;  ln Λ = −½ (ln 2πS + tanh²(|e|/2σ)/S), σ running deviation of e, S = 1 + a² P/r
    w = Λ_s/(Λ_s + Λ_t) within 0.02…0.98
Slope: the filter of `pipeline_liu.py`, R adapted while all is well, strong tracking of θ while the alarm rings: never both.
"""

import math

import numpy as np
from common import GRAVITY, jacobian
from pipeline_parts import DT, Bend, LeastSquares, LoadWatch, Road, SageHusa, Samples, Tracking, readings, record_road

M0 = 2400.0
# mass0_kg 2400, q_theta 1e-5, wheel_speed_sd_mps 0.01, alarm 1.2, the rest by default.
Q_V, Q_THETA, SD = 1e-4, 1e-5, 0.01
STEEPEST = math.pi / 3.0
R_MASS = 0.02**2


def record(rng):
    return record_road(rng)


def time_law(k, size):
    return 1.0 - 0.05 * 0.98**k


def fresh(x):
    return LeastSquares(x, [0.4], time_law)


class Mass:
    def __init__(self):
        self.straight, self.turning = fresh([1.0]), fresh([1.0])
        for rls in (self.straight, self.turning):
            rls.prior = np.array([0.16])
        self.samples, self.bend, self.load = Samples(1.0, 2.0, 1.0), Bend(Road, 1.0), LoadWatch()
        self.weight, self.sums, self.turns = 1.0, np.zeros(2), 0

    def fused(self):
        return self.weight * found(self.straight) + (1.0 - self.weight) * found(self.turning)

    def step(self, z):
        self.bend.step(z, M0 * self.fused())
        s = self.samples
        if s.step(z) is None:
            return
        f, rate = s.f.value, s.speed.rate
        sine = min(max((f - rate) / GRAVITY, -0.7), 0.7)
        a = f + math.copysign(Road.mu * GRAVITY, s.speed.value) * math.sqrt(1.0 - sine**2)
        self.straight.update((s.force.value - Road.J * rate) / M0, a, R_MASS)
        self.sums = self.straight.lam * self.sums + [a, a * a]
        gained, taken, drift, steer, across = self.bend.filtered()
        self.weight = 1.0
        if abs(steer) >= math.radians(1.0) and abs(across) >= 0.3:
            self.turns += 1
            h = a + taken + drift
            self.turning.update((s.force.value + gained - Road.J * rate) / M0, h, R_MASS)
            s_log, t_log = likelihood(self.straight, a), likelihood(self.turning, h)
            self.weight = min(max(1.0 / (1.0 + math.exp(t_log - s_log)), 0.02), 0.98)
        if self.load.changed(self.straight.normalised / max(1.0, self.straight.spread())):
            self.straight, self.turning, self.sums = again(self.straight), again(self.turning), np.zeros(2)

    def value(self):
        mean, w = self.fused(), self.weight
        variance = 0.0
        for share, rls in ((w, self.straight), (1.0 - w, self.turning)):
            variance += share * (rls.widened()[0] + (found(rls) - mean) ** 2)
        level = math.hypot(0.3 * Road.mu * GRAVITY, 0.02) * abs(self.sums[0]) / (self.sums[1] + (0.02 / 0.4) ** 2)
        return M0 * mean, M0 * math.hypot(math.sqrt(variance), mean * level)


def found(rls):
    return min(max(rls.x[0], Road.low / M0), Road.high / M0)


def again(old):
    rls = fresh([1.0])
    rls.x = np.array([found(old)])
    return rls


def likelihood(rls, a):
    size = math.tanh(abs(rls.residual) / (2.0 * rls.spread() * math.sqrt(R_MASS)))
    S = 1.0 + a * a * rls.P[0, 0] / R_MASS
    return -0.5 * (math.log(2.0 * math.pi * S) + size**2 / S)


class Slope:
    def __init__(self):
        self.x, self.P = np.zeros(2), np.diag([SD**2, math.radians(5.0) ** 2])
        self.noise, self.tracking = SageHusa(SD**2, 0.998), Tracking(0.95, 1.5, 50.0, 1.2)
        self.carried, self.process, self.started = np.eye(2), 0.0, False
        self.fading, self.y, self.nis, self.stf = 1.0, 0.0, 0.0, 0

    def step(self, z, mass, net):
        if z.running:
            weight = mass * GRAVITY
            f = lambda x: np.array(
                [x[0] + DT * (net - weight * (np.sin(x[1]) + z.sign * Road.mu * np.cos(x[1]))) / (mass + Road.J), x[1]]
            )
            F = jacobian(f, self.x)
            self.x, self.P = f(self.x), F @ self.P @ F.T + np.diag([Q_V, Q_THETA]) * DT
            self.carried, self.process = F @ self.carried, self.process + Q_V * DT
        else:
            self.P = np.diag(np.diag(self.P) + [DT, 0.0])
            self.carried, self.process = np.eye(2), 0.0
            if z.moving:
                self.P[1, 1] = min(self.P[1, 1] + 3e-3 * DT, STEEPEST**2)
        if z.new:
            self.update(z)

    def update(self, z):
        if not self.started:
            self.x[0], self.started = z.v, True
        R = self.noise.R
        tracking = z.running and self.track(z.v - self.x[0], R)
        self.carried, self.process = np.eye(2), 0.0
        S = self.P[0, 0] + R
        self.y = z.v - self.x[0]
        self.nis = self.y**2 / S
        K = self.P[:, 0] / S
        self.x, self.P = self.x + K * self.y, self.P - np.outer(K, K) * S
        self.x[1] = min(max(self.x[1], -STEEPEST), STEEPEST)
        self.stf += tracking
        if z.running and not tracking:
            self.noise.see(z.v - self.x[0], self.P[0, 0])

    def track(self, y, R):
        explained = max(self.P[0, 0] - self.process, 0.0)
        self.fading = self.tracking.step(y, explained, self.process, R)
        added = np.diag([0.0, (self.fading - 1.0) * self.P[1, 1]])
        self.P = self.P + self.carried @ added @ self.carried.T
        shrink = np.sqrt(np.minimum(1.0, np.array([100.0, STEEPEST**2]) / np.diag(self.P)))
        self.P = shrink[:, None] * self.P * shrink[None, :]
        return self.tracking.on


def oracle(table):
    mass, slope, rows = Mass(), Slope(), []
    for z in readings(table, Road):
        mass.step(z)
        m = mass.value()
        slope.step(z, m[0], z.net - mass.bend.force(m[0]))
        own = [M0 * found(mass.straight), M0 * found(mass.turning), mass.weight, math.sqrt(slope.noise.R), math.sqrt(slope.P[1, 1])]
        rows.append([*m, slope.x[1], slope.x[0], slope.y, slope.nis, *own, slope.fading])
    assert mass.turns > 10 and 0 < slope.stf < len(rows) / 3, f"{mass.turns} turning samples, {slope.stf} updates of strong tracking"
    header = ["mass", "mass_sd", "grade", "speed", "innovation", "nis", "straight", "turning", "weight", "wheel_speed_sd"]
    return [*header, "slope_filter_sd", "fading"], rows[3::4]
