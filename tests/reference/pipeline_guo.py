"""`imm_stf_robust` (Guo et al. 2024) on one recorded drive of a road vehicle with bends.

Mass: Δ(F + gained − J v̇) = M Δ(v̇ + taken), differences of samples 1/4 s apart, behind two gates.
Slope: x = [v, a, i], z = [f + drift, v] = [a + g i, v];
    kinematic  a, i walk at random;  dynamic  a = ((F − bend)/M − s μ g c − g i)/(1 + J/M), c from the combined i
each with strong tracking of i, interacting with transitions that vary (recursion as printed).
"""

import math

import numpy as np
from common import GRAVITY
from pipeline_parts import DT, Bend, LeastSquares, Road, Samples, Tracking, readings, record_road

M0 = 2230.0
Q_V, Q_A, Q_I, FORCE_SD, ACCEL_SD, SPEED_SD = 1e-6, 0.3, 1e-4, 0.03, 0.02, 0.01
# mass0_kg 2230, q_i 1e-4, accel_sd_mps2 0.02, wheel_speed_sd_mps 0.01, alarm 1.2, slope_gate_mps2 0.2, the rest by default.
ALARM = 1.2
STAY = 0.95
H = np.array([[0.0, 1.0, GRAVITY], [1.0, 0.0, 0.0]])
R = np.diag([ACCEL_SD**2, SPEED_SD**2])
KINEMATIC, DYNAMIC = 0, 1
STEEPEST = 0.87


def record(rng):
    return record_road(rng)


class Mass:
    def __init__(self):
        self.rls = LeastSquares([1.0], [0.4], lambda k, size: 0.999)
        self.samples, self.bend = Samples(2.0, 4.0, 0.5), Bend(Road, 2.0)
        self.last, self.used = None, 0

    def step(self, z):
        self.bend.step(z, self.found())
        s = self.samples
        if s.step(z) is not None:
            gained, taken, drift, _, _ = self.bend.filtered()
            now = np.array([s.force.value + gained, s.speed.rate, taken, s.f.value - s.speed.rate + drift])
            if self.last is not None:
                self.difference(*(now - self.last))
            self.last = now
        if not s.settled():
            self.last = None

    def difference(self, force, faster, taken, slope):
        if abs(slope) < 0.2 and abs(force) > 0.05 * M0:
            self.used += 1
            self.rls.update((force - Road.J * faster) / M0, faster + taken, 0.03**2)

    def found(self):
        return min(max(M0 * self.rls.x[0], Road.low), Road.high)

    def value(self):
        return self.found(), M0 * math.sqrt(self.rls.widened()[0])


def mixture(weights, beliefs):
    x = sum(w * b[0] for w, b in zip(weights, beliefs))
    return x, sum(w * (b[1] + np.outer(b[0] - x, b[0] - x)) for w, b in zip(weights, beliefs))


class Models:
    def __init__(self):
        start = (np.zeros(3), np.diag([SPEED_SD, 0.5, math.radians(5.0)]) ** 2)
        self.models, self.beliefs = [KINEMATIC, DYNAMIC], [start] * 2
        self.mu = np.full(2, 0.5)
        self.pi = np.array([[STAY, 1 - STAY], [1 - STAY, STAY]])
        self.tracking = [Tracking(0.95, 2.0, 50.0, ALARM) for _ in self.models]
        self.fading, self.started, self.since, self.last = [1.0] * 2, False, 0.0, (0.0, 0.0)

    def linear(self, model, z, mass, bend, dt):
        M, sd = mass
        if model == KINEMATIC or not z.running:
            A = np.array([[1.0, dt, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
            return A, np.zeros(3), np.diag([Q_V, Q_A, Q_I]) * dt
        inertia = 1.0 + Road.J / M
        i = min(max(mixture(self.mu, self.beliefs)[0][2], -STEEPEST), STEEPEST)
        per_mass = (z.net - bend.force(M)) / M
        u = (per_mass - z.sign * Road.mu * GRAVITY * math.sqrt(1.0 - i * i)) / inertia
        q = (FORCE_SD**2 + (per_mass * min(sd / M, 1.0)) ** 2) / inertia**2
        A = np.array([[1.0, dt, 0.0], [0.0, 0.0, -GRAVITY / inertia], [0.0, 0.0, 1.0]])
        return A, np.array([0.0, u, 0.0]), np.diag([Q_V * dt, q, Q_I * dt])

    def step(self, z, mass, bend):
        self.since += DT
        if not z.new:
            return
        dt, self.since = self.since, 0.0
        linear = [self.linear(model, z, mass, bend, dt) for model in self.models]
        seen = np.array([z.f + bend.now[2], z.v])
        if not self.started:
            self.beliefs = [(np.array([z.v, *x[1:]]), P) for x, P in self.beliefs]
            self.started = True
        c = self.mu @ self.pi
        mixed = [mixture(self.pi[:, j] * self.mu / c[j], self.beliefs) for j in range(len(c))]
        logs = []
        for j, ((A, u, Q), (x, P)) in enumerate(zip(linear, mixed)):
            x = A @ x + u
            y = seen - H @ x
            self.fading[j] = self.tracking[j].step(y, H @ A @ P @ A.T @ H.T, H @ Q @ H.T, R)
            P = P + np.diag([0.0, 0.0, (self.fading[j] - 1.0) * P[2, 2]])
            P = A @ P @ A.T + Q
            shrink = np.sqrt(np.minimum(1.0, np.array([100.0, 100.0, STEEPEST**2]) / np.diag(P)))
            P = shrink[:, None] * P * shrink[None, :]
            S = H @ P @ H.T + R
            K = P @ H.T @ np.linalg.inv(S)
            nis = y @ np.linalg.inv(S) @ y
            logs.append(-0.5 * (nis + math.log(np.linalg.det(2.0 * math.pi * S))))
            if logs[j] == max(logs):
                self.last = (y[1], nis / 2.0)
            x = x + K @ y
            x[2] = min(max(x[2], -STEEPEST), STEEPEST)
            B = np.eye(3) - K @ H
            self.beliefs[j] = (x, B @ P @ B.T + K @ R @ K.T)
        before = self.mu
        mu = c * np.exp(np.array(logs) - max(logs))
        mu = np.maximum(mu / mu.sum(), 1e-4)
        self.mu = mu / mu.sum()
        self.pi = self.pi * np.exp(self.mu - before)
        self.pi /= self.pi.sum(axis=1, keepdims=True)


def run(zs):
    mass, slope, fading = Mass(), Models(), 0
    for z in zs:
        mass.step(z)
        slope.step(z, mass.value(), mass.bend)
        x, P = mixture(slope.mu, slope.beliefs)
        sd = math.hypot(math.sqrt(P[2, 2]), 0.01 / GRAVITY) / math.sqrt(1.0 - x[2] ** 2)
        fading += max(slope.fading) > 1.0
        bend = mass.bend.force(mass.value()[0])
        yield [*mass.value(), math.asin(x[2]), sd, x[0], *slope.last, slope.fading[-1], bend, slope.mu[-1]]
    assert mass.used > 30 and fading > 0, f"{mass.used} differences, {fading} steps of fading"


def oracle(table):
    header = ["mass", "mass_sd", "grade", "grade_sd", "speed", "innovation", "nis", "fading", "bend", "dynamic_probability"]
    return header, list(run(readings(table, Road)))[3::4]
