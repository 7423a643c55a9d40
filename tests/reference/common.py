"""What the oracles share: CSV with all 17 digits, comparison, and the crane model of the state filters."""

from pathlib import Path

import numpy as np

DATA = Path(__file__).parent / "data"
GRAVITY = 9.81


def write(path, header, rows):
    """Rows of numbers with as many digits as a double has."""
    lines = [",".join(header)] + [",".join(f"{float(value):.17g}" for value in row) for row in rows]
    path.parent.mkdir(exist_ok=True)
    path.write_text("\n".join(lines) + "\n")


def read(path):
    """A table as {column name: array}."""
    header = path.read_text().split("\n", 1)[0].split(",")
    values = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    return {name: values[:, column] for column, name in enumerate(header)}


def agree(what, ours, other, relative=1e-9):
    """Stops unless two forms of one result agree, relative to the largest number of the array."""
    ours, other = np.asarray(ours, float), np.asarray(other, float)
    scale = np.max(np.abs(ours))
    worst = np.max(np.abs(ours - other)) / scale
    if not worst <= relative:
        raise SystemExit(f"{what}: two oracles disagree by {worst:.3g} of {scale:.3g}, allowed {relative:g}")


def upper(matrix):
    """The upper triangle of a symmetric matrix, row by row."""
    return np.asarray(matrix)[np.triu_indices(len(matrix))]


def upper_names(name, n):
    return [f"{name}{i + 1}{j + 1}" for i in range(n) for j in range(i, n)]


def names(name, n):
    return [f"{name}{i + 1}" for i in range(n)]


class Crane:
    """State [v in m/s, theta in rad, w = 10 t / M]; u = tractive force / 10 t.

    Force balance of a vehicle on a slope (Liu et al. 2023, eq. 1–7, without rotating masses):
        dv/dt = u w − g sin(theta) − mu g cos(theta),  theta and w constant.
    Seen: the speed, and the specific force along the rail, dv/dt + g sin(theta) = u w − mu g cos(theta).
    """

    DT = 0.02
    MU = 0.03
    X0 = np.array([0.1, 0.02, 1.0])
    SD0 = np.array([0.2, 0.1, 0.3])
    Q = np.array([[2e-5, 1e-6, 0.0], [1e-6, 4e-5, 0.0], [0.0, 0.0, 1e-7]])
    R = np.array([[4e-4, 1e-4], [1e-4, 2.5e-3]])

    @classmethod
    def f(cls, x, u):
        v, theta, w = x
        acceleration = u * w - GRAVITY * np.sin(theta) - cls.MU * GRAVITY * np.cos(theta)
        return np.array([v + cls.DT * acceleration, theta, w])

    @classmethod
    def h(cls, x, u):
        v, theta, w = x
        return np.array([v, u * w - cls.MU * GRAVITY * np.cos(theta)])

    @classmethod
    def record(cls, rng, steps):
        """Force and measurements of a speed-controlled run over a wavy track, the load changing half-way."""
        x = np.array([0.0, 0.0, 0.8])
        spread = np.linalg.cholesky(cls.R)
        rows = []
        for k in range(steps):
            x[1] = 0.25 * np.sin(0.03 * k) + 0.05 * np.sin(0.11 * k)
            x[2] = 0.8 if k < steps // 2 else 1.1
            hold = GRAVITY * np.sin(x[1]) + cls.MU * GRAVITY * np.cos(x[1])
            u = (hold + 2.0 * (1.0 - x[0])) / 0.9 + 0.3 * np.sin(0.2 * k)
            x = cls.f(x, u)
            rows.append([u, *(cls.h(x, u) + spread @ rng.standard_normal(2))])
        return ["u", "z1", "z2"], rows


def jacobian(f, x):
    """∂f/∂x by the complex step (Squire & Trapp 1998): exact to rounding, and nobody's derivation."""
    columns = []
    for i in range(len(x)):
        moved = np.array(x, complex)
        moved[i] += 1e-30j
        columns.append(np.asarray(f(moved)).imag / 1e-30)
    return np.array(columns).T
