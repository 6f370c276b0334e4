"""A participant of Tidewall written in Python, as a program: its command line, its case, its orders.

A participant has a role, a name, and these:

    mistakes(case)           what is wrong with its sections: (key, message, allowed) each
    resolved(case)           its own keys by section, defaults filled in: a run knows no others
    plan(case)               (figure, value, remark): the size of its side of the interface; of a case without mistakes
    Participant(case)        count: that size; capacity: values of its largest message; counts: for run.json
      .shake_hands(data)     what follows the contract on the link to the coupler
      .save() .restore()     keeps its state, goes back to it
      .advance(data, step, (time, dt))
      .shown()               (name, value) for the progress line
"""

import argparse
import ctypes
import json
import os
import resource
import signal
import sys
import tomllib
import zlib

VERSION = 2  # of the protocol
ORDER, REPLY, CONTRACT, SURFACE, BODY_MESH, MOTION, LOAD, FIN, POINTS, POINT_WALL = range(1, 11)  # kinds of messages
SAVE, RESTORE, ADVANCE = 2, 3, 4  # parts of a step


def load(path, options):
    """The case with the `KEY=VALUE` options laid over it."""
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


def check(module, path, options):
    """The answer to --check."""
    case = load(path, options)
    words = [dict(zip(("key", "message", "allowed"), mistake)) for mistake in module.mistakes(case)]
    plan = [] if words else [dict(zip(("name", "value", "remark"), module.plan(case)))]
    resolved = {} if words else module.resolved(case)
    diagnostics = [{"place": "scene", **mistake, "hint": ""} for mistake in words]
    report = {"program": module.NAME, "protocol_version": VERSION, "diagnostics": diagnostics}
    print(json.dumps({**report, "resolved": resolved, "keys": [], "plan": plan, "left_out": []}))
    return 0


def join(module, arguments):
    """Obeys orders until the run is over; the exit code."""
    import tidewall_link as link

    ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG: never outlive the launcher
    case = load(arguments.run, [])
    participant = module.Participant(case)
    run = link.Run(module.ROLE, arguments.prefix, arguments.root, arguments.silence)
    control = run.control()
    control.send(REPLY, 0, (0.0, 0.0), link.hello(module.ROLE, os.getpid()))
    number, step = 0, 0
    try:
        while True:
            number += 1
            name, what = link.Reader(control.receive(ORDER, number)).order()
            if name == "start":
                planned = what[0 if module.ROLE == "solid" else 1]
                data = shake_hands(link, run, participant, (case, arguments.run, planned))
                answer = link.ready(participant.counts)
            elif name == "step":
                step = what[0]
                parts(data, participant, what)
                answer = link.done(participant.shown())
            else:
                usage = resource.getrusage(resource.RUSAGE_SELF)
                shown, value = participant.shown()
                health = {f"{module.NAME}_{shown}": value}
                answer = link.account(usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024, health)
            control.send(REPLY, number, (0.0, 0.0), answer)
            if name == "stop":
                return 0
    except link.Refused as refusal:
        print(refusal, file=sys.stderr)
        reply = link.failed(module.ROLE, step, refusal.exit_code, str(refusal))
        control.send(REPLY, number, (0.0, 0.0), reply)
        return refusal.exit_code


def shake_hands(link, run, participant, scene):
    """Agrees on the contract with the coupler; the rest is the participant's."""
    case, path, planned = scene
    with open(path, "rb") as file:
        checksum = zlib.crc32(file.read())
    data = run.connect("coupler", participant.capacity)
    mine = (case["case"]["dimension"], participant.count, float(case["time"]["end"]), checksum)
    data.send_numbers(CONTRACT, 0, (0.0, 0.0), mine)
    theirs = data.receive_numbers(CONTRACT, 0, 4)
    if theirs != mine or planned != participant.count:
        raise link.Refused(f"interface of coupler: expected {mine}, found {theirs}", 2)
    participant.shake_hands(data)
    return data


def parts(data, participant, what):
    step, at, todo = what
    for part in todo:
        if part == SAVE:
            participant.save()
        elif part == RESTORE:
            participant.restore()
        elif part == ADVANCE:
            participant.advance(data, step, at)


def main(module):
    parser = argparse.ArgumentParser(description=module.__doc__)
    parser.add_argument("--check", metavar="CASE")
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--run", metavar="CASE")
    parser.add_argument("--folder")
    parser.add_argument("--prefix")
    parser.add_argument("--root")
    parser.add_argument("--silence", type=float, default=60.0)
    parser.add_argument("--threads", type=int, default=1)
    arguments = parser.parse_args()
    return check(module, arguments.check, arguments.set) if arguments.check else join(module, arguments)
