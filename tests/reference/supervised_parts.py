"""What the oracles of the supervised methods share: the core of a train around a published method.

Attitude, memory of the rail and means over the train are those of `fusion.py`. Here are: what is read of the rail, bends of a road, samples of the
force balance behind one low-pass at the place where the train was then, effective grade over rail that was read, weighing of the method's grade, mass
with the uncertainty of the torques' scale, and what several methods have: `Slope` (force balance with adapted noise or with strong tracking too, behind
an innovation gate) and `TwoStages`.
A sample has the bend of the time when it is worked off: on rails there is none, and a road vehicle that is a point waits for nothing.
Not covered, and switched off: comparison of the torques, conditioning of the channels, validity rule.
"""

import math

import numpy as np
from common import GRAVITY as G
from common import jacobian
from fusion import BX, DT, SHEET, TH, Attitude, Means, Rail, Train, V, clip, rim_force
from pipeline_parts import LowPass, SageHusa

STANDSTILL, STEEPEST = 0.05, math.pi / 3.0
FRONT, ETA, BEHIND_SD = 0.4, 9.0, 0.02
UNREAD, BLIND = 1e-3, 0.065  # rad per m of rail that was not read, and of the way gone back onto it
GAIN_SD = math.sqrt(0.005**2 / 2.0 + 0.035**2 + 0.01**2)
HEADER = ["mass", "mass_sd", "grade", "grade_sd", "effective", "effective_sd", "speed", "speed_sd", "innovation", "nis"]


def unusual(sum_sd):
    """The part of a standard deviation of sin θ + b/g that is beyond a calm instrument's."""
    return math.sqrt(max(sum_sd**2 - 0.003**2, 0.0))


class Rails:
    """What a train on rails differs in from one on a road."""

    standstill, drag, side, turn_walk, wheelbase = STANDSTILL, 0.0, SHEET["side"], 0.0, 0.0


class Road:
    """A train on a road; its first unit is steered."""

    standstill, drag, front, rear, rear_stiffness = 0.3, 0.5 * 1.2 * 4.0, 0.8, 0.9, 400e3
    side, turn_walk, wheelbase = 5.0, 0.01**2 * 2.0, 0.8 + 0.9


class Reading:
    """Channels merged: the sum of the torques, the speed that the two wheels vote for."""

    def __init__(self, row, way):
        self.force, self.rate, self.torques, self.speeds, brake = row[1:4], row[4:7], row[7:9], row[9:11], row[11]
        self.steer = row[12] if way is Road else 0.0
        self.torque = float(sum(self.torques))
        less, more = sorted(self.speeds, reverse=self.torque < 0.0)
        apart = abs(less - more) > way.standstill + 0.03 * abs(less)
        self.v = less if apart else 0.5 * (less + more)
        self.moving = abs(self.v) > way.standstill
        self.running = self.moving and brake <= 0.001


def traction(torque, v):
    return torque * Train.gear / Train.radius * (Train.efficiency if torque * v >= 0.0 else 1.0 / Train.efficiency)


class Bend:
    """Single-track model: what a steady turn gives to the traction, takes from it by mass, and the drift v_y r (docs/src/methods/guo_2024.md)."""

    def __init__(self, cutoff):
        self.now, self.low_pass = np.zeros(5), [LowPass(cutoff, DT) for _ in range(5)]

    def step(self, z, mass):
        self.now = np.zeros(5)
        if z.v > 1.0:
            L, delta, across, r = Road.front + Road.rear, clip(z.steer, -0.7, 0.7), z.force[1], z.rate[2]
            v_y = Road.rear * r - z.v * mass * across * Road.front / L / Road.rear_stiffness
            F = traction(z.torques[0], z.v)
            side = (mass * across * Road.rear / L - F * math.sin(delta)) / math.cos(delta)
            by_mass = across * Road.rear / L * math.tan(delta)
            gained = F * math.cos(delta) - side * math.sin(delta) - F + mass * by_mass
            self.now = np.array([gained, by_mass - v_y * r, v_y * r, delta, across])
        for low_pass, value in zip(self.low_pass, self.now):
            low_pass.step(value)

    def filtered(self):
        return np.array([low_pass.value for low_pass in self.low_pass])

    def force(self, mass):
        return mass * self.now[1] - self.now[0]


