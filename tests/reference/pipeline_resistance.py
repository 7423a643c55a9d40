"""`resistance_dffrls_robust` (Liu et al. 2023, eq. 8–15) on the drive of `fusion.py`, in the core of `supervised_parts.py`.

    (F − J v̇)/M − v̇ − u = s g c μ, M known, u the mean of g sin θ + b over the whole train; it has no grade of its own.
"""

import math

from common import GRAVITY
from fusion import Train
from pipeline_parts import LeastSquares, dynamic
from supervised_parts import HEADER, Supervised, run

INPUT = "fusion"
# known_mass_kg 17000, the rest by default.
M = 17e3


class Resistance:
    def __init__(self):
        self.rls, self.load, self.bias_sd = LeastSquares([0.0], [0.5], dynamic(0.98, 0.995, 1.0), True), 0.0, 0.01

    def sample(self, now):
        u, doubt = now.whole(M)
        y = (now.F - Train.J * now.a) / M - now.a - u
        self.rls.update(y, now.sign * GRAVITY * now.cosine(u), 0.02**2 + doubt**2)
        self.load = abs(now.F / (M * GRAVITY))

    def pause(self):
        pass

    def step(self, now):
        pass

    def mass(self):
        return M, 0.01 * M

    def grade(self):
        return None

    def own(self):
        sd = math.sqrt(self.rls.widened()[0] + (self.bias_sd / GRAVITY) ** 2 + (0.01 * self.load) ** 2)
        return [self.rls.x[0], sd, self.rls.lam if self.rls.k else 0.0, self.rls.residual]


def oracle(table):
    method = Resistance()
    rows = run(Supervised(method, 1.0, 2.0, 1.5), method.own, table, {"judged", "without IMU", "goes back blind"})
    assert abs(method.rls.x[0]) < 1.0 and method.rls.k > 40, f"{method.rls.x} by {method.rls.k} samples"
    return [*HEADER, "running_resistance", "running_resistance_sd", "lambda", "residual"], rows
