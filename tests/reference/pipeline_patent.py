"""`mmrls_sh_stf_robust` (patent CN 111507019 B) in the core of `supervised_parts.py`, on a drive of the train of `fusion.py` on a road with bends.

m the tare, ū₀, ū₁ the means of u = g sin θ + b under tare and load:
    straight  (F − J v̇ − m (ū₀ − ū₁))/m₀ = a M/m₀, a = v̇ + ū₁ + s μ g c
    turning   (F + gained − J v̇ − m (ū₀ − ū₁))/m₀ = (a + taken) M/m₀, above 1° and 0.3 m/s²
    λ(k) = 1 − 0.05 · 0.98ᵏ;  ln Λ = −½ (ln 2πS + tanh²(|e|/2σ)/S), σ running deviation of e, S = 1 + a² P/r;  w = Λ_s/(Λ_s + Λ_t) within 0.02…0.98
Slope: `Slope`; R adapted while all is well, strong tracking of θ while the alarm rings: never both.
"""

import math

import numpy as np
from common import GRAVITY
from fusion import ARM, COLUMNS, DT, Train, clip
from pipeline_parts import LeastSquares, LoadWatch, Tracking
from supervised_parts import HEADER, Road, Slope, Supervised, TwoStages, run

# mass0_kg 21000, load_change 5, q_theta 1e-5, alarm 1.2, the rest by default.
M0 = 21e3


def record(rng):
    """A roll back onto road that nothing has read, a start, changes of speed on a wavy road, bends from 8 s on, wheels that slip together, a stop under the brake,
    where it is loaded, a start."""
    wanted = lambda t: np.interp(t, [0, 0.5, 1.5, 2, 5, 22, 24, 25, 27], [0, -0.25, -0.25, 0, 1.5, 1.5, 0, 0, 1.4]) * (1.0 + 0.15 * math.sin(0.8 * t))
    grade = lambda s: 0.0 if s < 3.0 else 0.06 * (1.0 - math.cos(0.4 * (s - 3.0)))
    rows, s, r0 = [], 0.0, 0.0
    L, tare = Road.front + Road.rear, [(0.0, 2e3), (3.0, 1.5e3), (7.0, 1.5e3), (9.0, 1.5e3), (10.0, 1.5e3)]
    for k in range(3000):
        t = DT * (k + 1)
        v, a = wanted(t), (wanted(t) - wanted(t - 1e-3)) / 1e-3
        before, s = grade(s), s + v * DT
        pitch, steer = grade(s), 0.0 if t < 8.0 else 0.4 * math.sin(0.5 * (t - 8.0))
        turn, r = (pitch - before) / DT, v * math.tan(steer) / L
        across = v * r
        masses = [*tare, *((place, 4.5e3 if t < 24.5 else 7e3) for place in (4.0, 6.0))]
        M = sum(mass for _, mass in masses)
        drift = (Road.rear * r - v * M * across * Road.front / L / Road.rear_stiffness) * r
        brake = 1.0 if 22.0 < t < 24.5 else 0.0
        downhill = GRAVITY * sum(m * math.sin(grade(s - behind)) for behind, m in masses)
        force = (M + Train.J) * a + downhill + M * GRAVITY * Train.mu + Road.drag * v * v
        force = (1.0 - brake) * (force + M * (across * Road.rear / L * math.tan(steer) - drift))
        torque = 0.5 * force * Train.radius / Train.gear * (1.0 / Train.efficiency if force >= 0.0 else Train.efficiency)
        n = rng.standard_normal(14)
        fx = a + GRAVITY * math.sin(pitch) - drift + 0.012 + 0.01 * n[0] - ARM * (r * r + turn * turn)
        fy, fz = across + ARM * (r - r0) / DT + 0.01 * n[1], GRAVITY * math.cos(pitch) + v * turn + 0.01 * n[2]
        gyro = [4e-4 * n[3] + math.sin(pitch) * r, -turn + 4e-4 * n[4], math.cos(pitch) * r + 4e-4 * n[5]]
        r0 = r
        slip = 0.4 if 1500 <= k < 1560 else 0.0
        speeds = [v + slip + 0.004 * n[6], 1.002 * v + slip + 0.004 * n[7]]
        torques = [torque * (1 + 0.01 * n[8]) + 0.2 * n[9], torque * (1 + 0.01 * n[10]) + 0.2 * n[11]]
        rows.append(np.round([t, fx, fy, fz, *gyro, *torques, *speeds, brake, steer + 1e-4 * n[12]], 7))
    return [*COLUMNS, "steer"], rows


