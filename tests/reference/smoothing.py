"""Adaptive smoothing filter (DFFRLS-AUKF method for monorail cranes, its eq. 7–10, with the gain of the exact first-order lag):

    Y_n = m ψ_n + (1 − m) Y_{n−1},  m = 1 − exp(−2π f dt);  f = 0.5 Hz while |ψ_n − Y_{n−1}| ≤ 2 Γ₀, 2 Hz up to 5 Γ₀, 8 Hz beyond

Γ₀ = 0.1. The first channel chooses the gain of both; the first sample fills the filter.
"""

import math

CORNERS, NOISE, THRESHOLDS = (0.5, 2.0, 8.0), 0.1, (2.0, 5.0)


def record(rng):
    """Rest, a rough ramp (its noise crosses both thresholds often), a jump, with uneven steps of time."""
    rows = []
    for k in range(400):
        level = 0.0 if k < 100 else 0.01 * (k - 100) if k < 250 else 4.0
        first = level + (0.3 if 100 <= k < 250 else 0.1) * rng.standard_normal()
        rows.append([0.005 + 0.01 * rng.random(), first, 2.0 - 0.5 * level + 0.3 * rng.standard_normal()])
    return ["dt", "a", "b"], rows


def oracle(table):
    a, b = table["a"][0], table["b"][0]
    rows, used = [[a, b, 1.0]], set()
    for dt, new_a, new_b in list(zip(table["dt"], table["a"], table["b"]))[1:]:
        away = abs(new_a - a) / NOISE
        corner = CORNERS[0] if away <= THRESHOLDS[0] else CORNERS[1] if away <= THRESHOLDS[1] else CORNERS[2]
        used.add(corner)
        m = -math.expm1(-2.0 * math.pi * corner * dt)
        a, b = m * new_a + (1.0 - m) * a, m * new_b + (1.0 - m) * b
        rows.append([a, b, m])
    assert used == set(CORNERS), f"corners used: {used}"
    return ["a", "b", "gain"], rows
