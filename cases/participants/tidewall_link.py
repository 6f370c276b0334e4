"""The participant's side of Tidewall's contract (docs/participant.md) over the PyPI package iceoryx2 0.10.0.

`Run` joins a run: `control` carries the launcher's orders and the replies, `connect` opens a data link to a peer.
"""

import ctypes
import math
import struct
import time
import zlib

import iceoryx2 as iox2

from tidewall_program import VERSION

MAGIC = int.from_bytes(b"TIDEWALL", "big")
DATA, ABORT, ATTACHED = (iox2.EventId.new(number) for number in (1, 2, 3))
SLICE = iox2.Duration.from_millis(100)
CONTROL_BYTES = 64 * 1024
POOL = 2


class Refused(Exception):
    """Something does not fit; `exit_code` as in the table of failures."""

    def __init__(self, what, exit_code):
        super().__init__(what)
        self.exit_code = exit_code


class Header(ctypes.Structure):
    """What stands before every payload; protocol/src/header.rs."""

    _fields_ = [
        ("magic", ctypes.c_uint64),
        ("version", ctypes.c_uint32),
        ("kind", ctypes.c_uint32),
        ("step", ctypes.c_uint64),
        ("count", ctypes.c_uint64),
        ("time", ctypes.c_double),
        ("dt", ctypes.c_double),
        ("checksum", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name():
        return "tidewall.Header"


class Run:
    """This process as a participant of a run."""

    def __init__(self, role, prefix, root, silence):
        iox2.set_log_level(iox2.LogLevel.Fatal)
        config = iox2.config.default()
        config.global_cfg.prefix = iox2.FileName.new(prefix)
        config.global_cfg.root_path = iox2.Path.new(root)
        config.global_cfg.service.cleanup_dead_nodes_on_open = False
        config.global_cfg.node.cleanup_dead_nodes_on_creation = False
        config.global_cfg.node.cleanup_dead_nodes_on_destruction = False
        builder = iox2.NodeBuilder.new().config(config)
        builder = builder.signal_handling_mode(iox2.SignalHandlingMode.Disabled)
        self.node = builder.create(iox2.ServiceType.Ipc)
        self.role, self.silence = role, silence
        self.events = self.inbox(role)
        self.listener = self.events.listener_builder().create()

    def inbox(self, process):
        builder = self.node.service_builder(iox2.ServiceName.new(f"wake-{process}")).event()
        builder = builder.max_nodes(8).max_notifiers(8).max_listeners(1).event_id_max_value(7)
        builder = builder.disable_deadline().disable_notifier_created_event()
        builder = builder.disable_notifier_dropped_event().disable_notifier_dead_event()
        return builder.open_or_create()

    def sleep(self, peer, since, limit):
        """Until something happens; never endless."""
        events = self.listener.timed_wait(SLICE)
        if any(event.id == ABORT for event in events):
            raise Refused("the run was called off", 4)
        if not events and limit is not None and time.monotonic() - since > limit:
            raise Refused(f"no word from {peer} for {limit} s", 4)

    def control(self):
        return Link(self, "launcher", ctypes.c_uint8, CONTROL_BYTES, None)

    def connect(self, peer, capacity):
        return Link(self, peer, ctypes.c_double, capacity, self.silence)


class Link:
    """One duplex connection to one peer."""

    def __init__(self, run, peer, item, capacity, limit):
        self.run, self.peer, self.item, self.limit = run, peer, item, limit
        self.outgoing = self.channel(f"{run.role}-to-{peer}")
        self.incoming = self.channel(f"{peer}-to-{run.role}")
        self.receiver = self.incoming.subscriber_builder().buffer_size(POOL).create()
        builder = self.outgoing.publisher_builder().initial_max_slice_len(capacity)
        builder = builder.allocation_strategy(iox2.AllocationStrategy.Static)
        builder = builder.max_loaned_samples(POOL).override_sample_preallocation(POOL)
        self.sender = builder.create()
        self.wake = run.inbox(peer)
        self.bell = self.wake.notifier_builder().create()
        self.bell.notify_with_custom_event_id(ATTACHED)
        since = time.monotonic()
        while not (
            self.outgoing.dynamic_config.number_of_subscribers > 0
            and self.incoming.dynamic_config.number_of_publishers > 0
        ):
            run.sleep(peer, since, run.silence)
        self.sender.update_connections()

    def channel(self, name):
        builder = self.run.node.service_builder(iox2.ServiceName.new(name))
        builder = builder.publish_subscribe(iox2.Slice[self.item]).user_header(Header)
        builder = builder.payload_alignment(iox2.Alignment.new(64)).enable_safe_overflow(False)
        builder = builder.history_size(0).subscriber_max_buffer_size(POOL)
        builder = builder.subscriber_max_borrowed_samples(1)
        return builder.max_publishers(1).max_subscribers(1).max_nodes(2).open_or_create()

    def send(self, kind, step, at, payload):
        """`payload`: bytes of all items; `at`: (time, dt) in s."""
        count = len(payload) // ctypes.sizeof(self.item)
        sample = self.loan(count)
        ctypes.memmove(sample.payload_ptr, payload, len(payload))
        header = Header(MAGIC, VERSION, kind, step, count, at[0], at[1], zlib.crc32(payload))
        ctypes.memmove(sample.user_header_ptr, ctypes.byref(header), ctypes.sizeof(Header))
        sample.assume_init().send()
        self.bell.notify_with_custom_event_id(DATA)

    def loan(self, count):
        """A free sample, once the peer has given one back."""
        since = time.monotonic()
        while True:
            try:
                return self.sender.loan_slice_uninit(count)
            except iox2.LoanError:
                self.run.sleep(self.peer, since, self.run.silence)

    def receive(self, kind, step, count=None):
        """The payload of the message expected; anything else is refused."""
        since = time.monotonic()
        while (sample := self.receiver.receive()) is None:
            self.run.sleep(self.peer, since, self.limit)
        header = Header.from_buffer_copy(ctypes.string_at(sample.user_header_ptr, ctypes.sizeof(Header)))
        payload = ctypes.string_at(sample.payload_ptr, header.count * ctypes.sizeof(self.item))
        sample.delete()
        found = header.version if header.magic == MAGIC else 0
        if found != VERSION:
            raise Refused(f"protocol version of {self.peer}: expected {VERSION}, found {found}", 2)
        wanted = {"kind": (kind, header.kind), "step": (step, header.step)}
        wanted["values"] = (header.count if count is None else count, header.count)
        for name, (expected, found) in wanted.items():
            if expected != found:
                raise Refused(f"message from {self.peer}: expected {name} {expected}, found {found}", 4)
        if header.checksum != zlib.crc32(payload):
            raise Refused(f"checksum of the message from {self.peer} is wrong", 4)
        return payload

    def send_numbers(self, kind, step, at, values):
        """`values`: floats, all of them finite."""
        self.check(values)
        self.send(kind, step, at, struct.pack(f"<{len(values)}d", *values))

    def receive_numbers(self, kind, step, count=None):
        """The floats of the message expected, all of them finite."""
        payload = self.receive(kind, step, count)
        values = struct.unpack(f"<{len(payload) // 8}d", payload)
        self.check(values)
        return values

    def check(self, values):
        bad = next((index for index, value in enumerate(values) if not math.isfinite(value)), None)
        if bad is not None:
            raise Refused(f"value {bad} exchanged with {self.peer} is not finite", 3)


# Orders and replies: bincode's standard configuration.


def whole(number):
    if number < 251:
        return bytes([number])
    if number < 1 << 16:
        return b"\xfb" + struct.pack("<H", number)
    if number < 1 << 32:
        return b"\xfc" + struct.pack("<I", number)
    return b"\xfd" + struct.pack("<Q", number)


def real(number):
    return struct.pack("<d", number)


def text(words):
    return whole(len(words.encode())) + words.encode()


def table(entries, value):
    return whole(len(entries)) + b"".join(text(name) + value(entry) for name, entry in sorted(entries.items()))


class Reader:
    """Walks through an encoded order."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, form):
        (value,) = struct.unpack_from("<" + form, self.data, self.at)
        self.at += struct.calcsize(form)
        return value

    def whole(self):
        first = self.take("B")
        return first if first < 251 else self.take({251: "H", 252: "I", 253: "Q"}[first])

    def option(self):
        return self.whole() if self.take("B") else None

    def order(self):
        """(name, what belongs to it)."""
        match self.whole():
            case 0:
                return "start", (self.option(), self.option())
            case 1:
                step, at = self.whole(), (self.take("d"), self.take("d"))
                return "step", (step, at, [self.whole() for _ in range(self.whole())])
            case 2:
                return "output", None
            case _:
                return "stop", None


def hello(role, pid):
    return whole(0) + text(role) + whole(pid)


def ready(counts):
    return whole(1) + table(counts, whole) + real(float("inf"))


def done(shown):
    """A step without limit on the next one; `shown`: (name, value) for the progress line."""
    shown = b"\1" + text(shown[0]) + real(shown[1])
    return whole(2) + real(float("inf")) + whole(0) + shown + b"\0" + b"\0" + b"\0"


def account(cpu_s, peak_bytes, health):
    return whole(3) + whole(0) + real(cpu_s) + whole(peak_bytes) + table(health, real) + whole(0)


def failed(role, step, exit_code, what):
    kinds = {2: 0, 3: 1, 4: 2, 5: 3, 130: 4}
    failure = whole(kinds.get(exit_code, 5)) + text(role) + whole(step) + real(0.0) + text("exchange")
    return whole(4) + failure + text(what) + b"\0" + b"\0" + text("")
