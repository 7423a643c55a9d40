"""`mmrls_sh_stf_robust` (patent CN 111507019 B) on the drive of `fusion.py`, in the core of `supervised_parts.py`.

On a rail the straight model stands alone (the turning one is in `published_patent.py`), m the tare, ū₀, ū₁ the means of g sin θ under tare and load:
    (F − J v̇ − m (ū₀ − ū₁))/m₀ = a M/m₀, a = v̇ + ū₁ + s μ g c, with the core's bias taken off;  λ(k) = 1 − 0.05 · 0.98ᵏ
Slope: `Slope`; R adapted while all is well, strong tracking of θ while the alarm rings: never both.
"""

import math

import numpy as np
from common import GRAVITY
from fusion import Train, clip
from pipeline_parts import LeastSquares, LoadWatch, Tracking
from supervised_parts import HEADER, Slope, Supervised, TwoStages, run

INPUT = "fusion"
# mass0_kg 21000, load_change 8, q_theta 1e-5, alarm 1.2, the rest by default.
M0 = 21e3


def time_law(k, size):
    return 1.0 - 0.05 * 0.98**k


def fresh(x):
    return LeastSquares([x], [0.4], time_law)


class Mass:
    def __init__(self):
        self.rls, self.load, self.sums, self.bias_sd, self.valid = fresh(1.0), LoadWatch(8.0), np.zeros(2), 0.02, True

    def sample(self, now):
        bias, self.bias_sd = now.bias
        u, doubt = now.whole(M0 * self.found())
        tare, load = (u - bias for u in now.u)
        a = now.a + load + now.sign * Train.mu * GRAVITY * now.cosine(u - bias)
        self.rls.update((now.F - Train.J * now.a - Train.tare * (tare - load)) / M0, a, 0.02**2 + doubt**2)
        self.sums = self.rls.lam * self.sums + [a, a * a]
        self.valid = self.found() == self.rls.x[0]
        if self.load.changed(self.rls.normalised / max(1.0, self.rls.spread())):
            self.rls, self.sums = fresh(self.found()), np.zeros(2)

    def found(self):
        return clip(self.rls.x[0], Train.low / M0, Train.high / M0)

    def mass(self):
        level = math.hypot(0.3 * Train.mu * GRAVITY, self.bias_sd) * abs(self.sums[0]) / (self.sums[1] + (0.02 / 0.4) ** 2)
        mean = self.found()
        return M0 * mean, M0 * math.hypot(math.sqrt(self.rls.widened()[0]), mean * level)

    def mu(self, curvature):
        return Train.mu

    def slope_sd(self, F, cosine, s, by_theta, curvature):
        mass, sd = self.mass()
        return math.hypot(F / (mass * GRAVITY) * sd / mass, 0.3 * Train.mu * cosine) / by_theta

    def unmodelled(self):
        return 0.02 * math.sqrt(max(self.rls.variance - 1.0, 0.0))


def oracle(table):
    mass, slope = Mass(), Slope(0.998, Tracking(0.95, 1.5, 50.0, 1.2), 1e-5)
    method = TwoStages(mass, slope)
    own = lambda: [M0 * mass.found(), mass.load.changes, *method.own(), slope.fading]
    rows = run(Supervised(method, 1.0, 2.0, 1.0), own, table)
    assert mass.load.changes > 0 and 0 < slope.tracked < 3000, f"{mass.load.changes} load changes, {slope.tracked} updates of strong tracking"
    return [*HEADER, "straight", "load_changes", "wheel_speed_sd", "method_grade", "method_grade_sd", "fading"], rows
