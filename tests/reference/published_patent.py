"""`mmrls_sh_stf`: the patent CN 111507019 B as published (its formulas reconstructed), errata corrected, on a recorded drive.

Mass: F_t − F_w = m a_e straight, F_tt = m a_e turning, a_e = s g f + f_imu + (J/m₀) v̇, F_tt = F_t cos δ − F_w − c α sin δ,
α = δ − β − l_V ψ̇/v, β = l_H δ/L; λ = 1 − 0.05 · 0.98ᵗ; weights by exp(−tanh²(|e|/2σ)/2S)/√(2πS), S = 1 + h² P/σ².
Slope: x = [v, i], v̇ = ((F_t − F_w)/m − s g f − g i)/(1 + J/m); strong tracking where y² > γ S, else Sage-Husa for R.
"""

import math

import numpy as np
from common import GRAVITY
from pipeline_parts import DT, LeastSquares, LowPass, Road, Samples, readings, traction, record_road
from published_parts import Kalman, Noise, cut

record = record_road
M0 = 2400.0
SIGMA, GAMMA, RHO, BETA = 0.03, 4.0, 0.95, 1.5
SPEED_SD, Q = 0.01, np.array([1e-4, 1e-5])
# mass0_kg 2400, wheel_speed_sd_mps 0.01, q_i 1e-5, gamma 4, the rest by default.
STEEPEST = math.pi / 3.0
FRONT_STIFFNESS = 120e3


class Mass:
    def __init__(self):
        self.rls, self.likelihood = LeastSquares([1.0], [0.5], lambda k, size: 1.0 - 0.05 * 0.98**k), 1.0

    def learn(self, y, h):
        S = 1.0 + h**2 * self.rls.P[0, 0] / SIGMA**2
        self.rls.update(y, h, SIGMA**2)
        size = math.tanh(abs(y - h * self.rls.x[0]) / (2.0 * SIGMA))
        self.likelihood = math.exp(-0.5 * size**2 / S) / math.sqrt(2.0 * math.pi * S)


class Masses:
    def __init__(self):
        self.straight, self.turning, self.weight = Mass(), Mass(), 1.0
        self.samples, self.lost, self.turns = Samples(1.0, 10.0, 0.0), LowPass(1.0), 0

    def step(self, z):
        steer, lost = 0.0, 0.0
        if z.running and z.v > 1.0:
            steer = min(max(z.steer, -0.7), 0.7)
            slip = steer - Road.rear / (Road.front + Road.rear) * steer - Road.front * z.yaw / z.v
            F = traction(z.torque, z.v, Road)
            lost = F - (F * math.cos(steer) - FRONT_STIFFNESS * slip * math.sin(steer))
        self.lost.step(lost)
        s = self.samples
        if s.step(z) is None:
            return
        a_e = z.sign * GRAVITY * Road.mu + s.f.value + Road.J / M0 * s.speed.rate
        self.straight.learn(s.force.value / M0, a_e)
        self.weight = 1.0
        if abs(steer) >= math.radians(1.0):
            self.turns += 1
            self.turning.learn((s.force.value - self.lost.value) / M0, a_e)
            self.weight = self.straight.likelihood / (self.straight.likelihood + self.turning.likelihood)

    def found(self):
        s, t, w = self.straight.rls, self.turning.rls, self.weight
        m = w * s.x[0] + (1.0 - w) * t.x[0]
        variance = w * (s.widened()[0] + (s.x[0] - m) ** 2) + (1.0 - w) * (t.widened()[0] + (t.x[0] - m) ** 2)
        return M0 * m, M0 * math.sqrt(variance)


def run(zs):
    mass = Masses()
    slope = Kalman([0.0, 0.0], [SPEED_SD, math.radians(5.0)], Noise(SPEED_SD**2, 0.97))
    V, fading, since, jumps = None, 1.0, 0.0, 0
    for z in zs:
        mass.step(z)
        since += DT
        if not z.running:
            slope.started = False
        elif z.new:
            dt, since = min(since, 1.0), 0.0
            if not slope.start(z.v):
                M = min(max(mass.found()[0], Road.low), Road.high)
                A = np.array([[1.0, -dt * GRAVITY / (1.0 + Road.J / M)], [0.0, 1.0]])
                u = dt * (z.net / M - z.sign * GRAVITY * Road.mu) / (1.0 + Road.J / M)
                slope.x = A @ slope.x + [u, 0.0]
                carried, R = A @ slope.P @ A.T, slope.noise.R
                y = z.v - slope.x[0]
                V = y**2 if V is None else (RHO * V + y**2) / (1.0 + RHO)
                jumped = y**2 > GAMMA * (carried[0, 0] + Q[0] * dt + R)
                jumps += jumped
                fading = max(1.0, (V - Q[0] * dt - BETA * R) / carried[0, 0]) if jumped else 1.0
                slope.P = fading * carried + np.diag(Q) * dt
                assert slope.P[1, 1] < 100.0
                slope.update(z.v, adapt=not jumped)
        found = cut(mass.found(), Road.low, Road.high)
        i = min(max(slope.x[1], -0.87), 0.87)
        grade = cut((math.asin(i), slope.sd(1) / math.sqrt(1.0 - i * i)), -STEEPEST, STEEPEST)
        masses = [M0 * mass.straight.rls.x[0], M0 * mass.turning.rls.x[0]]
        yield [*found, *grade, slope.x[0], slope.y, slope.nis, *masses, mass.weight, fading, math.sqrt(slope.noise.R)]
    assert mass.turns > 50 and jumps > 5, f"{mass.turns} turns, {jumps} jumps"


def oracle(table):
    header = ["mass", "mass_sd", "grade", "grade_sd", "speed", "innovation", "nis", "straight", "turning", "weight", "fading", "r_sd"]
    return header, list(run(readings(table, Road)))[3::4]