class Sample:
    """A sample of the force balance with the means of u = g sin θ + b where the train was then."""

    def __init__(self, samples, place):
        self.F, self.v, self.a, self.f = samples.force.value, samples.speed.value, samples.speed.rate, samples.f.value
        self.period, self.place = samples.period, place

    def put_on(self, means, read_sd, bend):
        self.u = [G * means.S / Train.tare, G * means.load]
        self.doubt = [G * (UNREAD * metres + read_sd) for metres in ((means.behind + means.ahead) / Train.tare, means.load_behind)]
        self.curvature, self.bend, self.sign = means.bend, bend, -1.0 if self.v < 0.0 else 1.0

    def whole(self, mass):
        """Mean of u and of its doubt over a train of this mass."""
        share = min(Train.tare / max(mass, Train.tare), 1.0)
        return [load + share * (tare - load) for tare, load in (self.u, self.doubt)]

    def cosine(self, u):
        """cos θ from a mean of u."""
        return math.sqrt(1.0 - clip(u / G, -0.7, 0.7) ** 2)


class Samples:
    """Force, speed and specific force behind one low-pass; a sample every 1/rate s once settled."""

    def __init__(self, cutoff, rate, settle):
        self.force, self.speed, self.f = (LowPass(cutoff, DT) for _ in range(3))
        self.rate, self.settle, self.running, self.since = rate, settle, 0.0, 0.0

    def step(self, z, net, running):
        for low_pass, u in [(self.force, net), (self.speed, z.v), (self.f, z.force[0])]:
            low_pass.step(u)
        self.running = self.running + DT if running else 0.0
        self.since += DT
        if not self.settled() or self.since * self.rate < 1.0 - 1e-9:
            return False
        self.period, self.since = self.since, 0.0
        return True

    def settled(self):
        return self.running > 0.0 and self.running >= self.settle


class Now:
    """What the core gives a method in a step."""


