"""`imm_stf`, `imm_stf_fixed`, `imm_stf_no_lateral`, `imm_ekf`, `imm_ekf_fixed`, `kinematic_stf`, `dynamic_stf`: Guo et al. 2024 as published,
errata corrected, on a recorded drive.

Mass: ΔF η − J Δv̇ = m Δv̇ over samples 1/4 s apart (2 Hz), where |ΔF η| > 0.1 m₀ and |Δ(f − v̇)| < 0.2; η = |a_x|/√(a_x² + a_y²) while both are
large. Slope: x = [v, a, i], z = [a + g i, v]; kinematic: a walks; dynamic: a = ((F η − F_w)/m − s f g − g i)/(1 + J/m).
Strong tracking: P⁻ = λ A P Aᵀ + Q, λ = max(1, tr S⁻¹(V − H Q Hᵀ − α R) / tr S⁻¹ H A P Aᵀ Hᵀ), S = H (A P Aᵀ + Q) Hᵀ + R, α = 5.
"""

import math

import numpy as np
from common import GRAVITY
from pipeline_parts import DT, LeastSquares, Road, Samples, readings, record_road
from published_parts import cut

record = record_road
M0 = 2230.0
Q_V, Q_A, Q_I, FORCE_SD, ACCEL_SD, SPEED_SD, STAY = 1e-6, 0.3, 1e-4, 0.1, 0.02, 0.01, 0.95
# mass0_kg 2230, q_i 1e-4, force_sd_mps2 0.1, accel_sd_mps2 0.02, wheel_speed_sd_mps 0.01, weakening 5, the rest by default.
ALPHA = 5.0
H = np.array([[0.0, 1.0, GRAVITY], [1.0, 0.0, 0.0]])
R = np.diag([ACCEL_SD**2, SPEED_SD**2])
KINEMATIC, DYNAMIC = 0, 1
STEEPEST = math.pi / 3.0


def mixture(weights, beliefs):
    x = sum(w * b[0] for w, b in zip(weights, beliefs))
    return x, sum(w * (b[1] + np.outer(b[0] - x, b[0] - x)) for w, b in zip(weights, beliefs))


class Mass:
    def __init__(self):
        self.rls, self.samples, self.last = LeastSquares([1.0], [0.5], lambda k, size: 0.999), Samples(2.0, 4.0, 0.0), None

    def step(self, z, eta):
        s = self.samples
        due = s.step(z) is not None
        if not z.running:
            self.last = None
        if due:
            now = np.array([s.force.value, s.speed.rate, s.f.value])
            if self.last is not None:
                force, faster, felt = now - self.last
                force *= eta(s)
                if abs(force) >= 0.1 * M0 and abs(felt - faster) <= 0.2:
                    self.rls.update((force - Road.J * faster) / M0, faster, 0.03**2)
            self.last = now

    def found(self):
        return M0 * self.rls.x[0], M0 * math.sqrt(self.rls.widened()[0])


