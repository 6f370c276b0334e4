#!/usr/bin/env python3
"""A stiff wall on a spring, m u'' + k u = F across its thickness: a solid of Tidewall written in Python.

Used by the case beside it, `spring-wall.toml`; needs `pip install iceoryx2==0.10.0`. The contract is on one page,
docs/participant.md; everything about orders and channels is in tidewall_link.py. In 2-D, per metre of depth.
"""

import argparse
import ctypes
import json
import os
import resource
import signal
import struct
import sys
import tomllib
import zlib

ROLE = "solid"
FREQUENCY = 5.0  # of the wall without water, Hz
SAVE, RESTORE, ADVANCE, RECORD = 2, 3, 4, 9
FACES = ("left", "right", "bottom", "top")


class Wall:
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

    def surface(self):
        """Dimension, node count, nodes, areal mass per wet face, facets; protocol/src/interface/encoding.rs."""
        values = [2, 4, *self.nodes, *[self.areal_mass] * 4, 2, len(self.facets)]
        return values + [node for facet in self.facets for node in facet] + self.faces

    def motion(self):
        """Displacement, velocity, acceleration of all nodes."""
        return [value for component in self.state[:3] for _ in range(4) for value in (component, 0.0)]

    def advance(self, dt, force):
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


def check(path, options):
    """The answer to --check: its own mistakes, and the size of its surface."""
    case = load(path, options)
    diagnostics = []
    if "density" not in case["solid"]:
        missing = {"key": "solid.density", "message": "is missing", "allowed": "number > 0 in kg/m3"}
        diagnostics.append({"place": "scene", **missing, "hint": ""})
    figure = {"name": "surface_nodes", "value": 4.0, "remark": "corners of the wall"}
    report = {"program": "spring_wall.py", "protocol_version": 2, "diagnostics": diagnostics, "resolved": {}}
    print(json.dumps({**report, "keys": [], "plan": [figure], "left_out": []}))


def load(path, options):
    with open(path, "rb") as file:
        case = tomllib.load(file)
    for option in options:
        key, value = option.split("=", 1)
        *sections, name = key.split(".")
        try:
            value = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            pass  # a bare word is a text
        table = case
        for section in sections:
            table = table.setdefault(section, {}) if isinstance(table, dict) else {}
        table[name] = value
    return case


def join(arguments):
    """Obeys orders until the run is over; the exit code."""
    import tidewall_link as link

    ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG: never outlive the launcher
    wall = Wall(load(arguments.run, []))
    run = link.Run(ROLE, arguments.prefix, arguments.root, arguments.silence)
    control = run.control()
    control.send(link.REPLY, 0, (0.0, 0.0), link.hello(ROLE, os.getpid()))
    number, step = 0, 0
    try:
        while True:
            number += 1
            name, what = link.Reader(control.receive(link.ORDER, number)).order()
            if name == "start":
                data = start(link, run, wall, arguments, what[0])
                answer = link.ready({"solid_nodes": 4})
            elif name == "step":
                step = what[0]
                parts(link, data, wall, what)
                answer = link.done(("ux_m", wall.state[0]))
            else:
                usage = resource.getrusage(resource.RUSAGE_SELF)
                health = {"spring_wall_displacement_m": wall.state[0]}
                answer = link.account(usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024, health)
            control.send(link.REPLY, number, (0.0, 0.0), answer)
            if name == "stop":
                return 0
    except link.Refused as refusal:
        print(refusal, file=sys.stderr)
        control.send(link.REPLY, number, (0.0, 0.0), link.failed(ROLE, step, refusal.exit_code, str(refusal)))
        return refusal.exit_code


def start(link, run, wall, arguments, planned):
    """Shakes hands with the coupler: contract, surface, motion at the start."""
    with open(arguments.run, "rb") as file:
        scene = zlib.crc32(file.read())
    end = float(load(arguments.run, [])["time"]["end"])
    data = run.connect("coupler", len(wall.surface()))
    mine = struct.pack("<4d", 2, 4, end, scene)
    data.send(link.CONTRACT, 0, (0.0, 0.0), mine)
    theirs = data.receive(link.CONTRACT, 0, 4)
    if theirs != mine or planned != 4:
        expected, found = struct.unpack("<4d", mine), struct.unpack("<4d", theirs)
        raise link.Refused(f"interface of coupler: expected {expected}, found {found}", 2)
    send(link, data, link.SURFACE, 0, (0.0, 0.0), wall.surface())
    send(link, data, link.MOTION, 0, (0.0, 0.0), wall.motion())
    return data


def send(link, data, kind, step, at, values):
    data.send(kind, step, at, struct.pack(f"<{len(values)}d", *values))


def parts(link, data, wall, what):
    step, at, todo = what
    for part in todo:
        if part == SAVE:
            wall.saved = wall.state
        elif part == RESTORE:
            wall.state = wall.saved
        elif part == ADVANCE:
            # Which load acts (0: nodal forces), 4 nodal forces, tractions at 6 markers.
            count = 1 + 2 * 4 + 2 * 6
            load = struct.unpack(f"<{count}d", data.receive(link.LOAD, step, count))
            wall.advance(at[1], sum(load[1:9:2]))
            send(link, data, link.MOTION, step, at, wall.motion())


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", metavar="CASE")
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--run", metavar="CASE")
    parser.add_argument("--folder")
    parser.add_argument("--prefix")
    parser.add_argument("--root")
    parser.add_argument("--silence", type=float, default=60.0)
    parser.add_argument("--threads", type=int, default=1)
    arguments = parser.parse_args()
    if arguments.check:
        return check(arguments.check, arguments.set)
    return join(arguments)


if __name__ == "__main__":
    sys.exit(main())
