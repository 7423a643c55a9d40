"""Overlapping Allan deviation by allantools (Wallin, Price, Carson, Meynadier; NIST SP 1065, equation 11): white noise with a random walk.

Averaging times of 1 … 178 samples of 10 ms, those at which eight points per decade fall on whole samples.
"""

import allantools
import numpy as np

PERIOD = 0.01
M = [1, 2, 3, 4, 6, 7, 10, 13, 18, 24, 32, 42, 56, 75, 100, 133, 178]


def record(rng):
    """Eight hundred samples: white noise, and a bias that wanders."""
    white = rng.standard_normal(800)
    walk = np.cumsum(0.1 * rng.standard_normal(800))
    return ["white", "both"], np.column_stack([white, 3.0 + white + walk])


def oracle(table):
    columns = []
    for name in ("white", "both"):
        taus, deviation, _, _ = allantools.oadev(
            table[name], rate=1 / PERIOD, data_type="freq", taus=[m * PERIOD for m in M]
        )
        assert np.allclose(taus, [m * PERIOD for m in M])
        columns.append(deviation)
    return ["tau", "white", "both"], np.column_stack([[m * PERIOD for m in M], *columns])
