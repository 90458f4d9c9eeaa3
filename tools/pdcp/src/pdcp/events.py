"""What the arbitrator tells unasked, once a host has asked for the stream (2416h, 2419h)."""

import struct
from dataclasses import dataclass

from .messages import EventMessage, FormatError
from .model import ChannelId, Identity, LinkStatus
from .protocol import BusState, EventKind

__all__ = [
    "ALL_KINDS",
    "QUIET_KINDS",
    "AuditDifference",
    "BusState",
    "BusStateChanged",
    "CanFrame",
    "ConfigurationChanged",
    "DeviceBound",
    "DeviceLost",
    "Event",
    "EventKind",
    "LinkChanged",
    "UnknownEvent",
    "parse",
]


ALL_KINDS = frozenset(EventKind)
QUIET_KINDS = ALL_KINDS - {EventKind.CAN_FRAME}  # all that a person can follow


@dataclass(frozen=True, slots=True)
class Event:
    """Any event; time_ms is the arbitrator's clock, which wraps after 49 days."""

    kind: int
    time_ms: int


@dataclass(frozen=True, slots=True)
class DeviceBound(Event):
    identity: Identity
    node_id: int


@dataclass(frozen=True, slots=True)
class DeviceLost(Event):
    identity: Identity
    node_id: int


@dataclass(frozen=True, slots=True)
class LinkChanged(Event):
    output: ChannelId
    input: ChannelId
    status: LinkStatus


@dataclass(frozen=True, slots=True)
class ConfigurationChanged(Event):
    """active: the active configuration, 0 for none; stored: how many there are."""

    active: int
    stored: int


@dataclass(frozen=True, slots=True)
class CanFrame(Event):
    can_id: int
    data: bytes


@dataclass(frozen=True, slots=True)
class BusStateChanged(Event):
    state: BusState
    transmit_errors: int
    receive_errors: int


@dataclass(frozen=True, slots=True)
class AuditDifference(Event):
    """A channel did not have what the arbitrator's tables say in this parameter; it is repaired (D-BUS-40)."""

    channel: ChannelId
    parameter: int


@dataclass(frozen=True, slots=True)
class UnknownEvent(Event):
    """A kind that this package does not know."""

    data: bytes


def _device(data: bytes) -> tuple[Identity, int]:
    vid, pid, sn, node_id = struct.unpack("<HHHB", data)
    return Identity(vid, pid, sn), node_id


def _link(data: bytes) -> tuple[ChannelId, ChannelId, LinkStatus]:
    fields = struct.unpack("<HHHBHHHBB", data)
    output = ChannelId(Identity(*fields[0:3]), fields[3])
    return output, ChannelId(Identity(*fields[4:7]), fields[7]), LinkStatus(fields[8])


def _frame(data: bytes) -> tuple[int, bytes]:
    can_id, dlc = struct.unpack_from("<HB", data)
    if dlc > 8 or len(data) != 3 + dlc:
        raise ValueError
    return can_id, data[3:]


def _bus_state(data: bytes) -> tuple[BusState, int, int]:
    state, transmit_errors, receive_errors = struct.unpack("<BBB", data)
    return BusState(state), transmit_errors, receive_errors


def _audit(data: bytes) -> tuple[ChannelId, int]:
    *identity, index, parameter = struct.unpack("<HHHBB", data)
    return ChannelId(Identity(*identity), index), parameter


def parse(message: EventMessage) -> Event:
    """What an event message says. Raises FormatError when its data do not fit its kind."""
    kind, time_ms, data = message.kind, message.time_ms, message.data
    try:
        match kind:
            case EventKind.DEVICE_BOUND:
                return DeviceBound(kind, time_ms, *_device(data))
            case EventKind.DEVICE_LOST:
                return DeviceLost(kind, time_ms, *_device(data))
            case EventKind.LINK_CHANGED:
                return LinkChanged(kind, time_ms, *_link(data))
            case EventKind.CONFIGURATION_CHANGED:
                active, stored = data
                return ConfigurationChanged(kind, time_ms, active, stored)
            case EventKind.CAN_FRAME:
                return CanFrame(kind, time_ms, *_frame(data))
            case EventKind.BUS_STATE:
                return BusStateChanged(kind, time_ms, *_bus_state(data))
            case EventKind.AUDIT:
                return AuditDifference(kind, time_ms, *_audit(data))
            case _:
                return UnknownEvent(kind, time_ms, data)
    except (struct.error, ValueError):
        raise FormatError(f"an event of kind {kind} cannot be {data.hex(' ') or 'empty'}") from None
