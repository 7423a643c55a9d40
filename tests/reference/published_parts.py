"""What the oracles of the published methods share beyond `pipeline_parts`: the methods' own forgetting and noise, and plain Kalman steps."""

import math

import numpy as np
from common import jacobian
from pipeline_parts import LeastSquares


def by_residual(first, floor, sharpness):
    """λ of the first sample, then floor + (1 − floor) exp(−sharpness |e|)."""
    return lambda k, size: first if k == 1 else floor + (1.0 - floor) * math.exp(-sharpness * size)


def regression(x, sd, factor):
    return LeastSquares(x, sd, factor, "residual")


class Noise:
    """R from residuals after the update, d = (1 − b)/(1 − bᵏ⁺¹) from k = 0; or R as it is."""

    def __init__(self, R, b=None):
        self.R, self.b, self.k = R, b, 0

    def see(self, residual, variance):
        if self.b:
            d = (1.0 - self.b) / (1.0 - self.b ** (self.k + 1))
            self.k += 1
            self.R = (1.0 - d) * self.R + d * (residual**2 + variance)


class Kalman:
    """x, P of a filter that sees its first state."""

    def __init__(self, x, sd, noise):
        self.x, self.P, self.noise = np.array(x, float), np.diag(np.array(sd, float) ** 2), noise
        self.started, self.seen, self.y, self.nis = False, False, 0.0, 0.0

    def predict(self, f, Q):
        F = jacobian(f, self.x)
        self.x, self.P = f(self.x), F @ self.P @ F.T + Q

    def update(self, z, adapt=True):
        self.seen, S = True, self.P[0, 0] + self.noise.R
        self.y = z - self.x[0]
        self.nis = self.y**2 / S
        K = self.P[:, 0] / S
        self.x, self.P = self.x + K * self.y, self.P - np.outer(K, K) * S
        if adapt:
            self.noise.see(z - self.x[0], self.P[0, 0])

    def start(self, v):
        """Takes the first speed for its own. Tells whether this was the first."""
        first, self.started = not self.started, True
        if first:
            self.x[0] = v
        return first

    def sd(self, i):
        return math.sqrt(self.P[i, i])


def cut(found, low, high):
    """Value and standard deviation as an estimate has them: inside a range."""
    value, sd = found
    return [min(max(value, low), high), sd]
