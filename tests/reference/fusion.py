"""`attitude` and `rail_fusion` on one recorded drive, from the equations of estimators/EQUATIONS.md, in their plainest form.

Jacobians by the complex step, full matrices, the Joseph form written out, lists and dictionaries for the memory of the rail.

Covered: start, health of the IMU, time update with and without gyro, all measurements with their gates, noise seen, standstill,
limits, outputs; rail memory, means over the train, blocks, force balance with the swing, load bank, effective grade over rail that was read.
Not covered, and switched off or not met: a stand that opens the load, comparison of the torques (`torque_monitor`), the effective grade by the
force (`force_fusion`), the front end's timeouts, the validity rule.
"""

import math

import numpy as np
from common import GRAVITY as G
from common import jacobian

DT = 0.01
COLUMNS = ["t", "fx", "fy", "fz", "p", "q", "r", "torque1", "torque2", "speed1", "speed2", "brake"]
V, TH, PH, BX, BY, BZ, GX, GY, EW, KA, GZ = range(11)
ARM, BELOW = 0.3, 0.5
SHEET = dict(vrw=6.94e-4, bias=0.00978, bias_walk=1.5e-4, gyro=2.424e-6, gyro_walk=0.0, arw=4.072e-5, wheel=0.005, scale=0.0033,
             speed_walk=0.002, roll_walk=2e-4, side=0.05, bounce=5.0, curve_sd=0.03, mount=math.radians(0.2), curve_length=5.0, gate=5.0)


class Train:
    """The train of the recorded drive: three rigid masses, a load on chains."""

    tare, low, high = 9000.0, 4500.0, 29000.0
    radius, gear, efficiency, J, mu = 0.17, 19.0, 0.95, 1000.0, 0.02
    masses = [((-0.4, 0.4), 2000.0, 0.3), ((3.0, 7.0), 3000.0, 0.5), ((9.0, 10.0), 3000.0, 0.2)]
    load_places, gear_kg, hook, below, chain, stiffness, share = (4.0, 6.0), 1000.0, 0.4, 0.6, 0.6, 3e6, 0.4
    span = 10.4


def single(x):
    return float(np.float32(x))


def record(rng):
    """Creeping on the level, a start, a wavy rail, bends, a stop under the brake, a return backwards. On the way: a spike of the gyro, a
    wheel and then both that slip, a push from the side, a time in which |f| is not g, a gyro that drifts, a gyro that repeats itself."""
    wanted = lambda t: np.interp(t, [1, 5, 8, 11, 38, 41, 44, 46, 60], [0, 0.12, 0.12, 0.8, 0.8, 0, 0, -0.7, -0.7]) * (1.0 + 0.15 * math.sin(0.5 * t))
    grade = lambda s: 0.0 if s < 3.0 else 0.06 * (1.0 - math.cos(0.4 * (s - 3.0)))
    bend = lambda s: 0.08 * (0.5 - 0.5 * math.cos(0.5 * s)) if s > 8.0 else 0.0
    rows, s, swing, swing_rate, yaw0, turn0, stuck = [], 0.0, 0.0, 0.0, 0.0, 0.0, None
    M, load = Train.tare + 8000.0, 9000.0
    for k in range(6000):
        t = DT * (k + 1)
        v, a = wanted(t), (wanted(t) - wanted(t - 1e-3)) / 1e-3
        before, s = grade(s), s + v * DT
        pitch = grade(s)
        turn = (pitch - before) / DT
        yaw = bend(s) * v
        swing_rate += DT * (-G / 0.66 * swing - a / 0.66)
        swing += DT * swing_rate
        sign = 0.0 if v == 0.0 else math.copysign(1.0, v)
        force = (M + Train.J) * a + M * G * (math.sin(pitch) + sign * Train.mu) - load * G * swing - load * a
        brake = 1.0 if 38 < t < 44 else 0.0
        force *= 1.0 - brake
        torque = 0.5 * force * Train.radius / Train.gear * (1 / Train.efficiency if force * v >= 0 else Train.efficiency)
        n = rng.standard_normal(12)
        white, rate = SHEET["vrw"] / math.sqrt(DT), SHEET["arw"] / math.sqrt(DT)
        fx = a + G * math.sin(pitch) + 0.012 + white * n[0] - ARM * (yaw * yaw + turn * turn) + BELOW * (turn - turn0) / DT
        fy = v * yaw + ARM * (yaw - yaw0) / DT + 0.004 + 0.01 * n[1]
        fz = G * math.cos(pitch) - 0.008 + v * turn + BELOW * turn * turn + ARM * (turn - turn0) / DT + white * n[2]
        gyro = np.array([rate * n[3] + math.sin(pitch) * yaw, -turn + rate * n[4], math.cos(pitch) * yaw + rate * n[5]])
        gyro += [2e-5, -3e-5, 1e-5]
        yaw0, turn0 = yaw, turn
        if k in (1200, 1301):
            gyro[1] += 0.4
        if 1500 <= k < 1506:
            fx, gyro[1] = fx + [3.0, -2.0, 4.0, -4.0, 1.0, -1.0][k - 1500], gyro[1] + [0.3, -0.2, 0.2, -0.3, 0.1, -0.1][k - 1500]
        if 2000 <= k < 2015:
            fy += 0.6
        if 2700 <= k < 2790:
            fz += 1.5
        if 3000 <= k < 3250:
            gyro[1] += 0.01
        if 3400 <= k < 3440:
            stuck = np.array(gyro) if stuck is None else stuck
            gyro = stuck
        speeds = [v + 0.004 * n[6], 1.002 * v + 0.004 * n[7]]
        if 1800 <= k < 1900 or 2200 <= k < 2420:
            speeds[0] += 0.3
        if 2200 <= k < 2420:
            speeds[1] += 0.4
        torques = [torque * (1 + 0.01 * n[8]) + 0.2 * n[9], torque * (1 + 0.01 * n[10]) + 0.2 * n[11]]
        rows.append(np.round([t, fx, fy, fz, *gyro, *torques, *speeds, brake], 7))
    return COLUMNS, rows