class Models:
    def __init__(self, models, varying, strong):
        n = len(models)
        start = (np.zeros(3), np.diag([SPEED_SD, 0.5, math.radians(5.0)]) ** 2)
        self.models, self.varying, self.strong, self.beliefs = models, varying, strong, [start] * n
        self.mu, self.V = np.full(n, 1.0 / n), [None] * n
        self.pi = np.array([[STAY, 1 - STAY], [1 - STAY, STAY]]) if n == 2 else np.ones((1, 1))
        self.fading, self.started, self.since, self.last = [1.0] * n, False, 0.0, (0.0, 0.0)

    def linear(self, model, z, M, eta, dt):
        if model == KINEMATIC or not z.running:
            A = np.array([[1.0, dt, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
            return A, np.zeros(3), np.diag([Q_V, Q_A, Q_I]) * dt
        delta = 1.0 + Road.J / M
        drag = Road.drag * z.v * abs(z.v)
        u = (((z.net + drag) * eta - drag) / M - z.sign * Road.mu * GRAVITY) / delta
        A = np.array([[1.0, dt, 0.0], [0.0, 0.0, -GRAVITY / delta], [0.0, 0.0, 1.0]])
        return A, np.array([0.0, u, 0.0]), np.diag([Q_V * dt, (FORCE_SD / delta) ** 2, Q_I * dt])

    def fade(self, j, y, M, q):
        V = np.outer(y, y)
        self.V[j] = V if self.V[j] is None else (0.95 * self.V[j] + V) / 1.95
        inverse = np.linalg.inv(M + q + R)
        self.fading[j] = max(1.0, np.trace(inverse @ (self.V[j] - q - ALPHA * R)) / np.trace(inverse @ M))

    def step(self, z, M, eta):
        self.since += DT
        if not z.new:
            return
        dt, self.since = self.since, 0.0
        if not self.started:
            self.beliefs = [(np.array([z.v, *x[1:]]), P) for x, P in self.beliefs]
            self.started = True
        seen = np.array([z.f, z.v])
        c = self.mu @ self.pi
        mixed = [mixture(self.pi[:, j] * self.mu / c[j], self.beliefs) for j in range(len(c))]
        logs = []
        for j, (model, (x, P)) in enumerate(zip(self.models, mixed)):
            A, u, Q = self.linear(model, z, M, eta, dt)
            x = A @ x + u
            y = seen - H @ x
            carried = A @ P @ A.T
            if self.strong:
                self.fade(j, y, H @ carried @ H.T, H @ Q @ H.T)
            P = self.fading[j] * carried + Q
            assert np.all(np.diag(P) < [1e4, 1e4, 100.0])
            S = H @ P @ H.T + R
            K = P @ H.T @ np.linalg.inv(S)
            nis = y @ np.linalg.inv(S) @ y
            logs.append(-0.5 * (nis + math.log(np.linalg.det(2.0 * math.pi * S))))
            self.last = (y[1], nis / 2.0)
            B = np.eye(3) - K @ H
            self.beliefs[j] = (x + K @ y, B @ P @ B.T + K @ R @ K.T)
        before = self.mu
        mu = c * np.exp(np.array(logs) - max(logs))
        mu = np.maximum(mu / mu.sum(), 1e-4)
        self.mu = mu / mu.sum()
        if self.varying:
            self.pi = self.pi * np.exp(self.mu - before)
            self.pi /= self.pi.sum(axis=1, keepdims=True)


def run(zs, models, varying, strong, lateral):
    mass, slope, cornering, fading = Mass(), Models(models, varying, strong), 0, 0
    for z in zs:

        def eta(s):
            a_x = s.speed.rate
            if lateral and abs(z.across) > 0.5 and abs(a_x) > 0.3:
                return abs(a_x) / math.hypot(a_x, z.across)
            return 1.0

        mass.step(z, eta)
        cornering += eta(mass.samples) < 1.0
        M = min(max(mass.found()[0], Road.low), Road.high)
        slope.step(z, M, eta(mass.samples))
        fading += max(slope.fading) > 1.0
        x, P = mixture(slope.mu, slope.beliefs)
        found = cut(mass.found(), Road.low, Road.high)
        grade = cut((math.asin(x[2]), math.sqrt(P[2, 2]) / math.sqrt(1.0 - x[2] ** 2)), -STEEPEST, STEEPEST)
        probability = slope.mu[-1] if len(models) == 2 else 0.0
        yield [*found, *grade, x[0], math.sqrt(P[0, 0]), *slope.last, M0 * mass.rls.residual, slope.fading[-1], probability]
    assert mass.rls.k > 20 and (cornering > 50) == lateral and (fading > 10) == strong, f"{mass.rls.k}, {cornering}, {fading}"


def oracle(table):
    zs = readings(table, Road)
    both = [KINEMATIC, DYNAMIC]
    runs = [
        run(zs, both, True, True, True),
        run(zs, both, False, True, True),
        run(zs, both, True, True, False),
        run(zs, both, True, False, True),
        run(zs, both, False, False, True),
        run(zs, [KINEMATIC], False, True, True),
        run(zs, [DYNAMIC], False, True, True),
    ]
    header = ["pipeline", "mass", "mass_sd", "grade", "grade_sd", "speed", "speed_sd", "innovation", "nis", "residual", "fading", "dynamic_probability"]
    return header, [[number, *row] for number, run in enumerate(runs) for row in list(run)[3::4]]
