"""`imm_stf_robust` (Guo et al. 2024) on the drive of `pipeline_patent.py`, in the core of `supervised_parts.py`.

Mass: Δ(v̇ + taken) = x Δ(F + gained + J taken)/(M₀ + J), x = (M₀ + J)/(M + J), Δv̇ = Δ(f + drift), differences of samples 1/4 s apart, behind two gates:
ΔF considerable, Δ(mean of u over the train) small.
Slope: x = [v, a, i], z = [f − b + drift, v] = [a + g i, v], i at the instrument, δ ahead of the sine of the effective grade, b the core's bias;
    kinematic  a, i walk at random;  dynamic  a = ((F − bend)/M − s μ g c − g (i − δ))/(1 + J/M), c from the combined i
each with strong tracking of i, interacting with transitions that vary (recursion as printed). Both measurements have a gate on the kinematic model.
"""

import math

import numpy as np
from common import GRAVITY
from fusion import BX, DT, SHEET, TH, Train, clip
from pipeline_parts import LeastSquares, Tracking
from supervised_parts import HEADER, Gate, Road, Supervised, run

INPUT = "pipeline_patent"
M0 = 21e3
WHOLE0 = M0 + Train.J
Q_V, Q_A, Q_I, FORCE_SD, ACCEL_SD, SPEED_SD = 1e-6, 0.3, 1e-4, 0.2, 0.02, SHEET["wheel"]
# mass0_kg 21000, q_i 1e-4, force_sd_mps2 0.2, alarm 1.2, slope_gate_mps2 0.2, the rest by default. A small force_sd_mps2 makes the model that the wheels
# which slip contradict so unlikely that rounding decides: on the drive of `fusion.py` with 0.03 two equal forms of this oracle differ by 1e-8.
ALARM = 1.2
STAY = 0.95
H = np.array([[0.0, 1.0, GRAVITY], [1.0, 0.0, 0.0]])
KINEMATIC, DYNAMIC = 0, 1
STEEPEST = 0.87


class Mass:
    def __init__(self):
        self.rls, self.last, self.used = LeastSquares([1.0], [0.4 * M0 / WHOLE0], lambda k, size: 0.999), None, 0

    def sample(self, now):
        before, self.last = self.last, now
        if before is None:
            return
        gained, taken, drift = now.bend[:3] - before.bend[:3]
        force, faster = now.F - before.F + gained, now.f - before.f + drift
        slope = now.whole(self.found())[0] - before.whole(self.found())[0]
        if abs(slope) < 0.2 and abs(force) > 0.05 * M0:
            self.used += 1
            self.rls.update(faster + taken, (force + Train.J * taken) / WHOLE0, 0.03**2)

    def whole(self):
        return WHOLE0 / self.rls.x[0]

    def found(self):
        return clip(self.whole() - Train.J, Train.low, Train.high)

    def value(self):
        return self.found(), math.sqrt(self.rls.widened()[0]) * self.whole() / self.rls.x[0]


def mixture(weights, beliefs):
    x = sum(w * b[0] for w, b in zip(weights, beliefs))
    return x, sum(w * (b[1] + np.outer(b[0] - x, b[0] - x)) for w, b in zip(weights, beliefs))


