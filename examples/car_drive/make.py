#!/usr/bin/env python3
"""Writes the three CSV files of the walk in docs/src/logs.md: 150 s of a car over hills, from a force balance.

What is wrong with this car, which nobody tells the map: the accelerometer has a bias of 0.15 m/s² and shows 3 % too much
(the body leans), the gyro has a bias of 0.02 rad/s, and the torque on the bus is 5 % smaller than what drives the wheels.
"""
import math
import random

G, MASS, ROTATING, RADIUS = 9.80665, 1720.0, 60.0, 0.31
RESISTANCE, DRAG, DENSITY = 0.013, 0.66, 1.2
BIAS, SCALE, GYRO, GAIN = 0.15, 0.03, 0.02, 1.05

random.seed(2)
noise = lambda sd: random.gauss(0.0, sd)
slope_at = lambda s: 0.05 * math.sin(s / 110.0) + 0.02 * math.sin(s / 41.0)

imu = open("imu.csv", "w")
can = open("can.csv", "w")
ref = open("ref.csv", "w")
imu.write("t,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z\n")
can.write("t,speed_fl [km/h],speed_fr [km/h],speed_rl [km/h],speed_rr [km/h],torque [Nm],gear_ok,steering_wheel_deg\n")
ref.write("t,slope_deg,mass_kg\n")

v, s, dt = 0.0, 0.0, 0.01
for k in range(15000):
    t = k * dt
    slope = slope_at(s)
    wish = 0.0 if t < 8.0 else 13.0 + 6.0 * math.sin(0.19 * t) + 2.0 * math.sin(0.8 * t)
    a = 0.0 if t < 8.0 else max(-2.5, min(2.5, 1.1 * (wish - v)))
    force = (MASS + ROTATING) * a + MASS * G * (math.sin(slope) + RESISTANCE * math.cos(slope)) + 0.5 * DENSITY * DRAG * v * v
    torque = 0.0 if t < 8.0 else force * RADIUS / GAIN
    shifting = t > 8.0 and (t % 9.0) < 0.6
    change = (slope_at(s + v * dt) - slope) / dt
    if k % 2 == 0:
        fx = (a + G * math.sin(slope)) * (1.0 + SCALE) + BIAS + noise(0.08)
        row = (t, fx, noise(0.08), G * math.cos(slope) + noise(0.08), noise(0.003), GYRO - change + noise(0.003), noise(0.003))
        imu.write("%.2f,%.3f,%.3f,%.3f,%.4f,%.4f,%.4f\n" % row)
    if k % 4 == 0:
        wheels = [max(0.0, 3.6 * (v + noise(0.01) * (v > 0))) for _ in range(4)]
        shown = torque * 0.2 if shifting else torque + noise(4.0)
        can.write("%.2f,%.2f,%.2f,%.2f,%.2f,%.1f,%d,%.1f\n" % (t, *wheels, shown, not shifting, 0.0))
    if k % 10 == 0:
        ref.write("%.2f,%.3f,%.0f\n" % (t, math.degrees(slope) + noise(0.02), MASS))
    s += v * dt + 0.5 * a * dt * dt
    v = max(0.0, v + a * dt)
