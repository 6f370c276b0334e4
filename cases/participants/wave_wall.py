#!/usr/bin/env python3
"""Waves that a wall throws back, by linear theory (Airy): a fluid of Tidewall without a mesh, written in Python.

It offers points on the wet face of the wall, each with a position and an area, and answers every step with the pressure
of the fully reflected wave at their present places,

    p = max(0, -rho g y + rho g H cosh k(d + y) / cosh(k d) cos(w t)),    w^2 = g k tanh(k d),

y from the still level, d the depth, H the height of the crest at the wall (that of the incoming wave from trough to crest):
Dean & Dalrymple 1991, section 4.4. The motion of the wall does not change the wave. Used by the case beside it,
`wave-wall.toml`; needs `pip install iceoryx2==0.10.0`. In 2-D, per metre of depth.
"""

import math
import sys

import tidewall_program
from tidewall_program import LOAD, MOTION, POINT_WALL, POINTS

ROLE, NAME = "fluid", "wave_wall"
KEYS = {"program", "density", "spacing", "region", "wave_height", "wave_period"}
ROBIN, PRESCRIBED = 0, 2


def is_positive(value):
    return isinstance(value, (int, float)) and math.isfinite(value) and value > 0


def weight(case):
    """Of water per mass, downwards, m/s2; nothing where there is none."""
    acceleration = case.get("gravity", {}).get("acceleration")
    return -acceleration[1] if isinstance(acceleration, list) and acceleration[1:] else None


def is_box(section):
    corners = [section.get("min"), section.get("max")]
    return all(isinstance(corner, list) and len(corner) == 2 for corner in corners)


def mistakes(case):
    fluid, solid = case.get("fluid", {}), case.get("solid", {})
    for key in sorted(fluid.keys() - KEYS):
        yield f"fluid.{key}", "unknown key", ", ".join(sorted(KEYS))
    if case.get("case", {}).get("dimension") != 2:
        yield "case.dimension", "wave_wall.py is for plane scenes", "2"
    if case.get("coupling", {}).get("fluid_side") != "points":
        yield "coupling.fluid_side", "wave_wall.py has no use for a dummy mesh", '"points"'
    if not is_positive(weight(case)):
        yield "gravity.acceleration", "the water needs its weight", "[0.0, -9.81]"
    if not is_positive(fluid.get("density", 1000.0)):
        yield "fluid.density", "is not allowed", "number > 0 in kg/m3"
    if not is_positive(fluid.get("spacing")):
        yield "fluid.spacing", "is missing or not allowed: the distance of the points", "number > 0 in m"
    height = fluid.get("wave_height", 0.0)
    if height != 0 and not is_positive(height):
        yield "fluid.wave_height", "is not allowed: the crest above the still level at the wall", "number >= 0 in m"
    if height != 0 and not is_positive(fluid.get("wave_period")):
        yield "fluid.wave_period", "is missing or not allowed", "number > 0 in s"
    regions = fluid.get("region", [])
    if len(regions) != 1 or not is_box(regions[0]):
        yield "fluid.region", "the still water is one box", "one [[fluid.region]] with min and max"
    elif not is_box(solid):
        yield "solid.min", "the wall is a box", "min and max"
    elif not solid["min"][1] < regions[0]["max"][1] <= solid["max"][1]:
        yield "fluid.region", "the still level is not within the height of the wall", "a level on the wall"
    elif is_positive(height) and height >= regions[0]["max"][1] - regions[0]["min"][1]:
        yield "fluid.wave_height", "is not below the depth of the water", "number < depth in m"


def resolved(case):
    fluid = case["fluid"]
    own = {"spacing": fluid["spacing"], "wave_height": fluid.get("wave_height", 0.0)}
    return {"fluid": own | {key: fluid[key] for key in ("wave_period",) if key in fluid}}


def plan(case):
    return "interface_points", float(len(points(case))), "points on the wet face of the wall"


def points(case):
    """(x, y, area) from the foot of the wall to its crest, at the middle of pieces that end at the still level."""
    fluid, solid, water = case["fluid"], case["solid"], case["fluid"]["region"][0]
    is_left = water["min"][0] + water["max"][0] < solid["min"][0] + solid["max"][0]
    x = solid["min" if is_left else "max"][0]
    foot, level, crest = max(solid["min"][1], water["min"][1]), water["max"][1], solid["max"][1]
    found = []
    for low, high in ((foot, level), (level, crest)):
        number = math.ceil((high - low) / fluid["spacing"] - 1e-9)
        area = (high - low) / max(number, 1)
        found += [(x, low + (index + 0.5) * area, area) for index in range(number)]
    return found


def wave_number(omega, gravity, depth):
    """k of w^2 = g k tanh(k d), by Newton from the longer of shallow and deep water."""
    k = max(omega / math.sqrt(gravity * depth), omega**2 / gravity)
    for _ in range(50):
        wet = math.tanh(k * depth)
        k -= (gravity * k * wet - omega**2) / (gravity * (wet + k * depth * (1 - wet**2)))
    return k


class Participant:
    """The pressure of the wave at the points of the wall."""

    def __init__(self, case):
        fluid, water = case["fluid"], case["fluid"]["region"][0]
        self.weight = fluid.get("density", 1000.0) * weight(case)
        self.level = water["max"][1]
        self.depth = self.level - water["min"][1]
        self.height, self.omega, self.k = fluid.get("wave_height", 0.0), 0.0, 0.0
        if self.height > 0:
            self.omega = 2 * math.pi / fluid["wave_period"]
            self.k = wave_number(self.omega, weight(case), self.depth)
        found = points(case)
        self.positions = [place for x, y, _ in found for place in (x, y)]
        self.areas = [area for _, _, area in found]
        self.response, self.force = ROBIN, 0.0
        self.count, self.capacity = len(found), 2 + 3 * len(found)
        self.counts = {"interface_points": len(found)}

    def pressure(self, y, time):
        """At the height y above the still level, Pa."""
        shape = math.cosh(self.k * (self.depth + y)) / math.cosh(self.k * self.depth)
        return max(0.0, self.weight * (self.height * shape * math.cos(self.omega * time) - y))

    def shake_hands(self, data):
        data.send_numbers(POINTS, 0, (0.0, 0.0), [2, self.count, *self.positions, *self.areas])
        # How the wall responds, number of points, m_r at each: the wave does not ask for it.
        self.response = data.receive_numbers(POINT_WALL, 0, 2 + self.count)[0]

    def save(self):
        """The wave depends on the time alone: there is no state to keep."""

    def restore(self):
        """As there is none to go back to."""

    def advance(self, data, step, at):
        flag, block = int(self.response == ROBIN), 2 * self.count
        blocks = 4 if self.response == PRESCRIBED else 3
        motion = data.receive_numbers(MOTION, step, flag + blocks * block)
        position, velocity = (motion[flag + part * block :][:block] for part in (0, 1))
        normals = motion[-block:]
        time, dt = at
        pressures, forces = [], []
        for point, area in enumerate(self.areas):
            y = position[2 * point + 1] + dt * velocity[2 * point + 1] - self.level
            pressures.append(self.pressure(y, time))
            forces += [-pressures[-1] * area * component for component in normals[2 * point :][:2]]
        self.force = sum(forces[::2])
        data.send_numbers(LOAD, step, at, pressures + forces)

    def shown(self):
        return "force_x_n", self.force


if __name__ == "__main__":
    sys.exit(tidewall_program.main(sys.modules[__name__]))