def clip(x, low, high):
    return min(max(x, low), high)


class Belief:
    """Mean and covariance."""

    def __init__(self, x, P):
        self.x, self.P = np.array(x, float), np.array(P, float)

    def measure(self, h, R, y=None, z=None, huber=None):
        """One number: the innovation `y`, or `z` less h(x). Returns y and S."""
        H = jacobian(lambda x: np.array([h(x)]), self.x)
        y = z - h(self.x) if y is None else y
        S = float((H @ self.P @ H.T)[0, 0] + R)
        if huber is not None and y * y > huber**2 * S:
            R = R + (y * y / (huber**2 * S) - 1.0) * S
        K = self.P @ H.T / ((H @ self.P @ H.T)[0, 0] + R)
        A = np.eye(len(self.x)) - K @ H
        self.x, self.P = self.x + K[:, 0] * y, A @ self.P @ A.T + R * K @ K.T
        return y, S

    def alone(self, i, x, variance):
        self.P[i, :] = self.P[:, i] = 0.0
        self.x[i], self.P[i, i] = x, variance


class NoiseSeen:
    def __init__(self):
        self.level, self.mean, self.t = None, 0.0, 0.0

    def see(self, x, T):
        before = x if self.level is None else self.level
        self.level = before + (1.0 - math.exp(-T / 0.2)) * (x - before)
        self.t = min(self.t + T, 5.0)
        d = abs(x - before)
        if self.t > 0.3:
            d = min(d, 4.0 * self.mean + 1e-6)
        self.mean += (1.0 - math.exp(-T / self.t)) * (d - self.mean)

    def walk(self):
        return math.sqrt(math.pi / 2.0) * self.mean * math.sqrt(0.05) if self.t > 0.3 else 0.1


class Health:
    """What of the IMU is in use."""

    def __init__(self, events):
        self.last_force = None
        self.used = self.held = None
        self.jump, self.norm, self.up, self.out, self.scale = 0.0, 0.0, 0.0, 0.0, 0.0
        self.stuck = {"force": [None, 0, 0, 0], "rate": [None, 0, 0, 0]}
        self.events = events

    def repeats(self, name, sample):
        last, run, changes, repeats = self.stuck[name]
        is_stuck = lambda: run >= 3 and changes >= 100 and 100 * repeats < changes
        if last is not None and np.array_equal(sample, last):
            run += 1
        elif last is not None:
            repeats += 0 if is_stuck() else run
            changes, run = changes + 1, 0
        self.stuck[name] = [sample, run, changes, repeats]
        return is_stuck()

    def despike(self, w):
        if self.used is None:
            self.used = w
            return w
        last = self.used
        limit, jump = 0.1 + 6.0 * self.jump, np.max(np.abs(w - last))
        held, self.held = self.held, None
        confirmed = held is not None and np.max(np.abs(w - held)) <= limit
        if held is None or confirmed:
            self.jump += (min(jump, limit) - self.jump) / 64.0
        if jump > limit and not confirmed:
            self.held = w
            self.events.add("spike")
            return last
        self.used = w
        return w + (held - last) if confirmed and jump > limit else w

    def step(self, force, w, yaw_bias, v, gyro):
        lag = 0.0 if self.last_force is None else 0.4
        self.last_force = force
        rate = None
        if gyro:
            rate = self.despike(w)
            if self.repeats("rate", w):
                rate = None
                self.events.add("stuck gyro")
        assert not self.repeats("force", force)
        centripetal = (rate[2] - yaw_bias) * v if rate is not None else 0.0
        error = np.linalg.norm(force) - math.hypot(G, centripetal)
        self.norm += DT / (lag + DT) * (error - self.norm)
        self.up += DT / (lag + DT) * (force[2] - self.up)
        if abs(self.norm) > 0.35 or self.up < 0.5 * G:
            self.out = 0.5
        self.out = max(self.out - DT, 0.0)
        self.scale = self.norm / G if self.out > 0.0 else 0.0
        if self.out > 0.0:
            self.events.add("|f| is not g")
            return None, rate
        return force, rate


class Carried:
    """A pitch that the gyro alone carries on."""

    def __init__(self, theta, phi, sd, bias_sd):
        self.angles, self.variance, self.bias_sd, self.age = np.array([theta, phi]), sd**2, bias_sd, 0.0
        self.low = self.high = theta
        self.apart = False

    def step(self, theta, body, v, calm, turn_walk):
        if body is None:
            self.variance += (0.03 * v) ** 2 * DT
        else:
            (t, f), (p, q, r) = self.angles, body
            turned = np.array([r * math.sin(f) - q * math.cos(f), p - math.tan(t) * (q * math.sin(f) + r * math.cos(f))])
            self.angles = np.clip(self.angles + turned * DT, -math.pi / 3, math.pi / 3)
            self.variance += (SHEET["arw"] ** 2 + turn_walk * r**2) * DT
        self.age += DT
        self.low, self.high = min(self.low, theta), max(self.high, theta)
        self.apart = self.apart or not calm or abs(self.angles[0] - theta) > 3.0 * self.sd() + 0.004

    def sd(self):
        return math.sqrt(self.variance + (self.bias_sd * self.age) ** 2)