class Supervised:
    """`method` has sample(sample), pause(), mass() → value and sd, step(now) and grade() → value and sd, or None while it has none."""

    def __init__(self, method, cutoff, rate, settle, way=Rails):
        self.att, self.rail, self.method, self.samples = Attitude(True, 0.4 * way.standstill, way.side, way.turn_walk), Rail(), method, Samples(cutoff, rate, settle)
        self.way, self.bend = way, Bend(cutoff)
        self.read_sd, self.read_apart, self.waiting, self.late, self.curvature = 0.0, 0.0, [], 0.0, 0.0
        self.age, self.gone, self.back, self.pitch_rate = 1.0, 0.0, 0.0, 0.0
        self.sine, self.variance, self.square, self.blind = 0.0, 0.0, 1.0, 0.0
        self.met = {"waits": 0, "judged": 0, "alone": 0, "worse than calm": 0, "used": 0, "goes back blind": 0, "without IMU": 0, "read apart": 0}

    def step(self, row):
        z, att = Reading(row, self.way), self.att
        if self.way is Road:
            self.bend.step(z, self.method.mass()[0])
        att.step(z.force + np.array([self.bend.now[2], 0.0, 0.0]), z.rate, z.speeds)
        self.read()
        net = sum(rim_force(torque, att.v)[0] for torque in z.torques) - self.way.drag * att.v * abs(att.v)
        sound = att.imu and abs(z.v) >= self.way.standstill and att.used > 0 and att.separation.apart < 0.02
        sample = self.next(z, net, z.running and sound)
        if sample is not None:
            self.take(sample)
        if not self.samples.settled():
            self.method.pause()
        self.look()
        now = Now()
        now.z, now.att, now.curvature, now.moving, now.running = z, att, self.curvature, z.moving, z.running
        now.traction = net if z.running else None
        now.bend = self.bend
        now.effective, now.bias_sd = self.effective(), math.sqrt(att.b.P[BX, BX])
        self.method.step(now)
        apart = att.mount_sd - SHEET["mount"]
        of_rail = SHEET["mount"] + max(self.read_apart, apart)
        self.met["read apart"] += self.read_apart > apart + 1e-4
        grade, effective = ((angle, math.hypot(sd, mount)) for (angle, sd), mount in zip(self.weigh(now.effective), (att.mount_sd, of_rail)))
        self.pitch_rate += (1.0 - math.exp(-DT / 0.1)) * (att.pitch_rate - self.pitch_rate)
        trail = 0.25 * self.way.wheelbase * self.pitch_rate / max(abs(att.v), 0.5)
        effective = effective[0], math.hypot(effective[1], trail)
        mass, sd = self.method.mass()
        return [mass, math.hypot(sd, GAIN_SD * mass), *grade, *effective, att.v, math.sqrt(att.b.P[V, V]), att.y, att.nis]

    def read(self):
        """The rail under the unit."""
        att = self.att
        bend = abs(att.yaw / att.v) if abs(att.v) > 0.06 else 0.0
        self.rail.doubt += max(math.sqrt(att.b.P[V, V]) - 0.02, 0.0) * DT
        assert self.rail.doubt < 0.5, "the oracle never loses its place"
        readable = att.sum_sd < 0.02 and math.sqrt(att.b.P[V, V]) < 0.1
        self.rail.step(att.v * DT, [math.sin(att.b.x[TH]) + att.b.x[BX] / G, bend] if readable else None)
        if readable:
            self.read_sd = max(unusual(att.sum_sd), self.read_sd * math.exp(-abs(att.v) * DT / 20.0))
            self.met["worse than calm"] += att.sum_sd > 0.003
            apart = att.mount_sd - SHEET["mount"]
            over = 1.0 if apart > self.read_apart else 20.0  # m
            self.read_apart += (1.0 - math.exp(-abs(att.v) * DT / over)) * (apart - self.read_apart)

    def next(self, z, net, running):
        """The oldest sample whose rail has been read; any one while the train is not running."""
        new = self.samples.step(z, net, running)
        self.late = clip(self.late + (z.v - self.samples.speed.value) * DT, -2.0, 2.0)
        if new:
            self.waiting.append(Sample(self.samples, self.rail.at - self.late))
            if len(self.waiting) > 20:  # the oldest makes room
                return self.waiting.pop(0)
        if not self.waiting:
            return None
        read = bool(self.rail.u) and math.floor((self.waiting[0].place + FRONT) / self.rail.pitch) < self.rail.high
        if running and not read:
            self.met["waits"] += 1
            return None
        return self.waiting.pop(0)

    def take(self, sample):
        means = Means(self.rail, sample.place)
        self.curvature = means.bend
        assert sample.v >= 0.0 or means.behind <= 0.3 * Train.tare, "the drive does not go back onto rail that was not read"
        sample.put_on(means, self.read_sd, self.bend.filtered())
        self.met["used"] += 1
        self.method.sample(sample)

    def look(self):
        """The effective grade over the rail that was read."""
        mass, sd = self.method.mass()
        means, M = Means(self.rail, self.rail.at), max(mass, Train.tare)
        load = max(mass - Train.tare, 0.0)
        behind = (means.behind + load * means.load_behind) / ETA / M
        self.age, self.gone, self.back = self.age + DT, self.gone + abs(self.att.v) * DT, self.back + max(-self.att.v * DT, 0.0)
        if self.age < 0.1 - 1e-6 and self.gone < 0.1:
            return
        if self.back > 0.0:
            self.blind = min(self.blind + self.back, 9.0) if behind > 0.0 else 0.0
            self.met["goes back blind"] += self.blind > 0.1
        self.age = self.gone = self.back = 0.0
        mean = (means.S + load * means.load) / M
        self.sine = mean - self.att.b.x[BX] / G
        ahead = means.ahead / M * means.per_m
        self.variance = self.att.b.P[TH, TH] + self.read_sd**2 + ahead**2 + (behind * BEHIND_SD) ** 2 + (BLIND * self.blind * min(behind, 1.0)) ** 2
        self.variance += ((means.load - mean) / M * sd) ** 2
        if self.rail.doubt > 0.0:
            off = Means(self.rail, self.rail.at - self.rail.doubt)
            self.variance += ((off.S + load * off.load) / M - mean) ** 2

    def effective(self):
        return clip(math.asin(self.sine), -STEEPEST, STEEPEST), math.sqrt(self.variance)

    def weigh(self, core):
        """Grade at the IMU and effective grade, each with its standard deviation."""
        at_imu, method = (clip(self.att.grade, -STEEPEST, STEEPEST), math.sqrt(self.att.grade_sd**2 - self.att.mount_sd**2)), self.method.grade()
        if method is None:
            self.met["alone"] += 1
            return at_imu, core
        off, variance = method[0] - core[0], core[1] ** 2
        if core[1] < 0.005:
            self.met["judged"] += 1
            self.square += (1.0 - math.exp(-DT / 20.0)) * (min(off**2 / (variance + method[1] ** 2), 1e4) - self.square)
        both = variance + method[1] ** 2 * max(self.square, 1.0)

        def moved(grade, own):
            share = own / both
            return clip(grade[0] + share * off, -STEEPEST, STEEPEST), (1.0 - share) * grade[1] + share * math.sqrt(max(both - own, 0.0))

        self.met["without IMU"] += not self.att.imu
        return moved(at_imu, min(at_imu[1] ** 2, variance) if self.att.imu else 0.0), moved(core, variance)


