"""Units of a train: URDF links with their places and masses, and the consist as bodies, joints and wheels. Own readers of URDF and YAML."""

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field

import numpy as np
import yaml


def vector(text):
    return np.array([float(x) for x in text.split()])


def rotation(rpy):
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array([
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ])


def origin(element):
    o = element.find("origin")
    if o is None:
        return np.zeros(3), np.eye(3)
    return vector(o.get("xyz", "0 0 0")), rotation(vector(o.get("rpy", "0 0 0")))


class Urdf:
    """Places of all links in the frame of the root link (joints at zero), and the masses on them."""

    def __init__(self, path):
        root = ET.parse(path).getroot()
        self.links = {e.get("name"): e for e in root.findall("link")}
        self.parents = {j.find("child").get("link"): (j.find("parent").get("link"), *origin(j)) for j in root.findall("joint")}

    def place(self, link):
        if link not in self.parents:
            return np.zeros(3), np.eye(3)
        parent, x, r = self.parents[link]
        px, pr = self.place(parent)
        return px + pr @ x, pr @ r

    def at(self, link):
        return self.place(link)[0]

    def masses(self):
        """Link, mass, centre and inertia tensor about it, in the root's axes."""
        for name, link in self.links.items():
            inertial = link.find("inertial")
            if inertial is None:
                continue
            (x, r), (c, q) = self.place(name), origin(inertial)
            g = {k: float(v) for k, v in inertial.find("inertia").attrib.items()}
            j = np.array([[g["ixx"], g["ixy"], g["ixz"]], [g["ixy"], g["iyy"], g["iyz"]], [g["ixz"], g["iyz"], g["izz"]]])
            yield name, float(inertial.find("mass").get("value")), x + r @ c, (r @ q) @ j @ (r @ q).T


@dataclass
class Body:
    name: str
    urdf: Urdf
    sheet: dict
    kind: str  # drive, trolley, suspended, load
    s: float  # chainage of its origin behind the train's front, below 0
    z: float  # height of its origin above the rail's line
    reversed: bool = False

    def start(self, point):
        """A point of the body as it starts, along, left and up of the train's front."""
        sign = -1.0 if self.reversed else 1.0
        return np.array([self.s + sign * point[0], sign * point[1], self.z + point[2]])


@dataclass
class Joint:
    a: int
    at_a: np.ndarray
    b: int
    at_b: np.ndarray
    stiffness: float
    damping: float


@dataclass
class Consist:
    """Bodies of the whole train front to rear, the load last."""

    resistance: dict
    bodies: list = field(default_factory=list)
    drawbars: list = field(default_factory=list)
    hangers: list = field(default_factory=list)
    chains: list = field(default_factory=list)
    above_load: int = 0


def read(path):
    train = yaml.safe_load(path.read_text())
    all_ = Consist(train["resistance"])
    length, ends, index = 0.0, [], {}

    def unit(file):
        sheet = yaml.safe_load(file.read_text())
        return sheet, Urdf(file.parent / sheet["urdf"])

    for entry in train["consist"]:
        file = (path.parent / entry["unit"]).resolve()
        sheet, urdf = unit(file)
        middle, turned = -(length + 0.5 * sheet["length_m"]), bool(entry.get("reversed"))
        length += sheet["length_m"]
        index[entry["name"]] = len(all_.bodies)
        if "carried_by" not in sheet:
            all_.bodies.append(Body(entry["name"], urdf, sheet, "drive", middle, 0.0, turned))
            body = len(all_.bodies) - 1
            ends.append([(body, urdf.at("coupling_front")), (body, urdf.at("coupling_rear"))])
            continue
        carried = sheet["carried_by"]
        trolley_sheet, trolley = unit(file.parent / carried["trolley"])
        top, hooks = trolley.at("hanger"), [urdf.at(link) for link in carried["links"]]
        hung = len(all_.bodies)
        all_.bodies.append(Body(entry["name"], urdf, sheet, "suspended", middle, top[2] - hooks[0][2], turned))
        sign = -1.0 if turned else 1.0
        trolleys = []
        for hook in sorted(hooks, key=lambda h: -sign * h[0]):
            trolleys.append(len(all_.bodies))
            all_.bodies.append(Body(f"{entry['name']}/trolley", trolley, trolley_sheet, "trolley", middle + sign * hook[0] - top[0], 0.0))
            all_.hangers.append(Joint(trolleys[-1], top, hung, hook, carried["stiffness_npm"], carried["damping_nspm"]))
        ends.append([(trolleys[0], trolley.at("coupling_front")), (trolleys[-1], trolley.at("coupling_rear"))])
    bar = train["drawbar"]
    for (_, rear), (front, _) in zip(ends, ends[1:]):
        all_.drawbars.append(Joint(*rear, *front, bar["stiffness_npm"], bar["damping_nspm"]))

    sheet, urdf = unit((path.parent / train["load"]["unit"]).resolve())
    load, all_.above_load = sheet["load"], index[train["load"]["under"]]
    above = all_.bodies[all_.above_load]
    hook = load["chain_links"][0]
    z = above.z + above.urdf.at(hook)[2] - load["drop_m"] - urdf.at(hook)[2]
    all_.bodies.append(Body("load", urdf, sheet, "load", above.s + load.get("offset_m", 0.0), z))
    for link in load["chain_links"]:
        all_.chains.append(Joint(all_.above_load, above.urdf.at(link), len(all_.bodies) - 1, urdf.at(link), load["stiffness_npm"], load["damping_nspm"]))
    return all_


def body_masses(body, load_kg):
    """Masses of a body; a payload of another mass has the same shape."""
    payload = body.sheet["load"]["payload_link"] if body.kind == "load" else None
    for name, mass, c, j in body.urdf.masses():
        if name == payload:
            mass, j = load_kg, j * (load_kg / mass)
        if mass > 0.0:
            yield mass, c, j


def piston_area(clamp):
    return 0.25 * math.pi * clamp["piston_diameter_m"] ** 2
