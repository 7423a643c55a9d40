"""`dffrls_aekf`, `rls_ekf`, `ffrls`, `joint_ekf` and `resistance_dffrls`: Liu et al. 2023 as published, errata corrected, on a recorded
drive.

Mass: y = [(F − J v̇)/m₀, −g √(1 + μ²)] · [m₀/M, χ₂], y = f of the accelerometer (ffrls: v̇ of the wheels, and χ₂ = sin(θ + atan μ)),
λ = δ + (1 − δ) exp(−σ |e|). Slope: x = [v, θ], v̇ = (F/M − s μ g cos θ − g sin θ)/(1 + J/M). R from residuals. Resistance: eq. 8–15.
Cutoff 1 Hz, a sample each step; P₀ from standard deviations 0.5 and 0.1 over a residual of 0.02 m/s².
"""

import math

import numpy as np
from common import GRAVITY
from pipeline_parts import DT, LowPass, Rail, Samples, readings, record_rail
from published_parts import Kalman, Noise, by_residual, cut, regression

record = record_rail
M0 = 15e3
Q, SD = np.diag([1e-4, 3e-4]) * DT, 0.005
STEEPEST = math.pi / 3.0


class Mass:
    def __init__(self, factor, by_wheels):
        self.mu = Rail.mu
        self.sine = self.mu / math.sqrt(1.0 + self.mu**2)
        self.rls = regression([1.0, self.sine], [0.5, 0.1], factor)
        self.samples, self.by_wheels, self.sign = Samples(1.0, 200.0, 0.0), by_wheels, 1.0

    def step(self, z):
        s = self.samples
        if abs(z.v) > Rail.standstill:
            self.sign = math.copysign(1.0, z.v)
        if s.step(z) is None:
            return
        rate = s.speed.rate
        alpha = [(s.force.value - Rail.J * rate) / M0, -GRAVITY * math.sqrt(1.0 + self.mu**2)]
        self.rls.update(rate if self.by_wheels else s.f.value, alpha, 0.02**2)

    def value(self):
        chi = min(max(self.rls.x[0], M0 / Rail.high), M0 / Rail.low)
        return [M0 / chi, M0 / chi**2 * math.sqrt(self.rls.widened()[0])]

    def slope(self):
        theta = math.asin(min(max(self.rls.x[1], -1.0), 1.0)) - self.sign * math.asin(self.sine)
        return theta, math.sqrt(self.rls.widened()[1]) / max(math.cos(theta), 0.1)


def rate(F, mass, theta, resistance):
    return (F / mass - resistance * GRAVITY * np.cos(theta) - GRAVITY * np.sin(theta)) / (1.0 + Rail.J / mass)


def two_stages(zs, factor, kappa):
    mass, slope, cuts = Mass(factor, False), Kalman([0.0, 0.0], [SD, math.radians(5.0)], Noise(SD**2, kappa)), 0
    for z in zs:
        mass.step(z)
        if z.running:
            M = mass.value()[0]
            slope.predict(lambda x: np.array([x[0] + DT * rate(z.net, M, x[1], z.sign * Rail.mu), x[1]]), Q)
            if z.new:
                slope.start(z.v)
                slope.update(z.v)
        else:
            slope.started = False
        cuts += not Rail.low < M0 / mass.rls.x[0] < Rail.high
        chi, R = mass.rls.x, math.sqrt(slope.noise.R)
        grade = cut((slope.x[1], slope.sd(1)), -STEEPEST, STEEPEST)
        yield [*mass.value(), *grade, slope.x[0], slope.y if slope.seen else mass.rls.residual, slope.nis, mass.rls.lam if mass.rls.k else 0.0, *chi, R]
    print(f"    mass at a limit in {cuts} of {len(zs)} steps")


def coupled(zs):
    mass = Mass(lambda k, size: 0.98, True)
    for z in zs:
        mass.step(z)
        grade = cut(mass.slope(), -STEEPEST, STEEPEST)
        yield [*mass.value(), *grade, mass.samples.speed.value, mass.rls.residual, 0.0, mass.rls.lam if mass.rls.k else 0.0, *mass.rls.x, SD]


def joint(zs):
    w0 = 1e4 / M0
    slope = Kalman([0.0, 0.0, w0], [SD, math.radians(5.0), 0.4 * w0], Noise(SD**2))
    for z in zs:
        if z.running:
            drive = lambda x: rate(z.net, 1e4 / x[2], x[1], z.sign * Rail.mu)
            slope.predict(lambda x: np.array([x[0] + DT * drive(x), x[1], x[2]]), np.diag([*np.diag(Q), 0.0]))
            if z.new:
                slope.start(z.v)
                slope.update(z.v)
                slope.x[2] = min(max(slope.x[2], 1e2 / Rail.high), 1e6 / Rail.low)
        else:
            slope.started = False
        w = min(max(slope.x[2], 1e4 / Rail.high), 1e4 / Rail.low)
        mass = [1e4 / w, 1e4 / w**2 * slope.sd(2)]
        grade = cut((slope.x[1], slope.sd(1)), -STEEPEST, STEEPEST)
        yield [*mass, *grade, slope.x[0], slope.y, slope.nis, slope.x[2], slope.sd(2), 0.0, SD]


def resistance(zs):
    rls, s, known = regression([0.0], [0.5], by_residual(0.98, 0.95, 5.0)), Samples(1.0, 200.0, 0.0), False
    slope = 0.0
    for z in zs:
        if s.step(z) is not None:
            known, v_dot = True, s.speed.rate
            sine = min(max((s.f.value - v_dot) / GRAVITY, -0.7), 0.7)
            h = z.sign * GRAVITY * math.sqrt(1.0 - sine**2)
            rls.update((s.force.value - Rail.J * v_dot) / M0 - s.f.value, h, 0.02**2)
            slope = math.asin((s.f.value - v_dot) / GRAVITY)
        mass, grade = [M0, 0.0], cut((slope, 0.02 / GRAVITY), -STEEPEST, STEEPEST)
        lam = rls.lam if known else 0.0
        yield [*mass, *grade, s.speed.value, rls.residual, rls.normalised**2, rls.x[0], math.sqrt(rls.widened()[0]), lam, SD]


def oracle(table):
    zs = readings(table, Rail)
    runs = [
        two_stages(zs, by_residual(0.98, 0.95, 5.0), 0.966),
        two_stages(zs, lambda k, size: 1.0, None),
        coupled(zs),
        joint(zs),
        resistance(zs),
    ]
    header = ["pipeline", "mass", "mass_sd", "grade", "grade_sd", "speed", "innovation", "nis", "own1", "own2", "own3", "r_sd"]
    return header, [[number, *row] for number, run in enumerate(runs) for row in list(run)[3::4]]