class Separation:
    """Separation of the pitch from those without the gyro, by the gyro alone, without f_z, and by a gyro of another scale."""

    def __init__(self):
        self.by_scale, self.last = 0.0, 0.0
        self.low, self.waited, self.heard, self.without_gyro, self.pair = None, 0.0, 0.0, 0.0, None

    def step(self, b, body, acceleration, wheels, turn_walk, sheet_bias, scale):
        self.waited, self.heard = self.waited + DT, self.heard + DT
        if acceleration is None:
            self.low, self.heard, self.waited = None, 0.0, 0.0
        else:
            speed, mean = self.low or (wheels - acceleration, acceleration)
            if self.low:
                mean += DT / (1.0 + DT) * (acceleration - mean)
            gained = wheels - speed
            self.low, self.waited = (speed + self.waited / (1.0 + self.waited) * gained, mean), 0.0
            if self.heard > 2.0:
                self.without_gyro = (mean - gained) / G
        theta, own, bias_sd = b.x[TH], math.sqrt(b.P[TH, TH]), math.sqrt(b.P[GY, GY])
        anew = lambda: Carried(theta, b.x[PH], own, bias_sd)
        calm = abs(self.without_gyro) < 3.0 * own + 0.004
        if self.pair is None and calm and self.heard > 2.0:
            self.pair = (anew(), anew())
        for one in self.pair or ():
            one.step(theta, body, b.x[V], calm, turn_walk)
        if self.pair:
            self.renew(own, anew)
        others = [(abs(one.angles[0] - theta), one.sd()) for one in self.pair or () if one.sd() < 0.02]
        self.by_scale = self.by_scale + scale * (theta - self.last) if scale else 0.0
        self.last = theta
        largest = max(abs(self.without_gyro), abs(self.by_scale)) - 2.0 * own
        self.apart = max([largest, *(d - 2.0 * max(sd, own) for d, sd in others)])
        largest = max([largest, *(d - 2.0 * own for d, _ in others)])
        without_up = (abs(b.x[BX]) - 2.0 * sheet_bias) / G
        return SHEET["mount"] + max(largest, without_up, 0.0) / 3.0

    def renew(self, own, anew):
        kept, young = self.pair
        says = lambda one: one.sd() < 2.0 * own + 0.004
        if young.age > 20.0 or not says(young):
            moved = young.age > 20.0 and young.high - young.low > 0.01
            due = moved if kept.apart else kept.age > 40.0 or not says(kept)
            if kept.sd() >= 0.02 or (due and not young.apart and self.heard >= young.age):
                kept = young
            self.pair = (kept, anew())


