"""Names of the arbitrator's counters (2413h), in its order: pdcp/pdcp_stats.h, firmware/arb_hostext.h
and firmware/arb_config.h."""

from collections.abc import Sequence
from typing import NamedTuple

from .model import Counter, Stats


class Group(NamedTuple):
    """A group of counters: its name, and name and meaning of each counter."""

    name: str
    counters: tuple[tuple[str, str], ...]


BUS = Group(
    "bus",
    (
        ("rx", "frames received"),
        ("tx", "frames sent"),
        ("tx_full", "frames lost because the transmit queue was full"),
        ("drop_extended", "dropped: 29-bit identifier"),
        ("drop_remote", "dropped: remote frame"),
        ("drop_error", "dropped: error report of the controller"),
        ("drop_fd", "dropped: CAN FD frame"),
        ("drop_unused_id", "dropped: identifier that the protocol does not use"),
        ("drop_arbitrator", "dropped: sent in the name of an arbitrator, but not by this one"),
        ("foreign_beacon", "beacons of another arbitrator"),
        ("drop_unknown_id", "dropped: from an id that is not bound"),
        ("drop_bad_dlc", "dropped: wrong number of data bytes"),
        ("drop_bad_code", "dropped: unknown function code, or no data"),
        ("drop_direction", "dropped: function code that a device must not send"),
        ("drop_deprecated", "dropped: deprecated function code"),
        ("drop_late", "dropped: answer that nobody waits for"),
        ("drop_binding", "dropped: binding frame that is no bind request"),
        ("channel_data", "frames of output channels"),
        ("bind_granted", "bind requests granted"),
        ("bind_suggested", "bind requests answered with another id"),
        ("bind_refused", "bind requests refused: no id or no place left"),
        ("bind_duplicate", "bind requests with the identity of a bound device"),
        ("requests", "requests to devices"),
        ("repeats", "requests repeated"),
        ("no_answer", "requests that were never answered"),
        ("bulk_restarts", "bulk transfers begun again"),
        ("setup_failed", "devices that could not be set up"),
        ("no_room", "channels that found their table full"),
        ("lost", "devices lost"),
        ("link_failed", "links that could not be made"),
        ("stranger_reset", "unbound devices told to reset"),
        ("taken", "frames that the arbitrator made use of"),
        ("drop_silent", "dropped: on standby"),
        ("tx_discarded", "frames discarded when the bus went off"),
        ("bus_off", "times off the bus"),
        ("audit", "parameters of channels that were not as they should be"),
    ),
)

HOST = Group(
    "host",
    (
        ("bytes_received", "bytes from the host"),
        ("bytes_sent", "bytes to the host"),
        ("requests", "requests received"),
        ("bytes_skipped", "bytes between messages"),
        ("bad_size", "headers with an impossible size"),
        ("bad_crc8", "messages with a wrong CRC8"),
        ("bad_crc16", "messages with a wrong CRC16"),
        ("given_up", "messages that stopped in the middle"),
        ("busy", "requests refused because four were held"),
        ("unknown", "requests with an unknown id"),
        ("events_sent", "events sent"),
        ("dropped_bound", "events dropped: device bound"),
        ("dropped_lost", "events dropped: device lost"),
        ("dropped_link", "events dropped: link changed"),
        ("dropped_configuration", "events dropped: configuration changed"),
        ("dropped_frame", "events dropped: CAN frame"),
        ("dropped_bus_state", "events dropped: bus state"),
        ("dropped_7", "events dropped: kind 7, which there is not yet"),
        ("dropped_8", "events dropped: kind 8, which there is not yet"),
        ("dropped_audit", "events dropped: audit"),
    ),
)

STORAGE = Group(
    "storage",
    (
        ("identities_failed", "writes of the identities that failed"),
        ("identities_damaged", "copies of the identities found damaged at the start"),
        ("flags_failed", "writes of the flags that failed"),
        ("flags_damaged", "copies of the flags found damaged at the start"),
        ("configuration_pages", "pages of configurations written"),
        ("configuration_writes", "times that configurations were stored"),
        ("configuration_unchanged", "times that they were what is stored already"),
        ("configuration_failures", "times that storing them failed"),
        ("configuration_damaged", "areas of configurations found damaged at the start"),
    ),
)

DRIVERS = Group(
    "drivers",
    (
        ("frames_lost", "received frames lost before the arbitrator took them"),
        ("frames_unsent", "frames that are known not to have left"),
        ("bytes_lost", "bytes from the host lost before the arbitrator took them"),
    ),
)

GROUPS = (BUS, HOST, STORAGE, DRIVERS)


def name_counters(group: int, values: Sequence[int]) -> Stats:
    """Puts names to the counters of a group. An arbitrator may have more, or fewer, than this package knows."""
    known = GROUPS[group] if group < len(GROUPS) else Group(f"group {group}", ())
    counters = []
    for at, value in enumerate(values):
        name, text = known.counters[at] if at < len(known.counters) else (f"counter_{at}", "")
        counters.append(Counter(name, value, text))
    return Stats(group, known.name, tuple(counters))
