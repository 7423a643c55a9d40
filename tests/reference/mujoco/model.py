"""The train as a MuJoCo model: 18 free bodies; drawbars and chains are MuJoCo's spring-damper tendons; hangers, wheels, brakes and
resistances are forces of our own on the rail curve. Written from the documentation (docs/src/physics.md) and not from the Rust.

Integrator: Euler. implicitfast takes the damping of tendons between two kinematic trees into the mass matrix of each tree alone, and
so loses 2.3 % of the momentum of this train.
"""

import math

import mujoco
import numpy as np

import parts

GRAVITY = 9.81
ROLLING_STIFFNESS = 1e6  # N/m of way, until rolling resistance is at its limit
ROLL_STIFFNESS, ROLL_DAMPING, WHEEL_HALF_WIDTH = 2e4, 2e2, 0.03
SHOE_DAMPING = 2e4


def dot(a, b):
    return np.einsum("ij,ij->i", a, b)


def direction(v):
    x = np.clip(v / 0.01, -1.0, 1.0)
    return 1.5 * x - 0.5 * x**3


class Train:
    def __init__(self, path, rail, load_kg, front, dt):
        self.consist = c = parts.read(path)
        self.rail, self.dt, self.load = rail, dt, len(c.bodies) - 1
        self.m = mujoco.MjModel.from_xml_string(self._xml(load_kg, front))
        self.d = mujoco.MjData(self.m)
        mujoco.mj_forward(self.m, self.d)
        self._wheels(front)
        self.linear = self.m.jnt_dofadr[:, None] + np.arange(3)
        self.angular = self.linear + 3
        self.time_of_brake = None

    def _xml(self, load_kg, front):
        c, rail = self.consist, self.rail
        sites, tendons, bodies = {}, [], []

        def site(body, place):
            sites[f"s{len(sites)}"] = (body, place)
            return f"s{len(sites) - 1}"

        for joints, chain in ((c.drawbars, False), (c.chains, True)):
            for j in joints:
                free = float(np.linalg.norm(c.bodies[j.a].start(j.at_a) - c.bodies[j.b].start(j.at_b)))
                length = f"0 {free!r}" if chain else f"{free!r}"
                tendons.append(
                    f'<spatial stiffness="{j.stiffness}" damping="{j.damping}" springlength="{length}">'
                    f'<site site="{site(j.a, j.at_a)}"/><site site="{site(j.b, j.at_b)}"/></spatial>'
                )
        numbers = lambda *values: " ".join(repr(float(x)) for x in values)
        for i, b in enumerate(c.bodies):
            p, t, left, up, _ = (x[0] for x in rail.at(np.array([front + b.s])))
            axes = np.c_[t, left, up] @ (np.diag([-1.0, -1.0, 1.0]) if b.reversed else np.eye(3))
            quat = np.zeros(4)
            mujoco.mju_mat2Quat(quat, axes.flatten())
            inertials = "".join(
                f'<body><inertial pos="{numbers(*x)}" mass="{mass!r}" '
                f'fullinertia="{numbers(j[0, 0], j[1, 1], j[2, 2], j[0, 1], j[0, 2], j[1, 2])}"/></body>'
                for mass, x, j in parts.body_masses(b, load_kg)
            )
            marks = "".join(f'<site name="{n}" pos="{numbers(*x)}"/>' for n, (k, x) in sites.items() if k == i)
            bodies.append(f'<body pos="{numbers(*(p + up * b.z))}" quat="{numbers(*quat)}"><freejoint/>{inertials}{marks}</body>')
        return (
            '<mujoco><compiler fusestatic="true" angle="radian"/>'
            f'<option timestep="{self.dt}" gravity="0 0 {-GRAVITY}" integrator="Euler"><flag contact="disable"/></option>'
            f'<worldbody>{"".join(bodies)}</worldbody><tendon>{"".join(tendons)}</tendon></mujoco>'
        )

    def _wheels(self, front):
        bodies, rows = self.consist.bodies, []
        for i, b in enumerate(bodies):
            if b.kind not in ("drive", "trolley"):
                continue
            gear = b.sheet["running_gear"]
            wheels = [b.urdf.at(n) for n in b.urdf.links if n.startswith("running_wheel")]
            guide = next(b.urdf.at(n) for n in b.urdf.links if n.startswith("guide_wheel"))
            for k, x in enumerate(sorted({round(float(w[0]), 6) for w in wheels})):
                rows.append([i, x, abs(wheels[0][1]), guide[2], k == 0] + [gear[n] for n in (
                    "wheel_stiffness_npm", "wheel_damping_nspm", "holddown_play_m", "guide_stiffness_npm", "guide_damping_nspm")])
        rows = np.array(rows, float)
        self.stations = rows[:, 0].astype(int)
        self.x, self.arm, self.guide_z, self.first, self.wk, self.wc, self.play, self.gk, self.gc = rows[:, 1:].T
        self.first = self.first > 0
        self.units = np.array([i for i, b in enumerate(bodies) if b.kind == "drive"])
        sheet = bodies[self.units[0]].sheet["drive"]
        urdf = bodies[self.units[0]].urdf
        wheel = urdf.links["friction_wheel_left"]
        self.radius = float(wheel.find("visual/geometry/cylinder").get("radius"))
        self.ratio = sheet["gear"]["ratio"]
        self.driving, self.braking = sheet["gear"]["efficiency_drive"], sheet["gear"]["efficiency_brake"]
        self.inertia = float(wheel.find("inertial/inertia").get("izz")) + 0.5 * self.ratio**2 * sheet["motor"]["inertia_kgm2"]
        self.clamp = sheet["clamp"]["pressure_mpa"] * 1e6 * parts.piston_area(sheet["clamp"])
        friction = sheet["friction"]
        self.adhesion, self.sigma0, self.sigma1, self.kappa = (friction[k] for k in ("adhesion", "sigma0_npm", "sigma1_nspm", "kappa_1pm"))
        self.brake_max, self.brake_lag = float(sheet["brake"]["force_max_n"]), sheet["brake"]["lag_s"]
        self.on_rail = np.concatenate([self.stations, self.units])
        self.offset = np.concatenate([self.x, 0.0 * self.units])
        self.s = front + np.array([bodies[i].s for i in self.on_rail]) + self.offset
        self.imu = urdf.at("imu_link")
        self.imu_s = np.array([front + bodies[self.units[0]].s + self.imu[0]])
        n = len(self.units)
        # left and right wheel of each unit: rate and deflection of its bristles
        self.rate, self.bristle = np.zeros((n, 2)), np.zeros((n, 2))
        self.rolled, self.shoe, self.limit = np.zeros(len(rows)), np.zeros(n), np.full(n, self.brake_max)
        self.web_half = 0.0035

    def motion(self):
        d = self.d
        r = d.xmat[1:].reshape(-1, 3, 3)
        return d.xpos[1:], r, d.qvel[self.linear], np.einsum("ijk,ik->ij", r, d.qvel[self.angular])

    def forces(self, motor, brake):
        """Apply the forces of a motor torque (N·m, the same for each unit) and a brake command; sums along the rail, N."""
        p, r, v, w = self.motion()
        b, n, dt = self.on_rail, len(self.stations), self.dt
        axis = p[b] + r[b, :, 0] * self.offset[:, None]
        self.s = self.rail.project(axis, self.s)
        line, t, left, up, _ = self.rail.at(self.s)
        above = dot(axis - line, up)
        at = axis.copy()
        at[n:] = line[n:] + up[n:] * above[n:, None]  # friction wheels and shoes touch the web where it is
        speed = v[b] + np.cross(w[b], at - p[b])
        along, roll, roll_rate = dot(speed, t), dot(r[b, :, 1], up), dot(w[b], t)
        force, torque = np.zeros_like(at), np.zeros_like(at)

        # running wheels carry on one side and hold down on the other, guide wheels to both sides
        res, half = self.consist.resistance, self.arm
        a, a_rate, side, side_rate = above[:n], dot(speed, up)[:n], dot(axis - line, left)[:n], dot(speed, left)[:n]
        phi, phi_rate = roll[:n], roll_rate[:n]

        def wheel(depth, rate):
            carry = np.where(depth > 0.0, np.maximum(self.wk * depth + self.wc * rate, 0.0), 0.0)
            lift = -depth - self.play
            hold = np.where(lift > 0.0, np.maximum(self.wk * lift - self.wc * rate, 0.0), 0.0)
            return carry - hold, carry + hold

        n_left, l_left = wheel(-(a + half * phi), -(a_rate + half * phi_rate))
        n_right, l_right = wheel(-(a - half * phi), -(a_rate - half * phi_rate))
        guide = -self.gk * (side - self.guide_z * phi) - self.gc * (side_rate - self.guide_z * phi_rate)
        limit = res["running_wheel"] * (l_left + l_right) + res["guide_wheel"] * np.abs(guide)
        self.rolled = np.clip(self.rolled - along[:n] * dt, -limit / ROLLING_STIFFNESS, limit / ROLLING_STIFFNESS)
        held = ROLLING_STIFFNESS * self.rolled
        against = np.where(self.first, direction(along[:n]) * res["bearing_n"] + res["bearing_nspm"] * along[:n], 0.0)
        against[0] += res["air_nspm2"] * along[0] * abs(along[0])
        force[:n] = up[:n] * (n_left + n_right)[:, None] + left[:n] * guide[:, None] + t[:n] * (held - against)[:, None]
        torque[:n] = t[:n] * (half * (n_left - n_right) - self.guide_z * guide)[:, None]

        # friction wheels: elastic contact that lets go as it rolls, with the wheel solved implicitly
        mean = self.rate.mean(1)
        driving = np.where(mean == 0.0, 1.0, 0.5 * (1.0 + np.clip(np.sign(motor) * mean / 0.05, -1.0, 1.0)))
        shaft = motor * self.ratio * (driving * self.driving + (1.0 - driving) / self.braking)
        turning = dot(w[b], up)[n:] * self.web_half
        web = along[n:, None] + np.outer(turning, [-1.0, 1.0])
        rolling = direction(self.rate * self.radius) * res["clamped_wheel"] * self.clamp * self.radius
        load, radius = 0.5 * shaft[:, None] - rolling, self.radius
        fade = 1.0 + dt * self.kappa * np.abs(self.rate * radius)
        gain = (self.sigma0 + self.sigma1 / dt) / fade
        old = self.bristle
        pull = gain * (old - dt * web) - self.sigma1 / dt * old
        rate = (self.rate + dt / self.inertia * (load - radius * pull)) / (1.0 + dt * dt * radius**2 * gain / self.inertia)
        self.bristle = (old + dt * (rate * radius - web)) / fade
        grip = self.sigma0 * self.bristle + self.sigma1 * (self.bristle - old) / dt
        if np.abs(grip).max() > 0.7 * self.adhesion * self.clamp:
            raise RuntimeError("a wheel is near slipping: this model has no sliding friction")
        self.rate = rate
        # clamp brakes
        self.limit += (brake * self.brake_max - self.limit) * dt / (self.brake_lag + dt)
        limit = np.where((brake <= 0.0) & (self.limit < 1.0), 0.0, self.limit)
        before = np.clip(self.shoe, -limit / self.sigma0, limit / self.sigma0)
        self.shoe = np.clip(before - along[n:] * dt, -limit / self.sigma0, limit / self.sigma0)
        shoe = np.clip(self.sigma0 * self.shoe + SHOE_DAMPING * (self.shoe - before) / dt, -limit, limit)
        force[n:] = t[n:] * (grip.sum(1) + shoe)[:, None]
        most = self.clamp * WHEEL_HALF_WIDTH
        torque[n:] = t[n:] * np.clip(-ROLL_STIFFNESS * roll[n:] - ROLL_DAMPING * roll_rate[n:], -most, most)[:, None]

        applied = self.d.xfrc_applied
        applied[:] = 0.0
        centre = self.d.xipos[1:]
        np.add.at(applied, b + 1, np.hstack([force, torque + np.cross(at - centre[b], force)]))
        for h in self.consist.hangers:
            pa, pb = p[h.a] + r[h.a] @ h.at_a, p[h.b] + r[h.b] @ h.at_b
            rate = v[h.b] + np.cross(w[h.b], pb - p[h.b]) - v[h.a] - np.cross(w[h.a], pa - p[h.a])
            f = h.stiffness * (pb - pa) + h.damping * rate
            applied[h.a + 1] += np.r_[f, np.cross(pa - centre[h.a], f)]
            applied[h.b + 1] -= np.r_[f, np.cross(pb - centre[h.b], f)]
        return np.array([grip.sum(), (against - held).sum() + (rolling / radius).sum(), shoe.sum()])

    def step(self, motor, brake):
        mujoco.mj_step1(self.m, self.d)
        sums = self.forces(motor, brake)
        mujoco.mj_step2(self.m, self.d)
        return sums

    def settle(self, seconds=4.0, keep=0.99):
        """Stand on the springs, brakes on, without motion left."""
        for _ in range(round(seconds / self.dt)):
            self.step(0.0, 1.0)
            self.d.qvel *= keep
        self.rate[:] = 0.0

    def state(self):
        """Speed and chainage of the IMU's place on the rail, m/s and m, and swing of the load along and across, rad."""
        mujoco.mj_kinematics(self.m, self.d)
        p, r, v, w = self.motion()
        i = self.units[0]
        at = p[i] + r[i] @ self.imu
        for _ in range(3):
            self.imu_s = self.rail.project(at[None], self.imu_s)
        line, t, _, _, k = (x[0] for x in self.rail.at(self.imu_s))
        speed = (v[i] + np.cross(w[i], at - p[i])) @ t / (1.0 - (at - line) @ k)
        above = self.consist.above_load
        hooks = np.mean([j.at_a for j in self.consist.chains], 0)
        mujoco.mj_comPos(self.m, self.d)
        d = self.d.xipos[1 + self.load] - (p[above] + r[above] @ hooks)
        ahead = r[above][:, 0] * [1.0, 1.0, 0.0]
        ahead /= np.linalg.norm(ahead)
        return speed, self.imu_s[0], math.atan2(d @ ahead, -d[2]), math.atan2(d @ [-ahead[1], ahead[0], 0.0], -d[2])