class Attitude:
    def __init__(self, gyro, still=0.02, side=SHEET["side"], turn_walk=0.0):
        self.gyro, self.still, self.events = gyro, still, set()
        self.side, self.turn_walk = side, turn_walk
        self.health, self.b, self.separation = Health(self.events), None, Separation()
        self.k, self.coast, self.quiet = np.zeros(2), 0.0, 0.0
        self.smooth = None
        self.sums, self.length = np.zeros(4), 0.0
        self.seen = [NoiseSeen() for _ in range(4)]
        self.curvature, self.ways, self.way, self.arm = 0.0, [None] * 4, 0.0, 0.0
        self.turn, self.heading, self.heading_sd = 0, 0.0, 0.0
        self.y, self.nis, self.torques = 0.0, 0.0, 0.0

    def start(self, force, speeds):
        p, v = SHEET, float(np.mean(speeds))
        theta = math.asin(clip(force[0] / G, -0.6, 0.6))
        gc = G * math.cos(theta)
        phi = math.asin(clip(force[1] / gc, -0.3, 0.3))
        a = 0.02 if abs(v) < self.still else 2.5 if self.turn_walk else 1.0
        noise, most = p["vrw"] / math.sqrt(DT), 2.5 if self.turn_walk else a
        e = max(abs(self.health.norm) - 3.0 * (p["bias"] + noise) - most**2 / (2.0 * G), 0.0)
        bias = math.sqrt(p["bias"] ** 2 + 2.0 * G * e)
        angle = math.sqrt(bias**2 + a**2 + noise**2) / gc
        scale = p["scale"] / math.sqrt(len(speeds))
        sd = np.zeros(11)
        sd[[V, TH, PH, EW]] = 2.0 * p["wheel"] + scale * abs(v) + max(np.ptp(speeds) - 6.0 * p["wheel"], 0.0), angle, angle, scale
        sd[[BX, BY, BZ]], sd[[GX, GY, GZ]] = (bias, bias, p["bias"] + e), p["gyro"]
        self.b = Belief(np.zeros(11), np.diag(sd**2))
        self.b.x[[V, TH, PH]] = v, theta, phi
        for angle, at in ((TH, BX), (PH, BY)):
            self.b.P[angle, at] = self.b.P[at, angle] = -bias**2 / gc

    @staticmethod
    def rates(x, force, w):
        """Acceleration, rates of pitch and roll, body rates."""
        p, q, r = (w[0] - x[GX], w[1] - x[GY], w[2] - x[GZ]) if w is not None else (0.0, 0.0, 0.0)
        forward = 0.0 if force is None else force[0] - x[BX] - G * np.sin(x[TH]) + ARM * (q * q + r * r)
        if w is None:
            return forward, x[KA] * x[V], 0.0, None
        pitch = r * np.sin(x[PH]) - q * np.cos(x[PH])
        return forward, pitch, p - np.tan(x[TH]) * (q * np.sin(x[PH]) + r * np.cos(x[PH])), (p, q, r)

    def step(self, force, w, speeds):
        yaw_bias, v = (0.0, 0.0) if self.b is None else self.b.x[[GZ, V]]
        force, w = self.health.step(force, w, yaw_bias, v, self.gyro)
        if self.b is None:
            self.start(force, speeds)
        b, p = self.b, SHEET
        if (w is not None) == (b.P[KA, KA] > 0.0):
            b.alone(KA, *((0.0, 0.0) if w is not None else (self.curvature, 0.005**2)))
        before = b.x.copy()
        self.predict(force, w)
        used, rejected = self.used, self.rejected = self.wheels(before, force, w, speeds)
        if force is not None and w is not None:
            self.across_and_up(force, w)
        self.standstill(w, used)
        limits = np.array([100.0, math.pi / 3, math.pi / 3, *[np.inf] * 6, 0.13, np.inf])
        b.x = np.clip(b.x, -limits, limits)
        most = np.array([10.0, 0.6, 0.6, 2.0, 2.0, 2.0, 0.1, 0.1, 0.3, 0.3, 0.1])
        shrink = np.minimum(1.0, most / np.sqrt(np.maximum(np.diag(b.P), 1e-300)))
        b.P = shrink[:, None] * b.P * shrink[None, :]
        self.find(before, force, w)
        self.imu = force is not None and (w is not None or not self.gyro)

    def predict(self, force, w):
        b, p = self.b, SHEET
        left = 1.0 if w is not None else math.exp(-(0.02 + abs(b.x[V])) * DT / p["curve_length"])

        def f(x):
            forward, pitch, roll, _ = self.rates(x, force, w)
            following = np.array(x)
            following[V], following[TH], following[PH] = x[V] + forward * DT, x[TH] + pitch * DT, x[PH] + roll * DT
            following[KA], following[EW] = x[KA] * left, x[EW] / (1.0 + DT / 300.0)
            return following

        seen = self.seen_walk()
        Q = np.zeros(11)
        Q[V] = max(p["vrw"] ** 2 + p["speed_walk"] ** 2, seen**2) * DT if force is not None else 0.25 * DT
        Q[TH] = (p["arw"] ** 2 if w is not None else 1e-8) * DT
        Q[PH] = ((p["arw"] ** 2 if w is not None else 1e-3) + p["roll_walk"] ** 2) * DT
        Q[[BX, BY, BZ]], Q[[GX, GY, GZ]] = p["bias_walk"] ** 2 * DT, p["gyro_walk"] ** 2 * DT
        Q[KA] = p["curve_sd"] ** 2 * (1.0 - left**2)
        Q[EW] = p["scale"] ** 2 / 2.0 * (1.0 - 1.0 / (1.0 + DT / 300.0) ** 2)
        # a turn couples into the pitch what the roll is wrong by
        Q[TH] += self.turn_walk * (w[2] - b.x[GZ]) ** 2 * DT if w is not None else 0.0
        F = jacobian(f, b.x)
        b.x, b.P = f(b.x), F @ b.P @ F.T + np.diag(Q)

    def wheels(self, before, force, w, speeds):
        b, sd = self.b, SHEET["wheel"]
        pitch = lambda x: self.rates(x, force, w)[1]
        at, by = pitch(before), jacobian(lambda x: np.array([pitch(x)]), before)[0]
        h = lambda x: (x[V] - BELOW * (at + by @ (x - before))) * (1.0 + x[EW])
        expected = h(b.x)
        limit = SHEET["gate"] * math.sqrt(b.P[V, V] + sd**2 + (0.004 * expected) ** 2)
        each = speeds / (1.0 + self.k)
        inside = each[np.abs(each - expected) <= limit]
        self.voted = float(np.mean(inside)) if len(inside) else each[np.argmin(np.abs(each - expected))]
        used, rejected = len(inside), len(each) - len(inside)
        self.slipping = np.sum((np.abs(each - expected) > limit) & ((each - expected) * self.torques > 0.0))
        if used == 0:
            self.events.add("no wheel")
            self.coast += DT
            b.P[V, V] += DT if self.coast > 8.0 else 0.0
            return used, rejected
        self.coast, mean, R = 0.0, float(np.mean(inside)), sd**2 / used
        self.events.add("one wheel" if rejected else "wheels")
        if rejected == 0 and abs(mean) > 0.06:
            self.k = np.clip(self.k + DT / 20.0 * (speeds / mean - 1.0 - self.k), -0.2, 0.2)
        self.y, S = b.measure(h, R, z=mean)
        self.nis = self.y**2 / S
        return used, rejected

    def across_and_up(self, force, w):
        b, p = self.b, SHEET
        rate = w - b.x[[GX, GY, GZ]]
        if self.smooth is None:
            self.smooth = self.first = rate
        self.smooth = self.smooth + DT / (0.05 + DT) * (rate - self.smooth)
        v, ct = b.x[V], math.cos(b.x[TH])
        _, q, r = rate
        side = force[1] - v * r - G * ct * math.sin(b.x[PH])
        up = force[2] + v * q - G * ct * math.cos(b.x[PH]) - BELOW * q * q
        self.sums, self.length = self.sums + np.array([force[0], side, up, q]) * DT, self.length + DT
        if self.length < 0.05 - 1e-6:
            return
        T, (dp, dq, dr) = self.length, self.smooth - self.first
        means = self.sums / T
        turned, nodded = (ARM * dr + BELOW * dp) / T, -ARM * dq / T
        means[1], means[2] = means[1] - turned, means[2] - nodded
        self.sums, self.length, self.first = np.zeros(4), 0.0, self.smooth
        for seen, mean in zip(self.seen, means):
            seen.see(mean, T)
        across = lambda x: x[V] * (w[2] - x[GZ]) + G * np.sin(x[PH]) * np.cos(x[TH]) + x[BY] + turned
        upward = lambda x: (-x[V] * (w[1] - x[GY]) + G * np.cos(x[PH]) * np.cos(x[TH]) + x[BZ] + BELOW * (w[1] - x[GY]) ** 2 + nodded)
        R = [max(k * p["vrw"] ** 2, self.seen[i].walk() ** 2) / T for i, k in ((1, 1.0), (2, p["bounce"]))]
        for i, (h, bias, R) in enumerate([(across, BY, R[0] + self.side**2), (upward, BZ, R[1])]):
            y = means[1 + i] - b.x[bias]
            y, S = b.measure(h, R, y=y, huber=3.0)
            if y * y > 9.0 * S:
                self.events.add(f"Huber {i}")

    def standstill(self, w, used):
        if abs(self.b.x[V]) >= self.still:
            self.quiet = 0.0
        elif used:
            self.quiet += DT
        if w is not None and self.quiet > 0.3:
            self.events.add("standstill")
            for i, rate in zip((GX, GY, GZ), w):
                self.b.measure(lambda x, i=i: x[i], 3e-4**2 / DT, z=rate)

    def seen_walk(self):
        """Velocity random walk seen along the body; without windows, for want of a gyro, nothing is seen."""
        return self.seen[0].walk() if self.smooth is not None else 0.0

    def find(self, before, force, w):
        b = self.b
        self.v_dot, pitch, _, body = self.rates(before, force, w)
        self.pitch_rate = pitch
        self.v = b.x[V] - BELOW * pitch
        if w is None:
            self.curvature = clip(b.x[KA], -0.13, 0.13)
        elif abs(self.v) > 0.06:
            way = abs(self.v) * DT / 0.05
            self.curvature = clip(self.curvature + way / (1.0 + way) * (pitch / self.v - self.curvature), -0.13, 0.13)
        usual = 3.0 * math.sqrt(b.P[TH, TH]) + 0.004
        self.mount_sd = self.separation.step(b, body, None if force is None else self.v_dot, self.voted, self.turn_walk, SHEET["bias"], self.health.scale)
        beyond = abs(self.separation.without_gyro) - usual
        on_rail = self.turn_walk == 0.0
        if on_rail and self.used and not self.rejected and self.separation.heard > 2.0 and 0.0 <= beyond < 0.02:
            self.events.add("opened")
            b.P[TH, TH] += beyond**2 * DT / 0.3
        self.pitch_sd = math.sqrt(b.P[TH, TH])
        self.arm_error(self.v * DT, math.sqrt(b.P[TH, TH]) < 0.003)
        _, q, r = body if body is not None else (0.0, 0.0, 0.0)
        self.yaw = (q * math.sin(b.x[PH]) + r * math.cos(b.x[PH])) / math.cos(b.x[TH])
        c = math.cos(b.x[TH])
        self.sum_sd = math.sqrt(b.P[TH, TH] * c * c + 2.0 * b.P[TH, BX] * c / G + b.P[BX, BX] / G**2)
        self.speed_noise = math.sqrt(max(b.P[V, V] - b.P[V, EW] ** 2 / b.P[EW, EW], 0.0))
        self.grade = b.x[TH] + ARM * self.curvature
        arm = self.arm + (0.05 * self.curvature) ** 2
        self.grade_sd = math.sqrt(self.pitch_sd**2 + arm + self.mount_sd**2 + 0.0003**2)

    def arm_error(self, way, known):
        part = ARM / 4.0
        self.way += way
        if abs(self.way) < part:
            return
        if self.way <= 0.0 or not known:
            self.ways, self.way = [None] * 4, 0.0
            return
        self.way -= part
        if self.way > part:
            self.way = 0.0
        before, self.ways[self.turn] = self.ways[self.turn], self.b.x[TH] + ARM * self.curvature
        if before is not None:
            self.arm = max((1.0 - part / 8.0) * self.arm, 0.25 * (self.b.x[TH] - before) ** 2)
        self.turn = (self.turn + 1) % 4