def run(pipeline, own, table, never=()):
    """Every tenth row of a pipeline on the drive, with `own` numbers of the method; what is `never` met."""
    rows = []
    for k, row in enumerate(np.column_stack(list(table.values()))):
        found = pipeline.step(row)
        if k % 10 == 9:
            rows.append([*found, *own()])
    met = pipeline.met
    assert all(bool(count) == (name not in never) for name, count in met.items()), f"not met: {met}"
    return rows


class Gate:
    """Innovation gate at five standard deviations times a running scale; reopens after half a second of rejections."""

    def __init__(self):
        self.scale, self.rejecting, self.rejected, self.since, self.ratio = 1.0, 0.0, 0, 0.0, 0.0
        self.met = {"fuse": 0, "reject": 0, "reopen": 0}

    def judge(self, nis):
        self.ratio, period, self.since = nis / (25.0 * max(self.scale, 1.0)), self.since, 0.0
        self.scale = max(self.scale + (min(nis, 4.0 * self.scale) - self.scale) / 64.0, 1e-3)
        passage = "fuse"
        if self.ratio > 1.0:
            self.rejecting, self.rejected = self.rejecting + period, self.rejected + 1
            passage = "reopen" if self.rejecting > 0.5 and self.rejected >= 3 else "reject"
        if passage != "reject":
            self.rejecting, self.rejected = 0.0, 0
        self.met[passage] += 1
        return passage


