"""Function codes of PDCP and what is in their frames (pdcp-bus.md 2)."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["FUNCTIONS", "Function", "Values", "code_class", "sizes_text", "split", "word_at"]


def word_at(data: bytes, at: int = 0, size: int = 2) -> int:
    """A little-endian number (D-BUS-1); missing bytes are 0."""
    return int.from_bytes(data[at : at + size], "little")


@dataclass(frozen=True, slots=True)
class Function:
    """What a function code stands for."""

    name: str
    sizes: tuple[int, ...]
    layout: tuple[tuple[str, int], ...] = ()  # name and bytes; 0: all that is left
    device: bool = False  # a device may send it
    arbitrator: bool = False


_IDENTITY = (("vid", 2), ("pid", 2), ("sn", 2))
_PARAMETER = (("parameter", 1), ("channel", 1))
_RESPONSE = (("response", 1),)
_VALUE = (("value", 0),)
_REST = (("rest", 0),)  # of the deprecated codes only the sizes are known
_SIZE = (("size", 2),)


def _range(low: int, high: int) -> tuple[int, ...]:
    return tuple(range(low, high + 1))


# The sizes of [PDCP 3.2]; one that only [PDCP 3.1] has stands behind (D-BUS-3).
FUNCTIONS = {
    0x01: Function("Bind Device Request", (7,), _IDENTITY, device=True),
    0x02: Function("GetDeviceInfo", (2,), _REST, arbitrator=True),
    0x03: Function("Get Device Parameter", (3,), _PARAMETER, arbitrator=True),
    0x04: Function("Set Device Parameter", _range(4, 7), _PARAMETER + _VALUE, arbitrator=True),
    0x05: Function("IndGetDeviceParameter", (4,), _REST, device=True),
    0x06: Function("IndSetDeviceParameter", _range(5, 8), _REST, device=True),
    0x07: Function("SetNodeId", (2,), _REST, arbitrator=True),
    0x08: Function("Suspend Device", (3,), (("time", 2),), arbitrator=True),
    0x09: Function("Release Device", (1,), arbitrator=True),
    0x0A: Function("Device Beacon", (1,), device=True, arbitrator=True),
    0x0B: Function("Reset Device", (1,), arbitrator=True),
    0x0C: Function("Configure Get Bulk Data Transfer", (3, 5), _PARAMETER + _SIZE, arbitrator=True),
    0x0D: Function("Configure Set Bulk Data Transfer", (5,), _PARAMETER + _SIZE, arbitrator=True),
    0x0E: Function("Bulk Data Transfer", _range(3, 8), (("packet", 1), ("data", 0)), device=True, arbitrator=True),
    0x0F: Function("Update Data Channel", (2,), (("channel", 1),), device=True),
    0x81: Function("Bind Device Response", (8,), (("node", 1), *_IDENTITY), arbitrator=True),
    0x82: Function("GetDeviceInfo Response", _range(2, 6), _REST, device=True),
    0x83: Function("Get Device Parameter Response", _range(4, 8), _RESPONSE + _PARAMETER + _VALUE, device=True),
    0x84: Function("Set Device Parameter Response", (5, 6, 7, 8, 4), _RESPONSE + _PARAMETER + _VALUE, device=True),
    0x85: Function("IndGetDeviceParameter Response", _range(4, 7), _REST, arbitrator=True),
    0x86: Function("IndSetDeviceParameter Response", (1,), arbitrator=True),
    0x87: Function("SetNodeId Response", (1,), device=True),
    0x88: Function("Suspend Device Response", (4, 1), _RESPONSE + (("time", 2),), device=True),
    0x89: Function("Release Device Response", (2, 1), _RESPONSE, device=True),
    0x8B: Function("Reset Device Response", (2, 1), _RESPONSE, device=True),
    0x8C: Function("Configure Get Bulk Data Transfer Response", (6,), _RESPONSE + _PARAMETER + _SIZE, device=True),
    0x8D: Function("Configure Set Bulk Data Transfer Response", (6,), _RESPONSE + _PARAMETER + _SIZE, device=True),
    0x8E: Function("Bulk Data Transfer Response", (2,), _RESPONSE, device=True, arbitrator=True),
    0x8F: Function("Update Data Channel Response", (3,), _RESPONSE + (("channel", 1),), arbitrator=True),
}


def code_class(code: int) -> str:
    """What a code without a function of its own is [PDCP 3.1]."""
    for low, high, name in (
        (0x10, 0x4F, "Reserved System Code"),
        (0x50, 0x7F, "Device-Specific Code"),
        (0x90, 0xCF, "Reserved System Response"),
        (0xD0, 0xFE, "Device-Specific Response"),
    ):
        if low <= code <= high:
            return name
    return "Unknown Code"


def sizes_text(sizes: tuple[int, ...]) -> str:
    ordered = sorted(sizes)
    if len(ordered) > 2 and ordered == list(range(ordered[0], ordered[-1] + 1)):
        return f"{ordered[0]} to {ordered[-1]} bytes"
    text = " or ".join(str(size) for size in ordered)
    return f"{text} byte" if ordered == [1] else f"{text} bytes"


class Values(dict[str, int]):
    """The numbers of a message by name, and the bytes at its end."""

    tail: bytes = b""


def split(function: Function, data: bytes) -> Values:
    """The fields that are there, by name."""
    values = Values()
    at = 1
    for name, size in function.layout:
        if size == 0:
            values.tail = data[at:]
        elif len(data) >= at + size:
            values[name] = word_at(data, at, size)
        at += size
    return values