class Rail:
    """What was read of the rail, by node: a dictionary."""

    def __init__(self):
        self.pitch, self.at, self.last = max(0.1, (Train.span + 36.0) / 300.0), 0.0, None
        self.u, self.low, self.high, self.doubt = {}, 0, 0, 0.0

    def step(self, way, reading):
        self.at += way
        self.doubt *= 1.0 - min(abs(way) / (300.0 * self.pitch), 1.0)
        if reading is None:
            return
        (start, old), self.last = self.last or (self.at, reading), (self.at, reading)
        first, second = math.floor(start / self.pitch), math.floor(self.at / self.pitch)
        if not self.u:
            self.write(second, reading)
            self.low = self.high = second
            return
        passed = range(first + 1, second + 1) if second > first else range(first, second, -1)
        for node in passed:
            share = (node * self.pitch - start) / (self.at - start)
            self.write(node, [a + share * (c - a) for a, c in zip(old, reading)])
        assert self.high - self.low < 300, "the oracle does not forget"

    def write(self, node, value):
        if node in self.u:
            value = [a + 0.3 * (c - a) for a, c in zip(self.u[node], value)]
        u, bend = value
        self.u[node] = [single(u), single(abs(bend))]
        self.low, self.high = min(self.low, node), max(self.high, node)

    def gradient(self):
        count = max(math.floor(1.0 / self.pitch), 1)
        if self.high - self.low < count:
            return 0.0
        return (self.u[self.high][0] - self.u[self.high - count][0]) / (count * self.pitch)

    def sine(self, s):
        """u, and how far the place is ahead of and behind the rail read."""
        node = math.floor(s / self.pitch)
        if not self.u:
            return 0.0, 0.0, 0.0
        if node >= self.high:
            ahead = s - self.high * self.pitch
            return self.u[self.high][0] + self.gradient() * min(ahead, 3.0), ahead, 0.0
        if node < self.low:
            return self.u[self.low][0], 0.0, self.low * self.pitch - s
        (a, _), (c, _) = self.u[node], self.u[node + 1]
        return a + (s / self.pitch - node) * (c - a), 0.0, 0.0

    def bend(self, s):
        node = min(max(math.floor(s / self.pitch), self.low), self.high)
        return self.u[node][1] if self.u else 0.0


