"""What the oracles of the pipelines share: recorded drives, signals, least squares, and the state filters' building blocks.

All from the published equations as the crate documents them (docs/src/methods/), in their plainest form: lists, dictionaries and
matrix inverses.
"""

import math

import numpy as np
from common import GRAVITY

DT = 0.05
COLUMNS = ["fresh", "t", "f", "across", "yaw", "steer", "torque1", "torque2", "speed1", "speed2", "brake"]


class Rail:
    """The train of the recorded drive, taken for a point."""

    drives, radius, gear, efficiency, J, mu = 2, 0.17, 20.0, 0.9, 1045.0, 0.02
    low, high, standstill, drag = 5000.0, 27000.0, 0.05, 0.0
    front = rear = rear_stiffness = None


class Road:
    """The road vehicle of Guo et al. 2024; what they do not tell is invented."""

    drives, radius, gear, efficiency, J, mu = 2, 0.335, 7.235, 0.95, 65.0, 0.0092
    low, high, standstill, drag = 1500.0, 3000.0, 0.3, 0.5 * 1.2258 * 0.332 * 2.574
    front, rear, rear_stiffness = 1.3, 1.5, 130e3


def record_rail(rng):
    """A start, speed changes on a wavy rail with constant curves, another load, a stop under the brake, a return backwards."""
    speed = lambda t: np.interp(t, [2, 5, 44, 46, 48, 50, 70], [0, 0.9, 0.9, 0, 0, -0.7, -0.7]) * (1 + 0.2 * math.sin(0.6 * t))
    grade = lambda s: 0.09 * math.sin(0.25 * s)
    mass = lambda t: 12e3 if t < 26 else 19e3
    return record(rng, Rail, speed, grade, mass, lambda t: 0.0, 0.06, 0.004, 0.01)


def record_road(rng):
    """A start on the level, hills at changing speed, bends from 15 s on, a stop under the brake, a start again."""
    speed = lambda t: np.interp(t, [1, 6, 40, 44, 46, 50, 70], [0, 9, 9, 0, 0, 8, 8]) * (1 + 0.15 * math.sin(0.8 * t))
    grade = lambda s: 0.0 if s < 60 else 0.1 * math.sin(0.03 * (s - 60))
    steer = lambda t: 0.0 if t < 15 else 0.12 * math.sin(0.3 * (t - 15))
    return record(rng, Road, speed, grade, lambda t: 2170.0, steer, 0.0, 0.02, 0.03)


def record(rng, car, speed, grade, mass, steer, curve, speed_sd, accel_sd):
    rows, s, held = [], 0.0, None
    for k in range(1200):
        t = DT * (k + 1)
        v, a = speed(t), (speed(t) - speed(t - 1e-3)) / 1e-3
        s += v * DT
        m, theta, delta = mass(t), grade(s), steer(t)
        yaw = delta * v / 2.8 if car is Road else 0.0
        brake = 1.0 if a < -0.15 and t > 40 else 0.0
        force = (m + car.J) * a + m * GRAVITY * (math.sin(theta) + np.sign(v) * car.mu * math.cos(theta))
        force += car.drag * v * abs(v) + 0.5 * m * v * yaw * math.sin(delta)
        force *= 1.0 - brake
        loss = 1.0 / car.efficiency if force * v >= 0 else car.efficiency
        torque = 0.5 * force * car.radius / car.gear * loss
        f = a + GRAVITY * math.sin(theta) + 0.01 + accel_sd * rng.standard_normal()
        if k % 2 == 0:
            noise = rng.standard_normal(4)
            torques = [torque * (1 + 0.01 * noise[0]) + 0.5 * noise[1], 0.98 * torque]
            held = [*torques, v + speed_sd * noise[2], v + speed_sd * noise[3]]
        if car is Rail:
            yaw = curve * 0.5 * (held[2] + held[3])
        across = v * yaw + accel_sd * rng.standard_normal()
        rows.append([k % 2 == 0, *np.round([t, f, across, yaw, delta, *held, brake], 6)])
    return COLUMNS, rows


