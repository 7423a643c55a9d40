"""Matched low-pass: two first-order sections, s ← s + (1 − e^(−dt/τ))(u − s), τ = 1/(2π f), f = 1 Hz, and the rate of the second.

Written as z-transforms: with a = e^(−dt/τ), output = ((1 − a)/(1 − a z⁻¹))² input (scipy.signal.lfilter), and the rate is the same
filter applied to the difference quotient of the input. That needs even steps (rows 0–249, 100 Hz); the uneven rest goes section by
section from there.
"""

import math

import numpy as np
from common import agree
from scipy.signal import lfilter

TAU = 1.0 / (2.0 * math.pi)
EVEN = 250


def record(rng):
    rows = []
    for k in range(400):
        dt = 0.01 if k < EVEN else 0.002 + 0.03 * rng.random()
        rows.append([dt, 3.0 + math.sin(0.04 * k) + 0.2 * rng.standard_normal()])
    return ["dt", "u"], rows


def twice(a, u):
    """Two sections, the filter at rest at 0."""
    return lfilter([1.0 - a], [1.0, -a], lfilter([1.0 - a], [1.0, -a], u))


def sections(dts, us):
    first = second = us[0]
    values, rates = [second], [0.0]
    for dt, u in zip(dts[1:], us[1:]):
        share = -math.expm1(-dt / TAU)
        first = first * (1.0 - share) + share * u
        before, second = second, second * (1.0 - share) + share * first
        values.append(second)
        rates.append((second - before) / dt)
    return np.array(values), np.array(rates)


def oracle(table):
    dt, u = table["dt"], table["u"]
    value, rate = sections(dt, u)
    a = math.exp(-dt[0] / TAU)
    even_value = u[0] + twice(a, u[:EVEN] - u[0])
    even_rate = twice(a, np.diff(u[:EVEN], prepend=u[0]) / dt[0])
    agree("matched filter, value", value[:EVEN], even_value)
    agree("matched filter, rate", rate[:EVEN], even_rate)
    value[:EVEN], rate[:EVEN] = even_value, even_rate
    return ["value", "rate"], list(zip(value, rate))