class Means:
    """Means over the train with the unit's middle at `s`."""

    def __init__(self, rail, s):
        self.S = self.deep = self.behind = self.ahead = self.most = bend = 0.0
        self.per_m = 0.02 + 0.7 * abs(rail.gradient())
        for (front, rear), mass, depth in Train.masses:
            S, slope, ahead, behind, most = self.ends(rail, s, front, rear)
            self.S += mass * S
            self.deep += mass * (S + depth * S / self.cosine(S) * slope)
            self.behind, self.ahead, self.most = self.behind + mass * behind, self.ahead + mass * ahead, max(self.most, most)
            bend += mass * rail.bend(s - 0.5 * (front + rear))
        self.bend = bend / sum(mass for _, mass, _ in Train.masses)
        S, slope, _, self.load_behind, _ = self.ends(rail, s, *Train.load_places)
        self.c = self.cosine(S)
        self.load, self.curve = S, slope / self.c
        self.load_deep = S + (Train.hook + Train.below) * S * self.curve
        self.S += Train.gear_kg * S
        self.deep += Train.gear_kg * self.load_deep
        self.behind += Train.gear_kg * self.load_behind

    @staticmethod
    def cosine(sine):
        return math.sqrt(1.0 - sine * sine)

    @staticmethod
    def ends(rail, s, front, rear):
        (u1, a1, b1), (u2, a2, b2) = rail.sine(s - front), rail.sine(s - rear)
        return 0.5 * (u1 + u2), (u1 - u2) / max(rear - front, 0.05), 0.5 * (a1 + a2), 0.5 * (b1 + b2), max(a1, a2)


class Block:
    """Collects samples of half a second."""

    def __init__(self, s, v):
        self.start, self.v0 = s, v
        self.F, self.variance, self.v, self.noise, self.brake, self.good = [], [], 0.0, 0.0, 0.0, True
        self.parts, self.way, self.t, self.length, self.walk = [], 0.0, 0.0, 0.0, 0.0

    def take(self, force, variance, att, brake, good):
        self.F.append(force)
        self.variance.append(variance)
        if self.length == 0.0:
            self.part_v = self.v0
        self.v += att.v * DT
        self.walk = max(self.walk, att.seen_walk())
        self.noise, self.brake, self.good = max(self.noise, att.speed_noise), max(self.brake, brake), self.good and good
        self.way, self.t, self.length = self.way + att.v_dot * DT, self.t + DT, self.length + DT
        if self.t < 0.1 - 1e-6:
            return False
        by_speed, by_force = (att.v - self.part_v) / self.t, self.way / self.t
        self.parts.append(by_force + self.shaken()[1] * (by_speed - by_force))
        self.part_v = att.v
        self.way = self.t = 0.0
        return len(self.parts) == 5

    def shaken(self):
        """Noise of the acceleration of a part that is shaken, and the share of the speed in it."""
        force, speed = self.walk**2 / 0.1, 2.0 * (self.noise / 0.1) ** 2
        return (0.0, 0.0) if force < 0.01**2 else (math.sqrt(force * speed / (force + speed)), force / (force + speed))

    def close(self, s, v, mass):
        inertia = max(2.0 * (self.noise / self.length) ** 2 - 2.5e-3**2, 0.0) * mass**2
        self.variance = single(sum(self.variance) / len(self.variance) ** 2 + inertia)
        self.F, self.speed = single(np.mean(self.F)), single(self.v / self.length)
        self.shake = single(self.shaken()[0])
        shift = (v - self.v0) / self.length - sum(self.parts) / 5.0
        self.a = [single(a + shift) for a in self.parts]
        self.h = single(self.length / 5.0)
        self.place = 0.5 * (self.start + s)
        self.good = self.good and self.brake <= 0.002
        return self


ML, R0, CV, QC, AN, RA, D, ET, B, LA = range(10)
MU_LOAD = Train.mu * Train.share


LOADS = [(0.03, 0.03), (0.10, 0.04), (0.19, 0.05), (0.31, 0.07), (0.46, 0.08), (0.62, 0.08), (0.78, 0.08), (0.94, 0.08)]
WIDTH = sum(sd for _, sd in LOADS)
# protection level of a normal error over its standard deviation
LEVEL = 3.89


