"""Rail curve of a track file, read on its own: heading and grade along the chainage from the lists of elements, position by Gauss-Legendre
quadrature on a grid of 1 mm, frames from the nearest grid point to second order."""

import math

import numpy as np
import yaml


def curvatures(elements, horizontal):
    """Start angle, and pieces (length, curvature at the start, curvature at the end)."""
    start, angle, bend, pieces = 0.0, 0.0, 0.0, []

    def piece(length, k0, k1):
        nonlocal angle, bend
        if length > 1e-12:
            pieces.append((length, k0, k1))
            angle += 0.5 * (k0 + k1) * length
        bend = k1

    for i, e in enumerate(elements):
        kind = e["kind"]
        if kind in ("line", "grade"):
            if i == 0:
                start = angle = math.radians(e.get("grade_deg", 0.0))
            piece(e["length_m"], 0.0, 0.0)
        elif kind == "clothoid":
            piece(e["length_m"], bend, 1.0 / e["to_radius_m"] if "to_radius_m" in e else 0.0)
        elif kind == "arc":
            turn = math.radians(e["angle_deg"]) if horizontal else math.radians(e["to_grade_deg"]) - angle
            easement = e.get("easement_m", 0.0)
            k = math.copysign(1.0 / e["radius_m"], turn)
            if easement > 0.0:
                piece(easement, 0.0, k)
            piece(e["radius_m"] * abs(turn) - easement, k, k)
            if easement > 0.0:
                piece(easement, k, 0.0)  # else a clothoid behind it begins with the curvature of the arc
        else:
            raise ValueError(f"element {kind}: not read here")
    return start, pieces


class Rail:
    """Curve of the rail's line, from s = -5 m to 30 m beyond its end, straight outside of the track."""

    STEP = 1e-3
    BEFORE = 5.0

    def __init__(self, path):
        track = yaml.safe_load(path.read_text())
        self.tables = [self._table(track.get(k) or [], k == "horizontal") for k in ("horizontal", "vertical")]
        length = max(t[2] for t in self.tables)
        s = np.arange(round((length + 30.0 + self.BEFORE) / self.STEP) + 1) * self.STEP - self.BEFORE
        nodes, weights = np.polynomial.legendre.leggauss(4)
        steps = sum(
            0.5 * self.STEP * w * self._tangent(s[:-1] + 0.5 * self.STEP * (1.0 + x))
            for x, w in zip(nodes, weights)
        )
        p = np.vstack([np.zeros(3), np.cumsum(steps, 0)])
        p -= p[round(self.BEFORE / self.STEP)]
        heading, bend = self._angle(0, s)
        grade, crest = self._angle(1, s)
        t = self._tangent(s)
        left = np.c_[-np.sin(heading), np.cos(heading), 0.0 * s]
        k = (bend * np.cos(grade))[:, None] * left + crest[:, None] * np.cross(t, left)
        self.grid = np.hstack([p, t, k])

    @staticmethod
    def _table(elements, horizontal):
        angle, pieces = curvatures(elements, horizontal)
        rows, s = [(-1e9, 0.0, angle, 0.0, 0.0)], 0.0
        for length, k0, k1 in pieces:
            rows.append((s, s, angle, k0, (k1 - k0) / (2.0 * length)))
            angle += 0.5 * (k0 + k1) * length
            s += length
        rows.append((s, s, angle, 0.0, 0.0))
        rows = np.array(rows)
        return rows[:, 0], rows[:, 1:], s

    def _angle(self, which, s):
        """Angle and its derivative."""
        breaks, rows, _ = self.tables[which]
        s0, angle, k, half = rows[np.searchsorted(breaks, s, "right") - 1].T
        x = s - s0
        return angle + x * (k + x * half), k + 2.0 * x * half

    def _tangent(self, s):
        heading, grade = self._angle(0, s)[0], self._angle(1, s)[0]
        return np.stack([np.cos(grade) * np.cos(heading), np.cos(grade) * np.sin(heading), np.sin(grade)], -1)

    def at(self, s):
        """Position, tangent, left, up, curvature vector at chainages."""
        i = np.rint((s + self.BEFORE) / self.STEP).astype(np.int64)
        row = self.grid[i]
        x = (s + self.BEFORE - i * self.STEP)[:, None]
        p, t, k = row[:, :3], row[:, 3:6], row[:, 6:]
        p = p + (t + 0.5 * x * k) * x
        t = t + k * x
        level = 1.0 / np.sqrt(t[:, 0] ** 2 + t[:, 1] ** 2)
        left = np.stack([-t[:, 1] * level, t[:, 0] * level, 0.0 * level], -1)
        return p, t, left, np.cross(t, left), k

    def project(self, points, s):
        """Chainages in whose cross-sections the points lie, by one Newton step from where they were."""
        p, t, _, _, k = self.at(s)
        d = points - p
        return s + np.einsum("ij,ij->i", d, t) / (1.0 - np.einsum("ij,ij->i", d, k))