class Models:
    def __init__(self, mass):
        start = (np.zeros(3), np.diag([SPEED_SD, 0.5, math.radians(5.0)]) ** 2)
        self.differences, self.mass, self.sample = mass, mass.value, mass.sample
        self.models, self.beliefs, self.gates = [KINEMATIC, DYNAMIC], [start] * 2, [Gate(), Gate()]
        self.mu = np.full(2, 0.5)
        self.pi = np.array([[STAY, 1 - STAY], [1 - STAY, STAY]])
        self.tracking = [Tracking(0.95, 2.0, 50.0, ALARM) for _ in self.models]
        self.fading, self.started, self.saturated = [1.0] * 2, False, False
        self.faded = self.deweighted = 0

    def pause(self):
        self.differences.last = None

    def linear(self, model, now):
        if model == KINEMATIC or now.traction is None:
            A = np.array([[1.0, DT, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
            return A, np.zeros(3), np.diag([Q_V, Q_A, Q_I]) * DT
        M, sd = self.mass()
        inertia, per_mass, s = 1.0 + Train.J / M, (now.traction - now.bend.force(M)) / M, -1.0 if now.z.v < 0.0 else 1.0
        i = clip(mixture(self.mu, self.beliefs)[0][2], -STEEPEST, STEEPEST)
        u = (per_mass - s * Train.mu * GRAVITY * math.sqrt(1.0 - i * i) + GRAVITY * self.ahead) / inertia
        q = (FORCE_SD**2 + (per_mass * min(sd / M, 1.0)) ** 2 + (GRAVITY * self.ahead_sd) ** 2) / inertia**2
        A = np.array([[1.0, DT, 0.0], [0.0, 0.0, -GRAVITY / inertia], [0.0, 0.0, 1.0]])
        return A, np.array([0.0, u, 0.0]), np.diag([Q_V * DT, q, Q_I * DT])

    def gate(self, seen):
        """R of both measurements."""
        A = np.array([[1.0, DT, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
        x, P = mixture(self.mu, self.beliefs)
        R = np.diag([ACCEL_SD**2, SPEED_SD**2])
        y = seen - H @ A @ x
        S = np.diag(H @ (A @ P @ A.T + np.diag([Q_V, Q_A, Q_I]) * DT) @ H.T + R)
        speed, _ = self.gates[0].judge(y[1] ** 2 / S[1]), self.gates[1].judge(y[0] ** 2 / S[0])
        if speed == "reject":
            R[1, 1] = 1e6
        if speed == "reopen":
            self.beliefs = [(x, P + np.diag([y[1] ** 2, 0.0, 0.0])) for x, P in self.beliefs]
        if self.gates[1].ratio > 1.0:
            self.deweighted += 1
            R[0, 0] += (self.gates[1].ratio - 1.0) * S[0]
        return R

    def step(self, now):
        for gate in self.gates:
            gate.since += DT
        self.ahead, self.ahead_sd = math.sin(now.att.b.x[TH]) - math.sin(now.effective[0]), now.effective[1]
        self.bias_sd = now.bias_sd
        seen = np.array([now.z.force[0] - now.att.b.x[BX] + now.bend.now[2], now.z.v])
        linear = [self.linear(model, now) for model in self.models]
        if not self.started:
            self.beliefs = [(np.array([now.z.v, *x[1:]]), P) for x, P in self.beliefs]
            self.started = True
        R = self.gate(seen)
        c = self.mu @ self.pi
        mixed = [mixture(self.pi[:, j] * self.mu / c[j], self.beliefs) for j in range(len(c))]
        logs, self.saturated = [], False
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
            logs.append(-0.5 * (y @ np.linalg.inv(S) @ y + math.log(np.linalg.det(2.0 * math.pi * S))))
            x = x + K @ y
            inside = clip(x[2], -STEEPEST, STEEPEST)
            self.saturated, x[2] = self.saturated or inside != x[2], inside
            B = np.eye(3) - K @ H
            self.beliefs[j] = (x, B @ P @ B.T + K @ R @ K.T)
        self.faded += max(self.fading) > 1.0
        before = self.mu
        mu = c * np.exp(np.array(logs) - max(logs))
        mu = np.maximum(mu / mu.sum(), 1e-4)
        self.mu = mu / mu.sum()
        self.pi = self.pi * np.exp(self.mu - before)
        self.pi /= self.pi.sum(axis=1, keepdims=True)

    def grade(self):
        if self.saturated:
            return None
        x, P = mixture(self.mu, self.beliefs)
        sd = math.sqrt(P[2, 2] + (self.bias_sd / GRAVITY) ** 2 + self.ahead_sd**2) / math.sqrt(1.0 - x[2] ** 2)
        return math.asin(clip(x[2] - self.ahead, -STEEPEST, STEEPEST)), sd


def oracle(table):
    mass = Mass()
    models = Models(mass)
    own = lambda: [-mass.whole() * mass.rls.residual, *models.fading, *(math.asin(x[2]) for x, _ in models.beliefs), models.mu[-1]]
    rows = run(Supervised(models, 2.0, 4.0, 0.5, Road), own, table, {"alone", "without IMU"})
    assert mass.used > 10 and models.faded > 0, f"{mass.used} differences, {models.faded} steps of fading"
    assert models.deweighted and models.gates[0].met["reject"] and models.gates[0].met["reopen"], f"{models.deweighted}, {models.gates[0].met}"
    header = [*HEADER, "mass_residual", "kinematic_fading", "dynamic_fading", "kinematic_grade", "dynamic_grade", "dynamic_probability"]
    return header, rows