class Balance:
    """Force balance of a load, with the weight of its hypothesis."""

    most = Train.high - Train.tare
    W = (Train.tare + most / 3.0) * G

    def __init__(self, load, sd, weight):
        W, x = self.W, np.zeros(10)
        x[[ML, R0, CV]] = load * self.most, (Train.mu - MU_LOAD) * W, 0.03 * Train.mu * W
        sd = [sd * self.most, 0.4 * Train.mu * W, 0.04 * Train.mu * W, 15e3, 0.02, 0.08, 0.006 * W / G, 0.02, math.hypot(SHEET["bias"], G * SHEET["mount"]), 0.1]
        self.b, self.weight, self.grade, self.behind = Belief(x, np.diag(np.square(sd))), weight, 0.0, 0.0

    def other(self, load, sd, weight):
        new = Balance(load, sd, weight)
        new.b, new.grade, new.behind = Belief(self.b.x, self.b.P), self.grade, self.behind
        for i, x, own in [(ML, load * self.most, sd * self.most), (AN, 0.0, 0.06), (RA, 0.0, 0.25)]:
            new.b.alone(i, x, own**2)
        new.b.P[R0, R0] += 0.1 * (0.4 * Train.mu * self.W) ** 2
        return new

    def is_same(self, other):
        own, others, apart = self.b.P[ML, ML], other.b.P[ML, ML], self.b.x[ML] - other.b.x[ML]
        mean = 0.5 * (own + others)
        return 0.125 * apart**2 / mean + 0.5 * math.log(mean / math.sqrt(own * others)) < 0.1

    def merge(self, other):
        share, apart = self.weight / (self.weight + other.weight), self.b.x - other.b.x
        self.b.P = share * self.b.P + (1.0 - share) * other.b.P + share * (1.0 - share) * np.outer(apart, apart)
        self.b.x, self.weight = self.b.x - (1.0 - share) * apart, self.weight + other.weight

    @staticmethod
    def length(x):
        return (Train.chain + G * (x[ML] + Train.gear_kg) / Train.stiffness) * np.exp(x[LA])

    def pendulum(self, x, block, means, free=1.0):
        """φ, φ̇ at the end and the mean of φ: of the free motion from (φ, φ̇), `free` of it, and of the forced one from rest."""
        w, h = np.sqrt(G / self.length(x)), block.h

        def swing(angle, rate, accelerations):
            total = 0.0
            for a in accelerations:
                rest = -a * means.c / G
                away = angle - rest
                total += rest * h + away * np.sin(w * h) / w + rate * (1.0 - np.cos(w * h)) / w**2
                angle, rate = rest + away * np.cos(w * h) + rate * np.sin(w * h) / w, rate * np.cos(w * h) - away * w * np.sin(w * h)
            return np.array([angle, rate, total / (5.0 * h)])

        return free * swing(x[AN], x[RA], [0.0] * 5) + swing(0.0, 0.0, block.a)

    def correct(self, block, means, T, noise):
        """Corrects by a block, with the noise at the state `noise`; returns the normalised innovation squared."""
        b, a, s, v = self.b, float(np.mean(block.a)), -1.0 if block.speed < 0 else 1.0, block.speed
        f = MU_LOAD * G * means.c * s
        a_load = lambda x: -G * self.pendulum(x, block, means)[2] * means.c * (1.0 + Train.hook * means.curve)
        normal = 1.0 - Train.share * (1.0 - means.c)

        def h(x):
            forces = (x[ML] + Train.gear_kg) * a_load(x) + x[ML] * (G * means.load_deep + f)
            forces += s * (normal * x[R0] + x[CV] * abs(v) + x[QC] * means.bend) + x[D]
            forces += x[ET] * G / 9.0 * (means.behind + x[ML] * means.load_behind)
            return forces - (Train.tare + x[ML]) * x[B]

        z = block.F - (Train.J + Train.tare - Train.gear_kg) * a - G * means.deep - Train.tare * f
        M, hanging = Train.tare + noise[ML], noise[ML] + Train.gear_kg
        R = block.variance + (0.0016 * M) ** 2 + (means.per_m * M * G * means.ahead / Train.tare) ** 2
        free = G * means.c * (1.0 + Train.hook * means.curve) * block.shake * math.sqrt(block.h) / self.length(noise)
        R += (hanging * free * math.sqrt(T**3 / 20.0)) ** 2
        R += (0.015 * hanging * (abs(a) + abs(a_load(noise)))) ** 2
        y, S = b.measure(h, R, z=z, huber=3.0)
        b.x[ML], b.x[LA] = clip(b.x[ML], 0.0, self.most), clip(b.x[LA], -0.5, 0.5)
        return y * y / S

    def predict(self, block, means, T, M):
        b, v = self.b, abs(block.speed)

        def f(x):
            following = np.array(x)
            following[AN], following[RA], _ = self.pendulum(x, block, means, 0.99)
            following[D] = x[D] * math.exp(-T / 2.0)
            return following

        F = jacobian(f, b.x)
        b.x = f(b.x)
        L, x = self.length(b.x), b.x
        amplitude = x[AN] ** 2 + x[RA] ** 2 * L / G
        own = Train.tare + x[ML]
        grade = (means.deep + x[ML] * means.load_deep) / own
        turn = min(abs(grade - self.grade) / (v * T), 0.13) if v > 0.06 else 0.0
        behind = (means.behind + x[ML] * means.load_behind) / own
        onto, self.grade, self.behind = max(behind - self.behind, 0.0), grade, behind
        Q = np.zeros(10)
        walk = 0.003**2 + (block.shake / L) ** 2 * T / 5.0
        Q[AN] = 0.04**2 * amplitude * T + 0.1 * walk * T
        Q[RA] = 0.04**2 * amplitude * T * G / L + walk * T
        Q[D] = (M * (0.006 + G * turn * 0.06 + 0.15 * means.bend)) ** 2 * (1.0 - math.exp(-T))
        Q[R0] = (1e-4 * M) ** 2 * T
        Q[ET] = 0.02**2 * (1.0 - math.exp(-onto))
        b.P = F @ b.P @ F.T + np.diag(Q)


class Bank:
    """Gaussian sum over the load."""

    def __init__(self):
        self.all = [Balance(load, sd, sd / WIDTH) for load, sd in LOADS]
        self.settle, self.due, self.since, self.used, self.deweighted, self.merged, self.shared = 0.0, 0.0, 0, 0, 0, 0, 0
        self.x, self.variance = np.array(self.heaviest().b.x), 0.0
        self.x[ML] = Balance.most / 3.0
        self.publish(self.x)

    def heaviest(self):
        return max(self.all, key=lambda h: h.weight)

    def mass(self):
        return Train.tare + self.x[ML]

    def publish(self, x):
        self.x = np.array(x)
        self.variance = sum(h.weight * (h.b.P[ML, ML] + (h.b.x[ML] - x[ML]) ** 2) for h in self.all)
        gain = (Train.tare + x[ML]) * math.sqrt(0.005**2 / 2.0 + 0.035**2 + 0.01**2)
        covered = [(h, LEVEL**2 + 2.0 * math.log(h.weight)) for h in self.all if math.exp(-(LEVEL**2) / 2.0) < h.weight]
        self.level = max(abs(h.b.x[ML] - x[ML]) + math.sqrt(k * (h.b.P[ML, ML] + gain**2)) for h, k in covered)

    def step(self, block, means):
        T, v = 5.0 * block.h, block.speed
        self.settle = max(self.settle - T, 0.0) if abs(v) > 0.06 else 0.3
        self.due += T
        of_use = abs(v) > 0.06 and self.settle <= 0.0 and block.good and means.most <= 0.5
        if of_use and not (v < 0.0 and means.behind > 0.5 * Train.tare):
            self.since, self.used = self.since + 1, self.used + 1
            if self.since >= 4:
                self.share_out(1.0 - math.exp(-3e-5 * self.due))
            self.weigh(block, means, T)
        M = Train.tare + self.heaviest().b.x[ML]
        for h in self.all:
            h.predict(block, means, T, M)
        if self.used > 0:
            self.publish(self.heaviest().b.x)

    def share_out(self, share):
        best, self.due, self.since, self.shared = self.heaviest(), 0.0, 0, self.shared + 1
        for h in self.all:
            h.weight *= 1.0 - share
        self.all += [best.other(load, sd, share * sd / WIDTH) for load, sd in LOADS]

    def weigh(self, block, means, T):
        noise = np.array(self.heaviest().b.x)
        squares = np.array([h.correct(block, means, T, noise) for h in self.all])
        self.deweighted += int(squares[0] > 9.0)
        for h, square in zip(self.all, squares):
            h.weight *= (1.0 + square / 3.0) ** -2
        total = sum(h.weight for h in self.all)
        for h in self.all:
            h.weight /= total
        i = 0
        while i < len(self.all):
            j = i + 1
            while j < len(self.all):
                if self.all[i].is_same(self.all[j]):
                    self.all[i].merge(self.all[j])
                    self.forget(j)
                    self.merged += 1
                else:
                    j += 1
            i += 1
        while len(self.all) > 8 or min(h.weight for h in self.all) < 1e-12:
            self.forget(min(range(len(self.all)), key=lambda i: self.all[i].weight))

    def forget(self, i):
        """The last one takes its place."""
        self.all[i] = self.all[-1]
        self.all.pop()


