#!/usr/bin/env python3
"""Write the meshes beside this script: outlines in the x-z or y-z plane, extruded. Run it after a change; needs nothing.

    python3 make_meshes.py
"""
from pathlib import Path


def extrude(outline, half, axis):
    """Triangles of a convex outline (counter-clockwise seen from +axis) swept from -half to +half along `axis`."""
    place = {"y": lambda p, w: (p[0], w, p[1]), "x": lambda p, w: (w, p[0], p[1])}[axis]
    near, far = ([place(p, w) for p in outline] for w in (-half, half))
    n = len(outline)
    triangles = []
    for i in range(1, n - 1):
        triangles += [(far[0], far[i], far[i + 1]), (near[0], near[i + 1], near[i])]
    for i in range(n):
        j = (i + 1) % n
        triangles += [(near[i], near[j], far[j]), (near[i], far[j], far[i])]
    return triangles


def volume(triangles):
    def det(a, b, c):
        return (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]))
    return sum(det(*t) for t in triangles) / 6


def write(name, triangles):
    assert volume(triangles) > 0, f"{name}: triangles face inwards"
    lines = [f"solid {name}"]
    for t in triangles:
        lines += [" facet normal 0 0 0", "  outer loop"] + ["   vertex %g %g %g" % v for v in t] + ["  endloop", " endfacet"]
    lines += [f"endsolid {name}", ""]
    (Path(__file__).parent / f"{name}.stl").write_text("\n".join(lines))


# Cab: side view in x-z, clockwise seen from -y = counter-clockwise seen from +y. A sloped windscreen at the front (+x).
cab = [(-1.1, -1.16), (-1.1, -0.12), (0.65, -0.12), (1.1, -0.62), (1.1, -1.06), (1.0, -1.16)]
write("cab_shell", extrude(cab, 0.5, "y"))

# Clamp arm of the left wheel: front view in y-z, from the pivot (origin) up and out round the wheel to its axle.
pieces = [
    [(-0.03, -0.04), (0.05, -0.04), (0.06, 0.10), (-0.02, 0.10)],
    [(-0.02, 0.07), (0.06, 0.07), (0.06, 0.13), (-0.02, 0.13)],
]
write("clamp_arm", [t for p in pieces for t in extrude(p, 0.09, "x")])
