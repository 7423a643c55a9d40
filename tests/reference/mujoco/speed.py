"""Speed beside MuJoCo: the same train on a straight rail, held by slide joints or by contact, stepped in C without Python between; and
`monorig run` of the whole train with all sensors and an estimator, in turns: speed.py MONORIG [--rounds N]. All in processor time; of
monorig that of a long run less that of a short one, so that what comes once a run does not count.

Both MuJoCo models do less than monorig: straight level rail, constant force of the drives, no friction wheels, sensors or estimators.
"""

import argparse
import resource
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import mujoco
import numpy as np

import parts

HERE = Path(__file__).resolve().parent
TRAIN = HERE / "../../../assets/trains/dx80_176y.yaml"
SCENARIO = HERE / "../../../scenarios/liu2023_vehicle_test.yaml"
DT, LOAD_KG, DRIVE_N = 1e-3, 10_000.0, 500.0
SHORT_S, LONG_S = 10, 90
ONE_ESTIMATOR = [f"physics.dt_ms={DT * 1e3:.0f}", "estimators={dffrls_aekf_robust: {}}", "expect=[]", "published=[]", "known_failures=[]"]
# upper faces of the lower flange, and half a web
PAD, WEB_HALF = 0.01, 0.0035


def numbers(*values):
    return " ".join(repr(float(x)) for x in values)


def pads(body, rubbing):
    """Spheres where the wheels touch: running wheels on the flange, guide wheels on both sides of the web."""
    if body.kind not in ("drive", "trolley"):
        return ""
    wheels = [body.urdf.at(n) for n in body.urdf.links if n.startswith("running_wheel")]
    guide = next(body.urdf.at(n) for n in body.urdf.links if n.startswith("guide_wheel"))
    all_ = []
    for x in sorted({round(float(w[0]), 6) for w in wheels}):
        for side in (-1.0, 1.0):
            sphere = f'type="sphere" size="{PAD}" mass="0" solref="0.005 1"'
            all_.append(f'<geom {sphere} condim="3" friction="{rubbing} 0 0" pos="{numbers(x, side * abs(wheels[0][1]), PAD)}"/>')
            all_.append(f'<geom {sphere} condim="1" pos="{numbers(x, side * (WEB_HALF + PAD), guide[2])}"/>')
    return "".join(all_)


def model(contact):
    c = parts.read(TRAIN)
    sites, tendons, bodies, drives = {}, [], [], []

    def site(body, place):
        sites[f"s{len(sites)}"] = (body, place)
        return f"s{len(sites) - 1}"

    for joints, chain in ((c.drawbars, False), (c.hangers, False), (c.chains, True)):
        for j in joints:
            free = float(np.linalg.norm(c.bodies[j.a].start(j.at_a) - c.bodies[j.b].start(j.at_b)))
            length = f"0 {free!r}" if chain else f"{free!r}"
            tendons.append(
                f'<spatial stiffness="{j.stiffness}" damping="{j.damping}" springlength="{length}">'
                f'<site site="{site(j.a, j.at_a)}"/><site site="{site(j.b, j.at_b)}"/></spatial>'
            )
    for i, b in enumerate(c.bodies):
        on_rail = b.kind in ("drive", "trolley")
        joint = "<freejoint/>"
        if on_rail and not contact:
            joint = f'<joint name="j{i}" type="slide" axis="1 0 0" damping="10" frictionloss="{150 if b.kind == "drive" else 100}"/>'
        inertials = "".join(
            f'<body><inertial pos="{numbers(*x)}" mass="{mass!r}" '
            f'fullinertia="{numbers(j[0, 0], j[1, 1], j[2, 2], j[0, 1], j[0, 2], j[1, 2])}"/></body>'
            for mass, x, j in parts.body_masses(b, LOAD_KG)
        )
        marks = "".join(f'<site name="{n}" pos="{numbers(*x)}"/>' for n, (k, x) in sites.items() if k == i)
        turn = numbers(0, 0, 0, 1) if b.reversed else numbers(1, 0, 0, 0)
        geoms = pads(b, 0.012) if contact else ""
        bodies.append(f'<body name="b{i}" pos="{numbers(b.s, 0, b.z)}" quat="{turn}">{joint}{inertials}{marks}{geoms}</body>')
        if b.kind == "drive":
            drives.append(i)
    rail = (
        f'<geom type="box" friction="0 0 0" size="200 0.06 0.01" pos="0 0 -0.01"/><geom type="box" size="200 {WEB_HALF} 0.1" pos="0 0 0.1"/>' if contact else ""
    )
    flag = "" if contact else '<flag contact="disable"/>'
    m = mujoco.MjModel.from_xml_string(
        '<mujoco><compiler fusestatic="true" angle="radian"/>'
        f'<option timestep="{DT}" integrator="Euler">{flag}</option>'
        f'<worldbody>{rail}{"".join(bodies)}</worldbody><tendon>{"".join(tendons)}</tendon></mujoco>'
    )
    d = mujoco.MjData(m)
    for i in drives:
        d.xfrc_applied[mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_BODY, f"b{i}"), 0] = DRIVE_N
    mujoco.mj_step(m, d, 2000)
    if not (np.isfinite(d.qpos).all() and d.qvel[0] > 0.1):
        raise RuntimeError("this model does not drive")
    return m, d


def times_real_time(m, d, steps=2000):
    start = time.process_time()
    mujoco.mj_step(m, d, steps)
    return steps * DT / (time.process_time() - start)


def run_s(program, stop_s):
    """Processor time of a run that ends at stop_s, s."""

    def children():
        u = resource.getrusage(resource.RUSAGE_CHILDREN)
        return u.ru_utime + u.ru_stime

    before = children()
    with tempfile.TemporaryDirectory() as out:
        settings = [*ONE_ESTIMATOR, f"stop.after_s={stop_s}"]
        command = [program, "run", SCENARIO, "--no-rerun", "--out", out, *(w for s in settings for w in ("--set", s))]
        subprocess.run(command, capture_output=True, check=True)
    return children() - before


def of_monorig(program):
    return (LONG_S - SHORT_S) / (run_s(program, LONG_S) - run_s(program, SHORT_S))


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("monorig", help="the program")
    arguments.add_argument("--rounds", type=int, default=7)
    given = arguments.parse_args()
    peers = {"slide joints": model(contact=False), "contact": model(contact=True)}
    for name, (m, d) in peers.items():
        print(f"{name}: {m.nbody - 1} bodies, {m.nv} degrees of freedom, {d.ncon} contacts, speed {d.qvel[0]:.2f} m/s")
    seen = {name: [] for name in (*peers, "monorig")}
    for _ in range(given.rounds):
        for name, (m, d) in peers.items():
            seen[name].append(times_real_time(m, d))
        seen["monorig"].append(of_monorig(given.monorig))
    for name, factors in seen.items():
        print(f"{name:12} {statistics.median(factors):8.1f} times real time (median), {max(factors):8.1f} (best)")
    for name in peers:
        ratios = [ours / peer for ours, peer in zip(seen["monorig"], seen[name])]
        print(f"monorig is {statistics.median(ratios):.1f} times as fast as MuJoCo with {name} ({min(ratios):.1f} to {max(ratios):.1f})")


if __name__ == "__main__":
    main()