def rim_force(torque, v):
    d = 0.5 * (1.0 + clip(math.copysign(1.0, torque) * v / 0.0085, -1.0, 1.0))
    gain = Train.gear / Train.radius * (d * Train.efficiency + (1.0 - d) / Train.efficiency)
    return torque * gain, ((0.01 * torque) ** 2 + 0.2**2) * gain**2


class Fusion:
    def __init__(self):
        self.att, self.rail, self.balance = Attitude(True), Rail(), Bank()
        self.brake, self.block, self.waiting, self.age, self.sine = 0.0, None, [], 1.0, 0.0

    def step(self, force, w, speeds, torques, brake):
        att, balance = self.att, self.balance
        att.torques = torques
        att.step(force, w, speeds)
        v = att.v
        bend = abs(att.yaw / v) if abs(v) > 0.06 else 0.0
        apart = att.separation.apart
        readable = att.sum_sd < 0.02
        self.rail.doubt += max(math.sqrt(att.b.P[V, V]) - 0.02, 0.0) * DT
        assert self.rail.doubt < 0.5, "the oracle never loses its place"
        self.rail.step(v * DT, [math.sin(att.b.x[TH]) + att.b.x[BX] / G, bend] if readable else None)
        self.brake += DT / (0.3 + DT) * (brake - self.brake)
        forces = [rim_force(torque, v) for torque in torques]
        if att.sum_sd < 0.003 <= apart:
            att.events.add("apart")
        good = att.imu and att.sum_sd < 0.003 and apart < 0.003 and abs(np.mean(speeds)) >= 0.05 and att.used > 0 and att.slipping == 0
        if self.block is None:
            self.block = Block(self.rail.at, v)
        if self.block.take(sum(F for F, _ in forces), sum(s for _, s in forces), att, self.brake, good):
            self.waiting.append(self.block.close(self.rail.at, v, balance.mass()))
            self.block = Block(self.rail.at, v)
        assert len(self.waiting) < 25, "the oracle drops no block"
        if self.waiting:
            block = self.waiting[0]
            front = math.floor((block.place + 0.4) / self.rail.pitch)
            read = bool(self.rail.u) and front < self.rail.high
            if v <= 0.06 or read:
                self.waiting.pop(0)
                balance.step(block, Means(self.rail, block.place))
        self.age += DT
        if self.age >= 0.1 - 1e-6:
            means, x, M = Means(self.rail, self.rail.at), balance.x, balance.mass()
            self.age = 0.0
            self.sine = (means.S + x[ML] * means.load) / M - att.b.x[BX] / G
            self.sine += x[ET] * (means.behind + x[ML] * means.load_behind) / 9.0 / M


def attitude_row(att):
    b = att.b
    own = [b.x[TH], b.x[PH], b.x[BX], b.x[GY], b.x[EW], math.sqrt(b.P[BX, BX]), math.sqrt(b.P[EW, EW])]
    return [att.v, math.sqrt(b.P[V, V]), att.grade, att.grade_sd, LEVEL * att.grade_sd, att.y, att.nis, *own]


def oracle(table):
    rows = np.column_stack([table[name] for name in COLUMNS])
    header = ["run", "speed", "speed_sd", "grade", "grade_sd", "level", "innovation", "nis", *[f"own{i + 1}" for i in range(7)]]
    out = []
    for run, gyro in enumerate([True, False]):
        att = Attitude(gyro)
        for k, row in enumerate(rows):
            att.step(row[1:4], row[4:7], row[9:11])
            if k % 10 == 9:
                out.append([run, *attitude_row(att)])
        wanted = {"|f| is not g", "no wheel", "one wheel", "wheels"}
        wanted |= {"spike", "stuck gyro", "standstill", "opened", "Huber 0", "Huber 1"} if gyro else set()
        assert wanted <= att.events, f"not met: {wanted - att.events}"
    fusion = Fusion()
    for k, row in enumerate(rows):
        fusion.step(row[1:4], row[4:7], row[9:11], row[7:9], row[11])
        if k % 10 == 9:
            x, variance, att = fusion.balance.x, fusion.balance.variance, fusion.att
            effective = math.asin(fusion.sine)
            own = [x[R0], x[AN], x[D], x[ET], x[LA], math.sqrt(variance)]
            read_sd = math.hypot(att.sum_sd, 0.0003)
            out.append([2, att.v, math.sqrt(att.b.P[V, V]), att.grade, att.grade_sd, fusion.balance.level, fusion.balance.mass(), effective, *own, read_sd])
    assert "apart" in fusion.att.events
    b = fusion.balance
    met = (b.used, b.deweighted, b.merged, b.shared)
    assert b.used > 40 and b.deweighted > 0 and b.merged > 5 and b.shared > 5, met
    return header, out