class Reading:
    """Channels merged: the sum of the torques, the middle of the speeds."""

    def __init__(self, row, car):
        self.new, self.t, self.f, self.across, self.yaw, self.steer = row[:6]
        self.front = row[6]
        self.torque, self.v, brake = row[6] + row[7], 0.5 * (row[8] + row[9]), row[10]
        self.moving = abs(self.v) > car.standstill
        self.running = self.moving and brake <= 0.001
        self.sign = -1.0 if self.v < 0 else 1.0
        self.net = traction(self.torque, self.v, car) - car.drag * self.v * abs(self.v)
        self.curvature = min(abs(self.yaw / self.v), 0.5) if abs(self.v) > 0.1 else 0.0


def readings(table, car):
    return [Reading(row, car) for row in np.column_stack([table[name] for name in COLUMNS])]


def traction(torque, v, car):
    return torque * car.gear / car.radius * (car.efficiency if torque * v >= 0 else 1.0 / car.efficiency)


def lag(dt, tau):
    return 1.0 - math.exp(-dt / tau)


class LowPass:
    """Two first-order sections, and the rate of the second."""

    def __init__(self, hz, dt=DT):
        self.tau, self.dt, self.first, self.value, self.rate = 1.0 / (2.0 * math.pi * hz), dt, None, 0.0, 0.0

    def step(self, u):
        if self.first is None:
            self.first = self.value = u
            return
        share = lag(self.dt, self.tau)
        self.first += share * (u - self.first)
        before, self.value = self.value, self.value + share * (self.first - self.value)
        self.rate = (self.value - before) / self.dt


class Samples:
    """Force, speed, specific force and curvature behind one low-pass; a sample every 1/rate s once settled."""

    def __init__(self, cutoff, rate, settle):
        self.force, self.speed, self.f, self.curve = (LowPass(cutoff) for _ in range(4))
        self.rate, self.settle, self.running, self.since = rate, settle, 0.0, 0.0

    def step(self, z):
        """The time since the last sample if one is due, else None."""
        for low_pass, u in [(self.force, z.net), (self.speed, z.v), (self.f, z.f), (self.curve, z.curvature)]:
            low_pass.step(u)
        self.running = self.running + DT if z.running else 0.0
        self.since += DT
        if not self.settled() or self.since * self.rate < 1.0 - 1e-9:
            return None
        period, self.since = self.since, 0.0
        return period

    def settled(self):
        return self.running > 0.0 and self.running >= self.settle


class LeastSquares:
    """χ, P with forgetting; `factor(k, size)` gives λ (or one for each parameter) at update k for a residual of `size` deviations, or with
    `own_deviation="residual"` for the size of the residual as it is."""

    def __init__(self, x, sd, factor, own_deviation=False):
        self.x, self.prior = np.array(x, float), np.array(sd, float) ** 2
        self.P, self.factor, self.own = np.diag(self.prior), factor, own_deviation
        self.variance, self.tie, self.last, self.k = 1.0, 0.0, 0.0, 0
        self.residual = self.normalised = 0.0
        self.lam = 1.0

    def update(self, y, h, r, remember=False):
        h = np.atleast_1d(h).astype(float)
        self.k += 1
        self.residual = y - h @ self.x
        self.normalised = n = self.residual / math.sqrt(r + h @ self.P @ h)
        size = abs(n) / math.sqrt(self.variance) if self.own else abs(n)
        if self.own == "residual":
            size = abs(self.residual)
        lam = 1.0 if remember else self.factor(self.k, size)
        self.lam = np.min(lam)
        if np.ndim(lam):
            p = np.diag(self.P) / lam
            self.x = self.x + p * h * self.residual / (r + np.sum(p * h * h))
            self.P = np.diag(p * r / (r + p * h * h))
        else:
            K = self.P @ h / (lam * r + h @ self.P @ h)
            self.x = self.x + K * self.residual
            self.P = (self.P - np.outer(K, h @ self.P)) / lam
        shrink = np.sqrt(np.minimum(1.0, np.divide(self.prior, np.diag(self.P), where=np.diag(self.P) > 0, out=np.ones(len(h)))))
        self.P = shrink[:, None] * self.P * shrink[None, :]
        memory, cap = min(50.0, self.k + 1.0), 25.0 * self.variance
        self.tie += (min(max(n * self.last, -cap), cap) - self.tie) / memory
        self.variance += (min(n * n, cap) - self.variance) / memory
        self.last = n

    def spread(self):
        return math.sqrt(self.variance)

    def correlation(self):
        rho = 0.0 if self.k < 10 else min(max(self.tie / self.variance, 0.0), 0.9)
        return (1.0 + rho) / (1.0 - rho)

    def widened(self):
        """Variances, widened where residuals are too large or hang together, but not beyond the prior's."""
        return np.minimum(np.diag(self.P) * max(1.0, self.variance) * self.correlation(), self.prior)

    def covariance(self):
        """The whole covariance with these variances."""
        factor = np.sqrt(self.widened() / np.diag(self.P))
        widening = max(1.0, self.variance) * self.correlation()
        shrink = factor / math.sqrt(widening)
        return widening * shrink[:, None] * self.P * shrink[None, :]

    def other_load(self, share):
        """Forgets the first parameter and loosens the others by a share of their prior variances, up to these."""
        self.P[0, :] = self.P[:, 0] = 0.0
        self.P += np.diag(np.append(self.prior[0], share * self.prior[1:]))
        shrink = np.sqrt(np.minimum(1.0, self.prior / np.diag(self.P)))
        self.P = shrink[:, None] * self.P * shrink[None, :]