def time_law(k, size):
    return 1.0 - 0.05 * 0.98**k


def fresh(x):
    return LeastSquares([x], [0.4], time_law)


def found(rls):
    return clip(rls.x[0], Train.low / M0, Train.high / M0)


def likelihood(rls, a, r):
    size = math.tanh(abs(rls.residual) / (2.0 * rls.spread() * math.sqrt(r)))
    S = 1.0 + a * a * rls.P[0, 0] / r
    return -0.5 * (math.log(2.0 * math.pi * S) + size**2 / S)


class Mass:
    def __init__(self):
        self.straight, self.turning, self.weight, self.turns = fresh(1.0), fresh(1.0), 1.0, 0
        self.load, self.sums, self.bias_sd, self.valid = LoadWatch(5.0), np.zeros(2), 0.02, True

    def sample(self, now):
        u, doubt = now.whole(M0 * self.fused())
        tare, load = now.u
        a, r = now.a + load + now.sign * Train.mu * GRAVITY * now.cosine(u), 0.02**2 + doubt**2
        force = now.F - Train.J * now.a - Train.tare * (tare - load)
        self.straight.update(force / M0, a, r)
        self.sums = self.straight.lam * self.sums + [a, a * a]
        gained, taken, _, steer, across = now.bend
        self.weight = 1.0
        if abs(steer) >= math.radians(1.0) and abs(across) >= 0.3:
            self.turns += 1
            self.turning.update((force + gained) / M0, a + taken, r)
            s, t = likelihood(self.straight, a, r), likelihood(self.turning, a + taken, r)
            self.weight = clip(1.0 / (1.0 + math.exp(t - s)), 0.02, 0.98)
        self.valid = all(found(rls) == rls.x[0] for rls in (self.straight, self.turning))
        if self.load.changed(self.straight.normalised / max(1.0, self.straight.spread())):
            self.straight, self.turning, self.sums = fresh(found(self.straight)), fresh(found(self.turning)), np.zeros(2)

    def fused(self):
        return self.weight * found(self.straight) + (1.0 - self.weight) * found(self.turning)

    def mass(self):
        mean, variance = self.fused(), 0.0
        for share, rls in ((self.weight, self.straight), (1.0 - self.weight, self.turning)):
            variance += share * (rls.widened()[0] + (found(rls) - mean) ** 2)
        level = math.hypot(0.3 * Train.mu * GRAVITY, self.bias_sd) * abs(self.sums[0]) / (self.sums[1] + (0.02 / 0.4) ** 2)
        return M0 * mean, M0 * math.hypot(math.sqrt(variance), mean * level)

    def mu(self, curvature):
        return Train.mu

    def slope_sd(self, F, cosine, s, by_theta, curvature):
        mass, sd = self.mass()
        return math.hypot(F / (mass * GRAVITY) * sd / mass, 0.3 * Train.mu * cosine) / by_theta

    def unmodelled(self):
        return 0.02 * math.sqrt(max(self.straight.variance - 1.0, 0.0))


def oracle(table):
    mass, slope = Mass(), Slope(0.998, Tracking(0.95, 1.5, 50.0, 1.2), 1e-5)
    method = TwoStages(mass, slope)
    models = lambda: [M0 * found(mass.straight), M0 * found(mass.turning), mass.weight, mass.load.changes]
    rows = run(Supervised(method, 1.0, 2.0, 1.0, Road), lambda: [*models(), *method.own(), slope.fading], table, {"without IMU"})
    assert mass.turns > 5 and mass.load.changes > 0 and 0 < slope.tracked < 1500, f"{mass.turns}, {mass.load.changes}, {slope.tracked}"
    header = [*HEADER, "straight", "turning", "weight", "load_changes", "wheel_speed_sd", "method_grade", "method_grade_sd", "fading"]
    return header, rows
