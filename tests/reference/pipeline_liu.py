"""`dffrls_aekf_robust` (Liu et al. 2023, eq. 16–30) on the drive of `fusion.py`, in the core of `supervised_parts.py`.

Mass regression, both sides divided by the first mass m₀, m the tare, ū₀ and ū₁ the means of u = g sin θ + b under tare and load:
    (F − J v̇)/m₀ − m/m₀ (ū₀ − ū₁) = [v̇ + ū₁ + s μ g c, s g c, 1, s g c |κ|] · [M, r, a, q]/m₀,  s = sgn v, c = cos θ of the whole train
Slope filter: `Slope`; R adapted (Sage & Husa).
"""

import math
from copy import deepcopy

import numpy as np
from common import GRAVITY
from fusion import Train, clip
from pipeline_parts import LeastSquares, LoadWatch, dynamic, lag
from supervised_parts import HEADER, Slope, Supervised, TwoStages, run

INPUT = "fusion"
# mass0_kg 21000, delta 0.995, load_change 8, the rest by default.
M0 = 21e3


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
        self.rls = LeastSquares([1.0, 0.0, 0.0, 0.0], [0.4, 0.3 * Train.mu, 0.02, 0.05], dynamic(0.98, 0.995, 1.0), True)
        self.before, self.valid = deepcopy(self.rls), True
        self.regressor, self.jolts, self.load, self.acted = Deviation(), Deviation(), LoadWatch(8.0), set()

    def sample(self, now):
        u, doubt = now.whole(M0 * self.found())
        f, against = now.a + now.u[1], now.sign * GRAVITY * now.cosine(u)
        self.regressor.add(f, lag(now.period, 5.0))
        excited = math.sqrt(self.regressor.variance) > 0.06
        self.acted.add(excited)
        self.jolts.add(now.a, lag(now.period, 3.0))
        r = (0.02**2 + doubt**2 + 0.3**2 * self.jolts.variance) / (1.0 if excited else 0.02)
        y = (now.F - Train.J * now.a - Train.tare * (now.u[0] - now.u[1])) / M0
        self.rls.update(y, [f + against * Train.mu, against, 1.0, against * now.curvature], r, not excited)
        self.valid = self.found() == self.rls.x[0]
        if excited and self.load.changed(self.rls.normalised / max(1.0, self.rls.spread())):
            self.rls = deepcopy(self.before)
            self.rls.other_load(0.05)
        if self.load.up == self.load.down == 0.0:
            self.before = deepcopy(self.rls)

    def found(self):
        return clip(self.rls.x[0], Train.low / M0, Train.high / M0)

    def mass(self):
        return M0 * self.found(), M0 * math.sqrt(self.rls.widened()[0])

    def mu(self, curvature):
        x = self.rls.x
        return clip(Train.mu + (x[1] + x[3] * curvature) / self.found(), 0.0, 1.0)

    def slope_sd(self, F, cosine, s, by_theta, curvature):
        x, m, against = self.rls.x, self.found(), s * cosine
        by_m = -F / (M0 * GRAVITY * m * m) + against * (x[1] + x[3] * curvature) / (m * m)
        gradient = np.array([by_m, -against / m, 0.0, -against / m * curvature])
        return math.sqrt(gradient @ self.rls.covariance() @ gradient) / by_theta

    def unmodelled(self):
        return 0.02 * math.sqrt(max(self.rls.variance - 1.0, 0.0))


def oracle(table):
    mass, slope = Mass(), Slope(0.98)
    method = TwoStages(mass, slope)
    own = lambda: [mass.mu(pipeline.curvature), -mass.rls.x[2] / mass.found(), mass.load.changes, *method.own()]
    pipeline = Supervised(method, 1.0, 2.0, 1.5)
    rows = run(pipeline, own, table, {"goes back blind"})
    assert mass.acted == {True, False} and mass.load.changes > 0, f"{mass.acted}, {mass.load.changes} load changes"
    assert slope.gate.met["reject"] and slope.gate.met["reopen"], f"gate {slope.gate.met}"
    return [*HEADER, "running_resistance", "accel_bias", "load_changes", "wheel_speed_sd", "method_grade", "method_grade_sd"], rows