def dynamic(first, floor, sharpness):
    return lambda k, size: first if k <= 10 else floor + (1.0 - floor) * math.exp(-sharpness * size)


class LoadWatch:
    """Two-sided cumulated sum (Page 1954) of residuals beyond 1.5 deviations; rings at `level`."""

    def __init__(self, level=20.0):
        self.up = self.down = 0.0
        self.level, self.changes = level, 0

    def changed(self, n):
        self.up, self.down = max(0.0, self.up + n - 1.5), max(0.0, self.down - n - 1.5)
        if max(self.up, self.down) <= self.level:
            return False
        self.up = self.down = 0.0
        self.changes += 1
        return True


class SageHusa:
    """One measurement noise R between a hundredth and a hundred times its start."""

    def __init__(self, R, b):
        self.R, self.start, self.b, self.k = R, R, b, 0

    def see(self, residual, variance):
        d = (1.0 - self.b) / (1.0 - self.b ** (1.0 / (1.0 - self.b) + self.k))
        self.k += 1
        R = (1.0 - d) * self.R + d * (residual**2 + variance)
        self.R = min(max(R, 0.01 * self.start), 100.0 * self.start)


class Tracking:
    """Fading factor and alarm of strong tracking (`strong_tracking.py` has the equations)."""

    def __init__(self, memory, weakening, most, level):
        self.memory, self.weakening, self.most, self.level = memory, weakening, most, level
        self.V, self.size, self.tie, self.last, self.calm, self.on = None, 1.0, 0.0, None, 0, False

    def step(self, y, M, q, R):
        """λ, or 1 while the alarm is silent."""
        y, M, q, R = (np.atleast_1d(y), *(np.atleast_2d(A) for A in (M, q, R)))
        V = np.outer(y, y)
        self.V = V if self.V is None else (self.memory * self.V + V) / (1.0 + self.memory)
        inverse = np.linalg.inv(M + q + R)
        excess, explained = np.trace(inverse @ (self.V - q - self.weakening * R)), np.trace(inverse @ M)
        lam = min(max(excess / explained, 1.0), self.most) if explained > 1e-12 else 1.0
        return lam if self.ring(y, inverse / len(y)) else 1.0

    def ring(self, y, inverse):
        most = 10.0 * self.level
        tie = 0.0 if self.last is None else self.last @ inverse @ y
        self.size = 0.95 * self.size + 0.05 * min(y @ inverse @ y, most)
        self.tie = 0.95 * self.tie + 0.05 * min(max(tie, -most), most)
        self.last, self.calm = y, self.calm + 1 if self.size < 1.3 else 0
        if self.size > self.level and self.tie > 0.5 * self.size:
            self.on = True
        elif self.calm >= 20 or self.tie < 0.0:
            self.on = False
        return self.on