class Slope:
    """x = [v, θ], v⁻ = v + dt (F − M g (sin θ + s μ cos θ))/(M + J), z = v; R adapted (Sage & Husa), with `tracking` strong tracking of θ instead
    while its alarm rings."""

    SD, Q_V, Q_THETA = SHEET["wheel"], 1e-4, 1.5e-4

    def __init__(self, fading, tracking=None, q_theta=Q_THETA):
        self.x, self.P = np.zeros(2), np.diag([self.SD**2, math.radians(5.0) ** 2])
        self.noise, self.tracking, self.Q = SageHusa(self.SD**2, fading), tracking, np.diag([self.Q_V, q_theta]) * DT
        self.carried, self.process, self.fading, self.tracked = np.eye(2), 0.0, 1.0, 0
        self.gate, self.started, self.saturated, self.blind = Gate(), False, False, False

    def step(self, now, F, mass, resistance):
        self.gate.since += DT
        if F is None:
            self.P = np.diag(np.diag(self.P) + [DT, 0.0])
            self.carried, self.process = np.eye(2), 0.0
            if now.moving:
                self.P[1, 1] = min(self.P[1, 1] + 3e-3 * DT, STEEPEST**2)
                self.blind = True
        else:
            speed = lambda x: x[0] + DT * (F - mass * G * (np.sin(x[1]) + resistance * np.cos(x[1]))) / (mass + Train.J)
            f = lambda x: np.array([speed(x), x[1]])
            A = jacobian(f, self.x)
            self.x, self.P = f(self.x), A @ self.P @ A.T + self.Q
            self.carried, self.process = A @ self.carried, self.process + self.Q[0, 0]
        if self.update(now.z.v, now.running):
            self.blind = self.blind and self.P[1, 1] > 0.01**2

    def update(self, v, running):
        if not self.started:
            self.x[0], self.started = v, True
        y = v - self.x[0]
        passage = self.gate.judge(y**2 / (self.P[0, 0] + self.SD**2))
        if passage == "reject":
            return False
        if passage == "reopen":
            self.P[0, 0] += y**2
        R = self.noise.R
        tracking = self.tracking is not None and running and self.track(y, R)
        self.carried, self.process = np.eye(2), 0.0
        K = self.P[:, 0] / (self.P[0, 0] + R)
        B = np.eye(2) - np.outer(K, [1.0, 0.0])
        self.x, self.P = self.x + K * y, B @ self.P @ B.T + R * np.outer(K, K)
        inside = clip(self.x[1], -STEEPEST, STEEPEST)
        self.saturated, self.x[1] = inside != self.x[1], inside
        self.tracked += tracking
        if running and not tracking:
            self.noise.see(v - self.x[0], self.P[0, 0])
        return True

    def track(self, y, R):
        explained = max(self.P[0, 0] - self.process, 0.0)
        self.fading = self.tracking.step(y, explained, self.process, R)
        added = np.diag([0.0, (self.fading - 1.0) * self.P[1, 1]])
        self.P = self.P + self.carried @ added @ self.carried.T
        shrink = np.sqrt(np.minimum(1.0, np.array([100.0, STEEPEST**2]) / np.diag(self.P)))
        self.P = shrink[:, None] * self.P * shrink[None, :]
        return self.tracking.on

    def sound(self):
        """Has a grade of its own: it was started, sees the grade, no limit acts, the wheels do not slip."""
        return self.started and not self.saturated and not self.blind and math.sqrt(self.noise.R) / self.SD < 3.0


class TwoStages:
    """Mass by a regression, then `Slope` with it. `stage` has sample, mass, valid, mu(κ), slope_sd(F, sin, cos, s, by_theta, κ) and unmodelled."""

    def __init__(self, stage, slope):
        self.stage, self.slope, self.found, self.valid = stage, slope, (0.0, 0.0), False
        self.sample, self.mass = stage.sample, stage.mass

    def pause(self):
        pass

    def step(self, now):
        stage, slope, s = self.stage, self.slope, -1.0 if now.att.v < 0.0 else 1.0
        mu, mass = stage.mu(now.curvature), stage.mass()[0]
        slope.step(now, None if now.traction is None else now.traction - now.bend.force(mass), mass, mu * s)
        theta = slope.x[1]
        variance = slope.P[1, 1] + (stage.unmodelled() / G) ** 2
        if now.traction is not None:
            sine, cosine = math.sin(theta), math.cos(theta)
            by_theta = max(cosine - s * mu * sine, 0.1)
            variance += stage.slope_sd(mass * G * (sine + mu * s * cosine), cosine, s, by_theta, now.curvature) ** 2
        self.found = theta, math.sqrt(variance)
        self.valid = now.traction is not None and slope.sound() and stage.valid

    def grade(self):
        return self.found if self.valid else None

    def own(self):
        return [math.sqrt(self.slope.noise.R), *self.found]
