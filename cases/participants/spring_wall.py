#!/usr/bin/env python3
"""A stiff wall on a spring, m u'' + k u = F across its thickness: a solid of Tidewall written in Python.

Used by the case beside it, `spring-wall.toml`; needs `pip install iceoryx2==0.10.0`. The contract is on one page,
docs/participant.md; everything about orders is in tidewall_program.py, about channels in tidewall_link.py. In 2-D, per
metre of depth.
"""

import sys

import tidewall_program
from tidewall_program import LOAD, MOTION, SURFACE

ROLE, NAME = "solid", "spring_wall"
FREQUENCY = 5.0  # of the wall without water, Hz
FACES = ("left", "right", "bottom", "top")


def mistakes(case):
    if "density" not in case["solid"]:
        yield "solid.density", "is missing", "number > 0 in kg/m3"


def resolved(_case):
    return {}  # the keys of [solid] it needs are those all programs read


def plan(_case):
    return "surface_nodes", 4.0, "corners of the wall"


class Participant:
    """The box of [solid] with four nodes at its corners, moving along x."""

    def __init__(self, case):
        solid = case["solid"]
        (x0, y0), (x1, y1) = solid["min"], solid["max"]
        self.nodes = [x0, y0, x1, y0, x0, y1, x1, y1]
        # The outward normal is on the right of a -> b.
        self.facets = [(2, 0), (1, 3), (3, 2)]
        self.faces = [FACES.index("left"), FACES.index("right"), FACES.index("top")]
        self.areal_mass = solid["density"] * (x1 - x0) / 2
        self.mass = solid["density"] * (x1 - x0) * (y1 - y0)
        self.stiffness = self.mass * (2 * 3.141592653589793 * FREQUENCY) ** 2
        self.state = (0.0, 0.0, 0.0, 0.0)
        self.saved = self.state
        self.count, self.capacity = 4, max(len(self.surface()), len(self.motion()))
        self.counts = {"solid_nodes": 4}

    def surface(self):
        """Dimension, node count, nodes, areal mass per wet face, facets; protocol/src/interface/encoding.rs."""
        values = [2, 4, *self.nodes, *[self.areal_mass] * 4, 2, len(self.facets)]
        return values + [node for facet in self.facets for node in facet] + self.faces

    def motion(self):
        """Displacement, velocity, acceleration of all nodes."""
        return [value for component in self.state[:3] for _ in range(4) for value in (component, 0.0)]

    def shake_hands(self, data):
        data.send_numbers(SURFACE, 0, (0.0, 0.0), self.surface())
        data.send_numbers(MOTION, 0, (0.0, 0.0), self.motion())

    def save(self):
        self.saved = self.state

    def restore(self):
        self.state = self.saved

    def advance(self, data, step, at):
        # Which load acts (0: nodal forces), 4 nodal forces, tractions at 6 markers.
        load = data.receive_numbers(LOAD, step, 1 + 2 * 4 + 2 * 6)
        self.move(at[1], sum(load[1:9:2]))
        data.send_numbers(MOTION, step, at, self.motion())

    def move(self, dt, force):
        """Generalised-alpha (Chung & Hulbert 1993), rho_inf = 0.5, load blended."""
        am, af = 0.0, 1.0 / 3.0
        gamma = 0.5 - am + af
        beta = 0.25 * (1.0 - am + af) ** 2
        u, v, a, before = self.state
        free = u + dt * v + dt * dt * (0.5 - beta) * a
        known = (1 - af) * force + af * before - self.mass * am * a
        known -= self.stiffness * ((1 - af) * free + af * u)
        new = known / (self.mass * (1 - am) + self.stiffness * (1 - af) * beta * dt * dt)
        self.state = (free + beta * dt * dt * new, v + dt * ((1 - gamma) * a + gamma * new), new, force)

    def shown(self):
        return "displacement_m", self.state[0]


if __name__ == "__main__":
    sys.exit(tidewall_program.main(sys.modules[__name__]))
